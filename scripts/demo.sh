#!/bin/sh
# demo.sh BIN - a labelled corpus is made, a model trained on it, and motions sampled: minutes on two cores.
set -eu
bin=$1
here=$(cd "$(dirname "$0")" && pwd)
out=${OUT:-out/demo}
began=$(date +%s)
rm -rf "$out"
mkdir -p "$out"
"$bin/make-corpus" --subjects "${SUBJECTS:-20}" --seconds 5 -o "$out/corpus"
SPLIT_BY=subject STEPS=${STEPS:-3000} "$here/pipeline.sh" "$bin" "$out/corpus" "$out/corpus/labels.tsv" "$out"
printf 'time             %d s\n' $(($(date +%s) - began))
