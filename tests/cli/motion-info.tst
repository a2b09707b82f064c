# STATUS EXPECTED COMMAND (see run.sh). What every tool shares is tried in bvh2npz.tst.
# setup: mkdir in tmp; cp $DATA/bvh/tiny_human.bvh in/a.bvh; sed 's/^0\.0000 9/1.0000 9/' in/a.bvh > in/b.bvh; cp in/a.bvh good.bvh; echo nope > bad.bvh; : > empty.h5
# setup: printf 'file\taction\tgender\na\twalking\tfemale\nb\tjogging\t\n' > labels.tsv; bvh2npz -q good.bvh -o good.npz
# setup: canonicalize -q in --labels labels.tsv -o two.h5; head -c 5000 two.h5 > cut.h5
# setup: cat > edit.py <<'END'
# setup: import sys, h5py, numpy as np
# setup: with h5py.File(sys.argv[1], "r+", libver=("v110", "v110")) as f: exec(sys.argv[2])
# setup: END
# setup: printf '#!/bin/sh\nexec /usr/bin/python3 edit.py "$@"\n' > edit; printf '#!/bin/sh\nexec /usr/bin/python3 -c "import sys, json; d = json.load(sys.stdin); print($1)"\n' > j; chmod +x edit j
# setup: cp two.h5 moved.h5; ./edit moved.h5 'f["frames/root_position"][3, 2] = 9'; cp two.h5 started.h5; ./edit started.h5 'f["clips/start"][1] = 7'
# setup: cp two.h5 unfinished.h5; ./edit unfinished.h5 'del f.attrs["complete"]'; cp two.h5 newer.h5; ./edit newer.h5 'f.attrs["format_version"] = np.int32(2)'
# setup: cp two.h5 damaged.h5; /usr/bin/python3 -c 'import h5py; f = h5py.File("two.h5"); at = f["frames/rotations"].id.get_chunk_info(0).byte_offset + 50; g = open("damaged.h5", "r+b"); g.seek(at); b = g.read(1); g.seek(at); g.write(bytes([b[0] ^ 4]))'
# setup: /usr/bin/python3 $DATA/store/make_model.py model.h5; cp model.h5 nan.h5; cp model.h5 hurt.h5
# setup: /usr/bin/python3 -c 'import h5py; f = h5py.File("model.h5"); at = f["weights/decoder/weight"].id.get_chunk_info(0).byte_offset + 9; g = open("hurt.h5", "r+b"); g.seek(at); b = g.read(1); g.seek(at); g.write(bytes([b[0] ^ 4]))'
# setup: cp two.h5 axes.h5; ./edit axes.h5 'for n, v in (("unit", np.array([b"cm", b"in"], h5py.string_dtype("utf-8", 2))), ("up_axis", np.array([b"y", b""], h5py.string_dtype("utf-8", 1))), ("scale", [0.5, 1.0]), ("yaw", [0.25, 0.0]), ("origin", [[1.0, 2, 3], [0, 0, 0]])): del f["clips/source_" + n]; f.create_dataset("clips/source_" + n, data=v, chunks=np.shape(v), shuffle=True, fletcher32=True)'
# setup: cp two.h5 older.h5; ./edit older.h5 'for n in ("unit", "up_axis", "scale", "yaw", "origin"): del f["clips/source_" + n]'
# setup: cp axes.h5 sideways.h5; ./edit sideways.h5 'f["clips/source_up_axis"][0] = b"x"'
# setup: echo True > true; echo 141 > 141; echo 'two.h5: ok (quick check)' > quick; echo 'two.h5: ok (full check)' > full; echo 'model.h5: ok (full check)' > model

0 ~^Usage:.motion-info.*INPUT motion-info --help
0 ~^motion-info.\(mocapkit\) motion-info --version
4 ~write.failed motion-info two.h5 > /dev/full

# an archive
0 ~^two\.h5:.motion.archive,.2.clips,.[0-9]+.frames,.*at.30.Hz$ motion-info two.h5
0 ~^....pelvis motion-info two.h5
0 ~left_hip.-.left_knee.-.left_ankle.-.left_foot motion-info two.h5
0 ~left_wrist.\[left_hand\] motion-info two.h5
0 ~attribute...action:.jogging.1,.walking.1$ motion-info two.h5
0 ~attribute...gender:.\(none\).1,.female.1$ motion-info two.h5
0 ~contacts....preset:default motion-info two.h5
0 ~last........canonicalize.*--contacts=default motion-info two.h5
0 ~clip.*a:.*action=walking.gender=female,.from.a\.bvh motion-info --list two.h5
1 . motion-info two.h5 | grep -q '^  clip '
0 ~^<stdin>:.motion.archive,.2.clips motion-info - < two.h5
0 ~^<stdin>:.motion.archive,.2.clips cat two.h5 | motion-info -
0 true motion-info --json two.h5 | ./j 'd["clips"] == 2 and d["attributes"]["gender"] == {"": 1, "female": 1} and d["skeleton"]["roles"]["left_hand"] == "left_wrist" and len(d["history"]) == 1 and "clip" not in d'
0 true motion-info --json --list two.h5 | ./j '[c["name"] for c in d["clip"]] == ["a", "b"] and d["clip"][0]["source"] == "a.bvh" and sum(c["frames"] for c in d["clip"]) == d["frames"]'
0 true motion-info --json two.h5 good.bvh | ./j 'isinstance(d, list) and [x["format"] for x in d] == ["archive", "bvh"]'

# how its sources were read; archives from before that was kept
0 ~^..source.axes.cm,.y.up:.1\;.in:.1$ motion-info axes.h5
0 ~clip.*a:.*from.a\.bvh.\(cm,.y.up\)$ motion-info --list axes.h5
0 ~clip.*b:.*from.b\.bvh.\(in\)$ motion-info --list axes.h5
0 true motion-info --json --list axes.h5 | ./j '[d["clip"][0]["source_" + n] for n in ("unit", "up_axis", "scale", "yaw", "origin")] == ["cm", "y", 0.5, 0.25, [1, 2, 3]] and d["source_axes"] == {"cm, y up": 1, "in": 1}'
0 true motion-info --json --list older.h5 | ./j '[d["clip"][1]["source_" + n] for n in ("unit", "up_axis", "scale", "yaw", "origin")] == ["", "", 1, 0, [0, 0, 0]] and d["source_axes"] == {}'
0 ~older\.h5:.ok motion-info --check full older.h5
1 ~^sideways\.h5:clip.a:.source.up.axis.'x',.expected.y.or.z$ motion-info --check sideways.h5

# its history is a script
0 ~^canonicalize.*--contacts=default.*--fps=30 motion-info --history two.h5
0 ~^#.input.[0-9a-f]{64}..a\.bvh$ motion-info --history two.h5
0 . motion-info --history two.h5 | sh -n
2 ~exclude motion-info --history --json two.h5
2 ~exclude|--check motion-info --history --check two.h5

# text and npz files
0 ~^good\.bvh:.bvh,.30.frames,.*at.30.Hz$ motion-info good.bvh
0 ~note........unit.cm,.up.axis.y motion-info good.bvh
0 ~unit.m,.up.axis.z motion-info --unit m --up z good.bvh
0 ~^good\.npz:.npz.\(source\),.30.frames motion-info good.npz
0 ~^<stdin>:.bvh,.30.frames motion-info - < good.bvh
0 ~30.frames gzip -c good.bvh | motion-info -

# a model, written by another program
0 ~^model\.h5:.model,.motion-cell,.15.parameters.in.2.tensors,.weights.only$ motion-info model.h5
0 ~config......hidden.=.8$ motion-info model.h5
0 ~vocabulary..action:.walking,.jogging$ motion-info model.h5
0 ~tensor......decoder/weight.\[3,4\]$ motion-info --list model.h5
0 true motion-info --json model.h5 | ./j 'd["kind"] == "motion-cell" and d["config"]["joints"] == 22 and d["parameters"] == 15'
0 ~^<stdin>:.model motion-info - < model.h5
0 ~^train-vrnn.--steps=3 motion-info --history model.h5

# checks: 1 where a readable file breaks an invariant, 3 where it cannot be read
0 quick motion-info --check two.h5
0 quick motion-info --check quick two.h5
0 full motion-info --check full two.h5
0 full motion-info --check=full two.h5
0 model motion-info --check full model.h5
0 ~^good\.bvh:.ok motion-info --check good.bvh
0 true motion-info --check full --json two.h5 | ./j 'd["defects"] == [] and d["check"] == "full"'
0 ~moved\.h5:.ok motion-info --check moved.h5
1 ~^moved\.h5:clip.a:.the.frames.do.not.fit.the.clip's.digest motion-info --check full moved.h5
1 ~^<stdin>:clip.a:.the.frames motion-info --check full - < moved.h5
1 ~^started\.h5:clip.b:.starts.at.frame.7,.expected.30 motion-info --check started.h5
1 ~^damaged\.h5:frames/rotations:.checksum.mismatch:.the.file.is.damaged motion-info --check full damaged.h5
1 ~"defects" motion-info --check full --json damaged.h5
1 ~two\.h5:.ok motion-info --check full moved.h5 two.h5
3 ~^motion-info:.hurt\.h5:weights/decoder/weight:.checksum.mismatch:.the.file.is.damaged$ motion-info hurt.h5
3 ~checksum.mismatch motion-info --check full hurt.h5
3 ~unfinished\.h5:attribute.complete:.missing:.the.file.is.unfinished motion-info --check unfinished.h5
3 ~newer\.h5:attribute.format_version:.2,.expected.1 motion-info newer.h5
3 ~cut\.h5:.truncated:.5000.bytes motion-info cut.h5
3 ~empty motion-info empty.h5
3 ~^motion-info:.bad\.bvh: motion-info --check bad.bvh
3 ~absent\.h5:.cannot.be.opened motion-info absent.h5
3 ~<stdin>:.truncated motion-info - < cut.h5
1 ~1.of.2.inputs.failed motion-info bad.bvh two.h5
1 ~two\.h5:.ok motion-info --check bad.bvh two.h5

# usage
2 ~no.input.given motion-info
2 ~no.input.given motion-info --check
2 ~expected.one.of motion-info --check=deep two.h5
2 ~unknown.option motion-info --chek two.h5

# folders; names that reach for the terminal; quiet pipes; nothing left
0 ~a\.bvh motion-info in
0 . cp model.h5 in/m.h5 && motion-info in | grep -c 'frames\|parameters' | grep -qx 3
0 ~x\\x1b\[31m motion-info --list "$(cp good.bvh in/$'x\033[31m.bvh'; canonicalize -q in/x* -o esc.h5; echo esc.h5)"
0 141 { sleep 0.3; TMPDIR=$PWD/tmp motion-info - < two.h5; echo $? > died; } 2> noise | true; test ! -s noise && cat died
0 . test -z "$(ls tmp)"

# how a mocap file is read
3 ~declared motion-info $DATA/bvh/bad_more_rows.bvh
0 . motion-info --lenient $DATA/bvh/bad_more_rows.bvh
0 ~30.frames motion-info --first-frame keep good.bvh
0 ~29.frames motion-info --first-frame drop good.bvh

# rates by a table; npz files without motion
0 ~^good\.bvh:.bvh,.30.frames,.*at.60.Hz$ printf 'pattern\trate\ngood.bvh\t60\n' > rates.tsv; motion-info --fps-override rates.tsv good.bvh
0 ~note........60.Hz.by.--fps-override,.the.file.says.30.Hz motion-info --fps-override rates.tsv good.bvh
0 ~rates\.tsv:2:.the.pattern motion-info --fps-override rates.tsv good.npz
3 ~rates\.tsv:1:.a.header printf '*\t60\n' > rates.tsv; motion-info --fps-override rates.tsv good.bvh
0 ~shapes/shape\.npz:.skipped:.no.poses mkdir shapes && cp $DATA/npz/shape.npz good.npz shapes && motion-info shapes
3 ~no.poses:.a.shape.file motion-info shapes/shape.npz
0 ~amc,.60.frames,.*at.120.Hz motion-info $DATA/asf/human.amc
0 ~lhipjoint.-.lfemur..left_hip..-.ltibia..left_knee..-.lfoot..left_ankle..-.ltoes..left_foot. motion-info $DATA/asf/human.amc
0 ~note.*unit.asf.\(0\.0564444.m\),.up.axis.y motion-info $DATA/asf/human.amc
0 ~note.*120.Hz.assumed motion-info $DATA/asf/human.amc
0 ~60.frames motion-info --asf $DATA/asf/human.asf - < $DATA/asf/human.amc
3 ~^motion-info:.<stdin>:.motion.\(AMC\).without.its.skeleton motion-info - < $DATA/asf/human.amc
3 ~a.skeleton.\(ASF\).without.motion motion-info $DATA/asf/human.asf
3 ~bad_nan\.amc:11:frame.2:.bone.shin motion-info --asf $DATA/asf/plain.asf $DATA/asf/bad_nan.amc
3 ~bad_loop\.asf:19:bone.thigh: motion-info --asf $DATA/asf/bad_loop.asf $DATA/asf/plain.amc
