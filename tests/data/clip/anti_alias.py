#!/usr/bin/python3
"""Writes anti_alias.tsv: a position and a rotation of 150 frames, and what SciPy's low-pass leaves of them at new rates.

First line: source rate, frames. Then per frame: position (3), quaternion wxyz. Then per new rate a line `rate PHASE HZ COUNT` and COUNT lines: position,
quaternion. Filter: scipy.signal.windows' Kaiser window of 44 dB (scipy.special.i0 where samples lie between its places) times np.sinc; rotations
by scipy.spatial.transform in the tangent space of the middle.
"""
import os

import numpy as np
from scipy.signal import kaiser_beta, windows
from scipy.spatial.transform import Rotation, Slerp
from scipy.special import i0

rng = np.random.default_rng(3)
RATE, N = 120.0, 150
t = np.arange(N) / RATE
position = sum(rng.normal(0, 1, (1, 3)) * np.sin(2 * np.pi * f * t[:, None] + rng.uniform(0, 6, (1, 3))) for f in (1, 5, 13, 22, 41))
vector = sum(rng.normal(0, 0.25, (1, 3)) * np.sin(2 * np.pi * f * t[:, None] + rng.uniform(0, 6, (1, 3))) for f in (1, 4, 11, 24, 50))
rotation = Rotation.from_rotvec([0, 0, 1] * (9 * t[:, None])) * Rotation.from_rotvec(vector)  # a spin of 1.4 turns a second under it
slerp = Slerp(t, rotation)


def wxyz(r):
    return np.roll(r.as_quat(), 1, axis=-1)


def line(*groups):
    return "\t".join(repr(float(x)) for group in groups for x in np.ravel(group)) + "\n"


with open(os.path.join(os.path.dirname(os.path.abspath(__file__)), "anti_alias.tsv"), "w") as out:
    out.write(line([RATE, N]))
    for k in range(N):
        out.write(line(position[k], wxyz(rotation[k])))
    for phase, rate in ((0, 30.0), (1, 30.0), (0, 25.0), (0, 1000 / 11)):
        ratio = RATE / rate
        count = int((N - 1 - phase) / ratio + 1e-9) + 1
        out.write(line([phase, rate, count]))
        half, beta = 8 / rate, kaiser_beta(44)
        for i in range(count):
            now = phase / RATE + i / rate
            s = t - now
            near = np.abs(s) < half - 1e-12
            w = np.zeros(N)
            w[near] = np.sinc(0.9 * rate * s[near]) * i0(beta * np.sqrt(1 - (s[near] / half) ** 2)) / i0(beta)
            if rate == 30 and near.sum() == 63:  # the same taps as of the window by its name
                np.testing.assert_allclose(w[near], np.sinc(0.9 * rate * s[near]) * windows.kaiser(65, beta)[1:-1], atol=1e-12)
            w /= w.sum()
            middle = slerp([min(now, t[-1])])[0]
            tangent = (middle.inv() * rotation).as_rotvec()
            centre = min(int(np.floor(now * RATE + 1e-9)), N - 1)
            for order in (range(centre, -1, -1), range(centre + 1, N)):
                last = np.zeros(3)
                for k in order:
                    turns = [tangent[k] + 2 * np.pi * m * tangent[k] / max(np.linalg.norm(tangent[k]), 1e-12) for m in (-2, -1, 0, 1, 2)]
                    if np.linalg.norm(tangent[k]) > 1e-6:
                        tangent[k] = min(turns, key=lambda v: np.linalg.norm(v - last))
                    last = tangent[k]
            out.write(line(w @ position, wxyz(middle * Rotation.from_rotvec(w @ tangent))))
