#!/bin/bash
# bench-archive.sh BUILD_DIR [CLIPS] [HOURS] - a simulated AMASS (default 20000 clips, 40 hours): written, opened, read,
# merged from 4 shards; and the peak memory of canonicalize and motion-merge. Needs MOCAPKIT_BENCH=ON and three times
# the archive's size (1.6 GB) in $TMPDIR. Figures mean something on an idle machine.
set -eu
build=$(cd "${1:?usage: bench-archive.sh BUILD_DIR [CLIPS] [HOURS]}" && pwd)
clips=${2:-20000} hours=${3:-40}
[ -x "$build/bin/bench_archive" ] || { echo "bench-archive.sh: no bench_archive in $build/bin, expected a build with MOCAPKIT_BENCH=ON" >&2; exit 2; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
PATH=$build/bin:$PATH
cd "$work"

# Wall clock and peak memory of a command.
measure() {
  /usr/bin/python3 - "$@" <<'PY'
import resource, subprocess, sys, time
t = time.time()
status = subprocess.call(sys.argv[2:])
print("  %-38s %6.1f s, peak memory %d MB" % (sys.argv[1], time.time() - t, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss // 1024), flush=True)
sys.exit(status)
PY
}

bench_archive . "$clips" "$hours" 4
echo "tools on it"
measure "motion-merge, 4 shards" motion-merge -q shard-3.h5 shard-1.h5 shard-4.h5 shard-2.h5 -o merged.h5
cmp whole.h5 merged.h5
echo "  4 shards merged: the bytes of the whole"
rm shard-*.h5 merged.h5
measure "motion-select, a third by attribute" motion-select -q whole.h5 --attr action=jogging -o some.h5
measure "motion-info" motion-info whole.h5 > info
grep 'peak memory' info
rm ./*.h5

echo "canonicalize of a corpus, 8 s at 120 Hz each"
make-corpus -q --subjects 125 --clips 1 --transitions 0 -o corpus
ls corpus/*.bvh | head -1000 > thousand.txt
awk 'NR % 100 == 1' thousand.txt > ten.txt
for j in 1 2; do
  measure "10 clips, -j $j" canonicalize -q -j $j @ten.txt -f -o ten.h5
  measure "$(wc -l < thousand.txt) clips, -j $j" canonicalize -q -j $j @thousand.txt -f -o thousand.h5
done
seq 64 | while read -r i; do canonicalize -q @thousand.txt --shard "$i/64" -o "shard-$i.h5"; done
measure "motion-merge, 64 shards of them" motion-merge -q shard-*.h5 -o merged.h5
cmp thousand.h5 merged.h5
