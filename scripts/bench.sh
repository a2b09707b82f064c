#!/bin/sh
# bench.sh BUILD_DIR - run every benchmark of a build, one after the other. Figures mean something on an idle machine.
set -eu
build=${1:?usage: bench.sh BUILD_DIR}
found=0
for bench in "$build"/bin/bench_*; do
  [ -x "$bench" ] || continue
  found=1
  echo "== ${bench##*/}"
  "$bench"
done
if [ "$found" = 0 ]; then
  echo "bench.sh: no bench_* in $build/bin, expected a build with MOCAPKIT_BENCH=ON" >&2
  exit 2
fi

# Parsing, and folder to archive on one core and two: CMU where the real-data test has unpacked it, a corpus otherwise.
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
if /usr/bin/python3 -c 'import scipy' 2> /dev/null; then
  echo "== Frechet distance of the same features, against NumPy and SciPy on as many threads (best of 5 medians of 3; sqrtm once)"
  "$build/bin/bench_frechet" "$work" | tee "$work/frechet"
  OPENBLAS_NUM_THREADS=2 /usr/bin/python3 - "$work" << 'END' | tee -a "$work/frechet"
import statistics, sys, time
import numpy as np
from scipy import linalg
a, b = [np.fromfile("%s/%s.f64" % (sys.argv[1], k)).reshape(8000, 512) for k in "ab"]
def distance(root):
    m, n, s, t = a.mean(0), b.mean(0), np.cov(a, rowvar=False), np.cov(b, rowvar=False)
    return (m - n) @ (m - n) + np.trace(s) + np.trace(t) - 2 * root(s, t)
def eigh(s, t):
    w, v = linalg.eigh(s)
    r = (v * np.sqrt(np.maximum(w, 0))) @ v.T
    return np.sqrt(np.maximum(linalg.eigvalsh(r @ t @ r), 0)).sum()
for name, root in ("SciPy eigh", eigh), ("SciPy sqrtm", lambda s, t: np.trace(linalg.sqrtm(s @ t).real)):
    best = 1e9
    for _ in range(5 if root is eigh else 1):
        times = []
        for _ in range(3 if root is eigh else 1):
            begin = time.perf_counter()
            found = distance(root)
            times.append(time.perf_counter() - begin)
        best = min(best, statistics.median(times))
    print("%-52s %.3f s wall, distance %.12g" % (name, best, found))
END
  awk '/^Frechet/ { for (i = 1; i <= NF; i++) if ($i == "s" && !ours) ours = $(i - 1) } /^SciPy/ { printf "against %s %s: %.2f of its time\n", $1, $2, ours / $3 }' "$work/frechet"
fi
data=$build/real-data/cmu/bvh
if [ -d "$data" ]; then
  echo "== bench_parsing, CMU"
  "$build/bin/bench_parsing" "$data" "$build/real-data/cmu/asfamc"
else
  data=$work/corpus
  "$build/bin/make-corpus" -q --subjects 6 -o "$data"
fi
frames=$(cat "$data"/*.bvh | awk '/^Frames:/ { n += $2 } END { print n }')
echo "== canonicalize, $frames source frames of $(basename "$(dirname "$data")")/$(basename "$data"): one core, then two, in turn"
for run in 1 2 3 4 5 6 7; do
  for cores in 1 2; do
    begin=$(date +%s%N)
    taskset -c "$([ "$cores" = 1 ] && echo 0 || echo 0,1)" "$build/bin/canonicalize" -q -j "$cores" "$data" -f -o "$work/all.h5"
    printf '%s ' $((frames * 1000000000 / ($(date +%s%N) - begin)))
  done
  echo
done | awk '{ one[NR] = $1; two[NR] = $2; ratio[NR] = $2 / $1 }
  function median(v,   i, j, t) { for (i = 1; i <= NR; i++) for (j = i + 1; j <= NR; j++) if (v[j] < v[i]) { t = v[i]; v[i] = v[j]; v[j] = t }; return v[int((NR + 1) / 2)] }
  END { m = median(one); printf "one core: %d source frames/s (median of %d; %d .. %d)\n", m, NR, one[1], one[NR]
        m = median(two); printf "two cores: %d source frames/s (%d .. %d)\n", m, two[1], two[NR]
        m = median(ratio); printf "two cores against one, paired: %.2f (%.2f .. %.2f)\n", m, ratio[1], ratio[NR] }'
