"""Writes a small model file with h5py, NumPy and hashlib alone, digest included.

usage: make_model.py FILE
"""
import hashlib
import json
import struct
import sys

import h5py
import numpy as np


def text(value):
    return np.array(value.encode(), dtype=h5py.string_dtype("utf-8", max(len(value.encode()), 1)))


def hashed(value):
    return struct.pack("<i", len(value.encode())) + value.encode()


def numbers(value):
    return struct.pack("<d", value.size) + value.astype("<f4").tobytes()


kind, config = "motion-cell", json.dumps({"hidden": 8, "joints": 22})
classes = ["walking", "jogging"]
mean, deviation = np.zeros(2, "<f4"), np.ones(2, "<f4")
weights = {"decoder/bias": np.arange(3, dtype="<f4"), "decoder/weight": np.arange(12, dtype="<f4").reshape(3, 4)}

data = hashed(kind) + hashed(config) + hashed("action") + struct.pack("<i", len(classes)) + b"".join(map(hashed, classes)) + numbers(mean) + numbers(deviation)
for name in sorted(weights):
    data += hashed(name) + struct.pack("<i", weights[name].ndim) + b"".join(struct.pack("<d", n) for n in weights[name].shape) + numbers(weights[name])

history = json.dumps({"tool": "train-vrnn", "version": "1", "commit": "c0ffee", "argv": ["train-vrnn", "--steps=3"], "seed": 1, "inputs": []}) + "\n"
with h5py.File(sys.argv[1], "w", libver=("v110", "v110")) as f:
    def put(name, value):
        f.create_dataset(name, data=value, chunks=value.shape, shuffle=True, fletcher32=True)

    put("config", np.frombuffer(config.encode(), dtype="u1"))
    put("history", np.frombuffer(history.encode(), dtype="u1"))
    for name, value in weights.items():
        put("weights/" + name, value)
    put("normalization/mean", mean)
    put("normalization/std", deviation)
    put("vocabulary/action", np.array([c.encode() for c in classes], dtype=h5py.string_dtype("utf-8", 7)))
    put("data/train_sources", np.array([b"a" * 64], dtype=h5py.string_dtype("utf-8", 64)))
    f.attrs.create("format", text("mocap-model"))
    f.attrs.create("format_version", np.int32(1))
    f.attrs.create("kind", text(kind))
    f.attrs.create("complete", text(json.dumps({"tensors": len(weights), "digest": hashlib.sha256(data).hexdigest()})))
