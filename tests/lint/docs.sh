#!/bin/bash
# The committed docs/tools and docs/man are what the tools say about themselves.
set -eu
source=$(cd "$(dirname "$0")/../.." && pwd)
bin=${MOCAPKIT_BIN:?set it to the folder of the tools}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$work/tools" "$work/man"
cp "$source"/docs/tools/*.md "$work/tools" 2> /dev/null || true  # pages of tools that were not built stay as they are
cp "$source"/docs/man/*.1 "$work/man" 2> /dev/null || true
"$source/scripts/generate-docs.sh" "$bin" "$work"

differ() { ! diff -u -r -x .gitkeep "$1/tools" "$2/tools" || ! diff -u -r -x .gitkeep "$1/man" "$2/man"; }
if differ "$source/docs" "$work"; then
  echo "docs differ from the tools: run 'make docs' (scripts/generate-docs.sh $bin) and commit the result"
  exit 1
fi

# The comparison can fail: a changed page, a missing one and one of a tool that is gone are noticed.
page=$(find "$work/tools" -name '*.md' ! -name README.md | head -n 1)
for spoil in 'echo x >> "$page"' 'rm "$page"' 'touch "$work/man/attic.1"'; do
  cp -r "$work" "$work.spoilt"
  (page=$work.spoilt${page#"$work"}; work=$work.spoilt; eval "$spoil")
  differ "$work.spoilt" "$work" > /dev/null 2>&1 || { echo "not noticed: $spoil"; rm -rf "$work.spoilt"; exit 1; }
  rm -rf "$work.spoilt"
done
