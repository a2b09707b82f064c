#!/bin/bash
# A batch of 50 files of which 7 are bad, each in its own way: 43 are done, 7 are in the table of rejects with line and
# reason, the status is 1, and what was written is byte for byte what a run without the bad ones writes.
set -eu
source=$(cd "$(dirname "$0")/../.." && pwd)
bin=${MOCAPKIT_BIN:?set it to the folder of the tools}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
PATH=$bin:$PATH
export LC_ALL=C
cd "$work"
/usr/bin/python3 "$source/tests/pipeline/bad_inputs.py" "$source/tests/data/bvh/tiny_human.bvh" good bad expected.tsv
fail() { echo "bad_inputs.sh: $*"; exit 1; }
ls good/*.bvh | sort > good.txt
ls good/*.bvh bad/* | sort -t / -k 2 > all.txt
[ "$(wc -l < good.txt)" = 43 ] && [ "$(wc -l < all.txt)" = 50 ] || fail "43 and 7 files expected"

canonicalize -q @good.txt -o good.h5
bvh2npz -q @good.txt -o good-npz
for j in 1 2; do
  status=0
  canonicalize -j $j @all.txt --rejects canonicalize.tsv -f -o all.h5 2> canonicalize.log || status=$?
  [ $status = 1 ] || fail "canonicalize -j $j: status $status, expected 1"
  cmp good.h5 all.h5 || fail "canonicalize -j $j: bad files show in the output"
  rm -rf all-npz
  status=0
  bvh2npz -j $j @all.txt --rejects bvh2npz.tsv -f -o all-npz 2> bvh2npz.log || status=$?
  [ $status = 1 ] || fail "bvh2npz -j $j: status $status, expected 1"
  diff -r good-npz all-npz || fail "bvh2npz -j $j: bad files show in the outputs"
  [ "$(ls all-npz | wc -l)" = 43 ] || fail "bvh2npz -j $j: $(ls all-npz | wc -l) files, expected 43"
  for tool in canonicalize bvh2npz; do
    grep -q '7 of 50 inputs failed' $tool.log || fail "$tool -j $j: no word of 7 failed inputs"
    /usr/bin/python3 "$source/tests/pipeline/bad_inputs.py" --check expected.tsv $tool.tsv || fail "$tool -j $j"
  done
done
# A rerun writes nothing, and says again what was refused; a bad file that was mended is taken in.
cp all.h5 before.h5
touch -d 2000-01-01 all.h5
status=0
canonicalize @all.txt --rejects again.tsv --skip-existing -o all.h5 2> again.log || status=$?
[ $status = 1 ] && cmp canonicalize.tsv again.tsv && grep -q 'all.h5 is up to date' again.log || fail "a rerun: status $status, $(cat again.log)"
[ -z "$(find all.h5 -newermt 2001-01-01)" ] || fail "a rerun of a finished batch wrote its output anew"
mended=$(head -1 expected.tsv | cut -f 1)
cp "$mended" mended
cp good/g00.bvh "$mended"
status=0
canonicalize -q @all.txt --skip-existing -o all.h5 2> again.log || status=$?
[ $status = 1 ] && [ -n "$(find all.h5 -newermt 2001-01-01)" ] || fail "after a file was mended: status $status, $(cat again.log)"
cp mended "$mended"
# The check can fail: a table that lacks a file.
head -7 canonicalize.tsv > short.tsv
if /usr/bin/python3 "$source/tests/pipeline/bad_inputs.py" --check expected.tsv short.tsv > noise; then fail "a file that is missing from the table is not noticed"; fi
echo "43 of 50 files done, 7 named with line and reason, by canonicalize and bvh2npz on one and two threads"
