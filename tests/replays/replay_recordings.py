"""The estimates of whole runs from images and files: what a change of the code must leave as it is.

replay_recordings.py EAR_PROGRAM RECORDINGS REFERENCE [--write]. RECORDINGS: folder of public recordings; those that it
lacks are skipped, by name. A rendered recording is made here. Positions must agree within TOLERANCE; whether all bits
of estimate.tum do is shown, and below how far each estimate is from the truth and whether its health says so.
"""

import hashlib
import math
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tools"))
from real.judge import judge, table  # noqa: E402

TOLERANCE = 1e-6  # [m]
STEP = 5.0  # [s] between the positions that are written
RENDERED = ["fly1", "--seed", "77", "--duration", "15"]
# Name, options of `ear run`, and how far it goes: what needs no images is read whole.
RUNS = [
    ("hop", []),
    ("hop", ["--odometer", "none"]),
    ("kitti_a", []),
    ("micro_euroc", []),
    ("euroc_mh01_mono", []),
    ("comma2k19", []),
    ("ucsd_20", []),
    ("lawn_wheels", []),
]


def ear(program, *arguments):
    result = subprocess.run([str(program), *map(str, arguments)], stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    if result.returncode != 0:
        raise RuntimeError(f"ear {' '.join(map(str, arguments))}: {result.stderr}")


def estimate(program, recording, options, folder):
    """Lines: a count and digest of estimate.tum, then a position every STEP seconds."""
    ear(program, "run", recording, "--out", folder, *options)
    text = (folder / "estimate.tum").read_bytes()
    rows = [line.split() for line in text.decode().splitlines() if line and not line.startswith("#")]
    lines = [f"{len(rows)} {hashlib.sha256(text).hexdigest()[:16]}"]
    next_s = -math.inf
    for row in rows:
        if float(row[0]) < next_s:
            continue
        next_s = float(row[0]) + STEP
        lines.append("  " + " ".join(row[:4]))
    return lines


def difference(expected, found):
    """How far apart two rows of a time and a position are [m]; infinity for another time."""
    a, b = expected.split(), found.split()
    if a[0] != b[0]:
        return math.inf
    return max(abs(float(x) - float(y)) for x, y in zip(a[1:], b[1:]))


def compare(name, expected, found):
    """Faults of one run, after a line about it."""
    if len(expected) != len(found) or expected[0].split()[0] != found[0].split()[0]:
        print(f"{name}: expected {expected[0]} and {len(expected)} lines, found {found[0]} and {len(found)}")
        return 1
    largest = max((difference(a, b) for a, b in zip(expected[1:], found[1:])), default=0.0)
    same = "the same bits" if expected[0] == found[0] else f"other bits, {largest:.2g} m off"
    print(f"{name}: {same}")
    return 0 if largest <= TOLERANCE else 1


def read(reference):
    runs, name = {}, ""
    for line in reference.read_text(encoding="utf-8").splitlines():
        if line.startswith("#") or not line:
            continue
        if line.startswith("  "):
            runs[name].append(line)
        else:
            name, _, first = line.partition(": ")
            runs[name] = [first]
    return runs


def main():
    program, recordings, reference = (Path(argument).resolve() for argument in sys.argv[1:4])
    write = "--write" in sys.argv
    expected = {} if write else read(reference)
    found, judged, faults, compared = {}, [], 0, 0
    with tempfile.TemporaryDirectory() as folder:
        rendered = Path(folder) / "rendered"
        ear(program, "simulate", *RENDERED, "--out", rendered)
        runs = [("rendered " + " ".join(RENDERED), rendered, [])]
        for clip, options in RUNS:
            if (recordings / clip).exists():
                runs.append((" ".join([clip, *options]), recordings / clip, options))
            else:
                print(f"{clip}: skipped, no folder {recordings / clip}")
        for i, (name, recording, options) in enumerate(runs):
            found[name] = estimate(program, recording, options, Path(folder) / str(i))
            judged.append((name, judge(program, Path(folder) / str(i), recording)))
            if not write:
                compared += 1
                faults += compare(name, expected[name], found[name])
    if write:
        lines = ["# Made by replay_recordings.py --write. A run: estimates, digest; then time [s] and position [m]."]
        for name, rows in found.items():
            lines += [f"{name}: {rows[0]}", *rows[1:]]
        reference.write_text("\n".join(lines) + "\n", encoding="utf-8")
    print(table(judged))
    print(f"{compared} runs compared, {faults} moved")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
