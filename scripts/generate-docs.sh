#!/bin/bash
# generate-docs.sh BIN_DIR [DOCS_DIR] - docs/tools/<tool>.md, docs/tools/README.md and docs/man/<tool>.1 from the tools
# themselves. Pages of tools that BIN_DIR lacks (built without LibTorch) are kept; pages of tools that are gone go.
set -eu
bin=${1:?usage: generate-docs.sh BIN_DIR [DOCS_DIR]}
source=$(cd "$(dirname "$0")/.." && pwd)
docs=${2:-$source/docs}
mkdir -p "$docs/tools" "$docs/man"

tools=()
for app in "$source"/apps/*.cpp; do
  tool=$(basename "$app" .cpp)
  tools+=("$tool")
  [ -x "$bin/$tool" ] || continue
  "$bin/$tool" --print-docs markdown > "$docs/tools/$tool.md"
  "$bin/$tool" --print-docs man > "$docs/man/$tool.1"
done

for page in "$docs"/tools/*.md "$docs"/man/*.1; do
  tool=$(basename "${page%.*}")
  [ "$tool" = README ] || [ -e "$source/apps/$tool.cpp" ] || rm -f "$page"
done

{
  printf '# Tools\n\nWritten by `make docs` from the tools themselves; man pages are in `docs/man`.\n\n| tool | does |\n|---|---|\n'
  for tool in "${tools[@]}"; do
    page=$docs/tools/$tool.md
    [ -e "$page" ] && printf '| [`%s`](%s.md) | %s |\n' "$tool" "$tool" "$(sed -n 's/|/\\|/g; 3s/\.$//p' "$page")"
  done
  cat <<'TEXT'

## Exit status of every tool

| status | meaning |
|---|---|
| 0 | done |
| 1 | a batch finished but some inputs failed (also when all did), or a check found a readable file that breaks an invariant |
| 2 | usage: command line or configuration |
| 3 | a lone input missing, malformed, truncated or refused; a model or archive that cannot be read |
| 4 | output could not be written (exists without `-f`, disk full, closed): always, also in a batch |
| 5 | internal error: a bug |
| 75 | stopped early on a signal with a checkpoint: run the same line again to continue |
| 128+n | ended by signal n; SIGPIPE is quiet |
TEXT
} > "$docs/tools/README.md"
