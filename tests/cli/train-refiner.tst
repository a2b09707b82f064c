# STATUS EXPECTED COMMAND (see run.sh). What every tool shares is tried in bvh2npz.tst; what is computed in tests/refiner.
# setup: make-corpus -q --subjects 1 --seconds 3 --transitions 0 --action walking --action jogging -o corpus; canonicalize -q corpus --labels corpus/labels.tsv -o c.h5; canonicalize -q corpus --fps 60 -o fast.h5; canonicalize -q corpus --body source -o rig.h5
# setup: train-lstm -q c.h5 --steps 4 --batch 4 --window 8 --weights-only -o g.h5; train-vrnn -q c.h5 --steps 3 --batch 4 --window 6 --pretrain-steps 1 --weights-only -o mc.h5
# setup: motion-select -q c.h5 --time 0:0 -o frame.h5; head -c 9000 c.h5 > cut.h5; echo nope > bad.h5; mkdir folder
# setup: printf '#!/bin/sh\nexec train-refiner -q --batch 4 --window 8 --buffer 8 --samples 8 --sample-frames 20 "$@"\n' > t; chmod +x t
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
# setup: signal=$1; shift; touch before; "$@" --checkpoint-minutes 100 --checkpoint-epochs 2 & p=$!
# setup: for i in $(seq 6000); do [ -n "$(find . -name 'stopped.h5.ckpt-?' -newer before)" ] && break; kill -0 $p 2>/dev/null || break; sleep 0.01; done
# setup: kill -$signal $p; wait $p 2>/dev/null; exit $?
# setup: END
# setup: printf '#!/bin/sh\nexec /usr/bin/python3 q.py "$@"\n' > q; chmod +x q; echo True > true; printf 'a.h5\na.h5.log.tsv\n' > files

0 ~^Usage:.train-refiner.*INPUT.-o.FILE train-refiner --help
0 ~^LibTorch.[12]\. train-refiner --version

# the same bytes for any thread count, and from a pipe
0 files ./t c.h5 --generator g.h5 --steps 8 -j 2 -o a.h5 && ls -d a.h5*
0 . ./t c.h5 --generator g.h5 --steps 8 -j 1 -o b.h5 && cmp a.h5 b.h5 && cmp a.h5.log.tsv b.h5.log.tsv
0 true ./t - --generator g.h5 --steps 8 -o piped.h5 < c.h5 && ./q 'same(m[0].weights(), m[1].weights())' a.h5 piped.h5
1 . ./t c.h5 --generator g.h5 --steps 8 --seed 2 -o seed.h5 && cmp -s a.h5 seed.h5
0 ~^step.epoch.learning_rate.gradient_norm.loss.adversarial.root.contact.discriminator.accuracy_refined.accuracy_real.ratio.validation_loss$ cat a.h5.log.tsv
0 true ./q 'm[0].f.attrs["kind"] in ("refiner", b"refiner") and m[0].f["data/train_sources"].shape == (4,) and m[0].json("config")["generator"]["kind"] == "lstm-gmm" and {k.split("/")[0] for k in m[0].weights()} == {"effectors", "refiner", "discriminator"} and [e["tool"] for e in m[0].history()].count("train-lstm") == 1 and m[0].history()[-1]["tool"] == "train-refiner"' a.h5
0 ~refiner motion-info a.h5
0 . motion-info --check full a.h5

# interrupted and continued, both times after the first 150 updates: the same bytes, so buffer and balance of the two came along
75 . sh ./stop TERM ./t c.h5 --generator g.h5 --steps 600 -j 1 -o stopped.h5
137 . sh ./stop KILL ./t c.h5 --generator g.h5 --steps 600 -j 2 --resume -o stopped.h5
0 . ./t c.h5 --generator g.h5 --steps 600 -j 2 --resume -o stopped.h5 && ./t c.h5 --generator g.h5 --steps 600 -j 2 -o whole.h5 && cmp stopped.h5 whole.h5 && cmp stopped.h5.log.tsv whole.h5.log.tsv

# clips shorter than a window are left out
0 ~1.clips.of.less.than.--window.8.frames motion-select -q c.h5 --name '*walk*' --head 1 --time 0:0.1 -o part.h5 && motion-select -q c.h5 --name '*jog*' -o jogs.h5 && motion-merge -q jogs.h5 part.h5 -o mixed.h5 && train-refiner mixed.h5 --generator g.h5 --batch 4 --window 8 --buffer 8 --samples 8 --sample-frames 20 --steps 1 -o mixed-model.h5

# any generator
0 true ./t c.h5 --generator mc.h5 --steps 4 -o mcr.h5 && ./q 'm[0].json("config")["generator"]["kind"] == "motion-cell"' mcr.h5 && sample -q -m mc.h5 -n 4 --frames 30 -o - | refine -q -m mcr.h5 - -o mcs.h5 && motion-info --check full mcs.h5 > /dev/null

# options
0 true train-refiner -q c.h5 --generator g.h5 --samples 6 --sample-frames 15 --steps 2 --batch 6 --window 10 --buffer 12 --root-weight 5 --learning-rate 0.001 --discriminator-rate 0.003 --ratio 3 --contact-weight 7 --full-rate 0.25 --gradient-limit 2 --noise-scale 0.5 --shards 3 --no-contacts --device cpu --weights-only --checkpoint-minutes 1 --checkpoint-epochs 1 --val-epochs 1 -o o.h5 && ./q '[(t["batch"], t["window"], t["buffer"], t["root_weight"], t["learning_rate"], t["ratio"]["begin"], t["contact_weight"], t["gradient_limit"], t["shards"]) for t in [m[0].json("config")["training"]]] == [(6, 10, 12, 5, {"refiner": 0.001, "discriminator": 0.003, "full": 0.25}, 3, 7, 2, 3)] and m[0].json("config")["network"]["contacts"] is False and m[0].json("config")["generator"]["samples"] == 6 and m[0].json("config")["generator"]["frames"] == 15 and m[0].json("config")["generator"]["noise_scale"] == 0.5 and "training" not in m[0].f' o.h5
0 true ./t c.h5 --generator g.h5 --preset paper --steps 1 -o paper.h5 && ./q 'm[0].json("config")["network"]["hidden"] == 512' paper.h5
0 ~motions.of.g.h5 train-refiner c.h5 --generator g.h5 --batch 4 --window 8 --buffer 8 --samples 8 --sample-frames 20 --steps 1 -o said.h5

# usage
2 ~--generator.is.required train-refiner c.h5 -o x.h5
2 ~no.input.given train-refiner --generator g.h5
2 ~no.output.given ./t c.h5 --generator g.h5
2 ~'-' ./t c.h5 --generator g.h5 -o -
2 ~even.number train-refiner c.h5 --generator g.h5 --batch 5 -o x.h5
2 ~motions.as.long.as.a.window train-refiner c.h5 --generator g.h5 --sample-frames 20 --window 21 -o x.h5
2 ~frames.in.all train-refiner c.h5 --generator g.h5 --samples 1000000 --sample-frames 1000000 -o x.h5
2 ~a.buffer.of.1 train-refiner c.h5 --generator g.h5 --buffer 1 -o x.h5
2 ~--generator.- ./t - --generator - -o x.h5 < c.h5
2 ~is.a.file.that.the.training.reads ./t c.h5 --generator g.h5 -f -o g.h5
2 ~was.trained.with.generated.= ./t c.h5 --generator g.h5 --steps 8 --resume --seed 5 -o a.h5
4 ~a\.h5:.exists.already ./t c.h5 --generator g.h5 --steps 8 -o a.h5

# bad input
3 ~^train-refiner:.absent\.h5 ./t absent.h5 --generator g.h5 -o x.h5
3 ~^train-refiner:.bad\.h5 ./t bad.h5 --generator g.h5 -o x.h5
3 ~^train-refiner:.cut\.h5 ./t cut.h5 --generator g.h5 -o x.h5
3 ~^train-refiner:.absent\.h5 ./t c.h5 --generator absent.h5 -o x.h5
3 ~kind.'refiner',.expected.one.that.generates ./t c.h5 --generator a.h5 -o x.h5
3 ~^train-refiner:.g\.h5.*60.Hz ./t fast.h5 --generator g.h5 -o x.h5
3 ~^train-refiner:.g\.h5.*another.skeleton ./t rig.h5 --generator g.h5 -o x.h5
3 ~^train-refiner:.short\.h5:.no.clip.of.8.frames motion-select -q c.h5 --time 0:0.1 -o short.h5 && ./t short.h5 --generator g.h5 -o x.h5
3 ~^train-refiner:.frame\.h5:.no.clip.of.2.frames ./t frame.h5 --generator g.h5 -o x.h5
1 . test -e x.h5

# output
4 ~nowhere ./t c.h5 --generator g.h5 --steps 1 -o nowhere/x.h5
1 . test -n "$(find . -name '*.part-*')"
