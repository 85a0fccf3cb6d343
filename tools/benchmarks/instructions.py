#!/usr/bin/env python3
"""Instructions per stereo frame, counted by callgrind: a figure that does not depend on what else the machine does.

instructions.py TOOLS [RECORDING] [--filter-only] [--repeat N] [--json]

TOOLS is the folder of the programs, such as build/release/tools. Two runs:
- tracks: the filter alone, on 10 s of simulated feature tracks (flat1, seed 501), two of them standing;
- images: `ear bench` on RECORDING, or on 3 s that are simulated for it (flat1, seed 1). Here are also the front end, and
  the floor that the whole is compared with.
Counts all frames, the first ones too.
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
    "filter": [r"ear::Filter::(process|add_imu|add_encoder|add_laser|common_stamp|motion_to)\("],
}
PROCESS = r"ear::Filter::process\("
FLOOR_CALLER = r"ear::tools::Floor::measure\("
FLOOR = r"cv::(buildOpticalFlowPyramid|calcOpticalFlowPyrLK)\("


class Profile:
    """The inclusive cost and the number of all calls in a file of callgrind: calls[caller][callee]."""

    def __init__(self, file):
        self.calls = collections.defaultdict(collections.Counter)
        self.numbers = collections.Counter()  # by callee
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
                self.numbers[callee] += int(line[6:].split()[0])
                self.calls[caller][callee] += int(next(lines).split()[1])

    def calls_of(self, pattern):
        return sum(number for callee, number in self.numbers.items() if re.match(pattern, callee))

    def inclusive(self, pattern, within=None):
        """Of all calls to matching functions from others, or from the functions that match `within`."""
        return sum(cost for caller, callees in self.calls.items() for callee, cost in callees.items()
                   if re.match(pattern, callee) and (re.match(within, caller) if within else not re.match(pattern, caller)))


def profile_of(*command):
    """Runs a program under callgrind; its profile, and what it printed."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "callgrind.out"
        line = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={file}", *map(str, command)]
        done = subprocess.run(line, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            sys.exit(done.stderr)
        return Profile(file), done.stdout


def count_tracks(tools):
    profile, _ = profile_of(tools / "track_accuracy", "--sequences", "flat1", "--seeds", "501", "--duration", "10",
                            "--calibration", "wrong", "--odometer", "terrain", "--threads", "1", "--json")
    frames = profile.calls_of(PROCESS)
    return {"tracks frames": frames, "tracks filter": sum(map(profile.inclusive, PARTS["filter"])) / frames}


def count_images(tools, recording):
    with tempfile.TemporaryDirectory() as folder:
        if recording is None:
            recording = Path(folder) / "recording"
            command = [tools / "ear", "simulate", "flat1", "--seed", "1", "--duration", "3", "--out", recording]
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        profile, _ = profile_of(tools / "ear", "bench", recording, "--json")
    frames = profile.calls_of(PROCESS)
    cost = {part: sum(map(profile.inclusive, patterns)) for part, patterns in PARTS.items()}
    cost["floor"] = profile.inclusive(FLOOR, within=FLOOR_CALLER)
    return {"images frames": frames, **{f"images {part}": value / frames for part, value in cost.items()}}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("tools", type=Path, help="the folder of the programs")
    parser.add_argument("recording", type=Path, nargs="?")
    parser.add_argument("--filter-only", action="store_true", help="without the images")
    parser.add_argument("--repeat", type=int, default=1, help="count so many times, and say how far they differ")
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    runs = []
    for _ in range(arguments.repeat):
        runs.append(count_tracks(arguments.tools))
        if not arguments.filter_only:
            runs[-1] |= count_images(arguments.tools, arguments.recording)
    if arguments.json:
        print(json.dumps(runs, indent=2))
        return
    for name in runs[0]:
        values = [run[name] for run in runs]
        spread = f"  +-{50 * (max(values) - min(values)) / max(values[0], 1):.3f} %" if len(runs) > 1 else ""
        unit, factor = ("", 1) if name.endswith("frames") else ("million per frame", 1e-6)
        print(f"{name:18} {factor * values[0]:9.3f} {unit}{spread}")
    if not arguments.filter_only:
        print(f"ratio to the floor {runs[0]['images pipeline'] / runs[0]['images floor']:9.3f}")


if __name__ == "__main__":
    main()
