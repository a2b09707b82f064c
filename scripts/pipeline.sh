#!/bin/sh
# pipeline.sh BIN DATA LABELS OUT - from a folder of motion files to sampled motion.
#
# Writes into OUT: all.h5, split/{train,val,test}.h5, model.h5, samples.h5, strips.png, bvh/*.bvh, table.txt, rejects.tsv.
# Run it again after an interruption: what is finished is kept, and the training continues where it stopped.
#   STEPS=4000      optimiser steps (default: the preset's)     PRESET=small|paper
#   DENOISER=model.h5 (from train-denoiser) mends the clips before anything is trained on them
#   SPLIT_BY=source subject keeps a subject's clips together    SAMPLES=64    FRAMES=140    SEED=1
set -eu
bin=$1 data=$2 labels=$3 out=$4
PATH=$bin:$PATH
[ -n "$data" ] && [ -n "$labels" ] && [ -n "$out" ] || { echo "usage: make pipeline DATA=DIR LABELS=FILE OUT=DIR" >&2; exit 2; }
mkdir -p "$out"
say() { printf '\n== %s\n' "$*"; }
run() { printf '%s\n' "$*"; "$@"; }

say "1. clean the data: one body, one rate, one frame"
if [ ! -e "$out/all.h5" ]; then
  # Status 1: some files were refused and are listed; the rest is done.
  clean=$out/all.h5
  [ -z "${DENOISER:-}" ] || clean=$out/measured.h5
  run canonicalize "$data" --labels "$labels" --rejects "$out/rejects.tsv" -f -o "$clean" || [ $? -eq 1 ]
  [ -z "${DENOISER:-}" ] || run denoise "$clean" -m "$DENOISER" --report "$out/mended.tsv" -f -o "$out/all.h5"
fi
motion-info "$out/all.h5"

say "2. split by ${SPLIT_BY:-source}"
[ -e "$out/split/train.h5" ] || run motion-split "$out/all.h5" --by "${SPLIT_BY:-source}" -o "$out/split"

say "3. train (stop it any time, run again to continue)"
run train-vrnn "$out/split/train.h5" --val "$out/split/val.h5" --preset "${PRESET:-small}" ${STEPS:+--steps "$STEPS"} \
  --seed "${SEED:-1}" --resume -o "$out/model.h5"

say "4. sample"
run sample -m "$out/model.h5" -n "${SAMPLES:-64}" --frames "${FRAMES:-140}" --seed "${SEED:-1}" -f -o "$out/samples.h5"
run render "$out/split/test.h5" --compare "$out/samples.h5" -f -o "$out/strips.png"
run motion-export "$out/samples.h5" -f -o "$out/bvh"

say "5. what came out"
{
  motion-compare "$out/samples.h5" --real "$out/split/train.h5" --unseen "$out/split/test.h5"
  echo
  awk -F'\t' 'BEGIN { n = 0 } NR == 1 { for (i = 1; i <= NF; i++) at[$i] = i; next }
    { loss[n] = $at["loss_per_word"]; angle[n++] = $at["rotation_deg"] }
    function mean(v, first, count,   i, sum) { for (i = first; i < first + count; i++) sum += v[i]; return sum / count }
    END { w = int(n / 50); if (w < 1) w = 1
      printf "training         loss a word %.4g at first, %.4g at last; joint angle error %.2f deg, then %.2f (means of %d steps)\n", \
        mean(loss, 0, w), mean(loss, n - w, w), mean(angle, 0, w), mean(angle, n - w, w), w }' "$out/model.h5.log.tsv"
  echo "pictures         $out/strips.png (test clips above, samples below)"
  echo "for Blender      $(ls "$out/bvh" | wc -l) files in $out/bvh/"
  echo "samples, model   $out/samples.h5, $out/model.h5"
} | tee "$out/table.txt"
