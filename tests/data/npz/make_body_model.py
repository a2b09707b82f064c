#!/usr/bin/python3
"""A tiny made-up body model with the members of SMPL's, and what NumPy makes of it (no vertex is anybody's model).

    /usr/bin/python3 make_body_model.py [DIR]

body_model.npz: 24 joints, 60 vertices, 5 shapes; kintree_table unsigned with 2^32 - 1 for the root as SMPL has it. body_model_plain.npz: float32, no shapes,
-1 for the root. body_model_sparse.npz: its regressor pickled. amass_shaped.npz: a clip of 3 frames whose 16 betas it is for.
expected_* members of body_model.npz: joints (24,3) for the first 5 of those betas; and the world positions of the 22 body joints in the clip, by SciPy.
"""
import pathlib
import sys

import numpy as np
from scipy.spatial.transform import Rotation

out = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parent)
rng = np.random.default_rng(11)
PARENTS = [-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21]
J, V, B, N = 24, 60, 5, 3
# A rough T-pose, x left, y up, z forward, so that the clip can be retargeted; then a cloud around it.
rest = np.array([[0, .95, 0], [.08, .87, 0], [-.08, .87, 0], [0, 1.06, -.02], [.1, .47, .01], [-.1, .47, 0], [0, 1.19, 0], [.09, .06, -.03], [-.09, .06, -.03],
                 [0, 1.25, .01], [.12, 0, .1], [-.12, 0, .1], [0, 1.46, -.02], [.08, 1.36, 0], [-.08, 1.36, 0], [0, 1.55, .03], [.19, 1.4, -.02], [-.19, 1.4, -.02],
                 [.45, 1.39, -.03], [-.45, 1.39, -.03], [.7, 1.4, -.03], [-.7, 1.4, -.03], [.79, 1.39, -.04], [-.79, 1.39, -.04]]) - [0.002, 1.18, -.03]
regressor = np.zeros((J, V))
template = rng.normal(0, 0.3, (V, 3))
for j in range(J):
    own = [2 * j, 2 * j + 1]
    regressor[j, own] = [0.6, 0.4]
    template[own[1]] = (rest[j] - 0.6 * template[own[0]]) / 0.4
shapes = rng.normal(0, 0.01, (V, 3, B))
betas = rng.normal(0, 1, 16)
joints = np.einsum("jv,vk->jk", regressor, template + np.einsum("vkb,b->vk", shapes, betas[:B]))

poses = np.zeros((N, 156))
poses[:, :66] = rng.normal(0, 0.3, (N, 66))
trans = rng.normal(0, 1, (N, 3))
positions = np.empty((N, 22, 3))
for t in range(N):
    world = [Rotation.from_rotvec(poses[t, :3])]
    positions[t, 0] = trans[t] + joints[0]
    for j in range(1, 22):
        parent = PARENTS[j]
        positions[t, j] = positions[t, parent] + world[parent].apply(joints[j] - joints[parent])
        world.append(world[parent] * Rotation.from_rotvec(poses[t, 3 * j:3 * j + 3]))

tree = np.array([[2**32 - 1] + PARENTS[1:], range(J)], dtype=np.uint32)
model = dict(J_regressor=regressor, v_template=template, shapedirs=shapes, kintree_table=tree)
np.savez_compressed(out / "body_model.npz", **model, expected_joints=joints, expected_positions=positions, f=np.zeros((2, 3), np.uint32), bs_type=np.array({}, dtype=object))
np.savez_compressed(out / "body_model_plain.npz", J_regressor=regressor.astype(np.float32), v_template=template.astype(np.float32), kintree_table=np.array([PARENTS, range(J)]))
np.savez(out / "amass_shaped.npz", poses=poses, trans=trans, betas=betas, gender="female", mocap_framerate=60.0)

np.savez_compressed(out / "body_model_sparse.npz", **{**model, "J_regressor": np.array({"data": 1}, dtype=object)})
