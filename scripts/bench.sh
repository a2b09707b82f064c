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
