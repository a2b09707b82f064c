"""P2, P4, P5: SIGKILL before any write, fsync, rename or truncate, and at random moments, leaves at most a .part beside the whole old or new file, and the same command then succeeds; of
twenty writers racing for one output one wins; a reader that leaves early is no error.
"""
import random
import shutil
import signal
import tempfile
import time
from pathlib import Path

from jobs import *

RANDOM_KILLS = 100


def judge(label, folder, reference):
    for name, digest in written(folder).items():
        stray = name.startswith("tmp/") or ".part-" in name
        expect(stray or digest == reference.get(name), f"{label}: {name} is neither a .part nor the whole output")


def rerun(label, job, folder, reference, command=None):
    """The same line again, -f where an output stands already; what it makes is what an undisturbed run makes."""
    status, _, err = run((command or words(job, "o")) + (["-f"] if (folder / target(job, "o")).exists() else []), folder)
    expect(status == 0, f"{label}: the rerun ends with status {status}: {err}")
    found = {k: v for k, v in written(folder).items() if ".part-" not in k and not k.startswith("tmp/")}
    expect(found == reference, f"{label}: the rerun makes something else")


def kill_everywhere(job, top):
    folder, hit = top / "work", top / "hit"
    workplace(folder)
    seen = top / "seen"
    status, _, err = run(words(job, "o"), folder, LD_PRELOAD=FAULTS, MOCAPKIT_FAULT=f"any:{10**9}:5", MOCAPKIT_FAULT_SEEN=seen)
    expect(status == 0, f"{job.name}: {err}")
    reference, count = written(folder), int(seen.read_text())
    places = range(1, count + 1) if not job.network or EXHAUSTIVE else sorted({1, count // 2, count - 1, count})
    for n in places:
        label = f"{job.name} killed before call {n} of {count}"
        shutil.rmtree(folder)
        workplace(folder)
        (folder / "tmp").mkdir()
        hit.unlink(missing_ok=True)
        status, _, _ = run(words(job, "o"), folder, LD_PRELOAD=FAULTS, MOCAPKIT_FAULT=f"any:{n}:kill", MOCAPKIT_FAULT_HIT=hit, TMPDIR=folder / "tmp")
        expect(status == -signal.SIGKILL and hit.exists(), f"{label}: status {status}")
        judge(label, folder, reference)
        rerun(label, job, folder, reference)
    shutil.rmtree(folder)
    return len(places)


def kill_at_random(top):
    rng = random.Random(1)
    folder = top / "random"
    killed = 0
    for job in named("bvh2npz", "canonicalize"):  # many files, and one archive
        command = [w.replace("in/few", "in/corpus") for w in words(job, "o")]
        workplace(folder)
        start = time.monotonic()
        status, _, err = run(command, folder)
        expect(status == 0, err)
        duration, reference = time.monotonic() - start, written(folder)
        for i in range(RANDOM_KILLS // 2):
            shutil.rmtree(folder)
            workplace(folder)
            (folder / "tmp").mkdir()
            process = subprocess.Popen(command, cwd=folder, env=environment(TMPDIR=folder / "tmp"), stderr=subprocess.DEVNULL)
            time.sleep(rng.uniform(0, duration))
            process.kill()
            killed += process.wait() == -signal.SIGKILL
            label = f"{job.name}, random kill {i}"
            judge(label, folder, reference)
            rerun(label, job, folder, reference, command)
        shutil.rmtree(folder)
    expect(killed >= 5, f"{killed} of {RANDOM_KILLS} kills came in time")
    return killed


def race(top):
    for job in named("canonicalize", "motion-select", "sample"):
        folder = top / "race"
        workplace(folder)
        status, _, err = run(words(job, "o"), folder)
        expect(status == 0, err)
        reference = written(folder)
        (folder / target(job, "o")).unlink()
        writers = [subprocess.Popen(words(job, "o"), cwd=folder, env=environment(), stderr=subprocess.PIPE) for _ in range(20)]
        errors = [w.communicate()[1].decode() for w in writers]
        statuses = [w.returncode for w in writers]
        expect(sorted(statuses) == [0] + [4] * 19, f"{job.name}: twenty writers end with {sorted(statuses)}")
        expect(all(one_line(e, job.tool) for s, e in zip(statuses, errors) if s), f"{job.name}: {errors}")
        expect(written(folder) == reference, f"{job.name}: twenty writers leave {written(folder)}")
        shutil.rmtree(folder)


def leave_early(top):
    folder = top / "pipe"
    workplace(folder)
    commands = [j.command for j in REPORTS + NETWORK_REPORTS] + [j.command.replace("OUT.svg", "- --format svg").replace("OUT", "-") for j in FILE_JOBS if j.name in ("canonicalize", "motion-select", "motion-merge", "render.svg")]
    for command in commands:
        status, out, err = run(["bash", "-c", f"{command} | head -c1 | wc -c; exit ${{PIPESTATUS[0]}}"], folder)
        expect(out.strip() == b"1" and err == "", f"{command} | head -c1: {out} {err}")
        expect(status in (0, 128 + signal.SIGPIPE), f"{command} | head -c1: status {status}")
    return len(commands)


def half_is_noticed(top):
    folder = top / "noticed"
    workplace(folder)
    (folder / "o").write_bytes(b"half")
    try:
        judge("planted", folder, {"o": "another"})
    except Failure:
        return
    raise Failure("a half-written output passes")


def test():
    with tempfile.TemporaryDirectory() as name:
        top = Path(name)
        half_is_noticed(top)
        jobs = [j for j in WRITERS if not j.training and (EXHAUSTIVE or not j.network or j.name in ("sample", "embed"))]
        kills = {job.name: kill_everywhere(job, top) for job in jobs}
        in_time = kill_at_random(top)
        race(top)
        pipes = leave_early(top)
    print(f"{sum(kills.values())} kills at a call: " + ", ".join(f"{k} {v}" for k, v in kills.items()))
    print(f"{RANDOM_KILLS} kills at random moments, {in_time} before the end; races of 20 writers; {pipes} readers that leave after a byte")


main(test)
