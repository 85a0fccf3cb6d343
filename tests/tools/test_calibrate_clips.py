"""ear calibrate on recordings that nobody here made, where something is known of what it finds.

test_calibrate_clips.py EAR_PROGRAM CLIPS [TEST...]. CLIPS: folder of public recordings; those that it lacks are skipped.
"""

import json
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

PROGRAM = Path(sys.argv.pop(1)).resolve()
CLIPS = Path(sys.argv.pop(1)).resolve()

CAR_RADIUS = 343.3  # [mm] by the way that its truth travels; its calibration says 340


class Calibrate(unittest.TestCase):
    def recording(self, name):
        path = CLIPS / name
        if not path.is_dir():
            self.skipTest(f"{path} is not there")
        return path

    def calibrated(self, file, *arguments):
        with tempfile.TemporaryDirectory() as out:
            command = [PROGRAM, "calibrate", *arguments, "--out", out]
            done = subprocess.run([str(part) for part in command], capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 0, done.stderr)
            return json.loads((Path(out) / file).read_text(encoding="utf-8"))

    def test_radius_of_a_car_by_reference_positions(self):
        car = self.recording("comma2k19")
        truth = car / "mav0/state_groundtruth_estimate0/data.csv"
        found = self.calibrated("calibration.json", car, "--reference", truth, "--reference-sigma", "0.5")
        parameters = {parameter["name"]: parameter for parameter in found["parameters"]}
        radius = parameters["encoder0: wheel radius, mean"]
        self.assertTrue(radius["shown"])
        error = abs(radius["given"] + radius["change"] - CAR_RADIUS)
        self.assertLess(error, 1e-3 * CAR_RADIUS)
        # Over pieces of 100 m of the way it scatters by 0.3 mm, so that the whole says it to 0.1 mm and no better.
        self.assertGreater(radius["posterior_sigma"], 0.08)
        self.assertLess(radius["posterior_sigma"], 0.2)
        self.assertLess(error, 2.0 * radius["posterior_sigma"])
        for hidden in ("encoder0: wheel separation", "encoder0: position of the axle x"):
            self.assertFalse(parameters[hidden]["shown"], hidden)
            self.assertNotEqual(parameters[hidden]["motion_wanted"], "")

    def test_clock_of_a_car_s_cameras(self):
        """The inertial samples are 53 ms late against the attitude that the same device gives, which the cameras follow."""
        found = self.calibrated("calibration.json", self.recording("kitti_a"))
        parameters = {parameter["name"]: parameter for parameter in found["parameters"]}
        clock = parameters["cam0: time offset"]
        self.assertTrue(clock["shown"])
        self.assertLess(clock["posterior_sigma"], 3.0)
        self.assertLess(abs(clock["given"] + clock["change"] - 53.0), 10.0)  # [ms]; the cameras' trigger lasts some too

    def test_noise_of_a_simulated_imu(self):
        """2.5 s at rest, with 1e-3 rad/s/sqrt(Hz) and 1e-2 m/s^2/sqrt(Hz)."""
        noise = self.calibrated("imu_noise.json", "--imu", self.recording("hop"))
        for index, axis in enumerate(noise["axes"]):
            true = 1e-3 if index < 3 else 1e-2
            self.assertLess(abs(axis["white"]["value"] - true), 0.15 * true)  # two standard deviations of 2.5 s
            self.assertIsNone(axis["random_walk"])


if __name__ == "__main__":
    unittest.main()
