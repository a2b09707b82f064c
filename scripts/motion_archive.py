"""For the scripts beside it that read motion archives and draw them: one-line errors, rotations as arrays, forward kinematics. Needs NumPy."""
import sys
from pathlib import Path

import numpy as np


def fail(text, status=3):
    """Exit status 2: usage; 3: something that is not there or not what it should be; 4: output that cannot be written."""
    print(f"{Path(sys.argv[0]).name}: {text}", file=sys.stderr)
    sys.exit(status)


def write_lines(path, lines):
    try:
        Path(path).write_text("\n".join(lines) + "\n")
    except OSError as e:
        fail(f"{path}: {e.strerror}", 4)


def rotate(q, v):
    """v turned by the unit quaternions q (wxyz)."""
    w, u = q[..., :1], q[..., 1:]
    return v + 2 * np.cross(u, np.cross(u, v) + w * v)


def product(a, b):
    aw, av, bw, bv = a[..., :1], a[..., 1:], b[..., :1], b[..., 1:]
    return np.concatenate([aw * bw - (av * bv).sum(-1, keepdims=True), aw * bv + bw * av + np.cross(av, bv)], -1)


def joint_positions(parents, offsets, rotations, root):
    """Places of the joints in the world, a list of (T, 3): local rotations (T, J, 4), root (T, 3)."""
    world, places = [], []
    for j, p in enumerate(parents):
        world.append(rotations[:, j] if p < 0 else product(world[p], rotations[:, j]))
        places.append(root if p < 0 else places[p] + rotate(world[p], np.broadcast_to(offsets[j], root.shape)))
    return places
