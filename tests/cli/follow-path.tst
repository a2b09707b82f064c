# STATUS EXPECTED COMMAND (see run.sh). What every tool shares is tried in bvh2npz.tst; what is computed in tests/control.
# setup: make-corpus -q --subjects 1 --seconds 3 --transitions 0 --action walking -o corpus; canonicalize -q corpus -o c.h5; canonicalize -q corpus --fps 60 -o fast.h5; canonicalize -q corpus --body source -o rig.h5
# setup: train-lstm -q c.h5 --steps 6 --batch 4 --window 8 --weights-only -o g.h5
# setup: printf '#!/bin/sh\nexec train-refiner -q --samples 4 --sample-frames 12 --batch 4 --buffer 4 --window 8 --steps 2 --weights-only "$@"\n' > tr; chmod +x tr; ./tr c.h5 --generator g.h5 -o r.h5
# setup: for o in fast rig; do train-lstm -q $o.h5 --steps 1 --batch 4 --window 8 --weights-only -o g-$o.h5; ./tr $o.h5 --generator g-$o.h5 -o r-$o.h5; done; motion-select -q c.h5 --head 1 -o part.h5; train-lstm -q part.h5 --steps 1 --batch 4 --window 8 --weights-only -o g-part.h5; ./tr part.h5 --generator g-part.h5 -o r-part.h5
# setup: head -c 9000 g.h5 > cut.h5; echo nope > bad.h5; mkdir folder sub
# setup: printf 'x,y\n0,0\n0.5,0\n' > line.csv; printf '# metres\n2 3\n2 3.2\n2.1\t3.5\n' > bend.csv; gzip -kc bend.csv > packed.csv.gz; cp line.csv sub/line.csv
# setup: echo '<svg xmlns="http://www.w3.org/2000/svg"><path d="M0 0h20c10 0 20 -10 20 -20"/></svg>' > pen.svg; echo '<svg xmlns="http://www.w3.org/2000/svg"><rect width="3" height="2"/></svg>' > box.svg
# setup: printf 'x,y\n0,0\n0.5;0\n' > semicolon.csv; printf '0,0\n1,2,3\n' > three.csv; printf '0,0\n\n1,nan\n' > nan.csv; printf '1,1\n1,1\n' > point.csv; : > empty.csv
# setup: printf '#!/bin/sh\nexec follow-path -q -m g.h5 --window 8 --overlap 4 --particles 4 --rounds 1 --iterations 3 "$@"\n' > s; printf '#!/bin/sh\nexec ./s --most-seconds 0.4 "$@"\n' > t; chmod +x s t
# setup: cat > q.py <<'END'
# setup: import sys, json, h5py, numpy as np
# setup: class A:
# setup:     def __init__(self, path): self.f = h5py.File(path)
# setup:     def __getitem__(self, n): return self.f[n][()]
# setup:     def names(self): return [n.decode() for n in self["clips/name"]]
# setup:     def history(self): return [json.loads(l) for l in bytes(self["history"]).decode().splitlines()]
# setup:     def root(self, i=0):
# setup:         s, n = self.f["clips/start"][i], self.f["clips/length"][i]
# setup:         return self.f["frames/root_position"][s:s+n]
# setup: def text(v): return v.decode() if isinstance(v, bytes) else v
# setup: def same(a, b, *names): return all(np.array_equal(a[n], b[n]) for n in names)
# setup: print(eval(sys.argv[1], {**globals(), "a": [A(p) for p in sys.argv[2:]]}))
# setup: END
# setup: printf '#!/bin/sh\nexec /usr/bin/python3 q.py "$@"\n' > q; chmod +x q; echo True > true

0 ~^Usage:.follow-path.*-o.FILE follow-path --help
0 ~^LibTorch.[12]\. follow-path --version

# a motion along a curve: it starts at its beginning, facing along it, and the curve is kept; equal bytes for any thread count and again, others for another seed
0 . ./t --path bend.csv -j 1 -o b.h5 && ./t --path bend.csv -j 2 -o b2.h5 && ./t --path bend.csv -j 5 -o b5.h5 && cmp b.h5 b2.h5 && cmp b.h5 b5.h5 && ./t --path bend.csv -j 2 -f -o b2.h5 && cmp b.h5 b2.h5
1 . ./t --path bend.csv --seed 2 -o seed.h5 && cmp -s b.h5 seed.h5
0 true ./q 'a[0].names() == ["bend"] and np.allclose(a[0].root()[0, :2], [2, 3], atol=1e-6) and 2 <= len(a[0].root()) <= 12 and (lambda p: p.shape[1] == 2 and np.allclose(p[[0, -1]], [[2, 3], [2.1, 3.5]], atol=1e-6) and abs(np.linalg.norm(np.diff(p, axis=0), axis=1) - 0.05).max() < 0.01)(a[0]["paths/bend"])' b.h5
0 true ./q '(lambda q: abs(2 * np.arctan2(q[3], q[0]) - np.arctan2(0.29, 0.06)) < 0.2)(a[0]["frames/rotations"][0, 0])' b.h5
0 true ./q '[e["tool"] for e in a[0].history()] == ["canonicalize", "train-lstm", "follow-path"] and [i["path"] for i in a[0].history()[2]["inputs"]] == ["g.h5", "bend.csv"] and a[0].history()[2]["seed"] == 1 and text(a[0].f.attrs["contacts"]) == "model"' b.h5
0 . motion-info --check full b.h5

# curves: CSV, SVG in either scale, packed, from a pipe; several, a clip each
0 true ./t --path packed.csv.gz -o packed.h5 && ./q 'a[1].names() == ["packed"] and same(a[0], a[1], "frames/rotations", "frames/root_position")' b.h5 packed.h5
0 true ./t --path - -o piped.h5 < bend.csv && ./q 'a[1].names() == ["stdin"] and a[1].history()[2]["inputs"][1]["path"] == "<stdin>" and same(a[0], a[1], "frames/rotations", "frames/root_position")' b.h5 piped.h5
0 true follow-path -q -m - --window 8 --overlap 4 --particles 4 --rounds 1 --iterations 3 --most-seconds 0.4 --path bend.csv -o mp.h5 < g.h5 && ./q 'same(a[0], a[1], "frames/rotations")' b.h5 mp.h5
0 true ./t --path pen.svg -o s1.h5 && ./t --path pen.svg --metres-per-unit 0.02 -o s2.h5 && ./q '[np.allclose(x["paths/pen"][-1], [k * 0.4, k * 0.2], atol=1e-5) for k, x in zip([1, 2], a)] == [True, True]' s1.h5 s2.h5
0 true ./t --path bend.csv --path pen.svg --path sub/line.csv --path line.csv -j 2 -o many.h5 && ./t --path bend.csv --path pen.svg --path sub/line.csv --path line.csv -j 1 -o many1.h5 && cmp many.h5 many1.h5 && ./q 'a[0].names() == ["bend", "pen", "line", "line#2"] and np.array_equal(a[0].root(0), a[1].root(0)) and not np.array_equal(a[0].root(2), a[0].root(3)) and set(a[0].f["paths"]) == {"bend", "pen", "line", "line#2"}' many.h5 b.h5

# with a refiner, and through pipes: shown on, seen and held
0 true ./t --refiner r.h5 --path bend.csv -o rb.h5 && ./q 'not same(a[0], a[1], "frames/rotations") and [e["tool"] for e in a[0].history()][-1] == "follow-path" and [i["path"] for i in a[0].history()[-1]["inputs"]] == ["g.h5", "r.h5", "bend.csv"]' rb.h5 b.h5
0 true cat r.h5 | ./t --refiner - --path bend.csv -o rp.h5 && ./q 'same(a[0], a[1], "frames/rotations")' rb.h5 rp.h5
0 . ./t --path bend.csv -o - | refine -q --pin-feet - -o pinned.h5 && motion-info --check full pinned.h5
0 true ./q 'a[0].names() == ["bend"] and np.array_equal(a[0]["paths/bend"], a[1]["paths/bend"]) and [e["tool"] for e in a[0].history()][-2:] == ["follow-path", "refine"]' pinned.h5 b.h5
0 . render -q b.h5 --view top --trajectory -o b.png && test -s b.png

# the table of windows and the summary
0 true ./t --path bend.csv --path pen.svg --report windows.tsv --json -o w.h5 > w.json && ./q '(lambda j: [c["clip"] for c in j["clips"]] == ["bend", "pen"] and j["windows"] == sum(c["windows"] for c in j["clips"]) and abs(j["clips"][0]["curve_m"] - 0.51623) < 1e-4 and all(0 <= c["followed_m"] <= c["curve_m"] and c["mean_distance_m"] <= c["largest_distance_m"] for c in j["clips"]) and [c["frames"] for c in j["clips"]] == list(a[0]["clips/length"]))(json.load(open("w.json")))' w.h5
0 ~^clip.frame.after_swarm.after_lbfgs.prior_per_frame.mean_distance_m.prior.noise.contact.curve.facing.speed$ head -n 1 windows.tsv
0 true ./q '(lambda rows: {r[0] for r in rows} == {"bend", "pen"} and rows[0][1] == "1" and rows[1][1] == "5" and all(float(r[3]) <= float(r[2]) and abs(sum(map(float, r[6:])) - float(r[3])) <= 1e-4 * sum(abs(float(v)) for v in r[6:]) for r in rows) and len(rows) == json.load(open("w.json"))["windows"])([l.split("\t") for l in open("windows.tsv").read().splitlines()[1:]])'
1 . /usr/bin/python3 -c 'import h5py; print(bytes(h5py.File("w.h5")["history"][()]).decode())' > history && grep -q -e report -e windows.tsv history
0 ~1.curves,.[0-9]+.windows;.L-BFGS.lowered follow-path -m g.h5 --window 8 --overlap 4 --particles 4 --rounds 1 --iterations 3 --most-seconds 0.4 --path bend.csv -o said.h5
0 ~line\.csv:.followed.for.0\.[0-9]+.of.0\.50.m:.--most-seconds.is.over follow-path -m g.h5 --window 8 --overlap 4 --particles 4 --rounds 1 --iterations 3 --most-seconds 0.1 --path line.csv -o said.h5 -f

# a joint that follows; what else is asked
0 true ./t --path bend.csv --point left_wrist -o wrist.h5 && ./q 'not same(a[0], a[1], "frames/rotations")' wrist.h5 b.h5
0 . ./t --path bend.csv --point pelvis -o pelvis.h5 && ./q 'same(a[0], a[1], "frames/rotations")' pelvis.h5 b.h5 | cmp - true
0 . ./s --path bend.csv --most-seconds 0.25 -j 1 -o o.h5; for o in "--curve-sigma 0.5" "--facing-sigma 0" "--speed 0.9" "--speed-sigma 0.02" "--spread 0.3" "--noise-sigma 0.1" "--contact-sigma 0.05" "--height-sigma 0.2"; do ./s --path bend.csv --most-seconds 0.25 --device cpu $o -f -o p.h5 || exit 5; ./q 'same(a[0], a[1], "frames/rotations")' o.h5 p.h5 | grep -q False || { echo "no change by $o" >&2; exit 6; }; done
0 . n=0; for o in "9 4 4 1 3" "8 3 4 1 3" "8 4 5 1 3" "8 4 4 0 3" "8 4 4 1 2"; do set -- $o; follow-path -q -m g.h5 --window $1 --overlap $2 --particles $3 --rounds $4 --iterations $5 --path bend.csv --most-seconds 0.3 -f -o p$((n += 1)).h5 || exit 5; done; ./q 'len({x["frames/rotations"].tobytes() for x in a}) == 6' p1.h5 p2.h5 p3.h5 p4.h5 p5.h5 o.h5 | cmp - true
0 . ./t --path bend.csv --step-length 0.4 --step-sigma 0.2 --report steps.tsv --rereads 3 -o st.h5 && head -n 1 steps.tsv | grep -q 'facing.speed.step_length$'
0 . follow-path -q -m g.h5 --particles 4 --rounds 1 --iterations 3 --path line.csv --window 2 --overlap 0 --most-seconds 0.2 -o two.h5 && motion-info --check full two.h5
0 true ./s --path line.csv --most-seconds 0.01 --report none.tsv -o one.h5 && ./q 'list(a[0]["clips/length"]) == [1]' one.h5

# usage
2 ~--model.is.required follow-path --path bend.csv -o x.h5
2 ~--path.is.required follow-path -m g.h5 -o x.h5
2 ~no.output.given ./t --path bend.csv
2 ~no.joint.'left_paw',.expected.one.of.pelvis,.*left_wrist ./t --path bend.csv --point left_paw -o x.h5
2 ~--report.-:.standard.output.is.for.the.archive ./t --path bend.csv --report - -o x.h5
2 ~--json.and.-o.-:.both.write.standard.output ./t --path bend.csv --json -o -
2 ~standard.input.given.twice ./t --path - --path - -o x.h5 < bend.csv
2 ~standard.input.given.twice ./t --refiner - --path - -o x.h5 < r.h5
2 ~an.overlap.of.8.frames.of.a.window.of.8 follow-path -m g.h5 --window 8 --overlap 8 --path bend.csv -o x.h5
2 ~--window follow-path -m g.h5 --window 1 --path bend.csv -o x.h5
2 ~--curve-sigma ./t --path bend.csv --curve-sigma 0 -o x.h5
2 ~--speed ./t --path bend.csv --speed -1 -o x.h5
2 ~--metres-per-unit ./t --path pen.svg --metres-per-unit 0 -o x.h5

# bad input
3 ~^follow-path:.semicolon\.csv:3:.'0\.5;0',.expected.two.numbers ./t --path semicolon.csv -o x.h5
3 ~^follow-path:.three\.csv:2:.3.numbers ./t --path bend.csv --path three.csv -o x.h5
3 ~^follow-path:.nan\.csv:3: ./t --path nan.csv -o x.h5
3 ~^follow-path:.point\.csv:.a.curve.of.1.different.points ./t --path point.csv -o x.h5
3 ~^follow-path:.empty\.csv:.a.curve.of.0.different.points ./t --path empty.csv -o x.h5
3 ~^follow-path:.box\.svg: ./t --path box.svg -o x.h5
3 ~^follow-path:.<stdin>:2: ./t --path - -o x.h5 < three.csv
3 ~^follow-path:.absent\.csv ./t --path absent.csv -o x.h5
3 ~^follow-path:.absent\.h5 follow-path -m absent.h5 --path bend.csv -o x.h5
3 ~^follow-path:.absent\.h5 ./t --refiner absent.h5 --path bend.csv -o x.h5
3 ~^follow-path:.bad\.h5 follow-path -m bad.h5 --path bend.csv -o x.h5
3 ~^follow-path:.cut\.h5 follow-path -m cut.h5 --path bend.csv -o x.h5
3 ~^follow-path:.r\.h5:.a.model.of.kind.'refiner',.expected.lstm-gmm follow-path -m r.h5 --path bend.csv -o x.h5
3 ~^follow-path:.g\.h5:.a.model.of.kind.'lstm-gmm',.expected.refiner ./t --refiner g.h5 --path bend.csv -o x.h5
3 ~^follow-path:.r-rig\.h5:.another.skeleton.than.the.generator's ./t --refiner r-rig.h5 --path bend.csv -o x.h5
3 ~^follow-path:.r-fast\.h5:.60.Hz,.expected.the.generator's.30.Hz ./t --refiner r-fast.h5 --path bend.csv -o x.h5
# a refiner that is standardised by other data than the generator
0 . ./t -q --refiner r-part.h5 --path bend.csv -o units.h5
1 . test -e x.h5

# output
4 ~b\.h5:.exists.already ./t --path bend.csv -o b.h5
4 ~windows\.tsv:.exists.already ./t --path bend.csv --report windows.tsv -o x.h5
4 ~nowhere ./t --path bend.csv -o nowhere/x.h5
4 ~nowhere ./t --path bend.csv --report nowhere/w.tsv -o x.h5
4 ~folder ./t --path bend.csv -o folder
1 . test -e x.h5
1 . test -n "$(find . -name '*.part-*')"
