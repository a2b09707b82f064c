#!/usr/bin/python3
"""make_tsne.py [FOLDER] - tsne.txt: what tests/metrics/tsne_test.cpp compares libmocap/metrics/tsne with. Exact t-SNE written from the formulas of
van der Maaten and Hinton (2008), whole matrices at a time, widths by bisection; the descent as in van der Maaten's tsne.py with
scikit-learn's defaults. Features and maps are drawn here; the principal map is numpy's SVD."""
import pathlib
import sys

import numpy as np

folder = sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parent
rng = np.random.RandomState(11)


def squared(x):
    return ((x[:, None, :] - x[None, :, :]) ** 2).sum(-1)


def conditional(x, perplexity):
    d = squared(x)
    p = np.zeros_like(d)
    for i in range(len(x)):
        others = np.arange(len(x)) != i
        low, high = 0.0, np.inf
        beta = 1.0
        for _ in range(200):
            w = np.exp(-beta * d[i, others])
            q = w / w.sum()
            entropy = -(q[q > 0] * np.log(q[q > 0])).sum()
            if entropy > np.log(perplexity):
                low, beta = beta, beta * 2 if high == np.inf else (beta + high) / 2
            else:
                high, beta = beta, (beta + low) / 2
        p[i, others] = q
    return p


def joint(c):
    return (c + c.T) / (2 * len(c))


def low_dimensional(y):
    w = 1 / (1 + squared(y))
    np.fill_diagonal(w, 0)
    return w, w / w.sum()


def divergence(p, y):
    _, q = low_dimensional(y)
    at = p > 0
    return (p[at] * np.log(p[at] / q[at])).sum()


def gradient(p, y, exaggeration=1):
    w, q = low_dimensional(y)
    m = (exaggeration * p - q) * w
    return 4 * (np.diag(m.sum(1)) - m) @ y


def principal(x, k):
    centred = x - x.mean(0)
    u, s, vt = np.linalg.svd(centred, full_matrices=False)
    axes = vt[:k].T * np.sign(vt[:k][np.arange(k), np.abs(vt[:k]).argmax(1)])
    return centred @ axes, (s ** 2)[:k] / (s ** 2).sum()


def descend(x, perplexity, iterations=1000):
    p = joint(conditional(x, perplexity))
    y = principal(x, 2)[0]
    y *= 1e-4 / y[:, 0].std()
    rate = max(len(x) / 12 / 4, 50)
    v, gain = np.zeros_like(y), np.ones_like(y)
    for t in range(iterations):
        g = gradient(p, y, 12 if t < 250 else 1)
        gain = np.maximum(0.01, np.where(v * g < 0, gain + 0.2, gain * 0.8))
        v = (0.5 if t < 250 else 0.8) * v - rate * gain * g
        y += v
    return divergence(p, y)


def write(f, name, x):
    x = np.atleast_2d(x)
    f.write("%s %d %d\n" % (name, *x.shape))
    for row in x:
        f.write(" ".join("%.17g" % v for v in row) + "\n")


small = rng.randn(20, 4) * [3, 1, 1, 0.2]
small[7] = small[3] + 1e-3   # a near twin
places = rng.randn(20, 2)
centres = np.array([[0, 0, 0, 0, 0, 0], [12, 0, 0, 0, 0, 0], [0, 12, 0, 0, 0, 0]])
blobs = np.concatenate([c + rng.randn(40, 6) for c in centres])
c = conditional(small, 5)
coordinates, shares = principal(small, 2)
with open(pathlib.Path(folder) / "tsne.txt", "w") as f:
    write(f, "small", small)
    write(f, "conditional", c)
    write(f, "places", places)
    write(f, "gradient", gradient(joint(c), places))
    write(f, "exaggerated", gradient(joint(c), places, 12))
    write(f, "divergence", divergence(joint(c), places))
    write(f, "principal", coordinates)
    write(f, "shares", shares)
    write(f, "blobs", blobs)
    write(f, "blobs.divergence", descend(blobs, 15))
