#!/usr/bin/python3
"""Writes tiny_human.bvh: a hand-made figure that walks straight ahead. Y up, centimetres, facing +Z, 30 frames at 30 Hz.

Made up for the tests: joint names in the style of common exporters, round offsets, sine joint angles. No captured data.
Usage: make_tiny_human.py > tiny_human.bvh
"""
import math

# name, offset (cm), children; an empty list of children gets an End Site with the given tip
BODY = ("Hips", (0, 92, 0), [
    ("Spine", (0, 12, 0), [
        ("Spine1", (0, 14, 0), [
            ("Neck", (0, 22, 0), [("Head", (0, 9, 1), [], (0, 17, 0))]),
            ("LeftShoulder", (4, 18, 0), [("LeftArm", (14, 0, 0), [("LeftForeArm", (28, 0, 0), [("LeftHand", (25, 0, 0), [], (17, 0, 0))])])]),
            ("RightShoulder", (-4, 18, 0), [("RightArm", (-14, 0, 0), [("RightForeArm", (-28, 0, 0), [("RightHand", (-25, 0, 0), [], (-17, 0, 0))])])]),
        ])]),
    ("LeftUpLeg", (9, -4, 0), [("LeftLeg", (0, -41, 0), [("LeftFoot", (0, -41, 0), [("LeftToeBase", (0, -5, 13), [], (0, 0, 6))])])]),
    ("RightUpLeg", (-9, -4, 0), [("RightLeg", (0, -41, 0), [("RightFoot", (0, -41, 0), [("RightToeBase", (0, -5, 13), [], (0, 0, 6))])])]),
])
FRAMES, RATE = 30, 30


def angles(name, phase):
    """Z, Y, X rotation in degrees. Left and right are half a cycle apart; arms hang down and swing against the legs."""
    left = name.startswith("Left")
    side, swing = (1 if left else -1), math.sin(phase + (0 if left else math.pi))
    part = name.removeprefix("Left").removeprefix("Right")
    return {
        "Hips": (1.5 * math.sin(phase), 4 * math.sin(phase), 2),
        "Spine": (0, -3 * math.sin(phase), 3),
        "Arm": (-75 * side, 0, 18 * swing),
        "ForeArm": (0, -20 * side, 0),
        "UpLeg": (0, 0, -25 * swing),
        "Leg": (0, 0, 25 + 22 * math.sin(phase + (0 if left else math.pi) + 1.2)),
        "Foot": (0, 0, -8 * swing),
    }.get(part, (0, 0, 0))


def hierarchy(joint, depth, order):
    name, offset, children = joint[:3]
    pad = "\t" * depth
    order.append(name)
    print(f"{pad}{'JOINT' if depth else 'ROOT'} {name}\n{pad}{{")
    print(f"{pad}\tOFFSET {' '.join(f'{v:.4f}' for v in (offset if depth else (0, 0, 0)))}")
    print(f"{pad}\tCHANNELS " + ("3" if depth else "6 Xposition Yposition Zposition") + " Zrotation Yrotation Xrotation")
    for child in children:
        hierarchy(child, depth + 1, order)
    if not children:
        print(f"{pad}\tEnd Site\n{pad}\t{{\n{pad}\t\tOFFSET {' '.join(f'{v:.4f}' for v in joint[3])}\n{pad}\t}}")
    print(f"{pad}}}")


def main():
    order = []
    print("HIERARCHY")
    hierarchy(BODY, 0, order)
    print(f"MOTION\nFrames: {FRAMES}\nFrame Time: {1 / RATE:.7f}")
    for frame in range(FRAMES):
        phase = 2 * math.pi * frame / FRAMES
        row = [1.5 * math.sin(phase), 90 + 1.5 * math.cos(2 * phase), 120 * frame / RATE]
        for name in order:
            row += angles(name, phase)
        print(" ".join(f"{v:.4f}" for v in row))


main()
