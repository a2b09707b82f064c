#!/usr/bin/python3
"""make_fixtures.py [FOLDER] - features.txt (float32 features, posteriors, labels) and expected.tsv: the figures
that NumPy and SciPy give for them, by the formulas of pytorch-fid, clean-fid, torch-fidelity, action-to-motion and ACTOR written
out here. The tests compare libmocap/metrics with these."""
import pathlib
import sys

import numpy as np
from scipy import linalg, stats
from scipy.spatial.distance import cdist

folder = sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parent
rng = np.random.RandomState(7)


def features(n, d, shift, scale):
    mix = rng.randn(d, d) / np.sqrt(d)
    return np.maximum(0, rng.randn(n, d) @ mix * scale + shift).astype(np.float32)


def posteriors(n, c, sharp):
    logits = sharp * rng.randn(n, c)
    p = np.exp(logits - logits.max(1, keepdims=True))
    return p / p.sum(1, keepdims=True)


a, b = features(160, 8, 0.3, 1.0), features(150, 8, 0.5, 1.3)
dead_a, dead_b = a.copy(), b.copy()   # columns a ReLU never opens
dead_a[:, [2, 5]] = 0
dead_b[:, [5, 7]] = 0
few_a, few_b = features(12, 16, 0.2, 1.0), features(14, 16, 0.4, 1.0)  # N <= d
p4, p2 = posteriors(160, 4, 2.0), posteriors(160, 2, 3.0)
labels = rng.randint(0, 4, 160)
out = {}


def mean(x):  # as the dtype has it: float32 features are averaged in float32
    return np.mean(x, axis=0)


def fid(m1, s1, m2, s2, check, eps=1e-6):  # pytorch-fid, a2m, ACTOR (check), clean-fid (no check)
    diff = m1 - m2
    root, _ = linalg.sqrtm(s1.dot(s2), disp=False)
    if not np.isfinite(root).all():
        offset = np.eye(len(s1)) * eps
        root = linalg.sqrtm((s1 + offset).dot(s2 + offset))
    if np.iscomplexobj(root):
        if check and not np.allclose(np.diagonal(root).imag, 0, atol=1e-3):
            raise ValueError("Imaginary component")
        root = root.real
    return diff.dot(diff) + np.trace(s1) + np.trace(s2) - 2 * np.trace(root)


def fid_torch_fidelity(m1, s1, m2, s2):
    diff = m1 - m2
    root = np.sqrt(np.linalg.eigvals(s1.dot(s2)).astype("complex128")).real.sum()
    return diff.dot(diff) + np.trace(s1) + np.trace(s2) - 2 * root


for name, x, y in (("full", a, b), ("dead", dead_a, dead_b), ("few", few_a, few_b)):
    s1, s2 = np.cov(x, rowvar=False), np.cov(y, rowvar=False)
    exact1, exact2 = x.astype(np.float64).mean(0), y.astype(np.float64).mean(0)
    out["fid.pytorch-fid." + name] = fid(exact1, s1, exact2, s2, True)
    for program in ("a2m", "actor"):
        out[f"fid.{program}.{name}"] = fid(mean(x), s1, mean(y), s2, True)
    out["fid.clean-fid." + name] = fid(mean(x), s1, mean(y), s2, False)
    out["fid.torch-fidelity." + name] = fid_torch_fidelity(mean(x), s1, mean(y), s2)


def inception(p, splits, order):
    scores = []
    for i in range(splits):
        part = p[order][i * len(p) // splits:(i + 1) * len(p) // splits]
        q = part.mean(0, keepdims=True)
        scores.append(np.exp((part * (np.log(part) - np.log(q))).sum(1).mean()))
    return np.mean(scores), np.std(scores)


out["is.4"] = inception(p4, 1, np.arange(160))[0]
out["is.joint"] = inception((p4[:, :, None] * p2[:, None, :]).reshape(160, 8), 1, np.arange(160))[0]
out["is.torch-fidelity"], out["is.torch-fidelity.std"] = inception(p4, 10, np.random.RandomState(2020).permutation(160))


def mmd(x, y):
    m, d = x.shape
    kernel = lambda u, v: (u @ v.T / d + 1) ** 3
    xx, yy, xy = kernel(x, x), kernel(y, y), kernel(x, y)
    return ((xx.sum() - np.trace(xx)) + (yy.sum() - np.trace(yy))) / (m * (m - 1)) - 2 * xy.sum() / m**2


a64, b64 = a.astype(np.float64), b.astype(np.float64)
draw = np.random.RandomState(2020)
subsets = []
for _ in range(20):
    x = a64[draw.choice(160, 60, replace=False)]
    subsets.append(mmd(x, b64[draw.choice(150, 60, replace=False)]))
out["kid.torch-fidelity"], out["kid.torch-fidelity.std"] = np.mean(subsets), np.std(subsets)
out["kid.all"] = mmd(a64[:150], b64)  # one subset of everything


def covered(x, y, k=3):
    radius = np.sort(cdist(y, y), axis=1)[:, k]
    return np.mean((cdist(x, y) <= radius[None]).any(1))


out["precision"], out["recall"] = covered(a64, b64), covered(b64, a64)
out["accuracy"] = np.mean(p4.argmax(1) == labels)

np.random.seed(3)
first, second = np.random.randint(0, 160, 200), np.random.randint(0, 160, 200)
out["diversity.a2m"] = np.mean([np.linalg.norm(a64[i] - a64[j]) for i, j in zip(first, second)])
np.random.seed(4)
quota, total = np.repeat(20, 4), 0.0
while np.any(quota > 0):
    i = np.random.randint(0, 160)
    if not quota[labels[i]]:
        continue
    j = np.random.randint(0, 160)
    while labels[i] != labels[j]:
        j = np.random.randint(0, 160)
    quota[labels[i]] -= 1
    total += np.linalg.norm(a64[i] - a64[j])
out["multimodality.a2m"] = total / 80
out["diversity.all"] = np.mean(cdist(a64, a64)[np.triu_indices(160, 1)])  # what pairs drawn at random tend to
out["within"] = np.mean([a64[labels == c].var(0, ddof=1).sum() for c in range(4)])
w, v = np.linalg.eigh(np.cov(b64, rowvar=False))
out["pca.kept"] = w[-4:].sum() / w.sum()
axes = v[:, :-5:-1]
q1, q2 = (a64 - b64.mean(0)) @ axes, (b64 - b64.mean(0)) @ axes
out["fid.pca"] = fid(q1.mean(0), np.cov(q1, rowvar=False), q2.mean(0), np.cov(q2, rowvar=False), True)
for p, n in ((0.975, 19), (0.975, 1), (0.9, 3), (0.025, 7), (0.9995, 400)):
    out[f"t.{p}.{n}"] = stats.t.ppf(p, n)

np.savez(f"{folder}/statistics.npz", mu=a64.mean(0), sigma=np.cov(a64, rowvar=False))  # as pytorch-fid keeps them
with open(f"{folder}/features.txt", "w") as f:  # name, rows, columns, the numbers: for tests that read no npz
    for name, x in (("a", a), ("b", b), ("few_a", few_a), ("few_b", few_b), ("p4", p4), ("p2", p2), ("labels", labels[:, None])):
        f.write(f"{name} {x.shape[0]} {x.shape[1]}\n")
        f.writelines(" ".join("%.9g" % v if x.dtype == np.float32 else "%.17g" % v for v in row) + "\n" for row in x)
with open(f"{folder}/expected.tsv", "w") as f:
    f.writelines(f"{k}\t{v:.17g}\n" for k, v in out.items())
