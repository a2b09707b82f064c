"""P13, P14, P17 to P20: nightly batches. A rerun writes nothing, a changed input rewrites one output, memory does not grow with the number of clips; odd files and names go through or are
refused by name; sizes that a header only promises are refused before memory is taken; numbers mean the same in every locale. (Bad files among good ones: tests/pipeline/bad_inputs.sh.)
"""
import os
import re
import shutil
import tempfile
from pathlib import Path

from jobs import *

FEW, MANY, GROWTH_MB = 200, 2000, 12
LIMIT_MB = 64


# A process counts what its parent held when it was started: an interpreter of its own, with nothing in memory, starts the command.
STARTER = "import os, sys; p = os.posix_spawnp(sys.argv[2], sys.argv[2:], os.environ); _, s, u = os.wait4(p, 0); open(sys.argv[1], 'w').write(str(u.ru_maxrss)); sys.exit(os.waitstatus_to_exitcode(s) % 256)"


def measured(command, folder):
    """(status, standard error, peak resident memory in MB)."""
    peak = folder / "peak"
    status, _, err = run(["/usr/bin/python3", "-S", "-c", STARTER, str(peak), *command], folder)
    return status, err, int(peak.read_text()) / 1024


def opened_for_writing(command, folder):
    """The paths a run opened for writing, .part names cut back to the output's."""
    trace = folder / "trace"
    trace.unlink(missing_ok=True)
    status, _, err = run(command, folder, LD_PRELOAD=FAULTS, MOCAPKIT_TRACE=trace)
    expect(status == 0, f"{' '.join(command)}: {err}")
    lines = trace.read_text().splitlines() if trace.exists() else []
    return {line[2:].split(".part-")[0] for line in lines if line.startswith("w ") and not line.startswith("w /dev/")}


def reruns(folder):
    workplace(folder)
    shutil.copytree(INPUTS / "corpus", folder / "batch")
    for tool, extra, output in (("bvh2npz", [], None), ("canonicalize", [], {"out"})):
        command = [tool, "-q", "batch", "-o", "out", "--skip-existing", *extra]
        made = opened_for_writing(command, folder)
        expect(made == (output or {f"out/{p.stem}.npz" for p in (folder / "batch").glob("*.bvh")}), f"{tool}: first run writes {made}")
        again = opened_for_writing(command, folder)
        expect(not again, f"{tool}: a rerun of a finished batch writes {again}")
        changed = folder / "batch" / "walking_f001_1.bvh"
        shutil.copy(INPUTS / "corpus" / "jogging_f001_1.bvh", changed)
        rewritten = opened_for_writing(command, folder)
        expect(rewritten == (output or {"out/walking_f001_1.npz"}), f"{tool}: after one changed input {rewritten} is written")
        shutil.copy(INPUTS / "corpus" / "walking_f001_1.bvh", changed)
        shutil.rmtree(folder / "out", ignore_errors=True)
        (folder / "out").unlink(missing_ok=True)


def memory(folder):
    """Peaks of every tool that works through clips, with FEW and with MANY of them, in MB."""
    workplace(folder)
    files = sorted((INPUTS / "corpus").glob("*.bvh"))
    for count in (FEW, MANY):
        (folder / f"b{count}").mkdir()
        for i in range(count):
            (folder / f"b{count}" / f"clip{i:04}.bvh").symlink_to(files[i % len(files)].resolve())
    peaks = {}
    for command in ("canonicalize -q -j 2 bN -o aN", "bvh2npz -q -j 2 bN -o nN", "motion-select -q aN --time 0:1 -o sN", "motion-merge -q aN -o mN", "motion-export -q -j 2 aN -o eN",
                    "motion-split -q aN --ratios 2,1,1 -o pN", "motion-info -q --check=full aN", *(["refine -q -j 2 --pin-feet aN -o rN"] if NETWORKS else [])):
        both = []
        for count in (FEW, MANY):
            status, err, peak = measured([re.sub("^([a-z])N$", rf"\g<1>{count}", w) for w in command.split()], folder)
            expect(status == 0, f"{command}: {err}")
            both.append(peak)
        peaks[command.split()[0]] = both
        # As many clips of 2 s more are 45 MB of rotations in an archive, twice that in memory; buffers that fill and an index entry for each clip are what may grow.
        expect(both[1] - both[0] < GROWTH_MB, f"{command}: {both[0]:.0f} MB for {FEW} clips, {both[1]:.0f} MB for {MANY}")
    return peaks


BVH = """HIERARCHY
ROOT Hips
{{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  End Site
  {{
    OFFSET 0 10 0
  }}
}}
MOTION
Frames: {frames}
Frame Time: 0.0333333
{rows}"""


def odd_files(folder):
    """What is no ordinary clip is read, or refused with file and reason."""
    workplace(folder)
    tiny = (INPUTS / "corpus" / "walking_f001_1.bvh").read_text()
    head, motion = tiny.split("MOTION", 1)
    rows = motion.splitlines()[3:]
    one_frame = head + "MOTION\nFrames: 1\nFrame Time: 0.0333333\n" + rows[0] + "\n"
    cases = {
        "empty.bvh": ("", 3, "empty|HIERARCHY"),
        "no frames.bvh": (head + "MOTION\nFrames: 0\nFrame Time: 0.0333333\n", 3, "Frames|frame"),
        "one frame.bvh": (one_frame, 0, ""),
        "one joint.bvh": (BVH.format(frames=2, rows="0 1 0 0 0 0\n0 1 0 1 0 0\n"), 0, ""),
        "a name with blanks.bvh": (tiny, 0, ""),
        "new\nline.bvh": (tiny, 0, ""),
        "-dash.bvh": (tiny, 0, ""),
        "Größe.bvh": (tiny, 0, ""),
    }
    for name, (text, expected, reason) in cases.items():
        (folder / name).write_text(text)
        # As a user would have to write it: a leading dash needs "--" or "./".
        status, _, err = run(["bvh2npz", "-o", "odd/", "-q", "--", name], folder)
        expect(status == expected, f"bvh2npz {name!r}: status {status}, expected {expected}: {err}")
        expect(status == 0 or (name in err and re.search(reason, err)), f"bvh2npz {name!r}: {err}")
        if status == 0 and name != "one joint.bvh":
            status, _, err = run(["canonicalize", "-q", "-f", "-o", "odd.h5", "--", name], folder)
            expect(status == 0, f"canonicalize {name!r}: {err}")
            status, _, err = run(["motion-info", "-q", "--check=full", "odd.h5"], folder)
            expect(status == 0, f"motion-info of {name!r}: {err}")
    made = {p.name for p in (folder / "odd").iterdir()}
    expect({"_-dash.npz", "Größe.npz", "a name with blanks.npz"} <= made or {"-dash.npz", "Größe.npz", "a name with blanks.npz"} <= made, f"outputs {made}")
    # A million frames.
    frames = 1_000_000
    (folder / "long.bvh").write_text(BVH.format(frames=frames, rows="".join(f"0 1 {i % 7} {i % 11} 0 0\n" for i in range(frames))))
    status, err, peak = measured(["bvh2npz", "-q", "long.bvh", "-o", "long.npz"], folder)
    expect(status == 0, f"a million frames: {err}")
    import numpy as np
    with np.load(folder / "long.npz") as arrays:
        lengths = {k: arrays[k].shape[0] for k in ("poses", "trans") if k in arrays}
    expect(set(lengths.values()) == {frames}, f"a million frames: {lengths}")
    return peak


def hostile_sizes(folder):
    """What a header promises and the file does not hold is refused before memory is taken for it; so are numbers that are none, whatever the locale."""
    import io
    import zipfile
    import h5py
    import numpy as np
    workplace(folder)
    base = (INPUTS / "corpus" / "walking_f001_1.bvh").read_text()
    cases = []
    for size in ("2147483648", "1125899906842624", "-1", "99999999999999999999"):
        (folder / f"frames {size}.bvh").write_text(BVH.format(frames=size, rows="0 1 0 0 0 0\n"))
        cases.append((f"frames {size}.bvh", f"frames {size}.bvh:12"))
        header = f"{{'descr': '<f8', 'fortran_order': False, 'shape': ({size}, 156), }}".ljust(117) + "\n"
        data = io.BytesIO()
        with zipfile.ZipFile(data, "w") as z:
            z.writestr("poses.npy", b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header.encode() + b"12345678")
        (folder / f"shape {size}.npz").write_bytes(data.getvalue())
        cases.append((f"shape {size}.npz", f"shape {size}.npz"))
    for size in (2**31, 2**50):
        path = folder / f"rows {size}.h5"
        shutil.copy(INPUTS / "few.h5", path)
        with h5py.File(path, "a") as f:
            old = f["frames/rotations"]
            shape = (size, *old.shape[1:])
            dtype = old.dtype
            del f["frames/rotations"]
            f.create_dataset("frames/rotations", shape=shape, dtype=dtype, chunks=(1024, *shape[1:]), maxshape=(None, *shape[1:]), shuffle=True, fletcher32=True)
        cases.append((path.name, path.name))
    depth = 100_000
    (folder / "deep.bvh").write_text("HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n" + "".join(f"JOINT j{i}\n{{\nOFFSET 0 0 0\nCHANNELS 0\n" for i in range(depth)) + "}\n" * depth)
    cases.append(("deep.bvh", "deep.bvh"))
    worst = 0
    for name, place in cases:
        tool = ["motion-info", "-q"] if name.endswith(".h5") else ["bvh2npz", "-q", "-o", "x"]
        status, err, peak = measured(tool + ["--", name], folder)
        expect(status == 3 and place in err, f"{name}: status {status}, {err}")
        if name != "deep.bvh":
            worst = max(worst, peak)
            expect(peak < LIMIT_MB, f"{name}: {peak:.0f} MB before it was refused")
    # Numbers.
    lines = base.splitlines()
    row = next(i for i, line in enumerate(lines) if line.startswith("Frame Time")) + 1
    for bad in ("nan", "inf", "-inf", "1e400", "1,5", "0x10", "1.5.5", "１"):
        words_ = lines[row].split()
        words_[2] = bad
        (folder / "number.bvh").write_text("\n".join(lines[:row] + [" ".join(words_)] + lines[row + 1:]) + "\n")
        status, _, err = run(["bvh2npz", "-q", "number.bvh", "-o", "x"], folder)
        expect(status == 3 and f"number.bvh:{row + 1}" in err, f"{bad}: status {status}, {err}")
    return worst


def first_moments(folder):
    """What two threads do first in a process, they do at once: libzip lost one output of thirty runs."""
    workplace(folder)
    for i in range(150):
        status, _, err = run(["bvh2npz", "-q", "-f", "-j", "2", "in/few", "-o", "o"], folder)
        expect(status == 0, f"run {i} of bvh2npz on two threads: status {status}: {err}")


def test():
    with tempfile.TemporaryDirectory() as name:
        top = Path(name)
        reruns(top / "reruns")
        first_moments(top / "first")
        peaks = memory(top / "memory")
        long_peak = odd_files(top / "odd")
        worst = hostile_sizes(top / "hostile")
    print(f"peak MB for {FEW} and {MANY} clips: " + ", ".join(f"{k} {v[0]:.0f} {v[1]:.0f}" for k, v in peaks.items()))
    print(f"a million frames: {long_peak:.0f} MB; hostile headers: at most {worst:.0f} MB")


main(test)
