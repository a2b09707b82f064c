#!/bin/bash
# A file tool (apps/*.cpp that includes no header of libmodels) neither loads LibTorch nor starts slowly.
set -u
source=${MOCAPKIT_SOURCE:-$(cd "$(dirname "$0")/../.." && pwd)}
bin=${MOCAPKIT_BIN:?set it to the folder of the tools}
bad=0 checked=0
loads_torch() { ldd "$1" | grep -Eq 'lib(torch|c10)'; }
for app in "$source"/apps/*.cpp; do
  tool=$(basename "$app" .cpp)
  [ -x "$bin/$tool" ] || continue
  if grep -q '^#include "libmodels/' "$app"; then
    # The look at ldd can fail: it sees LibTorch where it is.
    loads_torch "$bin/$tool" || { echo "$tool includes libmodels, but no libtorch was seen: the check is blind"; bad=1; }
    continue
  fi
  checked=$((checked + 1))
  ! loads_torch "$bin/$tool" || { echo "$tool: a file tool links LibTorch"; bad=1; }
  # The best of 20: the machine may be busy. A sanitizer build is slower by its own start.
  best=999999
  for _ in $(seq 20); do
    start=$(date +%s%N); "$bin/$tool" --help > /dev/null || { echo "$tool --help fails"; bad=1; break; }; end=$(date +%s%N)
    ms=$(((end - start) / 1000000)); [ $ms -lt $best ] && best=$ms
    [ $best -lt 50 ] && break
  done
  [ $best -lt 100 ] || { echo "$tool --help takes $best ms, expected under 100"; bad=1; }
done
[ $checked -gt 0 ] || { echo "no file tool found in $bin"; bad=1; }
exit $bad
