#!/bin/bash
# The tree obeys layers.txt, and the check notices each kind of planted violation.
set -u
source=$(cd "$(dirname "$0")/../.." && pwd)
check=$source/scripts/check-layers
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
bad=0
"$check" "$source" || { echo "the tree breaks layers.txt"; bad=1; }

plant() {  # FILE INCLUDE: a copy of a small lawful tree with one more line
  rm -rf "$work/tree"
  mkdir -p "$work/tree/libmocap/base" "$work/tree/libmocap/io" "$work/tree/libmocap/store" "$work/tree/apps"
  printf 'libmocap/base:\nlibmocap/io: libmocap/base\nlibmocap/store: libmocap/base\nlibmocap/cli: libmocap/base\nlibmodels/nn: libmocap/base\napps: libmocap/base libmocap/io libmocap/cli libmodels/nn\n' > "$work/tree/layers.txt"
  printf '#include "libmocap/base/error.hpp"\n' > "$work/tree/libmocap/io/bvh.hpp"
  printf '#include "libmocap/io/bvh.hpp"\n#include <vector>\n' > "$work/tree/apps/tool.cpp"
  [ $# = 0 ] && return
  mkdir -p "$(dirname "$work/tree/$1")"
  printf '%s\n' "$2" >> "$work/tree/$1"
}
refused() {  # FILE INCLUDE
  plant "$1" "$2"
  "$check" "$work/tree" > "$work/out" && { echo "not noticed: $2 in $1"; bad=1; }
  grep -q "^$1:[0-9]*: " "$work/out" || { echo "no place named for $2 in $1:"; cat "$work/out"; bad=1; }
}
plant
"$check" "$work/tree" || { echo "a lawful tree is refused"; bad=1; }
refused libmocap/io/bvh.cpp '#include "libmocap/store/archive.hpp"'
refused libmocap/base/error.hpp '#include "libmocap/io/bvh.hpp"'
refused libmocap/base/error.cpp '#include "apps/tool.hpp"'
refused libmocap/io/bvh/tokens.cpp '  #  include <libmodels/nn/mlp.hpp>'
refused libmocap/attic/old.cpp '#include <vector>'
refused libmocap/io/bvh.cpp '#include "bvh.hpp"'
refused libmocap/io/bvh.cpp '#include <CLI/CLI.hpp>'
refused libmocap/io/bvh.cpp '#include <hdf5.h>'
refused libmocap/base/random.cpp '#include <torch/torch.h>'
refused apps/tool.cpp '#include "libmocap/store/archive.hpp"'
"$check" "$work" > /dev/null 2>&1
[ $? = 2 ] || { echo "an empty tree passes"; bad=1; }
exit $bad
