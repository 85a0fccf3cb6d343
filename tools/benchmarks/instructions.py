#!/usr/bin/env python3
"""Instructions per stereo frame, counted by callgrind: a figure that does not depend on what else the machine does.

instructions.py TOOLS [RECORDING] [--filter-only] [--repeat N] [--json]
instructions.py --builds BUILD... [--sysroot FOLDER]

TOOLS is the folder of the programs, such as build/release/tools. Two runs:
- tracks: the filter alone, on 10 s of simulated feature tracks (flat1, seed 501), two of them standing;
- images: `ear bench` on RECORDING, or on 3 s that are simulated for it (flat1, seed 1). Here are also the front end, and
  the floor that the whole is compared with.
Counts all frames, the first ones too.

--builds compares processors: the two short motions of tests/platform/estimates (filter on tracks; images, front end and
filter), as each build folder has it. A program for another processor runs under qemu-user, with its libraries in
FOLDER (build/aarch64-sysroot; tools/aarch64 makes both), and a plugin counts its instructions.
"""

import argparse
import collections
import json
import platform
import re
import subprocess
import sys
import tempfile
from pathlib import Path

# What is reported, and the functions that make it up. The floor is part of Floor::measure, which also picks points.
PARTS = {
    "pipeline": [r"ear::Odometry::add_(stereo|imu|encoder|laser)\("],
    "front end": [r"ear::Frontend::process\("],
    "filter": [r"ear::(Filter::process|CommonEstimator::(add_imu|add_encoder|add_laser|common_stamp|motion_to))\("],
}
PROCESS = r"ear::Filter::process\("
FLOOR_CALLER = r"ear::tools::Floor::measure\("
FLOOR = r"cv::(buildOpticalFlowPyramid|calcOpticalFlowPyrLK)\("

# Of --builds: parts by stage, per frame of the front end or of the filter.
STAGES = {
    "front end": [r"ear::Frontend::process\("],
    "  pyramids": [r"ear::ImagePyramid::build\("],
    "  tracking": [r"ear::Frontend::Impl::track\("],
    "  stereo": [r"ear::Frontend::Impl::match_stereo\("],
    "  outliers": [r"ear::Frontend::Impl::reject\("],
    "  new features": [r"ear::Frontend::Impl::detect\("],
    "filter": PARTS["filter"],
    "  samples": [r"ear::CommonEstimator::add_(imu|encoder|laser)\("],
    "  updates": [r"ear::Covariance::update\("],
    "  propagation": [r"ear::Ekf::propagate\("],
    "  features": [r"ear::TrackUpdate::add\(", r"ear::FeatureInformation::compress\("],
}


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


class Program:
    """A program's file: for which processor, and where its functions are."""

    def __init__(self, file):
        self.file = file

        def output(*command):
            return subprocess.run([*command, file], check=True, capture_output=True, text=True).stdout

        header = output("readelf", "-hW")
        self.machine = "aarch64" if "AArch64" in header else "x86_64" if "X86-64" in header else "unknown"
        executed = [line.split() for line in output("readelf", "-lW").splitlines() if re.match(r" +LOAD .* R E ", line)]
        self.code = executed[0][2]
        self.functions = collections.defaultdict(set)  # addresses by name
        for line in output("nm", "-C").splitlines():
            match = re.fullmatch(r"([0-9a-f]+) [tTwW] (.*)", line)
            if match and not match[2].endswith(".cold]"):
                self.functions[match[2]].add(match[1])


def count_emulated(program, sysroot, patterns):
    """Per pattern: calls and instructions of the functions that match, each with all that it calls."""
    matching = {pattern: {address for name, addresses in program.functions.items() if re.match(pattern, name)
                          for address in addresses} for pattern in patterns}
    wanted = sorted(set().union(*matching.values()))
    with tempfile.TemporaryDirectory() as folder:
        plugin = Path(folder) / "libcount.so"
        source = Path(__file__).with_name("count_instructions.c")
        subprocess.run(["cc", "-O2", "-shared", "-fPIC", "-fvisibility=hidden", "-o", plugin, source], check=True)
        arguments = ",".join([str(plugin), f"code={program.code}", *(f"function={address}" for address in wanted)])
        done = subprocess.run([f"qemu-{program.machine}", "-L", sysroot, "-plugin", arguments, "-d", "plugin",
                               program.file], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, check=True)
    if not re.search(r"^all \d+ unfinished 0$", done.stderr, re.MULTILINE):
        sys.exit(f"{program.file}: calls that did not return: {done.stderr[-200:]}")
    lines = re.findall(r"^(\d+) (\d+) (\d+)$", done.stderr, re.MULTILINE)
    counted = {wanted[int(index)]: (int(calls), int(instructions)) for index, calls, instructions in lines}
    return {pattern: [sum(counted[address][k] for address in addresses) for k in (0, 1)]
            for pattern, addresses in matching.items()}


def count_build(build, sysroot):
    """Instructions per frame by stage, of tests/platform/estimates."""
    program = Program(Path(build) / "tests/platform/estimates")
    patterns = [*{pattern: None for stage in STAGES.values() for pattern in stage}, PROCESS]
    if program.machine == platform.machine():
        profile, _ = profile_of(program.file)
        counted = {pattern: [profile.calls_of(pattern), profile.inclusive(pattern)] for pattern in patterns}
    else:
        counted = count_emulated(program, sysroot, patterns)
    frames = {"front end": counted[STAGES["front end"][0]][0], "filter": counted[PROCESS][0]}
    group = None
    per_frame = {}
    for stage, of_stage in STAGES.items():
        group = stage if stage in frames else group
        per_frame[stage] = sum(counted[pattern][1] for pattern in of_stage) / frames[group]
    return program.machine, per_frame


def compare_builds(arguments):
    results = [count_build(build, arguments.sysroot) for build in arguments.builds]
    if arguments.json:
        print(json.dumps([{"processor": machine, **per_frame} for machine, per_frame in results], indent=2))
        return
    print(f"{'million per frame':18}" + "".join(f"{machine:>10}" for machine, _ in results))
    for stage in STAGES:
        print(f"{stage:18}" + "".join(f"{1e-6 * per_frame[stage]:10.3f}" for _, per_frame in results))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("tools", type=Path, nargs="?", help="the folder of the programs")
    parser.add_argument("recording", type=Path, nargs="?")
    parser.add_argument("--filter-only", action="store_true", help="without the images")
    parser.add_argument("--repeat", type=int, default=1, help="count so many times, and say how far they differ")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--builds", nargs="+", help="compares processors: build folders")
    parser.add_argument("--sysroot", default="build/aarch64-sysroot", help="of builds for other processors")
    arguments = parser.parse_args()
    if arguments.builds:
        compare_builds(arguments)
        return
    if not arguments.tools:
        parser.error("TOOLS is needed, or --builds")
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
