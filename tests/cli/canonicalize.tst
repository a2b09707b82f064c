# STATUS EXPECTED COMMAND (see run.sh). What every tool shares is tried in bvh2npz.tst.
# setup: make-corpus -q --subjects 1 --seconds 2 -o corpus; mkdir in in/sub folder tmp; cp $DATA/bvh/tiny_human.bvh in/a.bvh; sed 's/^0\.0000 9/1.0000 9/' in/a.bvh > in/sub/b.bvh; cp -r in whole
# setup: cp in/a.bvh good.bvh; gzip -c good.bvh > packed.bvh.gz; printf 'HIERARCHY\nROOT Hips\n' > in/broken.bvh; echo text > in/notes.txt; echo nope > bad.bvh; : > empty.bvh; head -c 9000 good.bvh > cut.bvh; cp $DATA/bvh/plain.bvh legless.bvh
# setup: printf 'whole/a.bvh\nwhole/sub/b.bvh\n' > list.txt; sed -n '1,/^Frame Time/p' good.bvh | sed 's/^Frames:.*/Frames: 1/' > one.bvh; sed '1,/^Frame Time/d' good.bvh | head -1 >> one.bvh
# setup: printf 'file\taction\tgender\tstart\tend\na.bvh\twalking\tfemale\t0\t0.5\na.bvh\tjogging\tfemale\t0.5\t1\nsub/b.bvh\twalking\tmale\t\t\n' > whole/labels.tsv; cp whole/labels.tsv labels.tsv
# setup: cat > q.py <<'END'
# setup: import sys, json, h5py, numpy as np
# setup: class Archive:
# setup:     def __init__(self, path):
# setup:         self.f = f = h5py.File(path)
# setup:         self.names = self.col("clips/name")
# setup:         self.length = list(f["clips/length"][()])
# setup:         self.rate = f.attrs["frame_rate_hz"]
# setup:         self.history = [json.loads(l) for l in bytes(f["history"][()]).decode().splitlines()]
# setup:         self.argv = self.history[-1]["argv"]
# setup:         self.p, self.q = f["frames/root_position"][()], f["frames/rotations"][()]
# setup:     def col(self, name): return [v.decode() for v in self.f[name][()]]
# setup: def near(a, b): return np.minimum(np.linalg.norm(a.q - b.q, axis=-1), np.linalg.norm(a.q + b.q, axis=-1)).max() < 5e-6 and all(np.abs(x - y).max() < 1e-5 for x, y in [(a.p, b.p), (a.f["skeleton/end_sites"][()], b.f["skeleton/end_sites"][()]), (a.f["skeleton/rest_offsets"][()], b.f["skeleton/rest_offsets"][()])])
# setup: def heading(q): return 2 * np.arctan2(q[0, 3], q[0, 0])
# setup: print(eval(sys.argv[1], {**globals(), "a": [Archive(p) for p in sys.argv[2:]]}))
# setup: END
# setup: printf '#!/bin/sh\nexec /usr/bin/python3 q.py "$@"\n' > q; chmod +x q; echo True > true; echo 141 > 141
# setup: mkdir asfamc lone; cp $DATA/asf/human.asf asfamc/07.asf; for n in asfamc/07_05 asfamc/07_06 alone lone/b; do cp $DATA/asf/human.amc $n.amc; done
# setup: printf 'file\tstatus\nabsent.bvh\t3\nbad.bvh\t3\nin/broken.bvh\t3\n' > fails
# setup: awk '/OFFSET/ { sub(/OFFSET /, "OFFSET -"); sub(/--/, ""); print; next } m { $1 = -$1; for (i = 4; i <= NF; i += 3) { $i = -$i; $(i+1) = -$(i+1) } } /^Frame Time/ { m = 1 } { print }' good.bvh > reflected.bvh
# setup: sed -E 's/JOINT (Left|Right)UpLeg/JOINT Bone\1A/; s/JOINT (Left|Right)Leg/JOINT Bone\1B/; s/JOINT (Left|Right)Foot/JOINT Bone\1C/' good.bvh > bones.bvh
# setup: { echo '[joints]'; for s in Left Right; do l=$(echo $s | tr LR lr); printf '%s_hip = "Bone%sA"\n%s_knee = "Bone%sB"\n%s_ankle = "Bone%sC"\n' $l $s $l $s $l $s; done; } > map.toml
# setup: awk '/JOINT (Left|Right)Leg/ { turn = 1 } turn && /OFFSET/ { print "OFFSET 0 0 41"; turn = 0; next } { print }' good.bvh > seated.bvh
# setup: sed 's/JOINT Spine1/JOINT Chest/' good.bvh > other.bvh; sed '/^MOTION/q; s/OFFSET 0.0000 14/OFFSET 0.0000 15/' good.bvh > longer.bvh; sed '1,/^MOTION/d' good.bvh >> longer.bvh; echo Spine > spine

0 ~^Usage:.canonicalize.*INPUT\.\.\..-o canonicalize --help
0 ~^canonicalize.\(mocapkit\) canonicalize --version
4 ~write.failed canonicalize --help > /dev/full

# one file: body, rate, frame
0 ~1.clips,.30.frames,.1\.0.s canonicalize good.bvh -o good.h5
0 . motion-info --check full good.h5
0 true ./q 'a[0].names == ["good"] and a[0].length == [30] and a[0].rate == 30 and a[0].q.shape == (30, 22, 4) and a[0].f.attrs["contacts"] in ("preset:default", b"preset:default")' good.h5
0 true ./q 'np.allclose(a[0].p[0, :2], 0, atol=1e-6) and a[0].p[-1, 0] > 0.8 and 0.85 < a[0].p[0, 2] < 1.05 and abs(heading(a[0].q[0])) < 0.2' good.h5
0 true ./q 'a[0].history[-1]["inputs"][0]["path"] == "good.bvh" and not [x for x in a[0].argv if "output" in x or "quiet" in x]' good.h5
0 true canonicalize -q packed.bvh.gz -o packed.h5 && ./q 'np.array_equal(a[0].q, a[1].q)' good.h5 packed.h5
0 . canonicalize -q good.bvh -o - | cmp - good.h5
0 true canonicalize -q - -o piped.h5 < good.bvh && ./q 'np.array_equal(a[0].q, a[1].q)' good.h5 piped.h5
0 true canonicalize -q good.bvh -o - | canonicalize -q - -o twice.h5 && ./q 'np.allclose(a[0].q, a[1].q, atol=1e-6) and np.allclose(a[0].p, a[1].p, atol=1e-5) and [e["tool"] for e in a[1].history] == ["canonicalize"] * 2' good.h5 twice.h5
0 true bvh2npz -q good.bvh -o n.npz && canonicalize -q n.npz -o n.h5 && ./q 'np.allclose(a[0].q, a[1].q, atol=1e-5) and np.allclose(a[0].p, a[1].p, atol=1e-4)' good.h5 n.h5
0 true canonicalize -q one.bvh -o one.h5 && ./q 'a[0].length == [1]' one.h5

# options
0 true canonicalize -q corpus -o c.h5 && ./q 'a[0].rate == 30 and len(a[0].names) == 10 and set(a[0].length) <= {60, 61}' c.h5
0 true canonicalize -q corpus --phases all -o ph.h5 && ./q 'len(a[0].names) == 40 and a[0].names[1] == a[0].names[0] + "@1" and sorted(set(a[0].f["clips/phase"][()])) == [0, 1, 2, 3]' ph.h5
0 true canonicalize -q corpus --phases first --fps 60 -o f60.h5 && ./q 'a[0].rate == 60 and set(a[0].length) <= {120, 121}' f60.h5
0 true canonicalize -q good.bvh --contacts holden -o con.h5 && ./q 'a[0].f.attrs["contacts"] in ("preset:holden", b"preset:holden")' con.h5
0 true canonicalize -q good.bvh --unit cm --up y --first-frame keep -o u.h5 && ./q 'np.array_equal(a[0].q, a[1].q) and "--up=y" in a[1].argv' good.h5 u.h5
0 true canonicalize -q good.bvh --first-frame drop -o d.h5 && ./q 'a[0].length == [29]' d.h5
3 ~cut\.bvh:[0-9]+ canonicalize cut.bvh -o x.h5
0 ~warning:.cut\.bvh:.Frames:.30.declared,.kept canonicalize cut.bvh --lenient -o lw.h5
0 ~read.as.cm,.y.up,.30.Hz.\(2\)$ canonicalize whole -o how.h5
0 true ./q 'a[0].col("clips/source_unit") == ["cm", "cm"] and a[0].col("clips/source_up_axis") == ["y", "y"]' how.h5
0 true canonicalize -q good.bvh --unit dm -o dm.h5 && ./q 'a[0].col("clips/source_unit") == ["dm"]' dm.h5
0 true canonicalize -q cut.bvh --lenient -o l.h5 && ./q '0 < a[0].length[0] < 30' l.h5
3 ~good\.bvh.*expected.at.least.2 canonicalize good.bvh --min-seconds 2 -o x.h5
0 . canonicalize -q good.bvh --min-seconds 0.9 -o ms.h5
0 true printf 'fps = 60\nquiet = true\n' > c.toml; canonicalize good.bvh --config c.toml -o conf.h5 && ./q 'a[0].rate == 60' conf.h5

# labels: whole clips, segments, by path and by name
0 true canonicalize -q whole --labels whole/labels.tsv -o lab.h5 && ./q 'a[0].col("clips/attributes/action") == ["", "walking"] and a[0].col("clips/attributes/gender") == ["female", "male"]' lab.h5
0 true ./q 'a[0].col("segments/attributes/action") == ["walking", "jogging"] and list(a[0].f["segments/length"][()]) == [15, 15] and list(a[0].f["segments/clip"][()]) == [0, 0]' lab.h5
0 true ./q '[i["path"] for i in a[0].history[-1]["inputs"]] == ["a.bvh", "labels.tsv", "sub/b.bvh"]' lab.h5
0 ~9.of.10.clips.have.no.row (head -2 corpus/labels.tsv) > few.tsv; canonicalize corpus --labels few.tsv -o few.h5
3 ~absent\.tsv canonicalize good.bvh --labels absent.tsv -o x.h5
3 ~bad\.tsv printf 'name\taction\na\tb\n' > bad.tsv; canonicalize good.bvh --labels bad.tsv -o x.h5
3 ~wide\.tsv:3 printf 'file\taction\na\tb\nc\td\te\n' > wide.tsv; canonicalize good.bvh --labels wide.tsv -o x.h5

# batches: what is good is written as if the bad were not there
1 ~3.of.5.inputs.failed canonicalize good.bvh bad.bvh absent.bvh in/broken.bvh whole/sub/b.bvh --rejects fails.tsv -o some.h5
0 fails cut -f 1,3 fails.tsv
0 . canonicalize -q good.bvh whole/sub/b.bvh -o clean.h5 && cmp some.h5 clean.h5
1 . canonicalize -q in -o folder.h5 && cmp folder.h5 clean.h5
0 . canonicalize -q whole -j 1 -o j1.h5 && canonicalize -q whole -j 2 -o j2.h5 && cmp j1.h5 j2.h5
1 . canonicalize -q in -j 2 -o in2.h5
0 true ./q 'a[0].names == a[1].names == ["a", "sub/b"] and np.array_equal(a[0].q, a[1].q) and a[0].history[-1]["inputs"] == a[1].history[-1]["inputs"]' in2.h5 j1.h5
0 true canonicalize -q @list.txt -o list.h5 && ./q 'np.array_equal(a[0].q, a[1].q)' list.h5 j1.h5
1 ~2.of.2.inputs.failed canonicalize bad.bvh absent.bvh -o x.h5
1 ~--fail-fast|1.of.2.inputs.failed canonicalize bad.bvh good.bvh --fail-fast -o x.h5
0 true canonicalize -q whole --shard 1/2 -o s1.h5 && canonicalize -q whole --shard 2/2 -o s2.h5 && ./q 'sorted(a[0].names + a[1].names) == ["a", "sub/b"]' s1.h5 s2.h5
0 true canonicalize -q good.bvh good.h5 whole -o mix.h5 && ./q 'len(set(a[0].names)) == 4' mix.h5
0 true canonicalize -q ph.h5 -o again.h5 && ./q 'a[0].names == a[1].names and np.allclose(a[0].q, a[1].q, atol=1e-6)' again.h5 ph.h5

# a rerun does what is missing or changed, and replaces nothing else
0 . touch -d 2000-01-01 j1.h5 && canonicalize whole --skip-existing -o j1.h5 && test -z "$(find j1.h5 -newermt 2001-01-01)"
0 . canonicalize -q whole --fps 60 --skip-existing -o j1.h5 && test -n "$(find j1.h5 -newermt 2001-01-01)"
0 . canonicalize -q whole --skip-existing -o j1.h5 && cmp j1.h5 j2.h5 && touch -d 2000-01-01 j1.h5 && cp -r whole changed && cp good.bvh changed/sub/b.bvh && cp j1.h5 ch.h5 && canonicalize -q changed --skip-existing -o ch.h5
1 . cmp -s ch.h5 j1.h5
0 . canonicalize -q whole --labels whole/labels.tsv --skip-existing -o lab.h5 && touch -d 2000-01-01 lab.h5 && canonicalize -q whole --labels whole/labels.tsv --skip-existing -o lab.h5 && test -z "$(find lab.h5 -newermt 2001-01-01)"
4 ~not.made.by.canonicalize echo mine > mine.h5; canonicalize good.bvh --skip-existing -o mine.h5
0 . test "$(cat mine.h5)" = mine
0 . canonicalize -q good.bvh --skip-existing -o fresh.h5 && test -e fresh.h5

# usage
2 ~no.input.given canonicalize
2 ~no.output.given canonicalize good.bvh
2 ~--fps canonicalize good.bvh --fps 0 -o x.h5
2 ~--fps canonicalize good.bvh --fps 1e300 -o x.h5
2 ~--fps canonicalize good.bvh --fps nan -o x.h5
2 ~expected.one.of canonicalize good.bvh --phases some -o x.h5
2 ~expected.one.of canonicalize good.bvh --contacts none -o x.h5
2 ~--min-seconds canonicalize good.bvh --min-seconds -1 -o x.h5
2 ~I/N canonicalize whole --shard 0/2 -o x.h5
2 ~terminal script -qec 'canonicalize good.bvh -o -' /dev/null

# bad input
3 ~^canonicalize:.absent\.bvh canonicalize absent.bvh -o x.h5
3 ~^canonicalize:.bad\.bvh canonicalize bad.bvh -o x.h5
3 ~^canonicalize:.empty\.bvh canonicalize empty.bvh -o x.h5
3 ~^canonicalize:.<stdin> canonicalize - -o x.h5
3 ~legless\.bvh.*expected.a.body canonicalize legless.bvh -o x.h5
3 ~^canonicalize:.cut\.h5 head -c 5000 good.h5 > cut.h5; canonicalize cut.h5 -o x.h5
3 ~a.folder.without canonicalize tmp -o x.h5
1 . test -e x.h5

# output
4 ~good\.h5:.exists.already canonicalize good.bvh -o good.h5
4 ~exists.already canonicalize absent.bvh good.bvh -o good.h5
0 . canonicalize -q good.bvh -f -o good.h5
4 ~nowhere canonicalize good.bvh -o nowhere/x.h5
4 ~folder canonicalize good.bvh -o folder
4 ~full canonicalize good.bvh -o /dev/full
4 ~write.failed canonicalize good.bvh -o - > /dev/full
4 ~write.failed canonicalize good.bvh -o - >&-
0 141 { sleep 0.3; TMPDIR=$PWD/tmp canonicalize -q good.bvh -o -; echo $? > died; } 2> noise | true; test ! -s noise && cat died
0 . test -z "$(ls tmp)"
1 . test -n "$(find . -name '*.part-*')"

# rates: a table of patterns; what it sets, what it is refused for
# setup: printf 'pattern\trate\n# the tiny ones\n*sub/b*\t60\n\nwhole/a.bvh\t60000/1001\n' > rates.tsv; printf 'pattern\trate\n*\t1001/30000\nb*\t5\n' > all.tsv
0 true canonicalize -q whole --fps-override rates.tsv -o ra.h5 && ./q 'list(a[0].f["clips/source_frame_rate_hz"][()]) == [60000 / 1001, 60] and list(a[0].length) == [15, 15] and "rates.tsv" in [i["path"] for i in a[0].history[-1]["inputs"]] and "--fps-override=rates.tsv" in a[0].argv' ra.h5
0 ~a\.bvh:.60.Hz.by.--fps-override,.the.file.says.30.Hz printf 'pattern\trate\ng*\t60\n[!g]*\t60\n' > sixty.tsv; canonicalize -v in/a.bvh --fps-override sixty.tsv -o sixty.h5
0 ~all\.tsv:3:.the.pattern.'b\*'.set.no.file.s.rate canonicalize whole --fps-override all.tsv -o al.h5
1 . canonicalize whole --fps-override rates.tsv -f -o ra.h5 2>&1 | grep pattern
1 . canonicalize whole --shard 1/2 --fps-override rates.tsv -o rs.h5 2>&1 | grep pattern
0 ~rates\.tsv:3:.the.pattern canonicalize -v whole --shard 1/2 --fps-override rates.tsv -f -o rs.h5
0 . touch -d 2000-01-01 ra.h5 && canonicalize -q whole --fps-override rates.tsv --skip-existing -o ra.h5 && test -z "$(find ra.h5 -newermt 2001-01-01)"
0 . printf '#\n' >> rates.tsv && canonicalize -q whole --fps-override rates.tsv --skip-existing -o ra.h5 && test -n "$(find ra.h5 -newermt 2001-01-01)"
0 true canonicalize -q good.h5 --fps-override sixty.tsv -o rea.h5 && ./q 'a[0].f["clips/source_frame_rate_hz"][0] == 60 and a[0].length == [15]' rea.h5
3 ~^canonicalize:.norates\.tsv: canonicalize good.bvh --fps-override norates.tsv -o x.h5
3 ~^canonicalize:.r1\.tsv:1:.a.header printf '*\t30\n' > r1.tsv; canonicalize good.bvh --fps-override r1.tsv -o x.h5
3 ~^canonicalize:.r2\.tsv:2:rate:.'fast' printf 'pattern\trate\n*\tfast\n' > r2.tsv; canonicalize good.bvh --fps-override r2.tsv -o x.h5
3 ~^canonicalize:.r3\.tsv:2:.1.columns printf 'pattern\trate\n*.bvh 30\n' > r3.tsv; canonicalize good.bvh --fps-override r3.tsv -o x.h5

# a rate that the motion contradicts is doubted, a right one is not
# setup: make-corpus -q --subjects 1 --seconds 5 -o long; mkdir walks; cp long/walking_f001_1.bvh long/jogging_f001_1.bvh long/jumping_f001_1.bvh walks; printf 'pattern\trate\n*\t480\n' > fast.tsv; printf 'pattern\trate\n*\t30\n' > slow.tsv
1 . canonicalize long -o lo.h5 2>&1 | grep contradicts
0 ~walks/walking_f001_1\.bvh:.its.motion.contradicts.480.Hz:.*;.--fps-override.sets.another canonicalize walks --fps-override fast.tsv -o fast.h5
0 ~walks/jogging_f001_1\.bvh:.its.motion.contradicts.480.Hz canonicalize walks --fps-override fast.tsv -f -o fast.h5
0 ~walks/walking_f001_1\.bvh:.its.motion.contradicts.30.Hz:.steps.at.0 canonicalize walks --fps-override slow.tsv -o slow.h5
0 ~walks/jumping_f001_1\.bvh:.its.motion.contradicts.30.Hz:.it.falls.at.*about.1[12][0-9]*.Hz canonicalize walks --fps-override slow.tsv -f -o slow.h5
0 ~slow\.h5:clip.walking_f001_1:.its.motion.contradicts.30.Hz canonicalize slow.h5 -o doubted.h5

# attributes from the path; labels.tsv goes first
# setup: mkdir -p path/s01 path/s02; cp good.bvh path/s01/walk_1.bvh; cp good.bvh path/s02/JOG.bvh; printf 'file\taction\npath/s01/walk_1.bvh\tstrolling\n' > strolling.tsv
0 true canonicalize -q path --attr-from-path '(?<subject>[^/]+)/(?<action>[a-z]+)?' -o pa.h5 && ./q 'a[0].col("clips/attributes/subject") == ["s01", "s02"] and a[0].col("clips/attributes/action") == ["walk", ""]' pa.h5
0 ~--attr-from-path.does.not.match.1.of.2.files canonicalize path --attr-from-path '(?<subject>[^/]+)/(?<action>[a-z]+)_' -o pb.h5
1 . canonicalize path --attr-from-path '(?<subject>[^/]+)/' -o pc.h5 2>&1 | grep match
0 true canonicalize -q path --labels strolling.tsv --attr-from-path '(?<subject>[^/]+)/(?<action>[a-z]+)_' -o pd.h5 && ./q 'a[0].col("clips/attributes/action") == ["strolling", ""]' pd.h5
0 true canonicalize -q path/s01/walk_1.bvh --attr-from-path '(?<subject>[^/]+)/[^/]+$' -o pe.h5 && ./q 'a[0].col("clips/attributes/subject") == ["s01"]' pe.h5
0 true canonicalize -q pc.h5 --attr-from-path '/(?<take>.*)\.bvh' -o pf.h5 && ./q 'a[0].col("clips/attributes/take") == ["walk_1", "JOG"] and a[0].col("clips/attributes/subject") == ["s01", "s02"]' pf.h5
0 ~1.of.2.clips.have.no.row canonicalize path --labels strolling.tsv --attr-from-path '(?<subject>[^/]+)/' -f -o pd.h5
2 ~--attr-from-path:.*missing.closing.parenthesis canonicalize path --attr-from-path '(?<subject>[a-z]+' -o x.h5
2 ~--attr-from-path:.*has.no.named.group canonicalize path --attr-from-path '([a-z]+)' -o x.h5

# AMASS: folders as attributes, files without motion passed over, a user's body model
# setup: mkdir -p amass/ACCAD/Female1_c3d amass/KIT/3; cp $DATA/npz/amass_smplh.npz amass/ACCAD/Female1_c3d/A1_poses.npz; cp $DATA/npz/amass_stageii.npz amass/KIT/3/walk_stageii.npz; cp $DATA/npz/amass_parts.npz amass/KIT/3/turn_stageii.npz
# setup: cp $DATA/npz/shape.npz amass/ACCAD/Female1_c3d; cp $DATA/npz/stagei.npz amass/KIT/3/a_stagei.npz; cp $DATA/npz/no_trans.npz amass/KIT/3; /usr/bin/python3 -c 'import zipfile; zipfile.ZipFile("amass/readme.zip", "w").writestr("a.txt", "hello")'
# setup: cp $DATA/npz/amass_shaped.npz shaped_poses.npz; cp $DATA/npz/body_model.npz $DATA/npz/body_model_sparse.npz .
0 true canonicalize -q amass --rejects amass.tsv -o am.h5 && ./q 'a[0].col("clips/attributes/dataset") == ["ACCAD", "KIT", "KIT"] and a[0].col("clips/attributes/subject") == ["Female1_c3d", "3", "3"] and a[0].col("clips/attributes/gender") == ["female", "female", "male"] and list(a[0].f["clips/source_frame_rate_hz"][()]) == [120, 120, 60]' am.h5
0 . test "$(wc -l < amass.tsv)" = 1
0 ~Female1_c3d/shape\.npz:.skipped:.no.poses:.a.shape.file canonicalize amass -f -o am.h5
0 ~KIT/3/a_stagei\.npz:.skipped:.no.poses:.a.shape.file canonicalize amass -f -o am.h5
0 ~KIT/3/no_trans\.npz:.skipped:.no.trans canonicalize amass -f -o am.h5
0 ~readme\.zip:.skipped:.a.zip.file.without.arrays canonicalize amass -f -o am.h5
3 ~no.poses:.a.shape.file,.expected.a.motion canonicalize amass/ACCAD/Female1_c3d/shape.npz -o x.h5
1 ~no.poses:.a.shape.file,.expected.a.motion printf 'good.bvh\namass/ACCAD/Female1_c3d/shape.npz\n' > named.txt; canonicalize @named.txt -o named.h5
0 true canonicalize -q amass/ACCAD -o ac.h5 && ./q 'a[0].col("clips/attributes/dataset") == ["ACCAD"] and a[0].col("clips/attributes/subject") == ["Female1_c3d"]' ac.h5
0 true canonicalize -q amass --attr-from-path '^(?<collection>[A-Z]+)' -o ap.h5 && ./q 'a[0].col("clips/attributes/collection") == ["ACCAD", "KIT", "KIT"] and "clips/attributes/subject" not in a[0].f' ap.h5
0 true canonicalize -q shaped_poses.npz --body-model body_model.npz -o bm.h5 && canonicalize -q shaped_poses.npz -o nb.h5 && ./q 'a[0].history[-1]["inputs"][0]["path"] == "body_model.npz" and "--body-model=body_model.npz" in a[0].argv and a[0].q.shape == a[1].q.shape and not np.allclose(a[0].q, a[1].q, atol=1e-4)' bm.h5 nb.h5
3 ~^canonicalize:.body_model_sparse\.npz:J_regressor: canonicalize shaped_poses.npz --body-model body_model_sparse.npz -o x.h5
3 ~^canonicalize:.absent\.npz canonicalize shaped_poses.npz --body-model absent.npz -o x.h5
3 ~no.J_regressor canonicalize shaped_poses.npz --body-model shaped_poses.npz -o x.h5

# ends cut off; a low-pass before going down in rate
0 true canonicalize -q good.bvh --trim 0.2,0.1 -o t.h5 && ./q 'a[0].length == [21] and np.isclose(a[0].f["clips/source_start"][0], 0.2) and np.isclose(a[0].f["clips/source_end"][0], 26 / 30)' t.h5
0 true canonicalize -q good.bvh --trim 10% -o t2.h5 && ./q 'a[0].length == [24] and np.isclose(a[0].f["clips/source_start"][0], 0.1)' t2.h5
3 ~good\.bvh:clip.good:.*expected.more.than.the.2.s.to.be.trimmed canonicalize good.bvh --trim 1 -o x.h5
3 ~expected.at.least.0.9.s canonicalize good.bvh --trim 0.1 --min-seconds 0.9 -o x.h5
2 ~--trim:.'50%' canonicalize good.bvh --trim 50% -o x.h5
2 ~--trim:.'1s' canonicalize good.bvh --trim 1s -o x.h5
0 true canonicalize -q walks --anti-alias sinc -o aa.h5 && canonicalize -q walks --anti-alias none -o an.h5 && ./q 'a[0].argv != a[1].argv and list(a[0].length) == list(a[1].length) and not np.array_equal(a[0].q, a[1].q) and np.abs(a[0].p - a[1].p).max() < 0.1' aa.h5 an.h5
0 . canonicalize -q walks -o ad.h5 && cmp an.h5 ad.h5
2 ~expected.one.of.none,.sinc canonicalize good.bvh --anti-alias some -o x.h5
1 . test -e x.h5
# ASF and AMC: the skeleton is found beside the motion or named, and is an input of the history
0 ~1.clips,.15.frames canonicalize asfamc/07_05.amc -o amc.h5
0 true ./q 'a[0].names == ["07_05"] and [i["path"] for i in a[0].history[-1]["inputs"]] == ["07.asf", "07_05.amc"] and 0.9 < a[0].p[0, 2] < 1.05 and a[0].p[-1, 0] > 0.6' amc.h5
0 true canonicalize -q alone.amc --asf asfamc/07.asf -o alone.h5 && ./q 'np.array_equal(a[0].q, a[1].q) and "--asf=07.asf" in a[1].argv' amc.h5 alone.h5
3 ~^canonicalize:.<stdin>:.motion.\(AMC\).without.its.skeleton canonicalize - -o x.h5 < alone.amc
1 ~^canonicalize:.lone/b\.amc:.*found.none canonicalize good.bvh lone/b.amc -o lone.h5
0 true canonicalize -q asfamc -o both.h5 && ./q 'a[0].names == ["07_05", "07_06"] and [i["path"] for i in a[0].history[-1]["inputs"]] == ["07.asf", "07_05.amc", "07_06.amc"]' both.h5
0 true canonicalize -q asfamc --fps-override sixty.tsv -o slower.h5 && ./q 'list(a[0].f["clips/source_frame_rate_hz"][()]) == [60, 60] and "07.asf" in [i["path"] for i in a[0].history[-1]["inputs"]]' slower.h5
0 ~^canonicalize:.warning:.cut\.bvh:.*kept canonicalize cut.bvh --lenient --fps-override sixty.tsv -o cut60.h5
0 ~both\.h5.is.up.to.date canonicalize asfamc -o both.h5 --skip-existing
0 ~2.clips sed -i 's/length 7.0/length 7.5/' asfamc/07.asf && canonicalize asfamc -o both.h5 --skip-existing
# --body source: the inputs' own rig
0 ~2.clips canonicalize whole --body source -o own.h5
0 . motion-info --check full own.h5
0 true canonicalize -q good.bvh --body source -o rig.h5 && ./q '"Hips" in a[0].col("skeleton/joint_names") and a[0].q.shape[1] == len(a[0].col("skeleton/joint_names")) and "--body=source" in a[0].argv and np.allclose(a[0].p[0, :2], 0, atol=1e-6)' rig.h5
0 true ./q 'dict(zip(*np.array([[s.decode() for s in r] for r in a[0].f["skeleton/roles"][()]]).T))["left_knee"] == "LeftLeg" and a[0].f["frames/contacts"].shape == (30, 2)' rig.h5
0 . canonicalize -q - --body source -o - < good.bvh | cat > std.h5 && motion-info --check full std.h5
0 true bvh2npz -q good.bvh -o - | canonicalize -q - --body source -o rign.h5 && ./q 'np.allclose(a[0].q, a[1].q, atol=1e-5) and np.allclose(a[0].f["skeleton/end_sites"], a[1].f["skeleton/end_sites"], atol=1e-6)' rig.h5 rign.h5
0 true canonicalize -q rig.h5 --body source -o rig2.h5 && ./q 'np.allclose(a[0].q, a[1].q, atol=1e-6) and a[0].col("skeleton/joint_names") == a[1].col("skeleton/joint_names")' rig.h5 rig2.h5
0 true canonicalize -q rig.h5 -o onto.h5 && ./q 'a[0].q.shape[1] == 22 and np.allclose(a[0].q, a[1].q, atol=1e-5)' onto.h5 good.h5
1 ~other\.bvh.*joint.2.is.'Chest',.expected.'Spine1' canonicalize good.bvh other.bvh --body source -o two.h5
0 ~bones.differ.from.the.first canonicalize good.bvh longer.bvh --body source -o two.h5 -f
3 ~no.input.has.a.skeleton canonicalize legless.bvh --body source -o x.h5
2 ~--body canonicalize good.bvh --body other -o x.h5

# --joint-map
3 ~bones\.bvh.*no.joint.found.for.left_hip,.right_hip,.left_knee.*not.placed:.*BoneLeftA,.BoneLeftB canonicalize bones.bvh -o x.h5
3 ~hint:.--joint-map canonicalize bones.bvh -o x.h5
0 true canonicalize -q bones.bvh --joint-map map.toml -o bones.h5 && ./q 'np.array_equal(a[0].q, a[1].q) and [i["path"] for i in a[1].history[-1]["inputs"]] == ["bones.bvh", "map.toml"]' good.h5 bones.h5
0 true (cat map.toml; echo 'head = ""') > headless.toml; canonicalize -q bones.bvh --joint-map headless.toml -o headless.h5 && ./q 'not np.array_equal(a[0].q, a[1].q)' good.h5 headless.h5
3 ~bones\.bvh.*joint.'Bone9'.for.left_hip.is.not printf '[joints]\nleft_hip = "Bone9"\n' > m.toml; canonicalize bones.bvh --joint-map m.toml -o x.h5
3 ~m\.toml:3:.'left_thigh',.expected.a.joint printf '[joints]\n\nleft_thigh = "A"\n' > m.toml; canonicalize bones.bvh --joint-map m.toml -o x.h5
3 ~m\.toml:2:.*expected.TOML printf '[joints]\nleft_hip = Bone\n' > m.toml; canonicalize bones.bvh --joint-map m.toml -o x.h5
3 ~absent\.toml canonicalize bones.bvh --joint-map absent.toml -o x.h5

# --alignment
0 true canonicalize -q good.bvh --alignment rest -o rest.h5 && ./q 'np.array_equal(a[0].q, a[1].q)' good.h5 rest.h5
0 true canonicalize -q good.bvh --alignment motion -o motion.h5 && ./q '0 < np.abs(a[0].q - a[1].q).max() and np.abs(a[0].p - a[1].p).max() < 0.1' good.h5 motion.h5
3 ~seated\.bvh.*does.not.stand canonicalize seated.bvh --alignment rest -o x.h5
0 ~joint.axes.are.taken.from.the.motion canonicalize seated.bvh -o seated.h5
2 ~--alignment canonicalize good.bvh --alignment pose -o x.h5

# --mirror
0 true canonicalize -q whole --mirror -o mir.h5 && ./q 'a[0].names == ["a", "a@m", "sub/b", "sub/b@m"] and list(a[0].f["clips/mirrored"][()]) == [0, 1, 0, 1]' mir.h5
0 true ./q 'np.allclose(a[0].p[30:60] * [1, -1, 1], a[0].p[:30], atol=1e-6) and np.array_equal(a[0].f["frames/contacts"][30:60], a[0].f["frames/contacts"][:30][:, ::-1])' mir.h5
0 true canonicalize -q good.bvh --phases all --fps 15 --mirror -o mp.h5 && ./q 'a[0].names == ["good", "good@m", "good@1", "good@1@m"]' mp.h5
0 true canonicalize -q good.bvh --body source --mirror -o ms2.h5 && ./q 'a[0].names == ["good", "good@m"]' ms2.h5

# --report
0 ~bone.directions.against.the.source:.limbs canonicalize good.bvh --report report.tsv -o rep.h5
0 . cmp rep.h5 good.h5
0 . test "$(head -1 report.tsv)" = "$(printf 'clip\tjoint\tchild\tsource_joint\tmean_deg\tworst_deg\tworst_frame\tstill_frames\tadded_slide_mm_s')"
0 . awk -F'\t' 'NF != 9 || (NR > 1 && $1 != "good") { exit 1 }' report.tsv
0 . awk -F'\t' '$2 == "left_knee" && $3 == "left_ankle" && $4 == "LeftLeg" && $5 >= 0 && $6 >= $5 && $7 < 30 { found = 1 } END { exit !found }' report.tsv
0 . canonicalize -q corpus --report corpus.tsv -o repc.h5 && awk -F'\t' '$1 ~ /walking/ && $2 == "left_foot" && $3 == "" && $8 > 0 && $9 < 5 { found = 1 } END { exit !found }' corpus.tsv
4 ~report\.tsv:.exists canonicalize good.bvh --report report.tsv -o rep2.h5
1 . test -e rep2.h5
0 . canonicalize -q good.bvh --report report.tsv -f -o rep2.h5
2 ~--report.--body.source canonicalize good.bvh --body source --report r2.tsv -o x.h5

# a reflection is no rotation
3 ~reflected\.bvh.*right-handed canonicalize reflected.bvh -o x.h5
1 ~1.of.2.inputs.failed canonicalize good.bvh reflected.bvh -o refl.h5

# BVH to npz to archive to BVH to archive is the same motion, end sites too
0 true canonicalize -q corpus --fps 120 -o rt1.h5 && bvh2npz -q corpus -o rtn && canonicalize -q rtn --fps 120 -o rt2.h5 && motion-export -q rt2.h5 -o rtb && canonicalize -q rtb --fps 120 -o rt3.h5 && ./q 'all(near(a[0], b) for b in a[1:])' rt1.h5 rt2.h5 rt3.h5
0 true f=$(ls corpus/*.bvh | head -1); canonicalize -q $f --fps 120 --body source -o rs1.h5 && bvh2npz -q $f -o - | canonicalize -q - --fps 120 --body source -o rs2.h5 && motion-export -q rs2.h5 -o rs.bvh && canonicalize -q rs.bvh --fps 120 --body source -o rs3.h5 && ./q 'all(near(a[0], b) for b in a[1:])' rs1.h5 rs2.h5 rs3.h5

# probabilities that a classifier left in an archive stay there
0 true canonicalize -q corpus -o judged.h5 && /usr/bin/python3 -c 'import h5py, numpy as np; f = h5py.File("judged.h5", "a"); n = len(f["clips/name"]); g = f["clips"]; g.create_group("attribute_classes").create_dataset("mood", data=np.array([b"glad", b"sad"], dtype=h5py.string_dtype("utf-8", 4)), chunks=(2,), fletcher32=True); g.create_group("attribute_probability").create_dataset("mood", data=np.tile(np.float32([0.25, 0.75]), (n, 1)), chunks=(n, 2), fletcher32=True)' && canonicalize -q judged.h5 -o judged2.h5 && canonicalize -q - -o judged3.h5 < judged.h5 && /usr/bin/python3 -c 'import h5py; a = [h5py.File(p)["clips/attribute_probability/mood"][()] for p in ("judged2.h5", "judged3.h5")]; print(all(len(x) > 0 and (x == [0.25, 0.75]).all() for x in a))'
