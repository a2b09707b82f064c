#!/bin/bash
# scripts/latent-axes.py: a row for each axis, effects that are those of the clips, and one line for what is no such model.
set -u
source=$(cd "$(dirname "$0")/../.." && pwd)
bin=${MOCAPKIT_BIN:?set it to the folder of the tools}
[ -x "$bin/train-vae" ] || { echo "skipped: built without LibTorch"; exit 77; }
/usr/bin/python3 -c 'import h5py, numpy' 2> /dev/null || { echo "skipped: h5py and NumPy are not installed"; exit 77; }
export PATH=$bin:$PATH
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 2
make-corpus -q --subjects 1 --seconds 2 --transitions 0 -o corpus && canonicalize -q corpus -o c.h5 && train-vae -q c.h5 --window 20 --filters 8 --hidden 16 --latent 3 --epochs 40 --weights-only -o vae.h5 || exit 1
bad=0
/usr/bin/python3 "$source/scripts/latent-axes.py" vae.h5 -n 4 --top 2 --bin "$bin" --tsv axes.tsv > table.md || bad=1
[ "$(grep -c '^| [123] | ' table.md)" = 3 ] && [ "$(wc -l < table.md)" = 5 ] || { echo "not a row for each axis"; cat table.md; bad=1; }
# The pelvis's height along axis 2, from the archive itself.
sample -q -m vae.h5 -n 36 --latent-axis 2 -o a.h5
/usr/bin/python3 - <<'END' || { echo "an effect is not that of the clips"; bad=1; }
import h5py, numpy as np
f = h5py.File("a.h5")
height = f["frames/root_position"][:, 2].reshape(4, 9, 20).mean(2)
rows = [l.split("\t") for l in open("axes.tsv").read().splitlines()[1:]]
found = [float(r[2]) for r in rows if r[:2] == ["2", "pelvis height m"]]
assert len(rows) == 3 * 20, len(rows)
assert abs(found[0] - (height[:, 8] - height[:, 0]).mean()) < 1e-5, (found, height)
END
/usr/bin/python3 "$source/scripts/latent-axes.py" c.h5 --bin "$bin" > out 2>&1 && bad=1
grep -q 'c.h5: no model of kind cae-vae' out || { echo "not refused as it should be"; cat out; bad=1; }
exit $bad
