"""Motion archives for the scripts beside it: rotations as arrays, forward kinematics. Needs NumPy."""
import numpy as np


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
