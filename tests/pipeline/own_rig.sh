#!/bin/bash
# A studio's own rig from end to end: BVH of a body that is not the canonical one is kept as it is, trained on, sampled from, and
# comes back as BVH of that rig, joint for joint and bone for bone.
set -eu
source=$(cd "$(dirname "$0")/../.." && pwd)
bin=${MOCAPKIT_BIN:?set it to the folder of the tools}
[ -x "$bin/train-vrnn" ] || { echo "skipped: built without LibTorch"; exit 77; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
PATH=$bin:$PATH
cd "$work"

mkdir in
printf 'file\taction\n' > labels.tsv
for i in 1 2 3 4; do
  cp "$source/tests/data/bvh/tiny_human.bvh" "in/walk$i.bvh"
  printf 'in/walk%s.bvh\twalking\n' "$i" >> labels.tsv
done
canonicalize -q in --body source --labels labels.tsv -o own.h5
motion-info --check full own.h5 > /dev/null
joints=$(grep -cE '^[[:space:]]*(ROOT|JOINT)' in/walk1.bvh)
[ "$joints" != 22 ]
train-vrnn -q own.h5 --preset small --steps 3 --batch 4 --window 6 -o model.h5
sample -q -m model.h5 -n 2 --frames 12 -o samples.h5
motion-info --check full samples.h5 > /dev/null
motion-compare samples.h5 --real own.h5 > compared
grep -q walking compared
render -q samples.h5 -o strip.png
motion-export -q samples.h5 -o back
shape() { tr -d '\r' < "$1" | awk '/^[[:space:]]*(ROOT|JOINT)/ { printf "%s ", $2 } /OFFSET/ { printf "%.3f %.3f %.3f\n", $2 + 0, $3 + 0, $4 + 0 } /^MOTION/ { exit }'; }
for f in back/*.bvh; do diff <(shape in/walk1.bvh) <(shape "$f"); done
# The archive of another body is refused, not trained on by mistake.
canonicalize -q in --labels labels.tsv -o canonical.h5
if train-vrnn -q canonical.h5 --val own.h5 --steps 2 --batch 4 --window 6 -o other.h5 2> message; then echo "two bodies in one training"; exit 1; fi
echo "a rig of $joints joints went in, was learnt and came back"
