#!/usr/bin/python3
"""Writes forward_kinematics.tsv: poses of a random tree computed with 4x4 matrices in NumPy, an independent route.

First line: J. Then per joint: parent, rest offset. Then poses; each is a line `pose MOVED` (MOVED 1: the next lines end
with a translation that replaces the offset), a line with the root position, and per joint the local quaternion wxyz,
the expected world position, the expected world matrix (9), the translation if MOVED."""
import os

import numpy as np

rng = np.random.default_rng(7)
J = 14
parents = [-1] + [int(rng.integers(max(0, j - 4), j)) for j in range(1, J)]
offsets = rng.normal(0, 0.3, (J, 3))


def matrix(q):
    w, x, y, z = q
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def line(*groups):
    return "\t".join(repr(float(x)) for group in groups for x in np.ravel(group)) + "\n"


with open(os.path.join(os.path.dirname(os.path.abspath(__file__)), "forward_kinematics.tsv"), "w") as out:
    out.write(f"{J}\n")
    for p, o in zip(parents, offsets):
        out.write(f"{p}\t" + line(o))
    for moved in (0, 0, 1):
        q = rng.normal(size=(J, 4))
        q /= np.linalg.norm(q, axis=1, keepdims=True)
        root, shifts = rng.normal(0, 2, 3), rng.normal(0, 0.3, (J, 3))
        world = []
        out.write(f"pose\t{moved}\n" + line(root))
        for j in range(J):
            local = np.eye(4)
            local[:3, :3] = matrix(q[j])
            local[:3, 3] = root if j == 0 else (shifts if moved else offsets)[j]
            world.append(local if j == 0 else world[parents[j]] @ local)
            out.write(line(q[j], world[j][:3, 3], world[j][:3, :3], *([shifts[j]] if moved else [])))
