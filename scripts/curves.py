#!/usr/bin/python3
"""Writes twelve ground curves to follow (follow-path) into a folder: lines, circles both ways, S, figure eight, rounded square, spiral, and three drawn by hand.

    scripts/curves.py curves/
"""
import math
import os
import sys

STEP = 0.02  # metres between points


def polar(r0, r1, turns, side, n=2000):
    """A spiral of `turns` turns from radius r0 to r1 about a point beside the start, to the left for side 1."""
    points = []
    for i in range(n + 1):
        a = 2 * math.pi * turns * i / n
        r = r0 + (r1 - r0) * i / n
        points.append((r * math.sin(a), side * (r0 - r * math.cos(a))))
    return points


def rounded_square(side, radius):
    points, x, y, heading = [(0.0, 0.0)], 0.0, 0.0, 0.0
    straight = side - 2 * radius
    for corner in range(4):
        for length, curvature in ((straight, 0), (math.pi / 2 * radius, 1 / radius)):
            n = max(1, round(length / STEP))
            for _ in range(n):
                heading += curvature * length / n / 2
                x, y = x + length / n * math.cos(heading), y + length / n * math.sin(heading)
                heading += curvature * length / n / 2
                points.append((x, y))
    return points


def smooth(knots, n=60):
    """Catmull-Rom through knots."""
    k = [tuple(2 * a - b for a, b in zip(knots[0], knots[1]))] + knots + [tuple(2 * a - b for a, b in zip(knots[-1], knots[-2]))]
    points = []
    for i in range(1, len(k) - 2):
        for j in range(n):
            t = j / n
            points.append(tuple(0.5 * (2 * k[i][c] + (k[i + 1][c] - k[i - 1][c]) * t + (2 * k[i - 1][c] - 5 * k[i][c] + 4 * k[i + 1][c] - k[i + 2][c]) * t * t
                                       + (3 * k[i][c] - k[i - 1][c] - 3 * k[i + 1][c] + k[i + 2][c]) * t**3) for c in (0, 1)))
    return points + [tuple(map(float, knots[-1]))]


N = 800
CURVES = {
    "line-4": [(4.0 * i / 200, 0.0) for i in range(201)],
    "line-10": [(0.0, -10.0 * i / 500) for i in range(501)],  # along -Y
    "circle-left-2": polar(2, 2, 1, 1),
    "circle-right-2": polar(2, 2, 1, -1),
    "circle-right-4": polar(4, 4, 1, -1),
    "s": [(8.0 * i / N, 1.2 * math.sin(2 * math.pi * i / N)) for i in range(N + 1)],
    "eight": [(4 * math.sin(2 * math.pi * i / N), 2 * math.sin(4 * math.pi * i / N)) for i in range(N + 1)],
    "square": rounded_square(5, 1),
    "spiral": polar(3, 1, 2, 1),
    "hand-1": smooth([(0, 0), (1.5, 0.2), (3, 1.1), (3.6, 2.6), (5.0, 3.1), (6.6, 2.4), (7.1, 0.8), (8.6, -0.1), (10.2, 0.5)]),
    "hand-2": smooth([(0, 0), (-1.2, 0.9), (-1.6, 2.5), (-0.6, 4.0), (1.2, 4.3), (2.6, 3.2), (2.5, 1.4), (3.7, 0.1), (5.6, 0.0)]),
    "hand-3": smooth([(0, 0), (2.0, -0.3), (4.1, -0.2), (5.4, 0.9), (5.2, 2.5), (3.7, 3.3), (1.9, 3.0), (0.3, 3.6), (-0.5, 5.1)]),
}

if __name__ == "__main__":
    if len(sys.argv) != 2 or sys.argv[1].startswith("-"):
        sys.exit(__doc__.strip())
    os.makedirs(sys.argv[1], exist_ok=True)
    for name, points in CURVES.items():
        with open(os.path.join(sys.argv[1], name + ".csv"), "w", encoding="ascii") as f:
            f.write("x,y\n" + "".join(f"{x:.4f},{y:.4f}\n" for x, y in points))
