#!/bin/bash
# install-deps.sh installs what is missing, only that, once; without apt-get it explains; it can be told to stay away.
set -u
script=$(cd "$(dirname "$0")/../.." && pwd)/scripts/install-deps.sh
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir "$work/bin" "$work/bare"
for tool in sh sed grep cat env; do ln -s "$(command -v $tool)" "$work/bin/$tool"; ln -s "$(command -v $tool)" "$work/bare/$tool"; done
cat > "$work/bin/dpkg-query" <<END
#!/bin/sh
sed 's/^/ii  /' $work/installed
END
printf '#!/bin/sh\necho "$@" >> %s/calls\n' "$work" > "$work/bin/apt-get"
printf '#!/bin/sh\necho "${FAKE_UID:-0}"\n' > "$work/bin/id"
chmod +x "$work"/bin/{dpkg-query,apt-get,id}
sed -n '/^packages="/,/"$/p' "$script" | tr -d '"' | sed 's/^packages=//' | tr ' ' '\n' > "$work/all"
bad=0
fail() { echo "$1"; cat "$work/text" "$work/calls" 2> /dev/null; bad=1; }
try() { rm -f "$work/calls"; env -i PATH="$1" "${@:2}" "$work/bin/sh" "$script" > "$work/text" 2>&1; }

[ "$(wc -l < "$work/all")" -gt 20 ] || fail "the list of packages was not found"
cp "$work/all" "$work/installed"
try "$work/bin" && [ ! -s "$work/text" ] && [ ! -e "$work/calls" ] || fail "nothing is missing, but it was not silent"
grep -vx 'libzip-dev\|g++' "$work/all" > "$work/installed"
try "$work/bin" && [ "$(head -n 1 "$work/calls")" = "update -qq" ] && tail -n 1 "$work/calls" | grep -q ' g++ libzip-dev$' || fail "two are missing"
try "$work/bin" MOCAPKIT_NO_INSTALL=1 && [ ! -s "$work/text" ] && [ ! -e "$work/calls" ] || fail "told to stay away, but it did not"
try "$work/bin" FAKE_UID=1000 && fail "neither root nor sudo, but it passed"
grep -q 'ask for these packages: g++ libzip-dev' "$work/text" || fail "neither root nor sudo, and it does not say what to ask for"
printf '#!/bin/sh\nexec "$@"\n' > "$work/bin/sudo"; chmod +x "$work/bin/sudo"
try "$work/bin" FAKE_UID=1000 && tail -n 1 "$work/calls" | grep -q ' g++ libzip-dev$' || fail "with sudo"
try "$work/bare" && grep -q CMAKE_PREFIX_PATH "$work/text" || fail "without apt-get"
exit $bad
