"""Ten minutes of a flight over the wire: no inertial sample is lost, memory is flat, estimates are those of `ear run`.

test_long_run.py EAR_PROGRAM PLAYER [TEST...]
"""

import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import long_run

PROGRAM, PLAYER = Path(sys.argv.pop(1)).resolve(), Path(sys.argv.pop(1)).resolve()


class LongRun(unittest.TestCase):
    def test_ten_minutes(self):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            recording = folder / "recording"
            for arguments in (["simulate", "fly1", "--seed", "5", "--out", recording],
                              ["run", recording, "--out", folder / "run"]):
                subprocess.run([PROGRAM, *arguments], check=True, stdin=subprocess.DEVNULL, capture_output=True)
            figures = long_run.run(PROGRAM, PLAYER, recording, folder, 600, budget="budget_ms: 0\nframe_slots: 32")
            print(figures)
            self.assertEqual(figures["exit"], 0)
            self.assertEqual(figures["inertial_taken"], figures["inertial_sent"])
            self.assertEqual(figures["inertial_refused"], 0)
            first, *_, last = figures["resident_mb"]
            self.assertLess(last, 100)
            self.assertLess(last, first + 5)
            if figures["impatient_frames"] == 0:  # else the machine was too busy, and said so
                far, missing = long_run.farthest(long_run.positions(folder / "live/estimate.tum"),
                                                 long_run.positions(folder / "run/estimate.tum"))
                self.assertLess(far, 1e-6)
                self.assertEqual(missing, 0)


if __name__ == "__main__":
    unittest.main()
