#!/bin/bash
# An array job is one run: canonicalize --shard for all shards, then motion-merge, gives the bytes of canonicalize without
# --shard: 400 clips of a procedural corpus with labels of which some columns and rows are empty, all phases, inputs in two
# folders and two formats, some of them with a history; for several numbers of shards, in any order of inputs and shards.
set -eu
bin=${MOCAPKIT_BIN:?set it to the folder of the tools}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
PATH=$bin:$PATH
export LC_ALL=C
cd "$work"
fail() { echo "shards.sh: $*"; exit 1; }

make-corpus -q --subjects 4 --seconds 1 --clips 3 --transitions 4 -o corpus
# Columns that no clip, and that only clips of some shards have a value for; files without a row.
awk -F '\t' -v OFS='\t' 'NR == 1 { print $0, "mood", "take"; next } NR % 11 { print $0, "", NR == 20 ? "long take" : "" }' corpus/labels.tsv > labels.tsv
# Some of the files as npz, by two commands: they carry their histories. Two files of one name in two folders.
mkdir -p npz more
bvh2npz -q corpus/jogging_f00* -o npz
bvh2npz -q --first-frame keep corpus/lifting_m00* -o npz
rm corpus/jogging_f00* corpus/lifting_m00*
cp corpus/walking_f001_1.bvh more/
inputs=(corpus npz more)

canonicalize -q "${inputs[@]}" --labels labels.tsv --phases all -o whole.h5
clips=$(motion-info --json whole.h5 | /usr/bin/python3 -c 'import json, sys; print(json.load(sys.stdin)["clips"])')
[ "$clips" -ge 400 ] || fail "$clips clips, expected 400"
canonicalize -q more npz corpus --labels labels.tsv --phases all -o turned.h5
cmp whole.h5 turned.h5 || fail "the order of the inputs shows"
canonicalize -q -j 1 "${inputs[@]}" --labels labels.tsv --phases all -o one.h5
cmp whole.h5 one.h5 || fail "the number of threads shows"

for n in 2 3 7; do
  shards=()
  for i in $(seq "$n"); do
    canonicalize -q "${inputs[@]}" --labels labels.tsv --phases all --shard "$i/$n" -o "s$i-$n.h5"
    shards=("s$i-$n.h5" "${shards[@]}")
  done
  motion-merge -q "${shards[@]}" -o "merged-$n.h5"
  cmp whole.h5 "merged-$n.h5" || fail "$n shards differ from one run"
done
# Joined by twos, and shards of different cuts do not join.
motion-merge -q s5-7.h5 s2-7.h5 s7-7.h5 -o left.h5
motion-merge -q s1-7.h5 s3-7.h5 s6-7.h5 s4-7.h5 -o right.h5
motion-merge -q right.h5 left.h5 -o joined.h5
cmp whole.h5 joined.h5 || fail "shards joined in groups differ from one run"
if motion-merge -q s1-2.h5 s2-3.h5 -o twice.h5 2> twice; then fail "clips that are in two shards were not noticed"; fi
grep -q 'the very clip that s1-2.h5 holds' twice || fail "$(cat twice)"
# The comparison can fail: a shard too few.
motion-merge -q s1-3.h5 s2-3.h5 -o few.h5
if cmp -s whole.h5 few.h5; then fail "a missing shard makes no difference"; fi

motion-info --check full merged-3.h5 > /dev/null
echo "$clips clips in 2, 3 and 7 shards: the bytes of one run"
