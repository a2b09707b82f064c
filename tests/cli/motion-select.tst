# STATUS EXPECTED COMMAND (see run.sh). What every tool shares is tried in bvh2npz.tst.
# setup: make-corpus -q --subjects 1 --seconds 2 --transitions 1 -o corpus; mkdir tmp nothing; cp corpus/walking_f001_1.bvh one.bvh; canonicalize -q one.bvh -o one.h5; canonicalize -q one.bvh --fps 60 -o f60.h5; echo nope > bad.h5
# setup: canonicalize -q corpus --labels corpus/labels.tsv -o all.h5; canonicalize -q corpus --labels corpus/labels.tsv --phases all -o phases.h5; head -c 9000 all.h5 > cut.h5
# setup: motion-select -q all.h5 --name 'trans*' -o long.h5; motion-select -q all.h5 --not-name 'trans*' --time :1 -o short.h5; motion-merge -q long.h5 short.h5 -o mixed.h5
# setup: cat > q.py <<'END'
# setup: import sys, json, h5py, numpy as np
# setup: class Archive:
# setup:     def __init__(self, path):
# setup:         self.f = f = h5py.File(path)
# setup:         self.names, self.sources = self.col("clips/name"), self.col("clips/source")
# setup:         self.length, self.phase = list(f["clips/length"][()]), list(f["clips/phase"][()])
# setup:         self.start_s, self.end_s = f["clips/source_start"][()], f["clips/source_end"][()]
# setup:         self.history = [json.loads(l) for l in bytes(f["history"][()]).decode().splitlines()]
# setup:         self.argv, self.inputs = self.history[-1]["argv"], [i["path"] for i in self.history[-1]["inputs"]]
# setup:     def col(self, name): return [v.decode() for v in self.f[name][()]]
# setup:     def attr(self, name): return self.col("clips/attributes/" + name)
# setup:     def rows(self, i):
# setup:         i = self.names.index(i) if isinstance(i, str) else i; a, n = self.f["clips/start"][i], self.f["clips/length"][i]
# setup:         return [self.f["frames/" + x][a:a + n] for x in ("rotations", "root_position", "contacts")]
# setup: def same(x, y): return all(len(p) == len(q) and np.array_equal(p, q) for p, q in zip(x, y))
# setup: def part(x, a, b): return [v[a:b] for v in x]
# setup: def product(a, b): w, x, y, z = a; return np.stack([w * b[:, 0] - x * b[:, 1] - y * b[:, 2] - z * b[:, 3], w * b[:, 1] + x * b[:, 0] + y * b[:, 3] - z * b[:, 2], w * b[:, 2] - x * b[:, 3] + y * b[:, 0] + z * b[:, 1], w * b[:, 3] + x * b[:, 2] - y * b[:, 1] + z * b[:, 0]], axis=1)
# setup: def places(x, yaw, origin, flip=1):  # of the root in the source, by the stored yaw and origin; flip: undo mirroring first
# setup:     p = x[1].astype(float) * [1, flip, 1]; c, s = np.cos(yaw), np.sin(yaw)
# setup:     return np.stack([c * p[:, 0] - s * p[:, 1], s * p[:, 0] + c * p[:, 1], p[:, 2]], axis=1) + origin
# setup: def lies(a, n): i = a.names.index(n); return a.f["clips/source_yaw"][i], a.f["clips/source_origin"][i]
# setup: def placed(a, n): return places(a.rows(n), *lies(a, n))
# setup: def turned(a, n): y = lies(a, n)[0]; return product([np.cos(y / 2), 0, 0, np.sin(y / 2)], a.rows(n)[0][:, 0])
# setup: def facing(x): return 2 * np.arctan2(x[0][0, 0, 3], x[0][0, 0, 0])
# setup: print(eval(sys.argv[1], {**globals(), "a": [Archive(p) for p in sys.argv[2:]]}))
# setup: END
# setup: printf '#!/bin/sh\nexec /usr/bin/python3 q.py "$@"\n' > q; chmod +x q; echo True > true; echo 141 > 141
# setup: cp phases.h5 mirrored.h5; /usr/bin/python3 -c 'import h5py; f = h5py.File("mirrored.h5", "r+", libver=("v110", "v110")); f["clips/mirrored"][::4] = 1; f["clips/source_yaw"][...] = 0.5; f["clips/source_origin"][...] = [1, 2, 0.25]; f["clips/attributes/gender"][3] = b""'
# setup: printf 'walking_f001_1\r\n\nlifting_m001_1\n' > list.txt; printf 'walking_f001_1\nnobody\n' > unknown.txt; printf '\n\n' > empty.txt

0 ~^Usage:.motion-select.*INPUT motion-select --help
0 ~^motion-select.\(mocapkit\) motion-select --version

# attributes: values of one are alternatives, several attributes must all hold
0 ~^motion-select:.2.of.10.clips motion-select all.h5 --attr action=walking -o walk.h5
0 true ./q 'a[0].attr("action") == ["walking"] * 2 and all(same(a[0].rows(n), a[1].rows(n)) for n in a[0].names)' walk.h5 all.h5
0 . motion-info --check full walk.h5
0 true ./q '[e["tool"] for e in a[0].history] == ["canonicalize", "motion-select"] and a[0].inputs == ["all.h5"] and "--attr=action=walking" in a[0].argv' walk.h5
0 true motion-select -q all.h5 --attr action=walking --attr action=jogging --attr gender=female -o two.h5 && ./q 'a[0].names == ["jogging_f001_1", "walking_f001_1"]' two.h5
0 true motion-select -q all.h5 --attr action!=walking --attr action!=jogging --attr gender=male -o not.h5 && ./q 'sorted(set(a[0].attr("action"))) == ["", "jumping", "lifting"]' not.h5
0 true motion-select -q mirrored.h5 --attr gender= -o un.h5 && ./q 'len(a[0].names) == 1 and a[0].attr("gender") == [""]' un.h5
0 true motion-select -q mirrored.h5 --attr gender!= -o lab.h5 && ./q 'len(a[0].names) == 39 and "" not in a[0].attr("gender")' lab.h5
3 ~all\.h5:.no.clip.has.the.attribute.mood motion-select all.h5 --attr mood=sad -o x.h5
3 ~all\.h5:.none.of.10.clips.chosen motion-select all.h5 --attr action=flying -o x.h5
2 ~expected.NAME=VALUE motion-select all.h5 --attr action -o x.h5
2 ~expected.NAME=VALUE motion-select all.h5 --attr =walking -o x.h5

# names, sources, lists
0 true motion-select -q all.h5 --name 'w*_f*' --name 'lift*' -o n.h5 && ./q 'a[0].names == ["lifting_f001_1", "lifting_m001_1", "walking_f001_1"]' n.h5
0 true motion-select -q all.h5 --not-name '*_f001_?' --not-name 'trans*' -o nn.h5 && ./q 'a[0].names == [x + "_m001_1" for x in ("jogging", "jumping", "lifting", "walking")]' nn.h5
0 true motion-select -q phases.h5 --source 'walking_[fx]*.bvh' -o so.h5 && ./q 'len(a[0].names) == 4 and set(a[0].sources) == {"walking_f001_1.bvh"}' so.h5
0 true motion-select -q all.h5 --list list.txt -o li.h5 && ./q 'a[0].names == ["lifting_m001_1", "walking_f001_1"] and a[0].inputs == ["all.h5", "list.txt"] and "--list=list.txt" in a[0].argv' li.h5
3 ~^motion-select:.unknown\.txt:2:.no.clip.is.named.'nobody' motion-select all.h5 --list unknown.txt -o x.h5
3 ~empty\.txt:.an.empty.list motion-select all.h5 --list empty.txt -o x.h5
3 ~absent\.txt motion-select all.h5 --list absent.txt -o x.h5

# phase, mirrored, length
0 true motion-select -q phases.h5 --phase 2 -o ph.h5 && ./q 'set(a[0].phase) == {2} and len(a[0].names) == 10' ph.h5
0 true motion-select -q mirrored.h5 --mirrored yes -o my.h5 && motion-select -q mirrored.h5 --mirrored no -o mn.h5 && ./q 'len(a[0].names) == 10 and len(a[1].names) == 30 and set(a[0].f["clips/mirrored"][()]) == {1}' my.h5 mn.h5
0 ~40.of.40.clips motion-select mirrored.h5 --mirrored any -o ma.h5
0 true motion-select -q mixed.h5 --min-seconds 1.01 -o lo.h5 && motion-select -q mixed.h5 --max-seconds 1 -o sh.h5 && ./q 'min(a[0].length) > 31 and max(a[1].length) == 31 and [len(x.names) for x in a] == [2, 8]' lo.h5 sh.h5

# parts: frames, contacts, and the seconds of the source
0 true motion-select -q all.h5 --time 0.5:1 -o t.h5 && ./q 'a[0].names == a[1].names and set(a[0].length) == {16} and all(same(a[0].rows(n), part(a[1].rows(n), 15, 31)) for n in a[0].names)' t.h5 all.h5
0 true ./q 'np.allclose(a[0].start_s, a[1].start_s + 0.5) and np.allclose(a[0].end_s, a[1].start_s + 1)' t.h5 all.h5
0 . motion-info --check full t.h5
0 true motion-select -q t.h5 --time 0.2: --max-seconds 0.31 -o tt.h5 && ./q 'set(a[0].length) == {10} and np.allclose(a[0].start_s, a[1].start_s + 0.7) and all(same(a[0].rows(n), part(a[1].rows(n), 21, 31)) for n in a[0].names)' tt.h5 all.h5
0 true motion-select -q all.h5 --time :0.5 -o t0.h5 && ./q 'set(a[0].length) == {16} and np.array_equal(a[0].start_s, a[1].start_s)' t0.h5 all.h5
0 true motion-select -q mixed.h5 --time 1.1: -o t2.h5 && ./q 'len(a[0].names) == 2 and all("transition" in n for n in a[0].names)' t2.h5
3 ~none.of.0.clips.chosen motion-select all.h5 --time 100:101 -o x.h5
2 ~expected.START:END motion-select all.h5 --time 3 -o x.h5
2 ~expected.START:END motion-select all.h5 --time a:3 -o x.h5
2 ~expected.START:END motion-select all.h5 --time 0:nan -o x.h5
2 ~the.end.lies.before.the.start motion-select all.h5 --time 2:1 -o x.h5

# segments become clips
0 ~6.of.6.segments motion-select all.h5 --segments -o seg.h5
0 true ./q '[n for n in a[0].names if "_f" in n] == ["transition_f001_1/%d" % k for k in (1, 2, 3)] and a[0].attr("action") == ["walking", "jogging", "walking"] * 2 and a[0].attr("gender") == ["female"] * 3 + ["male"] * 3' seg.h5
0 true ./q 'all(same(a[0].rows("transition_f001_1/%d" % (k + 1)), part(a[1].rows("transition_f001_1"), s, s + n)) for k, (s, n) in enumerate(zip(a[1].f["segments/start"][:3], a[1].f["segments/length"][:3])))' seg.h5 all.h5
0 true ./q 'a[0].start_s[1] == a[1].f["segments/start"][1] / 30 and "segments" not in a[0].f' seg.h5 all.h5
0 true motion-select -q all.h5 --segments --attr action=jogging -o jog.h5 && ./q 'a[0].names == ["transition_f001_1/2", "transition_m001_1/2"]' jog.h5
0 true motion-select -q all.h5 --segments --name 'transition_f*_1' --not-name '*/2' -o w.h5 && ./q 'a[0].names == ["transition_f001_1/1", "transition_f001_1/3"]' w.h5
0 true motion-select all.h5 --segments --dry-run -q > seg.txt && head -2 seg.txt > some.txt && motion-select -q all.h5 --segments --list some.txt -o sl.h5 && ./q 'a[0].names == ["transition_f001_1/1", "transition_f001_1/2"]' sl.h5
0 true motion-select -q all.h5 --segments --time 0.2:0.4 -o st.h5 && ./q 'a[0].names == ["transition_f001_1/1", "transition_m001_1/1"] and a[0].length == [7, 7] and np.allclose(a[0].start_s, 0.2)' st.h5
3 ~none.of.0.segments motion-select one.h5 --segments -o x.h5

# a part keeps its place unless --recenter moves it; then yaw and origin say where it was
0 true motion-select -q all.h5 --time 0.5: --recenter -o re.h5 && ./q 'all(np.abs(a[0].rows(n)[1][0, :2]).max() < 1e-6 and same(part(a[0].rows(n), 0, 0), part(a[1].rows(n), 0, 0)) and abs(facing(a[0].rows(n))) < 0.6 for n in a[0].names)' re.h5 all.h5
0 true ./q 'all(np.abs(places(a[0].rows(i), a[0].f["clips/source_yaw"][i], a[0].f["clips/source_origin"][i]) - placed(a[1], n)[15:]).max() < 1e-5 for i, n in enumerate(a[0].names)) and max(np.abs(a[0].f["clips/source_origin"][:, 0])) > 0.5' re.h5 all.h5
0 true ./q 'all(np.array_equal(a[0].rows(n)[2], a[1].rows(n)[2][15:]) and np.array_equal(a[0].rows(n)[1][:, 2], a[1].rows(n)[1][15:, 2]) for n in a[0].names)' re.h5 all.h5
0 true ./q 'all(min(np.abs(product([np.cos(y / 2), 0, 0, np.sin(y / 2)], a[0].rows(i)[0][:, 0]) - s * turned(a[1], n)[15:]).max() for s in (1, -1)) < 1e-5 for i, (n, y) in enumerate(zip(a[0].names, a[0].f["clips/source_yaw"][()])))' re.h5 all.h5
0 true motion-select -q mirrored.h5 --time 0.5: --recenter -o rm.h5 && ./q 'all(np.abs(places(a[0].rows(i), a[0].f["clips/source_yaw"][i], a[0].f["clips/source_origin"][i], f) - places(part(a[1].rows(n), 15, None), 0.5, [1, 2, 0.25], f)).max() < 1e-5 for i, (n, f) in enumerate(zip(a[0].names, 1 - 2.0 * a[0].f["clips/mirrored"][()])))' rm.h5 mirrored.h5
0 . motion-info --check full rm.h5

# which of those
0 true motion-select -q all.h5 --head 3 -o h.h5 && ./q 'a[0].names == a[1].names[:3]' h.h5 all.h5
0 true motion-select -q all.h5 --every 4 -o e.h5 && ./q 'a[0].names == a[1].names[::4]' e.h5 all.h5
0 true motion-select -q all.h5 --random 4 -o r.h5 && motion-select -q all.h5 --random 4 --seed 5 -o r2.h5 && ./q 'len(a[0].names) == len(a[1].names) == 4 and a[0].names != a[1].names and all(sorted(x.names, key=a[2].names.index) == x.names for x in a)' r.h5 r2.h5 all.h5
0 . motion-select -q all.h5 --random 4 --seed 1 -o r3.h5 && cmp r.h5 r3.h5
0 ~10.clips.are.all.there.are motion-select all.h5 --random 11 -o r11.h5
0 true motion-select -q all.h5 --attr action=walking --invert -o inv.h5 && ./q 'sorted(a[0].names + a[1].names) == a[2].names' inv.h5 walk.h5 all.h5
0 walk.txt printf 'walking_f001_1\nwalking_m001_1\n' > walk.txt; motion-select all.h5 --attr action=walking --dry-run
0 ~2.of.10.clips motion-select all.h5 --attr action=walking --dry-run
3 ~none.of.10 motion-select all.h5 --name nobody --dry-run

# several archives, pipes
0 true motion-select -q all.h5 one.h5 --name 'walking_f*' --name one -o both.h5 && ./q 'a[0].names == ["walking_f001_1", "one"] and a[0].inputs == ["all.h5", "one.h5"] and [e["tool"] for e in a[0].history] == ["canonicalize", "canonicalize", "motion-select"]' both.h5
0 . motion-select -q - --attr action=walking -o - < all.h5 > piped.h5 && motion-info walk.h5 | grep digest > d && motion-info - < piped.h5 | grep digest | cmp - d
3 ~f60\.h5:.60.Hz,.expected.the.30.Hz motion-select all.h5 f60.h5 -o x.h5
3 ~the.same.file motion-select all.h5 "$(ln -sf all.h5 again.h5; echo again.h5)" -o x.h5

# usage, bad input, output
2 ~no.input.given motion-select -o x.h5
2 ~expected.-o.or.--dry-run motion-select all.h5
2 ~expected.one.of motion-select all.h5 --mirrored maybe -o x.h5
2 ~--every motion-select all.h5 --every 0 -o x.h5
2 ~--head motion-select all.h5 --head -1 -o x.h5
2 ~--min-seconds motion-select all.h5 --min-seconds -1 -o x.h5
3 ~^motion-select:.cut\.h5:.truncated motion-select cut.h5 -o x.h5
3 ~bad\.h5:.not.an.HDF5.file motion-select bad.h5 all.h5 -o x.h5
3 ~absent\.h5 motion-select absent.h5 -o x.h5
3 ~a.folder.without motion-select nothing -o x.h5
1 . test -e x.h5
4 ~walk\.h5:.exists.already motion-select all.h5 -o walk.h5
0 . motion-select -q all.h5 --attr action=walking -f -o walk.h5
4 ~write.failed motion-select all.h5 -o - > /dev/full
0 141 { sleep 0.3; TMPDIR=$PWD/tmp motion-select -q all.h5 -o -; echo $? > died; } 2> noise | true; test ! -s noise && cat died
0 . test -z "$(ls tmp)"
1 . test -n "$(find . -name '*.part-*')"
