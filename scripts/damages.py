#!/usr/bin/env python3
"""damages.py BIN CLEAN.h5 REAL.h5 [options of fid-eval ...] - which figures of fid-eval see which damage.

CLEAN holds real clips on the canonical body that stand for generated ones. Each damage is done to a copy of them, all copies are judged against REAL with the options given, and
a table is printed (Markdown): some figures, and in the last column every figure whose 95 % interval is apart from that of the undamaged clips.
Needs numpy and h5py. KEEP=DIR keeps the archives and reports there. SEED=1 is that of the noise and of fid-eval.
"""
import json
import os
import subprocess
import sys
import tempfile

import h5py
import numpy as np

SHOWN = ["fid", "kid", "precision", "recall", "within_class_variance", "multimodality", "skate_mps", "energy", "frozen_share", "exploding_share", "nearest_training"]


def unit(q):
    return q / np.linalg.norm(q, axis=-1, keepdims=True)


def times(a, b):  # Hamilton product, wxyz
    aw, av, bw, bv = a[..., :1], a[..., 1:], b[..., :1], b[..., 1:]
    return np.concatenate([aw * bw - (av * bv).sum(-1, keepdims=True), aw * bv + bw * av + np.cross(av, bv)], -1)


def between(q, p, at):  # frames at fractional times; neighbours have one sign, so the chord is near the arc
    i = np.minimum(np.floor(at).astype(int), len(q) - 1)
    j, u = np.minimum(i + 1, len(q) - 1), at - i
    return unit(q[i] + u[:, None, None] * (q[j] - q[i])), p[i] + u[:, None] * (p[j] - p[i])


def none(a):
    pass


def mean_pose(a):
    q, p = a.q, a.p
    local = q[:, 1:]
    local = unit(np.mean(local * np.where((local * local[:1]).sum(-1, keepdims=True) < 0, -1, 1), 0))
    q[:, 0], q[:, 1:] = [1, 0, 0, 0], local
    p[:, :2], p[:, 2] = 0, p[:, 2].mean()


def one_clip(a):  # the longest of each combination of labels in place of all of them
    q, p = a.q.copy(), a.p.copy()
    for label in set(a.labels):
        clips = [c for c, l in zip(a.clips, a.labels) if l == label]
        best = max(clips, key=lambda c: c.stop - c.start)
        for c in clips:
            n = c.stop - c.start
            a.q[c], a.p[c] = q[best.start:best.start + n], p[best.start:best.start + n]


def noise(a):  # 0.1 rad about each axis, every joint, every frame
    r = a.random.normal(0, 0.1, a.q.shape[:2] + (3,)) / 2
    a.q[:] = unit(times(a.q, unit(np.concatenate([np.ones(r.shape[:2] + (1,)), r], -1))))


def reversed_time(a):
    for c in a.clips:
        a.q[c], a.p[c] = a.q[c][::-1].copy(), a.p[c][::-1].copy()


def mirrored(a):
    names = [n.decode() for n in a.file["skeleton/joint_names"][()]]
    other = [names.index("right_" + n[5:] if n.startswith("left_") else "left_" + n[6:] if n.startswith("right_") else n) for n in names]
    a.q[:] = a.q[:, other] * np.array([1, -1, 1, -1])  # the canonical rest pose has no turned joint frames
    a.p[:] = a.p * np.array([1, -1, 1])


def slide(a):  # 0.5 m/s to the left
    for c in a.clips:
        a.p[c, 1] += 0.5 / a.rate * np.arange(c.stop - c.start)


def half_speed(a):
    for c in a.clips:
        a.q[c], a.p[c] = between(a.q[c].copy(), a.p[c].copy(), np.arange(c.stop - c.start) / 2)


DAMAGES = {"none": none, "frozen in the mean pose": mean_pose, "one clip of each class repeated": one_clip, "white noise on the joints, 0.1 rad": noise, "reversed time": reversed_time,
           "mirrored": mirrored, "feet slide at 0.5 m/s": slide, "half speed": half_speed}


class Archive:
    def __init__(self, path, seed):
        self.file = h5py.File(path, "r+")
        self.q, self.p = self.file["frames/rotations"][()].astype(float), self.file["frames/root_position"][()].astype(float)
        self.rate = self.file.attrs["frame_rate_hz"]
        self.clips = [slice(s, s + n) for s, n in zip(self.file["clips/start"][()], self.file["clips/length"][()])]
        attributes = self.file["clips/attributes"]
        self.labels = list(zip(*[attributes[k][()] for k in attributes if k in ("action", "style", "gender")])) or [()] * len(self.clips)
        self.random = np.random.RandomState(seed)

    def close(self):
        self.file["frames/rotations"][()], self.file["frames/root_position"][()] = self.q, self.p
        self.file.close()


def judge(tool, path, real, options, seed):
    run = subprocess.run([tool, path, "--real", real, "--json", "--seed", str(seed)] + options, stdout=subprocess.PIPE)
    if run.returncode:
        sys.exit(f"damages.py: fid-eval {path}: status {run.returncode}")
    return json.loads(run.stdout)


def seen(report, clean):
    out = []
    for key in report:
        name = key[:-6]
        if not key.endswith(".value") or ".real" in name or "floor" in name or "bound" in name:
            continue
        mine, theirs = [report[name + e] for e in (".low", ".high")], [clean[name + e] for e in (".low", ".high")]
        if None not in mine + theirs and (mine[0] > theirs[1] or mine[1] < theirs[0]):
            out.append(name)
    return out


def main():
    if len(sys.argv) < 4:
        sys.exit(__doc__.splitlines()[0])
    binaries, source, real, options = sys.argv[1], sys.argv[2], sys.argv[3], sys.argv[4:]
    seed = int(os.environ.get("SEED", "1"))
    with tempfile.TemporaryDirectory() as work:
        work = os.environ.get("KEEP") or work
        os.makedirs(work, exist_ok=True)
        clean, rows = None, []
        for name, damage in DAMAGES.items():
            stem = os.path.join(work, name.split(",")[0].replace(" ", "-").replace("/", "-"))
            with open(source, "rb") as f, open(stem + ".h5", "wb") as out:
                out.write(f.read())
            archive = Archive(stem + ".h5", seed)
            damage(archive)
            archive.close()
            report = judge(os.path.join(binaries, "fid-eval"), stem + ".h5", real, options, seed)
            with open(stem + ".json", "w") as f:
                json.dump(report, f, indent=1)
            if clean is None:
                clean = report
                shown = [n for n in SHOWN + [k[:-6] for k in report if k.startswith("accuracy.") and k.endswith(".value") and ".real" not in k] if n + ".value" in report]
                print("| damage | " + " | ".join(shown) + " | figures that see it |\n|" + "---|" * (len(shown) + 2))
            value = lambda n: "-" if report[n + ".value"] is None else "%.3g" % report[n + ".value"] if abs(report[n + ".value"]) < 1000 else "{:,.0f}".format(report[n + ".value"])
            names = seen(report, clean)
            print(f"| {name} | " + " | ".join(value(n) for n in shown) + " | " + (", ".join(names) if names else "" if damage is none else "nothing") + " |", flush=True)


main()
