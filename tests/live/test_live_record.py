"""What `ear live` sends and records, read by implementations that share no code with it; and files that end too early.

test_live_record.py EAR_PROGRAM SCRATCH_FOLDER

As tests/rosbag2/test_rosbag2.py, whose decoder from npm it uses; skipped where that cannot be had: exit code 77.
"""

import csv
import hashlib
import json
import os
import re
import subprocess
import sys
import time
import unittest
from pathlib import Path

import loopback

sys.path[:0] = [str(Path(__file__).resolve().parents[1] / folder) for folder in ("rosbag2", "support")]
import test_rosbag2 as bags  # takes the program and the folder from the arguments
from temporary_folder import InTemporaryFolder

os.environ["CYCLONEDDS_URI"] = loopback.URI


def transposed(a):
    return [list(column) for column in zip(*a)]


def applied(a, v):
    return [sum(x * y for x, y in zip(row, v)) for row in a]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def rotation(w, x, y, z):
    return [row[:3] for row in bags.pose({"translation": dict(x=0, y=0, z=0), "rotation": dict(w=w, x=x, y=y, z=z)})[:3]]


def rate_at(gyro, t_ns):
    """Between the two samples around it, however late the image came."""
    later = next(i for i, (t, _) in enumerate(gyro) if t >= t_ns)
    (t0, w0), (t1, w1) = gyro[max(later - 1, 0)], gyro[later]
    part = (t_ns - t0) / (t1 - t0) if later else 1.0
    return [a + part * (b - a) for a, b in zip(w0, w1)]


def vector(message):
    return [message["x"], message["y"], message["z"]]


class LiveRecord(InTemporaryFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.recording = cls.work / "recording"
        cls.mav0 = cls.recording / "mav0"
        cls.config = cls.work / "live.yaml"
        cls.config.write_text("calibration: recording\nbudget_ms: 0\nframe_slots: 64\nros: {domain: %d}\n"
                              % (100 + os.getpid() % 100), encoding="utf-8")
        cls.done("simulate", "flat1", "--duration", "4", "--camera-rate", "10", "--out", cls.recording)
        cls.file = cls.work / "live.mcap"
        cls.log = cls.done(*cls.live(cls.file)).stderr
        lines = bags.node("decode.mjs", cls.file).splitlines()  # compares the definitions with the official ones, too
        cls.messages = [json.loads(line) for line in lines[1:]]
        with (cls.work / "live-out/states.csv").open(encoding="utf-8") as states:
            cls.states = {int(row["t_ns"]): row for row in csv.DictReader(states)}

    @classmethod
    def done(cls, *arguments):
        result = bags.ear(*arguments)
        if result.returncode != 0:
            raise AssertionError(result)
        return result

    @classmethod
    def live(cls, file):
        return "live", "--sensors", cls.recording, "--config", cls.config, "--record", file, "--out", cls.work / (file.stem + "-out")

    def on(self, topic):
        return [m["message"] for m in self.messages if m["topic"] == topic]

    def assert_near(self, a, b, delta):
        for x, y in zip(a, b, strict=True):
            self.assertAlmostEqual(x, float(y), delta=delta)

    def test_nothing_else_is_in_it(self):
        self.assertEqual({m["topic"] for m in self.messages},
                         {"/imu0", "/wheels", "/laser/0", "/laser/1", "/laser/2", "/cam0/image_raw", "/cam1/image_raw",
                          "/cam0/camera_info", "/cam1/camera_info", "/tf_static", "/ear/odometry", "/ear/predicted", "/tf",
                          "/diagnostics"})

    def test_what_came_in(self):
        written = bags.rows(self.mav0 / "imu0/data.csv")
        self.assertEqual(len(written), len(self.on("/imu0")))
        for row, message in zip(written, self.on("/imu0")):
            self.assertEqual([bags.stamp(message), *vector(message["angular_velocity"]), *vector(message["linear_acceleration"])],
                             [int(row[0]), *map(float, row[1:])])
        for topic, sensor in (("/wheels", "encoder0"), ("/laser/0", "laser0"), ("/laser/2", "laser0")):
            self.assertEqual([bags.stamp(m) for m in self.on(topic)], [int(row[0]) for row in bags.rows(self.mav0 / sensor / "data.csv")])
        for camera in ("cam0", "cam1"):
            written = bags.rows(self.mav0 / camera / "data.csv")
            messages = self.on("/%s/image_raw" % camera)
            self.assertEqual([int(row[0]) for row in written], [bags.stamp(message) for message in messages])
            for row, message in list(zip(written, messages))[::13]:
                pixels = bags.grey_pixels((self.mav0 / camera / "data" / row[1]).read_bytes())
                self.assertEqual(message["data"]["sha256"], hashlib.sha256(pixels).hexdigest())

    def test_odometry(self):
        """Pose and velocity of the axle's middle, in the frames of REP-105, against states.csv, which has the IMU's."""
        T_BO = [self.numbers_of("encoder0")[4 * i:4 * i + 4] for i in range(3)]
        R_BO, p_BO = [row[:3] for row in T_BO], [row[3] for row in T_BO]
        gyro = [(int(row[0]), [float(n) for n in row[1:4]]) for row in bags.rows(self.mav0 / "imu0/data.csv")]
        self.assertEqual([bags.stamp(m) for m in self.on("/ear/odometry")], list(self.states))
        for message in self.on("/ear/odometry"):
            self.assertEqual((message["header"]["frame_id"], message["child_frame_id"]), ("odom", "base_link"))
            state = self.states[bags.stamp(message)]
            number = lambda name, axes="xyz": [float(state[name + "_" + axis]) for axis in axes]
            R_WB = rotation(*number("q", "wxyz"))
            p, q = message["pose"]["pose"]["position"], message["pose"]["pose"]["orientation"]
            self.assert_near(vector(p), [a + b for a, b in zip(number("p"), applied(R_WB, p_BO))], 1e-6)
            R_WO = rotation(q["w"], q["x"], q["y"], q["z"])
            for row, expected in zip(R_WO, bags.product(R_WB, R_BO)):
                self.assert_near(row, expected, 1e-6)
            rate = rate_at(gyro, bags.stamp(message))
            w_B = [a - b for a, b in zip(rate, number("b_g"))]
            v_W = [a + b for a, b in zip(number("v"), applied(R_WB, cross(w_B, p_BO)))]
            self.assert_near(vector(message["twist"]["twist"]["linear"]), applied(transposed(R_WO), v_W), 1e-5)
            self.assert_near(vector(message["twist"]["twist"]["angular"]), applied(transposed(R_BO), w_B), 1e-5)
            for covariance in (message["pose"]["covariance"], message["twist"]["covariance"]):
                for i in range(6):
                    self.assertGreater(covariance[7 * i], 0)
                    for j in range(i):
                        self.assertAlmostEqual(covariance[6 * i + j], covariance[6 * j + i], delta=1e-12)

    def test_tf_is_the_odometry(self):
        for odometry, tf in zip(self.on("/ear/odometry"), self.on("/tf"), strict=True):
            (transform,) = tf["transforms"]
            self.assertEqual((transform["header"], transform["child_frame_id"]), (odometry["header"], odometry["child_frame_id"]))
            self.assertEqual(transform["transform"]["translation"], odometry["pose"]["pose"]["position"])
            self.assertEqual(transform["transform"]["rotation"], odometry["pose"]["pose"]["orientation"])

    def test_predicted_states_lead_to_the_next_frame(self):
        frames = {bags.stamp(m): m["pose"]["pose"]["position"] for m in self.on("/ear/odometry")}
        predicted = self.on("/ear/predicted")
        self.assertGreater(len(predicted), 15 * len(frames))
        stamps = [bags.stamp(m) for m in predicted]
        self.assertLess(set(stamps), {int(row[0]) for row in bags.rows(self.mav0 / "imu0/data.csv")})
        for message in predicted:
            self.assertEqual((message["header"]["frame_id"], message["child_frame_id"]), ("odom", "base_link"))
        for t_ns, position in list(frames.items())[2:-1]:
            after = next(m for m in predicted if bags.stamp(m) >= t_ns)  # a sample later, at less than 2 m/s
            self.assertLess(bags.stamp(after) - t_ns, 20_000_000)
            self.assert_near(vector(after["pose"]["pose"]["position"]), vector(position), 0.05)

    def test_diagnostics(self):
        messages = self.on("/diagnostics")
        self.assertGreaterEqual(len(messages), 3)
        (status,) = messages[-1]["status"]
        self.assertEqual((status["name"], status["level"]), ("ear: localisation", 0))
        rates = {value["key"]: value["value"] for value in status["values"]}["rates"]
        self.assertAlmostEqual(float(re.match(r"imu (\d+) Hz, ", rates)[1]), 200, delta=60)

    def numbers_of(self, sensor):
        return bags.numbers(bags.sensor_yaml(self.mav0, sensor), "data")

    # What ends too early.

    def assert_reads_up_to_there(self, file, least):
        """By others, and by us: the estimates are those of the whole."""
        by_others = [json.loads(line) for line in bags.node("decode.mjs", file, "--torn").splitlines()]
        self.assertGreater(len(by_others), least)
        out = self.work / (file.stem + "-again")
        self.assertIn("bag: torn", self.done("run", file, "--out", out).stderr)
        found = (out / "estimate.tum").read_text().splitlines()
        self.assertGreater(len(found), 6)
        found = found[:-3]  # of the last frames, readings that came after them may be lost
        self.assertEqual(found, (self.work / "live-out/estimate.tum").read_text().splitlines()[:len(found)])

    def test_full_disk(self):
        limited = self.work / "limited.mcap"
        command = "trap '' XFSZ; ulimit -f 12000; exec \"$0\" \"$@\""
        result = subprocess.run(["bash", "-c", command, bags.PROGRAM, *map(str, self.live(limited))], capture_output=True, text=True,
                                stdin=subprocess.DEVNULL, check=False)
        self.assertEqual(result.returncode, 0, result.stderr)  # the estimate goes on
        self.assertIn("limited.mcap: cannot be written: File too large", result.stderr)
        self.assertIn("no more is recorded", result.stderr)
        self.assertEqual(result.stderr.count("cannot be written"), 1)
        self.assertEqual((self.work / "limited-out/estimate.tum").read_text(), (self.work / "live-out/estimate.tum").read_text())
        self.assert_reads_up_to_there(limited, 500)

    def test_kill(self):
        killed = self.work / "killed.mcap"
        end = time.monotonic() + 60
        with subprocess.Popen([bags.PROGRAM, *map(str, self.live(killed))], stdin=subprocess.DEVNULL,
                              stderr=subprocess.DEVNULL) as program:
            while not killed.exists() or killed.stat().st_size < 12_000_000:
                self.assertLess(time.monotonic(), end)
                self.assertIsNone(program.poll())
                time.sleep(0.01)
            program.kill()
        self.assert_reads_up_to_there(killed, 500)


if __name__ == "__main__":
    reason = bags.install_decoder()
    if not reason and "built without ROS 2 bags" in bags.ear("run", "nothing.mcap").stderr:
        reason = "built without ROS 2 bags"
    if not reason and "topics of ROS 2 are not built in" in bags.ear("live", "--help").stdout:
        reason = "built without ROS 2 on the wire"
    if reason:
        print("skipped: " + reason)
        sys.exit(77)
    unittest.main()
