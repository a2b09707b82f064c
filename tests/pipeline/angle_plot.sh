#!/bin/bash
# scripts/angle-plot.py: a curve for each archive, through the right points, and one line for what is not there.
set -u
source=$(cd "$(dirname "$0")/../.." && pwd)
/usr/bin/python3 -c 'import h5py, numpy' 2> /dev/null || { echo "skipped: h5py and NumPy are not installed"; exit 77; }
export PATH=${MOCAPKIT_BIN:?set it to the folder of the tools}:$PATH
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 2
bad=0
plot() { /usr/bin/python3 "$source/scripts/angle-plot.py" "$@"; }
make-corpus -q --subjects 1 --seconds 2 --action walking --transitions 0 --noise -o pairs && canonicalize -q pairs/clean -o clean.h5 && canonicalize -q pairs/noisy -o noisy.h5 || exit 1
plot --joint right_knee --from 0.5 --to 1.5 noisy=noisy.h5 'a<b=clean.h5' -o a.svg || bad=1
[ "$(grep -c '<polyline' a.svg)" = 2 ] && grep -q 'a&lt;b</text>' a.svg && grep -q '>degrees</text>' a.svg || { echo "curves or labels are missing"; bad=1; }
# The knee's angle of the clean clip, read back from the picture, is that of the archive but for one scale and shift.
/usr/bin/python3 - <<'END' || { echo "the curve is not the joint's angle"; bad=1; }
import re, h5py, numpy as np
line = re.findall(r'<polyline points="([^"]*)"', open("a.svg").read())[1]
y = np.array([float(p.split(",")[1]) for p in line.split()])
f = h5py.File("clean.h5")
q = f["frames/rotations"][15:46, [n.decode() for n in f["skeleton/joint_names"][()]].index("right_knee")].astype(float)
angle = np.degrees(2 * np.arccos(np.clip(np.abs(q[:, 0]), 0, 1)))  # a hinge: the whole rotation
assert len(y) == 31 and np.corrcoef(y, angle)[0, 1] < -0.999, np.corrcoef(y, angle)
END
refused() {  # STATUS REGEX ARGUMENTS
  local status=$1 regex=$2
  shift 2
  plot "$@" > out 2>&1
  [ $? = "$status" ] && grep -Eq "$regex" out || { echo "not refused as it should be: $*"; cat out; bad=1; }
}
refused 3 'no joint tail, expected one of pelvis' --joint tail a=clean.h5 -o x.svg
refused 3 'no clip nobody, expected one such as walking' --joint head --clip nobody a=clean.h5 -o x.svg
refused 3 'nowhere\.h5' --joint head a=nowhere.h5 -o x.svg
refused 2 'expected LABEL=ARCHIVE' --joint head clean.h5 -o x.svg
refused 2 'fewer than 2 frames' --joint head --from 90 a=clean.h5 -o x.svg
refused 4 'nowhere' --joint head a=clean.h5 -o nowhere/x.svg
[ ! -e x.svg ] || bad=1
exit $bad
