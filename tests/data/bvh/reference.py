#!/usr/bin/python3
"""World positions of every joint of mixed_orders.bvh by SciPy, independently of libmocap: mixed_orders.tsv.

    /usr/bin/python3 reference.py > mixed_orders.tsv
"""
import pathlib
import re

import numpy as np
from scipy.spatial.transform import Rotation

text = (pathlib.Path(__file__).parent / "mixed_orders.bvh").read_text()
head, data = text.split("MOTION")
rows = np.array([[float(v) for v in line.split()] for line in data.strip().split("\n")[2:]])

names, parents, offsets, channels, stack, in_tip = [], [], [], [], [], False
for line in head.split("\n")[1:]:
    word = line.split()
    if not word:
        continue
    if word[0] in ("ROOT", "JOINT"):
        names.append(word[1])
        parents.append(stack[-1] if stack else -1)
        stack.append(len(names) - 1)
    elif word[0] == "End":
        stack.append("tip")
    elif word[0] == "OFFSET" and stack[-1] != "tip":
        offsets.append([float(v) for v in word[1:]])
    elif word[0] == "CHANNELS":
        channels.append(word[2:])
    elif word[0] == "}":
        stack.pop()

for row in rows:
    at, world = 0, []
    for j, names_of in enumerate(channels):
        values, at = row[at:at + len(names_of)], at + len(names_of)
        place, order, angles = list(offsets[j]), "", []
        for name, value in zip(names_of, values):
            if name.endswith("position"):
                place["XYZ".index(name[0])] = value
            else:
                order += name[0]
                angles.append(value)
        # Upper case letters are intrinsic axes: R = R_first R_second R_third.
        local = Rotation.from_euler(order, angles, degrees=True).as_matrix()
        local = local.reshape(3, 3)
        if parents[j] < 0:
            world.append((local, np.array(place)))
        else:
            r, p = world[parents[j]]
            world.append((r @ local, p + r @ np.array(place)))
    print("\t".join("%.17g" % v for _, p in world for v in p))
