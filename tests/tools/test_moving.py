"""A recording that begins in motion is followed: from images to the estimate, against the truth.

test_moving.py EAR_PROGRAM CLIPS [TEST...]. CLIPS: folder of public recordings; without it they are skipped.
"""

import csv
import json
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

PROGRAM = Path(sys.argv.pop(1)).resolve()
CLIPS = Path(sys.argv.pop(1)).resolve()

FIRST_POSE = 2.5  # [s] after the first image at the latest

# The INS tells the speed of the IMU, and so does a wheel beneath it, given as two side by side: wheels further apart
# would have to turn differently in curves.
ENCODER_YAML = """sensor_type: wheel_encoder
rate_hz: 50
T_BS: {rows: 4, cols: 4, data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}
resolution: 262144
wraps: false
wheel_radius: [0.3, 0.3]
wheel_separation: 0.02
noise_counts: 20.0
"""
COUNTS_PER_METRE = 262144 / (2.0 * 3.141592653589793 * 0.3)


def read_rows(file):
    with file.open(encoding="utf-8") as lines:
        return [row for row in csv.reader(lines) if row and not row[0].startswith("#")]


def write_encoder(speed_csv, folder):
    """Counts of wheels that roll with the forward speed [m/s] of `speed_csv`, interpolated, 50 a second."""
    rows = [(int(row[0]), float(row[1])) for row in read_rows(speed_csv)]
    folder.mkdir()
    (folder / "sensor.yaml").write_text(ENCODER_YAML, encoding="utf-8")
    step, way, following = 20_000_000, 0.0, 1
    with (folder / "data.csv").open("w", encoding="utf-8") as out:
        out.write("#timestamp [ns],left [count],right [count]\n")
        for t_ns in range(rows[0][0], rows[-1][0], step):
            while rows[following][0] < t_ns:
                following += 1
            (t0, v0), (t1, v1) = rows[following - 1], rows[following]
            count = round(way * COUNTS_PER_METRE)
            out.write(f"{t_ns},{count},{count}\n")
            way += 1e-9 * step * (v0 + (v1 - v0) * (t_ns + step / 2 - t0) / (t1 - t0))


class Clip(unittest.TestCase):
    def clip(self, name):
        recording = CLIPS / name
        if not recording.exists():
            self.skipTest(f"no folder {recording}")
        return recording

    def run_program(self, *arguments):
        command = [str(PROGRAM), *map(str, arguments)]
        return subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)

    def error_percent(self, recording, truth, *options):
        """ATE in percent of the length."""
        with tempfile.TemporaryDirectory() as folder:
            output = Path(folder) / "output"
            result = self.run_program("run", recording, "--out", output, *options)
            self.assertEqual(result.returncode, 0, result)
            first = float((output / "estimate.tum").read_text(encoding="utf-8").split(maxsplit=1)[0])
            result = self.run_program("evaluate", output / "estimate.tum", truth, "--json")
            self.assertEqual(result.returncode, 0, result)
        first_image = 1e-9 * int(read_rows(recording / "mav0/cam0/data.csv")[0][0])
        self.assertLess(first - first_image, FIRST_POSE)
        percent = json.loads(result.stdout)["estimates"][0]["ate_percent"]
        print(f"{recording.name}: ATE {percent:.2f} % of the length", file=sys.stderr)
        return percent

    def test_car_with_two_cameras(self):
        recording = self.clip("kitti_a")
        self.assertLess(self.error_percent(recording, recording), 2.0)

    def test_car_with_two_cameras_and_speed(self):
        recording = self.clip("kitti_a")
        with tempfile.TemporaryDirectory() as folder:
            with_speed = Path(folder) / "kitti_a_with_speed"
            (with_speed / "mav0").mkdir(parents=True)
            for sensor in ("cam0", "cam1", "imu0"):
                (with_speed / "mav0" / sensor).symlink_to(recording / "mav0" / sensor)
            write_encoder(recording / "mav0/ins_speed0/data.csv", with_speed / "mav0/encoder0")
            self.assertLess(self.error_percent(with_speed, recording), 1.0)

    def test_one_camera_starts_in_motion(self):
        recording = self.clip("euroc_v101_mono")
        with tempfile.TemporaryDirectory() as folder:
            output = Path(folder) / "output"
            result = self.run_program("run", recording, "--out", output)
            self.assertEqual(result.returncode, 0, result)
            result = self.run_program("evaluate", output, recording, "--json")
        figures = json.loads(result.stdout)["estimates"][0]
        print(f"{recording.name}: ATE {1e3 * figures['ate_rmse_m']:.1f} mm", file=sys.stderr)
        self.assertLess(figures["ate_rmse_m"], 0.03)

    def test_one_camera_on_a_car_at_a_steady_speed_does_not_start(self):
        recording = self.clip("kitti_a")
        with tempfile.TemporaryDirectory() as folder:
            result = self.run_program("run", recording, "--mono", "--out", Path(folder) / "output")
        self.assertNotEqual(result.returncode, 0)
        self.assertIn("cannot start yet: it does not stand still", result.stderr)

    def test_one_camera_starts_where_it_is_told(self):
        """From a pose and velocity of the truth, without its biases. The estimate is then in the truth's world."""
        recording = self.clip("euroc_v101_mono")
        first = read_rows(recording / "mav0/cam0/data.csv")[0][0]
        truth = next(r for r in read_rows(recording / "mav0/state_groundtruth_estimate0/data.csv") if r[0] == first)
        with tempfile.TemporaryDirectory() as folder:
            start, output = Path(folder) / "start.yaml", Path(folder) / "output"
            position, rotation, velocity = (", ".join(truth[i:j]) for i, j in ((1, 4), (4, 8), (8, 11)))
            start.write_text(
                f"t_ns: {first}\nposition: [{position}]\nrotation: [{rotation}]\nvelocity: [{velocity}]\n",
                encoding="utf-8",
            )
            result = self.run_program("run", recording, "--out", output, "--start", start)
            self.assertEqual(result.returncode, 0, result)
            self.assertIn("90 of 90 frames estimated", result.stdout)
            states = output / "states.csv"
            result = self.run_program("evaluate", states, recording, "--align", "none", "--json")
            health = json.loads((output / "summary.json").read_text(encoding="utf-8"))["health"]
        figures = json.loads(result.stdout)["estimates"][0]
        print(
            f"{recording.name}, start given: ATE {1e3 * figures['ate_rmse_m']:.1f} mm,"
            f" rotation {figures['rotation_rmse_deg']:.2f} degrees, not aligned",
            file=sys.stderr,
        )
        self.assertLess(figures["ate_rmse_m"], 0.06)  # 38 mm of 1.35 m; 21 mm with the biases of the truth
        self.assertLess(figures["rotation_rmse_deg"], 1.5)
        self.assertFalse([entry for entry in health if entry["is"].startswith("lost")])


if __name__ == "__main__":
    unittest.main()
