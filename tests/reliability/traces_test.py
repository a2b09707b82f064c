"""P6, P15, P30: what a tool opens. No socket is made; nothing is written but the outputs and files of $TMPDIR; no file is read that a data file names; standard output carries payload alone.
"""
import shutil
import tempfile
from pathlib import Path

from jobs import *

SYSTEM = ("/dev/", "/proc/", "/sys/", "/usr/", "/lib", "/etc/")  # libraries, devices, what the system says of itself


def traced(command, folder, expected=0, **env):
    """(standard output, files read, files written, sockets); relative to the folder, those of the system left out of what is read."""
    trace = folder.parent / "trace"
    trace.unlink(missing_ok=True)
    status, out, err = run(command, folder, LD_PRELOAD=FAULTS, MOCAPKIT_TRACE=trace, **env)
    expect(status == expected, f"{' '.join(command)}: status {status}: {err}")
    found = {"r": set(), "w": set(), "s": set()}
    for line in trace.read_text().splitlines() if trace.exists() else []:
        found[line[0]].add(line[2:])
    read = {p for p in found["r"] if not p.startswith(SYSTEM)}
    return out, read, {p for p in found["w"] if not p.startswith("/dev/null")}, found["s"]


def check(job, top):
    folder = top / "work"
    shutil.rmtree(folder, ignore_errors=True)
    workplace(folder)
    (folder / "tmp").mkdir()
    out, read, wrote, sockets = traced(words(job, "o"), folder, TMPDIR=folder / "tmp")
    expect(not sockets, f"{job.name}: sockets of families {sockets}")
    output = target(job, "o")
    # The output, a training's log and checkpoints beside it, files in it, temporary ones.
    own = (*([output + ".", output + "/"] if output else []), str(folder / "tmp"))
    strays = {p for p in wrote if p != output and not p.startswith(own)}
    expect(not strays, f"{job.name}: writes {strays}")
    # Inputs by the names of the command line, and what lies in a folder that is named.
    typed = tuple(w for w in job.command.split() if w.startswith("in/"))
    for word in typed:
        expect(any(p.startswith(word) for p in read), f"{job.name}: {word} is not seen to be read: the look is blind")
    strange = {p for p in read if p not in (".", output) and not p.startswith(typed + own)}
    expect(not strange, f"{job.name}: reads {strange}")
    if output and job.name not in ("classify",):
        expect(out == b"", f"{job.name}: {len(out)} bytes on standard output beside -o")
    left = {p for p in written(folder) if p.startswith("tmp/")}
    expect(not left, f"{job.name}: leaves {left}")


def piped(top):
    """-o - is the file, and nothing but the file."""
    folder = top / "pipes"
    workplace(folder)
    jobs = [j for j in FILE_JOBS + NETWORK_JOBS if j.command.endswith("-o OUT") and j.name not in ("bvh2npz", "motion-split", "motion-export", "motion-export.npz", "make-corpus")]
    for job in jobs:
        status, _, err = run(words(job, "o"), folder)
        expect(status == 0, err)
        status, out, err = run([w if w != "-q" else "-v" for w in words(job, "-")], folder)
        expect(status == 0, f"{job.name} -o -: {err}")
        if job.name != "classify":  # whose report is on standard output, or on standard error beside an archive there
            expect(out == (folder / "o").read_bytes(), f"{job.name} -o -: {len(out)} bytes, the file has {(folder / 'o').stat().st_size}")
        (folder / "o").unlink()
    return len(jobs)


def names_inside(top):
    """Data that names another file: external links and external storage of HDF5, a log entry, an absolute member of a zip."""
    import h5py
    import zipfile
    folder = top / "named"
    workplace(folder)
    secret = top / "secret.h5"
    shutil.copy(INPUTS / "few.h5", secret)
    raw = top / "secret.raw"
    raw.write_bytes(b"\0" * 65536)
    shutil.copy(INPUTS / "few.h5", folder / "link.h5")
    with h5py.File(folder / "link.h5", "a") as f:
        del f["frames/rotations"]
        f["frames/rotations"] = h5py.ExternalLink(str(secret), "/frames/rotations")
    shutil.copy(INPUTS / "few.h5", folder / "storage.h5")
    with h5py.File(folder / "storage.h5", "a") as f:
        old = f["frames/root_position"]
        shape, dtype = old.shape, old.dtype
        del f["frames/root_position"]
        f.create_dataset("frames/root_position", shape=shape, dtype=dtype, external=[(str(raw), 0, h5py.h5f.UNLIMITED)])
    with zipfile.ZipFile(folder / "path.npz", "w") as z:
        z.writestr(str(top / "planted.npy"), b"x")
    (folder / "name.bvh").write_text((INPUTS / "few" / "walking_f001_1.bvh").read_text().replace("JOINT ", f"JOINT {secret}", 1))
    (folder / "doctype.svg").write_text(f'<!DOCTYPE svg [<!ENTITY x SYSTEM "file://{secret}">]><svg xmlns="http://www.w3.org/2000/svg"><path d="M0 0 L1 0"/><text>&x;</text></svg>')
    for command, expected in ((["motion-info", "-q", "--check=full", "link.h5"], 3), (["motion-info", "-q", "--check=full", "storage.h5"], 3), (["bvh2npz", "-q", "path.npz", "-o", "o"], 3),
                              (["bvh2npz", "-q", "name.bvh", "-o", "o"], 0),
                              *([("follow-path -q -m in/lstm.h5 --path doctype.svg --window 8 --overlap 4 --particles 4 --rounds 1 --iterations 2 --most-seconds 0.3 -o p.h5".split(), 0)] if NETWORKS else [])):
        _, read, wrote, _ = traced(command, folder, expected)
        opened = {p for p in read | wrote if "secret" in p or "planted" in p}
        expect(not opened, f"{' '.join(command)}: opens {opened}")


def is_seen(top):
    """The look can fail: a program that makes a socket, reads and writes elsewhere."""
    folder = top / "seen"
    workplace(folder)
    (top / "elsewhere").write_text("x")
    out, read, wrote, sockets = traced(["bash", "-c", f"head -c1 {top}/elsewhere > /dev/null; /usr/bin/python3 -c 'import socket; socket.socket(); open(\"{top}/stray\", \"w\")'"], folder)
    expect(str(top / "elsewhere") in read and str(top / "stray") in wrote, f"not all is seen of what is opened: {read} {wrote}")
    expect(sockets, "a socket is not seen")


def test():
    with tempfile.TemporaryDirectory() as name:
        top = Path(name)
        is_seen(top)
        for job in ALL:
            check(job, top)
        pipes = piped(top)
        names_inside(top)
    print(f"{len(ALL)} commands traced, {pipes} outputs through a pipe equal to the file")


main(test)
