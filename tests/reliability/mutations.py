#!/usr/bin/python3
"""The guards can fail (P31): each promise is broken on purpose in a copy of the sources, and the test that keeps it must notice. `make test-mutations`.

usage: mutations.py SOURCE FOLDER [NAME...]     SOURCE: this repository; FOLDER: where the copy and its build go, kept for the next time; NAME: these mutations alone

Prints a line for each: the promise, what was broken, the test that noticed. Exit status 1 where one goes unnoticed, or no longer fits the sources. The first build takes a quarter of
an hour of two cores; MOCAPKIT_MODELS=OFF leaves out what needs it.
"""
import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

OUTPUT = "libmocap/base/output_file.cpp"
# name: (promise, what is broken, {file: [(text, text instead)]}, tests that must fail, needs LibTorch)
MUTATIONS = {
    "part-stays": ("P1", "an unfinished output is left where it is", {OUTPUT: [("  if (!part_.empty()) ::unlink(part_.c_str());\n}", "}")]}, "reliability.faults", False),
    "in-place": ("P2", "an output has its name while it is written", {OUTPUT: [("void OutputFile::write(std::string_view bytes) { write_all", "void OutputFile::write(std::string_view bytes) { if (path_ != \"-\") (void)!::link(part_.c_str(), path_.c_str()); write_all"),
                 ("} else if (errno == EEXIST || (", "} else if (errno == EEXIST) {\n    ::unlink(part_.c_str());\n    } else if ((")]}, "reliability.kills", False),
    "fsync-ignored": ("P1", "a failed fsync is passed over", {OUTPUT: [('  if (::fsync(fd_) != 0) fail("fsync");', "  ::fsync(fd_);")]}, "reliability.faults", False),
    "hdf5-ignored": ("P3", "a failed write of HDF5 is passed over", {"libmocap/store/hdf5_write.cpp": [("  void check(herr_t status) {\n    if (status < 0) abandon();", "  void check(herr_t status) {\n    (void)status;")]}, "reliability.faults|^store", False),
    "last-one-wins": ("P4", "an output replaces what another made meanwhile", {OUTPUT: [("if (::link(part_.c_str(), path_.c_str()) == 0) {\n      ::unlink(part_.c_str());", "if (::rename(part_.c_str(), path_.c_str()) == 0) {")]}, "reliability.kills|^base", False),
    "pipe-is-an-error": ("P5", "a reader that leaves is reported", {"libmocap/cli/tool.cpp": [('e.where().file == "<stdout>" && reader_is_gone()', 'e.where().file == "<stdout>" && false')]}, "reliability.kills", False),
    "digest-ignored": ("P9", "the digests of clips are not compared", {"libmocap/store/archive_check.cpp": [("if (to_hex(clip_digest(s.assemble(i, std::move(raw)))) != s.clips[i].digest)", "if (to_hex(clip_digest(s.assemble(i, std::move(raw)))).empty())")]}, "^store", False),
    "unfinished-is-read": ("P8", "a file without its last mark is read", {"libmocap/store/hdf5_read.cpp": [('  if (!complete) refuse("attribute complete", "missing: the file is unfinished");\n  return *complete;', '  return complete.value_or("{\\"clips\\": 2, \\"digest\\": \\"\\"}");')]}, "^store", False),
    "size-believed": ("P13", "an array's promised size is not compared with what is there", {"libmocap/io/npz.cpp": [("  if (bytes != size - head.size())\n", "  if (bytes == 1)\n")]}, "^io|reliability.batches|fuzz.npz", False),
    "locale": ("P14", "the user's locale is left as a library set it", {"libmocap/cli/tool.cpp": [('  std::setlocale(LC_NUMERIC, "C");', "")]}, "reliability.determinism", False),
    "links-followed": ("P15", "links to other files are followed", {"libmocap/store/hdf5_read.cpp": [("if (!state_->link_is_hard(part)) refuse", "if (part.empty()) refuse"), ('  if (status > 0) refuse(path + "/" + found.odd', '  if (status > 99) refuse(path + "/" + found.odd')]}, "reliability.traces|^store", False),
    "batch-stops": ("P17", "a bad input ends the batch", {"libmocap/cli/context.cpp": [("  return s.common.fail_fast;", "  return true;")]}, "pipeline.bad_inputs", False),
    "never-up-to-date": ("P18", "a rerun does everything again", {"libmocap/cli/provenance.cpp": [("  if (existing.empty()) return false;", "  if (existing.empty() || !now.tool.empty()) return false;")]}, "reliability.batches", False),
    "all-in-memory": ("P19", "clips stay in memory", {"libmocap/store/archive_write.cpp": [("void ArchiveWriter::add(const Clip& clip) {\n", "void ArchiveWriter::add(const Clip& clip) {\n  static std::vector<Clip> kept;\n  kept.push_back(clip);\n")]}, "reliability.batches", False),
    "threads-in-history": ("P21", "the number of threads enters the output", {"libmocap/cli/provenance.cpp": [('"threads",       ', "")]}, "reliability.determinism", False),
    "stray-output": ("P30", "a file is written beside the output", {OUTPUT: [("  part_.clear();\n  if (const int d = ::open", '  part_.clear();\n  (void)!::open("stray.tmp", O_CREAT | O_RDWR, 0600);\n  if (const int d = ::open')]}, "reliability.traces", False),
    "optimizer-forgotten": ("P24", "the optimiser starts anew after --resume", {"libmodels/train/checkpoint.cpp": [('    optimizer.set_state(state, restored.state["step"].get<std::int64_t>());\n', "    (void)optimizer;\n")]}, "reliability.resume", True),
    "identity-ignored": ("P25", "a training goes on with another configuration", {"libmodels/train/checkpoint.cpp": [('  require_same_identity(model.identity(), restored.state["identity"].dump(), restored.path);\n', "")]}, "reliability.resume", True),
    "signal-ignored": ("P26", "SIGUSR1 ends a training without a checkpoint", {"libmodels/train/signals.cpp": [("{SIGTERM, SIGINT, SIGUSR1}", "{SIGTERM, SIGINT}")]}, "reliability.resume", True),
}


BUILT = ["tools", "mocapkit_faults", "test_base", "test_store", "test_io", "fuzz_npz"]


def quiet(command, folder, log):
    with open(log, "a") as f:
        return subprocess.run(command, cwd=folder, stdout=f, stderr=subprocess.STDOUT).returncode


def main():
    source, folder = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
    copy, log = folder / "source", folder / "log"
    folder.mkdir(parents=True, exist_ok=True)
    tracked = subprocess.run(["git", "ls-files", "-z"], cwd=source, capture_output=True, check=True).stdout.decode().split("\0")
    for name in filter(None, tracked):
        # Only what differs, so that the build of last time stands.
        target = copy / name
        text = (source / name).read_bytes()
        if not target.exists() or target.read_bytes() != text:
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(text)
            shutil.copymode(source / name, target)
    build = copy / "build/release"
    models = os.environ.get("MOCAPKIT_MODELS", "ON")
    chosen = {k: v for k, v in MUTATIONS.items() if (not sys.argv[3:] or k in sys.argv[3:]) and (models != "OFF" or not v[4])}
    problems = 0
    for step in (["cmake", "--preset", "release", f"-DMOCAPKIT_MODELS={models}", "-DMOCAPKIT_BENCH=OFF"], ["cmake", "--build", str(build), "--target", *BUILT]):
        if quiet(step, copy, log):
            sys.exit(f"mutations.py: {' '.join(step)} fails: {log}")
    for name, (promise, what, edits, tests, _) in chosen.items():
        originals = {path: (copy / path).read_text() for path in edits}
        try:
            for path, replacements in edits.items():
                text = originals[path]
                for old, new in replacements:
                    if text.count(old) != 1:
                        raise LookupError(f"'{old[:60]}' is {text.count(old)} times in {path}")
                    text = text.replace(old, new)
                (copy / path).write_text(text)
            start = time.time()
            if quiet(["cmake", "--build", str(build), "--target", *BUILT], copy, log):
                raise LookupError(f"does not compile, see {log}")
            done = subprocess.run(["ctest", "--test-dir", str(build), "-R", tests, "--timeout", "600"], capture_output=True, text=True)
            failed = [t for t in re.findall(r"^\s*\d+ - (\S+) \(", done.stdout, re.M) if t != "reliability.inputs"]
            verdict = "noticed by " + ", ".join(failed) if failed else "NOT NOTICED by " + tests
            problems += not failed
            print(f"{promise}\t{name}\t{what}\t{verdict}\t{time.time() - start:.0f} s", flush=True)
        except LookupError as e:
            problems += 1
            print(f"{promise}\t{name}\t{what}\tOUT OF DATE: {e}", flush=True)
        finally:
            for path, text in originals.items():
                (copy / path).write_text(text)
    sys.exit(1 if problems else 0)


main()
