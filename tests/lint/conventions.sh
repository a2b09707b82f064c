#!/bin/bash
# Every tool has its table of tests, and the table tries every option that --help shows and every common exit status.
set -u
source=${MOCAPKIT_SOURCE:-$(cd "$(dirname "$0")/../.." && pwd)}
bin=${MOCAPKIT_BIN:?set it to the folder of the tools}

# Options every tool shares are tried once, in tests/cli/bvh2npz.tst.
shared='help|version|threads|verbose|quiet|log-level|progress|config|print-config|rejects|fail-fast|shard|skip-existing'

breaches() {  # TOOL TABLE
  [ -e "$2" ] || { echo "$1: no $2"; return; }
  local help statuses='0 2' status short option
  help=$("$bin/$1" --help)
  grep -q '^Usage: .* INPUT' <<< "$help" && statuses+=' 3'
  grep -q -- '--output' <<< "$help" && statuses+=' 4'
  for status in $statuses; do grep -Eq "^$status[[:space:]]" "$2" || echo "$1: no line with status $status in its table"; done
  while read -r short option; do
    [ "$1" != bvh2npz ] && grep -Eqx "$shared" <<< "$option" && continue
    grep -Eq -- "--$option([= ]|\$)" "$2" && continue
    [ "$short" != . ] && grep -Eq -- " $short" "$2" && continue
    echo "$1: --$option is not tried in its table"
  done < <(sed -nE 's/^  (-[a-z]), --([a-z0-9-]+)( .*)?$/\1 \2/p; s/^  --([a-z0-9-]+)( .*)?$/. \1/p' <<< "$help")
}

bad=0 checked=0 some=
for app in "$source"/apps/*.cpp; do
  tool=$(basename "$app" .cpp)
  [ -x "$bin/$tool" ] || continue
  checked=$((checked + 1)) some=$tool
  found=$(breaches "$tool" "$source/tests/cli/$tool.tst")
  [ -z "$found" ] || { echo "$found"; bad=1; }
done
[ $checked -gt 0 ] || { echo "no tool found in $bin"; exit 1; }
# The check can fail: an empty table breaks everything.
[ -n "$(breaches "$some" /dev/null)" ] || { echo "an empty table is not noticed"; bad=1; }
exit $bad
