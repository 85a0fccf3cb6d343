#!/usr/bin/env python3
"""compile_memory.py BUILD_FOLDER [--target ear_program] [--only REGEX] [--limit 1000]

Compiles every source of a target once more, without a compiler cache, and prints the largest resident size of each
compiler [MB] and its processor time [s], largest first, and the sum of the times. Fails if one is over the limit. The
folder's generator must be Ninja, and configured.
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
            yield entry["file"], without_cache(shlex.split(entry["command"]))


def without_cache(command):
    """What follows the cache, and what sets its environment."""
    caches = [i for i, word in enumerate(command) if os.path.basename(word) in CACHES]
    return command[caches[0] + 1:] if caches else command


def cost(folder, command):
    """Memory of the compiler's largest process [MB], processor time of all [s]."""
    with tempfile.TemporaryDirectory() as scratch:
        for option, name in (("-o", "object"), ("-MF", "dependencies")):
            if option in command:
                command[command.index(option) + 1] = os.path.join(scratch, name)
        # A process of its own, so that the maximum over its children is that of one compiler.
        code = "import json,resource,subprocess,sys; subprocess.run(json.loads(sys.argv[1]), check=True);" \
               "u = resource.getrusage(resource.RUSAGE_CHILDREN); print(u.ru_maxrss, u.ru_utime + u.ru_stime)"
        result = subprocess.run([sys.executable, "-c", code, json.dumps(command)], cwd=folder, check=True,
                                capture_output=True, text=True)
    peak, seconds = result.stdout.split()
    return int(peak) // 1000, float(seconds)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder")
    parser.add_argument("--target", default="ear_program")
    parser.add_argument("--only", default="", help="sources whose path has this")
    parser.add_argument("--limit", type=int, default=1000, help="[MB]")
    arguments = parser.parse_args()
    costs = []
    for source, command in sources(arguments.folder, arguments.target, arguments.only):
        costs.append((*cost(arguments.folder, command), source))
    for peak, seconds, source in sorted(costs, reverse=True):
        print(f"{peak:5} MB  {seconds:6.1f} s  {os.path.relpath(os.path.join(arguments.folder, source))}")
    print(f"{len(costs)} sources, {sum(seconds for _, seconds, _ in costs):.0f} s")
    return 1 if any(peak > arguments.limit for peak, *_ in costs) else 0


if __name__ == "__main__":
    sys.exit(main())
