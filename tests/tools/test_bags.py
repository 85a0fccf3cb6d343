"""A recording to a ROS 1 bag and back, and to EuRoC's layout. test_bags.py EAR_PROGRAM [TEST...]"""

import subprocess
import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))
from temporary_folder import InTemporaryFolder

PROGRAM = Path(sys.argv.pop(1)).resolve()


def ear(*arguments):
    return subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, check=False)


def poses(run):
    return [[float(word) for word in line.split()] for line in (run / "estimate.tum").read_text().splitlines()]


class Bags(InTemporaryFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.recording = cls.work / "recording"
        made = ear("simulate", "flat1", "--duration", "4", "--camera-rate", "10", "--out", cls.recording)
        assert made.returncode == 0, made

    def test_euroc(self):
        out = self.work / "euroc"
        self.assertEqual(ear("export", self.recording, "--format", "euroc", "--out", out).returncode, 0)
        self.assertEqual({folder.name for folder in (out / "mav0").iterdir()},
                         {"cam0", "cam1", "imu0", "state_groundtruth_estimate0"})
        self.assertEqual(ear("run", out, "--out", self.work / "a").returncode, 0)
        self.assertEqual(ear("run", self.recording, "--odometer", "none", "--out", self.work / "b").returncode, 0)
        self.assertEqual((self.work / "a/estimate.tum").read_text(), (self.work / "b/estimate.tum").read_text())
        again = ear("export", self.recording, "--format", "euroc", "--out", out)
        self.assertIn("is there already", again.stderr)

    def test_bag(self):
        bag = self.work / "recording.bag"
        done = ear("export", self.recording, "--format", "rosbag1", "--out", bag)
        if "built without ROS bags" in done.stderr:
            self.skipTest("built without ROS bags")
        self.assertEqual(done.returncode, 0, done.stderr)
        checked = ear("check", bag)
        self.assertEqual(checked.returncode, 0, checked)
        self.assertIn("laser0", checked.stdout)
        self.assertEqual(ear("run", bag, "--out", self.work / "of_bag").returncode, 0)
        self.assertEqual(ear("run", self.recording, "--out", self.work / "of_folder").returncode, 0)
        of_bag, of_folder = poses(self.work / "of_bag"), poses(self.work / "of_folder")
        self.assertGreater(len(of_bag), 20)
        for a, b in zip(of_bag, of_folder, strict=True):
            self.assertEqual(a[0], b[0])
            for x, y in zip(a, b):
                self.assertAlmostEqual(x, y, delta=2e-6)  # ranges are floats in messages

        missing = self.work / "topics.yaml"
        missing.write_text("topics: {imu: /other}\n")
        self.assertIn("no messages on this topic of the IMU; there are", ear("check", bag, "--config", missing).stdout +
                      ear("run", bag, "--config", missing).stderr)


if __name__ == "__main__":
    unittest.main()
