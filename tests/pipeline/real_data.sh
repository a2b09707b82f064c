#!/bin/bash
# Real motion through the file tools: every CMU and Bandai-Namco file becomes a canonical clip that stands upright, faces
# and walks forward, bends its knees backwards, has left and right in their places and its feet on the ground, judged by a
# forward kinematics in NumPy. Skipped where the data, which is not part of the project, is absent.
set -eu
source=$(cd "$(dirname "$0")/../.." && pwd)
data=$source/../shared/data
[ -x "$data/unpack.sh" ] || [ -e "$data/unpack.sh" ] || { echo "skipped: no real motion data beside the project (shared/data)"; exit 77; }
bin=${MOCAPKIT_BIN:?set it to the folder of the tools}
unpacked=$(dirname "$bin")/real-data
sh "$data/unpack.sh" "$unpacked"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
PATH=$bin:$PATH
cd "$work"

canonicalize -q "$unpacked/cmu/bvh" --labels "$unpacked/cmu/labels.tsv" -o cmu.h5
canonicalize -q "$unpacked/bandai-namco/bvh" --labels "$unpacked/bandai-namco/labels.tsv" -o bn.h5
for archive in cmu bn; do motion-info --check full "$archive.h5" > /dev/null; done
/usr/bin/python3 "$source/tests/pipeline/check_standing.py" cmu.h5 88 walking,running
/usr/bin/python3 "$source/tests/pipeline/check_standing.py" bn.h5 918 walking,running

# BVH -> npz -> archive is BVH -> archive, and what is exported reads back as the same motion.
file=$unpacked/cmu/bvh/02_01.bvh
canonicalize -q "$file" -o direct.h5
bvh2npz -q "$file" -o - | canonicalize -q - -o through.h5
motion-export -q direct.h5 -o back.bvh
canonicalize -q back.bvh -o back.h5
motion-export -q direct.h5 --format npz -o back.npz
canonicalize -q back.npz -o amass.h5
/usr/bin/python3 - <<'END'
import h5py, numpy as np
def load(p):
    f = h5py.File(p)
    return f['frames/rotations'][:], f['frames/root_position'][:]
q, p = load('direct.h5')
for name, angle, place in (('through.h5', 1e-5, 1e-5), ('back.h5', 1e-5, 1e-4), ('amass.h5', 1e-5, 1e-4)):
    r, s = load(name)
    assert r.shape == q.shape, (name, r.shape, q.shape)
    chord = np.minimum(np.linalg.norm(q - r, axis=-1), np.linalg.norm(q + r, axis=-1)).max()
    assert 2 * chord < angle, (name, 2 * chord)
    assert np.abs(p - s).max() < place, (name, np.abs(p - s).max())
END
echo "1006 real files stand and walk"
