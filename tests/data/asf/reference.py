#!/usr/bin/python3
"""World positions (metres) and rotation matrices of every joint of an ASF + AMC pair, independently of libmocap.

    for f in tiny radians moving; do /usr/bin/python3 reference.py $f > $f.tsv; done

One row per frame and joint, joints depth first: frame, bone, x y z, then the rotation row by row.
"""
import pathlib
import sys

import numpy as np

here = pathlib.Path(__file__).parent
stem = sys.argv[1]


def turn(letter, angle):
    c, s = np.cos(angle), np.sin(angle)
    return {"X": np.array([[1, 0, 0], [0, c, -s], [0, s, c]]),
            "Y": np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]),
            "Z": np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])}[letter]


def turns(letters, angles):
    """About fixed axes, the first letter first."""
    r = np.eye(3)
    for letter, angle in zip(letters.upper(), angles):
        r = turn(letter, angle) @ r
    return r


def lines(path):
    for line in path.read_text().split("\n"):
        words = line.split("#")[0].split()
        if words:
            yield words


section, bones, bone, children, unit, angle = None, {}, None, {}, 1.0, np.pi / 180
root = {"axis": ([0, 0, 0], "XYZ"), "position": np.zeros(3)}
for w in lines(here / (stem + ".asf")):
    if w[0].startswith(":"):
        section = w[0]
    elif section == ":units" and w[0] == "length":
        unit = float(w[1])
    elif section == ":units" and w[0] == "angle":
        angle = 1.0 if w[1] == "rad" else np.pi / 180
    elif section == ":root":
        if w[0] == "order":
            root["dof"] = [v.lower() for v in w[1:]]
        elif w[0] == "axis":
            root["axis"] = (root["axis"][0], w[1])
        elif w[0] == "position":
            root["position"] = np.array([float(v) for v in w[1:]])
        elif w[0] == "orientation":
            root["axis"] = ([float(v) for v in w[1:]], root["axis"][1])
    elif section == ":bonedata":
        if w[0] == "begin":
            bone = {"dof": [], "axis": ([0, 0, 0], "XYZ")}
        elif w[0] == "end":
            bones[bone["name"]] = bone
        elif w[0] == "name":
            bone["name"] = w[1]
        elif w[0] == "direction":
            bone["direction"] = np.array([float(v) for v in w[1:]])
        elif w[0] == "length":
            bone["length"] = float(w[1])
        elif w[0] == "axis":
            bone["axis"] = ([float(v) for v in w[1:4]], w[4])
        elif w[0] == "dof":
            bone["dof"] = w[1:]
    elif section == ":hierarchy" and w[0] not in ("begin", "end"):
        children[w[0]] = w[1:]
for b in [root, *bones.values()]:
    b["C"] = turns(b["axis"][1], [v * angle for v in b["axis"][0]])

motion_angle, frames = angle, []
for w in lines(here / (stem + ".amc")):
    if w[0] == ":DEGREES":
        motion_angle = np.pi / 180
    elif w[0] == ":RADIANS":
        motion_angle = 1.0
    elif w[0].isdigit():
        frames.append({"number": int(w[0])})
    elif not w[0].startswith(":"):
        frames[-1][w[0]] = [float(v) for v in w[1:]]


def motion(dofs, values):
    t = np.zeros(3)
    letters, angles = "", []
    for dof, value in zip(dofs, values):
        if dof[0] == "t":
            t["xyz".index(dof[1])] = value
        else:
            letters, angles = letters + dof[1], angles + [value * motion_angle]
    return turns(letters, angles), t


def row(frame, name, p, r):
    print("\t".join([str(frame), name] + ["%.17g" % v for v in [*(p * 0.0254 / unit), *r.ravel()]]))


def walk(frame, name, r_parent, base):
    b = bones[name]
    m, t = motion(b["dof"], frame.get(name, []))
    r = r_parent @ b["C"] @ m @ np.linalg.inv(b["C"])
    p = base + r_parent @ b["C"] @ t
    row(frame["number"], name, p, r)
    tip = p + r @ (b["length"] * b["direction"])
    below = children.get(name, [])
    for child in below:
        walk(frame, child, r, tip)
    if not below:
        row(frame["number"], "tip", tip, r)


for frame in frames:
    m, t = motion(root["dof"], frame["root"])
    r, p = root["C"] @ m, root["position"] + root["C"] @ t
    row(frame["number"], "root", p, r)
    for child in children["root"]:
        walk(frame, child, r, p)
