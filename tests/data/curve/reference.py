#!/usr/bin/python3
"""Writes reference.tsv: points along the curves of the SVG files beside it, and their lengths. Run with Debian's python3-numpy; the output is committed.

The curves are given here a second time, by hand: absolute control points and matrices. Bezier curves are Bernstein sums. The centre of an arc is found among both candidates by
trying which one fulfils the flags. Lines: curve, x, y (metres); or curve, "length", metres.
"""
import os

import numpy as np

METRES_PER_UNIT = 0.01
SAMPLES = 12  # of a segment, in the table
FINE = 4000  # for the length


def line(*p):
    return lambda t: np.outer(1 - t, p[0]) + np.outer(t, p[1])


def quadratic(*p):
    return lambda t: np.outer((1 - t) ** 2, p[0]) + np.outer(2 * t * (1 - t), p[1]) + np.outer(t**2, p[2])


def cubic(*p):
    return lambda t: np.outer((1 - t) ** 3, p[0]) + np.outer(3 * t * (1 - t) ** 2, p[1]) + np.outer(3 * t**2 * (1 - t), p[2]) + np.outer(t**3, p[3])


def arc(a, rx, ry, degrees, large, sweep, b):
    a, b = np.array(a, float), np.array(b, float)
    rx, ry, phi = abs(rx), abs(ry), np.radians(degrees)
    turn = np.array([[np.cos(phi), -np.sin(phi)], [np.sin(phi), np.cos(phi)]])
    to_circle = np.diag([1 / rx, 1 / ry]) @ turn.T
    p, q = to_circle @ a, to_circle @ b
    middle, apart = (p + q) / 2, np.linalg.norm(q - p)
    normal = np.array([-(q - p)[1], (q - p)[0]]) / apart
    if apart >= 2:  # the smallest ellipse of that shape that reaches both
        radius, centres = apart / 2, [middle]
    else:
        radius, height = 1.0, np.sqrt(1 - apart**2 / 4)
        centres = [middle + height * normal, middle - height * normal]
    for centre in centres:
        start, end = (np.arctan2(*(x - centre)[::-1]) for x in (p, q))
        span = (end - start) % (2 * np.pi) if sweep else -((start - end) % (2 * np.pi))
        if len(centres) == 1 or (abs(span) > np.pi) == bool(large):
            break
    else:
        raise ValueError("no centre fulfils the flags")
    back = np.linalg.inv(to_circle)
    return lambda t: (centre + radius * np.stack([np.cos(start + span * t), np.sin(start + span * t)], 1)) @ back.T


def matrix(a, b, c, d, e, f):
    return np.array([[a, c, e], [b, d, f], [0, 0, 1]], float)


def rotate(degrees, x=0, y=0):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return matrix(1, 0, 0, 1, x, y) @ matrix(c, s, -s, c, 0, 0) @ matrix(1, 0, 0, 1, -x, -y)


tan = lambda degrees: np.tan(np.radians(degrees))
group = (matrix(1, 0, 0, 1, 10, 0) @ rotate(30, 50, 60) @ matrix(1.5, 0, 0, 0.5, 0, 0) @ matrix(1, 0, tan(20), 1, 0, 0) @ matrix(1, tan(-10), 0, 1, 0, 0)
         @ matrix(0.8, 0.1, -0.3, 1.1, 5, -7) @ matrix(2, 0, 0, 2, 0, 0))
commands = [
    line((100, 200), (150, 180)), line((150, 180), (220, 180)), line((220, 180), (210, 180)), line((210, 180), (210, 240)), line((210, 240), (210, 245)),
    cubic((210, 245), (250, 300), (300, 100), (350, 220)), cubic((350, 220), (400, 340), (390, 280), (440, 210)), cubic((440, 210), (490, 140), (480, 150), (500, 240)),
    quadratic((500, 240), (540, 320), (580, 240)), quadratic((580, 240), (620, 160), (640, 250)), quadratic((640, 250), (660, 340), (700, 230)),
    cubic((700, 230), (700, 230), (720, 100), (760, 200)), line((760, 200), (800, 260)),
    arc((800, 260), 40, 20, 30, 1, 0, (850, 230)), arc((850, 230), 25, 25, 0, 0, 1, (880, 280)),
    cubic((880, 280), (880, 320), (920, 320), (920, 280)), cubic((920, 280), (940, 220), (980, 220), (990, 290)), line((990, 290), (100, 200)),
]
arcs = [
    arc((0, 0), 60, 40, 20, 0, 0, (50, 30)), arc((50, 30), 60, 40, 20, 0, 1, (100, 0)), arc((100, 0), 60, 40, -35, 1, 0, (150, 30)), arc((150, 30), 60, 40, -35, 1, 1, (200, 0)),
    arc((200, 0), 10, 5, 45, 0, 1, (300, 40)), arc((300, 40), 30, 20, 10, 1, 0, (320, 10)), line((320, 10), (400, 10)),
    arc((400, 10), 50, 50, 0, 0, 0, (500, 10)), arc((500, 10), 50, 50, 0, 1, 1, (500, 110)), arc((500, 110), 25, 80, 100, 1, 1, (500.001, 110)),
]
bent = [arc((0, 0), 30, 10, 25, 1, 1, (40, 20)), cubic((40, 20), (60, 80), (100, -40), (120, 30)), quadratic((120, 30), (130, 60), (150, 20))]
broken, closed = [(0, 0), (10, 20), (30, -5), (40, 40)], [(0, 0), (100, 0), (100, 50), (0, 0)]
curves = {
    "commands.svg all": (np.eye(3), commands),
    "commands.svg compact": (np.eye(3), commands),
    "arcs.svg ": (np.eye(3), arcs),
    "transforms.svg bent": (group @ rotate(-90) @ matrix(1, 0, 0, 1, 3, 4), bent),
    "transforms.svg broken": (group, [line(*pair) for pair in zip(broken, broken[1:])]),
    "transforms.svg closed": (group, [line(*pair) for pair in zip(closed, closed[1:])]),
}

with open(os.path.join(os.path.dirname(os.path.abspath(__file__)), "reference.tsv"), "w") as out:
    for name, (transform, segments) in curves.items():
        to_metres = np.diag([METRES_PER_UNIT, -METRES_PER_UNIT]) @ transform[:2]
        sample = lambda segment, n: np.column_stack([segment(np.linspace(0, 1, n + 1)), np.ones(n + 1)]) @ to_metres.T
        for segment in segments:
            for x, y in sample(segment, SAMPLES):
                out.write(f"{name}\t{float(x)!r}\t{float(y)!r}\n")
        length = sum(np.linalg.norm(np.diff(sample(segment, FINE), axis=0), axis=1).sum() for segment in segments)
        out.write(f"{name}\tlength\t{float(length)!r}\n")
