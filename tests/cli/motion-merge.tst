# STATUS EXPECTED COMMAND (see run.sh). What every tool shares is tried in bvh2npz.tst; all shards of larger runs in tests/pipeline/shards.sh.
# setup: make-corpus -q --subjects 1 --seconds 1 --transitions 1 -o corpus; mkdir tmp nothing shards; cp corpus/walking_f001_1.bvh one.bvh
# setup: for k in 1 2 3; do canonicalize -q corpus --labels corpus/labels.tsv --shard $k/3 -o s$k.h5; done; canonicalize -q corpus --labels corpus/labels.tsv -o whole.h5; cp s?.h5 shards
# setup: canonicalize -q one.bvh -o one.h5; canonicalize -q one.bvh --fps 60 -o f60.h5; canonicalize -q one.bvh --contacts holden -o holden.h5; head -c 9000 s3.h5 > cut.h5; cp s1.h5 copy.h5; ln -s s1.h5 link.h5
# setup: canonicalize -q corpus/jogging_f001_1.bvh -o jog.h5; mkdir x y; cp one.bvh x/w.bvh; cp corpus/jogging_f001_1.bvh y/w.bvh; canonicalize -q x/w.bvh -o x.h5; canonicalize -q y/w.bvh -o y.h5
# setup: cat > q.py <<'END'
# setup: import sys, json, h5py, numpy as np
# setup: class Archive:
# setup:     def __init__(self, path):
# setup:         self.f = f = h5py.File(path)
# setup:         self.names, self.sources = self.col("clips/name"), self.col("clips/source")
# setup:         self.history = [json.loads(l) for l in bytes(f["history"][()]).decode().splitlines()]
# setup:         self.inputs = [i["path"] for i in self.history[-1]["inputs"]]
# setup:     def col(self, name): return [v.decode() for v in self.f[name][()]]
# setup:     def of(self, name):
# setup:         i = self.names.index(name); a, n = self.f["clips/start"][i], self.f["clips/length"][i]
# setup:         return self.f["frames/rotations"][a:a + n], self.f["frames/root_position"][a:a + n], self.f["frames/contacts"][a:a + n]
# setup: def same(a, x, b, y): return all(np.array_equal(p, q) for p, q in zip(a.of(x), b.of(y)))
# setup: print(eval(sys.argv[1], {**globals(), "a": [Archive(p) for p in sys.argv[2:]]}))
# setup: END
# setup: printf '#!/bin/sh\nexec /usr/bin/python3 q.py "$@"\n' > q; chmod +x q; echo True > true; echo 141 > 141
# setup: cat > edit.py <<'END'
# setup: import sys, h5py, numpy as np
# setup: with h5py.File(sys.argv[1], "r+", libver=("v110", "v110")) as f: exec(sys.argv[2])
# setup: END
# setup: cp one.h5 long.h5; /usr/bin/python3 edit.py long.h5 'f["skeleton/rest_offsets"][4, 2] += 0.012'; cp one.h5 named.h5; /usr/bin/python3 edit.py named.h5 'f["skeleton/joint_names"][3] = b"chest"; f["skeleton/roles"][...] = f["skeleton/roles"][:]'
# setup: cp one.h5 role.h5; /usr/bin/python3 edit.py role.h5 'r = f["skeleton/roles"][:]; r[0, 1] = b"neck"; f["skeleton/roles"][...] = r'; cp one.h5 hurt.h5; /usr/bin/python3 -c 'import h5py; f = h5py.File("one.h5"); at = f["frames/rotations"].id.get_chunk_info(0).byte_offset + 50; g = open("hurt.h5", "r+b"); g.seek(at); b = g.read(1); g.seek(at); g.write(bytes([b[0] ^ 4]))'

0 ~^Usage:.motion-merge.*INPUT\.\.\..-o motion-merge --help
0 ~^motion-merge.\(mocapkit\) motion-merge --version

# shards of one command are the run that was not cut up, in any order and any grouping
0 ~10.clips.of.3.shards.of.one.command motion-merge s1.h5 s2.h5 s3.h5 -o m.h5
0 . cmp m.h5 whole.h5
0 . motion-merge -q s3.h5 s1.h5 s2.h5 -o - | cmp - whole.h5
0 . motion-merge -q shards -o folder.h5 && cmp folder.h5 whole.h5
0 . motion-merge -q s3.h5 s2.h5 -o s23.h5 && motion-merge -q s23.h5 s1.h5 -o again.h5 && cmp again.h5 whole.h5
0 . cat s2.h5 | motion-merge -q s1.h5 - s3.h5 -o piped.h5 && cmp piped.h5 whole.h5
0 . printf 's1.h5\ns2.h5\ns3.h5\n' > list.txt && motion-merge -q @list.txt -o listed.h5 && cmp listed.h5 whole.h5
0 ~s2\.h5:.3.clips motion-merge -v s1.h5 s2.h5 s3.h5 -o verbose.h5
0 ~ok motion-info --check full m.h5
0 true ./q 'len(a[0].names) == 6 and len(a[0].history) == 1' s23.h5
0 . motion-merge -q whole.h5 -o lone.h5 && cmp lone.h5 whole.h5

# other archives: one after the other, with the histories of all and this command
0 ~2.clips.of.2.archives bvh2npz -q one.bvh -o one.npz && canonicalize -q one.npz --min-seconds 0.5 -o other.h5 && motion-merge other.h5 jog.h5 -o both.h5
0 true ./q '[e["tool"] for e in a[0].history] == ["bvh2npz", "canonicalize", "canonicalize", "motion-merge"]' both.h5
0 true motion-split -q whole.h5 -o split && motion-merge -q split/val.h5 split/train.h5 split/test.h5 -o joined.h5 && ./q 'sorted(a[0].names) == a[1].names and all(same(a[0], n, a[1], n) for n in a[1].names)' joined.h5 whole.h5
0 true ./q '[e["tool"] for e in a[0].history] == ["canonicalize", "motion-split", "motion-merge"] and a[0].inputs == ["val.h5", "train.h5", "test.h5"]' joined.h5
0 true ./q 'a[0].names == a[1].names + a[2].names + a[3].names' joined.h5 split/val.h5 split/train.h5 split/test.h5
0 . motion-info --check full joined.h5

# names that meet
0 ~y\.h5:.clip.w.is.now.w#2 motion-merge x.h5 y.h5 -o xy.h5
0 true ./q 'a[0].names == ["w", "w#2"] and same(a[0], "w", a[1], "w") and same(a[0], "w#2", a[2], "w")' xy.h5 x.h5 y.h5
3 ~^motion-merge:.copy\.h5:clip.*the.very.clip.that.s1\.h5.holds motion-merge s1.h5 s2.h5 copy.h5 -o x2.h5
3 ~shard.given.twice motion-merge s1.h5 s2.h5 copy.h5 -o x2.h5
3 ~link\.h5:.the.same.file.as.s1\.h5 motion-merge s1.h5 link.h5 -o x2.h5
2 ~s1\.h5:.given.twice,.expected motion-merge s1.h5 ./s1.h5 -o x2.h5

# what does not fit
3 ~^motion-merge:.long\.h5:skeleton:.joint.left_knee.lies.12.mm.elsewhere motion-merge one.h5 long.h5 -o x2.h5
3 ~named\.h5:skeleton:.joint.3.is.'chest',.expected.'spine1' motion-merge one.h5 named.h5 -o x2.h5
3 ~role\.h5:skeleton:.role motion-merge one.h5 role.h5 -o x2.h5
3 ~f60\.h5:.60.Hz,.expected.the.30.Hz.of.one\.h5 motion-merge one.h5 f60.h5 -o x2.h5
3 ~canonicalize.--fps motion-merge one.h5 f60.h5 -o x2.h5
3 ~holden\.h5:.contacts.by.preset:holden,.expected.contacts.by.preset:default motion-merge one.h5 holden.h5 -o x2.h5

# an archive that cannot be read ends it
3 ~^motion-merge:.cut\.h5:.truncated motion-merge s1.h5 cut.h5 -o x2.h5
3 ~^motion-merge:.hurt\.h5:.*checksum motion-merge s1.h5 hurt.h5 -o x2.h5
3 ~absent\.h5:.cannot.be.opened motion-merge s1.h5 absent.h5 -o x2.h5
3 ~one\.bvh:.not.an.HDF5.file,.expected.a.motion.archive motion-merge one.bvh -o x2.h5
3 ~a.folder.without motion-merge nothing s1.h5 -o x2.h5
1 . test -e x2.h5

# usage, output
2 ~no.input.given motion-merge -o x2.h5
2 ~no.output.given motion-merge s1.h5 s2.h5
2 ~standard.input.can.be.read.once motion-merge - - -o x2.h5
4 ~m\.h5:.exists.already motion-merge s1.h5 s2.h5 -o m.h5
0 . motion-merge -q s1.h5 s2.h5 s3.h5 -f -o m.h5 && cmp m.h5 whole.h5
0 . cp s1.h5 self.h5 && motion-merge -q -f self.h5 s2.h5 s3.h5 -o self.h5 && cmp self.h5 whole.h5
4 ~write.failed motion-merge s1.h5 -o - > /dev/full
0 141 { sleep 0.3; TMPDIR=$PWD/tmp motion-merge -q s1.h5 -o -; echo $? > died; } 2> noise | true; test ! -s noise && cat died
0 . test -z "$(ls tmp)"
1 . test -n "$(find . -name '*.part-*')"
