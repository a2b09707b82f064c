"""P1, P3: whichever write, fsync, rename, close or truncate of a tool fails, once or from then on, it says so in one line with status 4, and what is at the output's place is the whole
new file, the old one, or nothing; no .part stays. Every call of the tools without LibTorch, some of those with it.
"""
import re
import shutil
import tempfile
from pathlib import Path

from jobs import *


def faulty(job, folder, operation, n, what, old=None, **env):
    """Runs `job` in a fresh `folder` with a fault; (whether it happened, status, standard error)."""
    shutil.rmtree(folder, ignore_errors=True)
    workplace(folder)
    (folder / "tmp").mkdir()
    command = words(job, "o")
    if old:
        (folder / target(job, "o")).write_text(old)
        command.append("-f")
    hit = folder.parent / "hit"
    hit.unlink(missing_ok=True)
    status, _, err = run(command, folder, LD_PRELOAD=FAULTS, MOCAPKIT_FAULT=f"{operation}:{n}:{what}", MOCAPKIT_FAULT_HIT=hit, TMPDIR=folder / "tmp", **env)
    return hit.exists(), status, err


def whole(job, found, reference, old=None):
    """What is wrong with the files a failed run left."""
    for name, digest in found.items():
        if ".part" in name or name.startswith("tmp/"):
            return f"left {name}"
        if job.training and name.endswith((".log.tsv", ".ckpt-1", ".ckpt-2")):
            continue  # a log grows row by row; a checkpoint is opened by the resume tests
        if digest != reference.get(name) and not (old and name == target(job, "o") and digest == hashlib.sha256(old.encode()).hexdigest()):
            return f"{name} is not the whole output"
    return ""


def places(job, operation, count, what):
    """Which of `count` calls fail in turn: all of a file tool; of one with LibTorch few, with MOCAPKIT_EXHAUSTIVE=1 all but writes, of which forty."""
    if not job.network or (EXHAUSTIVE and (operation != "write" or count <= 40)):
        return range(1, count + 1)
    if EXHAUSTIVE:
        return sorted({1 + round(i * (count - 1) / 39) for i in range(40)})
    return sorted({"5": {1, count}, "28+": {(count + 1) // 2}, "short": {count}}[what]) if count > 0 else []


def try_job(job, folder):
    _, status, err = faulty(job, folder, "any", 10**9, 5)
    expect(status == 0, f"{job.name}: {err}")
    reference = written(folder)
    old = None if (folder / target(job, "o")).is_dir() else "an older file\n"
    runs = 0
    for operation in ("write", "fsync", "rename", "close", "truncate"):
        seen = folder.parent / "seen"
        faulty(job, folder, operation, 10**9, 5, MOCAPKIT_FAULT_SEEN=seen)
        count = int(seen.read_text())
        expect(count > 0 or operation == "truncate", f"{job.name}: no {operation} seen: the library of faults does not reach it")
        for what in ("5", "28+", "short") if operation == "write" else ("5", "28+"):
            n = [f"{i}+" for i in places(job, operation, count, what)] if what == "28+" else places(job, operation, count, what)
            for at in n:
                for before in {None, old} if operation == "rename" else {None}:
                    hit, status, err = faulty(job, folder, operation, at, what.rstrip("+"), before)
                    label = f"{job.name}: {operation} {at} of {count} ({what})"
                    expect(hit, f"{label}: not reached the second time")
                    expect(status == 4, f"{label}: status {status}, expected 4: {err}")
                    expect(one_line(err, job.tool), f"{label}: more than one line: {err}")
                    wrong = whole(job, written(folder), reference, before)
                    expect(not wrong, f"{label}: {wrong}")
                    if before:
                        expect((folder / target(job, "o")).exists(), f"{label}: the old file is gone")
                    runs += 1
    return runs


def in_place_is_noticed(folder):
    """The judgement can fail: a tool that writes in place, and one that does not look whether it could."""
    job, = named("canonicalize")
    workplace(folder)
    (folder / "o").write_bytes(b"half")
    expect(whole(job, written(folder), {"o": "another"}), "a half-written output passes")
    (folder / "o").rename(folder / "o.part-Xy12Zw")
    expect(whole(job, written(folder), {}), "a .part that stays passes")
    script = "import os\nfor i in range(3):\n  try: os.write(os.open('x', os.O_WRONLY | os.O_CREAT), b'abc')\n  except OSError: pass\n"
    hit = folder.parent / "hit"
    hit.unlink(missing_ok=True)
    status, _, err = run(["/usr/bin/python3", "-c", script], folder, LD_PRELOAD=FAULTS, MOCAPKIT_FAULT="write:2:5", MOCAPKIT_FAULT_HIT=hit)
    expect(status == 0 and hit.exists(), f"a program that goes on after a failed write: status {status} {err}")


def disk_full(folder, disk):
    """A real file system of half the size that is needed, at `disk`."""
    disk.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(disk)], capture_output=True).returncode != 0:
        return "no file system could be mounted: a full disk was tried by failing calls alone"
    subprocess.run(["umount", str(disk)], check=True)
    tried = 0
    for job in FILE_JOBS + [j for j in NETWORK_JOBS + TRAININGS if EXHAUSTIVE or j.name in ("sample", "refine", "classify", "train-lstm")]:
        shutil.rmtree(folder, ignore_errors=True)
        workplace(folder)
        status, _, err = run(words(job, "o"), folder)
        expect(status == 0, f"{job.name}: {err}")
        reference = written(folder)
        size = sum(p.stat().st_size for p in folder.rglob("*") if p.is_file() and "in" not in p.relative_to(folder).parts)
        if size < 12288:
            continue  # pages are of 4 KiB
        subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size // 2}", "tmpfs", str(disk)], check=True)
        try:
            (disk / "in").symlink_to(INPUTS.resolve())
            status, _, err = run(words(job, "o"), disk)
            expect(status == 4 and one_line(err, job.tool), f"{job.name} on a full disk: status {status}, {err}")
            wrong = whole(job, written(disk), reference)
            expect(not wrong, f"{job.name} on a full disk: {wrong}")
            tried += 1
        finally:
            subprocess.run(["umount", str(disk)], check=True)
    return f"{tried} tools on a file system of half the size they need"


def test():
    with tempfile.TemporaryDirectory() as top:
        in_place_is_noticed(Path(top) / "noticed")
        # The end of a training, not its length, is what matters here.
        short = [Job(j.name, re.sub("--(steps|epochs|vae-epochs|pretrain-steps) [0-9]+", r"--\1 1", j.command), True, True) for j in TRAININGS]
        jobs = [j for j in FILE_JOBS + NETWORK_JOBS + short if EXHAUSTIVE or not j.network or j.name in ("sample", "classify", "embed", "train-lstm")]
        runs = {job.name: try_job(job, Path(top) / "work") for job in jobs}
        full = disk_full(Path(top) / "full", Path(top) / "disk")
    print(f"{sum(runs.values())} failing calls in {len(runs)} commands: " + ", ".join(f"{k} {v}" for k, v in runs.items()))
    print(full)


main(test)
