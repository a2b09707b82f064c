"""asf_pairs.py PAIRS.tsv AMC_FOLDER BVH_FOLDER - one motion read from two formats, by a forward kinematics of our own.

Joints correspond by their place in the tree (root~Hips, lfemur~LeftUpLeg, ...). World rotations within 0.1 degree; joint
positions within 1 mm with both motions on one skeleton, the ASF's and the BVH's in turn. The skeletons themselves agree
within the BVH's print precision but for one thing: the published BVH has OFFSET 0 0 0 below bones with several children,
the thorax and the wrists, and so loses the length of these bones; nothing else may differ.
"""
import csv
import sys

import numpy as np

pairs, amc_folder, bvh_folder = sys.argv[1:4]


def matrices(v):
    angle = np.linalg.norm(v, axis=-1)[..., None, None]
    x, y, z = np.moveaxis(v / np.maximum(angle[..., 0], 1e-300), -1, 0)
    zero = np.zeros_like(x)
    k = np.stack([np.stack([zero, -z, y], -1), np.stack([z, zero, -x], -1), np.stack([-y, x, zero], -1)], -2)
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * (k @ k)


class Motion:
    def __init__(self, path):
        z = np.load(path)
        self.names, self.parents, self.offsets = list(z["joint_names"]), z["parents"], z["rest_offsets"]
        self.ends, self.end_parents = z["end_sites"], z["end_parents"]
        self.local, self.root = matrices(z["poses"].reshape(len(z["poses"]), -1, 3)), z["trans"]
        self.rate = float(z["mocap_framerate"])

    def world(self):
        r = []
        for j, k in enumerate(self.parents):
            r.append(self.local[:, j] if k < 0 else r[k] @ self.local[:, j])
        return r

    def positions(self, skeleton):
        r, p = self.world(), []
        for j, k in enumerate(self.parents):
            p.append(self.root if k < 0 else p[k] + r[k] @ skeleton.offsets[j])
        return np.stack(p + [p[k] + r[k] @ e for e, k in zip(skeleton.ends, skeleton.end_parents)], 1)


problems, worst = [], {"angle": 0.0, "on_asf": 0.0, "on_bvh": 0.0, "as_is": 0.0, "offset": 0.0}
lost, rows = {}, list(csv.DictReader(open(pairs), delimiter="\t"))
for row in rows:
    stem = row["amc"][:-4]
    a, b = Motion(f"{amc_folder}/{stem}.npz"), Motion(f"{bvh_folder}/{stem}.npz")
    say = lambda what: problems.append(f"{stem}: {what}")
    if len(a.root) != int(row["amc_frames"]) or len(b.root) != len(a.root):
        say(f"{len(a.root)} and {len(b.root)} frames, expected {row['amc_frames']}")
        continue
    if list(a.parents) != list(b.parents) or list(a.end_parents) != list(b.end_parents):
        say("two hierarchies")
        continue
    if a.rate != b.rate:
        say(f"{a.rate} and {b.rate} Hz")
    children = np.bincount(a.parents[1:], minlength=len(a.parents))
    for j in range(1, len(a.parents)):
        difference = np.linalg.norm(a.offsets[j] - b.offsets[j])
        if difference > 1e-5 and not b.offsets[j].any() and children[a.parents[j]] > 1 and a.parents[j] > 0:
            lost.setdefault(a.names[a.parents[j]], set()).add(round(1000 * difference, 1))
        else:
            worst["offset"] = max(worst["offset"], difference)
    worst["offset"] = max(worst["offset"], np.linalg.norm(a.ends - b.ends, axis=-1).max())
    chord = max(np.linalg.norm(x - y, axis=(-2, -1)).max() for x, y in zip(a.world(), b.world()))
    worst["angle"] = max(worst["angle"], np.degrees(2 * np.arcsin(chord / np.sqrt(8))))
    for key, skeletons in (("on_asf", (a, a)), ("on_bvh", (b, b)), ("as_is", (a, b))):
        d = np.linalg.norm(a.positions(skeletons[0]) - b.positions(skeletons[1]), axis=-1)
        worst[key] = max(worst[key], d.max())

for key, limit in (("angle", 0.1), ("on_asf", 1e-3), ("on_bvh", 1e-3), ("offset", 1e-5)):
    if not worst[key] < limit:
        problems.append(f"{key}: {worst[key]}, expected less than {limit}")
if not set(lost) <= {"thorax", "lwrist", "rwrist"}:
    problems.append(f"the BVH lacks the length of {sorted(lost)}")
print(f"{len(rows)} pairs: world rotations within {worst['angle']:.1e} degree; joints and tips within {1e3 * worst['on_asf']:.4f} mm on the "
      f"ASF's skeleton, {1e3 * worst['on_bvh']:.4f} mm on the BVH's; offsets within {1e3 * worst['offset']:.4f} mm")
print(f"with each on its own skeleton {1e3 * worst['as_is']:.1f} mm: the BVH has offset 0 below " + ", ".join(
    f"{bone} ({min(mm)} to {max(mm)} mm)" for bone, mm in sorted(lost.items())))
for line in problems:
    print("  " + line)
sys.exit(bool(problems))
