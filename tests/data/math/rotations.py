#!/usr/bin/python3
"""Writes rotations.tsv: rotations as SciPy sees them. Run with Debian's python3-scipy; the output is committed."""
import itertools
import os

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

AXES = [np.array(a, float) / np.linalg.norm(a) for a in [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, -2, 3)]]
ANGLES = [0.0, 1e-12, 1e-7, 1e-4, 1.0, np.pi - 1e-7, np.pi]
ORDERS = ["XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX", "XYX", "XZX", "YXY", "YZY", "ZXZ", "ZYZ"]
EULER = [(0.3, -0.4, 0.5), (3.0, 1.2, -2.0), (-2.5, -1.5, 0.1), (1e-7, 1e-7, -1e-7), (0.2, np.pi / 2, 0.7), (-1.0, -np.pi / 2, 2.0)]


def words(*groups):
    return [repr(float(x)) for group in groups for x in np.ravel(group)]


def wxyz(rotation):
    x, y, z, w = rotation.as_quat()
    return np.array([w, x, y, z])


lines = []
vectors = [axis * angle for axis in AXES for angle in ANGLES]
for v in vectors:
    r = Rotation.from_rotvec(v)
    lines.append(["rotvec", *words(v, wxyz(r), r.as_matrix())])
for order, angles in itertools.product(ORDERS, EULER):
    lines.append(["euler", order, *words(angles, wxyz(Rotation.from_euler(order, angles)))])  # upper case: intrinsic
pairs = [(vectors[i], vectors[j]) for i, j in [(4, 11), (4, 18), (25, 11), (3, 25), (1, 2), (22, 23), (5, 4), (27, 4), (12, 19), (8, 8)]]
for a, b in pairs:
    ra, rb = Rotation.from_rotvec(a), Rotation.from_rotvec(b)
    lines.append(["distance", *words(a, b, (ra.inv() * rb).magnitude())])
    for t in (0.0, 0.25, 0.5, 0.9, 1.0):
        lines.append(["slerp", *words(a, b, t, wxyz(Slerp([0, 1], Rotation.concatenate([ra, rb]))(t)))])
with open(os.path.join(os.path.dirname(os.path.abspath(__file__)), "rotations.tsv"), "w") as out:
    for line in lines:
        out.write("\t".join(line) + "\n")
