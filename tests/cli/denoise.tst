# STATUS EXPECTED COMMAND (see run.sh). What every tool shares is tried in bvh2npz.tst; what is denoised in tests/denoiser.
# setup: make-corpus -q --subjects 1 --seconds 3 --noise -o corpus; canonicalize -q corpus/noisy --labels corpus/noisy/labels.tsv -o n.h5; canonicalize -q corpus/clean --labels corpus/clean/labels.tsv -o c.h5
# setup: canonicalize -q corpus/noisy --fps 60 -o fast.h5; canonicalize -q corpus/noisy --body source -o rig.h5; head -c 9000 n.h5 > cut.h5; echo nope > bad.h5
# setup: train-denoiser -q c.h5 --noisy n.h5 --window 24 --batch 16 --learning-rate 0.001 --epochs 12 -o m.h5; train-classifier -q c.h5 --attribute gender --epochs 1 -o g.h5; classify -q n.h5 -m g.h5 --all -o judged.h5 > c.txt
# setup: motion-select -q n.h5 --head 2 --time 0:1.4 -o two.h5; motion-select -q n.h5 --head 1 --time 0:0 -o frame.h5; train-lstm -q c.h5 --steps 6 --batch 4 --window 8 --weights-only -o l.h5
# setup: train-refiner -q c.h5 --generator l.h5 --samples 4 --sample-frames 12 --batch 4 --buffer 4 --window 8 --steps 2 --weights-only -o f.h5; motion-select -q c.h5 --head 1 -o part.h5; train-lstm -q part.h5 --steps 1 --batch 4 --window 8 --weights-only -o lp.h5
# setup: train-lstm -q fast.h5 --steps 1 --batch 4 --window 8 --weights-only -o l60.h5; printf '#!/bin/sh\nexec denoise --method map -m l.h5 --iterations 3 --rereads 2 "$@"\n' > dm; chmod +x dm
# setup: cat > q.py <<'END'
# setup: import sys, csv, json, h5py, numpy as np
# setup: class A:
# setup:     def __init__(self, path): self.f = h5py.File(path)
# setup:     def __getitem__(self, n): return self.f[n][()]
# setup:     def history(self): return [json.loads(l) for l in bytes(self["history"]).decode().splitlines()]
# setup: def same(a, b, *names): return all(np.array_equal(a[n], b[n]) for n in names)
# setup: def rows(path): return list(csv.DictReader(open(path), delimiter="\t"))
# setup: print(eval(sys.argv[1], {**globals(), "a": [A(p) for p in sys.argv[2:]]}))
# setup: END
# setup: printf '#!/bin/sh\nexec /usr/bin/python3 q.py "$@"\n' > q; chmod +x q; echo True > true
# setup: printf 'import h5py, sys\nf = h5py.File(sys.argv[1], "r+")\nexec(sys.argv[2])\n' > spoil.py

0 ~^Usage:.denoise.*INPUT denoise --help
0 ~^LibTorch.[12]\. denoise --version

# rotations and positions alone change, and are normalised; equal bytes for any thread count and through pipes
0 . denoise -q n.h5 -m m.h5 -j 2 --report r.tsv -o d.h5
0 true ./q 'same(a[0], a[1], "clips/name", "clips/length", "clips/source", "clips/source_sha256", "clips/attributes/action", "skeleton/rest_offsets") and not same(a[0], a[1], "frames/contacts") and not same(a[0], a[1], "frames/rotations") and abs(np.linalg.norm(a[0]["frames/rotations"], axis=2) - 1).max() < 1e-6' d.h5 n.h5
0 true ./q '[e["tool"] for e in a[0].history()] == ["canonicalize", "denoise"] and [i["path"] for i in a[0].history()[1]["inputs"]] == ["n.h5", "m.h5"] and not [x for x in a[0].history()[1]["argv"] if "report" in x]' d.h5
0 . motion-info --check full d.h5
0 . denoise -q n.h5 -m m.h5 -j 1 -o j1.h5 && cmp j1.h5 d.h5
0 true cat n.h5 | denoise -q - -m m.h5 -o - | denoise -q - -m m.h5 -o - > twice.h5 && ./q 'same(a[0], a[1], "clips/name") and [e["tool"] for e in a[0].history()] == ["canonicalize", "denoise", "denoise"]' twice.h5 n.h5
0 true cat m.h5 | denoise -q n.h5 -m - -o pm.h5 && ./q 'same(a[0], a[1], "frames/rotations", "frames/root_position")' pm.h5 d.h5
0 true denoise -q judged.h5 -m m.h5 -o dj.h5 && ./q 'same(a[0], a[1], "clips/attribute_probability/gender", "clips/attribute_classes/gender")' dj.h5 judged.h5

# contacts of a preset are found anew, as canonicalize would in the denoised motion; those of no preset stay
0 true motion-export -q d.h5 -o bvh && canonicalize -q bvh -o again.h5 && ./q '(a[0]["frames/contacts"] == a[1]["frames/contacts"]).mean() > 0.98' d.h5 again.h5
0 true cp n.h5 own.h5; /usr/bin/python3 spoil.py own.h5 'f.attrs.create("contacts", b"model", dtype="S5")'; denoise -q own.h5 -m m.h5 -o do.h5 && ./q 'same(a[0], a[1], "frames/contacts")' do.h5 n.h5

# smoother than before (nearer to the truth: tests/denoiser)
0 true ./q '(lambda j: j(a[0]) < 0.5 * j(a[1]))(lambda x: np.square(np.diff(x["frames/root_position"][:int(x["clips/length"][0])], 3, axis=0)).sum())' d.h5 n.h5

# the report
0 true ./q 'list(rows("r.tsv")[0]) == ["clip", "joint", "mean_deg", "worst_deg", "worst_deg_frame", "mean_mm", "worst_mm", "worst_mm_frame", "peak_speed_mps", "peak_speed_kept_percent"] and len(rows("r.tsv")) == 22 * len(a[0]["clips/name"])' n.h5
0 true ./q 'all(0 <= float(x["mean_deg"]) <= float(x["worst_deg"]) and 0 <= float(x["mean_mm"]) <= float(x["worst_mm"]) and 10 < float(x["peak_speed_kept_percent"]) < 200 and 0 <= int(x["worst_mm_frame"]) < 400 for x in rows("r.tsv"))'
0 true ./q 'abs(float(rows("r.tsv")[5]["worst_deg"]) - np.degrees(2 * np.arccos(np.clip(abs((a[0]["frames/rotations"][:a[0]["clips/length"][0], 5] * a[1]["frames/rotations"][:a[0]["clips/length"][0], 5]).sum(1)), 0, 1))).max()) < 0.1' d.h5 n.h5

# usage
2 ~--model.is.required denoise n.h5 -o x.h5
2 ~no.output.given denoise n.h5 -m m.h5
2 ~no.input.given denoise -m m.h5 -o x.h5
2 ~-m.-.and.the.input.- denoise - -m - -o x.h5 < n.h5
2 ~--report.-: denoise n.h5 -m m.h5 --report - -o x.h5
2 ~--report.\./x.h5.is.another.file denoise n.h5 -m m.h5 --report ./x.h5 -o x.h5
2 ~--report.n.h5.is.another.file denoise n.h5 -m m.h5 -f --report n.h5 -o x.h5
2 ~cuda denoise n.h5 -m m.h5 --device cuda -o x.h5

# bad input
3 ~^denoise:.absent\.h5 denoise absent.h5 -m m.h5 -o x.h5
3 ~^denoise:.absent\.h5 denoise n.h5 -m absent.h5 -o x.h5
3 ~^denoise:.cut\.h5 denoise cut.h5 -m m.h5 -o x.h5
3 ~^denoise:.bad\.h5 denoise n.h5 -m bad.h5 -o x.h5
3 ~kind.'classifier',.expected.a.denoiser denoise n.h5 -m g.h5 -o x.h5
3 ~fast\.h5:clip.*60.Hz,.expected.the.30.Hz denoise fast.h5 -m m.h5 -o x.h5
3 ~rig\.h5:clip.*another.skeleton denoise rig.h5 -m m.h5 -o x.h5
3 ~finite cp n.h5 nan.h5; /usr/bin/python3 spoil.py nan.h5 'f["frames/root_position"][3] = float("nan")'; denoise nan.h5 -m m.h5 -o x.h5
1 . test -e x.h5

# output
4 ~exists.already denoise n.h5 -m m.h5 -o d.h5
4 ~exists.already denoise n.h5 -m m.h5 --report r.tsv -o y.h5
0 . denoise -q n.h5 -m m.h5 -f --report r.tsv -o d.h5 && cmp d.h5 j1.h5
4 ~nowhere denoise n.h5 -m m.h5 -o nowhere/x.h5
1 . test -n "$(find . -name '*.part-*')"

# --method map: everything but motion and contacts stays; contacts are the model's; equal bytes for any thread count and through pipes
0 . denoise -q two.h5 --method dae -m m.h5 -j 1 -o dae.h5 && denoise -q two.h5 -m m.h5 -j 1 -o dae2.h5 && ./q 'same(a[0], a[1], "frames/rotations")' dae.h5 dae2.h5
0 ~10.windows;.L-BFGS.lowered.the.objective.in.100.0.% denoise two.h5 --method map -m l.h5 --iterations 3 --rereads 2 --window 10 --overlap 2 --report mr.tsv --outliers mo.tsv -j 1 -o map.h5
0 true ./q 'same(a[0], a[1], "clips/name", "clips/length", "clips/source", "clips/attributes/action", "skeleton/rest_offsets") and not same(a[0], a[1], "frames/rotations") and not same(a[0], a[1], "frames/root_position") and a[0].f.attrs["contacts"] == b"model" and abs(np.linalg.norm(a[0]["frames/rotations"], axis=2) - 1).max() < 1e-6' map.h5 two.h5
0 true ./q '(lambda e: e["tool"] == "denoise" and [i["path"] for i in e["inputs"]] == ["two.h5", "l.h5"] and not [x for x in e["argv"] if "report" in x or "outliers" in x])(a[0].history()[-1])' map.h5
0 . motion-info --check full map.h5
0 . ./dm -q two.h5 -j 1 -o j1.h5 -f && ./dm -q two.h5 -j 2 -o j2.h5 && cmp j1.h5 j2.h5
0 true cat two.h5 | ./dm -q - -o - > pipe.h5; ./q 'same(a[0], a[1], "frames/rotations", "frames/contacts")' pipe.h5 j1.h5
0 true cat l.h5 | denoise -q two.h5 --method map -m - --iterations 3 --rereads 2 -o pipe2.h5; ./q 'same(a[0], a[1], "frames/rotations")' pipe2.h5 j1.h5
0 true ./q 'list(rows("mr.tsv")[0]) == list(rows("r.tsv")[0]) and len(rows("mr.tsv")) == 44 and open("mo.tsv").readline().split() == ["clip", "joint", "first_frame", "last_frame", "kind", "largest", "unit"]'
# a spike is found, listed and put right; heading and path stay
0 . cp two.h5 spike.h5; /usr/bin/python3 spoil.py spike.h5 'f["frames/root_position"][20] = f["frames/root_position"][20] + [0, 0.4, 0]' && ./dm -q spike.h5 --outliers so.tsv -o unspiked.h5
0 true ./q '[(x["joint"], x["first_frame"], x["last_frame"], x["kind"], x["unit"]) for x in rows("so.tsv") if x["joint"] == "position" and float(x["largest"]) > 200] == [("position", "20", "20", "spike", "mm")]'
0 true ./q 'abs(a[0]["frames/root_position"][20] - a[1]["frames/root_position"][20]).max() < 0.1 and abs(a[0]["frames/root_position"] - a[1]["frames/root_position"]).max() < 0.15' unspiked.h5 two.h5
# every option
0 . denoise -q two.h5 --method map -m l.h5 --refiner f.h5 --sigma-root 0.005 --sigma-angle 0.02 --outlier-sigmas 6 --window 12 --overlap 6 --iterations 2 --rereads 1 --noise-sigma 0.02 --contact-sigma 0.05 --height-sigma 0.1 -o all.h5
0 true ./q '[i["path"] for i in a[0].history()[-1]["inputs"]] == ["two.h5", "l.h5", "f.h5"] and not same(a[0], a[1], "frames/rotations")' all.h5 j1.h5
0 true ./dm -q two.h5 --sigma-root 0.0005 --sigma-angle 0.002 -o near.h5; ./q '(lambda far: far(a[0]) < far(a[1]))(lambda x: abs(x["frames/root_position"] - a[2]["frames/root_position"]).mean())' near.h5 j1.h5 two.h5
# refusals
2 ~sigma.*an.option.of.--method.map denoise two.h5 -m m.h5 --sigma-angle 0.1 -o x.h5
2 ~--refiner:.an.option.of.--method.map denoise two.h5 -m m.h5 --refiner f.h5 -o x.h5
2 ~--outliers:.an.option.of.--method.map denoise two.h5 -m m.h5 --outliers o.tsv -o x.h5
2 ~--window:.an.option.of.--method.map denoise two.h5 -m m.h5 --window 10 -o x.h5
2 ~dae.*map denoise two.h5 --method wiener -m m.h5 -o x.h5
2 ~overlap.of.34 ./dm two.h5 --overlap 34 -o x.h5
2 ~sigma-root ./dm two.h5 --sigma-root 0 -o x.h5
2 ~particles ./dm two.h5 --particles 4 -o x.h5
2 ~--outliers.-: ./dm two.h5 --outliers - -o x.h5
2 ~--outliers.o.tsv.is.another.file ./dm two.h5 --report o.tsv --outliers o.tsv -o x.h5
2 ~-m.-.and.--refiner.- denoise two.h5 --method map -m - --refiner - -o x.h5
2 ~--refiner.-.and.the.input ./dm - --refiner - -o x.h5 < two.h5
4 ~exists.already ./dm two.h5 --outliers mo.tsv -o x.h5
3 ~kind.'denoiser',.expected.lstm-gmm denoise two.h5 --method map -m m.h5 -o x.h5
3 ~hint:.-m.of.--method.dae.comes.from.train-denoiser,.of.--method.map.from.train-lstm denoise two.h5 -m l.h5 -o x.h5
3 ~expected.a.denoiser denoise two.h5 -m l.h5 -o x.h5
3 ~l\.h5:.*kind.'lstm-gmm',.expected ./dm two.h5 --refiner l.h5 -o x.h5
3 ~absent\.h5 ./dm two.h5 --refiner absent.h5 -o x.h5
# a refiner that is standardised by other data than the generator
0 . denoise -q two.h5 --method map -m lp.h5 --refiner f.h5 -o units.h5
3 ~two\.h5:clip.*30.Hz,.expected.the.model's.60.Hz denoise two.h5 --method map -m l60.h5 -o x.h5
3 ~fast\.h5:clip.*60.Hz,.expected.the.model's.30.Hz ./dm fast.h5 -o x.h5
3 ~rig\.h5:clip.*another.skeleton ./dm rig.h5 -o x.h5
0 ~1.of.1.clips.have.one.frame denoise --log-level warning --method map -m l.h5 --window 8 --overlap 4 --iterations 2 frame.h5 -o single.h5
0 true ./q 'same(a[0], a[1], "frames/rotations", "frames/root_position")' single.h5 frame.h5
3 ~nan\.h5:clip.*finite ./dm nan.h5 -o x.h5
1 . test -e x.h5
