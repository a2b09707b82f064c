# STATUS EXPECTED COMMAND (see run.sh). What every tool shares is tried in bvh2npz.tst. Trainings of a few steps: what they
# learn is tried in tests/motion_cell.
# setup: make-corpus -q --subjects 1 --seconds 2 --transitions 0 -o corpus; canonicalize -q corpus --labels corpus/labels.tsv -o c.h5; canonicalize -q corpus -o unlabelled.h5
# setup: canonicalize -q corpus --labels corpus/labels.tsv --fps 60 -o fast.h5; make-corpus -q --subjects 1 --seconds 1 --transitions 0 --action walking --seed 2 -o val; canonicalize -q val --labels val/labels.tsv -o val.h5
# setup: head -c 9000 c.h5 > cut.h5; echo nope > bad.h5; printf 'file\taction\n' > some.tsv; (cd corpus; for f in *.bvh; do printf '%s\t%s\n' $f dancing; done) >> some.tsv; canonicalize -q corpus --labels some.tsv -o dancing.h5
# setup: (head -1 corpus/labels.tsv; grep walking corpus/labels.tsv) > few.tsv; sed 's/female/male/' corpus/labels.tsv > relabelled.tsv; canonicalize -q corpus --labels relabelled.tsv -o relabelled.h5
# setup: canonicalize -q corpus --labels few.tsv -o few.h5; mkdir tmp folder
# setup: printf '#!/bin/sh\nexec train-vrnn -q --batch 4 --window 6 --pretrain-steps 2 "$@"\n' > t; printf '#!/bin/sh\nexec ./t c.h5 --steps 120 "$@"\n' > long; chmod +x t long
# setup: train-classifier -q c.h5 --attribute action --epochs 2 -o cl-action.h5; train-classifier -q c.h5 --attribute gender --epochs 2 -o cl-gender.h5; train-classifier -q fast.h5 --attribute action --epochs 1 -o cl-fast.h5
# setup: make-corpus -q --subjects 1 --seconds 2 --transitions 0 --seed 5 -o real; canonicalize -q real --labels real/labels.tsv -o real.h5; canonicalize -q real --labels real/labels.tsv --body source -o rig.h5; train-classifier -q rig.h5 --attribute action --epochs 1 -o cl-rig.h5
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
# setup: printf '#!/bin/sh\nexec /usr/bin/python3 q.py "$@"\n' > q
# setup: cat > stop <<'END'
# setup: #!/bin/bash
# setup: # stop SIGNAL COMMAND...: runs the command, sends the signal once sig.h5 has a checkpoint newer than now, says how it ended
# setup: signal=$1; shift; touch before; "$@" --checkpoint-minutes 0.0005 & p=$!
# setup: for i in $(seq 3000); do [ -n "$(find . -name 'sig.h5.ckpt-?' -newer before)" ] && break; kill -0 $p 2>/dev/null || break; sleep 0.01; done
# setup: kill -$signal $p; wait $p 2>/dev/null; exit $?
# setup: END
# setup: chmod +x q stop; echo True > true; echo 7 > 7; printf 'a.h5\na.h5.log.tsv\n' > files

0 ~^Usage:.train-vrnn.*INPUT.-o.FILE train-vrnn --help
0 ~^LibTorch.[12]\. train-vrnn --version
4 ~write.failed train-vrnn --help > /dev/full

# the same bytes for any thread count, and from a pipe
0 files ./t c.h5 --steps 6 -j 2 -o a.h5 && ls -d a.h5*
0 7 wc -l < a.h5.log.tsv
0 ~^step.epoch.learning_rate.gradient_norm.loss.*validation_loss$ cat a.h5.log.tsv
0 . ./t c.h5 --steps 6 -j 1 -o tmp/b.h5 && cmp a.h5 tmp/b.h5 && cmp a.h5.log.tsv tmp/b.h5.log.tsv
0 true ./t - --steps 6 -o piped.h5 < c.h5 && ./q 'same(m[0].weights(), m[1].weights())' a.h5 piped.h5
1 . ./t c.h5 --steps 6 --seed 2 -o seed.h5 && cmp -s a.h5 seed.h5
0 true ./q 'm[0].json("config")["training"]["seed"] == 1 and m[0].f.attrs["kind"] in ("motion-cell", b"motion-cell") and m[0].json("config")["frame_rate_hz"] == 30' a.h5
0 true ./q '[e["tool"] for e in m[0].history()] == ["canonicalize", "train-vrnn"] and m[0].history()[1]["inputs"][0]["path"] == "c.h5" and not [a for a in m[0].history()[1]["argv"] if "--output" in a or "threads" in a or "quiet" in a]' a.h5
0 true ./q 'sorted(m[0].f["vocabulary"]) == ["action", "gender"] and m[0].f["data/train_sources"].shape == (8,)' a.h5
0 ~motion-cell motion-info a.h5
0 . motion-info --check full a.h5

# options
0 true ./t c.h5 --steps 6 --val val.h5 --val-epochs 1 -o v.h5 && ./q 'same(m[0].weights(), m[1].weights())' a.h5 v.h5
0 ~^6.3.*[0-9]$ cat v.h5.log.tsv
0 true ./t c.h5 --steps 6 --weights-only -o w.h5 && ./q 'same(m[0].weights(), m[1].weights()) and "training" not in m[1].f and "training" in m[0].f' a.h5 w.h5
0 true ./t c.h5 --steps 2 --attribute action -o act.h5 && ./q 'list(m[0].f["vocabulary"]) == ["action"]' act.h5
0 true train-vrnn -q c.h5 --batch 4 --window 6 --epochs 3 --pretrain-steps 0 -o e.h5 && ./q 'm[0].json("config")["training"]["steps"] == 6 and m[0].json("config")["training"]["pretraining"]["steps"] == 0' e.h5
0 true train-vrnn -q c.h5 --preset paper --steps 1 --batch 3 --shards 3 --window 8 --learning-rate 0.002 --reconstruction-scale 5 --velocity-weight 0.25 --root-weight 0.75 --overlap 2 --kl-ramp 0.1 0.2 --own-output 0.3 0.4 --own-output-rate 0.5 --checkpoint-epochs 1 --device cpu --weights-only -o p.h5 && ./q '[(t["batch"], t["shards"], t["windows"], t["learning_rate"]["rate"], t["reconstruction_scale"], t["objective"]["velocity_weight"], t["objective"]["root_weight"], t["kl_weight"], t["own_output"]) for t in [m[0].json("config")["training"]]] == [(3, 3, [{"begin": 0.0, "frames": 6}], 0.002, 5, 0.25, 0.75, {"begin": 0.1, "end": 0.2, "from": 0.1, "to": 1}, {"begin": 0.3, "end": 0.4, "from": 0, "to": 0.5})] and m[0].json("config")["network"]["hidden"] == 512 and m[0].json("config")["network"]["overlap"] == 2' p.h5
0 . printf 'steps = 6\nbatch = 4\nwindow = 6\npretrain-steps = 2\nquiet = true\n' > c.toml && train-vrnn c.h5 --config c.toml -o conf.h5 && cmp conf.h5 a.h5
0 ~^[0-9]+/2.steps,.loss ./t c.h5 --steps 2 --progress always --log-level info -o prog.h5
0 ~parameters,.2.steps train-vrnn --batch 4 --window 6 c.h5 --steps 2 -o said.h5
0 ~6.of.8.clips.are.left.out train-vrnn --batch 4 --window 6 few.h5 --attribute action --steps 2 -o few-model.h5
0 . ./t c.h5 --steps 6 -f -o a.h5 && cmp a.h5 tmp/b.h5

# representations and distances: trained, kept in the file, sampled
0 true for r in quaternion rotation-matrix axis-angle; do ./t c.h5 --steps 4 --representation $r -o rep-$r.h5; done; ./q '[(x.json("config")["representation"], x.json("config")["training"]["objective"]["distance"], x.json("config")["network"]["rotation_values"]) for x in m] == [("quaternion", "d1", 4), ("rotation-matrix", "geodesic", 9), ("axis-angle", "l2", 3)]' rep-quaternion.h5 rep-rotation-matrix.h5 rep-axis-angle.h5
0 true ./t c.h5 --steps 4 -o plain.h5 && ./q 'same(m[0].weights(), m[1].weights())' plain.h5 rep-quaternion.h5
0 . for r in rotation-matrix axis-angle; do sample -q -m rep-$r.h5 -n 2 --frames 10 -f -o s.h5 && motion-info --check full s.h5 > info || exit 1; done
0 . ./t c.h5 --steps 4 --representation rotation-matrix --val val.h5 -j 1 -o again.h5 && ./q 'same(m[0].weights(), m[1].weights())' again.h5 rep-rotation-matrix.h5 | grep True
0 true for d in d2 d3 l2 fk; do ./t c.h5 --steps 4 --distance $d -o d-$d.h5; done; ./q 'all(not same(x.weights(), m[0].weights()) for x in m[1:]) and [x.json("config")["training"]["objective"]["distance"] for x in m] == ["d1", "d2", "d3", "l2", "fk"]' plain.h5 d-d2.h5 d-d3.h5 d-l2.h5 d-fk.h5
2 ~distance.geodesic.of.representation.quaternion,.expected.one.of.d1,.d2,.d3,.l2,.fk ./t c.h5 --distance geodesic -o x.h5
2 ~expected.one.of.geodesic,.l2,.fk ./t c.h5 --representation rotation-matrix --distance d1 -o x.h5
2 ~expected.one.of ./t c.h5 --distance d4 -o x.h5
2 ~expected.one.of ./t c.h5 --representation euler -o x.h5
0 true ./t c.h5 --steps 4 --representation rotation-matrix --constraint-weight 2 -o con.h5 && ./q 'm[0].json("config")["training"]["objective"]["orthogonality_weight"] == 2 and not same(m[0].weights(), m[1].weights())' con.h5 rep-rotation-matrix.h5
0 ~axis-angle.vectors.have.no.constraint train-vrnn c.h5 --batch 4 --window 6 --steps 2 --representation axis-angle --constraint-weight 2 -f -o con.h5

# what is read is not written over
2 ~is.the.archive.to.train.on ./t c.h5 --steps 2 -f -o c.h5
2 ~is.a.file.that.the.training.reads ./t c.h5 --steps 2 --val val.h5 -f -o val.h5
2 ~is.a.file.that.the.training.reads ./t c.h5 --steps 2 --classifier cl-action.h5 -f -o ./cl-action.h5

# ablations
0 true train-vrnn -q c.h5 --batch 4 --steps 4 --ablate single-layer --ablate uniform-joints --window 7 -o sl.h5 && ./q '[(c["network"]["word_length"], c["network"]["single_layer"], c["training"]["objective"]["uniform_joints"], c["training"]["windows"][0]["frames"]) for c in [m[0].json("config")]] == [(1, True, True, 7)] and not [n for n in m[0].weights() if n.startswith("word_encoder") or n.startswith("word_decoder")]' sl.h5
0 . sample -q -m sl.h5 -n 3 --frames 10 -f -o s.h5 && motion-info --check full s.h5 > info
2 ~uniform.joint.weights.with.distance.fk ./t c.h5 --steps 2 --ablate uniform-joints --distance fk -o x.h5
2 ~expected.one.of ./t c.h5 --ablate everything -o x.h5

# words that overlap: three frames in the preset small, none in the paper's and without words
0 true ./t c.h5 --steps 4 --overlap 0 -o apart.h5 && ./t c.h5 --steps 4 --preset paper -o paper.h5 && ./q '[x.json("config")["network"]["overlap"] for x in m] == [3, 0, 0, 0]' plain.h5 apart.h5 paper.h5 sl.h5
0 . sample -q -m apart.h5 -n 2 --frames 10 -f -o s.h5 && motion-info --check full s.h5 > info
2 ~--overlap.with.--ablate.single-layer ./t c.h5 --ablate single-layer --overlap 1 -o x.h5
2 ~whole.number ./t c.h5 --overlap 4 -o x.h5
2 ~--overlap.with.--arch.erd ./t c.h5 --arch erd --overlap 1 -o x.h5

# remedies for exposure bias
0 true ./t c.h5 --steps 8 --exposure none -o e-none.h5; for e in noise joint-dropout; do ./t c.h5 --steps 8 --exposure $e --exposure-ramp 0 0.1 -o e-$e.h5; done; ./t c.h5 --steps 8 --exposure-ramp 0 0.1 -o e-own.h5; ./q 'len({json.dumps([v.tolist() for v in x.weights().values()]) for x in m}) == 4 and [x.json("config")["training"]["exposure"] for x in m] == ["none", "noise", "joint-dropout", "own-output"]' e-none.h5 e-noise.h5 e-joint-dropout.h5 e-own.h5
0 true ./t c.h5 --steps 4 --exposure noise --noise-deviation 0.2 --exposure-ramp 0.2 0.3 -o n.h5 && ./q 'm[0].json("config")["training"]["noise"] == {"begin": 0.2, "end": 0.3, "from": 0, "to": 0.2}' n.h5
0 true ./t c.h5 --steps 4 --exposure joint-dropout --dropout-rate 0.5 -o n.h5 -f && ./q 'm[0].json("config")["training"]["joint_dropout"]["to"] == 0.5' n.h5
2 ~--noise-deviation.with.--exposure.own-output,.expected.--exposure.noise ./t c.h5 --noise-deviation 0.1 -o x.h5
2 ~--dropout-rate.with.--exposure.none ./t c.h5 --exposure none --dropout-rate 0.1 -o x.h5
2 ~--exposure-ramp.with.--exposure.none ./t c.h5 --exposure none --exposure-ramp 0 1 -o x.h5
2 ~--own-output-rate.with.--exposure.noise ./t c.h5 --exposure noise --own-output-rate 0.1 -o x.h5
2 ~expected.one.of ./t c.h5 --exposure prayer -o x.h5

# the classifiers' loss: in the weights, the log and the file; a judge that took part is refused, unless it was left out
0 true ./t c.h5 --steps 8 --classifier cl-action.h5 --classifier cl-gender.h5 --cl-ramp 0 0.5 --classifier-weight 0.5 -j 1 -o cl.h5 && ./q 'not same(m[0].weights(), m[1].weights()) and [c["attribute"] for c in m[0].json("config")["classifiers"]] == ["action", "gender"] and m[0].json("config")["training"]["classifier_weight"] == {"begin": 0, "end": 0.5, "from": 0, "to": 0.5} and [i["path"] for i in m[0].history()[-1]["inputs"]] == ["c.h5", "cl-action.h5", "cl-gender.h5"]' cl.h5 a.h5
0 ~classifiers.*classifier_weight head -1 cl.h5.log.tsv
0 . ./t c.h5 --steps 8 --classifier cl-action.h5 --classifier cl-gender.h5 --cl-ramp 0 0.5 --classifier-weight 0.5 -j 2 -o tmp/cl.h5 && cmp cl.h5 tmp/cl.h5
0 . sample -q -m cl.h5 -n 8 --frames 30 -f -o s.h5
3 ~cl-gender\.h5:.this.classifier.took.part.in.training.the.generator fid-eval s.h5 --real real.h5 --classifier cl-gender.h5
0 true ./t c.h5 --steps 8 --classifier cl-action.h5 --ablate no-classifier -o nc.h5 && ./t c.h5 --steps 8 -o eight.h5 && ./q 'same(m[0].weights(), m[1].weights()) and m[0].json("config")["classifiers"] == []' nc.h5 eight.h5
1 . sample -q -m nc.h5 -n 8 --frames 30 -f -o s.h5 && fid-eval s.h5 --real real.h5 --classifier cl-action.h5 2>&1 | grep took.part
2 ~was.trained.with.classifiers ./t c.h5 --steps 8 --classifier cl-gender.h5 --cl-ramp 0 0.5 --classifier-weight 0.5 --resume -o cl.h5
0 . ./t c.h5 --steps 4 --representation axis-angle --classifier cl-action.h5 --cl-ramp 0 0.1 -o claa.h5
3 ~cl-fast\.h5:.a.classifier.for.60.Hz,.expected.the.30.Hz ./t c.h5 --steps 2 --classifier cl-fast.h5 -o x.h5
3 ~cl-rig\.h5.*another.skeleton ./t c.h5 --steps 2 --classifier cl-rig.h5 -o x.h5
3 ~second.time ./t c.h5 --steps 2 --classifier cl-action.h5 --classifier cl-action.h5 -o x.h5
3 ~^train-vrnn:.a\.h5.*expected.a.classifier ./t c.h5 --steps 2 --classifier a.h5 -o x.h5
3 ~absent\.h5 ./t c.h5 --steps 2 --classifier absent.h5 -o x.h5
2 ~expected.--classifier.FILE ./t c.h5 --steps 2 --cl-ramp 0.1 0.2 -o x.h5
2 ~start.before.the.end ./t c.h5 --steps 2 --classifier cl-action.h5 --cl-ramp 0.5 0.1 -o x.h5

# stopped by each signal, killed, resumed: the same model and log as in one go
0 . ./long -o one-go.h5
75 . ./stop TERM ./long -o sig.h5
1 . test -e sig.h5
2 ~sig\.h5\.ckpt-.:.was.trained.with.training/seed.=.1,.this.command.says.2 ./long --resume --seed 2 -o sig.h5
2 ~was.trained.with.data ./t relabelled.h5 --steps 120 --resume -o sig.h5
4 ~a.checkpoint.of.an.earlier.training ./long -o sig.h5
75 . ./stop USR1 ./long --resume -j 1 -o sig.h5
75 . ./stop INT ./long --resume -o sig.h5
137 . ./stop KILL ./long --resume -o sig.h5
0 . rm -f sig.h5*.part-*; ls sig.h5.ckpt-1 sig.h5.ckpt-2 && for i in 1 2; do cp sig.h5.ckpt-$i dam.h5.ckpt-$i; head -c 9000 sig.h5.ckpt-$i > both.h5.ckpt-$i; done; printf 'XXXXXXXX' | dd of=dam.h5.ckpt-2 bs=1 seek=4000000 conv=notrunc status=none
0 . ./long --resume -j 1 -o sig.h5 && cmp sig.h5 one-go.h5 && cmp sig.h5.log.tsv one-go.h5.log.tsv
0 . test "$(ls -d sig.h5* | tr '\n' ' ')" = 'sig.h5 sig.h5.log.tsv '
0 ~warning:.dam\.h5\.ckpt-2 ./long --log-level warning --resume -o dam.h5
0 . cmp dam.h5 one-go.h5
3 ~both\.h5\.ckpt- ./long --resume -o both.h5
1 . test -e both.h5

# a finished output
0 . touch -d 2000-01-01 sig.h5 && ./long --resume -o sig.h5 && test -z "$(find sig.h5 -newermt 2001-01-01)"
2 ~was.trained.with ./long --resume --seed 2 -o sig.h5
2 ~was.trained.with ./t c.h5 --steps 7 --resume -o w.h5
0 . ./t c.h5 --steps 6 --resume --weights-only -o w.h5
3 ~bad\.h5 ./t c.h5 --steps 6 --resume -o bad.h5
4 ~a\.h5:.exists.already ./t c.h5 --steps 6 -o a.h5
4 ~exists.already ./t absent.h5 --steps 6 -o a.h5
0 . cmp a.h5 tmp/b.h5

# usage
2 ~no.input.given train-vrnn
2 ~no.output.given ./t c.h5
2 ~expected.one ./t c.h5 val.h5 -o x.h5
2 ~'-' ./t c.h5 --steps 2 -o -
2 ~expected.one.of ./t c.h5 --preset large -o x.h5
2 ~both.--steps.and.--epochs ./t c.h5 --steps 2 --epochs 2 -o x.h5
2 ~whole.number ./t c.h5 --steps 0 -o x.h5
2 ~shards ./t c.h5 --steps 2 --shards 5 -o x.h5
2 ~whole.number train-vrnn c.h5 --window 2 -o x.h5
2 ~frames.in.all train-vrnn c.h5 --steps 3 --batch 65536 --window 100000 -o x.h5
2 ~above.0 ./t c.h5 --steps 2 --learning-rate nan -o x.h5
2 ~above.0 ./t c.h5 --steps 2 --learning-rate 0 -o x.h5
2 ~start.before.the.end ./t c.h5 --steps 2 --kl-ramp 0.5 0.1 -o x.h5
2 ~--exposure-ramp ./t c.h5 --steps 2 --own-output 0.5 1.5 -o x.h5
2 ~pretraining ./t c.h5 --steps 1 -o x.h5
2 ~unknown.option ./t c.h5 --step 2 -o x.h5
2 ~cuda ./t c.h5 --steps 2 --device cuda -o x.h5

# bad input
3 ~^train-vrnn:.absent\.h5 ./t absent.h5 --steps 2 -o x.h5
3 ~^train-vrnn:.bad\.h5 ./t bad.h5 --steps 2 -o x.h5
3 ~^train-vrnn:.cut\.h5 ./t cut.h5 --steps 2 -o x.h5
3 ~^train-vrnn:.a\.h5 ./t a.h5 --steps 2 -o x.h5
3 ~^train-vrnn:.corpus ./t corpus/walking_f001_1.bvh --steps 2 -o x.h5
3 ~^train-vrnn:.<stdin> ./t - --steps 2 -o x.h5
3 ~unlabelled\.h5.*attribute ./t unlabelled.h5 --steps 2 -o x.h5
3 ~mood ./t c.h5 --attribute mood --steps 2 -o x.h5
3 ~60.*Hz ./t c.h5 --val fast.h5 --steps 2 -o x.h5
3 ~dancing ./t c.h5 --attribute action --val dancing.h5 --steps 2 -o x.h5
3 ~absent\.h5 ./t c.h5 --val absent.h5 --steps 2 -o x.h5
3 ~diverged.at.step.[0-9]+ ./t c.h5 --steps 20 --learning-rate 1e30 -o div.h5
1 . test -e x.h5 -o -e x.h5.log.tsv -o -e div.h5

# output
4 ~nowhere ./t c.h5 --steps 2 -o nowhere/x.h5
4 ~full ./t c.h5 --steps 2 -o /dev/full
4 ~folder ./t c.h5 --steps 2 -o folder
1 . test -n "$(find . -name '*.part-*')"

# a preset's share of word pretraining is kept however the length is given; the data is never its own output
0 true train-vrnn -q c.h5 --batch 4 --window 6 --epochs 5 -o share.h5 && ./q 'm[0].json("config")["training"]["steps"] == 10 and m[0].json("config")["training"]["pretraining"]["steps"] == 2' share.h5
2 ~is.the.archive.to.train.on cp c.h5 own.h5; train-vrnn own.h5 --steps 2 -f -o own.h5
0 . cmp c.h5 own.h5

# attributes that change within a clip: only these archives have other classes than the clip's own, and only these train differently
0 ~2.clips.change make-corpus -q --subjects 1 --seconds 4 --transitions 1 --action walking --action jogging -o tc && canonicalize -q tc --labels tc/labels.tsv -o tc.h5 && train-vrnn tc.h5 --batch 4 --window 90 --steps 2 -o tc-model.h5
0 true train-vrnn -q tc.h5 --batch 4 --window 90 --steps 6 -j 2 -o tc2.h5 && train-vrnn -q tc.h5 --batch 4 --window 90 --steps 6 -j 1 -o tc1.h5 && cmp tc1.h5 tc2.h5 && sed -E 's/^(transition[^\t]*\t)jogging/\1walking/' tc/labels.tsv > walks.tsv && canonicalize -q tc --labels walks.tsv -o walks.h5 && train-vrnn -q walks.h5 --batch 4 --window 90 --steps 6 -o walks-model.h5 && ./q 'not same(m[0].weights(), m[1].weights()) and m[0].json("config")["combinations"] == m[1].json("config")["combinations"]' tc1.h5 walks-model.h5

# clips without a label: left out, or filled from what a classifier found
0 . (head -1 corpus/labels.tsv; grep -v m001 corpus/labels.tsv | tail -n +2; grep m001 corpus/labels.tsv | sed 's/^\([^\t]*\t\)[a-z]*/\1/') > partly.tsv && canonicalize -q corpus --labels partly.tsv -o partly.h5 && train-classifier -q c.h5 --attribute action --epochs 2 -o action.h5 && classify -q partly.h5 -m action.h5 --min-probability 1 -o found.h5 > /dev/null
0 ~4.of.8.clips.are.left.out:.they.lack.a.label$ train-vrnn partly.h5 --batch 4 --window 6 --steps 2 --unlabelled fill -o partly-model.h5
0 ~4.of.8.clips.are.left.out.*--unlabelled.fill.would.use.4 train-vrnn found.h5 --batch 4 --window 6 --steps 2 --unlabelled drop -o dropped.h5
0 ~4.of.8.clips.lack.a.label:.each.draw.takes.one train-vrnn found.h5 --batch 4 --window 6 --steps 2 --unlabelled fill --val found.h5 -o filled.h5
0 true ./q 'not same(m[0].weights(), m[1].weights()) and same(m[1].weights(), m[2].weights()) and m[0].f["data/train_sources"].shape == (8,)' filled.h5 dropped.h5 partly-model.h5
2 ~expected.one.of ./t found.h5 --steps 2 --unlabelled guess -o x.h5

# the deterministic baselines: the same bytes for any thread count, samples, resume
# setup: printf '#!/bin/sh\nexec train-vrnn -q c.h5 --batch 4 --window 6 "$@"\n' > b; chmod +x b
0 . for a in quaternet erd; do ./b --arch $a --steps 6 -j 2 -o $a.h5 && ./b --arch $a --steps 6 -j 1 -o tmp/$a.h5 && cmp $a.h5 tmp/$a.h5 && cmp $a.h5.log.tsv tmp/$a.h5.log.tsv || exit 9; done
0 true ./q '[m[i].f.attrs["kind"] in (k, k.encode()) for i, k in enumerate(["quaternet", "erd"])] == [True, True] and [(t["own_output"]["to"], t["input_noise"]["ramp"]["to"], t["objective"]["velocity_weight"]) for t in [x.json("config")["training"] for x in m]] == [(1, 0, 0.7), (0.5, 0.2, 0.7)]' quaternet.h5 erd.h5
0 ~own_output.input_noise.validation_loss head -1 erd.h5.log.tsv
0 ~erd motion-info erd.h5
0 . motion-info --check full quaternet.h5
1 . ./b --arch erd --steps 6 --input-noise 0 0.5 0.4 -o noise.h5 && cmp -s erd.h5 noise.h5
0 true train-vrnn -q c.h5 --batch 4 --arch quaternet --val val.h5 --steps 2 --input-noise 0.25 0.5 0.125 --own-output 0.3 0.4 --own-output-rate 0.875 --learning-rate 0.002 --velocity-weight 0.25 --shards 3 --window 8 -o o.h5 && ./q '[(t["shards"], t["windows"], t["learning_rate"]["rate"], t["objective"]["velocity_weight"], t["own_output"], t["input_noise"]["ramp"]) for t in [m[0].json("config")["training"]]] == [(3, [{"begin": 0.0, "frames": 8}], 0.002, 0.25, {"begin": 0.3, "end": 0.4, "from": 0, "to": 0.875}, {"begin": 0.25, "end": 0.5, "from": 0, "to": 0.125})]' o.h5
0 true train-vrnn -q c.h5 --arch erd --preset paper --epochs 1 --batch 4 --window 6 --weights-only -o ep.h5 && ./q 'm[0].json("config")["network"]["hidden"] == 1000 and m[0].json("config")["training"]["steps"] == 2' ep.h5
0 ~quaternet:.8.clips.*parameters,.2.steps train-vrnn --arch quaternet --batch 4 --window 6 c.h5 --steps 2 -o said-q.h5
0 . for a in quaternet erd; do sample -q -m $a.h5 -n 8 --frames 20 -j 2 -o s-$a.h5 && sample -q -m $a.h5 -n 8 --frames 20 -j 1 -o - | cmp - s-$a.h5 && motion-info --check full s-$a.h5 || exit 9; done
3 ~^sample:.cut-erd\.h5 head -c 100000 erd.h5 > cut-erd.h5; sample -m cut-erd.h5 -o x.h5
2 ~not.trained.on.'dancing' sample -m erd.h5 --attr action=dancing -o x.h5
75 . rm -f sig.h5*; for a in quaternet erd; do ./b --arch $a --steps 120 -o one-$a.h5 || exit 9; done; ./stop TERM ./b --arch erd --steps 120 -o sig.h5 -f
0 . ./b --arch erd --steps 120 --resume -j 1 -o sig.h5 && cmp sig.h5 one-erd.h5 && cmp sig.h5.log.tsv one-erd.h5.log.tsv
2 ~was.trained.with.kind ./b --arch quaternet --steps 120 --resume -o sig.h5
75 . rm -f sig.h5*; ./stop KILL ./b --arch quaternet --steps 120 -o sig.h5; ./stop TERM ./b --arch quaternet --steps 120 -o sig.h5 --resume
0 . ./b --arch quaternet --steps 120 --resume -j 2 -o sig.h5 && cmp sig.h5 one-quaternet.h5 && cmp sig.h5.log.tsv one-quaternet.h5.log.tsv
3 ~diverged.at.step.[0-9]+ ./b --arch erd --steps 20 --learning-rate 1e30 -o div.h5
2 ~expected.one.of ./b --arch lstm --steps 2 -o x.h5
2 ~expected.quaternet.or.erd ./b --input-noise 0 1 0.1 --steps 2 -o x.h5
2 ~expected.--arch.motion-cell ./b --arch erd --ablate single-layer --steps 2 -o x.h5
2 ~expected.--own-output-rate ./b --arch erd --exposure noise --steps 2 -o x.h5
2 ~expected.quaternions ./b --arch erd --representation axis-angle --steps 2 -o x.h5
0 true ./b --arch quaternet --ablate uniform-joints --distance d2 --steps 2 -o uq.h5 && ./q '[(o["uniform_joints"], o["distance"]) for o in [m[0].json("config")["training"]["objective"]]] == [(True, "d2")]' uq.h5
2 ~no.latent.variable ./b --arch erd --kl-ramp 0 1 --steps 2 -o x.h5
2 ~no.latent.variable ./b --arch erd --pretrain-steps 1 --steps 2 -o x.h5
2 ~start.before.the.end ./b --arch erd --input-noise 0.5 0.1 0.1 --steps 2 -o x.h5
2 ~at.least.0|--input-noise ./b --arch erd --input-noise 0 1 -0.1 --steps 2 -o x.h5
2 ~frames.in.all train-vrnn c.h5 --arch erd --steps 3 --batch 65536 --window 100000 -o x.h5
