#!/bin/bash
# run.sh TABLE.tst - one test a line: STATUS EXPECTED COMMAND
#
# STATUS    exit status that COMMAND (a bash line) must have; standard input is empty.
# EXPECTED  .       standard output is not looked at
#           FILE    standard output is equal to FILE, of the temporary folder or of tests/cli/expected/
#           ~REGEX  standard error or standard output has a line that matches the extended REGEX (no blanks; \s for one)
# Lines that start with `# setup: ` are run first, all in one shell; `# needs: FILE` skips the table (status 77) where
# FILE is absent. Other lines starting with # are comments.
# The lines run one after the other in one fresh temporary folder, with the tools of $MOCAPKIT_BIN on PATH,
# $DATA = tests/data and $LC_ALL = C. A line that takes longer than 120 s fails.
set -u
here=$(cd "$(dirname "$0")" && pwd)
table=$(readlink -f "$1") || exit 2
[ -r "$table" ] || { echo "run.sh: $1: cannot be read"; exit 2; }
export MOCAPKIT_SOURCE=${MOCAPKIT_SOURCE:-$(dirname "$(dirname "$here")")}
export DATA=$MOCAPKIT_SOURCE/tests/data LC_ALL=C
export PATH=${MOCAPKIT_BIN:?set it to the folder of the tools}:$PATH

while read -r needed; do
  needed=$(eval echo "$needed")
  [ -e "$needed" ] || { echo "skipped: $needed is absent"; exit 77; }
done < <(sed -n 's/^# needs: //p' "$table")

work=$(mktemp -d) out=$(mktemp -d)  # two folders: a test may count the files of the first
trap 'rm -rf "$work" "$out"' EXIT
cd "$work" || exit 2
if ! sed -n 's/^# setup: //p' "$table" > "$out/setup" || ! bash -e "$out/setup" > "$out/stdout" 2> "$out/stderr" < /dev/null; then
  echo "setup failed:"; head -5 "$out/stdout" "$out/stderr"; exit 1
fi

passed=0 failed=0
while read -r status expected command; do
  case $status in '' | \#*) continue ;; esac
  { timeout -k 5 120 bash -c "$command" > "$out/stdout" 2> "$out/stderr" < /dev/null; } 2> /dev/null
  got=$? why=
  [ "$got" = "$status" ] || why="status $got, expected $status"
  case $expected in
    .) ;;
    ~*) grep -Eqe "${expected#\~}" "$out/stderr" "$out/stdout" || why="${why:+$why; }no line matches ${expected#\~}" ;;
    *)
      file=$expected
      [ -e "$file" ] || file=$here/expected/$expected
      if [ ! -e "$file" ]; then why="${why:+$why; }no file $expected to compare with"
      elif ! cmp -s "$out/stdout" "$file"; then why="${why:+$why; }standard output differs from $expected"; fi ;;
  esac
  if [ -z "$why" ]; then
    passed=$((passed + 1))
  else
    failed=$((failed + 1))
    echo "FAIL ($why): $command"
    head -n 5 "$out/stderr" | sed 's/^/  stderr: /'
    case $why in *differs*) diff "$file" "$out/stdout" | head -n 8 | sed 's/^/  /' ;; esac
  fi
done < <(grep -v '^#' "$table"; echo)
echo "$passed passed, $failed failed"
[ "$failed" = 0 ] && [ "$passed" -gt 0 ]
