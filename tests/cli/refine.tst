# STATUS EXPECTED COMMAND (see run.sh). What every tool shares is tried in bvh2npz.tst; what is computed in tests/refiner and tests/clip.
# setup: make-corpus -q --subjects 1 --seconds 3 --transitions 0 --action walking -o corpus; canonicalize -q corpus --labels corpus/labels.tsv -o c.h5; canonicalize -q corpus --fps 60 -o fast.h5; canonicalize -q corpus --body source -o rig.h5
# setup: train-lstm -q c.h5 --steps 4 --batch 4 --window 8 --weights-only -o g.h5; train-refiner -q c.h5 --generator g.h5 --samples 8 --sample-frames 20 --batch 4 --buffer 8 --window 8 --steps 4 -o r.h5; sample -q -m g.h5 -n 3 --frames 40 -o s.h5
# setup: /usr/bin/python3 -c 'import h5py; f = h5py.File("c.h5", "r"); g = h5py.File("bare.h5", "w", libver="latest"); [f.copy(k, g) for k in f]; [g.attrs.__setitem__(k, v) for k, v in f.attrs.items() if k != "contacts"]; del g["frames/contacts"]'
# setup: motion-select -q c.h5 --time 0:0 -o frame.h5; motion-export -q c.h5 -o bvh; cp bvh/*walk*f001*.bvh w.bvh 2>/dev/null || cp $(ls bvh/*.bvh | head -1) w.bvh; head -c 9000 c.h5 > cut.h5; echo nope > bad.h5; mkdir folder
# setup: cat > q.py <<'END'
# setup: import sys, json, h5py, numpy as np
# setup: class A:
# setup:     def __init__(self, path): self.f = h5py.File(path)
# setup:     def __getitem__(self, n): return self.f[n][()]
# setup:     def history(self): return [json.loads(l) for l in bytes(self["history"]).decode().splitlines()]
# setup: def text(v): return v.decode() if isinstance(v, bytes) else v
# setup: def same(a, b, *names): return all(np.array_equal(a[n], b[n]) for n in names)
# setup: print(eval(sys.argv[1], {**globals(), "a": [A(p) for p in sys.argv[2:]]}))
# setup: END
# setup: printf '#!/bin/sh\nexec /usr/bin/python3 q.py "$@"\n' > q; chmod +x q; echo True > true

0 ~^Usage:.refine.*INPUT refine --help
0 ~^LibTorch.[12]\. refine --version

# refined: names, lengths and attributes stay, contacts are the model's; equal bytes for any thread count and through pipes
0 . refine -q -m r.h5 c.h5 -j 2 -o o.h5 && refine -q -m r.h5 c.h5 -j 1 -o o1.h5 && cmp o.h5 o1.h5
0 true ./q 'same(a[0], a[1], "clips/name", "clips/length", "clips/source", "clips/attributes/action", "skeleton/rest_offsets") and not same(a[0], a[1], "frames/rotations") and text(a[0].f.attrs["contacts"]) == "model" and [e["tool"] for e in a[0].history()] == ["canonicalize", "refine"] and [i["path"] for i in a[0].history()[1]["inputs"]] == ["c.h5", "r.h5"]' o.h5 c.h5
0 . motion-info --check full o.h5
0 true cat c.h5 | refine -q -m r.h5 - -o - > p.h5 && ./q 'same(a[0], a[1], "frames/rotations", "frames/root_position", "frames/contacts")' p.h5 o.h5
0 true cat r.h5 | refine -q -m - c.h5 -o pm.h5 && ./q 'same(a[0], a[1], "frames/rotations")' pm.h5 o.h5
0 true sample -q -m g.h5 -n 3 --frames 40 -o - | refine -q -m r.h5 - -o - | motion-select -q - --head 2 -o chain.h5 && ./q 'len(a[0]["clips/name"]) == 2 and list(a[0]["clips/length"]) == [40, 40]' chain.h5

# pinned: feet that are down keep their place, and nothing but legs and root height changes
0 . refine -q --pin-feet s.h5 -j 2 -o pinned.h5 && refine -q --pin-feet s.h5 -j 1 -o pinned1.h5 && cmp pinned.h5 pinned1.h5
0 true ./q 'same(a[0], a[1], "frames/contacts", "clips/name") and np.array_equal(a[0]["frames/root_position"][:, :2], a[1]["frames/root_position"][:, :2]) and np.array_equal(a[0]["frames/rotations"][:, 9:], a[1]["frames/rotations"][:, 9:]) and not same(a[0], a[1], "frames/rotations") and text(a[0].f.attrs["contacts"]) == "model"' pinned.h5 s.h5
0 ~times.a.foot.is.down refine --pin-feet c.h5 -o said.h5
0 true refine -q -m r.h5 --pin-feet c.h5 -o both.h5 && refine -q --pin-feet o.h5 -o after.h5 && ./q 'np.abs(a[0]["frames/rotations"] - a[1]["frames/rotations"]).max() < 1e-5' both.h5 after.h5
0 true refine -q --pin-feet w.bvh -o w.h5 && ./q 'text(a[0].f.attrs["contacts"]) == "preset:default" and len(a[0]["clips/name"]) == 1 and [e["tool"] for e in a[0].history()] == ["refine"]' w.h5
0 true refine -q --pin-feet c.h5 --blend-seconds 0.1 --most-root 0.02 -o o2.h5 && refine -q --pin-feet c.h5 -o o3.h5 && ./q 'not same(a[0], a[1], "frames/rotations")' o2.h5 o3.h5
0 true refine -q --pin-feet rig.h5 -o rigged.h5 && ./q 'same(a[0], a[1], "skeleton/rest_offsets")' rigged.h5 rig.h5
0 . refine --pin-feet w.bvh -o - | motion-export -q - -o out && ls out/*.bvh

# contacts
0 true train-refiner -q c.h5 --generator g.h5 --samples 8 --sample-frames 20 --batch 4 --buffer 8 --window 8 --steps 2 --no-contacts -o blind.h5 && refine -q -m blind.h5 c.h5 -o ob2.h5 && ./q 'same(a[0], a[1], "frames/contacts") and text(a[0].f.attrs["contacts"]) == "preset:default"' ob2.h5 c.h5
0 ~2.clips.without.contacts.were.labelled.by.the.rule.default refine -m r.h5 bare.h5 -o ob.h5
0 true ./q 'same(a[0], a[1], "frames/rotations")' ob.h5 o.h5
0 true refine -q --pin-feet --contacts holden c.h5 -o holden.h5 && ./q 'text(a[0].f.attrs["contacts"]) == "preset:holden" and not same(a[0], a[1], "frames/contacts")' holden.h5 c.h5
0 . refine -q -m r.h5 frame.h5 -o of.h5 && motion-info --check full of.h5
0 . refine -q --pin-feet frame.h5 -o pf.h5 && motion-info --check full pf.h5

# reading motion files
0 . refine -q --pin-feet w.bvh --unit m --up z --first-frame keep --lenient --device cpu -f -o w.h5
0 true printf 'pattern\trate\nw.bvh\t15\n' > rates.tsv; refine -q --pin-feet w.bvh --fps-override rates.tsv -o rated.h5 && ./q 'a[0].f.attrs["frame_rate_hz"] == 15' rated.h5
0 true refine -q --pin-feet $DATA/asf/human.amc --asf $DATA/asf/human.asf -o amc.h5 && ./q '[i["path"] for i in a[0].history()[-1]["inputs"]] == ["human.amc", "human.asf"]' amc.h5

# usage
2 ~neither.-m.nor.--pin-feet refine c.h5 -o x.h5
2 ~no.input.given refine -m r.h5 -o x.h5
2 ~no.output.given refine -m r.h5 c.h5
2 ~-m.-.and.the.input.- refine -m - - -o x.h5 < c.h5
2 ~expected.one.of refine --pin-feet --contacts guess c.h5 -o x.h5
2 ~--blend-seconds refine --pin-feet --blend-seconds 11 c.h5 -o x.h5
2 ~requires.--pin-feet refine -m r.h5 --blend-seconds 1 c.h5 -o x.h5

# bad input
3 ~^refine:.absent\.h5 refine -m absent.h5 c.h5 -o x.h5
3 ~^refine:.absent\.h5 refine -m r.h5 absent.h5 -o x.h5
3 ~^refine:.bad\.h5 refine -m r.h5 bad.h5 -o x.h5
3 ~^refine:.cut\.h5 refine -m r.h5 cut.h5 -o x.h5
3 ~kind.'lstm-gmm',.expected.refiner refine -m g.h5 c.h5 -o x.h5
3 ~^refine:.fast\.h5.*60.Hz,.expected.the.refiner's.30.Hz refine -m r.h5 fast.h5 -o x.h5
3 ~^refine:.rig\.h5.*another.skeleton refine -m r.h5 rig.h5 -o x.h5
1 . test -e x.h5

# output
4 ~c\.h5:.exists.already refine --pin-feet c.h5 -o c.h5
4 ~nowhere refine --pin-feet c.h5 -o nowhere/x.h5
4 ~folder refine --pin-feet c.h5 -o folder
1 . test -n "$(find . -name '*.part-*')"
