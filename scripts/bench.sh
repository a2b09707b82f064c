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

# canonicalize on one core: CMU where the real-data test has unpacked it, a corpus otherwise.
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
data=$build/real-data/cmu/bvh
[ -d "$data" ] || { data=$work/corpus; "$build/bin/make-corpus" -q --subjects 6 -o "$data"; }
frames=$(cat "$data"/*.bvh | awk '/^Frames:/ { n += $2 } END { print n }')
echo "== canonicalize, one core, $frames source frames of $(basename "$(dirname "$data")")/$(basename "$data")"
for run in 1 2 3 4 5 6 7; do
  begin=$(date +%s%N)
  taskset -c 0 "$build/bin/canonicalize" -q -j 1 "$data" -f -o "$work/all.h5"
  echo $((frames * 1000000000 / ($(date +%s%N) - begin)))
done | sort -n | awk '{ v[NR] = $1 } END { printf "%d source frames/s (median of %d; %d .. %d)\n", v[int((NR + 1) / 2)], NR, v[1], v[NR] }'
