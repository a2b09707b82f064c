#!/bin/bash
# `make table2` in small: six models of a made corpus, trained for some steps, sampled, judged, in a table; a second run finds all done;
# a training that was stopped continues; a damaged file of figures is named.
set -eu
bin=${MOCAPKIT_BIN:?set it to the folder of the tools}
root=$(cd "$(dirname "$0")/../.." && pwd)
[ -x "$bin/train-vrnn" ] || { echo "skipped: no LibTorch"; exit 77; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export PATH=$bin:$PATH LC_ALL=C
cd "$work"
fail() { echo "table2.sh: $*"; exit 1; }

make-corpus -q --subjects 14 --seconds 3 --transitions 0 -o corpus
table() { make -s -f "$root/scripts/table2.mk" BIN="$bin" DATA=corpus LABELS=corpus/labels.tsv OUT=t SPLIT="--by subject --ratios 14,4,10" STEPS=8 SAMPLES=160 SEEDS="1 2" JUDGES="11 12" \
  OPTIONS="--batch 8 --window 30" JUDGING="--pca 8 --resamples 20" "$@"; }
table > out.txt 2> log.txt || { tail -5 log.txt; fail "status $?"; }
[ "$(grep -c '^| \(Proposed\|ERD\|QuaterNet\)[^|]*| [0-9]' t/table.md)" = 6 ] || fail "not six models: $(cat t/table.md)"
grep -q '^| Real data' t/table.md || fail "no row of real data"
grep -q "^| Training clips frozen in their class's mean pose | - | - | - | [0-9]" t/table.md || fail "no row of mean poses"
[ "$(grep -c '^| Proposed | \(walking\|jogging\|jumping\|lifting\) | [0-9]' t/table.md)" = 4 ] || fail "not four actions: $(cat t/table.md)"
cmp -s out.txt t/table.md || fail "the table is not what was printed"
[ "$(cut -f1 t/table.tsv | sort -u | wc -l)" = 9 ] || fail "table.tsv: $(cut -f1 t/table.tsv | sort -u)"
cp t/table.md first.md
cp t/motion-cell-2.h5 first.h5
touch -r t/table.md before
table > /dev/null 2> log.txt
[ ! t/table.md -nt before ] || fail "a second run made the table again"
# The same model once more, from nothing: the same bytes, the same table.
rm t/motion-cell-2.h5*
table > /dev/null 2> log.txt
cmp t/motion-cell-2.h5 first.h5 || fail "a model made again differs"
cmp t/table.md first.md || fail "a table made again differs"
echo nonsense > t/figures-erd-1-11.json
touch t/figures-erd-1-11.json
table > /dev/null 2> log.txt && fail "nonsense was taken for figures"
grep -q 'figures-erd-1-11.json: not JSON' log.txt || fail "$(cat log.txt)"
make -s -f "$root/scripts/table2.mk" BIN="$bin" 2> log.txt && fail "no data was taken"
grep -q 'usage: make table2' log.txt || fail "$(cat log.txt)"
make -s -f "$root/scripts/table2.mk" BIN="$bin" DATA=corpus LABELS=corpus/labels.tsv OUT=t STEPS=9 2> log.txt && fail "other settings were taken for the same table"
grep -q 'begun with other settings' log.txt || fail "$(cat log.txt)"
# A variant beside the six, on clips of its own; its settings are its own too.
motion-select -q t/train.h5 --attr gender=female -o women.h5
variant() { table MODELS="motion-cell matrices" SEEDS=1 OPTIONS_matrices="--representation rotation-matrix" STEPS_matrices=6 "$@"; }
variant > out.txt 2> log.txt TRAIN_matrices=t/train.h5 || { tail -5 log.txt; fail "a variant: status $?"; }
grep -q '^| matrices |' out.txt || fail "no variant in the table: $(cat out.txt)"
[ "$(motion-info --json t/matrices-1.h5 | grep -c rotation-matrix)" -gt 0 ] || fail "the variant's options did not reach it"
variant 2> log.txt TRAIN_matrices=women.h5 && fail "another training file was taken for the same model"
grep -q 'settings-matrices: this model was begun with other settings' log.txt || fail "$(cat log.txt)"
# 20 frames of 140 are gone.
[ "$(motion-info --json t/samples-erd-1.h5 | /usr/bin/python3 -c 'import json, sys; d = json.load(sys.stdin); print(d["frames"] <= 120 * 80 + 240 * 80, d["clips"])')" = "True 160" ] || fail "samples: $(motion-info t/samples-erd-1.h5 | head -2)"
