#!/bin/bash
# The same CMU motion from both of its formats: every AMC (with its ASF) and the published BVH of it, through bvh2npz, judged
# by a forward kinematics in NumPy. Skipped where the data, which is not part of the project, is absent.
set -eu
source=$(cd "$(dirname "$0")/../.." && pwd)
data=$source/../shared/data
[ -e "$data/unpack.sh" ] || { echo "skipped: no real motion data beside the project (shared/data)"; exit 77; }
bin=${MOCAPKIT_BIN:?set it to the folder of the tools}
unpacked=$(dirname "$bin")/real-data
sh "$data/unpack.sh" "$unpacked"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
PATH=$bin:$PATH
pairs=$unpacked/cmu/asfamc/pairs.tsv

bvh2npz -q "$unpacked/cmu/asfamc" -o "$work/amc"
mkdir "$work/in"
tail -n +2 "$pairs" | while IFS=$'\t' read -r amc _ bvh _; do ln -s "$unpacked/cmu/asfamc/$bvh" "$work/in/${amc%.amc}.bvh"; done
bvh2npz -q "$work/in" -o "$work/bvh"
/usr/bin/python3 "$source/tests/pipeline/asf_pairs.py" "$pairs" "$work/amc" "$work/bvh"
