# STATUS EXPECTED COMMAND (see run.sh). What every tool shares is tried in bvh2npz.tst; stopping and resuming in train-vrnn.tst; what is learnt in tests/denoiser.
# setup: make-corpus -q --subjects 1 --seconds 2 --transitions 0 -o corpus; canonicalize -q corpus -o c.h5; canonicalize -q corpus --fps 60 -o fast.h5; canonicalize -q corpus --body source -o rig.h5
# setup: make-corpus -q --subjects 1 --seconds 2 --transitions 0 --noise -o pair; canonicalize -q pair/clean -o pc.h5; canonicalize -q pair/noisy -o pn.h5; motion-select -q pn.h5 --head 3 -o few.h5; motion-select -q pn.h5 --time 0:1 -o short.h5
# setup: head -c 9000 c.h5 > cut.h5; echo nope > bad.h5; mkdir folder; printf '#!/bin/sh\nexec train-denoiser -q --batch 4 --window 16 "$@"\n' > t; chmod +x t
# setup: cat > q.py <<'END'
# setup: import sys, json, h5py, numpy as np
# setup: class Model:
# setup:     def __init__(self, path): self.f = h5py.File(path)
# setup:     def json(self, name): return json.loads(bytes(self.f[name][()]))
# setup:     def weights(self): return {n: d[()] for n, d in self.f["weights"].items()}
# setup:     def history(self): return [json.loads(l) for l in bytes(self.f["history"][()]).decode().splitlines()]
# setup: def same(a, b): return a.keys() == b.keys() and all(np.array_equal(a[k], b[k]) for k in a)
# setup: print(eval(sys.argv[1], {**globals(), "m": [Model(p) for p in sys.argv[2:]]}))
# setup: END
# setup: printf '#!/bin/sh\nexec /usr/bin/python3 q.py "$@"\n' > q; chmod +x q; echo True > true; printf 'a.h5\na.h5.log.tsv\n' > files

0 ~^Usage:.train-denoiser.*INPUT.-o.FILE train-denoiser --help
0 ~^LibTorch.[12]\. train-denoiser --version

# labels are not needed; the same bytes for any thread count, and from a pipe
0 files ./t c.h5 --epochs 2 -j 2 -o a.h5 && ls -d a.h5*
0 . ./t c.h5 --epochs 2 -j 1 -o b.h5 && cmp a.h5 b.h5 && cmp a.h5.log.tsv b.h5.log.tsv
0 true ./t - --epochs 2 -o piped.h5 < c.h5 && ./q 'same(m[0].weights(), m[1].weights())' a.h5 piped.h5
1 . ./t c.h5 --epochs 2 --seed 2 -o seed.h5 && cmp -s a.h5 seed.h5
0 ~^step.epoch.learning_rate.gradient_norm.loss.square_error.validation_loss$ cat a.h5.log.tsv
0 true ./q 'm[0].f.attrs["kind"] in ("denoiser", b"denoiser") and m[0].f["data/train_sources"].shape == (8,) and m[0].f["normalization/mean"].shape == (90,) and [e["tool"] for e in m[0].history()] == ["canonicalize", "train-denoiser"]' a.h5
0 ~denoiser motion-info a.h5
0 . motion-info --check full a.h5

# options
0 true ./t c.h5 --epochs 2 --val c.h5 --val-epochs 1 -o v.h5 && ./q 'same(m[0].weights(), m[1].weights())' a.h5 v.h5
0 ~[0-9]$ tail -n 1 v.h5.log.tsv
0 true train-denoiser -q c.h5 --epochs 1 --batch 5 --window 20 --corrupt-share 0.3 --corrupt-deviation 0.2 --learning-rate 0.002 --rate-decay 0.5 --shards 3 --device cpu --weights-only --checkpoint-minutes 1 --checkpoint-epochs 1 -o o.h5 && ./q '[(t["batch"], t["window"], t["share"], t["corruption"], t["learning_rate"], t["decay"], t["shards"]) for t in [m[0].json("config")["training"]]] == [(5, 20, 0.3, 0.2, 0.002, 0.5, 3)] and "training" not in m[0].f' o.h5
0 true train-denoiser -q c.h5 --epochs 1 -o d.h5 && ./q '[(t["share"], t["corruption"], t["learning_rate"], t["decay"], t["decay_epochs"]) for t in [m[0].json("config")["training"]]] == [(0.1, 0.5, 1e-4, 0.99, 10)]' d.h5
0 true ./t pc.h5 --noisy pn.h5 --val pc.h5 --val-noisy pn.h5 --val-epochs 1 --epochs 2 -o pair.h5 && ./q 'not same(m[0].weights(), m[1].weights()) and m[0].f["data/train_sources"].shape == (16,) and [i["path"] for i in m[0].history()[-1]["inputs"]] == ["pc.h5", "pn.h5", "pc.h5", "pn.h5"]' pair.h5 a.h5
2 ~is.a.file.that.the.training.reads ./t pc.h5 --noisy pn.h5 -f -o pn.h5
0 ~parameters,.*steps train-denoiser c.h5 --epochs 1 -o said.h5
0 . ./t c.h5 --epochs 2 --resume -o a.h5 && cmp a.h5 b.h5
2 ~was.trained.with.training/seed ./t c.h5 --epochs 2 --resume --seed 5 -o a.h5
4 ~a\.h5:.exists.already ./t c.h5 --epochs 2 -o a.h5
0 . ./t c.h5 --epochs 2 -f -o a.h5 && cmp a.h5 b.h5

# usage
2 ~no.input.given train-denoiser
2 ~no.output.given ./t c.h5
2 ~'-' ./t c.h5 -o -
2 ~--window train-denoiser -q c.h5 --window 0 -o x.h5
2 ~shards ./t c.h5 --shards 5 -o x.h5
2 ~above.0 ./t c.h5 --corrupt-share 0 -o x.h5
2 ~number ./t c.h5 --corrupt-share 1.5 -o x.h5
2 ~above.0 ./t c.h5 --corrupt-deviation 0 -o x.h5
2 ~above.0 ./t c.h5 --learning-rate nan -o x.h5
2 ~takes.the.place ./t pc.h5 --noisy pn.h5 --corrupt-share 0.2 -o x.h5
2 ~--val-noisy.without.--noisy ./t pc.h5 --val pc.h5 --val-noisy pn.h5 -o x.h5
2 ~expected.both.or.none ./t pc.h5 --noisy pn.h5 --val pc.h5 -o x.h5
2 ~standard.input ./t pc.h5 --noisy - -o x.h5
2 ~frames.in.all train-denoiser -q c.h5 --batch 65536 --window 100000 -o x.h5
2 ~is.the.archive.to.train.on cp c.h5 own.h5; ./t own.h5 -f -o own.h5

# bad input
3 ~^train-denoiser:.absent\.h5 ./t absent.h5 -o x.h5
3 ~^train-denoiser:.bad\.h5 ./t bad.h5 -o x.h5
3 ~^train-denoiser:.cut\.h5 ./t cut.h5 -o x.h5
3 ~^train-denoiser:.a\.h5 ./t a.h5 -o x.h5
3 ~60.Hz,.expected.30.Hz ./t c.h5 --val fast.h5 -o x.h5
3 ~another.skeleton ./t c.h5 --val rig.h5 -o x.h5
3 ~^train-denoiser:.few\.h5:.no.clip ./t pc.h5 --noisy few.h5 -o x.h5
3 ~frames,.expected ./t pc.h5 --noisy short.h5 -o x.h5
3 ~diverged.at.step ./t c.h5 --epochs 20 --learning-rate 1e30 -o div.h5
1 . test -e x.h5 -o -e div.h5

# output
4 ~nowhere ./t c.h5 --epochs 1 -o nowhere/x.h5
4 ~folder ./t c.h5 --epochs 1 -o folder
1 . test -n "$(find . -name '*.part-*')"
