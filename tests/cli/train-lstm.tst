# STATUS EXPECTED COMMAND (see run.sh). What every tool shares is tried in bvh2npz.tst; stopping and resuming in train-vrnn.tst; what is computed in tests/lstm_gmm.
# setup: make-corpus -q --subjects 1 --seconds 3 --transitions 0 --action walking --action jogging -o corpus; canonicalize -q corpus -o c.h5; canonicalize -q corpus --fps 60 -o fast.h5; canonicalize -q corpus --body source -o rig.h5
# setup: motion-select -q c.h5 --head 2 -o two.h5; motion-select -q c.h5 --time 0:0 -o frame.h5; head -c 9000 c.h5 > cut.h5; echo nope > bad.h5; mkdir folder
# setup: printf '#!/bin/sh\nexec train-lstm -q --batch 4 --window 12 "$@"\n' > t; chmod +x t
# setup: cat > q.py <<'END'
# setup: import sys, json, h5py, numpy as np
# setup: class Model:
# setup:     def __init__(self, path): self.f = h5py.File(path)
# setup:     def json(self, name): return json.loads(bytes(self.f[name][()]))
# setup:     def weights(self):
# setup:         out = {}
# setup:         self.f["weights"].visititems(lambda n, d: out.update({n: d[()]}) if hasattr(d, "shape") else None)
# setup:         return out
# setup:     def history(self): return [json.loads(l) for l in bytes(self.f["history"][()]).decode().splitlines()]
# setup: def same(a, b): return a.keys() == b.keys() and all(np.array_equal(a[k], b[k]) for k in a)
# setup: print(eval(sys.argv[1], {**globals(), "m": [Model(p) for p in sys.argv[2:]]}))
# setup: END
# setup: cat > stop <<'END'
# setup: # stop SIGNAL COMMAND... -o stopped.h5: sends the signal once a checkpoint newer than now is there
# setup: signal=$1; shift; touch before; "$@" --checkpoint-minutes 0.002 & p=$!
# setup: for i in $(seq 6000); do [ -n "$(find . -name 'stopped.h5.ckpt-?' -newer before)" ] && break; kill -0 $p 2>/dev/null || break; sleep 0.01; done
# setup: kill -$signal $p; wait $p 2>/dev/null; exit $?
# setup: END
# setup: printf '#!/bin/sh\nexec /usr/bin/python3 q.py "$@"\n' > q; chmod +x q; echo True > true; printf 'a.h5\na.h5.log.tsv\n' > files

0 ~^Usage:.train-lstm.*INPUT.-o.FILE train-lstm --help
0 ~^LibTorch.[12]\. train-lstm --version

# the same bytes for any thread count, and from a pipe; no labels are needed
0 files ./t c.h5 --steps 6 -j 2 -o a.h5 && ls -d a.h5*
0 . ./t c.h5 --steps 6 -j 1 -o b.h5 && cmp a.h5 b.h5 && cmp a.h5.log.tsv b.h5.log.tsv
0 true ./t - --steps 6 -o piped.h5 < c.h5 && ./q 'same(m[0].weights(), m[1].weights())' a.h5 piped.h5
1 . ./t c.h5 --steps 6 --seed 2 -o seed.h5 && cmp -s a.h5 seed.h5
0 ~^step.epoch.learning_rate.gradient_norm.loss.features_nats.contacts_nats.validation_loss$ cat a.h5.log.tsv
0 true ./q 'm[0].f.attrs["kind"] in ("lstm-gmm", b"lstm-gmm") and m[0].f["data/train_sources"].shape == (4,) and m[0].f["normalization/mean"].shape == (69,) and m[0].weights()["start"].shape == (64, 2, 71) and m[0].json("config")["contacts"] == "preset:default" and [e["tool"] for e in m[0].history()] == ["canonicalize", "train-lstm"]' a.h5
0 ~lstm-gmm motion-info a.h5
0 . motion-info --check full a.h5

# interrupted and continued: the same bytes
75 . sh ./stop TERM ./t c.h5 --steps 400 -j 1 -o stopped.h5
137 . sh ./stop KILL ./t c.h5 --steps 400 -j 2 --resume -o stopped.h5
0 . ./t c.h5 --steps 400 -j 2 --resume -o stopped.h5 && ./t c.h5 --steps 400 -j 2 -o whole.h5 && cmp stopped.h5 whole.h5 && cmp stopped.h5.log.tsv whole.h5.log.tsv

# learnt: a likelihood far above the first step's
0 true ./q '(lambda loss: np.mean(loss[-20:]) < np.mean(loss[:20]) - 40)(np.genfromtxt("whole.h5.log.tsv", names=True, delimiter="\t")["loss"])'

# options
0 true train-lstm -q c.h5 --steps 2 --batch 5 --window 20 --cell standard --carry 0.25 --input-noise 0.1 --learning-rate 0.002 --decay-steps 7 --shards 3 --device cpu --weights-only --checkpoint-minutes 1 --checkpoint-epochs 1 -o o.h5 && ./q '[(t["batch"], t["window"], t["input_noise"], t["learning_rate"]["rate"], t["learning_rate"]["decay_steps"], t["shards"]) for t in [m[0].json("config")["training"]]] == [(5, 20, 0.1, 0.002, 7, 3)] and [[x.json("config")["network"][k] for k in ("cell", "carry")] for x in m] == [["standard", 0.25], ["paper", 0.9]] and m[0].weights()["lstm_1/weight_hh"].shape == (1024, 256) and m[1].weights()["lstm_1/weight_hh"].shape == (1024, 512) and "training" not in m[0].f' o.h5 a.h5
0 true train-lstm -q c.h5 --preset paper --steps 1 --batch 2 --window 4 -o paper.h5 && ./q 'm[0].json("config")["network"]["hidden"] == 512 and sum(v.size for k, v in m[0].weights().items() if k != "start") == 6952633' paper.h5
0 ~parameters,.*steps train-lstm two.h5 --steps 1 --batch 2 --window 4 -o said.h5
0 ~negative.log-likelihood.*nats.a.frame ./t c.h5 --steps 6 --val two.h5 --val-epochs 1 -o v.h5
0 true ./q 'same(m[0].weights(), m[1].weights())' a.h5 v.h5
0 true ./t c.h5 --steps 6 --val two.h5 --json -o vj.h5 > r.json && ./q '(lambda r: set(r) == {"nats_per_frame", "contact_nats_per_frame", "angle_error_deg", "persistence_deg", "contact_error"} and r["angle_error_deg"] > 0.1 and 0 <= r["contact_error"] <= 1)(json.load(open("r.json")))'

# fine-tuning: weights and normalisation of another model
0 true ./t two.h5 --init-from a.h5 --steps 1 --learning-rate 1e-12 -o fine.h5 && ./q 'all(np.allclose(m[0].weights()[k], m[1].weights()[k], atol=1e-6) for k in m[0].weights() if k != "start") and np.array_equal(m[0].f["normalization/mean"][()], m[1].f["normalization/mean"][()]) and [i["path"] for i in m[0].history()[-1]["inputs"]] == ["two.h5", "a.h5"]' fine.h5 a.h5
3 ~another.skeleton ./t rig.h5 --init-from a.h5 --steps 1 -o x.h5
3 ~60.Hz,.expected.the.training.data's.30.Hz ./t fast.h5 --init-from a.h5 --steps 1 -o x.h5
3 ~is.no.model|not.a.mocap.model|expected ./t c.h5 --init-from c.h5 --steps 1 -o x.h5

# clips without contacts are labelled, clips of one frame left out
0 ~labelled.by.the.rule.default /usr/bin/python3 -c 'import h5py; f = h5py.File("two.h5", "r"); g = h5py.File("bare.h5", "w", libver="latest"); [f.copy(k, g) for k in f]; [g.attrs.__setitem__(k, v) for k, v in f.attrs.items() if k != "contacts"]; del g["frames/contacts"]' && train-lstm bare.h5 --steps 1 --batch 2 --window 4 -o nb.h5
3 ~^train-lstm:.frame\.h5:.no.clip.of.2.frames ./t frame.h5 --steps 1 -o x.h5

# usage
2 ~no.input.given train-lstm
2 ~no.output.given ./t c.h5
2 ~'-' ./t c.h5 -o -
2 ~expected.one.of ./t c.h5 --cell other -o x.h5
2 ~--carry ./t c.h5 --carry 1.5 -o x.h5
2 ~--val.-: ./t c.h5 --val - -o x.h5
2 ~shards ./t c.h5 --shards 5 -o x.h5
2 ~frames.in.all train-lstm -q c.h5 --batch 65536 --window 100000 -o x.h5
2 ~is.the.archive.to.train.on cp c.h5 own.h5; ./t own.h5 -f -o own.h5
2 ~is.a.file.that.the.training.reads ./t c.h5 --init-from a.h5 -f -o a.h5
2 ~was.trained.with.training/seed ./t c.h5 --steps 6 --resume --seed 5 -o a.h5
4 ~a\.h5:.exists.already ./t c.h5 --steps 6 -o a.h5

# bad input
3 ~^train-lstm:.absent\.h5 ./t absent.h5 -o x.h5
3 ~^train-lstm:.bad\.h5 ./t bad.h5 -o x.h5
3 ~^train-lstm:.cut\.h5 ./t cut.h5 -o x.h5
3 ~^train-lstm:.a\.h5 ./t a.h5 -o x.h5
3 ~60.Hz,.expected.the.training.data's.30.Hz ./t c.h5 --val fast.h5 -o x.h5
3 ~another.skeleton ./t c.h5 --val rig.h5 -o x.h5
3 ~diverged.at.step ./t c.h5 --steps 50 --learning-rate 1e30 -o div.h5
1 . test -e x.h5 -o -e div.h5

# output
4 ~nowhere ./t c.h5 --steps 1 -o nowhere/x.h5
4 ~folder ./t c.h5 --steps 1 -o folder
1 . test -n "$(find . -name '*.part-*')"
