# STATUS EXPECTED COMMAND (see run.sh). What every tool shares is tried in bvh2npz.tst. t-SNE against NumPy: tests/metrics; the drawing: tests/draw.
# setup: for k in "t 4 1" "r 5 2" "g 5 3"; do set -- $k; make-corpus -q --subjects $2 --seconds 2 --transitions 0 --seed $3 -o $1; canonicalize -q $1 --labels $1/labels.tsv -o $1.h5; done
# setup: canonicalize -q g --labels g/labels.tsv --fps 60 -o fast.h5; canonicalize -q g --labels g/labels.tsv --body source -o rig.h5; canonicalize -q g -o plain.h5; sed 's/^file\taction/file\tkind/' g/labels.tsv > kind.tsv; canonicalize -q g --labels kind.tsv -o kind.h5; sed 's/^file\taction/file\tf3/' g/labels.tsv > f3.tsv; canonicalize -q g --labels f3.tsv -o f3.h5
# setup: motion-select -q g.h5 --attr action=walking --attr gender=female -o some.h5; motion-select -q some.h5 --name '*f001_1' --name '*f002_1' -o two.h5; head -c 9000 g.h5 > cut.h5
# setup: train-classifier -q t.h5 --attribute action --epochs 3 -o a.h5; train-classifier -q t.h5 --attribute gender --epochs 2 -o s.h5; train-classifier -q fast.h5 --attribute action --epochs 1 -o a60.h5
# setup: cat > make.py <<'END'
# setup: import h5py, json, hashlib, numpy as np
# setup: def change(out, body, source="g.h5"):
# setup:     open(out, "wb").write(open(source, "rb").read())
# setup:     with h5py.File(out, "r+") as f: body(f)
# setup: def sampled(f):  # as `sample` writes: made of no file
# setup:     f["clips/source_sha256"][5:] = b""
# setup: change("sampled.h5", sampled)
# setup: def nan(f): f["frames/root_position"][3] = float("nan")
# setup: change("nan.h5", nan)
# setup: def same(f):
# setup:     n, s = f["clips/length"][()], f["clips/start"][()]
# setup:     for k in range(1, len(n)):
# setup:         m = min(n[0], n[k]); f["frames/rotations"][s[k]:s[k] + m] = f["frames/rotations"][s[0]:s[0] + m]; f["frames/root_position"][s[k]:s[k] + m] = f["frames/root_position"][s[0]:s[0] + m]
# setup:     f["clips/length"][()] = n.min()
# setup: change("same.h5", same, "some.h5")
# setup: def tab(f): f["clips/name"][0] = b"a\tb"
# setup: change("tab.h5", tab)
# setup: END
# setup: /usr/bin/python3 make.py
# setup: cat > q.py <<'END'
# setup: import sys, re, zlib, struct, xml.etree.ElementTree as xml
# setup: def table(path):
# setup:     rows = [l.rstrip("\n").split("\t") for l in open(path)]
# setup:     assert all(len(r) == len(rows[0]) for r in rows)
# setup:     return rows[0], [dict(zip(rows[0], r)) for r in rows[1:]]
# setup: def svg(path):
# setup:     root = xml.parse(path).getroot()
# setup:     paths = [e.get("style") + e.get("d") for e in root.iter("{http://www.w3.org/2000/svg}path")]
# setup:     return {"strokes": sum("fill:none" in p for p in paths), "colours": len({re.search("stroke:(rgb[^;]*)", p).group(1) for p in paths if "fill:none" in p}), "width": root.get("width"), "history": root.find("{http://www.w3.org/2000/svg}metadata").text}
# setup: def png(path):
# setup:     b = open(path, "rb").read(); assert b[:8] == b"\x89PNG\r\n\x1a\n"
# setup:     return struct.unpack(">II", b[16:24])
# setup: print(eval(sys.argv[1]))
# setup: END
# setup: printf '#!/bin/sh\nexec /usr/bin/python3 q.py "$@"\n' > q; chmod +x q; echo True > true

0 ~^Usage:.embed.*INPUT embed --help
0 ~^LibTorch.[12]\. embed --version

# the map as a table, and its columns
0 . embed g.h5 --real r.h5 --classifier a.h5 --perplexity 10 -o map.tsv
0 true ./q '(lambda h, r: h == ["clip", "kind", "action", "gender", "subject", "x", "y"] or h)(*table("map.tsv"))'
0 true ./q '(lambda r: [x["kind"] for x in r] == ["real"] * 40 + ["generated"] * 40 and abs(sum(float(x["x"]) for x in r)) < 1e-9 and len({x["x"] for x in r}) == 80 and r[0]["action"] in r[0]["clip"])(table("map.tsv")[1])'
0 ~t-SNE.of.80.clips.with.32.features:.KL.divergence.0\.[0-9]+,.perplexity.10,.learning.rate.50 embed g.h5 --real r.h5 --classifier a.h5 --perplexity 10 -o said.tsv
0 . embed -q g.h5 --real r.h5 --classifier a.h5 --perplexity 10 | cmp - map.tsv
0 . embed -q g.h5 --real r.h5 --classifier a.h5 --perplexity 10 -j 1 -o - | cmp - map.tsv && embed -q g.h5 --real r.h5 --classifier a.h5 --perplexity 10 -j 3 | cmp - map.tsv
0 . cat g.h5 | embed -q - --real r.h5 --classifier a.h5 --perplexity 10 | cmp - map.tsv
0 . embed -q g.h5 --real - --classifier a.h5 --perplexity 10 < r.h5 | cmp - map.tsv
0 . embed -q g.h5 --real r.h5 --classifier - --perplexity 10 < a.h5 | cmp - map.tsv
0 . printf 'perplexity = 10\nreal = "r.h5"\nclassifier = "a.h5"\n' > c.toml; embed -q g.h5 --config c.toml | cmp - map.tsv
0 . embed -q g.h5 --real r.h5 --classifier a.h5 --perplexity 10 --format tsv -o map.txt && cmp map.txt map.tsv

# options of t-SNE each change the map; the seed only a random start
0 . m="embed -q g.h5 --real r.h5 --classifier a.h5 --perplexity 10"; $m --seed 2 | cmp - map.tsv && $m --init random > r1 && $m --init random --seed 2 > r2 && $m --init random -j 1 | cmp - r1 && ! cmp -s r1 r2 && ! cmp -s r1 map.tsv
0 . m="embed -q g.h5 --real r.h5 --classifier a.h5"; for o in "--perplexity 12" "--perplexity 10 --iterations 400" "--perplexity 10 --learning-rate 20" "--perplexity 10 --early-exaggeration 4"; do $m $o | cmp -s - map.tsv && exit 1; done; $m --perplexity 10 --method tsne --init pca --iterations 1000 --learning-rate 0 --early-exaggeration 12 | cmp - map.tsv

# principal axes
0 ~principal.axes.of.80.clips.with.32.features:.[0-9.]+.%.and.[0-9.]+.%.of.the.variance embed g.h5 --real r.h5 --classifier a.h5 --method pca -o pca.tsv
0 . embed -q g.h5 --classifier a.h5 --features-only -o g.tsv && embed -q g.h5 --classifier a.h5 --method pca -o gp.tsv && /usr/bin/python3 -c 'import numpy as np; x = np.array([[float(v) for v in l.split("\t")[4:]] for l in list(open("g.tsv"))[1:]]); y = np.array([[float(v) for v in l.split("\t")[-2:]] for l in list(open("gp.tsv"))[1:]]); u, s, v = np.linalg.svd(x - x.mean(0)); assert np.allclose(abs((x - x.mean(0)) @ v[:2].T), abs(y), atol=1e-9)'
0 . embed -q some.h5 --classifier a.h5 --method pca -o some.tsv

# features, as fid-eval reads them
0 true ./q '(lambda h, r: h == ["clip", "action", "gender", "subject"] + ["f%d" % k for k in range(32)] and len(r) == 40)(*table("g.tsv"))'
0 . embed -q r.h5 --classifier a.h5 --features-only -o r.tsv && fid-eval g.tsv --features --real r.tsv --json > /dev/null
0 true embed -q g.h5 --classifier a.h5 --classifier s.h5 --features-only -o both.tsv; ./q '(lambda h, r, one: len(h) == 4 + 64 and all(x["f%d" % k] == y["f%d" % k] for x, y in zip(r, one) for k in range(32)))(*table("both.tsv"), table("g.tsv")[1])'
0 . embed -q - --classifier a.h5 --features-only < g.h5 | cmp - g.tsv
0 true embed -q two.h5 --classifier a.h5 --features-only -o two.tsv; ./q '(lambda few, many: len(few) == 2 and all(x in many for x in few))(table("two.tsv")[1], table("g.tsv")[1])'
0 true embed -q tab.h5 --classifier a.h5 --features-only -o tab.tsv; ./q 'table("tab.tsv")[1][0]["clip"] == "a b"'
0 true embed -q plain.h5 --classifier a.h5 --features-only -o plain.tsv; ./q 'table("plain.tsv")[0][:2] == ["clip", "f0"]'

# kind: without --real, what was made of no file is generated
0 true embed -q sampled.h5 --classifier a.h5 --perplexity 5 -o kinds.tsv; ./q '[x["kind"] for x in table("kinds.tsv")[1]] == ["real"] * 5 + ["generated"] * 35'

# pictures: rings are one stroke, crosses two, and one of each in the legend; a colour a class, and the legend's own
0 true embed -q g.h5 --real r.h5 --classifier a.h5 --perplexity 10 --color-by action -o map.svg --table beside.tsv; ./q '(lambda s: s["strokes"] == 40 + 2 * 40 + 3 and s["colours"] == 5 and s["width"].startswith("900"))(svg("map.svg"))'
0 . cmp beside.tsv map.tsv
0 true ./q '"\"tool\":\"embed\"" in svg("map.svg")["history"].replace(" ", "") and "a.h5" in svg("map.svg")["history"] and "r.h5" in svg("map.svg")["history"] and "beside" not in svg("map.svg")["history"]'
0 true embed -q g.h5 --real r.h5 --classifier a.h5 --classifier s.h5 --method pca --color-by action --color-by gender -o ag.svg; ./q 'svg("ag.svg")["colours"] == 8 + 1' 
0 . embed -q g.h5 --real r.h5 --classifier a.h5 --perplexity 10 -o default.svg && embed -q g.h5 --real r.h5 --classifier a.h5 --perplexity 10 -j 1 -f -o other.svg && cmp other.svg default.svg && embed -q g.h5 --real r.h5 --classifier a.h5 --perplexity 10 --format svg -o - | sed 's/"--format=svg"/"--format=auto"/' | cmp - default.svg
0 true embed -q plain.h5 --classifier a.h5 --method pca -o plain.svg; ./q 'svg("plain.svg")["colours"] == 2'
0 true embed -q g.h5 --real r.h5 --classifier a.h5 --perplexity 10 -o map.png; ./q 'png("map.png") == (900, 630)'
0 true embed -q g.h5 --real r.h5 --classifier a.h5 --perplexity 10 --size 500 -o small.png; ./q 'png("small.png") == (500, 350)'
0 . for o in "--title Ours" "--mark 7"; do embed -q g.h5 --real r.h5 --classifier a.h5 --perplexity 10 $o -f -o other.png && cmp -s other.png map.png && exit 1; done; true
0 . embed -q g.h5 --real r.h5 --classifier a.h5 --perplexity 10 --format png -o map.picture && /usr/bin/python3 -c 'import re; b = lambda p: re.sub(rb"iTXt.*IEND", b"", open(p, "rb").read(), flags=re.S)[60:-8]; assert b("map.picture") == b("map.png")'

# told, not refused: a classifier's own training clips
0 ~a\.h5:.this.classifier.was.trained.on.32.of.the.72.clips embed t.h5 --real g.h5 --classifier a.h5 --method pca -o own.tsv

# what gives no map
3 ~g\.h5:.40.clips.with.a.perplexity.of.30,.expected.at.least.91.clips embed g.h5 --classifier a.h5
3 ~hint:.a.perplexity.of.at.most.13 embed g.h5 --classifier a.h5
3 ~2.clips,.expected.at.least.3 embed two.h5 --classifier a.h5
3 ~two\.h5:.2.clips,.expected.at.least.3 embed two.h5 --classifier a.h5 --method pca
3 ~all.5.clips.have.the.same.features embed same.h5 --classifier a.h5 --method pca
3 ~runs.away embed g.h5 --classifier a.h5 --perplexity 5 --learning-rate 1e200
3 ~fast\.h5:clip.*60.Hz,.expected.30.Hz.as.in.r\.h5 embed fast.h5 --real r.h5 --classifier a.h5
3 ~a60\.h5:.a.classifier.for.60.Hz,.expected.30.Hz.as.in.g\.h5 embed g.h5 --classifier a60.h5 --method pca
3 ~rig\.h5:clip.*another.skeleton,.expected.that.of.r\.h5 embed rig.h5 --real r.h5 --classifier a.h5
3 ~rig\.h5:clip.*another.skeleton embed rig.h5 --classifier a.h5
3 ~nan\.h5:clip.*finite embed nan.h5 --real r.h5 --classifier a.h5
3 ~kind\.h5:.an.attribute.'kind' embed kind.h5 --classifier a.h5 --method pca
3 ~f3\.h5:.an.attribute.'f3' embed f3.h5 --classifier a.h5 --features-only
0 . embed -q f3.h5 --classifier a.h5 --method pca -o f3-map.tsv

# usage
2 ~--color-by.style:.no.clip.has.this.attribute,.expected.one.of.action,.gender embed g.h5 --classifier a.h5 --color-by style
2 ~expected.clips.with.attributes embed plain.h5 --classifier a.h5 --color-by action
2 ~--classifier.is.required embed g.h5
2 ~no.input embed --classifier a.h5
2 ~standard.input.given.twice embed - --real - --classifier a.h5
2 ~expected.a.name.that.ends.in embed g.h5 --classifier a.h5 -o map.pdf
2 ~a.picture.without.-o embed g.h5 --classifier a.h5 --format svg
2 ~--features-only.writes.a.table embed g.h5 --classifier a.h5 --features-only -o f.png
2 ~--features-only.and.--real embed g.h5 --real r.h5 --classifier a.h5 --features-only
2 ~--features-only.and.--color-by embed g.h5 --classifier a.h5 --features-only --color-by action
2 ~--features-only.and.--table embed g.h5 --classifier a.h5 --features-only --table x.tsv
2 ~--table.beside.a.table embed g.h5 --classifier a.h5 --table x.tsv -o y.tsv
2 ~method embed g.h5 --classifier a.h5 --method umap
2 ~init embed g.h5 --classifier a.h5 --init zero
2 ~format embed g.h5 --classifier a.h5 --format pdf -o x.pdf
2 ~perplexity embed g.h5 --classifier a.h5 --perplexity 1
2 ~iterations embed g.h5 --classifier a.h5 --iterations 0
2 ~size embed g.h5 --classifier a.h5 --size 50000 -o x.png
2 ~cuda embed g.h5 --classifier a.h5 --device cuda

# files
3 ~^embed:.absent\.h5 embed absent.h5 --classifier a.h5
3 ~^embed:.absent\.h5 embed g.h5 --real absent.h5 --classifier a.h5
3 ~^embed:.absent\.h5 embed g.h5 --classifier absent.h5
3 ~^embed:.cut\.h5 embed cut.h5 --classifier a.h5
3 ~^embed:.g\.h5 embed g.h5 --classifier g.h5
4 ~exists.already embed g.h5 --classifier a.h5 --perplexity 5 -o map.tsv
4 ~exists.already embed g.h5 --classifier a.h5 --perplexity 5 -o new.svg --table map.tsv
4 ~nowhere embed g.h5 --classifier a.h5 --perplexity 5 -o new.svg --table nowhere/x.tsv
4 ~write.failed embed g.h5 --classifier a.h5 --perplexity 5 > /dev/full
0 . embed -q g.h5 --real r.h5 --classifier a.h5 --perplexity 10 -f -o map.tsv && cmp map.tsv map.txt
1 . test -e new.svg
