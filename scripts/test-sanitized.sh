#!/bin/bash
# test-sanitized.sh - builds the presets asan and tsan and runs their tests.
#
#   scripts/test-sanitized.sh [JOBS]
#
# All tests under address and undefined-behaviour sanitizers (those of tests/reliability need the first place of a preloaded library and run without); under the thread sanitizer the suites
# of rooms that start threads, and two tools that work on many files at once. SUITES=REGEX: these alone, under both.
set -eu
cd "$(dirname "$0")/.."
jobs=${1:-2}
# LibTorch, OpenBLAS and HDF5 are not built with sanitizers. HDF5 1.10.8 loses what it read of a damaged object; LibTorch keeps what it made once.
suppressions=$PWD/build/leaks.supp
mkdir -p build
printf 'leak:libhdf5\nleak:libtorch\nleak:libc10\nleak:libopenblas\nleak:python3\nleak:libfontconfig\n' > "$suppressions"
printf 'called_from_lib:libtorch_cpu.so\nrace:libopenblas\n' > build/races.supp
export LSAN_OPTIONS=suppressions=$suppressions:print_suppressions=0 UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1
export TSAN_OPTIONS=suppressions=$PWD/build/races.supp:halt_on_error=1:ignore_noninstrumented_modules=1
for preset in asan tsan; do
  cmake --preset $preset
  cmake --build build/$preset -j "$jobs"
done
all='^(base|math|clip|store|io|cli|corpus|metrics|evaluation|formats|nn|train|lstm_gmm|refiner|cae_vae|motion_cell|baselines|classifier|denoiser|control|generators)$|^cli\.(canonicalize|bvh2npz)$|^pipeline\.shards$'
(cd build/asan && ctest --output-on-failure -j "$jobs" ${SUITES:+-R "$SUITES"})
(cd build/tsan && ctest --output-on-failure -j "$jobs" -R "${SUITES:-$all}")
