#!/usr/bin/env python3
"""Motion with known truth before and after denoising, beside a Savitzky-Golay filter of rotations and root positions.

    denoising-figures.py CLEAN.h5 NOISY.h5 [DENOISED.h5 ...] [--manifest pairs/manifest.tsv]

For each archive (clips of equal names and lengths as CLEAN's), means over all clips:
  mm     distance of the joints in the world to the truth, after the turn about Z and the shift that fit a clip best (canonicalize starts each
         clip by its own first frame, which is noisy); mm_root: of the root alone; mm_pose: of joints from their own root, in its heading
  jerk   third difference of joint positions times rate cubed, m/s^3
  skate  m/s: horizontal speed of ankles and toe bases while under 0.06 m in both frames (fid-eval's skate_mps takes the lowest joints alike)
  peak   99.9 % quantile of joint speeds, share of the truth's
With the manifest of `make-corpus --noise` a second table:
  mm     as above; its 99 % quantile and its largest over frames and joints
  spikes, dropouts   mm over the frames that they last, of the joints that they displace (below the joint; all for the position of the root), and degrees of the joint's own rotation; mean over events
  hands, feet        speed of wrists and toe bases where the truth's is greatest (one frame either way), share of it
Needs h5py, NumPy, SciPy.
"""
import argparse
import csv

import h5py
import numpy as np
from motion_archive import joint_positions, product
from scipy.signal import savgol_filter


class Archive:
    def __init__(self, path):
        f = h5py.File(path)
        names = [n.decode() if isinstance(n, bytes) else n for n in f["clips/name"][()]]
        self.rate = float(f.attrs.get("frame_rate_hz", 30))
        self.parents, self.offsets = f["skeleton/parents"][()], f["skeleton/rest_offsets"][()].astype(float)
        self.joints = [n.decode() for n in f["skeleton/joint_names"][()]]
        rotations, positions = f["frames/rotations"][()].astype(float), f["frames/root_position"][()].astype(float)
        self.clips = {n: (rotations[s:s + k], positions[s:s + k]) for n, s, k in zip(names, f["clips/start"][()], f["clips/length"][()])}

    def positions(self, rotations, root):
        return np.stack(joint_positions(self.parents, self.offsets, rotations, root), 1)


def smoothed(clip, window):
    q, p = (savgol_filter(x, window, 3, axis=0) for x in clip)
    return q / np.linalg.norm(q, axis=-1, keepdims=True), p


def heading_free(x, q):
    psi = 2 * np.arctan2(q[:, 0, 3], q[:, 0, 0])
    c, s = np.cos(psi)[:, None], np.sin(psi)[:, None]
    d = x - x[:, :1]
    return np.stack([c * d[..., 0] + s * d[..., 1], -s * d[..., 0] + c * d[..., 1], d[..., 2]], -1)


def aligned(x, y):
    """x turned about Z and shifted so that all its joints lie nearest to those of y."""
    a, b = x[..., :2] - x[..., :2].mean((0, 1)), y[..., :2] - y[..., :2].mean((0, 1))
    turn = np.arctan2((a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]).sum(), (a * b).sum())
    c, s = np.cos(turn), np.sin(turn)
    ground = np.stack([c * a[..., 0] - s * a[..., 1], s * a[..., 0] + c * a[..., 1]], -1) + y[..., :2].mean((0, 1))
    return np.concatenate([ground, x[..., 2:]], -1)


def figures(archive, clips, truth):
    feet = [i for i, n in enumerate(archive.joints) if n.lower().endswith(("foot", "toe", "toes", "toebase", "ankle"))]
    rows = []
    for name, clip in clips.items():
        x, y = archive.positions(*clip), archive.positions(*truth[name])
        d = np.linalg.norm(aligned(x, y) - y, axis=-1)
        speed = lambda z: np.quantile(np.linalg.norm(np.diff(z, axis=0), axis=-1), 0.999)
        f = x[:, feet]
        low = (f[1:, :, 2] < 0.06) & (f[:-1, :, 2] < 0.06)
        slide = np.linalg.norm(np.diff(f[..., :2], axis=0), axis=-1) * archive.rate
        jerk = np.linalg.norm(np.diff(x, 3, axis=0), axis=-1).mean() * archive.rate ** 3
        pose = np.linalg.norm(heading_free(x, clip[0]) - heading_free(y, truth[name][0]), axis=-1)
        rows.append([1000 * d.mean(), 1000 * d[:, 0].mean(), 1000 * pose.mean(), jerk, slide[low].mean() if low.any() else np.nan, 100 * speed(x) / speed(y)])
    return np.nanmean(rows, 0)


def read_manifest(path, archive):
    """Clip name -> [(kind, joint index or -1, frames)]."""
    events = {}
    for row in csv.DictReader(open(path), delimiter="\t"):
        if row["kind"] == "jitter":
            continue
        name = row["file"].rsplit(".", 1)[0]
        frames = np.arange(np.ceil(float(row["start"]) * archive.rate - 1e-6), np.ceil(float(row["end"]) * archive.rate - 1e-6)).astype(int)
        if name in archive.clips and len(frames := frames[frames < len(archive.clips[name][1])]):
            events.setdefault(name, []).append((row["kind"], -1 if row["joint"] == "position" else archive.joints.index(row["joint"]), frames))
    return events


def below(archive, joint):
    inside = [joint < 0] * len(archive.joints)
    for j, p in enumerate(archive.parents):
        inside[j] = inside[j] or p == joint or (p >= 0 and inside[p])
    return [j for j, i in enumerate(inside) if i]


def event_figures(archive, clips, truth, events):
    ends = {k: [i for i, n in enumerate(archive.joints) if n.lower().endswith(v)] for k, v in {"hands": ("wrist", "hand"), "feet": ("foot", "toe", "toes", "toebase")}.items()}
    distances, at = [], {(k, u): [] for k in ("spike", "dropout") for u in ("mm", "deg")}
    kept = {k: [] for k in ends}
    for name, clip in clips.items():
        x, y = archive.positions(*clip), archive.positions(*truth[name])
        d = 1000 * np.linalg.norm(aligned(x, y) - y, axis=-1)
        distances.append(d)
        for kind, joint, frames in events.get(name, []):
            moved = below(archive, joint)
            if moved:
                at[kind, "mm"].append(d[np.ix_(frames, moved)].mean())
            if joint >= 0:
                p, q = clip[0][frames, joint], truth[name][0][frames, joint]
                between = product(p * [1, -1, -1, -1], q) if joint else None
                if joint:
                    at[kind, "deg"].append(np.degrees(2 * np.arctan2(np.linalg.norm(between[:, 1:], axis=-1), np.abs(between[:, 0]))).mean())
        for k, joints in ends.items():
            for j in joints:
                v, w = (np.linalg.norm(np.diff(z[:, j], axis=0), axis=-1) for z in (x, y))
                t = w.argmax()
                kept[k].append(100 * v[max(0, t - 1):t + 2].max() / w[t])
    d = np.concatenate([d.ravel() for d in distances])
    return [d.mean(), np.quantile(d, 0.99), d.max(), *(np.mean(at[k, u]) if at[k, u] else np.nan for k in ("spike", "dropout") for u in ("mm", "deg")), *(np.mean(kept[k]) for k in ends)]


parser = argparse.ArgumentParser(usage=__doc__)
parser.add_argument("archives", nargs="+")
parser.add_argument("--manifest")
parser.add_argument("--windows", type=int, nargs="*", default=[5, 7, 9, 11], help="of the filter")
arguments = parser.parse_args()
clean, noisy = Archive(arguments.archives[0]), Archive(arguments.archives[1])
all_clips = [("truth", clean.clips), ("noisy", noisy.clips)]
for window in (5, 7, 9, 11):
    if window in arguments.windows: all_clips.append(("Savitzky-Golay, %d frames" % window, {n: smoothed(c, window) for n, c in noisy.clips.items()}))
all_clips += [(path, Archive(path).clips) for path in arguments.archives[2:]]
print("%-28s%9s%9s%9s%9s%9s%9s" % ("", "mm", "mm_root", "mm_pose", "jerk", "skate", "peak %"))
for name, clips in all_clips:
    print("%-28s%9.2f%9.2f%9.2f%9.0f%9.3f%9.1f" % (name, *figures(clean, clips, clean.clips)))
if arguments.manifest:
    events = read_manifest(arguments.manifest, clean)
    print("\n%-28s%9s%9s%9s%9s%9s%9s%9s%9s%9s" % ("", "mm", "99 %", "largest", "spikes", "deg", "dropouts", "deg", "hands %", "feet %"))
    for name, clips in all_clips:
        print("%-28s%9.2f%9.1f%9.0f%9.1f%9.2f%9.1f%9.2f%9.1f%9.1f" % (name, *event_figures(clean, clips, clean.clips, events)))
