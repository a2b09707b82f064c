#!/usr/bin/python3
"""npz files as NumPy and the AMASS releases write them, after their documented keys, shapes and types (no AMASS data).

    /usr/bin/python3 make_fixtures.py [DIR]
"""
import pathlib
import sys

import numpy as np
from scipy.spatial.transform import Rotation

out = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parent)
rng = np.random.default_rng(7)
N = 4
SMPL_PARENTS = [-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19]
PELVIS = np.array([-0.00179506, -0.22333382, 0.02821918])

poses = rng.normal(0, 0.8, (N, 156))
poses[0, 3:6] = 0
poses[1, 6:9] = [np.pi - 1e-7, 0, 0]
trans = rng.normal(0, 1, (N, 3))

# What the poses mean, by SciPy in SMPL's own frames: where each joint's SMPL axes x (left), y (up), z (forward) point in
# the Z-up world, [N, 22, 3 (axis), 3 (component)].
axes = np.empty((N, 22, 3, 3))
for t in range(N):
    world = []
    for j, parent in enumerate(SMPL_PARENTS):
        local = Rotation.from_rotvec(poses[t, 3 * j:3 * j + 3])
        world.append(local if parent < 0 else world[parent] * local)
        axes[t, j] = world[-1].as_matrix().T
expected = dict(expected_axes=axes, expected_pelvis=trans + PELVIS)

common = dict(betas=rng.normal(0, 1, 16), dmpls=np.zeros((N, 8)))
np.savez(out / "amass_smplh.npz", poses=poses, trans=trans, gender="female", mocap_framerate=120.00004577636719,
         marker_data=np.zeros((N, 2, 3)), marker_labels=np.array([b"LFHD", b"RTOE"], dtype="S7"), **common, **expected)
np.savez_compressed(out / "amass_smplh_float32.npz", poses=poses.astype(np.float32), trans=trans.astype(np.float32),
                    gender=np.array(b"male", dtype="S6"), mocap_framerate=np.array([59.9999885559082]), **common)
wide = np.zeros((N, 165))
wide[:, :66] = poses[:, :66]
np.savez(out / "amass_smplx.npz", poses=wide, trans=trans, gender=np.array(["neutral"]), mocap_frame_rate=np.float32(30),
         surface_model_type="smplx", markers_latent_vids=np.array({"LFHD": 1}, dtype=object), num_betas=np.int64(16), **common)

# A stageii file with its parts and nothing else: the whole of poses is missing, as in copies that saved space.
np.savez(out / "amass_parts.npz", root_orient=poses[:, :3], pose_body=poses[:, 3:66], trans=trans, gender=np.array(b"female"), surface_model_type=np.array("smplx"),
         mocap_frame_rate=120.0, mocap_time_length=np.float64(N / 120), **common)
np.savez_compressed(out / "amass_parts_smplh.npz", root_orient=poses[:, :3].astype(np.float32), pose_body=poses[:, 3:66].astype(np.float32), trans=trans.astype(np.float32),
                    surface_model_type="smplh", mocap_framerate=np.float32(100))
# The full key list of a stageii file, its shape as one row.
np.savez(out / "amass_stageii.npz", poses=wide, root_orient=poses[:, :3], pose_body=poses[:, 3:66], pose_hand=np.zeros((N, 90)), pose_jaw=np.zeros((N, 3)), pose_eye=np.zeros((N, 6)),
         trans=trans, betas=common["betas"][None], num_betas=np.int64(16), gender=np.array("male"), surface_model_type=np.array("smplx"), mocap_frame_rate=np.float64(59.9999885559082),
         mocap_time_length=np.float64(N / 60), markers_latent=np.zeros((2, 3)), latent_labels=np.array(["LFHD", "RTOE"]), markers_latent_vids=np.array({"LFHD": 1}, dtype=object))
np.savez(out / "stagei.npz", gender="male", betas=np.zeros(16), markers_latent=np.zeros((2, 3)), latent_labels=np.array(["LFHD", "RTOE"]))
np.savez(out / "parts_short.npz", root_orient=poses[:, :3], pose_body=poses[:-1, 3:66], trans=trans, mocap_frame_rate=120.0)
np.savez(out / "parts_wide.npz", root_orient=poses[:, :4], pose_body=poses[:, 3:66], trans=trans, mocap_frame_rate=120.0)

np.savez(out / "shape.npz", gender="male", betas=np.zeros(16))
np.savez(out / "no_trans.npz", poses=poses, mocap_framerate=120.0)
np.savez(out / "no_rate.npz", poses=poses, trans=trans)
np.savez(out / "smpl24.npz", poses=np.zeros((N, 72)), trans=trans, mocap_framerate=60.0)
np.savez(out / "trans_short.npz", poses=poses, trans=trans[:-1], mocap_framerate=60.0)
np.savez(out / "no_frames.npz", poses=np.zeros((0, 156)), trans=np.zeros((0, 3)), mocap_framerate=60.0)
hurt = poses.copy()
hurt[2, 5] = np.nan
np.savez(out / "nan.npz", poses=hurt, trans=trans, mocap_framerate=60.0)

np.savez(out / "dtypes.npz", f4=np.array([0.5, -1], "<f4"), f8=np.float64(1e-300), i4=np.array([[-5, 6]], "<i4"), i8=np.array(2**62),
         u1=np.array([255], "u1"), u4=np.array([2**32 - 1], "<u4"), u8=np.array([2**63 - 1], "<u8"), b1=np.array([True, False]),
         S=np.array([b"", b"ab", b"abc"]), U=np.array(["", "Müller", "骨😀"]), empty=np.zeros((0, 3)),
         fortran_line=np.asfortranarray(np.arange(3.0)))
np.savez(out / "object.npz", a=np.array([{}, 1], dtype=object))
np.savez(out / "fortran.npz", a=np.asfortranarray(np.arange(6.0).reshape(2, 3)))
np.savez(out / "big_endian.npz", a=np.arange(3, dtype=">f8"))
np.savez(out / "structured.npz", a=np.zeros(2, dtype=[("x", "<f8"), ("y", "<i4")]))
np.savez(out / "half.npz", a=np.zeros(2, dtype="<f2"))
np.savez(out / "u8_large.npz", a=np.array([2**63], "<u8"))
