#!/bin/bash
# The table runner can fail: each kind of wrong expectation, an empty table and a failing setup are noticed.
set -u
run=$(cd "$(dirname "$0")/../cli" && pwd)/run.sh
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export MOCAPKIT_BIN=$work
bad=0
expect() {  # STATUS LAST-LINE TABLE-TEXT
  printf '%b\n' "$3" > "$work/t.tst"
  local text got
  text=$("$run" "$work/t.tst" 2>&1 < /dev/zero)
  got=$?
  if [ $got != "$1" ] || [ "$(tail -n 1 <<< "$text")" != "$2" ]; then
    echo "status $got, expected $1 and '$2' from:"; printf '%b\n' "$3"; echo "$text"; bad=1
  fi
}
expect 0 '7 passed, 0 failed' '# comment\n# setup: echo hello > hi\n0 . true\n1 . false\n0 hi echo hello\n3 ~^x.*z$ echo xyz >&2; exit 3\n0 ~xyz echo xyz\n0 . test -z "$(cat)"\n141 . kill -PIPE $$'
expect 1 '0 passed, 1 failed' '0 . false'
expect 1 '0 passed, 1 failed' '1 . true'
expect 1 '0 passed, 1 failed' '# setup: echo hello > hi\n0 hi echo bye'
expect 1 '0 passed, 1 failed' '0 absent echo bye'
expect 1 '0 passed, 1 failed' '0 ~^b$ echo bye'
expect 1 '1 passed, 1 failed' '0 . true\n0 . no-such-tool'
expect 1 '0 passed, 0 failed' '# nothing here'
expect 77 "skipped: $work/absent is absent" "# needs: $work/absent\n0 . true"
printf '# setup: false\n0 . true\n' > "$work/t.tst"
"$run" "$work/t.tst" > /dev/null 2>&1 && { echo "a failing setup was not noticed"; bad=1; }
exit $bad
