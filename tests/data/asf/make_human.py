#!/usr/bin/python3
"""A figure of CMU's bones in round numbers walks for half a second: human.asf and human.amc.

    /usr/bin/python3 make_human.py
"""
import pathlib

import numpy as np

here = pathlib.Path(__file__).parent
down, up, ahead = (0, -1, 0), (0, 1, 0), (0, 0, 1)
# name, parent, direction (of the left side), length, axis, dof
bones = [("lowerback", "root", up, 2.2, "0 0 0", "rx ry rz"), ("upperback", "lowerback", up, 2.2, "0 0 0", "rx ry rz"),
         ("thorax", "upperback", up, 2.2, "0 0 0", "rx ry rz"), ("lowerneck", "thorax", up, 1.4, "0 0 0", "rx ry rz"),
         ("upperneck", "lowerneck", up, 1.4, "0 0 0", "rx ry rz"), ("head", "upperneck", up, 1.5, "0 0 0", "rx ry rz")]
for side, sign in (("l", 1), ("r", -1)):
    out = (sign, 0, 0)
    bones += [(side + "hipjoint", "root", (sign * 0.6, -0.8, 0), 2.5, "0 0 0", ""),
              (side + "femur", side + "hipjoint", down, 7.0, f"0 0 {20 * sign}", "rx ry rz"),
              (side + "tibia", side + "femur", down, 7.2, f"0 0 {20 * sign}", "rx"),
              (side + "foot", side + "tibia", (0, -0.28, 0.96), 2.0, f"-90 0 {20 * sign}", "rx rz"),
              (side + "toes", side + "foot", ahead, 1.0, f"-90 0 {20 * sign}", "rx"),
              (side + "clavicle", "thorax", (sign * 0.96, 0.28, 0), 3.2, "0 0 0", "ry rz"),
              (side + "humerus", side + "clavicle", out, 5.0, f"180 {30 * sign} {90 * sign}", "rx ry rz"),
              (side + "radius", side + "humerus", out, 3.4, f"180 {30 * sign} {90 * sign}", "rx"),
              (side + "wrist", side + "radius", out, 1.7, f"180 0 {90 * sign}", "ry"),
              (side + "hand", side + "wrist", out, 0.7, f"180 0 {90 * sign}", "rx rz")]

with open(here / "human.asf", "w") as f:
    f.write("# make_human.py\n:version 1.10\n:name HUMAN\n:units\n  mass 1.0\n  length 0.45\n  angle deg\n:root\n   order TX TY TZ RX RY RZ\n"
            "   axis XYZ\n   position 0 0 0\n   orientation 0 0 0\n:bonedata\n")
    for i, (name, _, direction, length, axis, dof) in enumerate(bones):
        f.write(f"  begin\n     id {i + 1}\n     name {name}\n     direction {' '.join(map(str, direction))}\n     length {length}\n     axis {axis} XYZ\n")
        if dof:
            f.write(f"    dof {dof}\n    limits " + "\n           ".join(["(-180.0 180.0)"] * len(dof.split())) + "\n")
        f.write("  end\n")
    f.write(":hierarchy\n  begin\n")
    for parent in ["root"] + [b[0] for b in bones]:
        below = [b[0] for b in bones if b[1] == parent]
        if below:
            f.write(f"    {parent} {' '.join(below)}\n")
    f.write("  end\n")

with open(here / "human.amc", "w") as f:
    f.write("#!OML:ASF make_human.py\n:FULLY-SPECIFIED\n:DEGREES\n")
    for t in range(60):
        phase = 2 * np.pi * t / 120
        f.write(f"{t + 1}\nroot 0.5 {17.5 + 0.1 * np.cos(2 * phase):.4f} {0.2 * t:.4f} 0 {5 * np.sin(phase):.4f} 0\n")
        for name, _, _, _, _, dof in bones:
            values = {"rx": 0.0, "ry": 0.0, "rz": 0.0}
            swing = np.sin(phase if name[0] == "l" else phase + np.pi)
            if name.endswith("femur"):
                values["rx"] = -25 * swing
            elif name.endswith("tibia"):
                values["rx"] = 20 + 15 * swing
            elif name.endswith("humerus"):
                values.update(rx=10 * swing, rz=(-70 if name[0] == "r" else 70))
            elif name.endswith("radius"):
                values["rx"] = 25.0
            if dof:
                f.write(name + "".join(f" {values[d]:.4f}" for d in dof.split()) + "\n")
