"""P24, P25, P26: a training that is killed at any moment, also while it writes a checkpoint, ends after --resume at the bits of one that ran through, model and log; SIGTERM, SIGUSR1 and SIGINT
end it with a checkpoint and status 75; a damaged newest checkpoint gives way to the older one with a warning; another configuration is refused. For every train-* tool.
"""
import random
import re
import shutil
import signal
import tempfile
from pathlib import Path

from jobs import *

KILLS = 20 if EXHAUSTIVE else 3
EVERY_STEP = ["--checkpoint-minutes", "0.000001"]


def model(folder):
    """Digests of the finished model and its log."""
    found = {k: v for k, v in written(folder).items() if ".part-" not in k}
    return found if set(found) == {"o", "o.log.tsv"} else {"unfinished": sorted(found)}


def fresh(folder):
    shutil.rmtree(folder, ignore_errors=True)
    return workplace(folder)


def checkpoints(folder):
    return sorted(folder.glob("o.ckpt-?"), key=lambda p: p.stat().st_mtime_ns)


def stopped(job, folder, what, n, resume=False):
    """Runs until the n-th call, before which a signal comes; (status, standard error)."""
    command = words(job, "o") + EVERY_STEP + (["--resume"] if resume else [])
    status, _, err = run(command, folder, LD_PRELOAD=FAULTS, MOCAPKIT_FAULT=f"any:{n}:{what}")
    return status, err


def resumed(label, job, folder, reference):
    status, _, err = run(words(job, "o") + ["--resume"], folder)
    expect(status == 0, f"{label}: --resume ends with status {status}: {err}")
    expect(model(folder) == reference, f"{label}: the resumed training ends at other bits: {model(folder)}")


def damage(path):
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 4
    path.write_bytes(data)


def try_training(job, top):
    rng = random.Random(job.name)
    folder, seen = top / "work", top / "seen"
    fresh(folder)
    status, _, err = run(words(job, "o"), folder)
    expect(status == 0, f"{job.name}: {err}")
    reference = model(folder)
    fresh(folder)
    status, _, err = run(words(job, "o") + EVERY_STEP, folder, LD_PRELOAD=FAULTS, MOCAPKIT_FAULT=f"any:{10**9}:5", MOCAPKIT_FAULT_SEEN=seen)
    expect(status == 0 and model(folder) == reference, f"{job.name}: checkpoints change the model")
    calls = int(seen.read_text())

    # Killed, and killed again while it goes on from there.
    fresh(folder)
    kills = 0
    for i in range(KILLS):
        n = rng.randrange(1, calls // 3)
        status, err = stopped(job, folder, "kill", n, resume=i > 0)
        if status == 0:  # done before the call came
            expect(model(folder) == reference, f"{job.name}: killed {kills} times, then through: other bits")
            fresh(folder)
            continue
        expect(status == -signal.SIGKILL, f"{job.name}: killed before call {n}: status {status}: {err}")
        expect(not (folder / "o").exists(), f"{job.name}: a killed training left a model")
        kills += 1
    resumed(f"{job.name} killed {kills} times", job, folder, reference)
    expect(kills >= KILLS // 2, f"{job.name}: {kills} of {KILLS} kills came in time")

    # Stopped by each signal.
    for what in ("term", "usr1", "int"):
        fresh(folder)
        status, err = stopped(job, folder, what, calls // 2)
        expect(status == 75, f"{job.name}: SIG{what.upper()}: status {status}, expected 75: {err}")
        expect(checkpoints(folder) and not (folder / "o").exists(), f"{job.name}: SIG{what.upper()} leaves {written(folder)}")
        if what != "int":
            resumed(f"{job.name}, SIG{what.upper()}", job, folder, reference)

    # What the last one left, continued by another command, and damaged.
    status, _, err = run(words(job, "o") + ["--resume", "--seed", "2"], folder)
    expect(status == 2 and re.search("was trained with .* = .*, this command says", err), f"{job.name}: another seed: status {status}: {err}")
    status, _, err = run(words(job, "o"), folder)
    expect(status == 4 and "a checkpoint of an earlier training" in err, f"{job.name}: without --resume: status {status}: {err}")
    expect(len(checkpoints(folder)) == 2, f"{job.name}: {checkpoints(folder)}, expected two checkpoints")
    both = top / "both"
    shutil.rmtree(both, ignore_errors=True)
    shutil.copytree(folder, both, symlinks=True)
    older, newer = checkpoints(folder)
    damage(newer)
    status, _, err = run([w for w in words(job, "o") if w != "-q"] + ["--resume", "--log-level", "warning"], folder)
    expect(status == 0 and f"warning: {newer.name}" in err, f"{job.name}: a damaged newest checkpoint: status {status}: {err}")
    expect(model(folder) == reference, f"{job.name}: from the older checkpoint: other bits")
    for path in checkpoints(both):
        damage(path)
    status, _, err = run(words(job, "o") + ["--resume"], both)
    expect(status == 3 and ".ckpt-" in err and not (both / "o").exists(), f"{job.name}: both checkpoints damaged: status {status}: {err}")
    return kills, calls


def test():
    with tempfile.TemporaryDirectory() as name:
        done = {job.name: try_training(job, Path(name)) for job in TRAININGS}
    print("kills, calls: " + ", ".join(f"{k} {v[0]} of {v[1]}" for k, v in done.items()))


main(test)
