"""Writes one damaged copy of a motion archive per defect, with h5py as a writer that is not ours.

usage: make_defects.py ARCHIVE DIR
Prints a tab-separated line for each: file, how it must be found ("open", "read", "check"), a part of the message.
The archive must have two clips, contacts, a segment and a path (tests/store/hostile_test.cpp writes it).
"""
import json
import os
import shutil
import sys

import h5py
import numpy as np

base, folder = sys.argv[1:]


def defect(name, found, message):
    def decorate(change):
        path = os.path.join(folder, name + ".h5")
        shutil.copy(base, path)
        with h5py.File(path, "r+", libver=("v110", "v110")) as f:
            change(f)
        print(name + ".h5", found, message, sep="\t")

    return decorate


def replace(f, name, value, **options):
    del f[name]
    create(f, name, value, **options)


def create(f, name, value, **options):
    value = np.asarray(value)
    settings = dict(chunks=tuple(max(n, 1) for n in value.shape), shuffle=True, fletcher32=True)
    if 0 in value.shape:  # h5py refuses chunks larger than the data unless it may grow
        settings["maxshape"] = (None,) * value.ndim
    settings.update(options)
    f.create_dataset(name, data=value, **settings)


def fixed(values, length=32):
    return np.array([v if isinstance(v, bytes) else v.encode() for v in values], dtype=h5py.string_dtype("utf-8", length))


def text_attribute(f, name, text):
    f.attrs.create(name, np.array(text.encode(), dtype=h5py.string_dtype("utf-8", len(text))))


def declared(f, name, shape, dtype, chunks, deflate=False):
    """A dataset that declares a shape and holds nothing."""
    del f[name]
    f.create_dataset(name, shape=shape, dtype=dtype, chunks=chunks, shuffle=True, fletcher32=True, compression=9 if deflate else None)


# --- the markers
defect("unfinished", "open", "attribute complete: missing: the file is unfinished")(lambda f: f.attrs.__delitem__("complete"))
defect("no_format", "open", "without the attribute format, expected a motion archive")(lambda f: f.attrs.__delitem__("format"))
defect("other_format", "open", "'somebody', expected 'mocap-motion'")(lambda f: text_attribute(f, "format", "somebody"))
defect("model_format", "open", "'mocap-model', expected 'mocap-motion'")(lambda f: text_attribute(f, "format", "mocap-model"))
defect("version_2", "open", "attribute format_version: 2, expected 1")(lambda f: f.attrs.create("format_version", np.int32(2)))
defect("version_0", "open", "attribute format_version: 0, expected 1")(lambda f: f.attrs.create("format_version", np.int32(0)))
defect("version_text", "open", "of another type, expected one number")(lambda f: text_attribute(f, "format_version", "1"))
defect("format_array", "open", "of another type, expected one string")(lambda f: f.attrs.create("format", np.array([b"mocap-motion"] * 2)))
defect("format_variable", "open", "of another type, expected one string")(lambda f: f.attrs.create("format", "mocap-motion", dtype=h5py.string_dtype()))
defect("centimetres", "open", "attribute length_unit: 'cm', expected 'm'")(lambda f: text_attribute(f, "length_unit", "cm"))
defect("xyzw", "open", "attribute quaternion_order: 'xyzw', expected 'wxyz'")(lambda f: text_attribute(f, "quaternion_order", "xyzw"))
defect("rate_nan", "open", "attribute frame_rate_hz")(lambda f: f.attrs.create("frame_rate_hz", np.float64("nan")))
defect("rate_negative", "open", "attribute frame_rate_hz: -30")(lambda f: f.attrs.create("frame_rate_hz", np.float64(-30)))
defect("complete_count", "open", "2 clips, expected 3 as the attribute complete says")(
    lambda f: text_attribute(f, "complete", json.dumps({**json.loads(f.attrs["complete"]), "clips": 3})))
defect("complete_digest", "open", "do not fit the attribute complete")(lambda f: text_attribute(f, "complete", json.dumps({"clips": 2, "digest": "0" * 64})))
defect("complete_text", "open", "attribute complete: 'yes'")(lambda f: text_attribute(f, "complete", "yes"))
defect("complete_type", "open", "attribute complete")(lambda f: text_attribute(f, "complete", '{"clips": -1, "digest": 3}'))
defect("history_text", "open", "history line 1")(lambda f: replace(f, "history", np.frombuffer(b"not json\n", dtype="u1")))
defect("history_deep", "open", "history line 1")(lambda f: replace(f, "history", np.frombuffer(b"[" * 200000, dtype="u1")))


# --- what HDF5 can do and an archive must not
@defect("soft_link", "open", "clips/name: a soft or external link")
def _(f):
    f.move("clips/name", "elsewhere")
    f["clips/name"] = h5py.SoftLink("/elsewhere")


@defect("soft_group", "open", "clips: a soft or external link")
def _(f):
    f.move("clips", "elsewhere")
    f["clips"] = h5py.SoftLink("/elsewhere")


@defect("external_link", "open", "frames/rotations: a soft or external link")
def _(f):
    del f["frames/rotations"]
    f["frames/rotations"] = h5py.ExternalLink("secret.h5", "/data")


@defect("external_attribute", "open", "clips/attributes/action: a soft or external link")
def _(f):
    del f["clips/attributes/action"]
    f["clips/attributes/action"] = h5py.ExternalLink("secret.h5", "/data")


@defect("external_storage", "open", "frames/root_position: not a chunked dataset of this file")
def _(f):
    shape = f["frames/root_position"].shape
    del f["frames/root_position"]
    f.create_dataset("frames/root_position", shape=shape, dtype="<f4", external=[("/etc/passwd", 0, 12 * shape[0])])


@defect("virtual", "open", "frames/root_position: not a chunked dataset of this file")
def _(f):
    shape = f["frames/root_position"].shape
    del f["frames/root_position"]
    layout = h5py.VirtualLayout(shape=shape, dtype="<f4")
    layout[:] = h5py.VirtualSource("secret.h5", "data", shape=shape)
    f.create_virtual_dataset("frames/root_position", layout)


@defect("contiguous", "open", "clips/start: not a chunked dataset of this file")
def _(f):
    value = f["clips/start"][()]
    del f["clips/start"]
    f.create_dataset("clips/start", data=value)


defect("scalar", "open", "clips/start: not a chunked dataset")(lambda f: (f.__delitem__("clips/start"), f.create_dataset("clips/start", data=np.int64(0))))
defect("no_checksum", "open", "clips/length: no checksums")(lambda f: replace(f, "clips/length", f["clips/length"][()], fletcher32=False))
defect("other_filter", "open", "clips/length: filter 32000")(lambda f: replace(f, "clips/length", f["clips/length"][()], compression="lzf"))
defect("variable_strings", "open", "clips/name: strings of variable length")(
    lambda f: (f.__delitem__("clips/name"), f.create_dataset("clips/name", data=["a", "b"], dtype=h5py.string_dtype(), chunks=(2,))))
defect("dataset_for_group", "open", "not a group")(lambda f: (f.__delitem__("clips/attributes"), create(f, "clips/attributes", np.zeros(2, "u1"))))
defect("group_for_dataset", "open", "clips/phase: not a dataset")(lambda f: (f.__delitem__("clips/phase"), f.create_group("clips/phase")))
defect("cycle", "check", "groups nested deeper than 16, or in a cycle")(lambda f: (f.create_group("loop"), [f["loop"].__setitem__(n, f["loop"]) for n in "abcdefgh"]))


@defect("lattice", "check", "more objects than the file has room for")
def _(f):
    group = f.create_group("lattice")
    for _ in range(12):  # 8^12 paths lead to the last group
        below = group.create_group("a")
        for name in "bcdefgh":
            group[name] = below
        group = below


defect("deep", "check", "groups nested deeper")(lambda f: f.create_group("/".join("d" * 40)))
defect("unknown_dataset", "fine", "")(lambda f: create(f, "frames/joint_positions", np.zeros((3, 2), "<f4")))
defect("chunk_of_64_mb", "open", "chunks of 67108864 bytes")(lambda f: replace(f, "clips/phase", f["clips/phase"][()], chunks=(1 << 24,), maxshape=(None,), compression=9))

# --- declared sizes
for label, n in [("2_31", 2**31), ("2_50", 2**50), ("2_62", 2**62)]:
    defect("names_" + label, "open", "clips/name: ")(lambda f: declared(f, "clips/name", (n,), "S16", (1 << 10,)))
    defect("rotations_" + label, "open", "frames/rotations: ")(lambda f: declared(f, "frames/rotations", (n, 2, 4), "<f4", (1 << 10, 2, 4)))
    defect("history_" + label, "open", "history: ")(lambda f: declared(f, "history", (n,), "u1", (1 << 20,), deflate=True))
    defect("length_" + label, "open", "expected rows of the")(lambda f: replace(f, "clips/length", np.array([n, 1])))
    defect("start_" + label, "open", "expected rows of the")(lambda f: replace(f, "clips/start", np.array([n, 1])))
    defect("segment_" + label, "open", "segments row 0")(lambda f: replace(f, "segments/length", np.array([n])))
defect("rotations_deflated", "open", "chunks, expected")(lambda f: declared(f, "frames/rotations", (100000, 2, 4), "<f4", (1 << 10, 2, 4), deflate=True))
defect("string_of_2_31", "open", "more than the file can hold")(lambda f: declared(f, "clips/source", (2,), "S2147483647", (1,)))
for label, n in [("minus_1", -1), ("0", 0)]:
    defect("length_" + label, "open", "expected rows of the")(lambda f: replace(f, "clips/length", np.array([n, 1])))
defect("start_minus_1", "open", "expected rows of the")(lambda f: replace(f, "clips/start", np.array([-1, 1])))
defect("no_clips", "open", "no clips, expected at least one")(lambda f: replace(f, "clips/name", fixed([])))
defect("no_joints", "open", "no joints")(lambda f: [replace(f, "skeleton/" + n, np.zeros((0,) + f["skeleton/" + n].shape[1:], f["skeleton/" + n].dtype))
                                                    for n in ["parents", "joint_names", "rest_offsets"]])

# --- shapes, types, values of the index
defect("missing", "open", "clips/digest: missing")(lambda f: f.__delitem__("clips/digest"))
defect("missing_frames", "open", "frames/rotations: missing, expected a dataset")(lambda f: f.__delitem__("frames"))
defect("missing_contacts", "open", "frames/contacts: missing, expected contacts by rule preset:x")(lambda f: f.__delitem__("frames/contacts"))
defect("missing_rule", "open", "attribute contacts: missing")(lambda f: f.attrs.__delitem__("contacts"))
defect("row_short", "open", "clips/start: shape [1], expected [2]")(lambda f: replace(f, "clips/start", f["clips/start"][:1]))
defect("rank", "open", "clips/start: shape [2,1], expected [2]")(lambda f: replace(f, "clips/start", f["clips/start"][()].reshape(2, 1)))
defect("joints", "open", "frames/rotations: shape")(lambda f: replace(f, "frames/rotations", f["frames/rotations"][:, :1]))
defect("root_rows", "open", "frames/root_position: shape")(lambda f: replace(f, "frames/root_position", f["frames/root_position"][:-1]))
defect("float64", "open", "frames/rotations: float64, expected float32")(lambda f: replace(f, "frames/rotations", f["frames/rotations"][()].astype("<f8")))
defect("big_endian", "open", "frames/rotations: a type not known here")(lambda f: replace(f, "frames/rotations", f["frames/rotations"][()].astype(">f4")))
defect("uint64", "open", "clips/start: a type not known here")(lambda f: replace(f, "clips/start", f["clips/start"][()].astype("<u8")))
defect("names_as_numbers", "open", "clips/name: int64, expected strings")(lambda f: replace(f, "clips/name", f["clips/start"][()]))
defect("name_twice", "open", "occurs twice")(lambda f: replace(f, "clips/name", fixed(["a", "a"])))
defect("name_empty", "open", "row 1 is empty")(lambda f: replace(f, "clips/name", fixed(["a", ""])))
defect("name_latin_1", "open", "row 0 is not UTF-8")(lambda f: replace(f, "clips/name", fixed([b"l\xe4ufer", "b"])))
defect("name_nul", "open", "row 0 is not UTF-8")(lambda f: replace(f, "clips/name", fixed([b"a\0b", "b"])))
defect("source_nan", "open", "not finite")(lambda f: replace(f, "clips/source_end", np.array([np.nan, 1])))
defect("digest_changed", "open", "do not fit the attribute complete")(lambda f: replace(f, "clips/digest", f["clips/digest"][()] ^ 1))
defect("parent_cycle", "open", "expected a joint before it")(lambda f: replace(f, "skeleton/parents", np.array([-1, 1], "<i4")))
defect("parent_range", "open", "expected a joint before it")(lambda f: replace(f, "skeleton/parents", np.array([-1, 2**31 - 1], "<i4")))
defect("end_parent", "open", "end site")(lambda f: replace(f, "skeleton/end_parents", np.array([5], "<i4")))
defect("offset_inf", "open", "not finite")(lambda f: replace(f, "skeleton/rest_offsets", np.full((2, 3), np.inf, "<f4")))
defect("role_unknown", "open", "does not exist")(lambda f: replace(f, "skeleton/roles", fixed(["head", "nobody"]).reshape(1, 2)))
defect("segment_clip", "open", "segments row 0: clip 2, expected a row of /clips")(lambda f: replace(f, "segments/clip", np.array([2])))
defect("path_shape", "open", "paths/first: shape")(lambda f: replace(f, "paths/first", np.zeros((2, 3), "<f4")))


# --- frames: found when the clip is read, or by a full check
def frames(name, change, **options):
    def apply(f):
        value = f[name][()]
        change(value)
        replace(f, name, value, **options)

    return apply


defect("nan_rotation", "read", "norm")(frames("frames/rotations", lambda v: v.__setitem__((1, 1), np.nan)))
defect("zero_rotation", "read", "frame 1 joint tip: a quaternion of norm 0")(frames("frames/rotations", lambda v: v.__setitem__((1, 1), 0)))
defect("inf_position", "read", "not finite")(frames("frames/root_position", lambda v: v.__setitem__((1, 1), np.inf)))
defect("contact_7", "read", "a contact other than 0 and 1")(frames("frames/contacts", lambda v: v.__setitem__((1, 1), 7)))
defect("path_nan", "read", "a path point that is not finite")(frames("paths/first", lambda v: v.__setitem__((1, 1), np.nan)))
defect("moved", "check", "clip first: the frames do not fit the clip's digest")(frames("frames/root_position", lambda v: v.__setitem__((1, 1), 5)))
defect("contact_changed", "check", "clip first: the frames do not fit the clip's digest")(frames("frames/contacts", lambda v: v.__setitem__((1, 1), 1 - v[1, 1])))
defect("norm_off", "check", "a quaternion of norm 1.0003")(frames("frames/rotations", lambda v: v.__setitem__((1, 1), v[1, 1] * np.float32(1.0003))))
defect("sign_jump", "check", "expected continuous signs")(frames("frames/rotations", lambda v: v.__setitem__((1, 1), -v[1, 1])))
defect("overlap", "check", "clip second: starts at frame 3, expected 4: clips lie end to end")(lambda f: replace(f, "clips/start", np.array([0, 3])))
defect("path_of_nobody", "check", "paths/nobody: no clip of this name")(lambda f: create(f, "paths/nobody", np.zeros((1, 2), "<f4")))
defect("source_hash", "check", "SHA-256 digest")(lambda f: replace(f, "clips/source_sha256", fixed(["zz", ""])))
defect("repacked", "fine", "")(frames("frames/rotations", lambda v: None, chunks=(1, 2, 4), compression=4))

# --- HDF5 files of somebody else
with h5py.File(os.path.join(folder, "foreign.h5"), "w") as f:
    f["data"] = np.arange(10)
print("foreign.h5", "open", "an HDF5 file with superblock version 0, expected a motion archive", sep="\t")
with h5py.File(os.path.join(folder, "foreign_new.h5"), "w", libver=("v110", "v110")) as f:
    f["data"] = np.arange(10)
print("foreign_new.h5", "open", "without the attribute format, expected a motion archive", sep="\t")


# --- where clips lie in their sources: columns that older archives lack
@defect("older", "fine", "")
def _(f):
    for name in ["unit", "up_axis", "scale", "yaw", "origin"]:
        del f["clips/source_" + name]


defect("scale_zero", "open", "clip second: source scale 0.000000, expected a finite number above 0")(lambda f: replace(f, "clips/source_scale", [1.0, 0.0]))
defect("scale_nan", "open", "clip first: source scale nan")(lambda f: replace(f, "clips/source_scale", [np.nan, 1.0]))
defect("scale_short", "open", "clips/source_scale")(lambda f: replace(f, "clips/source_scale", [1.0]))
defect("yaw_inf", "open", "clip first: a source yaw that is not finite")(lambda f: replace(f, "clips/source_yaw", [np.inf, 0.0]))
defect("origin_nan", "open", "clip second: a source origin that is not finite")(lambda f: replace(f, "clips/source_origin", [[0.0, 0, 0], [0, np.nan, 0]]))
defect("origin_flat", "open", "clips/source_origin")(lambda f: replace(f, "clips/source_origin", [0.0, 0.0]))
defect("unit_short", "open", "clips/source_unit")(lambda f: replace(f, "clips/source_unit", fixed(["m"])))
defect("up_axis_x", "check", "clip second: source up axis 'x', expected y or z")(lambda f: replace(f, "clips/source_up_axis", fixed(["y", "x"])))
