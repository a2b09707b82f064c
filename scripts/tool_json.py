"""Reads what the tools write with --json, for the scripts that assemble tables of it. Exit status 3 names a file that is missing or not what it should be."""
import json
import sys
from pathlib import Path


def fail(message):
    print(f"{Path(sys.argv[0]).name}: {message}", file=sys.stderr)
    sys.exit(3)


def read(path, key):
    """The document at `path`, which must have `key`."""
    try:
        document = json.loads(path.read_text())
    except OSError as e:
        fail(f"{path}: {e.strerror}")
    except ValueError as e:
        fail(f"{path}: not JSON: {e}")
    if not isinstance(document, dict) or key not in document:
        fail(f"{path}: no {key}, expected the tool's --json")
    return document
