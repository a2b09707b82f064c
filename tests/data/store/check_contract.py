"""Checks a motion archive or model file against the format's description, with h5py, NumPy and hashlib alone.

usage: check_contract.py archive|model FILE
"""
import hashlib
import json
import struct
import sys

import h5py
import numpy as np

kind, path = sys.argv[1:]
problems = []


def need(condition, text):
    if not condition:
        problems.append(text)


def texts(dataset):
    return [v.decode("utf-8") for v in dataset[()].ravel()]


with open(path, "rb") as f:
    need(f.read(9)[8] >= 2, "superblock version")

f = h5py.File(path, "r")


def check_object(name, obj):
    if not isinstance(obj, h5py.Dataset):
        return
    need(obj.chunks is not None and obj.fletcher32 and obj.shuffle, name + ": chunked, shuffle, fletcher32")
    info = h5py.h5t.check_string_dtype(obj.dtype)
    need(info is None or info.length, name + ": fixed-length strings")
    if info:
        need(obj.id.get_type().get_strpad() == h5py.h5t.STR_NULLPAD and info.encoding == "utf-8", name + ": NUL-padded UTF-8")


f.visititems(check_object)


def shape(name, dims, dtype):
    need(name in f and f[name].shape == dims and f[name].dtype == np.dtype(dtype), "%s: %s %s" % (name, dims, dtype))


complete = json.loads(f.attrs["complete"])
history = [json.loads(line) for line in f["history"][()].tobytes().decode("utf-8").splitlines()]
need(history and set(history[0]) >= {"tool", "version", "commit", "argv", "inputs"}, "history")
need(f.attrs["format_version"] == 1 and f.attrs["format_version"].dtype == np.int32, "format_version")

names = texts(f["skeleton/joint_names"])
J, E = len(names), len(f["skeleton/end_parents"])
shape("skeleton/parents", (J,), "<i4")
shape("skeleton/rest_offsets", (J, 3), "<f4")
shape("skeleton/end_sites", (E, 3), "<f4")
shape("skeleton/end_parents", (E,), "<i4")
need(f["skeleton/roles"].shape[1] == 2, "roles")


def skeleton_hash():
    out = struct.pack("<i", J)
    for n in names:
        out += struct.pack("<i", len(n.encode())) + n.encode()
    out += f["skeleton/parents"][()].tobytes() + struct.pack("<i", E) + f["skeleton/end_parents"][()].tobytes()
    return out + f["skeleton/rest_offsets"][()].tobytes() + f["skeleton/end_sites"][()].tobytes()


if kind == "archive":
    for name, value in [("format", "mocap-motion"), ("length_unit", "m"), ("angle_unit", "rad"), ("up_axis", "z"), ("forward_axis", "x"), ("quaternion_order", "wxyz")]:
        need(f.attrs[name].decode() == value, name)
    need(f.attrs["frame_rate_hz"].dtype == np.float64, "frame_rate_hz")
    N = len(f["clips/name"])
    F = len(f["frames/rotations"])
    need(complete["clips"] == N, "complete")
    for name, dtype in [("start", "<i8"), ("length", "<i8"), ("source_start", "<f8"), ("source_end", "<f8"), ("source_frame_rate_hz", "<f8"), ("phase", "<i4"), ("mirrored", "u1"),
                        ("source_scale", "<f8"), ("source_yaw", "<f8")]:
        shape("clips/" + name, (N,), dtype)
    shape("clips/source_origin", (N, 3), "<f8")
    need((f["clips/source_scale"][()] > 0).all(), "source_scale above 0")
    need(texts(f["clips/source_unit"]) == ["cm", "in"] and texts(f["clips/source_up_axis"]) == ["y", "z"], "source_unit, source_up_axis")
    need((f["clips/source_origin"][1] == [1, -2, 0.5]).all() and f["clips/source_yaw"][1] == 0.25, "source_origin, source_yaw")
    for name in ["name", "source", "source_sha256"]:
        need(len(texts(f["clips/" + name])) == N, name)
    shape("clips/digest", (N, 32), "u1")
    shape("frames/rotations", (F, J, 4), "<f4")
    shape("frames/root_position", (F, 3), "<f4")
    if "contacts" in f["frames"]:
        shape("frames/contacts", (F, 2), "u1")
        need(f.attrs["contacts"].decode().startswith("preset:"), "contacts rule")
    q = f["frames/rotations"][()].astype(float)
    need(np.abs(np.linalg.norm(q, axis=2) - 1).max() < 2e-7, "unit rotations")
    digests = []
    for i in range(N):
        part = slice(f["clips/start"][i], f["clips/start"][i] + f["clips/length"][i])
        need(((q[part][1:] * q[part][:-1]).sum(axis=2) >= 0).all(), "sign-continuous")
        data = struct.pack("<d", f.attrs["frame_rate_hz"]) + skeleton_hash() + f["frames/rotations"][part].tobytes() + f["frames/root_position"][part].tobytes()
        if "contacts" in f["frames"]:
            data += f["frames/contacts"][part].tobytes()
        digests.append(hashlib.sha256(data).digest())
        need(digests[-1] == f["clips/digest"][i].tobytes(), "digest of clip %d" % i)
    need(hashlib.sha256(b"".join(sorted(digests))).hexdigest() == complete["digest"], "digest of the file")
    need(texts(f["clips/attributes/action"]) == ["walking", ""], "attributes")
    need(texts(f["segments/attributes/action"]) == ["jogging"] and f["segments/clip"][0] == 1, "segments")
    shape("paths/run%2Ffast", (2, 2), "<f4")
else:
    need(f.attrs["format"].decode() == "mocap-model" and f.attrs["kind"].decode() == "motion-cell", "format, kind")
    json.loads(f["config"][()].tobytes())
    weights = {}
    f["weights"].visititems(lambda n, o: weights.__setitem__(n, o) if isinstance(o, h5py.Dataset) else None)
    need(complete["tensors"] == len(weights) == 4, "tensors")
    shape("weights/word_encoder/0/weight", (3, 5), "<f4")
    need((f["weights/word_encoder/0/weight"][()].ravel() == np.arange(15)).all(), "C order")
    need(len(f["normalization/mean"]) == len(f["normalization/std"]) == 2, "normalization")
    need(texts(f["vocabulary/action"]) == ["walking", "jogging"], "vocabulary")
    need(texts(f["data/train_sources"]) == ["a" * 64, "b" * 64], "train_sources")
    json.loads(f["training/state"][()].tobytes())
    shape("training/tensors/adam/m/word_encoder/0/weight", (3, 5), "<f4")

for p in problems:
    print("check_contract:", p, file=sys.stderr)
sys.exit(1 if problems else 0)
