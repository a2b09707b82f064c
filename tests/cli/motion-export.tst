# STATUS EXPECTED COMMAND (see run.sh). What every tool shares is tried in bvh2npz.tst.
# The other name of the tool, `export`, is a builtin of every shell: it is reached as `env export` or by its path.
# setup: mkdir in in/sub tmp; cp $DATA/bvh/tiny_human.bvh in/a.bvh; sed 's/^0\.0000 9/1.0000 9/' in/a.bvh > in/sub/b.bvh; cp in/a.bvh good.bvh; echo nope > bad.bvh
# setup: canonicalize -q in -o two.h5; canonicalize -q good.bvh -o one.h5; head -c 5000 two.h5 > cut.h5
# setup: cat > q.py <<'END'
# setup: import sys, numpy as np, h5py
# setup: def load(p):
# setup:     if p.endswith('.npz'): return dict(np.load(p, allow_pickle=False))
# setup:     return {k.replace('/', '_'): v[()] for k, v in ((k, h5py.File(p)[k]) for k in ('frames/rotations', 'frames/root_position', 'skeleton/joint_names'))}
# setup: def rows(p):
# setup:     t = open(p).read().split('Frame Time:')[1].split('\n', 1)[1]
# setup:     return np.array([[float(x) for x in l.split()] for l in t.splitlines() if l.strip()])
# setup: print(eval(sys.argv[1], {**globals(), **{f'f{i}': p for i, p in enumerate(sys.argv[2:])}}))
# setup: END
# setup: printf '#!/bin/sh\nexec /usr/bin/python3 q.py "$@"\n' > q; chmod +x q; echo True > true; echo 141 > 141; printf 'a.bvh\nsub_b.bvh\n' > names; printf 'a.npz\nsub_b.npz\n' > npznames

0 ~^Usage:.motion-export.*INPUT motion-export --help
0 ~^motion-export.\(mocapkit\) motion-export --version
0 ~^motion-export.\(mocapkit\) env export --version

# archives: one file per clip
0 names motion-export two.h5 -o out && ls out
0 names motion-export - --output piped < two.h5 && ls piped && diff -r out piped
0 names motion-export two.h5 one.h5 -o both && ls both/two && test -e both/one/good.bvh
0 . motion-export one.h5 -o one.bvh && motion-export one.h5 -o - | cmp - one.bvh
0 ~^ROOT.pelvis$ cat one.bvh
0 . test $(grep -c 'End Site' one.bvh) = 5
0 . motion-export two.h5 -o j1 -j1 && motion-export two.h5 -o j4 -j4 && diff -r j1 j4 && diff -r j1 out
2 ~2.clips.for.one.output motion-export two.h5 -o x.bvh
2 ~2.clips.for.one.output motion-export two.h5 -o -

# BVH: axes, units and orders lead back to the same motion
0 true motion-export good.bvh -o y.bvh && ./q 'np.allclose(rows(f0)[0, :3], (0, 91.5, 0), atol=1e-5)' y.bvh
0 true ./q 'np.allclose(rows(f0), rows(f1), atol=2e-4)' good.bvh y.bvh
0 true motion-export good.bvh --up z --unit m -o z.bvh && ./q 'np.allclose(rows(f0)[0, :3], (0, 0, 0.915), atol=1e-5)' z.bvh
0 true motion-export good.bvh --up y --unit mm -o mm.bvh && ./q 'np.allclose(rows(f0)[0, :3], (0, 915, 0), atol=1e-5)' mm.bvh
0 true motion-export good.bvh --unit in -o in.bvh && ./q 'np.allclose(rows(f0)[0, :3], (0, 91.5 / 2.54, 0), atol=1e-5)' in.bvh
0 . bvh2npz good.bvh -o ref.npz
0 true bvh2npz z.bvh --up z --unit m -o z.npz && ./q 'all(np.allclose(load(f0)[k], load(f1)[k], atol=1e-5) for k in ("poses", "trans", "rest_offsets", "end_sites"))' ref.npz z.npz
0 true bvh2npz mm.bvh --up y --unit mm -o mm.npz && ./q 'all(np.allclose(load(f0)[k], load(f1)[k], atol=1e-5) for k in ("poses", "trans", "rest_offsets", "end_sites"))' ref.npz mm.npz
0 true for o in XYZ XZY YXZ YZX ZXY ZYX; do motion-export good.bvh --order $o -o - | bvh2npz - -o - > $o.npz || exit 9; done; ./q 'all(np.allclose(load(f0)["poses"], load(p)["poses"], atol=1e-5) for p in (f1, f2, f3, f4, f5, f6))' ref.npz XYZ.npz XZY.npz YXZ.npz YZX.npz ZXY.npz ZYX.npz
0 ~CHANNELS.6.*Yrotation.Xrotation.Zrotation motion-export good.bvh --order YXZ -o -

# npz: AMASS layout, back to the same motion
0 npznames motion-export two.h5 --format npz -o amass && ls amass
0 true ./q 'load(f0)["poses"].shape == (30, 156) and load(f0)["mocap_framerate"] == 30 and not load(f0)["poses"][:, 66:].any()' amass/a.npz
0 true motion-export one.h5 -o one.npz && canonicalize -q one.npz -o back.h5 && ./q 'np.abs(load(f0)["frames_root_position"] - load(f1)["frames_root_position"]).max() < 1e-4' one.h5 back.h5
0 true ./q '(2 * np.arccos(np.clip(np.abs((load(f0)["frames_rotations"].astype(float) * load(f1)["frames_rotations"]).sum(-1)), 0, 1))).max() < 1e-3' one.h5 back.h5
0 true ./q 'np.abs(np.abs(load(f0)["frames_rotations"]) - np.abs(load(f1)["frames_rotations"])).max() < 1e-5' one.h5 back.h5
3 ~^motion-export:.good\.bvh motion-export good.bvh --format npz -o x.npz

# usage
2 ~no.input.given motion-export
2 ~no.output.given motion-export one.h5
2 ~'fbx',.expected.one.of motion-export one.h5 --format fbx -o x
2 ~expected.one.of motion-export one.h5 --up x -o x.bvh
2 ~expected.one.of motion-export one.h5 --unit ft -o x.bvh
2 ~expected.one.of motion-export one.h5 --order ZYZ -o x.bvh
2 ~--unit:.an.option.of.bvh motion-export one.h5 --format npz --unit cm -o x.npz
2 ~fits.--format motion-export one.h5 --format bvh -o x.npz
2 ~fits.--format motion-export one.h5 --format npz -o x.bvh

# bad input
3 ~absent\.h5 motion-export absent.h5 -o x
3 ~bad\.bvh motion-export bad.bvh -o x
3 ~cut\.h5 motion-export cut.h5 -o x
1 ~1.of.2.inputs.failed motion-export bad.bvh one.h5 -o part --rejects rejects.tsv
0 ~^bad\.bvh cat rejects.tsv
0 . test -e part/one/good.bvh
1 . test -e x -o -e x.bvh -o -e x.npz

# output
4 ~exists.already motion-export one.h5 -o one.bvh
0 . motion-export one.h5 -o one.bvh -f
0 . motion-export one.h5 -o one.bvh --force
4 ~out/a\.bvh:.exists motion-export bad.bvh good.bvh in/a.bvh -o out
4 ~out/sub_b\.bvh:.exists rm out/a.bvh; motion-export two.h5 -o out
1 . test -e out/a.bvh
4 ~write.failed motion-export one.h5 -o - > /dev/full
4 ~terminal script -qec 'motion-export one.h5 --format npz -o -' /dev/null; test $? = 2 && exit 4
0 ~HIERARCHY script -qec 'motion-export one.h5 -o -' /dev/null
0 141 { sleep 0.3; TMPDIR=$PWD/tmp motion-export one.h5 -o -; echo $? > died; } 2> noise | true; test ! -s noise && cat died
0 . test -z "$(ls tmp)"

# a rerun writes what is missing or changed
0 . motion-export two.h5 -o out --skip-existing && find out -name '*.bvh' -exec touch -d 2000-01-01 {} + && motion-export two.h5 -o out --skip-existing && test -z "$(find out -name '*.bvh' -newermt 2001-01-01)"
4 ~other.content motion-export two.h5 -o out --skip-existing --unit m
0 . motion-export two.h5 -o out --skip-existing --unit m -f && test -n "$(find out/a.bvh -newermt 2001-01-01)"
0 . find amass -name '*.npz' -exec touch -d 2000-01-01 {} + && motion-export two.h5 --format npz -o amass --skip-existing && test -z "$(find amass -name '*.npz' -newermt 2001-01-01)"
1 . test -n "$(find . -name '*.part-*')"
