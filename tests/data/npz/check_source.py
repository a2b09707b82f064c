#!/usr/bin/python3
"""Checks a file of the source layout as NumPy sees it (contract: keys, dtypes, shapes): check_source.py FILE N J E."""
import json
import sys

import numpy as np

N, J, E = (int(a) for a in sys.argv[2:])
with np.load(sys.argv[1], allow_pickle=False) as f:
    found = {k: (f[k].shape, f[k].dtype.str) for k in f.files}
    expected = {
        "poses": ((N, 3 * J), "<f8"), "trans": ((N, 3), "<f8"), "mocap_framerate": ((), "<f8"), "mocap_frame_rate": ((), "<f8"),
        "betas": ((16,), "<f8"), "parents": ((J,), "<i4"), "rest_offsets": ((J, 3), "<f8"), "end_sites": ((E, 3), "<f8"),
        "end_parents": ((E,), "<i4"),
    }
    texts = {"gender": (), "joint_names": (J,), "history": ()}
    for key, value in expected.items():
        assert found[key] == value, (key, found[key], value)
    for key, shape in texts.items():
        assert found[key][0] == shape and found[key][1].startswith("<U"), (key, found[key])
    assert set(found) == set(expected) | set(texts), sorted(found)
    assert f["parents"][0] == -1 and not f["betas"].any()
    assert str(f["gender"]) == "neutral" and f["mocap_framerate"] == f["mocap_frame_rate"] == 29.97
    assert list(f["joint_names"]) == ["Hips", "Rücken", "手"], f["joint_names"]
    assert json.loads(str(f["history"]).splitlines()[0])["tool"] == "bvh2npz"
