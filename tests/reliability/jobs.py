"""What the tests of this folder run: one short command of every tool that writes, on small inputs made here. Run by itself it makes the inputs.

usage: jobs.py FOLDER     makes the inputs in FOLDER anew, with the tools of $MOCAPKIT_BIN; a tool that no job runs is an error
"""
import hashlib
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

BIN = Path(os.environ["MOCAPKIT_BIN"])
FAULTS = os.environ.get("MOCAPKIT_FAULTS", "")  # the library of faults.cpp
INPUTS = Path(os.environ.get("MOCAPKIT_INPUTS", ""))
NETWORKS = (BIN / "sample").exists()  # a build without LibTorch has the file tools alone
EXHAUSTIVE = os.environ.get("MOCAPKIT_EXHAUSTIVE", "0") == "1"

SETUP = """
make-corpus -q --subjects 1 --seconds 2 --transitions 0 -o corpus
mkdir few; cp corpus/walking_f001_1.bvh corpus/jogging_m001_1.bvh few/; cp corpus/labels.tsv labels.tsv
canonicalize -q corpus --labels labels.tsv -o c.h5
canonicalize -q few --labels labels.tsv -o few.h5
make-corpus -q --subjects 1 --seconds 2 --transitions 0 --seed 7 -o others; canonicalize -q others --labels others/labels.tsv -o others.h5
canonicalize -q few -o unlabelled.h5
canonicalize -q few --labels labels.tsv --shard 1/2 -o s1.h5
canonicalize -q few --labels labels.tsv --shard 2/2 -o s2.h5
printf 'x,y\\n0,0\\n0.5,0\\n' > line.csv
printf '0 1.2 0\\n0.5 1.2 90\\n' > go.txt
"""
SETUP_NETWORKS = """
train-lstm -q few.h5 --steps 3 --batch 2 --window 8 --weights-only -o lstm.h5
train-refiner -q few.h5 --generator lstm.h5 --samples 4 --sample-frames 12 --batch 4 --buffer 4 --window 8 --steps 2 --weights-only -o refiner.h5
train-vrnn -q c.h5 --steps 3 --batch 4 --window 6 --pretrain-steps 1 --weights-only -o cell.h5
train-classifier -q c.h5 --attribute action --epochs 1 --weights-only -o action.h5
train-denoiser -q c.h5 --epochs 1 --batch 4 --window 16 --weights-only -o denoiser.h5
train-vae -q c.h5 --epochs 1 --vae-epochs 1 --batch 4 --window 20 --filters 4 --hidden 8 --latent 2 --prior-components 2 --weights-only -o vae.h5
"""


@dataclass(frozen=True)
class Job:
    """`command`: words in which OUT is where it writes, a file or a folder, and in/ the inputs. Without OUT it writes to standard output."""
    name: str
    command: str
    training: bool = False
    network: bool = False  # a tool that links LibTorch, and takes the best part of a second to start

    @property
    def tool(self):
        return self.command.split()[0]


TRAININGS = [
    Job("train-vrnn", "train-vrnn -q in/c.h5 --batch 4 --window 6 --pretrain-steps 2 --steps 40 -o OUT", True, True),
    Job("train-lstm", "train-lstm -q in/few.h5 --batch 4 --window 12 --steps 40 -o OUT", True, True),
    Job("train-refiner", "train-refiner -q in/few.h5 --generator in/lstm.h5 --batch 4 --window 8 --buffer 8 --samples 8 --sample-frames 20 --steps 40 -o OUT", True, True),
    Job("train-vae", "train-vae -q in/c.h5 --batch 8 --window 20 --filters 8 --hidden 16 --latent 4 --prior-components 3 --epochs 12 --vae-epochs 12 -o OUT", True, True),
    Job("train-classifier", "train-classifier -q in/c.h5 --attribute action --epochs 20 -o OUT", True, True),
    Job("train-denoiser", "train-denoiser -q in/c.h5 --batch 4 --window 16 --epochs 20 -o OUT", True, True),
]
FILE_JOBS = [
    Job("bvh2npz", "bvh2npz -q in/few -o OUT"),
    Job("canonicalize", "canonicalize -q in/few --labels in/labels.tsv --phases all --mirror -o OUT"),
    Job("motion-merge", "motion-merge -q in/s1.h5 in/s2.h5 -o OUT"),
    Job("motion-select", "motion-select -q in/c.h5 --attr action=walking -o OUT"),
    Job("motion-split", "motion-split -q in/c.h5 --ratios 2,1,1 -o OUT"),
    Job("motion-export", "motion-export -q in/few.h5 -o OUT"),
    Job("motion-export.npz", "motion-export -q in/few.h5 --format npz -o OUT"),
    Job("render", "render -q in/few.h5 -o OUT.png"),
    Job("render.svg", "render -q in/few.h5 -o OUT.svg"),
    Job("make-corpus", "make-corpus -q --subjects 1 --seconds 1.5 --transitions 0 --action walking -o OUT"),
    Job("refine.pin", "refine -q --pin-feet in/few.h5 -o OUT", network=True),
]
REPORTS = [
    Job("motion-info", "motion-info -q --json in/c.h5"),
    Job("motion-compare", "motion-compare -q --json in/few.h5 --real in/c.h5"),
]
NETWORK_JOBS = [
    Job("sample", "sample -q -m in/cell.h5 -n 4 --frames 20 -o OUT", network=True),
    Job("sample.lstm", "sample -q -m in/lstm.h5 -n 4 --frames 20 -o OUT", network=True),
    Job("sample.vae", "sample -q -m in/vae.h5 -n 4 --frames 20 -o OUT", network=True),
    Job("refine", "refine -q -m in/refiner.h5 in/few.h5 -o OUT", network=True),
    Job("denoise", "denoise -q -m in/denoiser.h5 in/few.h5 -o OUT", network=True),
    Job("denoise.map", "denoise -q --method map -m in/lstm.h5 in/few.h5 --iterations 3 -o OUT", network=True),
    Job("classify", "classify -q -m in/action.h5 in/unlabelled.h5 -o OUT", network=True),
    Job("follow-path", "follow-path -q -m in/lstm.h5 --path in/line.csv --window 8 --overlap 4 --particles 4 --rounds 1 --iterations 3 --most-seconds 0.4 -o OUT", network=True),
    Job("steer", "steer -q -m in/lstm.h5 in/go.txt --window 8 --overlap 4 --particles 4 --rounds 1 --iterations 2 --tail 0.3 -o OUT", network=True),
    Job("embed", "embed -q in/c.h5 --classifier in/action.h5 --method pca -o OUT.svg", network=True),
]
NETWORK_REPORTS = [
    Job("fid-eval", "fid-eval -q --json in/c.h5 --real in/others.h5 --classifier in/action.h5 --pca 4 --train in/c.h5", network=True),
    Job("classify.report", "classify -q --json -m in/action.h5 in/c.h5", network=True),
]
if not NETWORKS:
    FILE_JOBS = [j for j in FILE_JOBS if not j.network]
    NETWORK_JOBS, NETWORK_REPORTS, TRAININGS = [], [], []
WRITERS = FILE_JOBS + NETWORK_JOBS + TRAININGS
ALL = FILE_JOBS + REPORTS + NETWORK_JOBS + NETWORK_REPORTS + TRAININGS


def named(*names):
    """The jobs of these names, where this build has their tools."""
    return [j for j in ALL if j.name in names]


class Failure(Exception):
    pass


def expect(true, text):
    if not true:
        raise Failure(text)


def words(job, out):
    return [w.replace("OUT", out) if w.startswith("OUT") else w for w in job.command.split()]


def target(job, out):
    """Where the job writes."""
    return next((w.replace("OUT", out) for w in job.command.split() if w.startswith("OUT")), None)


def environment(**more):
    env = {"PATH": str(BIN) + ":/usr/bin:/bin", "LC_ALL": "C", "HOME": "/nonexistent", "TMPDIR": os.environ.get("TMPDIR", "/tmp")}
    for kept in ("OPENBLAS_CORETYPE", "ASAN_OPTIONS"):
        if kept in os.environ:
            env[kept] = os.environ[kept]
    env.update({k: str(v) for k, v in more.items()})
    return env


def run(command, folder, timeout=120, **env):
    """(status, standard output, standard error); a signal's status is negative."""
    done = subprocess.run(command, cwd=folder, env=environment(**env), stdin=subprocess.DEVNULL, capture_output=True, timeout=timeout)
    return done.returncode, done.stdout, done.stderr.decode(errors="replace")


def workplace(folder):
    """A folder for jobs to write in, with the inputs at in/."""
    folder = Path(folder)
    folder.mkdir(parents=True)
    (folder / "in").symlink_to(INPUTS.resolve())
    return folder


def content(path):
    """{relative path: digest} of everything below a file or folder; {} where there is nothing."""
    path = Path(path)
    if path.is_file():
        return {"": hashlib.sha256(path.read_bytes()).hexdigest()}
    return {str(p.relative_to(path)): hashlib.sha256(p.read_bytes()).hexdigest() for p in sorted(path.rglob("*")) if p.is_file()}


def written(folder):
    """All files of a workplace but the inputs."""
    return {k: v for k, v in content(folder).items() if not k.startswith("in/")}


def one_line(stderr, tool):
    """Whether standard error is one message of the tool (and its hint)."""
    lines = [line for line in stderr.splitlines() if not line.startswith("  hint:")]
    return len(lines) == 1 and lines[0].startswith(tool + ": ")


def main(test):
    """Runs a test's function; prints what failed."""
    try:
        test()
    except Failure as e:
        print(f"{Path(sys.argv[0]).name}: {e}")
        sys.exit(1)


if __name__ == "__main__":
    tools = {p.stem for p in (Path(__file__).parents[2] / "apps").glob("*.cpp") if (BIN / p.stem).exists()}
    if tools - {job.tool for job in ALL}:
        sys.exit(f"jobs.py: no job for {sorted(tools - {job.tool for job in ALL})}")
    shutil.rmtree(sys.argv[1], ignore_errors=True)
    os.makedirs(sys.argv[1])
    sys.exit(subprocess.run(["bash", "-e"], input=(SETUP + (SETUP_NETWORKS if NETWORKS else "")).encode(), cwd=sys.argv[1], env=environment()).returncode)
