#!/usr/bin/python3
"""Checks a file of the AMASS layout against SMPL's own kinematics in SciPy: check_amass.py FILE.

The clip has: frame 0 the canonical rest pose facing +X at pelvis (1, 2, 0.9); frame 1 the same turned 90 degrees
counter-clockwise about Z, with the left elbow bent 90 degrees forward.
"""
import sys

import numpy as np
from scipy.spatial.transform import Rotation

PARENTS = [-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19]
LEFT, UP, FORWARD = np.eye(3)  # of a joint at rest, in SMPL's frames
with np.load(sys.argv[1], allow_pickle=False) as f:
    poses, trans = f["poses"], f["trans"]
    assert poses.shape == (2, 156) and poses.dtype == np.float64 and not poses[:, 66:].any()
    assert f["mocap_framerate"].shape == () and f["mocap_framerate"] == 60
    assert str(f["gender"]) == "female" and f["betas"].shape == (16,)
    np.testing.assert_allclose(trans + [-0.00179506, -0.22333382, 0.02821918], [[1, 2, 0.9]] * 2, atol=1e-12)


def world(t, joint):
    r = Rotation.identity()
    while joint >= 0:
        r = Rotation.from_rotvec(poses[t, 3 * joint:3 * joint + 3]) * r
        joint = PARENTS[joint]
    return r


for joint in range(22):
    np.testing.assert_allclose(world(0, joint).apply([FORWARD, LEFT, UP]), np.eye(3), atol=1e-12)
    if joint not in (18, 20):
        np.testing.assert_allclose(world(1, joint).apply([FORWARD, LEFT, UP]), [[0, 1, 0], [-1, 0, 0], [0, 0, 1]], atol=1e-12)
# The forearm at rest points left; bent, it points where the body faces, which is +Y after the turn.
np.testing.assert_allclose(world(1, 18).apply(LEFT), [0, 1, 0], atol=1e-12)
