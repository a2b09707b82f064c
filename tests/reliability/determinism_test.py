"""P21, P22: the same inputs, options and seed give the same bytes for every tool, whatever the number of threads, the locale (German: a decimal comma, set for the whole process as well), the
time zone and the folder; between processor generations (OPENBLAS_CORETYPE) figures agree within the tolerances below.
"""
import itertools
import json
import shutil
import tempfile
from pathlib import Path

from jobs import *

THREADS = ("1", "2", "5")
ZONES = ("UTC", "Pacific/Kiritimati")
ONE_THREAD = {"motion-info", "motion-merge", "motion-select", "motion-split", "render"}  # tools without -j
PLACES = ("a", "ein Ordner mit Leerzeichen/und ümlaut")


def german(top):
    """The environment of a German locale, or None where the system has no sources of locales."""
    made = subprocess.run(["localedef", "-i", "de_DE", "-f", "UTF-8", str(top / "de_DE.UTF-8")], capture_output=True)
    if made.returncode != 0:
        return None
    return {"LOCPATH": top, "LC_ALL": "de_DE.UTF-8", "LD_PRELOAD": FAULTS, "MOCAPKIT_LOCALE": 1}


def matrix(job, german_env):
    """(threads, locale, zone, place) of every run; for tools with LibTorch each value of each, and neighbours, once."""
    locales = ("C", "de") if german_env else ("C",)
    whole = list(itertools.product(THREADS, locales, ZONES, PLACES))
    if EXHAUSTIVE or not job.network:
        return whole
    return [whole[0], ("2", locales[-1], ZONES[1], PLACES[1]), ("5", locales[0], ZONES[1], PLACES[0]), ("1", locales[-1], ZONES[0], PLACES[1])][: 3 if job.training else 4]


def outcome(job, folder, threads, env):
    shutil.rmtree(folder, ignore_errors=True)
    workplace(folder)
    status, out, err = run(words(job, "o") + ([] if job.tool in ONE_THREAD else ["-j", threads]), folder, **env)
    expect(status == 0, f"{job.name}: {err}")
    return {**written(folder), "standard output": hashlib.sha256(out).hexdigest()}


def same_bytes(job, top, german_env):
    first = None
    runs = matrix(job, german_env)
    for threads, locale, zone, place in runs:
        env = {"TZ": zone, **(german_env if locale == "de" else {})}
        found = outcome(job, top / place, threads, env)
        first = first or found
        different = [k for k in {**first, **found} if first.get(k) != found.get(k)]
        expect(not different, f"{job.name}: {different} differ with -j {threads}, locale {locale}, TZ={zone}, in '{place}'")
    return len(runs)


# Two generations of processors, as the libraries know them; the networks' own kernels are the same on both.
GENERATIONS = {"Haswell": {"OPENBLAS_CORETYPE": "Haswell", "ATEN_CPU_CAPABILITY": "avx2", "ONEDNN_MAX_CPU_ISA": "AVX2"},
               "Sandybridge": {"OPENBLAS_CORETYPE": "Sandybridge", "ATEN_CPU_CAPABILITY": "default", "ONEDNN_MAX_CPU_ISA": "SSE41"}}
# Searches decide between candidates, and a last bit may decide: they are as good on another generation, but not the same.
SEARCHES = ("denoise.map", "follow-path", "steer")
# Largest differences between them: of quaternions and metres absolute, of losses and figures relative where they are above 1. Losses are those of the first ten steps: in a training a last bit grows, and may
# lead it elsewhere.
TOLERANCES = {"frames/rotations": 1e-4, "frames/root_position": 1e-4, "loss": 1e-3, "figures": 1e-3}


def archive_difference(a, b):
    import h5py
    import numpy as np
    worst = {}
    with h5py.File(a) as f, h5py.File(b) as g:
        for name in ("frames/rotations", "frames/root_position"):
            expect(f[name].shape == g[name].shape, f"{name}: other shapes")
            worst[name] = float(np.abs(f[name][()].astype(float) - g[name][()].astype(float)).max())
    return worst


def figures(value, path=""):
    if isinstance(value, dict):
        for k, v in value.items():
            yield from figures(v, f"{path}/{k}")
    elif isinstance(value, list):
        for i, v in enumerate(value):
            yield from figures(v, f"{path}/{i}")
    elif isinstance(value, (int, float)) and not isinstance(value, bool):
        yield path, float(value)


def core_types(job, top):
    found = {}
    for core, env in GENERATIONS.items():
        folder = top / core
        shutil.rmtree(folder, ignore_errors=True)
        workplace(folder)
        status, out, err = run(words(job, "o"), folder, **env)
        expect(status == 0, f"{job.name}: {err}")
        found[core] = (folder, out)
    (a, text_a), (b, text_b) = found["Haswell"], found["Sandybridge"]
    if job.training:
        rows = [[float(line.split("\t")[4]) for line in (x / "o.log.tsv").read_text().splitlines()[1:11]] for x in (a, b)]
        return {"loss": max(abs(p - q) / max(1, abs(p)) for p, q in zip(*rows))}
    if target(job, "o"):
        return archive_difference(a / "o", b / "o")
    one, two = dict(figures(json.loads(text_a))), dict(figures(json.loads(text_b)))
    expect(one.keys() == two.keys(), f"{job.name}: other figures")
    return {"figures": max(abs(one[k] - two[k]) / max(1, abs(one[k])) for k in one)}


def test():
    with tempfile.TemporaryDirectory() as name:
        top = Path(name)
        german_env = german(top)
        if german_env:
            done = subprocess.run(["/usr/bin/printf", "%.1f", "1,5"], env={"LOCPATH": str(top), "LC_ALL": "de_DE.UTF-8"}, capture_output=True)
            expect(done.stdout == b"1,5", f"the German locale is none: {done}")
        # The comparison can fail: another seed.
        corpus = next(j for j in FILE_JOBS if j.name == "make-corpus")
        seeded = Job("seeded", corpus.command + " --seed 2")
        expect(outcome(corpus, top / "a", "1", {}) != outcome(seeded, top / "a", "1", {}), "another seed gives the same bytes")
        runs = {job.name: same_bytes(job, top, german_env) for job in ALL}
        worst = {}
        for job in [j for j in NETWORK_JOBS + NETWORK_REPORTS + TRAININGS if j.name not in ("embed", "classify", *SEARCHES) and (EXHAUSTIVE or j.name in ("sample", "sample.lstm", "refine", "denoise", "fid-eval", "train-lstm"))]:
            for what, size in core_types(job, top).items():
                worst[f"{job.name} {what}"] = size
                expect(size <= TOLERANCES[what], f"{job.name}: {what} differ by {size} between core types, expected at most {TOLERANCES[what]}")
    print(f"{sum(runs.values())} runs of {len(runs)} commands, " + ("in two locales" if german_env else "no German locale could be made: C alone"))
    print("Haswell against Sandybridge: " + ", ".join(f"{k} {v:.2g}" for k, v in worst.items()))


main(test)
