# STATUS EXPECTED COMMAND (see run.sh). What every tool shares is tried in bvh2npz.tst.
# setup: make-corpus -q --subjects 1 --seconds 3 -o corpus; canonicalize -q corpus --labels corpus/labels.tsv -o c.h5; make-corpus -q --subjects 1 --seconds 3 --seed 2 -o other; canonicalize -q other --labels other/labels.tsv -o o.h5
# setup: canonicalize -q corpus -o plain.h5; canonicalize -q corpus --fps 60 -o fast.h5; cp $DATA/bvh/tiny_human.bvh good.bvh; cp $DATA/bvh/plain.bvh two-joints.bvh; echo nope > bad.h5; head -c 9000 c.h5 > cut.h5
# setup: sed -n '1,/^Frame Time/p' good.bvh | sed 's/^Frames:.*/Frames: 1/' > one.bvh; sed '1,/^Frame Time/d' good.bvh | head -1 >> one.bvh
# setup: cat > q <<'END'
# setup: #!/usr/bin/python3
# setup: import sys, json
# setup: r = json.load(sys.stdin)["rows"]
# setup: by = {(x["group"], x["set"]): x for x in r}
# setup: print(eval(sys.argv[1], {"r": r, "by": by}))
# setup: END
# setup: chmod +x q; echo True > true

0 ~^Usage:.motion-compare.*INPUT motion-compare --help
0 ~^motion-compare.\(mocapkit\) motion-compare --version
4 ~write.failed motion-compare --help > /dev/full

# a copy of the training data lies at distance 0 from it and moves as much; other people's motion does neither
0 true motion-compare c.h5 --real c.h5 --by none --json | ./q 'len(r) == 2 and by["all", "generated"]["nearest_training"] == 0 and by["all", "generated"]["energy_ratio"] == 1 and by["all", "generated"]["clips"] == 10'
0 true motion-compare c.h5 --real c.h5 --unseen o.h5 --by none --json | ./q 'list(s for g, s in by) == ["real", "unseen", "generated"] and by["all", "unseen"]["nearest_training"] > 0.05 and by["all", "unseen"]["energy_ratio"] != 1'
0 ~^all.*real.*10.*900.*1\.00 motion-compare o.h5 --real c.h5
0 ~^all.*generated.*10.*900 motion-compare o.h5 --real c.h5
0 ~^group.*set.*clips.*frames.*energy.*ratio motion-compare o.h5 --real c.h5

# groups: what labels every generated clip (transitions have no action of their own), what is named, or none
0 true motion-compare o.h5 --real c.h5 --json | ./q '{g for g, s in by} == {"female", "male", "all"}'
0 true motion-compare o.h5 --real c.h5 --by action --json | ./q '{g for g, s in by} == {"(none)", "jogging", "jumping", "lifting", "walking", "all"} and by["walking", "real"]["clips"] == 2'
0 true motion-compare o.h5 --real c.h5 --by gender --by action --json | ./q '"female walking" in {g for g, s in by} and by["walking" if ("walking", "real") in by else "female walking", "real"]["clips"] == 1'
0 true motion-compare plain.h5 --real c.h5 --json | ./q 'len(r) == 2'
3 ~c\.h5:.no.clip.has.the.attribute.'mood' motion-compare o.h5 --real c.h5 --by mood
3 ~plain\.h5:.no.clip.has.the.attribute.'gender' motion-compare plain.h5 --real c.h5 --by gender

# windows, threads, streams
0 true motion-compare o.h5 --real c.h5 --window 20 --by none --json | ./q '0 < by["all", "generated"]["nearest_training"] < 10'
0 true motion-compare o.h5 --real c.h5 --window 1000 --by none --json | ./q 'by["all", "generated"]["nearest_training"] is None'
0 . motion-compare o.h5 --real c.h5 -j 1 > j1 && motion-compare o.h5 --real c.h5 -j 2 | cmp - j1
0 . motion-compare - --real c.h5 < o.h5 | cmp - j1
0 . motion-compare o.h5 --real - < c.h5 | cmp - j1
0 ~all.*generated.*1.*30 motion-compare good.bvh --real good.bvh
0 . motion-compare one.bvh --real one.bvh > one.txt; test $? = 0 && ! grep -q nan one.txt
0 true motion-compare one.bvh --real one.bvh --json | ./q 'by["all", "generated"]["energy_ratio"] is None and by["all", "generated"]["energy"] == 0'
0 . printf 'real = "c.h5"\nthreads = 1\n' > c.toml; motion-compare o.h5 --config c.toml | cmp - j1

# over clips and over time: two routes to one number; a clip of 90 frames at 30 Hz has three seconds
0 true motion-compare o.h5 --real c.h5 --by none --spread --json > s.json && /usr/bin/python3 -c 'import json; d = json.load(open("s.json"))["spread"]; print(set(d) == {"speed_mps", "turning_dps", "step_length_m"} and d["speed_mps"]["generated"]["clips"] == 10 and d["speed_mps"]["real"]["smallest"] < d["speed_mps"]["real"]["mean"] < d["speed_mps"]["real"]["largest"] and 0.3 < d["step_length_m"]["real"]["mean"] < 1.5 and d["speed_mps"]["real"]["deviation"] > 0.2)'
0 ~^speed_mps.*generated.*10 motion-compare o.h5 --real c.h5 --spread
0 ~^step_length_m.*real.*0.*-.*- motion-compare good.bvh --real good.bvh --spread
0 true motion-compare o.h5 --real c.h5 --by none --stretches 1 --json > w.json && motion-select -q o.h5 --time 1:1.97 -o second.h5 && motion-compare second.h5 --real c.h5 --by none --json > second.json && /usr/bin/python3 -c 'import json; d = json.load(open("w.json"))["stretches"]; g = d["generated"]; s = json.load(open("second.json"))["rows"][1]; print(len(g) == 3 and g[1]["start_s"] == 1 and g[1]["clips"] == 10 and all(abs(g[1][k] - s[k]) < 1e-9 for k in ("energy", "root_speed_mps", "contact_share")) and d["real"]["energy"][0] < d["real"]["energy"][1] and all(r["outside"] == [] for r in g))'
0 ~^2.-.3.*10 motion-compare o.h5 --real c.h5 --stretches 1
0 ~outside:.*root_speed_mps motion-select -q c.h5 --attr action=lifting -o lift.h5 && motion-compare o.h5 --real lift.h5 --by none --stretches 1
2 ~above.0 motion-compare o.h5 --real c.h5 --stretches 0

# usage
2 ~no.input.given motion-compare --real c.h5
2 ~--real.is.required motion-compare c.h5
2 ~whole.number motion-compare c.h5 --real c.h5 --window 1
2 ~expected.one motion-compare c.h5 o.h5 --real c.h5
2 ~unknown.option motion-compare c.h5 --real c.h5 -o x

# bad input
3 ~^motion-compare:.absent\.h5 motion-compare absent.h5 --real c.h5
3 ~^motion-compare:.absent\.h5 motion-compare c.h5 --real absent.h5
3 ~^motion-compare:.bad\.h5 motion-compare c.h5 --real c.h5 --unseen bad.h5
3 ~^motion-compare:.cut\.h5 motion-compare cut.h5 --real c.h5
3 ~<stdin> motion-compare - --real c.h5
3 ~60.Hz,.expected.22.joints.at.30.Hz motion-compare fast.h5 --real c.h5
3 ~joints motion-compare two-joints.bvh --real c.h5
4 ~write.failed motion-compare c.h5 --real c.h5 > /dev/full
4 ~write.failed motion-compare c.h5 --real c.h5 >&-
