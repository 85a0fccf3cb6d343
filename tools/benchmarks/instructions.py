#!/usr/bin/env python3
"""Instructions per stereo frame, counted by valgrind: a figure that does not depend on what else the machine does.

instructions.py EAR [RECORDING] [--json]

Runs `ear bench` under callgrind; without a recording it simulates one first (flat1, seed 1, 5 s). Counts all frames, the
first ones too. The front end and the filter are inclusive; below them stands the most expensive they call.
"""

import argparse
import collections
import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

# What is reported, and the functions that make it up. The floor is part of Floor::measure, which also picks points.
PARTS = {
    "pipeline": [r"ear::Odometry::add_(stereo|imu|encoder|laser)\("],
    "front end": [r"ear::Frontend::process\("],
    "filter": [r"ear::Filter::(process|add_imu|add_encoder|add_laser|motion_to)\("],
}
FLOOR_CALLER = r"ear::tools::Floor::measure\("
FLOOR = r"cv::(buildOpticalFlowPyramid|calcOpticalFlowPyrLK)\("


class Profile:
    """The inclusive cost of every call in a file of callgrind: calls[caller][callee]."""

    def __init__(self, file):
        self.calls = collections.defaultdict(collections.Counter)
        names = {}
        caller = callee = None

        def name(text):
            number, _, rest = re.fullmatch(r"(\(\d+\))( (.*))?", text).groups()
            if rest:
                names[number] = rest
            return names[number]

        lines = iter(file.read_text(encoding="utf-8", errors="replace").splitlines())
        for line in lines:
            if line.startswith("fn="):
                caller = name(line[3:])
            elif line.startswith("cfn="):
                callee = name(line[4:])
            elif line.startswith("calls="):
                self.calls[caller][callee] += int(next(lines).split()[1])

    def inclusive(self, pattern, within=None):
        """Of all calls to matching functions from others, or from the functions that match `within`."""
        return sum(cost for caller, callees in self.calls.items() for callee, cost in callees.items()
                   if re.match(pattern, callee) and (re.match(within, caller) if within else not re.match(pattern, caller)))


def count(ear, recording):
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "callgrind.out"
        command = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={file}", ear, "bench", recording, "--json"]
        done = subprocess.run([*map(str, command)], capture_output=True, text=True, check=False)
        if done.returncode != 0:
            sys.exit(done.stderr)
        profile = Profile(file)
    frames = json.loads(done.stdout)["frames"] + 5  # those of the warm-up are counted too
    cost = {part: sum(profile.inclusive(pattern) for pattern in patterns) for part, patterns in PARTS.items()}
    cost["floor"] = profile.inclusive(FLOOR, within=FLOOR_CALLER)
    return {"frames": frames, **{part: instructions / frames for part, instructions in cost.items()}}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("ear", type=Path, help="the ear program")
    parser.add_argument("recording", type=Path, nargs="?")
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        recording = arguments.recording or Path(folder) / "recording"
        if arguments.recording is None:
            command = [arguments.ear, "simulate", "flat1", "--seed", "1", "--duration", "5", "--out", recording]
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        figures = count(arguments.ear, recording)
    if arguments.json:
        print(json.dumps(figures, indent=2))
        return
    print(f"{figures['frames']} frames, million instructions per frame")
    for part in ("floor", *PARTS):
        print(f"{part:10} {figures[part] / 1e6:8.2f}")
    print(f"ratio      {figures['pipeline'] / figures['floor']:8.3f}")


if __name__ == "__main__":
    main()
