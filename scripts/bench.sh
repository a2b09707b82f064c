#!/bin/sh
# bench.sh BUILD_DIR - run every benchmark of a build, one after the other. Figures mean something on an idle machine.
set -eu
build=${1:?usage: bench.sh BUILD_DIR}
found=0
for bench in "$build"/bin/bench_*; do
  [ -x "$bench" ] || continue
  found=1
  echo "== ${bench##*/}"
  "$bench"
done
if [ "$found" = 0 ]; then
  echo "bench.sh: no bench_* in $build/bin, expected a build with MOCAPKIT_BENCH=ON" >&2
  exit 2
fi

# Parsing, and folder to archive on one core and two: CMU where the real-data test has unpacked it, a corpus otherwise.
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
data=$build/real-data/cmu/bvh
if [ -d "$data" ]; then
  echo "== bench_parsing, CMU"
  "$build/bin/bench_parsing" "$data" "$build/real-data/cmu/asfamc"
else
  data=$work/corpus
  "$build/bin/make-corpus" -q --subjects 6 -o "$data"
fi
frames=$(cat "$data"/*.bvh | awk '/^Frames:/ { n += $2 } END { print n }')
echo "== canonicalize, $frames source frames of $(basename "$(dirname "$data")")/$(basename "$data"): one core, then two, in turn"
for run in 1 2 3 4 5 6 7; do
  for cores in 1 2; do
    begin=$(date +%s%N)
    taskset -c "$([ "$cores" = 1 ] && echo 0 || echo 0,1)" "$build/bin/canonicalize" -q -j "$cores" "$data" -f -o "$work/all.h5"
    printf '%s ' $((frames * 1000000000 / ($(date +%s%N) - begin)))
  done
  echo
done | awk '{ one[NR] = $1; two[NR] = $2; ratio[NR] = $2 / $1 }
  function median(v,   i, j, t) { for (i = 1; i <= NR; i++) for (j = i + 1; j <= NR; j++) if (v[j] < v[i]) { t = v[i]; v[i] = v[j]; v[j] = t }; return v[int((NR + 1) / 2)] }
  END { m = median(one); printf "one core: %d source frames/s (median of %d; %d .. %d)\n", m, NR, one[1], one[NR]
        m = median(two); printf "two cores: %d source frames/s (%d .. %d)\n", m, two[1], two[NR]
        m = median(ratio); printf "two cores against one, paired: %.2f (%.2f .. %.2f)\n", m, ratio[1], ratio[NR] }'
