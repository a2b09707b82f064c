# STATUS EXPECTED COMMAND (see run.sh). What every tool shares is tried in bvh2npz.tst; what is computed in tests/control.
# setup: make-corpus -q --subjects 1 --seconds 3 --transitions 0 --action walking --action jogging -o corpus; canonicalize -q corpus --labels corpus/labels.tsv -o c.h5; canonicalize -q corpus --fps 60 -o fast.h5
# setup: train-lstm -q c.h5 --steps 4 --batch 4 --window 8 --weights-only -o g.h5; train-lstm -q fast.h5 --steps 1 --batch 4 --window 8 --weights-only -o fast-g.h5
# setup: train-refiner -q c.h5 --generator g.h5 --batch 4 --window 8 --buffer 8 --samples 8 --sample-frames 20 --steps 2 --weights-only -o r.h5; train-refiner -q fast.h5 --generator fast-g.h5 --batch 4 --window 8 --buffer 8 --samples 8 --sample-frames 20 --steps 1 --weights-only -o fast-r.h5
# setup: printf '# time speed heading\n0 1.2 0\n\n0.5\t1.2,90\n1 2 -90\r\n' > go.txt; printf '0 1.2 0\n0.5 fast 90\n0.2 1 0\n0.6 1 0 4\n1 2 -90\n' > bad.txt; printf '1 1.2 0\n0.5 1.2 0\n' > back.txt; : > empty.txt; printf '# nothing\n\n' > comments.txt; mkdir folder; echo nope > bad.h5
# setup: head -c 5000 /dev/zero | tr '\0' ' ' > long.txt
# setup: printf '#!/bin/sh\nexec steer -q -m g.h5 --window 8 --overlap 4 --particles 4 --rounds 1 --iterations 2 --tail 0.5 "$@"\n' > t; chmod +x t
# setup: cat > q.py <<'END'
# setup: import sys, json, csv, h5py, numpy as np
# setup: def table(p):
# setup:     rows = list(csv.reader(open(p))); return rows[0], np.array(rows[1:], float)
# setup: print(eval(sys.argv[1], {**globals(), "f": sys.argv[2:]}))
# setup: END
# setup: printf '#!/bin/sh\nexec /usr/bin/python3 q.py "$@"\n' > q; chmod +x q; echo True > true

0 ~^Usage:.steer.*INPUT steer --help
0 ~^LibTorch.[12]\. steer --version

# a frame every thirtieth of a second until --tail after the last command; places of 22 joints and two contacts
0 . ./t go.txt > a.csv
0 true ./q '[(t.shape == (46, 69) and h[0] == "time_s" and h[1] == "pelvis_x" and h[-1] == "right_contact" and np.allclose(t[:, 0], np.arange(46) / 30, atol=1e-5) and set(t[:, -1]) <= {0, 1}) for h, t in [table(f[0])]] == [True]' a.csv
0 true ./t go.txt --columns rotations > r.csv && ./q '[(t.shape == (46, 94) and np.allclose(np.linalg.norm(t[:, 4:8], axis=1), 1, atol=1e-5)) for h, t in [table(f[0])]] == [True]' r.csv
0 true ./q 'np.allclose(table(f[0])[1][:, 1:4], table(f[1])[1][:, 1:4], atol=2e-5)' a.csv r.csv

# the same from a pipe, for any thread count, and as an archive; another seed is another motion
0 . ./t - < go.txt > b.csv && cmp a.csv b.csv
0 . ./t go.txt -j 2 > b.csv && cmp a.csv b.csv && ./t go.txt -j 5 > b.csv && cmp a.csv b.csv
1 . ./t go.txt --seed 2 > b.csv && cmp -s a.csv b.csv
0 . ./t go.txt -o a.h5 && motion-info --check full a.h5
0 true ./q '[(h["frames/root_position"].shape == (46, 3) and np.allclose(h["frames/root_position"][:], table(f[1])[1][:, 1:4], atol=2e-5) and h["clips/name"][0] == b"steered") for h in [h5py.File(f[0])]] == [True]' a.h5 a.csv
0 ~^train-lstm motion-info --history a.h5
0 ~^steer motion-info --history a.h5
0 . ./t go.txt -o b.h5 && cmp a.h5 b.h5 && ./t go.txt -o - > c2.h5 && cmp a.h5 c2.h5
0 . (cat go.txt; sleep 1) | ./t - | head -5 > five.csv && head -5 a.csv | cmp - five.csv

# live: frames of a window come before the next command is there
0 ~^14$ mkfifo p && (./t - < p > live.csv & p=$!; exec 3> p; printf '0 1.2 0\n0.4 1.2 90\n' >&3; for i in $(seq 300); do [ "$(wc -l < live.csv)" -ge 14 ] && break; sleep 0.1; done; wc -l < live.csv; exec 3>&-; wait $p)

# malformed lines
3 ~steer:.bad\.txt:2:.'fast',.expected.time,.speed.and.heading ./t bad.txt -o x.h5
1 . test -e x.h5
3 ~<stdin>:2:.'fast' ./t - < bad.txt
0 ~bad\.txt:2:.'fast'.*skipped steer -m g.h5 --lenient bad.txt --window 8 --overlap 4 --particles 2 --rounds 0 --iterations 1 --tail 0.2 -o lenient.h5
0 ~2.malformed.lines.were.skipped steer -m g.h5 --lenient bad.txt --window 8 --overlap 4 --particles 2 --rounds 0 --iterations 1 --tail 0.2 -f -o lenient.h5
3 ~back\.txt:2:.time.0\.5,.expected.at.least.that.of.the.command.before,.1 ./t back.txt
3 ~empty\.txt:.0.commands ./t empty.txt
3 ~comments\.txt:.0.commands ./t comments.txt
3 ~long\.txt:1:.a.line.of.more.than.4096.bytes ./t long.txt
3 ~absent ./t absent.txt

# options
0 true ./t go.txt --refiner r.h5 -o refined.h5 && ./q 'not np.array_equal(h5py.File(f[0])["frames/root_position"][:], h5py.File(f[1])["frames/root_position"][:])' a.h5 refined.h5
0 true ./t go.txt --speed-sigma 0.1 --direction-sigma 0.1 --turn-limit 90 --spread 1 --rereads 2 --noise-sigma 0.1 --contact-sigma 0.02 --height-sigma 0.02 --device cpu -o o.h5 && ./q 'not np.array_equal(h5py.File(f[0])["frames/root_position"][:], h5py.File(f[1])["frames/root_position"][:])' a.h5 o.h5
0 true ./t go.txt -f -o j.h5 --json > j.json && ./q '[(j["frames"] == 46 and len(j["commands"]) == 3 and j["commands"][1]["heading_deg"] == 90 and "settled_s" in j["commands"][2] and j["frames_per_second"] > 0 and j["window_latency_p99_s"] >= j["window_latency_median_s"]) for j in [json.load(open(f[0]))]] == [True]' j.json
0 ~frames,.*a.second;.windows.took steer -m g.h5 --window 8 --overlap 4 --particles 2 --rounds 0 --iterations 1 --tail 0.2 go.txt -o said.h5
0 ~^1$ printf '0 1 0\n' | steer -q -m g.h5 - --tail 0 | tail -n +2 | wc -l

# usage and models
2 ~--model.is.required steer go.txt
2 ~no.input ./t
2 ~--json.needs.-o ./t go.txt --json
2 ~both.from.standard.input steer -m - - < go.txt
2 ~an.overlap.of.8.frames.of.a.window.of.8 steer -m g.h5 go.txt --window 8 --overlap 8
2 ~expected ./t go.txt --columns angles
2 ~expected ./t go.txt --tail -1
2 ~expected ./t go.txt --turn-limit 0
3 ~a.model.of.kind.'refiner',.expected.lstm-gmm steer -m r.h5 go.txt
3 ~g\.h5.*expected.refiner ./t go.txt --refiner g.h5
3 ~fast-r\.h5 ./t go.txt --refiner fast-r.h5
3 ~bad\.h5 steer -m bad.h5 go.txt
4 ~exists ./t go.txt -o a.h5
