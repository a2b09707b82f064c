# STATUS EXPECTED COMMAND (see run.sh). What every tool shares is tried in bvh2npz.tst; what is denoised in tests/denoiser.
# setup: make-corpus -q --subjects 1 --seconds 3 --noise -o corpus; canonicalize -q corpus/noisy --labels corpus/noisy/labels.tsv -o n.h5; canonicalize -q corpus/clean --labels corpus/clean/labels.tsv -o c.h5
# setup: canonicalize -q corpus/noisy --fps 60 -o fast.h5; canonicalize -q corpus/noisy --body source -o rig.h5; head -c 9000 n.h5 > cut.h5; echo nope > bad.h5
# setup: train-denoiser -q c.h5 --noisy n.h5 --window 24 --batch 16 --learning-rate 0.001 --epochs 12 -o m.h5; train-classifier -q c.h5 --attribute gender --epochs 1 -o g.h5; classify -q n.h5 -m g.h5 --all -o judged.h5 > c.txt
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
