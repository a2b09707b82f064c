# STATUS EXPECTED COMMAND (see run.sh). What every tool shares is tried in bvh2npz.tst; stopping and resuming in train-vrnn.tst; what is learnt in tests/classifier.
# setup: make-corpus -q --subjects 2 --seconds 2 --transitions 0 -o corpus; canonicalize -q corpus --labels corpus/labels.tsv -o c.h5; canonicalize -q corpus -o unlabelled.h5
# setup: canonicalize -q corpus --labels corpus/labels.tsv --fps 60 -o fast.h5; make-corpus -q --subjects 1 --seconds 2 --transitions 0 --seed 2 -o val; canonicalize -q val --labels val/labels.tsv -o val.h5
# setup: (head -1 corpus/labels.tsv; grep walking corpus/labels.tsv) > few.tsv; canonicalize -q corpus --labels few.tsv -o few.h5; (head -1 corpus/labels.tsv; grep 'walking\|jogging' corpus/labels.tsv) > two.tsv; canonicalize -q corpus --labels two.tsv -o two.h5
# setup: head -c 9000 c.h5 > cut.h5; echo nope > bad.h5; mkdir folder
# setup: printf 'file\taction\n' > dance.tsv; (cd val; for f in *.bvh; do printf '%s\tdancing\n' $f; done) >> dance.tsv; canonicalize -q val --labels dance.tsv -o dancing.h5
# setup: motion-select -q c.h5 --name 'walking_f*1_1' --name 'jogging_f*1_1' -o pair.h5; canonicalize -q val --labels val/labels.tsv --body source -o rig.h5
# setup: printf '#!/bin/sh\nexec train-classifier -q --attribute action --batch 4 "$@"\n' > t; chmod +x t
# setup: cat > q.py <<'END'
# setup: import sys, json, h5py, numpy as np
# setup: class Model:
# setup:     def __init__(self, path): self.f = h5py.File(path)
# setup:     def json(self, name): return json.loads(bytes(self.f[name][()]))
# setup:     def weights(self): return {n: d[()] for n, d in self.f["weights"].items()}
# setup:     def sources(self): return {x for x in self.f["data/train_sources"][()].astype(str).ravel()}
# setup:     def history(self): return [json.loads(l) for l in bytes(self.f["history"][()]).decode().splitlines()]
# setup: def same(a, b): return a.keys() == b.keys() and all(np.array_equal(a[k], b[k]) for k in a)
# setup: print(eval(sys.argv[1], {**globals(), "m": [Model(p) for p in sys.argv[2:]]}))
# setup: END
# setup: printf '#!/bin/sh\nexec /usr/bin/python3 q.py "$@"\n' > q; chmod +x q; echo True > true; printf 'a.h5\na.h5.log.tsv\n' > files

0 ~^Usage:.train-classifier.*INPUT.-o.FILE train-classifier --help
0 ~^LibTorch.[12]\. train-classifier --version

# the same bytes for any thread count, and from a pipe
0 files ./t c.h5 --epochs 2 -j 2 -o a.h5 && ls -d a.h5*
0 . ./t c.h5 --epochs 2 -j 1 -o b.h5 && cmp a.h5 b.h5 && cmp a.h5.log.tsv b.h5.log.tsv
0 true ./t - --epochs 2 -o piped.h5 < c.h5 && ./q 'same(m[0].weights(), m[1].weights())' a.h5 piped.h5
1 . ./t c.h5 --epochs 2 --seed 2 -o seed.h5 && cmp -s a.h5 seed.h5
0 ~^step.epoch.learning_rate.gradient_norm.loss.cross_entropy.accuracy.validation_loss$ cat a.h5.log.tsv
0 true ./q 'm[0].f.attrs["kind"] in ("classifier", b"classifier") and m[0].json("config")["attribute"] == "action" and list(m[0].f["vocabulary"]) == ["action"] and m[0].f["normalization/mean"].shape == (180,)' a.h5
0 true ./q '[e["tool"] for e in m[0].history()] == ["canonicalize", "train-classifier"] and "training" in m[0].f' a.h5
0 ~classifier motion-info a.h5
0 . motion-info --check full a.h5

# options
0 true ./t c.h5 --epochs 2 --val val.h5 --json -o v.h5 > v.json && ./q 'same(m[0].weights(), m[1].weights()) and json.load(open("v.json"))["clips"] == 8 and len(json.load(open("v.json"))["confusion"]) == 4' a.h5 v.h5
0 ~^accuracy.[01]\.[0-9]+,.mean.over.classes.*8.clips ./t c.h5 --epochs 2 --val val.h5 -o v2.h5
2 ~is.a.file.that.the.training.reads ./t c.h5 --epochs 2 --val val.h5 -f -o val.h5
0 true ./t c.h5 --epochs 1 --half A -o half-a.h5 && ./t c.h5 --epochs 1 --half B -o half-b.h5 && ./q 'not m[0].sources() & m[1].sources() and m[0].sources() | m[1].sources() == m[2].sources() and len(m[0].sources()) == 8' half-a.h5 half-b.h5 a.h5
0 true ./t c.h5 --epochs 1 --half A --half-seed 9 -o half-9.h5 && ./q 'm[0].sources() != m[1].sources()' half-a.h5 half-9.h5
0 true train-classifier -q c.h5 --attribute gender --epochs 1 --batch 5 --window 20 --noise 0.1 --learning-rate 0.002 --shards 3 --device cpu --weights-only --checkpoint-minutes 1 --checkpoint-epochs 1 --val-epochs 1 -o g.h5 && ./q '[(t["batch"], t["window"], t["noise"], t["learning_rate"]["rate"], t["shards"]) for t in [m[0].json("config")["training"]]] == [(5, 20, 0.1, 0.002, 3)] and m[0].json("config")["crops"] == {"longest": 20, "shortest": 8} and list(m[0].f["vocabulary"]) == ["gender"] and "training" not in m[0].f' g.h5
0 ~classes.of.action train-classifier c.h5 --attribute action --epochs 1 -o said.h5
0 ~8.clips.are.left.out train-classifier two.h5 --attribute action --epochs 1 -o two-model.h5
0 . ./t c.h5 --epochs 2 --resume -o a.h5 && cmp a.h5 b.h5
2 ~was.trained.with.training/seed ./t c.h5 --epochs 2 --resume --seed 5 -o a.h5
4 ~a\.h5:.exists.already ./t c.h5 --epochs 2 -o a.h5
0 . ./t c.h5 --epochs 2 -f -o a.h5 && cmp a.h5 b.h5

# usage
2 ~--attribute.is.required train-classifier c.h5 -o x.h5
2 ~no.output.given ./t c.h5
2 ~'-' ./t c.h5 -o -
2 ~expected.one.of ./t c.h5 --half C -o x.h5
2 ~whole.number ./t c.h5 --epochs 0 -o x.h5
2 ~shards ./t c.h5 --shards 5 -o x.h5
2 ~frames.in.all train-classifier -q --attribute action c.h5 --batch 65536 --window 100000 -o x.h5
2 ~above.0 ./t c.h5 --learning-rate nan -o x.h5
2 ~--val.-: ./t c.h5 --val - -o x.h5
2 ~is.the.archive.to.train.on cp c.h5 own.h5; ./t own.h5 -f -o own.h5

# bad input
3 ~^train-classifier:.absent\.h5 ./t absent.h5 -o x.h5
3 ~^train-classifier:.bad\.h5 ./t bad.h5 -o x.h5
3 ~^train-classifier:.cut\.h5 ./t cut.h5 -o x.h5
3 ~^train-classifier:.a\.h5 ./t a.h5 -o x.h5
3 ~no.clip.has.an.attribute.'action' ./t unlabelled.h5 -o x.h5
3 ~no.clip.has.an.attribute.'mood'.*there.are.action,.gender train-classifier -q c.h5 --attribute mood -o x.h5
3 ~all.labelled.clips.have.action=walking ./t few.h5 -o x.h5
3 ~is.in.half.[AB],.expected.more.sources ./t pair.h5 --half A -o x.h5
3 ~60.Hz,.expected.30.Hz ./t c.h5 --val fast.h5 -o x.h5
3 ~another.skeleton ./t c.h5 --val rig.h5 -o x.h5
3 ~dancing ./t c.h5 --val dancing.h5 -o x.h5
3 ~diverged.at.step ./t c.h5 --epochs 20 --learning-rate 1e30 -o div.h5
1 . test -e x.h5 -o -e div.h5

# output
4 ~nowhere ./t c.h5 --epochs 1 -o nowhere/x.h5
4 ~folder ./t c.h5 --epochs 1 -o folder
1 . test -n "$(find . -name '*.part-*')"
