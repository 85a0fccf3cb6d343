"""`ear live` with a vehicle that speaks ROS 2 by another implementation of DDS (fast_dds_player.cpp), over loopback.

test_live_ros.py EAR_PROGRAM PLAYER [TEST...]
"""

import csv
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

import loopback

PROGRAM, PLAYER = Path(sys.argv.pop(1)).resolve(), Path(sys.argv.pop(1)).resolve()

os.environ["CYCLONEDDS_URI"] = loopback.URI

SECONDS = 5
CONFIG = """calibration: {recording}
budget_ms: 0
frame_slots: 64
ros: {{domain: {domain}}}
topics: {{imu: /imu0, left: /cam0/image_raw, right: /cam1/image_raw, wheels: /wheels,
  beam_0: /laser/0, beam_1: /laser/1, beam_2: /laser/2}}
"""


def ear(*arguments):
    return subprocess.run([str(PROGRAM), *map(str, arguments)], stdin=subprocess.DEVNULL, capture_output=True, text=True,
                          check=True)


class Live:
    """A process of `ear live`, which ends with SIGTERM."""

    def __init__(self, folder, config, *arguments):
        self.log_file = (folder / "live.log").open("w+", encoding="utf-8")
        self.process = subprocess.Popen([str(PROGRAM), "live", "--config", str(config), *map(str, arguments)],
                                        stdin=subprocess.DEVNULL, stderr=self.log_file)

    def log(self):
        self.log_file.flush()
        return Path(self.log_file.name).read_text(encoding="utf-8")

    def wait_for(self, words, seconds=30):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if words in self.log():
                return
            time.sleep(0.05)
        raise AssertionError(f"not said within {seconds} s: {words}\n{self.log()}")

    def resident_mb(self):
        status = Path(f"/proc/{self.process.pid}/status").read_text(encoding="utf-8")
        return int(re.search(r"VmRSS:\s+(\d+) kB", status)[1]) / 1024

    def stop(self):
        self.process.send_signal(signal.SIGTERM)
        code = self.process.wait(timeout=30)
        text = self.log()
        self.log_file.close()
        return code, text


class Ros(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.recordings = tempfile.TemporaryDirectory()
        cls.recording = Path(cls.recordings.name) / "recording"
        ear("simulate", "flat1", "--seed", 3, "--duration", SECONDS, "--camera-rate", 20, "--out", cls.recording)

    @classmethod
    def tearDownClass(cls):
        cls.recordings.cleanup()

    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.folder = Path(self.temporary.name)
        self.domain = 100 + os.getpid() % 100
        self.config = self.folder / "live.yaml"
        self.config.write_text(CONFIG.format(recording=self.recording, domain=self.domain), encoding="utf-8")

    def tearDown(self):
        self.temporary.cleanup()

    def play(self, quality="reliable", seconds=0):
        log = self.folder / "odometry.csv"
        result = subprocess.run([str(PLAYER), str(self.recording), str(self.domain), quality, str(log), str(seconds)],
                                capture_output=True, text=True, timeout=120, check=False)
        self.assertEqual(result.returncode, 0, result.stderr)
        with log.open(encoding="utf-8") as lines:
            return int(result.stdout.split()[0]), list(csv.reader(lines))

    def test_agrees_with_a_run_of_the_recording(self):
        """To the last bit, unless the machine is so busy that readings came too late: then it was said, and once more."""
        ear("run", self.recording, "--out", self.folder / "run")
        for attempt in range(3):
            log = self.play_and_record(attempt)
            if "; 0 frames did not wait" in log and "refused so far" not in log:
                break
        else:
            self.fail(log)
        expected = self.positions(self.folder / "run" / "estimate.tum")
        estimated = self.positions(self.folder / "live" / "estimate.tum")
        self.assertGreater(len(expected), 60)
        self.assertEqual(set(estimated), set(expected), log)
        for stamp, position in expected.items():
            for a, b in zip(estimated[stamp], position):
                self.assertAlmostEqual(a, b, delta=1e-6)

        # What was recorded gives the same to the last bit.
        ear("run", self.folder / f"record{attempt}.mcap", "--out", self.folder / "again")
        for name in ("estimate.tum", "states.csv"):
            self.assertEqual((self.folder / "live" / name).read_bytes(), (self.folder / "again" / name).read_bytes(), name)

    def play_and_record(self, attempt):
        """What holds however busy the machine is; returns the log."""
        record = self.folder / f"record{attempt}.mcap"
        live = Live(self.folder, self.config, "--out", self.folder / "live", "--record", record)
        live.wait_for("ready")
        inertial, rows = self.play()
        resident = live.resident_mb()
        code, log = live.stop()
        self.assertEqual(code, 0, log)
        self.assertIn(f" {inertial} inertial samples, 0 of these refused", log)
        self.assertIn("; 0 inertial samples, 0 wheel readings, 0 ranges, 0 frames refused by full queues", log)
        self.assertLess(resident, 200)
        self.check_odometry(rows)
        return log

    def check_odometry(self, rows):
        """What the vehicle heard: poses of the axle's middle, in the frames of REP-105."""
        states = {row["t_ns"]: row for row in self.states(self.folder / "live" / "states.csv")}
        self.assertGreaterEqual(len(rows), len(states) - 2)
        T_BO = self.matrix(self.recording / "mav0" / "encoder0" / "sensor.yaml")
        for stamp, x, y, z, _, frame, child in rows:
            self.assertEqual((frame, child), ("odom", "base_link"))
            row = states[stamp]
            R = self.rotation(*(float(row[key]) for key in ("q_w", "q_x", "q_y", "q_z")))
            lever = [sum(R[i][k] * T_BO[4 * k + 3] for k in range(3)) for i in range(3)]
            for i, heard in enumerate((x, y, z)):
                self.assertAlmostEqual(float(heard), float(row[("p_x", "p_y", "p_z")[i]]) + lever[i], delta=1e-6)

    def test_publisher_that_leaves_and_comes_back_as_another(self):
        live = Live(self.folder, self.config)
        live.wait_for("nothing has come yet", 5)
        self.play("reliable", 2)
        live.wait_for("/imu0: its publisher is gone", 5)
        live.wait_for("imu: silent for", 3)
        self.play("best_effort", 2)
        code, log = live.stop()
        self.assertEqual(code, 0, log)
        self.assertEqual(log.count("/imu0: has a publisher"), 2, log)
        self.assertIn("imu: samples come", log)

    @staticmethod
    def positions(file):
        rows = (line.split() for line in file.read_text(encoding="utf-8").splitlines())
        return {row[0]: [float(value) for value in row[1:4]] for row in rows}

    @staticmethod
    def states(file):
        with file.open(encoding="utf-8") as lines:
            return list(csv.DictReader(lines))

    @staticmethod
    def matrix(file):
        numbers = re.search(r"data: \[(.*?)\]", file.read_text(encoding="utf-8"), re.DOTALL)[1]
        return [float(number) for number in numbers.split(",")]

    @staticmethod
    def rotation(w, x, y, z):
        return [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]


if __name__ == "__main__":
    unittest.main()
