# STATUS EXPECTED COMMAND (see run.sh). What every tool shares is tried in bvh2npz.tst. Formulas: tests/metrics. Sources of the corpora differ by seed.
# setup: for k in "t 5 1" "r 9 2" "g 5 3"; do set -- $k; make-corpus -q --subjects $2 --seconds 2 --transitions 0 --seed $3 -o $1; canonicalize -q $1 --labels $1/labels.tsv -o $1.h5; done
# setup: canonicalize -q g --labels g/labels.tsv --fps 60 -o fast.h5; canonicalize -q g --labels g/labels.tsv --body source -o rig.h5; canonicalize -q g -o plain.h5; sed 's/walking\t/dancing\t/' g/labels.tsv > dance.tsv; canonicalize -q g --labels dance.tsv -o dancing.h5
# setup: motion-select -q g.h5 --attr action=walking -o walks.h5; motion-select -q r.h5 --attr action=walking -o real-walks.h5
# setup: train-classifier -q t.h5 --attribute action --epochs 3 -o a.h5; train-classifier -q t.h5 --attribute gender --epochs 2 -o s.h5; head -c 9000 g.h5 > cut.h5
# setup: cat > make.py <<'END'
# setup: import sys, hashlib, json, h5py, numpy as np
# setup: def change(out, body, source="g.h5"):
# setup:     open(out, "wb").write(open(source, "rb").read())
# setup:     with h5py.File(out, "r+") as f: body(f)
# setup: def freeze(f):
# setup:     n = f["clips/length"][0]; q = f["frames/rotations"][()]; q[n // 3:n] = q[n // 3]; f["frames/rotations"][()] = q
# setup: change("frozen.h5", freeze)
# setup: def shake(f):
# setup:     n = f["clips/length"][0]; q = f["frames/rotations"][()]; r = np.random.RandomState(1).randn(n, *q.shape[1:]); q[:n] = r / np.linalg.norm(r, axis=-1, keepdims=True); f["frames/rotations"][()] = q
# setup: change("wild.h5", shake)
# setup: def own(f, path="a.h5"):
# setup:     e = json.dumps({"tool": "train-vrnn", "version": "0.1.0", "commit": "0", "argv": ["train-vrnn"], "seed": 1, "inputs": [{"path": path, "sha256": hashlib.sha256(open(path, "rb").read()).hexdigest()}]})
# setup:     b = bytes(f["history"][()]) + (e + "\n").encode(); del f["history"]; f.create_dataset("history", data=np.frombuffer(b, np.uint8), chunks=True, fletcher32=True)
# setup: change("pleases.h5", own); change("leaks.h5", lambda f: own(f, "r.h5"))
# setup: r = np.random.RandomState(3); x, y = r.randn(200, 6), r.randn(180, 6) + 0.2
# setup: p = np.exp(2 * r.randn(200, 4)); p /= p.sum(1, keepdims=True); l = r.randint(0, 4, 200)
# setup: np.savez("x.npz", features=x, posteriors=p, labels=l, classes=list("abcd")); np.savez("y.npz", features=y, labels=r.randint(0, 4, 180), classes=list("abcd")); np.savez("xf.npz", features=x); np.savez("yf.npz", features=y); np.savez("big.npz", features=100 * x); np.savez("big-real.npz", features=100 * y)
# setup: np.savez("names.npz", features=x, labels=np.array(list("abcd"))[l]); np.savez("stats.npz", mu=y.mean(0), sigma=np.cov(y, rowvar=False)); np.savez("t.npz", features=r.randn(150, 6))
# setup: n = x.copy(); n[4, 2] = np.nan; np.savez("nan.npz", features=n); np.savez("small.npz", features=x[:6]); np.savez("ten.npz", features=y[:10]); np.savez("wide.npz", features=r.randn(50, 9)); np.savez("none.npz", mu=x); np.savez("flat.npz", features=x[0])
# setup: np.savez("one.npz", features=x, posteriors=np.ones((200, 1))); np.savez("gap.npz", features=x, labels=np.where(l == 2, 1, l), classes=list("abcd")); np.savez("long.npz", features=x, labels=l[:3]); np.savez("off.npz", features=x, posteriors=p[:9])
# setup: np.savez("high.npz", features=x, labels=l + 1, classes=list("abcd")); np.savez("other.npz", features=x, labels=np.where(l == 1, "zebra", "a"), classes=list("abcd")); np.savez("half.npz", features=x, posteriors=p / 2); np.savez("texts.npz", features=np.array([["a", "b"]])); np.savez("fraction.npz", features=x, labels=l + 0.5)
# setup: open("x.tsv", "w").write("clip\tf0\tf1\tf2\tf3\tf4\tf5\n" + "".join("c%d\t" % i + "\t".join("%.17g" % v for v in row) + "\n" for i, row in enumerate(x)))
# setup: open("bad.tsv", "w").write("clip\tf0\tf1\nc0\t1\t2\nc1\t1\tnan\n"); open("none.tsv", "w").write("clip\taction\nc0\twalking\n")
# setup: from scipy import linalg
# setup: c1, c2 = np.cov(x, rowvar=False), np.cov(y, rowvar=False); d = x.mean(0) - y.mean(0)
# setup: open("fid", "w").write("%.5f\n" % (d @ d + np.trace(c1) + np.trace(c2) - 2 * np.trace(linalg.sqrtm(c1 @ c2)).real))
# setup: END
# setup: /usr/bin/python3 make.py
# setup: cat > q.py <<'END'
# setup: import sys, json
# setup: r = json.load(sys.stdin); v = lambda n: r[n + ".value"]; lo = lambda n: r[n + ".low"]; hi = lambda n: r[n + ".high"]; n = lambda k: r[k + ".n"]
# setup: print(eval(sys.argv[1]))
# setup: END
# setup: printf '#!/bin/sh\nexec /usr/bin/python3 q.py "$@"\n' > q; chmod +x q; echo True > true

0 ~^Usage:.fid-eval.*INPUT fid-eval --help
0 ~^LibTorch.[12]\. fid-eval --version

# features made elsewhere: SciPy's distance, by every formula
0 fid fid-eval x.npz --features --real y.npz --json | ./q '"%.5f" % v("fid")'
0 fid fid-eval xf.npz --features --real yf.npz --compat pytorch-fid --json | ./q '"%.5f" % v("fid")'
0 fid fid-eval xf.npz --features --real yf.npz --compat clean-fid --json | ./q '"%.5f" % v("fid")'
0 fid fid-eval xf.npz --features --real yf.npz --compat torch-fidelity --json | ./q '"%.5f" % v("fid")'
0 fid fid-eval xf.npz --features --real yf.npz --compat a2m --json | ./q '"%.5f" % v("fid")'
0 fid fid-eval xf.npz --features --real yf.npz --compat actor --json | ./q '"%.5f" % v("fid")'
0 true fid-eval x.npz --features --real y.npz --json | ./q 'lo("fid") < v("fid") < hi("fid") and n("fid") == 200 and 0 < v("fid.floor_halves") and n("fid.floor_halves") == 90 and v("is.bound") == 4 and 1 < v("is") < 4 and 0 < v("accuracy.class") < 0.5 and v("diversity.real") > 0 and v("multimodality") > 0 and r["compat"] == "none"'
0 true fid-eval xf.npz --features --real yf.npz --json | ./q '"is.value" not in r and "multimodality.value" not in r and lo("kid") < v("kid") < hi("kid") and lo("diversity") < v("diversity") < hi("diversity") and 0 < v("precision") <= 1 and 0 < v("recall") <= 1'
0 true fid-eval y.npz --features --real y.npz --json | ./q 'v("fid") < 1e-9 and v("precision") == 1 and v("recall") == 1'
0 fid fid-eval x.tsv --features --real yf.npz --json | ./q '"%.5f" % v("fid")'
3 ~bad\.tsv:3:.'nan'.in.column.3,.expected.a.number fid-eval bad.tsv --features --real yf.npz
3 ~none\.tsv:1:.neither.an.npz fid-eval none.tsv --features --real yf.npz
0 true fid-eval names.npz --features --real y.npz --json | ./q 'v("within_class_variance") > 0'
0 true fid-eval x.npz --features --real y.npz --train t.npz --json | ./q 'v("fid.floor_train") > 0 and n("fid.floor_train") == 150 and lo("fid.train") < v("fid.train") < hi("fid.train")'
0 true fid-eval x.npz --features --real t.npz --json | ./q 'v("fid")' > a.txt; fid-eval x.npz --features --real y.npz --train t.npz --json | ./q 'v("fid.train")' | cmp - a.txt && echo True
0 . fid-eval - --features --real y.npz < x.npz > p && fid-eval x.npz --features --real y.npz -j 1 | cmp - p && fid-eval x.npz --features --real - -j 2 < y.npz | cmp - p
0 true fid-eval x.npz --features --real y.npz --pca 3 --train t.npz --json | ./q 'v("fid") > 0'
0 ~3.principal.axes.keep fid-eval x.npz --features --real y.npz --pca 3 --train t.npz

# KID of standardised features has no units; the published one cubes them, and has no interval of its own
0 true fid-eval big.npz --features --real big-real.npz --json > k; fid-eval xf.npz --features --real yf.npz --json | ./q 'abs(v("kid") - json.load(open("k"))["kid.value"]) < 1e-9'
0 true fid-eval big.npz --features --real big-real.npz --compat torch-fidelity --json | ./q 'abs(v("kid")) > 1e4 and lo("kid") is None and lo("diversity") is None'
0 true fid-eval x.npz --features --real y.npz --json | ./q 'all(lo(k) < v(k) < hi(k) for k in ["multimodality", "within_class_variance", "multimodality.real", "within_class_variance.real", "diversity.real"])'

# repeats, resamples, splits, seed
0 true fid-eval x.npz --features --real y.npz --repeats 4 --json | ./q 'n("fid") == 4 and lo("fid") < v("fid") < hi("fid") and lo("kid") < v("kid") < hi("kid")'
0 true fid-eval x.npz --features --real y.npz --resamples 0 --json | ./q 'lo("fid") is None and lo("is") is None and lo("accuracy.class") is not None'
0 . fid-eval x.npz --features --real y.npz --splits 10 --json > s10; fid-eval x.npz --features --real y.npz --json > s1; ! cmp -s s1 s10
0 . fid-eval x.npz --features --real y.npz --seed 2 --json > seed2; fid-eval x.npz --features --real y.npz --json | cmp - s1 && ! cmp -s s1 seed2
0 . printf 'real = "y.npz"\nfeatures = true\n' > c.toml; fid-eval x.npz --config c.toml --json | cmp - s1

# statistics: written once, read back by us and by NumPy, and as --real
0 . fid-eval x.npz --features --real y.npz --stats-cache cache.npz > /dev/null && /usr/bin/python3 -c 'import numpy as np; a, b = np.load("cache.npz"), np.load("stats.npz"); assert sorted(a) == ["mu", "sigma"] and np.allclose(a["mu"], b["mu"], atol=1e-12) and np.allclose(a["sigma"], b["sigma"], atol=1e-12)'
0 . fid-eval x.npz --features --real y.npz --stats-cache cache.npz
3 ~cache\.npz:.statistics.of.other.clips fid-eval y.npz --features --real x.npz --stats-cache cache.npz
4 ~nowhere fid-eval x.npz --features --real y.npz --stats-cache nowhere/c.npz
0 fid fid-eval x.npz --features --real cache.npz --json | ./q '"%.5f" % v("fid")'
2 ~expected.features fid-eval x.npz --features --real stats.npz --stats-cache new.npz

# forms of the report
0 ~^figure.*value.*low.*high.*n$ fid-eval x.npz --features --real y.npz
0 . fid-eval x.npz --features --real y.npz --format tsv > r.tsv; /usr/bin/python3 -c 'r = [l.rstrip("\n").split("\t") for l in open("r.tsv")]; assert r[0] == ["figure", "value", "low", "high", "n"] and all(len(x) == 5 for x in r) and r[1][0] == "fid"'
0 ~^fid.floor..halves.*&.*-.&.-.&.90 fid-eval x.npz --features --real y.npz --format latex
0 . fid-eval x.npz --features --real y.npz --format json | cmp - s1
0 ~^fid.floor_halves fid-eval x.npz --features --real y.npz --format text

# motion: classifiers, floors, cut lengths, feet, energy, memorising
0 . fid-eval g.h5 --real r.h5 --train t.h5 --classifier a.h5 --classifier s.h5 --pca 8 --json > m.json
0 true ./q 'v("is.bound") == 8 and v("is.action.bound") == 4 and v("is.gender.bound") == 2 and n("fid") == 40 and n("fid.floor_train") == 40 and v("fid.floor_halves") > 0 and v("nearest_training") > 0 and v("skate_mps") > 0 and v("contact_speed_mps") > 0 and 0.01 < v("contact_height_m.real") < 0.06 and v("energy") > 0 and r["frozen"] == [] == r["exploding"]' < m.json
0 true fid-eval g.h5 --real r.h5 --classifier a.h5 --json | ./q '"nearest_training.value" not in r and v("accuracy.action") > 0.2 and v("fid") > 0 and lo("skate_mps") < v("skate_mps") < hi("skate_mps") and v("fid.floor_halves") > 0'
0 true fid-eval g.h5 --real r.h5 --classifier a.h5 --classifier s.h5 --pca 8 --train t.h5 --repeats 2 --json | ./q 'n("fid") == 2 and n("skate_mps") == 2'
0 true fid-eval g.h5 --real r.h5 --json | ./q '"fid.value" not in r and v("jerk") > 0 and v("penetration_m") >= 0 and v("frozen_share") == 0 and hi("frozen_share") > 0'
0 true fid-eval t.h5 --real r.h5 --train t.h5 --json | ./q 'v("nearest_training") < 1e-4 < v("nearest_training.real")'
0 true fid-eval t.h5 --real r.h5 --train t.h5 --window 20 --json | ./q 'v("nearest_training") < 1e-4 and n("nearest_training") == 40'
0 true fid-eval t.h5 --real r.h5 --train t.h5 --window 900 --json | ./q 'v("nearest_training") is None'
0 true fid-eval frozen.h5 --real r.h5 --classifier a.h5 --json | ./q 'len(r["frozen"]) == 1 and v("frozen_share") == 1 / 40'
0 ~^frozen:.[a-z] fid-eval frozen.h5 --real r.h5
0 ~^exploding:.[a-z] fid-eval wild.h5 --real r.h5
0 . fid-eval g.h5 --real r.h5 --frames 30 --json > f30 && fid-eval g.h5 --real r.h5 --json > f0 && ! cmp -s f30 f0
0 . cat g.h5 | fid-eval - --real r.h5 --classifier a.h5 -j 2 > j2 && fid-eval g.h5 --real r.h5 --classifier a.h5 -j 1 | cmp - j2
0 true fid-eval plain.h5 --real r.h5 --classifier a.h5 --json | ./q '"multimodality.value" not in r and v("fid") > 0'
0 ~leaks\.h5.was.made.with.r\.h5.\(train-vrnn\) fid-eval leaks.h5 --real r.h5

# what would give a figure that lies
3 ~60.Hz,.expected.30.Hz fid-eval fast.h5 --real r.h5 --classifier a.h5
3 ~another.skeleton fid-eval rig.h5 --real r.h5 --classifier a.h5
3 ~t\.h5:clip.*made.of.*of.which.there.are.clips.in.t\.h5 fid-eval g.h5 --real t.h5 --train t.h5
3 ~a\.h5:.this.classifier.was.trained.on fid-eval g.h5 --real t.h5 --classifier a.h5
3 ~a\.h5:.this.classifier.took.part.in.training.the.generator fid-eval pleases.h5 --real r.h5 --classifier a.h5
0 . fid-eval pleases.h5 --real r.h5 --classifier s.h5
3 ~a\.h5:.a.second.classifier.of.action fid-eval g.h5 --real r.h5 --classifier a.h5 --classifier a.h5
3 ~dancing.*expected.one.of.the.classifier fid-eval dancing.h5 --real r.h5 --classifier a.h5
3 ~class.jogging.has.0.clips fid-eval walks.h5 --real r.h5 --classifier a.h5
3 ~more.clips.than.features fid-eval walks.h5 --real real-walks.h5 --classifier a.h5
3 ~hint:.*--pca fid-eval small.npz --features --real yf.npz
3 ~6.clips.with.6.features fid-eval small.npz --features --real yf.npz
3 ~nan\.npz.*row.5,.column.3 fid-eval nan.npz --features --real yf.npz
3 ~nan\.npz.*row.5,.column.3 fid-eval xf.npz --features --real nan.npz
3 ~features.of.6.and.of.9 fid-eval xf.npz --features --real wide.npz
3 ~over.1.classes,.expected.at.least.two fid-eval one.npz --features --real yf.npz
3 ~class.c.has.0.clips fid-eval gap.npz --features --real y.npz
3 ~posteriors:.row.1.sums.to.0.5 fid-eval half.npz --features --real yf.npz
0 ~no.floor.of.halves fid-eval xf.npz --features --real ten.npz
0 ~no.floor.of.training.clips fid-eval xf.npz --features --real yf.npz --train small.npz
0 true fid-eval xf.npz --features --real ten.npz --json 2> /dev/null | ./q 'v("fid.floor_halves") is None and v("fid") > 0'

# files
3 ~none\.npz:.no.array.'features' fid-eval none.npz --features --real yf.npz
3 ~flat\.npz:features:.an.array.of.1.dimensions fid-eval flat.npz --features --real yf.npz
3 ~texts\.npz:features:.an.array.of.texts fid-eval texts.npz --features --real yf.npz
3 ~long\.npz:labels:.3.labels,.expected.200 fid-eval long.npz --features --real yf.npz
3 ~fraction\.npz:labels:.fractions fid-eval fraction.npz --features --real yf.npz
3 ~off\.npz:posteriors:.9.rows,.expected.200 fid-eval off.npz --features --real yf.npz
3 ~high\.npz:labels:.class.4 fid-eval high.npz --features --real yf.npz
3 ~other\.npz:labels:.class.'zebra' fid-eval other.npz --features --real yf.npz
3 ~stats\.npz:.statistics fid-eval stats.npz --features --real yf.npz
3 ~absent fid-eval absent.npz --features --real yf.npz
3 ~cut\.h5 fid-eval cut.h5 --real r.h5
3 ~absent\.h5 fid-eval g.h5 --real absent.h5
3 ~r\.h5 fid-eval g.h5 --real r.h5 --classifier r.h5
4 ~write.failed fid-eval x.npz --features --real y.npz > /dev/full

# the mix of classes, figures of one value, where the scale ends
0 . { motion-select -q g.h5 --attr action=walking -o w.h5; motion-select -q g.h5 --attr action=jogging --attr action=jumping --attr action=lifting --attr gender=female -o o.h5; motion-merge -q w.h5 o.h5 -f -o mixed.h5; } > /dev/null
0 ~classes.are.not.as.frequent.*--match-classes fid-eval mixed.h5 --real r.h5 --classifier a.h5 --pca 4 --train t.h5
0 true fid-eval mixed.h5 --real r.h5 --classifier a.h5 --pca 4 --train t.h5 --match-classes --mean-pose --by action --json | ./q 'n("fid") == 20 and v("fid.mean_pose") > v("fid.floor_train") and n("energy.walking") == 5 and 0.5 < v("energy.walking") / v("energy.walking.real") < 2 and v("energy.jogging") > v("energy.walking") and v("within_class_variance.lifting.real") > 0 and "frozen_share.jumping.value" in r'
0 true fid-eval x.npz --features --real y.npz --match-classes --json | ./q '100 < n("fid") < 200'
3 ~plain\.h5:.clips.without.a.label fid-eval plain.h5 --real r.h5 --classifier a.h5 --pca 4 --train t.h5 --match-classes
3 ~walks\.h5:.no.clips.of fid-eval walks.h5 --real r.h5 --classifier a.h5 --pca 4 --train t.h5 --match-classes
2 ~--match-classes.with.statistics fid-eval x.npz --features --real stats.npz --match-classes
2 ~--mean-pose.without.--train fid-eval g.h5 --real r.h5 --classifier a.h5 --mean-pose
2 ~--mean-pose.without.--classifier fid-eval g.h5 --real r.h5 --train t.h5 --mean-pose
2 ~--mean-pose.without.--classifier fid-eval x.npz --features --real y.npz --train t.npz --mean-pose
2 ~figures.by.gender fid-eval g.h5 --real r.h5 --classifier a.h5 --pca 4 --train t.h5 --by gender
0 . fid-eval g.h5 --real r.h5 --frames 20 --json > behind.json; fid-eval g.h5 --real r.h5 --frames 20 --cut-anywhere --json > any.json; fid-eval g.h5 --real r.h5 --frames 20 --cut-anywhere --seed 2 --json > other.json
0 true ./q 'v("energy") == json.load(open("any.json"))["energy.value"] and len({json.load(open(f + ".json"))["energy.real.value"] for f in ("behind", "any", "other")}) == 3 and json.load(open("any.json"))["energy.real.value"] > 1.1 * v("energy.real")' < behind.json

# usage
2 ~--real.is.required fid-eval g.h5
2 ~no.input fid-eval --real r.h5
2 ~--features.and.--classifier fid-eval x.npz --features --real y.npz --classifier a.h5
2 ~--pca.without.--train fid-eval x.npz --features --real y.npz --pca 3
2 ~standard.input.given.twice fid-eval - --features --real -
2 ~compat fid-eval x.npz --features --real y.npz --compat fid
2 ~format fid-eval x.npz --features --real y.npz --format html
2 ~whole.number fid-eval x.npz --features --real y.npz --repeats 0
3 ~200.clips.for.150.repeats fid-eval x.npz --features --real y.npz --repeats 150
2 ~cuda fid-eval g.h5 --real r.h5 --classifier a.h5 --device cuda
