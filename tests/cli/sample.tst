# STATUS EXPECTED COMMAND (see run.sh). What every tool shares is tried in bvh2npz.tst.
# setup: make-corpus -q --subjects 1 --seconds 1 --transitions 0 -o corpus; canonicalize -q corpus --labels corpus/labels.tsv -o c.h5
# setup: train-vrnn -q c.h5 --steps 3 --batch 4 --window 6 --pretrain-steps 1 --weights-only -o m.h5; head -c 100000 m.h5 > cut.h5; echo nope > bad.h5; mkdir tmp folder
# setup: cp m.h5 flipped.h5; printf 'XXXXXXXX' | dd of=flipped.h5 bs=1 seek=2000000 conv=notrunc status=none
# setup: cat > q.py <<'END'
# setup: import sys, json, h5py, hashlib, numpy as np
# setup: class Archive:
# setup:     def __init__(self, path):
# setup:         self.f = f = h5py.File(path)
# setup:         self.names = [n.decode() for n in f["clips/name"][()]]
# setup:         self.length = list(f["clips/length"][()])
# setup:         self.history = [json.loads(l) for l in bytes(f["history"][()]).decode().splitlines()]
# setup:     def attribute(self, name): return [v.decode() for v in self.f["clips/attributes/" + name][()]]
# setup:     def clip(self, i):
# setup:         s, n = self.f["clips/start"][i], self.f["clips/length"][i]
# setup:         return self.f["frames/rotations"][s:s+n], self.f["frames/root_position"][s:s+n]
# setup: def equal(a, b): return all(np.array_equal(x, y) for x, y in zip(a, b))
# setup: def sha(p): return hashlib.sha256(open(p, "rb").read()).hexdigest()
# setup: print(eval(sys.argv[1], {**globals(), "a": [Archive(p) for p in sys.argv[2:]]}))
# setup: END
# setup: printf '#!/bin/sh\nexec /usr/bin/python3 q.py "$@"\n' > q; chmod +x q; echo True > true; echo 141 > 141

0 ~^Usage:.sample.*-o.FILE sample --help
0 ~^LibTorch.[12]\. sample --version
4 ~write.failed sample --help > /dev/full

# counts, lengths, all combinations equally
0 true sample -q -m m.h5 -n 8 -j 2 -o eight.h5 && ./q 'len(a[0].names) == 8 and set(a[0].length) == {140} and len({*zip(a[0].attribute("action"), a[0].attribute("gender"))}) == 8' eight.h5
0 . motion-info --check full eight.h5
0 true ./q 'a[0].names[0] == "jogging-female-0" and a[0].f.attrs["frame_rate_hz"] == 30 and a[0].f["frames/contacts"].shape == (1120, 2)' eight.h5
0 true ./q 'all(np.allclose(p[0, :2], 0, atol=1e-6) and abs(2 * np.arctan2(q[0, 0, 3], q[0, 0, 0])) < 1e-5 for q, p in [a[0].clip(i) for i in range(8)])' eight.h5
0 true ./q '[e["tool"] for e in a[0].history] == ["canonicalize", "train-vrnn", "sample"] and a[0].history[2]["inputs"] == [{"path": "m.h5", "sha256": sha("m.h5")}] and a[0].history[2]["seed"] == 1' eight.h5
0 ~preset:default motion-info eight.h5

# clip 7 is the same, whether 8 or 20 are asked for and whatever the number of threads; equal runs give equal bytes
0 true sample -q -m m.h5 --count 20 -j 1 -o twenty.h5 && ./q 'all(equal(a[0].clip(i), a[1].clip(i)) for i in range(8)) and not equal(a[0].clip(0), a[1].clip(8))' eight.h5 twenty.h5
0 . sample -q --model m.h5 -n 8 -j 1 -o tmp/eight.h5 && cmp eight.h5 tmp/eight.h5
1 . sample -q -m m.h5 -n 8 --seed 2 -o tmp/other.h5 && cmp -s eight.h5 tmp/other.h5
0 true sample -q -m m.h5 -n 2 --frames 31 -o short.h5 && ./q 'a[0].length == [31, 31] and np.allclose(a[0].clip(1)[0], a[1].clip(1)[0][:31], atol=1e-6)' short.h5 eight.h5
0 true sample -q -m m.h5 -o one.h5 --frames 1 && ./q 'a[0].length == [1]' one.h5
0 . motion-info --check full one.h5

# attributes
0 true sample -q -m m.h5 -n 3 --frames 9 --attr action=walking --attr gender=male -o w.h5 && ./q 'set(a[0].attribute("action")) == {"walking"} and set(a[0].attribute("gender")) == {"male"}' w.h5
0 true sample -q -m m.h5 -n 4 --frames 9 --attr action=walking --attr action=jumping -o w2.h5 && ./q 'sorted(a[0].attribute("action")) == ["jumping"] * 2 + ["walking"] * 2 and sorted(a[0].attribute("gender")) == ["female"] * 2 + ["male"] * 2' w2.h5
2 ~not.trained.on.'dancing',.expected.jogging,.jumping,.lifting,.walking sample -m m.h5 --attr action=dancing -o x.h5
2 ~no.attribute.'mood',.expected.action,.gender sample -m m.h5 --attr mood=glad -o x.h5
2 ~NAME=VALUE sample -m m.h5 --attr walking -o x.h5
2 ~NAME=VALUE sample -m m.h5 --attr =walking -o x.h5
2 ~not.trained.on sample -m m.h5 --attr action= -o x.h5

# noise, streams, pipes
0 true sample -q -m m.h5 -n 2 --frames 60 --noise-scale 0 -o still.h5 && ./q 'not equal(a[0].clip(0), (a[1].clip(0)[0][:60],))' still.h5 eight.h5
0 . sample -q -m m.h5 -n 8 -o - | cmp - eight.h5
0 . sample -q -m - -n 8 -o stdin.h5 < m.h5 && motion-info eight.h5 | grep digest > d && motion-info stdin.h5 | grep digest | cmp - d
0 true ./q 'a[0].history[2]["inputs"] == [{"path": "<stdin>", "sha256": sha("m.h5")}]' stdin.h5
0 ~generated.*8.*80 sample -q -m m.h5 -n 8 --frames 10 -o - | motion-compare - --real c.h5
0 . sample -q -m m.h5 -n 2 --frames 20 -o - | render -q - -o strips.png && test -s strips.png
0 141 { TMPDIR=$PWD/tmp sample -q -m m.h5 -n 8 -o -; echo $? > died; } 2> noise | true; test ! -s noise && cat died
0 . test "$(ls tmp)" = "$(printf 'eight.h5\nother.h5')"
0 ~^20/20.motions sample -m m.h5 -n 20 --frames 3 --progress always -o prog.h5
0 true printf 'model = "m.h5"\ncount = 8\nquiet = true\n' > c.toml; sample --config c.toml --device cpu -o conf.h5 && cmp conf.h5 eight.h5 && cat true

# usage
2 ~--model.is.required sample -o x.h5
2 ~no.output.given sample -m m.h5
2 ~whole.number sample -m m.h5 -n 0 -o x.h5
2 ~whole.number sample -m m.h5 --frames 0 -o x.h5
2 ~whole.number sample -m m.h5 --frames 99999999999 -o x.h5
2 ~at.least.0 sample -m m.h5 --noise-scale -1 -o x.h5
2 ~at.least.0 sample -m m.h5 --noise-scale inf -o x.h5
2 ~cuda sample -m m.h5 --device cuda -o x.h5
2 ~unexpected|unknown|no.input sample -m m.h5 c.h5 -o x.h5
2 ~terminal script -qec 'sample -m m.h5 -o -' /dev/null

# bad models
3 ~^sample:.absent\.h5 sample -m absent.h5 -o x.h5
3 ~^sample:.bad\.h5 sample -m bad.h5 -o x.h5
3 ~^sample:.cut\.h5 sample -m cut.h5 -o x.h5
3 ~^sample:.flipped\.h5:.*checksum|^sample:.flipped\.h5:.*damaged sample -m flipped.h5 -o x.h5
3 ~^sample:.c\.h5:.*not.a.model sample -m c.h5 -o x.h5
3 ~^sample:.<stdin> sample -m - -o x.h5
3 ~not.finite sample -m m.h5 --noise-scale 1e300 -o x.h5
1 . test -e x.h5

# output
4 ~eight\.h5:.exists.already sample -m m.h5 -o eight.h5
4 ~exists.already sample -m absent.h5 -o eight.h5
0 . sample -q -m m.h5 -n 8 -f -o eight.h5 && cmp eight.h5 tmp/eight.h5
4 ~nowhere sample -m m.h5 -o nowhere/x.h5
4 ~full sample -m m.h5 -o /dev/full
4 ~folder sample -m m.h5 -o folder
4 ~write.failed sample -q -m m.h5 -o - > /dev/full
4 ~write.failed sample -q -m m.h5 -o - >&-
1 . test -n "$(find . -name '*.part-*')"

# combinations that were never trained on: left out, and refused when asked for
0 . canonicalize -q corpus/walking_f001_1.bvh corpus/jogging_m001_1.bvh --labels corpus/labels.tsv -o p.h5 && train-vrnn -q p.h5 --steps 2 --batch 2 --window 6 --pretrain-steps 0 -o p.model
0 true sample -q -m p.model -n 4 --frames 6 -o p4.h5 && ./q 'sorted({*zip(a[0].attribute("action"), a[0].attribute("gender"))}) == [("jogging", "male"), ("walking", "female")]' p4.h5
2 ~expected.one.of.action=jogging.gender=male;.action=walking.gender=female sample -m p.model --attr action=walking --attr gender=male -o x.h5

# attributes over time
0 true printf 'start\tend\taction\n0\t1\twalking\n1\t2.04\tjogging\n2.04\t3\twalking\n' > s.tsv; sample -q -m m.h5 -n 2 --schedule s.tsv -o sched.h5 && ./q 'list(a[0].f["segments/start"][()]) == [0, 30, 60] * 2 and list(a[0].f["segments/length"][()]) == [30] * 6 and a[0].length == [90, 90] and a[0].names == ["schedule-0", "schedule-1"] and a[0].attribute("gender") == ["female", "male"] and "action" not in a[0].f["clips/attributes"]' sched.h5
0 true ./q '[v.decode() for v in a[0].f["segments/attributes/action"][()]] == ["walking", "jogging", "walking"] * 2 and [v.decode() for v in a[0].f["segments/attributes/gender"][()]] == ["female"] * 3 + ["male"] * 3 and a[0].history[2]["inputs"][1] == {"path": "s.tsv", "sha256": sha("s.tsv")}' sched.h5
0 . motion-info --check full sched.h5
0 true sample -q -m m.h5 -n 1 --frames 90 --attr action=walking --attr gender=female -o plain.h5; ./q 'np.allclose(a[0].clip(0)[0][:30], a[1].clip(0)[0][:30], atol=1e-6) and np.abs(a[0].clip(0)[0][30:60] - a[1].clip(0)[0][30:60]).max() > 1e-4' sched.h5 plain.h5
0 . sample -q -m m.h5 -n 2 -j 1 --schedule - -o stdin2.h5 < s.tsv && motion-info sched.h5 | grep digest > d2 && motion-info stdin2.h5 | grep digest | cmp - d2
0 true printf 'clip\tstart\taction\tgender\na\t0\twalking\tmale\nb\t0\tlifting\t\na\t2\tjogging\t\n' > two.tsv; sample -q -m m.h5 --schedule two.tsv --frames 75 -o two.h5 && ./q 'a[0].names == ["a-0", "b-1"] and a[0].attribute("action") == ["", "lifting"] and a[0].attribute("gender") == ["male", "female"] and a[0].length == [75, 75]' two.h5
0 true sample -q -m m.h5 --schedule s.tsv --attr gender=male -n 2 -o male.h5 && ./q 'a[0].attribute("gender") == ["male"] * 2' male.h5
0 ~end.tsv:3:.2\.99.s.is.less.than.half.a.word printf 'start\taction\n0\twalking\n2.99\tjogging\n' > end.tsv; sample -m m.h5 --schedule end.tsv --frames 90 -o end.h5
2 ~the.schedule.sets.gender.from.the.start sample -m m.h5 --schedule two.tsv --attr gender=male -o x.h5
2 ~the.schedule.sets.action.from.the.start sample -m m.h5 --schedule s.tsv --attr action=jogging -o x.h5
2 ~--frames.and.a.schedule sample -m m.h5 --schedule s.tsv --frames 90 -o x.h5
2 ~expected.one.of.them.to.be.a.file sample -m - --schedule - -o x.h5 < m.h5
3 ~^sample:.gap\.tsv:3:.a.gap:.a.start.at.2.s printf 'start\tend\taction\n0\t1\twalking\n2\t3\tjogging\n' > gap.tsv; sample -m m.h5 --schedule gap.tsv -o x.h5
3 ~^sample:.late\.tsv:2:.a.gap printf 'start\taction\n1\twalking\n' > late.tsv; sample -m m.h5 --schedule late.tsv -o x.h5
3 ~^sample:.down\.tsv:4:.*after.the.2.s.of.line.3 printf 'start\taction\n0\twalking\n2\tjogging\n1\twalking\n' > down.tsv; sample -m m.h5 --schedule down.tsv -o x.h5
3 ~^sample:.val\.tsv:3:action:.*not.trained.on.'dancing',.expected.jogging,.jumping,.lifting,.walking printf 'start\taction\n0\twalking\n2\tdancing\n' > val.tsv; sample -m m.h5 --schedule val.tsv -o x.h5
3 ~^sample:.attr\.tsv:1:mood:.*no.attribute.'mood',.expected.action,.gender printf 'start\tmood\n0\tglad\n' > attr.tsv; sample -m m.h5 --schedule attr.tsv -o x.h5
3 ~^sample:.beyond\.tsv:3:start:.5.s,.expected.a.time.within.the.140.frames printf 'start\taction\n0\twalking\n5\tjogging\n' > beyond.tsv; sample -m m.h5 --schedule beyond.tsv -o x.h5
3 ~^sample:.fine\.tsv:3:start:.*same.word printf 'start\taction\n0\twalking\n0.02\tjogging\n' > fine.tsv; sample -m m.h5 --schedule fine.tsv -o x.h5
3 ~^sample:.absent\.tsv sample -m m.h5 --schedule absent.tsv -o x.h5
0 ~warning:.u\.tsv:3:.*action=jogging.gender=female.together printf 'start\taction\n0\twalking\n1\tjogging\n' > u.tsv; sample -m p.model --schedule u.tsv -n 3 --frames 60 -o u.h5
0 true ./q 'a[0].attribute("gender") == ["female"] * 3' u.h5
1 . test -e x.h5

# a generator that starts from frames (lstm-gmm)
0 . train-lstm -q c.h5 --steps 4 --batch 4 --window 8 --weights-only -o l.h5 && motion-select -q c.h5 --time 0:0 -o frame.h5 && canonicalize -q corpus --fps 60 -o fast.h5 && canonicalize -q corpus --body source -o rig.h5
0 true sample -q -m l.h5 -n 12 --frames 40 -j 2 -o l1.h5 && ./q 'a[0].names == ["motion-%02d" % i for i in range(12)] and set(a[0].length) == {40} and a[0].f.attrs["contacts"] in ("model", b"model") and a[0].f["frames/contacts"].shape == (480, 2)' l1.h5 && motion-info --check full l1.h5 > /dev/null
0 . sample -q -m l.h5 -n 12 --frames 40 -j 1 -o l2.h5 && motion-info l1.h5 | grep digest > d1 && motion-info l2.h5 | grep digest | cmp - d1
0 true sample -q -m l.h5 -n 12 --frames 30 --init c.h5 -o li.h5 && ./q 'all(np.abs(a[0].clip(i)[0][0, 1:] - a[1].clip(i % 8)[0][0, 1:]).max() < 1e-4 and abs(a[0].clip(i)[1][0, 2] - a[1].clip(i % 8)[1][0, 2]) < 1e-4 for i in range(12)) and [i["path"] for i in a[0].history[-1]["inputs"]] == ["l.h5", "c.h5"]' li.h5 c.h5
0 true sample -q -m l.h5 --frames 30 --init - -o lp.h5 < c.h5 && ./q 'equal(a[0].clip(0), a[1].clip(0))' lp.h5 li.h5
0 true sample -q -m l.h5 -n 2 --frames 30 --init "c.h5:$(/usr/bin/python3 -c 'import h5py; print(h5py.File("c.h5")["clips/name"][2].decode())')" -o lc.h5 && ./q 'all(np.abs(a[0].clip(i)[0][0, 1:] - a[1].clip(2)[0][0, 1:]).max() < 1e-4 for i in (0, 1)) and not equal(a[0].clip(0), a[0].clip(1))' lc.h5 c.h5
3 ~^sample:.c\.h5:clip.nobody:.no.clip.of.this.name sample -m l.h5 --init c.h5:nobody -o x.h5
0 true for o in "--init-state zero" "--network-noise 0.2" "--noise-scale 0" "--seed 5"; do sample -q -m l.h5 --frames 30 --init c.h5 $o -o lo.h5 -f && ./q '(lambda x, y: np.array_equal(x[0][0], y[0][0]) and not np.array_equal(x[0][5], y[0][5]))(a[0].clip(0), a[1].clip(0))' lo.h5 li.h5; done | sort -u
0 true sample -q -m l.h5 --frames 30 --init frame.h5 --init-state zero -o lz.h5 && ./q 'a[0].length == [30]' lz.h5
3 ~^sample:.frame\.h5.*1.frame,.expected.2 sample -m l.h5 --init frame.h5 -o x.h5
3 ~^sample:.fast\.h5.*60.Hz,.expected.the.model's.30.Hz sample -m l.h5 --init fast.h5 -o x.h5
3 ~^sample:.rig\.h5.*another.skeleton.than.the.model's sample -m l.h5 --init rig.h5 -o x.h5
3 ~^sample:.absent\.h5 sample -m l.h5 --init absent.h5 -o x.h5
2 ~expected.a.generator.that.starts.from.frames.*kind.motion-cell sample -m m.h5 --init c.h5 -o x.h5
2 ~expected.a.generator.that.starts.from.frames sample -m m.h5 --init-state zero -o x.h5
2 ~expected.a.generator.that.starts.from.frames sample -m m.h5 --network-noise 0.1 -o x.h5
2 ~-m.-.and.--init.- sample -m - --init - -o x.h5 < l.h5
2 ~knows.no.attribute.'action',.expected.none:.it.was.trained.without.attributes sample -m l.h5 --attr action=walking -o x.h5

# ended at rest: a model of three steps never rests, so the noise's slowest steps stand for it; what is left is the beginning of the same motion
0 true sample -q -m m.h5 -n 8 --stop-when-still -o never.h5 && ./q 'all(equal(a[0].clip(i), a[1].clip(i)) for i in range(8))' never.h5 eight.h5
0 ~[1-8].of.8.motions.came.to.rest sample -m m.h5 -n 8 --stop-when-still --still-speed 45 --still-seconds 0.03 -o stopped.h5
0 true ./q 'min(a[0].length) < 140 and min(a[0].length) >= 30 and all(equal(a[0].clip(i), [x[:n] for x in a[1].clip(i)]) for i, n in enumerate(a[0].length)) and set(a[0].f["clips/source_end"][()]) == {0}' stopped.h5 eight.h5
0 true sample -q -m m.h5 -n 2 --schedule s.tsv --stop-when-still --still-speed 1e-9 -o sw.h5 && ./q 'a[0].length == [90, 90] and list(a[0].f["segments/start"][()]) == [0, 30, 60] * 2' sw.h5
2 ~above.0 sample -m m.h5 --stop-when-still --still-speed 0 -o x.h5
2 ~above.0 sample -m m.h5 --stop-when-still --still-seconds nan -o x.h5

# a latent space (train-vae): along an axis, between two windows, there and back, longer than the window
0 . train-vae -q c.h5 --window 20 --filters 8 --hidden 16 --latent 4 --epochs 60 --batch 8 --weights-only -j 1 -o vae.h5
0 true sample -q -m vae.h5 -n 5 -o v.h5 && ./q 'a[0].length == [20] * 5 and a[0].names == ["motion-%d" % i for i in range(5)] and not equal(a[0].clip(0), a[0].clip(1)) and [e["tool"] for e in a[0].history] == ["canonicalize", "train-vae", "sample"]' v.h5
0 . motion-info --check full v.h5
0 true ./q 'all(np.allclose(p[0, :2], 0, atol=1e-6) and abs(2 * np.arctan2(q[0, 0, 3], q[0, 0, 0])) < 1e-5 and 0.5 < p[0, 2] < 1.2 for q, p in [a[0].clip(i) for i in range(5)])' v.h5
0 true sample -q -m vae.h5 -n 70 -j 2 -o v70.h5 && ./q 'all(equal(a[0].clip(i), a[1].clip(i)) for i in range(5))' v.h5 v70.h5
0 true sample -q -m vae.h5 -n 5 --prior normal -o normal.h5 && ./q 'not equal(a[0].clip(0), a[1].clip(0)) and a[0].length == [20] * 5' normal.h5 v.h5
2 ~--prior,.expected.a.generator.with.a.latent.space sample -m m.h5 --prior normal -o x.h5
2 ~mixture sample -m vae.h5 --prior uniform -o x.h5
0 ~^sample:.joints.of.the.body.are.within.[0-9.]+.mm.of.what.the.model.made sample -m vae.h5 -n 2 -o told.h5
0 true sample -q -m vae.h5 -n 3 --frames 75 -j 2 -o long.h5 && sample -q -m vae.h5 -n 3 --frames 75 -j 1 -f -o long1.h5 && cmp long.h5 long1.h5 && ./q 'a[0].length == [75] * 3 and np.allclose(a[0].clip(1)[1][:10], a[1].clip(1)[1][:10], atol=1e-6)' long.h5 v.h5
0 true sample -q -m vae.h5 --latent-axis 3 -o axis.h5 && ./q 'len(a[0].names) == 9 and a[0].names[0] == "motion-0-axis-3-at-0.1" and a[0].names[8] == "motion-0-axis-3-at-0.9"' axis.h5
0 true sample -q -m vae.h5 --latent-axis 3 -n 6 --quantiles 0.25:0.75:0.25 -o axis2.h5 && ./q 'a[0].names == ["motion-%d-axis-3-at-%g" % (i, x) for i in (0, 1) for x in (0.25, 0.5, 0.75)] and equal(a[0].clip(1), a[1].clip(4)) and not equal(a[0].clip(0), a[0].clip(1))' axis2.h5 axis.h5
0 true sample -q -m vae.h5 -n 3 --prior normal --noise-scale 0 -o mean.h5; sample -q -m vae.h5 --prior normal --latent-axis 2 --quantiles 0.5 --noise-scale 0 -o median.h5 && ./q 'equal(a[0].clip(0), a[1].clip(0)) and equal(a[0].clip(0), a[0].clip(2))' mean.h5 median.h5
0 true N=$(./q 'a[0].names[-1]' c.h5); sample -q -m vae.h5 --interpolate c.h5 c.h5:$N -n 5 -o between.h5 && sample -q -m vae.h5 --reconstruct c.h5 -o again.h5 && ./q 'len(a[0].names) == 5 and not equal(a[0].clip(1), a[0].clip(0)) and np.allclose(a[0].clip(0)[1][:10, 2] - a[0].clip(0)[1][0, 2], a[1].clip(0)[1][:10, 2] - a[1].clip(0)[1][0, 2], atol=1e-4) and a[1].names == a[2].names and a[1].length == a[2].length and a[1].attribute("action") == a[2].attribute("action")' between.h5 again.h5 c.h5
0 . motion-info --check full again.h5
0 true sample -q -m vae.h5 --reconstruct c.h5 --through positions -o pos.h5; sample -q -m vae.h5 --reconstruct c.h5 --through autoencoder -o cae.h5; ./q '[round(float(np.abs(x.f["frames/root_position"][()] - a[3].f["frames/root_position"][()]).max()), 4) == 0 for x in a[:3]] == [True, False, False] and not equal(a[1].clip(0), a[2].clip(0))' pos.h5 cae.h5 again.h5 c.h5
0 ~joints.are.within.[0-9.]+.mm.of.the.originals'.in.the.world,.[0-9.]+.mm.seen.from.the.root sample -m vae.h5 --reconstruct c.h5 -o told2.h5
2 ~--through sample -m vae.h5 --through positions -o x.h5
0 true sample -q -m vae.h5 --interpolate c.h5 c.h5 -o same.h5 && ./q 'len(a[0].names) == 9 and all(equal(a[0].clip(0), a[0].clip(i)) for i in range(9))' same.h5
0 . sample -q -m vae.h5 -n 4 --frames 40 -o - | refine -q --pin-feet - -o - | render -q - -o vstrips.png && motion-export -q v.h5 --format bvh -o vbvh && bvh2npz -q vbvh/motion-0.bvh -o v.npz
2 ~expected.a.generator.with.a.latent.space sample -m m.h5 --latent-axis 1 -o x.h5
2 ~expected.a.generator.with.a.latent.space sample -m m.h5 --reconstruct c.h5 -o x.h5
2 ~expected.a.generator.with.a.latent.space sample -m m.h5 --interpolate c.h5 c.h5 -o x.h5
2 ~expected.one.of.the.model's.4.axes sample -m vae.h5 --latent-axis 5 -o x.h5
2 ~FIRST:LAST:STEP sample -m vae.h5 --latent-axis 1 --quantiles 0:0.9:0.1 -o x.h5
2 ~FIRST:LAST:STEP sample -m vae.h5 --latent-axis 1 --quantiles 0.1:1:0.1 -o x.h5
2 ~FIRST:LAST:STEP sample -m vae.h5 --latent-axis 1 --quantiles 0.1:0.9 -o x.h5
2 ~FIRST:LAST:STEP sample -m vae.h5 --latent-axis 1 --quantiles 0.9:0.1:0.1 -o x.h5
2 ~FIRST:LAST:STEP sample -m vae.h5 --latent-axis 1 --quantiles a -o x.h5
2 ~at.most.10000 sample -m vae.h5 --latent-axis 1 --quantiles 0.1:0.9:0.00001 -o x.h5
2 ~latent-axis sample -m vae.h5 --quantiles 0.5 -o x.h5
2 ~interpolate sample -m vae.h5 --latent-axis 1 --interpolate c.h5 c.h5 -o x.h5
2 ~at.least.2.motions sample -m vae.h5 --interpolate c.h5 c.h5 -n 1 -o x.h5
2 ~--interpolate.-.and.--interpolate.- sample -m vae.h5 --interpolate - - -o x.h5
2 ~no.attribute sample -m vae.h5 --attr action=walking -o x.h5
2 ~starts.from.frames sample -m vae.h5 --init c.h5 -o x.h5
3 ~no.clip.of.this.name sample -m vae.h5 --interpolate c.h5:nobody c.h5 -o x.h5
3 ~nowhere sample -m vae.h5 --interpolate nowhere.h5 c.h5 -o x.h5
3 ~expected.the.20.of.the.model's.window motion-select -q c.h5 --time 0:0.5 -o half.h5; sample -m vae.h5 --interpolate half.h5 c.h5 -o x.h5
3 ~none.as.long.as.the.model's.window.of.20.frames sample -m vae.h5 --reconstruct half.h5 -o x.h5
3 ~60.Hz,.expected.the.model's.30.Hz canonicalize -q corpus --fps 60 -o fast.h5; sample -m vae.h5 --reconstruct fast.h5 -o x.h5
1 . test -e x.h5
2 ~frames.excludes.--reconstruct sample -m vae.h5 --reconstruct c.h5 --frames 30 -o x.h5
2 ~still.excludes.--reconstruct sample -m vae.h5 --reconstruct c.h5 --stop-when-still -o x.h5
