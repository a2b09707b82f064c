# STATUS EXPECTED COMMAND (see run.sh). What every tool shares is tried here, once.
# setup: cp $DATA/bvh/tiny_human.bvh good.bvh; gzip -c good.bvh > packed.gz; head -c 9000 good.bvh > cut.bvh; echo nope > bad.bvh; : > empty.bvh
# setup: mkdir -p in/sub in/.hidden tmp; cp good.bvh in/a.bvh; sed 's/^0\.0000 9/1.0000 9/' good.bvh > in/sub/b.bvh; printf 'HIERARCHY\nROOT Hips\n' > in/broken.bvh; cp good.bvh in/.hidden/h.bvh; echo text > in/notes.txt
# setup: mkdir whole; cp in/a.bvh whole/; cp -r in/sub whole/; printf 'whole/a.bvh\nwhole/sub/b.bvh\n' > list.txt
# setup: cat > q.py <<'END'
# setup: import sys, numpy as np
# setup: z = np.load(sys.argv[1], allow_pickle=False)
# setup: print(eval(sys.argv[2], {"np": np, **{k: z[k] for k in z.files}}))
# setup: END
# setup: cat > q <<'END'
# setup: #!/bin/sh
# setup: exec /usr/bin/python3 q.py "$@"
# setup: END
# setup: chmod +x q; echo 30 > 30; echo 29 > 29; echo True > true; echo 141 > 141; echo 2 > 2; printf 'a.npz\nsub/b.npz\n' > two
# setup: mkdir mocap zipped alone; cp $DATA/asf/tiny.asf mocap/07.asf; cp mocap/07.asf zipped/07.asf; for n in mocap/07_05 mocap/07_06 alone/07_05; do cp $DATA/asf/tiny.amc $n.amc; done; head -c 317 mocap/07_05.amc > cut.amc
# setup: printf 'file\tstatus\nbad.bvh\t3\nabsent.bvh\t3\nin/broken.bvh\t3\n' > fails

# help and version: no data at hand, standard output checked
0 ~^Usage:.bvh2npz.*INPUT\.\.\..-o bvh2npz --help
0 ~--first-frame bvh2npz -h
0 ~^commit.[0-9a-f]+|^commit.unknown bvh2npz --version
0 ~^HDF5.[0-9]+\. bvh2npz --version
0 ~^bvh2npz.\(mocapkit\).[0-9.]+$ bvh2npz --version
4 ~write.failed bvh2npz --help > /dev/full
4 ~write.failed bvh2npz --version > /dev/full
4 ~write.failed bvh2npz --help >&-
0 ~^#.bvh2npz$ bvh2npz --print-docs markdown
0 ~^\.TH.BVH2NPZ bvh2npz --print-docs man

# one file
0 . bvh2npz good.bvh -o good.npz
0 30 ./q good.npz 'len(poses)'
0 true ./q good.npz 'np.allclose(trans[0], (0, 0, 0.915))'
0 true ./q good.npz 'np.allclose(trans[-1], (1.16, 0.015 * np.sin(2*np.pi*29/30), 0.90 + 0.015*np.cos(4*np.pi*29/30)), atol=1e-5)'
0 true ./q good.npz 'np.allclose(rest_offsets[list(joint_names).index("LeftToeBase")], (0.13, 0, -0.05))'
0 true ./q good.npz 'mocap_framerate == 30 and poses.shape == (30, 63) and parents[0] == -1'
0 true ./q good.npz '"\"path\":\"good.bvh\"" in str(history) and "--up=auto" in str(history) and "output" not in str(history)'
0 30 bvh2npz packed.gz -o packed.npz && ./q packed.npz 'len(poses)'
0 30 bvh2npz - -o - < good.bvh > piped.npz && ./q piped.npz 'len(poses)'
0 30 bvh2npz good.bvh -o - | bvh2npz - -o - > twice.npz && ./q twice.npz 'len(poses)'
0 2 ./q twice.npz 'len(str(history).strip().split("\n"))'

# the same bytes for any thread count, time zone, folder and spelling
0 . cd tmp && TZ=Asia/Tokyo bvh2npz -j 1 ../good.bvh --output other.npz && cmp other.npz ../good.npz && rm other.npz
0 . bvh2npz whole -o j1 -j1 && bvh2npz whole --output j4 --threads=4 && diff -r j1 j4

# reading options
0 true bvh2npz good.bvh --unit m -o - > m.npz && ./q m.npz 'np.allclose(trans[0], (0, 0, 91.5))'
0 true bvh2npz good.bvh --unit mm -o - > m.npz && ./q m.npz 'np.allclose(trans[0], (0, 0, 0.0915))'
0 true bvh2npz good.bvh --unit in -o - > m.npz && ./q m.npz 'np.allclose(trans[0], (0, 0, 91.5 * 0.0254))'
0 true bvh2npz good.bvh --unit cmu -o - > m.npz && ./q m.npz 'np.allclose(trans[0], (0, 0, 91.5 * 0.0254 / 0.45))'
0 true bvh2npz good.bvh --up z --unit cm -o - > z.npz && ./q z.npz 'np.allclose(trans[0], (0, 0.915, 0))'
0 true bvh2npz good.bvh --up=y --unit=cm -o - > z.npz && ./q z.npz 'np.allclose(trans[0], (0, 0, 0.915))'
0 29 bvh2npz good.bvh --first-frame drop -o - > d.npz && ./q d.npz 'len(poses)'
0 30 bvh2npz good.bvh --first-frame keep -o - > d.npz && ./q d.npz 'len(poses)'
3 ~cut\.bvh:[0-9]+ bvh2npz cut.bvh -o cut.npz
0 true bvh2npz cut.bvh --lenient -o - > l.npz && ./q l.npz '0 < len(poses) < 30'

# usage
2 ~no.input.given bvh2npz
2 ~no.output.given bvh2npz good.bvh
2 ~unknown.option.--fsp bvh2npz good.bvh --fsp 30 -o x.npz
2 ~did.you.mean.--unit bvh2npz good.bvh --unti m -o x.npz
2 ~unknown.option.--first bvh2npz good.bvh --first keep -o x.npz
2 ~'inches',.expected.one.of bvh2npz good.bvh --unit inches -o x.npz
2 ~no.value.given bvh2npz good.bvh -o
2 ~given.2.times bvh2npz good.bvh -o x.npz -o y.npz
2 ~empty.value bvh2npz good.bvh --unit= m -o x.npz
2 ~whole.number.from.1 bvh2npz good.bvh -j 0 -o x.npz
2 ~whole.number bvh2npz good.bvh -j 0x2 -o x.npz
2 ~exclude bvh2npz good.bvh -q -v -o x.npz
2 ~expected.one.of bvh2npz good.bvh --log-level loud -o x.npz
2 ~expected.one.of bvh2npz good.bvh --progress yes -o x.npz
2 ~I/N bvh2npz in --shard 3/2 -o x
2 ~2.inputs.for.one.output bvh2npz good.bvh packed.gz -o x.npz
2 ~2.inputs.for.one.output bvh2npz whole -o -
2 ~'-'.given.twice bvh2npz - - -o x
2 ~same.file bvh2npz good.bvh -o x --rejects x
2 ~terminal script -qec 'bvh2npz good.bvh -o -' /dev/null
1 . test -e x.npz -o -e x

# bad input
3 ~^bvh2npz:.absent\.bvh:.cannot.be.opened bvh2npz absent.bvh -o x.npz
3 ~^bvh2npz:.bad\.bvh: bvh2npz bad.bvh -o x.npz
3 ~^bvh2npz:.empty\.bvh: bvh2npz empty.bvh -o x.npz
3 ~^bvh2npz:.<stdin>: bvh2npz - -o x.npz
3 ~^bvh2npz:.in/broken\.bvh: bvh2npz in/broken.bvh -o x.npz
3 ~a.folder.without bvh2npz tmp -o x
3 ~nolist:.cannot.be.opened bvh2npz @nolist -o x
1 . test -e x.npz -o -e x

# output
4 ~exists.already bvh2npz good.bvh -o good.npz
4 ~exists.already bvh2npz absent.bvh good.bvh -o j1 --rejects good.npz
0 . bvh2npz good.bvh -o good.npz -f
0 . bvh2npz good.bvh -o good.npz --force
4 ~nowhere bvh2npz good.bvh -o nowhere/x.npz
4 ~write.failed bvh2npz good.bvh -o - > /dev/full
4 ~write.failed bvh2npz good.bvh -o - >&-
4 ~a.file,.expected.a.folder bvh2npz whole -o bad.bvh
0 141 { sleep 0.3; TMPDIR=$PWD/tmp bvh2npz good.bvh -o -; echo $? > died; } 2> noise | true; test ! -s noise && cat died
0 . test -z "$(ls tmp)"

# batches
1 . bvh2npz good.bvh bad.bvh absent.bvh in -o many --rejects fails.tsv
0 fails cut -f 1,3 fails.tsv
0 ~^in/broken\.bvh[[:space:]][0-9]+[[:space:]]3[[:space:]]. cat fails.tsv
0 . test -e many/good.npz -a -e many/a.npz -a -e many/sub/b.npz -a ! -e many/.hidden
1 ~2.of.2.inputs.failed bvh2npz bad.bvh absent.bvh -o none
1 . test -e none
1 ~1.of.4.inputs.failed bvh2npz bad.bvh good.bvh in/a.bvh in/sub/b.bvh --fail-fast -o ff
1 . test -e ff
0 . bvh2npz @list.txt -o listed && test "$(cd listed && echo *)" = 'a.npz b.npz'
0 two bvh2npz whole -o s --shard 1/2 && bvh2npz whole -o s --shard 2/2 && cd s && find . -name '*.npz' | sort | sed 's,./,,'
0 . diff -r s j1
4 ~a\.npz:.exists.already bvh2npz absent.bvh whole -o s
0 . bvh2npz whole -o whole/out && bvh2npz whole -o whole/out -f && test ! -e whole/out/out && rm -r whole/out
0 two bvh2npz good.bvh whole/a.bvh -o met && bvh2npz in/a.bvh whole/a.bvh -o met && test -e met/in/a.npz -a -e met/whole/a.npz && cat two

# a rerun writes what is missing or changed, and nothing else
0 two cd s && find . -name '*.npz' -exec touch -d 2000-01-01 {} + && cd .. && bvh2npz whole -o s --skip-existing && cd s && find . -name '*.npz' ! -newermt 2001-01-01 | sort | sed 's,./,,'
0 two rm s/sub/b.npz && bvh2npz whole -o s --skip-existing && cd s && find . -name '*.npz' | sort | sed 's,./,,'
0 . test -n "$(find s/sub/b.npz -newermt 2001-01-01)" -a -z "$(find s/a.npz -newermt 2001-01-01)"
0 . cp good.bvh whole/sub/b.bvh && touch -d 2000-01-01 s/sub/b.npz && bvh2npz whole -o s --skip-existing && test -n "$(find s/sub/b.npz -newermt 2001-01-01)" -a -z "$(find s/a.npz -newermt 2001-01-01)"
0 . bvh2npz whole -o s --skip-existing --up y && test -n "$(find s/a.npz -newermt 2001-01-01)"
4 ~not.made.by.bvh2npz echo mine > s/a.npz; bvh2npz whole -o s --skip-existing
0 . bvh2npz whole -o s --skip-existing -f

# archives: one file per clip
0 . canonicalize -q whole -o two.h5 && bvh2npz two.h5 -o arch && test "$(cd arch && echo *)" = 'a.npz sub_b.npz'
0 . bvh2npz two.h5 good.bvh -o arch2 && test -e arch2/two/a.npz -a -e arch2/two/sub_b.npz -a -e arch2/good.npz
0 2 ./q arch/a.npz 'len(str(history).strip().split("\n"))'
2 ~2.clips.for.one.output bvh2npz two.h5 -o x.npz
2 ~2.clips.for.one.output bvh2npz - -o - < two.h5
4 ~sub_b\.npz:.exists.already rm arch/a.npz; bvh2npz two.h5 -o arch
1 . test -e arch/a.npz
3 ~^bvh2npz:.cut\.h5: head -c 5000 two.h5 > cut.h5; bvh2npz cut.h5 -o x

# names
0 . mkdir odd && cp good.bvh 'odd/-dash.bvh' && cp good.bvh 'odd/sp ace.bvh' && cp good.bvh "odd/new"$'\n'"line.bvh" && cp good.bvh 'odd/[1].bvh' && cp good.bvh odd/äöü.bvh && bvh2npz odd -o odd2 && test $(ls odd2 | wc -l) = 6
0 . cd odd && bvh2npz -o ../dash.npz -- -dash.bvh
0 . cd odd && bvh2npz '[1].bvh' -o ../bracket.npz

# configuration, messages, progress
0 true printf '# c\nup = "z"\nunit = "cm"\n[canonicalize]\nfps = 30\n' > c.toml; bvh2npz good.bvh --config c.toml -o - > c.npz && ./q c.npz 'np.allclose(trans[0], (0, 0.915, 0))'
0 true bvh2npz good.bvh --config c.toml --up y -o - > c.npz && ./q c.npz 'np.allclose(trans[0], (0, 0, 0.915))'
0 . bvh2npz --config c.toml --print-config > e.toml && bvh2npz --config e.toml --print-config | cmp - e.toml
2 ~c1:.unknown.option.'upp' echo 'upp = "z"' > c1; bvh2npz good.bvh --config c1 -o x.npz
2 ~c2:2: printf 'up = "z"\nup = "y"\n' > c2; bvh2npz good.bvh --config c2 -o x.npz
2 ~absent.toml:.cannot.be.read bvh2npz good.bvh --config absent.toml -o x.npz
0 ~unit.cm,.up.axis.y bvh2npz good.bvh -v -o v.npz
0 ~unit.cm,.up.axis.y bvh2npz good.bvh --log-level debug -f -o v.npz
3 ~^..status:.3 bvh2npz bad.bvh -v -v -o x.npz
0 . test -z "$(bvh2npz good.bvh -q -f -o v.npz 2>&1)"
0 ~^2/2.files,.*files/s,.0:00.left bvh2npz whole -o prog --progress always
0 . test -z "$(bvh2npz whole -f -o prog --progress never 2>&1)"
1 . test -n "$(find . -name '*.part-*')"
1 . test -e x.npz

# rates by a table; npz files without motion in a folder
# setup: printf 'pattern\trate\n*/sub/*\t60\ngood.bvh\t30000/1001\nb?.npz\t5\n' > rates.tsv; mkdir amass; cp $DATA/npz/shape.npz amass; cp $DATA/npz/amass_smplh.npz amass/w_poses.npz
0 true bvh2npz good.bvh --fps-override rates.tsv -o r.npz && ./q r.npz 'mocap_framerate == 30000 / 1001 and "\"rates.tsv\"" in str(history)'
0 true bvh2npz whole --fps-override rates.tsv -o rated && ./q rated/sub/b.npz 'mocap_framerate == 60 and np.load("rated/a.npz")["mocap_framerate"] == 30'
0 ~rates\.tsv:4:.the.pattern.'b\?\.npz'.set.no.file.s.rate bvh2npz good.bvh --fps-override rates.tsv -f -o r.npz
0 . touch -d 2000-01-01 r.npz && bvh2npz good.bvh --fps-override rates.tsv --skip-existing -o r.npz && test -z "$(find r.npz -newermt 2001-01-01)"
3 ~^bvh2npz:.bad\.tsv:2:rate:.'0' printf 'pattern\trate\n*\t0\n' > bad.tsv; bvh2npz good.bvh --fps-override bad.tsv -o x.npz
0 ~amass/shape\.npz:.skipped:.no.poses bvh2npz amass -o am && test "$(ls am)" = w_poses.npz
3 ~a.folder.without.any.file.that.can.be.read mkdir shapes && cp amass/shape.npz shapes && bvh2npz shapes -o x
1 . test -e x.npz -o -e x
# ASF and AMC: the skeleton is found beside the motion or named
0 ~skeleton.07\.asf,.unit.asf.\(0\.0564444.m\),.up.axis bvh2npz mocap/07_05.amc -v -o amc.npz
0 true ./q amc.npz 'np.allclose(trans[0], np.array((-3.25, 1.5, 16)) * 0.0254 / 0.45) and mocap_framerate == 120 and poses.shape == (3, 21)'
0 true ./q amc.npz 'list(joint_names) == ["root", "lhip", "lthigh", "lshin", "lfoot", "spine", "head"]'
0 true ./q amc.npz '"\"path\":\"07_05.amc\"" in str(history) and "\"path\":\"07.asf\"" in str(history)'
0 true bvh2npz - --asf mocap/07.asf --up y -o - < mocap/07_05.amc > in.npz && ./q in.npz 'len(poses) == 3 and "--asf=07.asf" in str(history)'
0 true bvh2npz mocap/07_05.amc --unit m --up y -o - > m.npz && ./q m.npz 'np.allclose(trans[0], (-3.25, 1.5, 16))'
0 . gzip -c mocap/07_05.amc > zipped/07_05.amc.gz && bvh2npz zipped/07_05.amc.gz -o zipped.npz
0 . bvh2npz mocap -o amcs && test "$(cd amcs && echo *)" = '07_05.npz 07_06.npz'
3 ~^bvh2npz:.<stdin>:.motion.\(AMC\).without.its.skeleton bvh2npz - -o x.npz < mocap/07_05.amc
3 ~hint:.--asf.FILE bvh2npz alone/07_05.amc -o x.npz
3 ~^bvh2npz:.alone/07_05\.amc:.*found.none bvh2npz alone/07_05.amc -o x.npz
3 ~^bvh2npz:.absent\.asf:.cannot.be.opened bvh2npz alone/07_05.amc --asf absent.asf -o x.npz
3 ~^bvh2npz:.good\.bvh:.no.skeleton,.expected.an.ASF bvh2npz alone/07_05.amc --asf good.bvh -o x.npz
3 ~^bvh2npz:.mocap/07\.asf:.a.skeleton.\(ASF\).without.motion bvh2npz mocap/07.asf -o x.npz
3 ~^bvh2npz:.cut\.amc:[0-9]+:frame.3:.bone.lshin.*expected bvh2npz cut.amc --asf mocap/07.asf -o x.npz
0 true bvh2npz cut.amc --asf mocap/07.asf --lenient -o - > l.npz && ./q l.npz 'len(poses) == 2'
2 ~empty.value bvh2npz mocap/07_05.amc --asf= -o x.npz
0 . cd amcs && touch -d 2000-01-01 * && cd .. && bvh2npz mocap -o amcs --skip-existing && test -z "$(find amcs -name '*.npz' -newermt 2001-01-01)"
0 . sed -i 's/length 4.25/length 4.5/' mocap/07.asf && bvh2npz mocap -o amcs --skip-existing && test "$(find amcs -name '*.npz' -newermt 2001-01-01 | wc -l)" = 2
1 . test -e x.npz
