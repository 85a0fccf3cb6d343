"""Names that are not there, imports and variables that nothing uses: what Pyflakes finds in the project's Python sources.

lint_python.py ROOT PYFLAKES; Debian's package is pyflakes3.
"""

import subprocess
import sys
from pathlib import Path

PASSED_ON = Path("python/ear/__init__.py")  # hands on what it imports
NO_SOURCES = ("build", "install", "node_modules")


def is_script(file):
    return file.is_file() and file.suffix == "" and file.read_bytes()[:50].startswith(b"#!/usr/bin/env python")


def sources(root):
    """All Python sources, relative to the root; in tools/ also those whose first line says so."""
    scripts = [file for file in root.glob("tools/*") if is_script(file)]
    found = [file.relative_to(root) for file in [*root.rglob("*.py"), *scripts]]
    return sorted(file for file in found if file != PASSED_ON and not any(
        part in NO_SOURCES or part.startswith(".") for part in file.parts))


def lint(root, pyflakes):
    files = sources(root)
    if not files:
        return "no Python sources below " + str(root)
    done = subprocess.run([pyflakes, *files], cwd=root, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    return done.stdout + done.stderr


if __name__ == "__main__":
    faults = lint(Path(sys.argv[1]).resolve(), sys.argv[2])
    print(faults or "lint_python: nothing found")
    sys.exit(1 if faults else 0)
