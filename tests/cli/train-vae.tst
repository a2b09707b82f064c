# STATUS EXPECTED COMMAND (see run.sh). What every tool shares is tried in bvh2npz.tst; stopping and resuming in train-vrnn.tst; what is learnt in tests/cae_vae.
# setup: make-corpus -q --subjects 1 --seconds 3 --transitions 0 -o corpus; canonicalize -q corpus -o c.h5; canonicalize -q corpus --fps 60 -o fast.h5; cp corpus/walking_f001_1.bvh other.bvh; sed -i 's/spine2/chest/' other.bvh; canonicalize -q other.bvh --body source -o other.h5; motion-select -q c.h5 --time 0:0.5 -o short.h5
# setup: head -c 9000 c.h5 > cut.h5; echo nope > bad.h5; mkdir folder; printf '#!/bin/sh\nexec train-vae -q --batch 8 --window 30 --filters 8 --hidden 16 --latent 4 "$@"\n' > t; chmod +x t
# setup: cat > q.py <<'END'
# setup: import sys, json, h5py, numpy as np
# setup: class Model:
# setup:     def __init__(self, path): self.f = h5py.File(path)
# setup:     def json(self, name): return json.loads(bytes(self.f[name][()]))
# setup:     def weights(self):
# setup:         out = {}
# setup:         self.f["weights"].visititems(lambda n, d: out.update({n: d[()]}) if isinstance(d, h5py.Dataset) else None)
# setup:         return out
# setup:     def history(self): return [json.loads(l) for l in bytes(self.f["history"][()]).decode().splitlines()]
# setup: def same(a, b): return a.keys() == b.keys() and all(np.array_equal(a[k], b[k]) for k in a)
# setup: print(eval(sys.argv[1], {**globals(), "m": [Model(p) for p in sys.argv[2:]]}))
# setup: END
# setup: printf '#!/bin/sh\nexec /usr/bin/python3 q.py "$@"\n' > q; chmod +x q; echo True > true; printf 'a.h5\na.h5.log.tsv\n' > files

0 ~^Usage:.train-vae.*INPUT.-o.FILE train-vae --help
0 ~^LibTorch.[12]\. train-vae --version

# both stages in one file; the same bytes for any thread count, and from a pipe
0 files ./t c.h5 --epochs 2 -j 2 -o a.h5 && ls -d a.h5*
0 . ./t c.h5 --epochs 2 -j 1 -o b.h5 && cmp a.h5 b.h5 && cmp a.h5.log.tsv b.h5.log.tsv
0 true ./t - --epochs 2 -o piped.h5 < c.h5 && ./q 'same(m[0].weights(), m[1].weights())' a.h5 piped.h5
1 . ./t c.h5 --epochs 2 --seed 2 -o seed.h5 && cmp -s a.h5 seed.h5
0 ~^step.epoch.learning_rate.gradient_norm.loss.square_error.nats.kl.validation_loss$ cat a.h5.log.tsv
0 true ./q 'm[0].f.attrs["kind"] in ("cae-vae", b"cae-vae") and m[0].f["normalization/mean"].shape == (58,) and m[0].f["weights/cae/encoder_weight"].shape == (8, 58, 15) and m[0].f["weights/vae/decoder_1_weight"].shape == (2 * 8 * 15, 16) and [e["tool"] for e in m[0].history()] == ["canonicalize", "train-vae"]' a.h5
0 ~cae-vae motion-info a.h5
0 . motion-info --check full a.h5
0 ~within.*mm.by.the.autoencoder.*mm.by.both.stages train-vae c.h5 --window 30 --epochs 1 -o told.h5
0 ~^train-vae:.c\.h5:.joints.of train-vae c.h5 --window 30 --epochs 1 --val c.h5 -o told.h5 -f

# options
0 true ./t c.h5 --epochs 2 --val c.h5 --val-epochs 1 -o v.h5 && ./q 'same(m[0].weights(), m[1].weights())' a.h5 v.h5
0 ~[0-9]$ tail -n 1 v.h5.log.tsv
0 true ./t c.h5 --epochs 1 --root-filters separate -o s.h5 && ./q 'm[0].f["weights/cae/encoder_weight"].shape == (7, 55, 15) and m[0].f["weights/cae/encoder_root_weight"].shape == (1, 3, 15) and m[0].json("config")["network"]["root_filters"] == 1' s.h5
0 true train-vae -q c.h5 --epochs 1 --vae-epochs 2 --batch 5 --window 20 --overlap 5 --filters 4 --kernel 7 --hidden 12 --latent 3 --learning-rate 0.002 --full-rate 0.7 --gradient-limit 3 --kl-weight 0.5 --least-deviation 0.2 --windows fixed --upsampling nearest --prior-components 2 --shards 3 --device cpu --weights-only --checkpoint-minutes 1 --checkpoint-epochs 1 -o o.h5 && ./q '[(t["epochs"], t["vae_epochs"], t["batch"], t["overlap"], t["learning_rate"], t["kl_weight"], t["gradient_limit"], t["least_deviation"], t["shifted"], t["shards"], n["window"], n["filters"], n["kernel"], n["hidden"], n["latent"], n["upsampling"]) for t, n in [(m[0].json("config")["training"], m[0].json("config")["network"])]] == [(1, 2, 5, 5, {"rate": 0.002, "full": 0.7}, 0.5, 3, 0.2, False, 3, 20, 4, 7, 12, 3, "nearest")] and "training" not in m[0].f and m[0].f["weights/prior/root"].shape == (2, 3, 3)' o.h5
0 true train-vae -q c.h5 --window 30 --epochs 1 -o d.h5 && ./q '[(t["vae_epochs"], t["batch"], t["overlap"], t["learning_rate"], t["kl_weight"], t["gradient_limit"], t["least_deviation"], t["shifted"], n["root_filters"], n["filters"], n["kernel"], n["hidden"], n["latent"]) for t, n in [(m[0].json("config")["training"], m[0].json("config")["network"])]] == [(1, 100, 15, {"rate": 0.001, "full": 0.5}, 1, 5, 0.3, True, 0, 32, 15, 256, 32)]' d.h5
0 ~windows.of.*parameters,.*steps train-vae c.h5 --window 30 --epochs 1 -o said.h5
0 . ./t c.h5 --epochs 2 --resume -o a.h5 && cmp a.h5 b.h5
2 ~was.trained.with.training/seed ./t c.h5 --epochs 2 --resume --seed 5 -o a.h5
2 ~was.trained.with.network/root_filters ./t c.h5 --epochs 2 --resume --root-filters separate -o a.h5
4 ~a\.h5:.exists.already ./t c.h5 --epochs 2 -o a.h5
0 . ./t c.h5 --epochs 2 -f -o a.h5 && cmp a.h5 b.h5
# stopped in either stage and continued
75 . timeout --preserve-status -s TERM 4 ./t c.h5 --epochs 100000 --vae-epochs 1 -o stop.h5
2 ~was.trained.with.training/vae_epochs ./t c.h5 --epochs 100000 --vae-epochs 2 --resume -o stop.h5
75 . timeout --preserve-status -s TERM 4 ./t c.h5 --epochs 1 --vae-epochs 100000 -o stop2.h5
75 . timeout --preserve-status -s TERM 4 ./t c.h5 --epochs 1 --vae-epochs 100000 --resume -o stop2.h5

# usage
2 ~no.input.given train-vae
2 ~no.output.given ./t c.h5
2 ~'-' ./t c.h5 -o -
2 ~--window train-vae -q c.h5 --window 0 -o x.h5
2 ~even train-vae -q c.h5 --window 31 -o x.h5
2 ~odd ./t c.h5 --kernel 4 -o x.h5
2 ~within.the.window ./t c.h5 --kernel 31 -o x.h5
2 ~expected.an.overlap.from.0.to.29 ./t c.h5 --overlap 30 -o x.h5
2 ~shared ./t c.h5 --root-filters both -o x.h5
2 ~--filters ./t c.h5 --filters 1 -o x.h5
2 ~shards ./t c.h5 --shards 9 -o x.h5
2 ~above.0 ./t c.h5 --learning-rate nan -o x.h5
2 ~at.least.0 ./t c.h5 --kl-weight -1 -o x.h5
2 ~at.least.0 ./t c.h5 --least-deviation -1 -o x.h5
2 ~above.0 ./t c.h5 --gradient-limit 0 -o x.h5
2 ~--full-rate ./t c.h5 --full-rate 1.5 -o x.h5
2 ~shifted ./t c.h5 --windows loose -o x.h5
2 ~nearest ./t c.h5 --upsampling cubic -o x.h5
2 ~--prior-components ./t c.h5 --prior-components 0 -o x.h5
2 ~weights train-vae -q c.h5 --window 80 --filters 4096 --hidden 4096 -o x.h5
2 ~standard.input ./t c.h5 --val - -o x.h5
2 ~is.the.archive.to.train.on cp c.h5 own.h5; ./t own.h5 -f -o own.h5
2 ~is.a.file.that.the.training.reads cp c.h5 val.h5; ./t c.h5 --val val.h5 -f -o val.h5

# bad input
3 ~^train-vae:.nowhere\.h5 ./t nowhere.h5 -o x.h5
3 ~bad\.h5 ./t bad.h5 -o x.h5
3 ~cut\.h5 ./t cut.h5 -o x.h5
3 ~short\.h5:.*none.as.long.as.a.window.of.30.frames ./t short.h5 -o x.h5
3 ~other\.h5:skeleton:.no.joint.*expected.the.canonical.body ./t other.h5 -o x.h5
3 ~60.Hz,.expected.the.training.data's.30.Hz ./t c.h5 --val fast.h5 -o x.h5
3 ~nowhere ./t c.h5 --val nowhere.h5 -o x.h5
1 . ls x.h5* 2> /dev/null | grep -q .
3 ~diverged.at.step ./t c.h5 --epochs 20 --learning-rate 1e30 -o div.h5
1 . test -e div.h5

# output
4 ~nowhere ./t c.h5 --epochs 1 -o nowhere/x.h5
4 ~folder ./t c.h5 --epochs 1 -o folder
1 . test -n "$(find . -name '*.part-*')"
