# STATUS EXPECTED COMMAND (see run.sh). What every tool shares is tried in bvh2npz.tst.
# setup: mkdir in tmp; for n in a b c d; do cp $DATA/bvh/tiny_human.bvh in/$n.bvh; done; cp in/a.bvh walk.bvh; echo nope > bad.bvh
# setup: printf 'file\taction\tgender\na\twalking\tfemale\nb\twalking\tmale\nc\trunning\tfemale\nd\twalking\tfemale\n' > real.tsv
# setup: printf 'file\taction\na\twalking\nb\trunning\n' > few.tsv; printf 'file\taction\na\tlifting\n' > other.tsv
# setup: canonicalize -q in --labels real.tsv -o real.h5; canonicalize -q in/a.bvh in/b.bvh --labels few.tsv -o sampled.h5; canonicalize -q in/a.bvh --labels other.tsv -o lifting.h5
# setup: head -c 5000 real.h5 > cut.h5
# setup: cat > q.py <<'END'
# setup: import struct, sys, zlib, xml.etree.ElementTree as xml
# setup: def png(path):
# setup:     data = open(path, 'rb').read()
# setup:     assert data[:8] == b'\x89PNG\r\n\x1a\n' and data[-12:-4] == b'\0\0\0\0IEND'
# setup:     return struct.unpack('>II', data[16:24])
# setup: def text(path):
# setup:     data = open(path, 'rb').read()
# setup:     at = data.index(b'iTXtDescription')
# setup:     return data[at + 20:at + 4 + struct.unpack('>I', data[at - 4:at])[0]].decode()
# setup: def svg(path):
# setup:     return xml.parse(path).getroot()
# setup: print(eval(sys.argv[1]))
# setup: END
# setup: printf '#!/bin/sh\nexec /usr/bin/python3 q.py "$@"\n' > q; chmod +x q; echo True > true; echo 1600 > 1600; echo 4 > 4

0 ~^Usage:.render.*INPUT\.\.\. render --help
0 ~^render.\(mocapkit\) render --version

# formats
0 . render walk.bvh -o walk.png
0 1600 ./q 'png("walk.png")[0]'
0 . render walk.bvh -o walk.svg
0 true ./q 'svg("walk.svg").tag == "{http://www.w3.org/2000/svg}svg"'
0 . render walk.bvh -o - > stdout.png && cmp stdout.png walk.png
0 . render walk.bvh --format svg -o - | cmp - <(render walk.bvh --format svg -o -)
0 . render walk.bvh --format svg -o odd.name
0 true ./q 'svg("odd.name").tag.endswith("svg")'
0 . render - -o - < real.h5 | head -c 4 | grep -q PNG
2 ~walk\.jpg:.*expected.it.to.end.in.\.png.or.\.svg render walk.bvh -o walk.jpg
2 ~--format render walk.bvh --format pdf -o x.png
2 ~no.output.given render walk.bvh

# same bytes twice; what is drawn changes them
0 . render real.h5 --contacts --trajectory -o 1.svg && render real.h5 --contacts --trajectory -o 2.svg && cmp 1.svg 2.svg
0 . render real.h5 -o plain.png && for o in --contacts --trajectory '--view front' '--view top' '--view oblique' '--spread path' '--frames 5' '--seconds 0.1' '--size 900' '--row-height 100'; do render real.h5 $o -f -o x.png && ! cmp -s x.png plain.png || exit 1; done
0 true render real.h5 --size 700 -f -o x.png && ./q 'png("x.png")[0] == 700'

# which clips
0 true render real.h5 --clip 1 -o one.png && render real.h5 --max-clips 2 -o two.png && ./q 'png("one.png")[1] < png("two.png")[1] < png("plain.png")[1]'
0 . render real.h5 --clip a -f -o x.png && render real.h5 --clip 1 -f -o y.png && test $(stat -c %s x.png) -gt 1000
0 . render real.h5 --clip 2 --clip 1 -f -o x.png
0 . render in -f -o x.png
0 . render walk.bvh real.h5 --clip walk --clip b -f -o x.png
2 ~--clip.5:.no.clip.of.that.name,.expected.a.name.or.a.number.from.1.to.4 render real.h5 --clip 5 -f -o x.png
2 ~--clip.0 render real.h5 --clip 0 -f -o x.png
2 ~--max-clips render real.h5 --max-clips 0 -f -o x.png
3 ~real\.h5:clip.a:.*long,.expected.more.than.--start.9 render real.h5 --clip a --start 9 -f -o x.png
2 ~--start render real.h5 --start -1 -f -o x.png
2 ~--seconds render real.h5 --seconds nan -f -o x.png
2 ~--frames render real.h5 --frames 0 -f -o x.png
2 ~--size render real.h5 --size 100 -f -o x.png
2 ~--row-height render real.h5 --row-height 1e9 -f -o x.png
2 ~--view render real.h5 --view back -f -o x.png
2 ~--spread render real.h5 --spread wide -f -o x.png
0 . render walk.bvh --unit m --up y --first-frame keep --lenient -f -o x.png

# real above sampled: one pair for each combination
0 true render real.h5 --compare sampled.h5 -o cmp.png && ./q 'png("cmp.png")[1] == png("plain.png")[1]'
0 true render real.h5 --compare sampled.h5 --max-clips 1 -f -o x.png && ./q 'png("x.png")[1] == png("two.png")[1]'
0 . render real.h5 --compare sampled.h5 --clip c -f -o x.png
3 ~lifting\.h5:.no.clip.has.the.attributes render real.h5 --compare lifting.h5 -f -o x.png
3 ~absent\.h5 render real.h5 --compare absent.h5 -f -o x.png
3 ~bad\.bvh render real.h5 --compare bad.bvh -f -o x.png

# provenance travels inside
0 true ./q '[l for l in text("cmp.png").splitlines()][-1].startswith("{\"tool\":\"render\"")'
0 true ./q '"canonicalize" in text("cmp.png") and "sampled.h5" in text("cmp.png")'
0 true ./q '"\"tool\":\"render\"" in svg("walk.svg").find("{*}metadata").text'
0 true ./q '"-o" not in text("cmp.png") and ".png" not in text("cmp.png")'

# bad input, and nothing half written
3 ~bad\.bvh render bad.bvh -o no.png
3 ~absent\.bvh render absent.bvh -o no.png
3 ~cut\.h5 render cut.h5 -o no.png
4 ~walk\.png:.exists.already render walk.bvh -o walk.png
4 ~is.a.folder render walk.bvh -o tmp -f --format png
4 ~cannot.be.created.in.nowhere render walk.bvh -o nowhere/x.png
4 ~write.failed render walk.bvh -o - > /dev/full
4 ~expected.a.regular.file mkfifo pipe && render walk.bvh --format png -f -o pipe
0 . test ! -e no.png && ! ls -A | grep -q part

# a rate by a table: a second of the file is two of the motion
0 true printf 'pattern\trate\nwalk.bvh\t15\n' > rates.tsv; render walk.bvh --fps-override rates.tsv -o rated.png && ./q '"--fps-override=rates.tsv" in text("rated.png")'
3 ~rates\.tsv:1:.a.header printf '*\t15\n' > rates.tsv; render walk.bvh --fps-override rates.tsv -o no.png
0 . render $DATA/asf/human.amc --asf $DATA/asf/human.asf -o amc.png
