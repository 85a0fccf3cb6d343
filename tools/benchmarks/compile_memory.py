#!/usr/bin/env python3
"""compile_memory.py BUILD_FOLDER [--target ear_program] [--only REGEX] [--limit 1000]

Compiles every source of a target once more, without a compiler cache, and prints the largest resident size of each
compiler [MB], largest first. Fails if one is over the limit. The folder's generator must be Ninja, and configured.
"""

import argparse
import json
import os
import re
import shlex
import subprocess
import sys
import tempfile

CACHES = ("ccache", "sccache")


def ninja(folder, *arguments):
    return subprocess.run(["ninja", "-C", folder, "-t", *arguments], check=True, capture_output=True, text=True).stdout


def sources(folder, target, only):
    """(source, command) of each object that the target is made of."""
    objects = {name for name in ninja(folder, "inputs", target).split() if name.endswith(".o")}
    for entry in json.loads(ninja(folder, "compdb")):
        if entry["output"] in objects and re.search(only, entry["file"]):
            command = shlex.split(entry["command"])
            yield entry["file"], command[1:] if os.path.basename(command[0]) in CACHES else command


def peak_memory(folder, command):
    """Of the compiler's largest process [MB]."""
    with tempfile.TemporaryDirectory() as scratch:
        for option, name in (("-o", "object"), ("-MF", "dependencies")):
            if option in command:
                command[command.index(option) + 1] = os.path.join(scratch, name)
        # A process of its own, so that the maximum over its children is that of one compiler.
        code = "import json,resource,subprocess,sys; subprocess.run(json.loads(sys.argv[1]), check=True);" \
               "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)"
        result = subprocess.run([sys.executable, "-c", code, json.dumps(command)], cwd=folder, check=True,
                                capture_output=True, text=True)
    return int(result.stdout) // 1000


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder")
    parser.add_argument("--target", default="ear_program")
    parser.add_argument("--only", default="", help="sources whose path has this")
    parser.add_argument("--limit", type=int, default=1000, help="[MB]")
    arguments = parser.parse_args()
    peaks = []
    for source, command in sources(arguments.folder, arguments.target, arguments.only):
        peaks.append((peak_memory(arguments.folder, command), source))
    for peak, source in sorted(peaks, reverse=True):
        print(f"{peak:5} MB  {os.path.relpath(os.path.join(arguments.folder, source))}")
    return 1 if any(peak > arguments.limit for peak, _ in peaks) else 0


if __name__ == "__main__":
    sys.exit(main())
