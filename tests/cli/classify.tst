# STATUS EXPECTED COMMAND (see run.sh). What every tool shares is tried in bvh2npz.tst.
# setup: make-corpus -q --subjects 2 --seconds 2 --transitions 0 -o corpus; canonicalize -q corpus --labels corpus/labels.tsv -o c.h5; canonicalize -q corpus --labels corpus/labels.tsv --fps 60 -o fast.h5
# setup: (head -1 corpus/labels.tsv; grep walking corpus/labels.tsv) > few.tsv; canonicalize -q corpus --labels few.tsv -o few.h5; sed 's/walking\t/dancing\t/' corpus/labels.tsv > dance.tsv; canonicalize -q corpus --labels dance.tsv -o dancing.h5
# setup: canonicalize -q corpus -o plain.h5; canonicalize -q corpus --labels corpus/labels.tsv --body source -o rig.h5; head -c 9000 c.h5 > cut.h5; echo nope > bad.h5
# setup: train-classifier -q c.h5 --attribute action -o m.h5; train-classifier -q c.h5 --attribute gender --epochs 2 -o g.h5
# setup: cat > q.py <<'END'
# setup: import sys, json, h5py, numpy as np
# setup: class A:
# setup:     def __init__(self, path): self.f = h5py.File(path)
# setup:     def labels(self, n="action"): return [x.decode() for x in self.f["clips/attributes/" + n][()]]
# setup:     def classes(self, n="action"): return [x.decode() for x in self.f["clips/attribute_classes/" + n][()]]
# setup:     def p(self, n="action"): return self.f["clips/attribute_probability/" + n][()]
# setup:     def best(self): return [self.classes()[k] for k in self.p().argmax(1)]
# setup:     def names(self): return [x.decode() for x in self.f["clips/name"][()]]
# setup:     def history(self): return [json.loads(l) for l in bytes(self.f["history"][()]).decode().splitlines()]
# setup: print(eval(sys.argv[1], {**globals(), "a": [A(p) for p in sys.argv[2:]]}))
# setup: END
# setup: printf '#!/bin/sh\nexec /usr/bin/python3 q.py "$@"\n' > q; chmod +x q; echo True > true
# setup: printf 'import h5py, sys\nf = h5py.File(sys.argv[1], "r+")\nexec(sys.argv[2])\n' > spoil.py

0 ~^Usage:.classify.*INPUT classify --help
0 ~^LibTorch.[12]\. classify --version

# accuracy on the very data: the report alone needs no output
0 ~^accuracy.*16.clips,.0.unlabelled classify c.h5 -m m.h5
0 ~^walking.*[0-9] classify c.h5 -m m.h5
0 . classify c.h5 -m m.h5 --json > r.json; /usr/bin/python3 -c 'import json; r = json.load(open("r.json")); assert r["attribute"] == "action" and r["accuracy"] > 0.9 and r["classes"] == ["jogging", "jumping", "lifting", "walking"] and sum(map(sum, r["confusion"])) == 16 and "labelled" not in r'
0 . classify c.h5 -m m.h5 -j 1 > j1 && classify c.h5 -m m.h5 -j 2 | cmp - j1
0 . classify - -m m.h5 < c.h5 | cmp - j1

# labels for what has none, probabilities for all
0 . classify -q few.h5 -m m.h5 -o out.h5
0 true ./q 'a[0].classes() == ["jogging", "jumping", "lifting", "walking"] and a[0].p().shape == (16, 4) and a[0].p().dtype == np.float32 and np.allclose(a[0].p().sum(1), 1)' out.h5
0 true ./q 'all(l == (m if m else b) for l, m, b in zip(a[0].labels(), a[1].labels(), a[0].best())) and "" not in a[0].labels() and a[1].labels().count("") == 12' out.h5 few.h5
0 true ./q '[e["tool"] for e in a[0].history()] == ["canonicalize", "classify"] and [i["path"] for i in a[0].history()[1]["inputs"]] == ["few.h5", "m.h5"]' out.h5
0 . motion-info --check full out.h5
0 ~12.of.16.clips.labelled classify few.h5 -m m.h5 -o said.h5
0 . classify -q few.h5 -m m.h5 -j 1 -o - > piped.h5 && cmp piped.h5 out.h5
0 true classify -q plain.h5 -m m.h5 -o plain-out.h5 > /dev/null && ./q 'a[0].labels() == a[0].best()' plain-out.h5
0 ~no.clip.has.a.class.*16.unlabelled classify plain.h5 -m m.h5
0 true classify -q few.h5 -m m.h5 --min-probability 1 -o doubt.h5 > /dev/null && ./q 'all(l for l, p in zip(a[0].labels(), a[0].p().max(1)) if p >= 1) and a[0].labels().count("") >= 1' doubt.h5
0 true classify -q dancing.h5 -m m.h5 --all -o all.h5 > /dev/null && ./q 'a[0].labels() == a[0].best() and "dancing" in a[1].labels()' all.h5 dancing.h5
0 ~does.not.know classify dancing.h5 -m m.h5
0 . classify dancing.h5 -m m.h5 --json > d.json; /usr/bin/python3 -c 'import json; r = json.load(open("d.json")); assert r["clips"] == 12 and len(r["unknown"]) == 4'
0 true classify -q out.h5 -m g.h5 -o both.h5 > /dev/null && ./q 'sorted(a[0].f["clips/attribute_probability"]) == ["action", "gender"] and (a[0].p() == a[1].p()).all()' both.h5 out.h5
0 true classify -q c.h5 --config <(printf 'model = "m.h5"\n') -o conf.h5 > /dev/null && ./q 'a[0].p().shape == (16, 4)' conf.h5

# they stay with their clips where these are chosen, split and merged
0 true motion-select -q out.h5 --name 'jogging*' --time 0.5:1 -o sel.h5 && ./q 'all((a[0].p()[i] == a[1].p()[a[1].names().index(n)]).all() for i, n in enumerate(a[0].names())) and len(a[0].names()) == 4' sel.h5 out.h5
0 true motion-split -q out.h5 --ratios 2,1,1 -o split && ./q 'sum(len(x.names()) for x in a[:3]) == 16 and all((x.p()[i] == a[3].p()[a[3].names().index(n)]).all() for x in a[:3] for i, n in enumerate(x.names()))' split/train.h5 split/val.h5 split/test.h5 out.h5
0 true motion-merge -q split/train.h5 split/val.h5 split/test.h5 -o merged.h5 && ./q 'all((a[0].p()[i] == a[1].p()[a[1].names().index(n)]).all() for i, n in enumerate(a[0].names())) and len(a[0].names()) == 16' merged.h5 out.h5

# usage
2 ~--model.is.required classify c.h5
2 ~no.input.given classify -m m.h5
2 ~--all.without.-o classify c.h5 -m m.h5 --all
2 ~both.would.go.to.standard.output classify c.h5 -m m.h5 --json -o -
2 ~-m.-.and.the.input.- classify - -m - < c.h5
2 ~number classify c.h5 -m m.h5 --min-probability 2
2 ~unknown.option classify c.h5 -m m.h5 --labels x
2 ~cuda classify c.h5 -m m.h5 --device cuda

# bad input
3 ~^classify:.absent\.h5 classify absent.h5 -m m.h5
3 ~^classify:.absent\.h5 classify c.h5 -m absent.h5
3 ~^classify:.cut\.h5 classify cut.h5 -m m.h5
3 ~^classify:.bad\.h5 classify c.h5 -m bad.h5
3 ~^classify:.c\.h5 classify c.h5 -m c.h5
3 ~fast\.h5:clip.*60.Hz,.expected.the.30.Hz classify fast.h5 -m m.h5
3 ~rig\.h5:clip.*another.skeleton classify rig.h5 -m m.h5
3 ~finite cp c.h5 nan.h5; /usr/bin/python3 spoil.py nan.h5 'f["frames/root_position"][3] = float("nan")'; classify nan.h5 -m m.h5
3 ~clips/attribute_probability/action:.missing cp out.h5 miss.h5; /usr/bin/python3 spoil.py miss.h5 'del f["clips/attribute_probability/action"]'; classify miss.h5 -m m.h5
3 ~clips/attribute_probability/action classify -q -m m.h5 <(cp out.h5 shape.h5; /usr/bin/python3 spoil.py shape.h5 'del f["clips/attribute_probability/action"]; f["clips/attribute_probability/action"] = [[1.0]]'; cat shape.h5)
3 ~expected.a.number.in.0\.\.1 cp out.h5 range.h5; /usr/bin/python3 spoil.py range.h5 'f["clips/attribute_probability/action"][2, 1] = 2'; classify range.h5 -m m.h5
3 ~columns.of.clips/attribute_probability/action cp out.h5 twice.h5; /usr/bin/python3 spoil.py twice.h5 'f["clips/attribute_classes/action"][1] = f["clips/attribute_classes/action"][0]'; classify twice.h5 -m m.h5

# output
4 ~exists.already classify few.h5 -m m.h5 -o out.h5
4 ~write.failed classify c.h5 -m m.h5 > /dev/full
0 . classify -q few.h5 -m m.h5 -f -o out.h5 && cmp piped.h5 out.h5
1 . test -n "$(find . -name '*.part-*')"
