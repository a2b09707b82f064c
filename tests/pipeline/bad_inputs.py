"""Makes 43 good and 7 bad BVH files, and judges a table of rejects.

usage: bad_inputs.py MODEL.bvh GOOD_DIR BAD_DIR EXPECTED.tsv    writes the files, and file, line, regular expression of the reason
       bad_inputs.py --check EXPECTED.tsv REJECTS.tsv
"""
import gzip
import os
import re
import sys

if sys.argv[1] == "--check":
    def rows(path):
        return [line.split("\t") for line in open(path).read().splitlines()]

    expected, found = rows(sys.argv[2]), rows(sys.argv[3])
    problems = []
    if found[0] != ["file", "line", "status", "reason"]:
        problems.append("header %s" % found[0])
    if [r[0] for r in found[1:]] != sorted(r[0] for r in expected):
        problems.append("%s, expected %s" % ([r[0] for r in found[1:]], sorted(r[0] for r in expected)))
    table = {r[0]: r for r in found[1:]}
    for name, line, reason in expected:
        row = table.get(name, ["", "", "", ""])
        if row[1] != line or row[2] != "3" or not re.search(reason, row[3]):
            problems.append("%s: line %s, status %s, '%s'; expected line %s, status 3, '%s'" % (name, *row[1:], line, reason))
    for p in problems:
        print("bad_inputs.py:", p)
    sys.exit(1 if problems else 0)

model, good, bad, table = sys.argv[1:]
lines = open(model).read().splitlines()
motion = next(i for i, line in enumerate(lines) if line.startswith("MOTION"))
first = motion + 3  # the first row of numbers
frames = len(lines) - first
for folder in (good, bad):
    os.makedirs(folder)


def text(rows):
    return "\n".join(rows) + "\n"


for n in range(43):
    # Another motion in each: the figure starts and walks elsewhere.
    moved = list(lines)
    for i in range(first, len(lines)):
        words = lines[i].split()
        words[0] = "%.4f" % (float(words[0]) + n)
        words[2] = "%.4f" % (float(words[2]) * (1 + 0.01 * n))
        moved[i] = " ".join(words)
    open(os.path.join(good, "g%02d.bvh" % n), "w").write(text(moved))

expected = []


def defect(name, data, line, reason):
    path = os.path.join(bad, name)
    open(path, "wb").write(data if isinstance(data, bytes) else data.encode())
    expected.append((path, str(line) if line else "", reason))


def with_row(k, row):
    return text(lines[:first + k] + [row] + lines[first + k + 1:])


words = lines[first + 9].split()
whole = text(lines).encode()
# Names between the good ones, so that each fails in the middle of the batch.
defect("g05-cut.bvh", text(lines[:first + 12])[:-40], first + 12, r"%d|%d" % (frames, len(words)))
defect("g11-wide.bvh", with_row(9, " ".join(words + ["0"])), first + 10, r"%d.*%d" % (len(words) + 1, len(words)))
defect("g17-roots.bvh", text(lines[:motion] + ["ROOT Other"] + lines[1:motion] + lines[motion:]), motion + 1, r"(?i)root")
defect("g23-nan.bvh", with_row(9, " ".join(["nan"] + words[1:])), first + 10, r"nan")
defect("g29-frames.bvh", text(lines).replace("Frames: %d" % frames, "Frames: %d" % (frames + 1)), motion + 2, r"%d.*%d|%d.*%d" % (frames, frames + 1, frames + 1, frames))
defect("g35-prose.bvh", "This is a letter, not motion.\n", "", r"no format known here")
defect("g41-torn.bvh.gz", gzip.compress(whole, mtime=0)[:-700], "", r"gzip|truncated|compressed")
with open(table, "w") as f:
    for row in expected:
        f.write("\t".join(row) + "\n")
