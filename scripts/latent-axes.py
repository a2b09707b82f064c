#!/usr/bin/env python3
"""What each axis of a latent space moves: heights of joints, angles at joints, stance and travel, measured on motions sampled along it.

    latent-axes.py MODEL.h5 [-n LATENTS] [--seed N] [--top N] [--bin DIR] [--axes 1,2,24] [--tsv FILE]

For every axis `sample --latent-axis` makes LATENTS (32) rows of nine motions, element K of each drawn latent at the quantiles 0.1 to 0.9 of N(0, 1). Of each motion, means over its frames:
  height   m, of hands, elbows, head, pelvis and feet over the ground
  angle    degrees, between the bones at knees, elbows, hips (thigh and spine), shoulders (upper arm and spine): 0 straight for knees and elbows
  lean     degrees of the line from pelvis to neck from the vertical
  stance   m, between the feet on the ground
  speed    m/s of the root; turn, degrees/s, counter-clockwise
An axis's effect on a measure is the mean over latents of its value at 0.9 less that at 0.1; `of spread` is it in deviations that the measure has among all motions drawn, `same way` the
share of latents in which it goes the way of the mean. The table lists for each axis the measures with the greatest effect in spreads, then how many deviations all of them together move
(root mean square): axes that move nothing are those that the encoder does not use.
Needs h5py, NumPy.
"""
import argparse
import os
import subprocess
import sys
import tempfile

import h5py
import numpy as np
from motion_archive import fail, joint_positions

QUANTILES = "0.1:0.9:0.1"


def angle(a, b):
    return np.degrees(np.arccos(np.clip((a * b).sum(-1) / np.maximum(1e-9, np.linalg.norm(a, axis=-1) * np.linalg.norm(b, axis=-1)), -1, 1)))


def measures(path):
    """(clips, measures) and their names, of an archive whose clips have one length."""
    with h5py.File(path) as f:
        names = [n.decode() for n in f["skeleton/joint_names"][()]]
        parents, offsets = f["skeleton/parents"][()], f["skeleton/rest_offsets"][()].astype(float)
        q, root, rate = f["frames/rotations"][()].astype(float), f["frames/root_position"][()].astype(float), float(f.attrs["frame_rate_hz"])
        lengths = f["clips/length"][()]
    at = dict(zip(names, joint_positions(parents, offsets, q, root)))
    up = at["neck"] - at["pelvis"]
    out = {}
    for name, joint in [("hand", "wrist"), ("elbow", "elbow"), ("foot", "foot")]:
        for side in ("left", "right"):
            out[f"{side} {name} height m"] = at[f"{side}_{joint}"][:, 2]
    out["head height m"], out["pelvis height m"] = at["head"][:, 2], at["pelvis"][:, 2]
    for side in ("left", "right"):
        p = {k: at[f"{side}_{k}"] for k in ("hip", "knee", "ankle", "shoulder", "elbow", "wrist", "foot")}
        out[f"{side} knee angle deg"] = angle(p["knee"] - p["hip"], p["ankle"] - p["knee"])
        out[f"{side} elbow angle deg"] = angle(p["elbow"] - p["shoulder"], p["wrist"] - p["elbow"])
        out[f"{side} hip angle deg"] = angle(p["knee"] - p["hip"], -up)
        out[f"{side} shoulder angle deg"] = angle(p["elbow"] - p["shoulder"], -up)
    out["lean deg"] = angle(up, np.array([0, 0, 1.0]))
    out["stance m"] = np.linalg.norm((at["left_foot"] - at["right_foot"])[:, :2], axis=-1)
    heading = 2 * np.arctan2(q[:, 0, 3], q[:, 0, 0])
    step, turn = np.zeros(len(root)), np.zeros(len(root))
    step[1:] = np.linalg.norm(np.diff(root[:, :2], axis=0), axis=-1) * rate
    turn[1:] = np.degrees((np.diff(heading) + np.pi) % (2 * np.pi) - np.pi) * rate
    starts = np.concatenate([[0], np.cumsum(lengths)[:-1]])
    step[starts] = step[np.minimum(starts + 1, len(step) - 1)]
    turn[starts] = turn[np.minimum(starts + 1, len(turn) - 1)]
    out["speed m/s"], out["turn deg/s"] = step, turn
    values = np.stack([np.add.reduceat(v, starts) / lengths for v in out.values()], 1)
    return values, list(out)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0], formatter_class=argparse.RawDescriptionHelpFormatter, epilog="\n".join(__doc__.split("\n")[1:]))
    parser.add_argument("model")
    parser.add_argument("-n", type=int, default=32, help="latents drawn")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--top", type=int, default=3, help="measures listed for each axis")
    parser.add_argument("--axes", help="only these, such as 1,2,24")
    parser.add_argument("--bin", default="", help="folder of the tools (default: PATH)")
    parser.add_argument("--tsv", help="all effects as a table")
    o = parser.parse_args()
    sample = os.path.join(o.bin, "sample") if o.bin else "sample"
    try:
        with h5py.File(o.model) as f:
            latent = f["weights/vae/decoder_0_weight"].shape[1]
    except (OSError, KeyError):
        fail(f"{o.model}: no model of kind cae-vae, expected one that train-vae makes")
    axes = [int(a) for a in o.axes.split(",")] if o.axes else range(1, latent + 1)
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        archive = os.path.join(folder, "axis.h5")
        for axis in axes:
            done = subprocess.run([sample, "-q", "-m", o.model, "-n", str(9 * o.n), "--latent-axis", str(axis), "--quantiles", QUANTILES, "--seed", str(o.seed), "-f", "-o", archive])
            if done.returncode != 0:
                sys.exit(done.returncode)
            values, names = measures(archive)
            rows.append(values.reshape(o.n, 9, -1))
    spread = np.concatenate([r[:, 4] for r in rows]).std(0)  # at the median: as drawn but for one element
    print("| axis | moves most: from quantile 0.1 to 0.9 (of spread, same way) | all measures |\n|---|---|---|")
    table = []
    for axis, r in zip(axes, rows):
        change = r[:, -1] - r[:, 0]
        effect = change.mean(0)
        same = (np.sign(change) == np.sign(effect)).mean(0)
        strength = effect / np.maximum(spread, 1e-9)
        for k, name in enumerate(names):
            table.append((axis, name, effect[k], strength[k], same[k]))
        best = np.argsort(-np.abs(strength))[: o.top]
        cells = [f"{' '.join(names[k].split()[:-1])} {effect[k]:+.{2 if abs(effect[k]) < 10 else 0}f} {names[k].split()[-1]} ({strength[k]:+.1f}, {100 * same[k]:.0f} %)" for k in best]
        print(f"| {axis} | {'; '.join(cells)} | {np.sqrt((strength ** 2).mean()):.2f} |")
    if o.tsv:
        with open(o.tsv, "w") as f:
            f.write("axis\tmeasure\teffect\tof_spread\tsame_way\n")
            f.writelines(f"{a}\t{n}\t{e:.6g}\t{s:.6g}\t{w:.6g}\n" for a, n, e, s, w in table)


if __name__ == "__main__":
    main()
