#!/bin/bash
# One motion as many writers would put it - rigs, rest poses, axes, units, channels, spellings, rates, ASF+AMC, AMASS - and what canonicalize
# makes of each held against the motion itself (dialects.py). Then the same files cut off and mutilated: refused or read, nothing else.
set -eu
source=$(cd "$(dirname "$0")/../.." && pwd)
bin=${MOCAPKIT_BIN:?set it to the folder of the tools}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
PATH=$bin:$PATH
dialects="/usr/bin/python3 $source/tests/pipeline/dialects.py"

make-corpus -q --subjects 1 --seconds 4 --transitions 0 -o "$work/corpus"
$dialects write "$work/corpus" "$work/files"
status=0
canonicalize -q "$work/files" "$work/corpus" --rejects "$work/rejects.tsv" -o "$work/all.h5" 2> "$work/messages" || status=$?
[ $status = 1 ] || { cat "$work/messages"; echo "status $status, expected 1: reflections and beasts are refused"; exit 1; }
motion-info --check full "$work/all.h5" > /dev/null
$dialects check "$work/corpus" "$work/files" "$work/all.h5" "$work/rejects.tsv"

$dialects mutilate "$work/files" "$work/broken" 300
status=0
timeout 60 canonicalize -q "$work/broken" --rejects "$work/rejects.tsv" -f -o "$work/broken.h5" 2> "$work/messages" || status=$?
[ $status = 1 ] || { tail -5 "$work/messages"; echo "canonicalize of mutilated files: status $status, expected 1"; exit 1; }
! cut -f3 "$work/rejects.tsv" | grep -qx 5 || { grep -P '\t5\t' "$work/rejects.tsv"; echo "an internal error"; exit 1; }
motion-info --check full "$work/broken.h5" > /dev/null
status=0
timeout 60 bvh2npz -q "$work/broken" -o "$work/npz" --rejects "$work/rejects2.tsv" 2> "$work/messages" || status=$?
[ $status = 1 ] || { tail -5 "$work/messages"; echo "bvh2npz of mutilated files: status $status, expected 1"; exit 1; }
! cut -f3 "$work/rejects2.tsv" | grep -qx 5 || { grep -P '\t5\t' "$work/rejects2.tsv"; echo "an internal error"; exit 1; }
[ -z "$(find "$work" -name '*.part*')" ]
