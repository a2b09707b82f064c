#!/bin/bash
# scripts/motion-grid.py: the figures asked for, and one line for what is no archive.
set -u
source=$(cd "$(dirname "$0")/../.." && pwd)
/usr/bin/python3 -c 'import h5py, numpy' 2> /dev/null || { echo "skipped: h5py and NumPy are not installed"; exit 77; }
export PATH=${MOCAPKIT_BIN:?set it to the folder of the tools}:$PATH
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 2
bad=0
grid() { /usr/bin/python3 "$source/scripts/motion-grid.py" "$@"; }
make-corpus -q --subjects 1 --seconds 1 --transitions 0 -o corpus && canonicalize -q corpus -o c.h5 || exit 1
grid c.h5 --columns 3 --most 5 --figures 4 --names -o grid.svg || bad=1
[ "$(grep -c '<circle' grid.svg)" = 20 ] && [ "$(grep -c '<text' grid.svg)" = 5 ] && /usr/bin/python3 -c 'import xml.dom.minidom as m; m.parse("grid.svg")' || { echo "not five clips of four figures"; bad=1; }
echo nope > bad.h5
refused() {  # STATUS REGEX ARGUMENTS
  local status=$1 regex=$2
  shift 2
  grid "$@" > out 2>&1
  [ $? = "$status" ] && grep -Eq "$regex" out || { echo "not refused as it should be: $*"; cat out; bad=1; }
}
refused 3 'nowhere\.h5' nowhere.h5 -o x.svg
refused 3 'bad\.h5' bad.h5 -o x.svg
refused 2 'at least 1' c.h5 --figures 0 -o x.svg
refused 4 'nowhere/x' c.h5 -o nowhere/x.svg
exit $bad
