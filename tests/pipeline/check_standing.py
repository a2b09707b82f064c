"""check_standing.py ARCHIVE CLIPS ACTIONS - canonical clips judged by a forward kinematics of our own.

ACTIONS: comma-separated values of the attribute `action` whose clips must travel forward.
"""
import sys

import h5py
import numpy as np

archive, expected, forward = sys.argv[1], int(sys.argv[2]), sys.argv[3].split(",")
f = h5py.File(archive)
names = [n.decode() for n in f["skeleton/joint_names"][:]]
parents, offsets = f["skeleton/parents"][:], f["skeleton/rest_offsets"][:].astype(float)
at = {n: i for i, n in enumerate(names)}
start, length = f["clips/start"][:], f["clips/length"][:]
actions = [a.decode() for a in f["clips/attributes/action"][:]]
assert len(start) == expected, (len(start), expected)


def multiply(a, b):
    aw, av, bw, bv = a[..., :1], a[..., 1:], b[..., :1], b[..., 1:]
    return np.concatenate([aw * bw - (av * bv).sum(-1, keepdims=True), aw * bv + bw * av + np.cross(av, bv)], -1)


def rotate(q, v):
    t = 2 * np.cross(q[..., 1:], v)
    return v + q[..., :1] * t + np.cross(q[..., 1:], t)


def positions(i):
    rows = slice(start[i], start[i] + length[i])
    q, root = f["frames/rotations"][rows].astype(float), f["frames/root_position"][rows].astype(float)
    world, p = [q[:, 0]], [root]
    for j in range(1, len(names)):
        k = parents[j]
        p.append(p[k] + rotate(world[k], np.broadcast_to(offsets[j], root.shape)))
        world.append(multiply(world[k], q[:, j]))
    return np.stack(p, 1)


def contacts(i):
    return f["frames/contacts"][start[i] : start[i] + length[i]]


problems, wanderers = [], []
for i in range(len(start)):
    p = positions(i)
    clip = f["clips/name"][i].decode()
    joint = lambda n: p[:, at[n]]
    say = lambda what: problems.append(f"{clip} ({actions[i]}): {what}")
    if not np.isfinite(p).all():
        say("positions that are not finite")
    if np.abs(p[0, 0, :2]).max() > 1e-5:
        say(f"starts at {p[0, 0]}")
    across = joint("left_hip") - joint("right_hip") + joint("left_shoulder") - joint("right_shoulder")
    facing = np.stack([across[:, 1], -across[:, 0]], 1)
    norm = np.linalg.norm(facing, axis=1)
    if norm[0] > 0.05 and facing[0, 0] / norm[0] < 0.999:
        say(f"first frame faces {facing[0] / norm[0]}")
    lowest = np.minimum(joint("left_foot"), joint("right_foot"))[:, 2].min()
    if not -0.25 < lowest < 0.12:  # some trials step off a kerb or walk on uneven ground
        say(f"lowest toe base at {lowest:.3f} m")
    if actions[i] not in forward:
        continue
    # Upright walkers and runners: order of heights, knees bending backwards, travel along the facing, toes ahead.
    if (joint("head")[:, 2] < joint("pelvis")[:, 2] + 0.3).mean() > 0.01 or (joint("pelvis")[:, 2] < joint("left_knee")[:, 2]).mean() > 0.01:
        say("not upright")
    for side in ("left", "right"):
        hinge = np.cross(joint(f"{side}_knee") - joint(f"{side}_hip"), joint(f"{side}_ankle") - joint(f"{side}_knee"))
        bend = (hinge * across).sum(-1) / (np.linalg.norm(across, axis=-1) + 1e-9)
        if (bend < -0.02).mean() > 0.02:
            say(f"{side} knee bends forward in {100 * (bend < -0.02).mean():.0f} % of the frames")
        toe = (joint(f"{side}_foot") - joint(f"{side}_ankle"))[:, :2]
        down = contacts(i)[:, int(side == "right")] > 0  # a foot in the air may point anywhere
        if down.any() and ((toe * facing).sum(-1) > 0)[down].mean() < 0.95:
            say(f"{side} toes point backwards on the ground")
    step = np.diff(p[:, 0, :2], axis=0)
    if np.linalg.norm(p[-1, 0, :2]) > 0.5 and (step * facing[:-1] / norm[:-1, None]).sum() < 0.7 * np.linalg.norm(step, axis=1).sum():
        wanderers.append(clip)

# A trial or two of "walking" go backwards and sideways on purpose; a wrong facing would show in all of them.
if len(wanderers) > 0.05 * sum(a in forward for a in actions):
    problems.append(f"do not travel where they face: {', '.join(wanderers)}")
print(f"{archive}: {len(start)} clips, {len(problems)} problems")
for line in problems:
    print("  " + line)
sys.exit(bool(problems))
