#!/bin/bash
# `make refinement` in small: an LSTM and two refiners trained for some steps on a made corpus, every row sampled, refined, pinned, judged, in a table; a second run finds all
# done; for a Motion Cell likewise, by a pipe; a damaged file of figures is named.
set -eu
bin=${MOCAPKIT_BIN:?set it to the folder of the tools}
root=$(cd "$(dirname "$0")/../.." && pwd)
[ -x "$bin/train-lstm" ] || { echo "skipped: no LibTorch"; exit 77; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export PATH=$bin:$PATH LC_ALL=C
cd "$work"
fail() { echo "refinement.sh: $*"; exit 1; }

make-corpus -q --subjects 8 --seconds 3 --transitions 0 --action walking --action jogging -o corpus
table() { make -s -f "$root/scripts/refinement.mk" BIN="$bin" DATA=corpus LABELS=corpus/labels.tsv OUT=t VALUES="walking jogging" SPLIT="--by subject --ratios 10,2,4" STEPS=12 GENERAL_STEPS=4 REFINER_STEPS=8 \
  LSTM="--batch 4" REFINER="--batch 4 --buffer 8 --samples 8" SAMPLES=16 FRAMES=60 JUDGING="--pca 4 --resamples 10" "$@"; }
table > out.txt 2> log.txt || { tail -5 log.txt; fail "status $?"; }
cmp -s out.txt t/table.md || fail "the table is not what was printed"
[ "$(grep -c '^| \(captured\|generated\|refined, blind to contacts\|refined, with contacts\)\(, pinned\)\? | [0-9]' t/table.md)" = 24 ] || fail "not eight rows of all, walking and jogging: $(cat t/table.md)"
grep -q '^| refined, with contacts |.* | [01]\.[0-9][0-9] |$' t/table.md || fail "no accuracy of the discriminator"
[ "$(cut -f1 t/table.tsv | sort -u | wc -l)" = 10 ] || fail "table.tsv: $(cut -f1 t/table.tsv | sort -u)"
# What the table says is what the tools say.
motion-compare -q t/contacts.h5 --real t/generated.h5 --by none --json > c.json
/usr/bin/python3 -c '
import json
rows = {r["set"]: r for r in json.load(open("c.json"))["rows"]}
table = {tuple(l.split("\t")[:3]): float(l.split("\t")[3]) for l in open("t/table.tsv").read().splitlines()[1:]}
for key in ("energy", "root_speed_mps"):
    assert abs(table["contacts", "all", key + "_of_input"] - rows["generated"][key] / rows["real"][key]) < 1e-4, key
f = json.load(open("t/figures-plain-pinned.json"))
assert abs(table["plain-pinned", "walking", "skate_mps"] - f["skate_mps.walking.value"]) < 1e-5
for row in ("mocap", "generated", "plain", "contacts"):
    assert table[row + "-pinned", "all", "contact_speed_mps"] < table[row, "all", "contact_speed_mps"], row' || fail "the table says something else"
touch -r t/table.md before
table > /dev/null 2> log.txt
[ ! t/table.md -nt before ] || fail "a second run made the table again"
echo nonsense > t/compared-plain.json
touch t/compared-plain.json
table > /dev/null 2> log.txt && fail "nonsense was taken for figures"
grep -q 'compared-plain.json: not JSON' log.txt || fail "$(cat log.txt)"
table STEPS=13 2> log.txt && fail "other settings were taken for the same table"
grep -q 'begun with other settings' log.txt || fail "$(cat log.txt)"
make -s -f "$root/scripts/refinement.mk" BIN="$bin" 2> log.txt && fail "no data was taken"
grep -q 'usage: make refinement' log.txt || fail "$(cat log.txt)"

# Another generator, refined in a pipe into the evaluation.
train-vrnn -q t/train.h5 --attribute action --attribute gender --preset small --batch 8 --window 30 --steps 4 -o cell.h5
train-refiner -q t/train.h5 --generator cell.h5 --batch 4 --buffer 8 --samples 8 --steps 4 -o refiner.h5
sample -q -m cell.h5 -n 16 --frames 60 -o - | refine -q - -m refiner.h5 --pin-feet -o - | fid-eval -q - --real t/real.h5 --train t/mocap.h5 --classifier t/judge.h5 --pca 4 --resamples 10 --json > piped.json || fail "the pipe: status $?"
grep -q '"fid.value": [0-9]' piped.json || fail "$(cat piped.json)"
