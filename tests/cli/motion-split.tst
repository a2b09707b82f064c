# STATUS EXPECTED COMMAND (see run.sh). What every tool shares is tried in bvh2npz.tst.
# setup: make-corpus -q --subjects 4 --seconds 1 --transitions 0 --clips 2 -o corpus
# setup: canonicalize -q corpus --labels corpus/labels.tsv --phases all -o all.h5; cp corpus/walking_f001_1.bvh one.bvh; canonicalize -q one.bvh -o one.h5; head -c 9000 all.h5 > cut.h5; mkdir tmp
# setup: cat > q.py <<'END'
# setup: import sys, h5py
# setup: def col(s, name): return [v.decode() for v in h5py.File(s)["clips/" + name][()]]
# setup: def files(d): return [d + "/" + n + ".h5" for n in ("train", "val", "test")]
# setup: def disjoint(d, name):
# setup:     sets = [set(col(p, name)) for p in files(d)]
# setup:     return not (sets[0] & sets[1] or sets[0] & sets[2] or sets[1] & sets[2])
# setup: def sizes(d, name): return [len(set(col(p, name))) for p in files(d)]
# setup: def classes(d): return [sorted({k: c.count(k) for k in c}.values()) for c in [list(zip(col(p, "attributes/action"), col(p, "attributes/gender"))) for p in files(d)]]
# setup: def names(d): return sorted(n for p in files(d) for n in col(p, "name"))
# setup: print(eval(sys.argv[1], {**globals(), "d": sys.argv[2]}))
# setup: END
# setup: cp all.h5 mirrored.h5; /usr/bin/python3 -c 'import h5py, numpy as np; f = h5py.File("mirrored.h5", "r+", libver=("v110", "v110")); f["clips/mirrored"][::2] = 1; f["clips/source_yaw"][...] = np.arange(len(f["clips/name"]))'
# setup: printf '#!/bin/sh\nexec /usr/bin/python3 q.py "$@"\n' > q; chmod +x q; echo True > true; printf 'test.h5\ntrain.h5\nval.h5\n' > three

0 ~^Usage:.motion-split.*-o.DIR motion-split --help
0 ~^motion-split.\(mocapkit\) motion-split --version

# by source: phases of a file stay together, nothing is lost, each action and gender everywhere
0 three motion-split -q all.h5 --ratios 6,1,1 -o src && ls src
0 true ./q 'disjoint(d, "source") and disjoint(d, "source_sha256")' src
0 true ./q 'sizes(d, "source") == [48, 8, 8]' src
0 true ./q 'names(d) == sorted(col("all.h5", "name"))' src
0 true ./q 'len(col(d + "/val.h5", "name")) == 4 * 8' src
0 true ./q 'classes(d) == [[24] * 8, [4] * 8, [4] * 8]' src
0 . motion-info --check full src/train.h5 src/val.h5 src/test.h5
0 ~preset:default motion-info src/val.h5
0 ~canonicalize,.motion-split motion-info src/test.h5
0 ~^motion-split.--by=source.--ratios=6,1,1.--seed=1$ motion-info --history src/test.h5

# by subject
0 ~val\.h5:.2.subjects motion-split all.h5 --by subject --ratios 4,2,2 -o sub
0 true ./q 'disjoint(d, "attributes/subject") and sizes(d, "attributes/subject") == [4, 2, 2]' sub
0 true ./q 'classes(d) == [[16] * 8, [8] * 8, [8] * 8]' sub

# by clip: the phases of a file still stay together
0 true motion-split -q all.h5 --by clip -o clip && ./q 'disjoint(d, "source") and sizes(d, "source") == [48, 8, 8]' clip

# mirrored copies stay with their originals, whatever --by says; where clips lie in their sources is kept
0 true motion-split -q mirrored.h5 --by clip -o mc && ./q 'disjoint(d, "source") and sizes(d, "source") == [48, 8, 8]' mc
0 true motion-split -q mirrored.h5 --by subject --ratios 4,2,2 -o ms && ./q 'disjoint(d, "source") and disjoint(d, "attributes/subject")' ms
0 true motion-split -q mirrored.h5 -o mb && ./q 'all({0, 1} == set(h5py.File(p)["clips/mirrored"][()]) for p in files(d)) and {n: y for p in files(d) for n, y in zip(col(p, "name"), h5py.File(p)["clips/source_yaw"][()])} == dict(zip(col("mirrored.h5", "name"), range(256)))' mb

# balance; report
0 true motion-split -q all.h5 --balance action --balance gender -o bal --ratios 2,1,1 && ./q 'classes(d) == [[16] * 8, [8] * 8, [8] * 8]' bal
0 true motion-split -q all.h5 -o js --json | /usr/bin/python3 -c 'import sys, json; d = json.load(sys.stdin); print(list(d) == ["train", "val", "test"] and d["val"]["groups"] == 8 and sum(d["val"]["classes"].values()) == d["val"]["clips"] == 32)'
0 ~warning:.8.combinations.*fewer.than.3.subjects motion-split all.h5 --by subject --balance subject -o none

# the same for the same seed, another for another; from a pipe
0 . motion-split -q all.h5 --ratios=6,1,1 -o src2 && diff -r src src2
1 . motion-split -q all.h5 --ratios 6,1,1 --seed 2 -o src3 && diff -qr src src3
0 true ./q 'disjoint(d, "source") and classes(d) == [[24] * 8, [4] * 8, [4] * 8]' src3
0 . motion-split -q - --ratios 6,1,1 -o src4 < all.h5 && motion-info src/val.h5 | grep digest > a && motion-info src4/val.h5 | grep digest | cmp - a

# refusals
2 ~no.input.given motion-split -o x
2 ~no.output.given motion-split all.h5
2 ~expected.one motion-split all.h5 one.h5 -o x
2 ~a.folder motion-split all.h5 -o -
2 ~expected.three.numbers motion-split all.h5 --ratios 1,2 -o x
2 ~expected.three.numbers motion-split all.h5 --ratios 1,2,0 -o x
2 ~expected.three.numbers motion-split all.h5 --ratios 1,2,nan -o x
2 ~expected.three.numbers motion-split all.h5 --ratios 1,2,3,4 -o x
2 ~expected.one.of motion-split all.h5 --by gender -o x
3 ~1.source.to.split,.expected.at.least.3 motion-split one.h5 -o x
3 ~no.attribute.subject motion-split one.h5 --by subject -o x
3 ~no.clip.has.the.attribute.mood motion-split all.h5 --balance mood -o x
3 ~cut\.h5:.truncated motion-split cut.h5 -o x
3 ~one\.bvh:.not.an.HDF5.file,.expected.a.motion.archive motion-split one.bvh -o x
3 ~absent\.h5 motion-split absent.h5 -o x
1 . test -e x
4 ~src/train\.h5:.exists.already motion-split all.h5 --ratios 6,1,1 -o src
4 ~src5/test\.h5:.exists.already mkdir src5 && echo mine > src5/test.h5 && motion-split all.h5 -o src5
0 . test "$(ls src5)" = test.h5
4 ~a.file,.expected.a.folder motion-split all.h5 -o one.h5
0 . motion-split -q all.h5 --ratios 6,1,1 -f -o src && diff -r src src2
1 . test -n "$(find . -name '*.part-*')"
