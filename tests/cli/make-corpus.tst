# setup: mkdir ro taken; make-corpus --subjects 1 --seconds 2 --transitions 0 -o base -q
# setup: touch taken/lifting_m001_1.bvh; echo 1 > plain
0  .                     make-corpus --help
0  ~^make-corpus.*0\.     make-corpus --version
2  ~output               make-corpus
2  ~expected             make-corpus --subjects 0 -o x
2  ~expected             make-corpus --seconds nan -o x
2  ~expected             make-corpus --seconds 0.5 -o x
2  ~expected             make-corpus --clips -1 -o x
2  ~expected             make-corpus --transitions 1.5 -o x
2  ~expected             make-corpus --action running -o x
2  .                     make-corpus --noise-level 2 -o x
2  ~expected             make-corpus --turning 11 -o x
2  ~expected             make-corpus --noise --noise-level 0 -o x
2  ~folder               make-corpus -o -
2  .                     make-corpus input.bvh -o x
1  .                     test -e x
# what a default-like run makes: 4 actions x 2 genders, labels, history
0  ~^8$                  ls base/*.bvh | wc -l
0  ~^9$                  wc -l < base/labels.tsv
0  ~^file.action.gender.subject$  head -n 1 base/labels.tsv
0  ~^jumping_m001_1\.bvh.jumping.male.m001$  cat base/labels.tsv
0  ~"tool":"make-corpus"  cat base/history.jsonl
0  ~^21$                 grep -c JOINT base/walking_f001_1.bvh
0  ~^Frames:.240         grep Frames base/walking_f001_1.bvh
0  ~^Frame.Time:.0\.00833333  grep Frame\ Time base/walking_f001_1.bvh
# equal bytes for any -j, any subset; another seed gives others
0  .                     make-corpus --subjects 1 --seconds 2 --transitions 0 -j 3 -o again -q && diff -r base again
0  .                     make-corpus --subjects 2 --clips 2 --seconds 2 -o more -q && for f in base/*.bvh; do cmp $f more/${f#base/} || exit 1; done
0  .                     make-corpus --action jumping --subjects 1 --seconds 2 --transitions 0 -o one -q && cmp one/jumping_f001_1.bvh base/jumping_f001_1.bvh
0  ~^2$                  ls one/*.bvh | wc -l
1  .                     make-corpus --seed 2 --subjects 1 --seconds 2 --transitions 0 -o other -q && cmp -s base/walking_f001_1.bvh other/walking_f001_1.bvh
# turns: other headings, the same people; 1 is the default
0  .                     make-corpus --action walking --subjects 1 --seconds 2 --transitions 0 --turning 1 -o bends -q && cmp bends/walking_f001_1.bvh base/walking_f001_1.bvh
1  .                     make-corpus --action walking --subjects 1 --seconds 2 --transitions 0 --turning 5 -o bends -f -q && cmp -s bends/walking_f001_1.bvh base/walking_f001_1.bvh
# transitions: segment rows
0  ~^file.action.gender.subject.start.end$  head -n 1 more/labels.tsv
0  ~^12$                 grep -c ^transition more/labels.tsv
0  ~^transition_f001_1\.bvh.walking.female.f001.0\.0000  cat more/labels.tsv
# noise: twins and manifest
0  .                     make-corpus --noise --subjects 1 --seconds 2 --transitions 0 -o pairs -q && for f in base/*.bvh; do cmp $f pairs/clean/${f#base/} || exit 1; done
0  .                     diff base/labels.tsv pairs/noisy/labels.tsv
1  .                     cmp -s pairs/clean/walking_f001_1.bvh pairs/noisy/walking_f001_1.bvh
0  ~^file.kind.joint.start.end.size.unit$  head -n 1 pairs/manifest.tsv
0  ~^walking_f001_1\.bvh.jitter.all.0\.0000.2\.0000.0\.6000.deg$  cat pairs/manifest.tsv
0  ~jitter.all.*1\.2000.deg  make-corpus --noise --noise-level 2 --action walking --subjects 1 --seconds 2 --transitions 0 -o loud -q && cat loud/manifest.tsv
# nothing is replaced without -f, and the refusal comes before any work
4  ~exists               make-corpus --subjects 1 --seconds 2 --transitions 0 -o base
4  ~exists               make-corpus --subjects 1 --seconds 2 --transitions 0 -o taken
0  ~^1$                  ls taken | wc -l
0  .                     make-corpus --subjects 1 --seconds 2 --transitions 0 -o taken -f -q && diff -r base taken
4  .                     make-corpus --subjects 1 --seconds 2 -o plain
4  .                     make-corpus --subjects 1 --seconds 2 -o plain/below
4  .                     make-corpus --help > /dev/full
0  ~^0$                  ls -a base more taken pairs/* | grep -c part- || true
