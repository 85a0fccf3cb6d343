"""A vehicle that stands stays where it is: from images to the estimate, against the truth.

test_standing.py EAR_PROGRAM CLIPS [TEST...]. CLIPS: folder of public recordings; without it they are skipped.
"""

import bisect
import csv
import math
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

PROGRAM = Path(sys.argv.pop(1)).resolve()
CLIPS = Path(sys.argv.pop(1)).resolve()

MAX_DRIFT = 0.005  # [m] between the first estimate and the last ones
MAX_DISTANCE = 0.010  # [m] at any time, also while legs give under starting rotors
MAX_TURN = math.radians(0.12)  # estimates begin before the rotors do; the reference scatters by 0.06 degrees
LAST = 0.5  # [s] the last estimates


def multiply(a, b):
    """Hamilton product of quaternions (w, x, y, z)."""
    return (
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    )


def conjugate(q):
    return (q[0], -q[1], -q[2], -q[3])


def turn_about_z(q):
    """The part of a rotation that is about the vertical [rad]."""
    return math.remainder(2.0 * math.atan2(q[3], q[0]), 2.0 * math.pi)


def read_truth(recording):
    """Stamps [s], positions [m] and attitudes (w, x, y, z), body to world."""
    with (recording / "mav0/state_groundtruth_estimate0/data.csv").open(encoding="utf-8") as file:
        rows = [row for row in csv.reader(file) if row and not row[0].startswith("#")]
    poses = [tuple(map(float, row[1:8])) for row in rows]
    return [int(row[0]) * 1e-9 for row in rows], [pose[:3] for pose in poses], [pose[3:] for pose in poses]


def read_estimate(output):
    with (output / "estimate.tum").open(encoding="utf-8") as file:
        rows = [tuple(map(float, line.split())) for line in file if not line.startswith("#")]
    return [row[0] for row in rows], [row[1:4] for row in rows], [(row[7], *row[4:7]) for row in rows]


def errors(recording, output):
    """Error of the position [m], and of the heading [rad], of each estimate since the first. The worlds may differ by a
    shift and a turn about the vertical."""
    truth_t, truth_p, truth_q = read_truth(recording)
    estimate_t, estimate_p, estimate_q = read_estimate(output)
    nearest = [min(bisect.bisect_left(truth_t, t), len(truth_t) - 1) for t in estimate_t]
    differences = [multiply(q, conjugate(truth_q[i])) for q, i in zip(estimate_q, nearest)]
    start = turn_about_z(differences[0])
    cosine, sine = math.cos(start), math.sin(start)
    positions, turns = [], []
    for p, i, difference in zip(estimate_p, nearest, differences):
        x, y, z = (a - b for a, b in zip(truth_p[i], truth_p[nearest[0]]))
        moved = (cosine * x - sine * y, sine * x + cosine * y, z)
        positions.append([a - b - c for a, b, c in zip(p, estimate_p[0], moved)])
        turns.append(math.remainder(turn_about_z(difference) - start, 2.0 * math.pi))
    return estimate_t, positions, turns


class Standing(unittest.TestCase):
    def ear(self, *arguments):
        command = [str(PROGRAM), *map(str, arguments)]
        result = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
        self.assertEqual(result.returncode, 0, result)

    def assert_stays(self, recording, duration):
        with tempfile.TemporaryDirectory() as folder:
            output = Path(folder) / "output"
            self.ear("run", recording, "--out", output)
            stamps, positions, turns = errors(recording, output)
        last = [p for t, p in zip(stamps, positions) if t > stamps[-1] - LAST]
        drift = math.hypot(*(sum(axis) / len(last) for axis in zip(*last)))
        distance = max(math.hypot(*p) for p in positions)
        turn = max(map(abs, turns))
        print(
            f"{recording.name}: drift {1e3 * drift:.2f} mm, at most {1e3 * distance:.2f} mm off and"
            f" {math.degrees(turn):.3f} degrees",
            file=sys.stderr,
        )
        self.assertGreater(stamps[-1] - stamps[0], duration)
        self.assertLess(drift, MAX_DRIFT)
        self.assertLess(distance, MAX_DISTANCE)
        self.assertLess(turn, MAX_TURN)


class Rendered(Standing):
    """Ten images a second instead of thirty, which take a third of the time to render."""

    def test_a_minute(self):
        for seed in (301, 302):
            with self.subTest(seed=seed), tempfile.TemporaryDirectory() as folder:
                recording = Path(folder) / f"static_{seed}"
                rate = ("--camera-rate", "10", "--duration", "62")
                self.ear("simulate", "static", "--seed", seed, *rate, "--out", recording)
                self.assert_stays(recording, 60.0)


class Clip(Standing):
    """EuRoC V1_01 before its take-off: the rotors start, and the vehicle shakes on its legs."""

    def test_micro_euroc(self):
        recording = CLIPS / "micro_euroc"
        if not recording.exists():
            self.skipTest(f"no folder {recording}")
        self.assert_stays(recording, 3.0)


if __name__ == "__main__":
    unittest.main()
