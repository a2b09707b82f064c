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

# BVH -> npz -> archive is BVH -> archive, and what is exported reads back as the same motion, on the canonical body and on the file's own.
for file in "$unpacked/cmu/bvh/02_01.bvh" "$(find "$unpacked/bandai-namco/bvh" -name '*walk*.bvh' | sort | head -1)"; do
  for body in canonical source; do
    canonicalize -q -f "$file" --body $body -o direct.h5
    bvh2npz -q "$file" -o - | canonicalize -q -f - --body $body -o through.h5
    motion-export -q -f through.h5 -o back.bvh
    canonicalize -q -f back.bvh --body $body -o back.h5
    others="through.h5 back.h5"
    if [ $body = canonical ]; then
      motion-export -q -f direct.h5 --format npz -o back.npz
      canonicalize -q -f back.npz -o amass.h5
      others="$others amass.h5"
    fi
    /usr/bin/python3 - $others <<'END'
import sys, h5py, numpy as np
def load(path):
    f = h5py.File(path)
    joints, parents = [n.decode() for n in f['skeleton/joint_names'][:]], f['skeleton/end_parents'][:]
    # BVH writes joints depth first: everything by name.
    tips = {joints[p]: o for p, o in zip(parents, f['skeleton/end_sites'][:])}
    return ({n: f['frames/rotations'][:, j] for j, n in enumerate(joints)}, f['frames/root_position'][:], tips, dict(zip(joints, f['skeleton/rest_offsets'][:])))
q, p, tips, bones = load('direct.h5')
for name in sys.argv[1:]:
    r, s, other_tips, other_bones = load(name)
    assert r.keys() == q.keys() and tips.keys() == other_tips.keys(), name
    chord = max(np.minimum(np.linalg.norm(q[j] - r[j], axis=-1), np.linalg.norm(q[j] + r[j], axis=-1)).max() for j in q)
    assert 2 * chord < 1e-5, (name, 2 * chord)
    assert np.abs(p - s).max() < 1e-4, (name, np.abs(p - s).max())
    assert max(np.abs(tips[j] - other_tips[j]).max() for j in tips) < 1e-5, (name, 'end sites')
    assert max(np.abs(bones[j] - other_bones[j]).max() for j in bones) < 1e-5, (name, 'bones')
END
  done
done
echo "1006 real files stand and walk"
