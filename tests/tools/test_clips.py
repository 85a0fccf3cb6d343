"""Recordings that nobody here made: how far the estimate is from their truth, with the settings that serve all.

test_clips.py EAR_PROGRAM CLIPS [TEST...]. CLIPS: folder of public recordings; those that it lacks are skipped.
"""

import json
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

PROGRAM = Path(sys.argv.pop(1)).resolve()
CLIPS = Path(sys.argv.pop(1)).resolve()


class Clips(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.output = Path(folder.name) / "output"

    def clip(self, name):
        recording = CLIPS / name
        if not recording.exists():
            self.skipTest(f"no folder {recording}")
        return recording

    def ear(self, *arguments):
        command = [str(PROGRAM), *map(str, arguments)]
        result = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
        self.assertEqual(result.returncode, 0, result)
        return result.stdout

    def position_rmse(self, recording, *options):
        self.ear("run", recording, "--out", self.output, *options)
        report = json.loads(self.ear("evaluate", self.output / "estimate.tum", recording, "--json"))
        figures = report["estimates"][0]
        print(f"{recording.name} {' '.join(options)}: {figures['ate_rmse_m']:.4f} m", file=sys.stderr)
        self.assertGreater(figures["coverage"], 0.95)
        return figures["ate_rmse_m"]

    def test_hop_by_camera_and_inertia(self):
        self.assertLess(self.position_rmse(self.clip("hop"), "--odometer", "none"), 0.021)

    def test_hop_by_all_sensors(self):
        self.assertLess(self.position_rmse(self.clip("hop")), 0.015)


if __name__ == "__main__":
    unittest.main()
