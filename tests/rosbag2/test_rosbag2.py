"""ROS 2 bags out and in, with implementations of MCAP and of the messages that share no code with this project.

test_rosbag2.py EAR_PROGRAM SCRATCH_FOLDER

@mcap/core and @foxglove/rosmsg2-serialization come from npm's registry into SCRATCH_FOLDER. Where that is not possible, or
the program was built without ROS 2 bags, the tests are skipped: exit code 77.
"""

import csv
import hashlib
import json
import math
import re
import shutil
import sqlite3
import struct
import subprocess
import sys
import unittest
import zlib
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))
from temporary_folder import InTemporaryFolder

PROGRAM = Path(sys.argv.pop(1)).resolve()
SCRATCH = Path(sys.argv.pop(1)).resolve()
DECODER = Path(__file__).resolve().parent / "decoder"


def install_decoder():
    """Nothing, or the reason why there is no decoder."""
    if not shutil.which("npm") or not shutil.which("node"):
        return "no Node.js and npm here"
    SCRATCH.mkdir(parents=True, exist_ok=True)
    for file in DECODER.iterdir():
        if file.is_file():
            shutil.copy(file, SCRATCH)
    if (SCRATCH / "node_modules/@mcap/core").is_dir():
        return ""
    try:
        done = subprocess.run(["npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund"], cwd=SCRATCH, check=False,
                              stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=240)
    except subprocess.TimeoutExpired:
        return "npm's registry does not answer"
    errors = [line for line in done.stderr.splitlines() if "error" in line]
    return "" if done.returncode == 0 else "npm could not install the decoder: " + "; ".join(errors[:2])


def ear(*arguments):
    return subprocess.run([PROGRAM, *map(str, arguments)], stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)


def node(script, *arguments):
    return subprocess.run(["node", script, *map(str, arguments)], cwd=SCRATCH, stdin=subprocess.DEVNULL,
                          capture_output=True, text=True, check=True).stdout


def rows(file):
    with file.open(encoding="utf-8") as lines:
        return [row for row in csv.reader(lines) if not row[0].startswith("#")]


def stamp(message):
    time = message["header"]["stamp"]
    return 1_000_000_000 * time["sec"] + time["nanosec"]


def grey_pixels(png):
    """The pixels of an 8-bit grey PNG."""
    at, packed, width, height = 8, b"", 0, 0
    while at < len(png):
        length, kind = struct.unpack(">I4s", png[at:at + 8])
        body = png[at + 8:at + 8 + length]
        at += 12 + length
        if kind == b"IHDR":
            width, height = struct.unpack(">II", body[:8])
        if kind == b"IDAT":
            packed += body
    data, above, pixels = zlib.decompress(packed), bytearray(width), bytearray()
    for y in range(height):
        filtering, line = data[y * (width + 1)], bytearray(data[y * (width + 1) + 1:(y + 1) * (width + 1)])
        for x in range(width):
            left, up, corner = (line[x - 1] if x else 0), above[x], (above[x - 1] if x else 0)
            guess = left + up - corner
            nearest = min((abs(guess - left), 0, left), (abs(guess - up), 1, up), (abs(guess - corner), 2, corner))[2]
            line[x] = (line[x] + [0, left, up, (left + up) // 2, nearest][filtering]) % 256
        pixels += line
        above = line
    return bytes(pixels)


def pose(transform):
    t, q = transform["translation"], transform["rotation"]
    w, x, y, z = q["w"], q["x"], q["y"], q["z"]
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), t["x"]],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x), t["y"]],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y), t["z"]], [0, 0, 0, 1]]


def product(a, b):
    return [[sum(x * y for x, y in zip(row, column)) for column in zip(*b)] for row in a]


def sensor_yaml(mav0, sensor):
    return (mav0 / sensor / "sensor.yaml").read_text(encoding="utf-8")


def numbers(text, key):
    return [float(n) for n in re.search(key + r":.*?\[(.*?)\]", text, re.DOTALL)[1].split(",")]


class Bags(InTemporaryFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.recording = cls.work / "recording"
        cls.mav0 = cls.recording / "mav0"
        cls.bag = cls.work / "ours.mcap"
        # Late frames, too: their order among other samples is the log's.
        cls.done("simulate", "flat1", "--duration", "4", "--camera-rate", "10", "--fault", "camera_late@1.5+1",
                 "--out", cls.recording)
        cls.done("export", cls.recording, "--format", "mcap", "--out", cls.bag)
        cls.done("run", cls.recording, "--out", cls.work / "of_folder")
        cls.estimate = (cls.work / "of_folder/estimate.tum").read_text(encoding="utf-8")
        lines = node("decode.mjs", cls.bag).splitlines()
        cls.file = json.loads(lines[0])
        cls.messages = [json.loads(line) for line in lines[1:]]

    @classmethod
    def done(cls, *arguments):
        result = ear(*arguments)
        if result.returncode != 0:
            raise AssertionError(result)
        return result

    def on(self, topic):
        return [m["message"] for m in self.messages if m["topic"] == topic]

    def beside(self, bag):
        """Puts the calibration beside a bag that has none."""
        folder = bag.with_name(bag.name.split(".")[0] + ".calibration")
        for sensor in ("imu0", "cam0", "cam1", "encoder0", "laser0"):
            (folder / sensor).mkdir(parents=True, exist_ok=True)
            shutil.copy(self.mav0 / sensor / "sensor.yaml", folder / sensor)

    def assert_same_estimate(self, bag, expected=None, *options):
        out = self.work / (bag.name + "-out")
        result = self.done("run", bag, "--out", out, *options)
        self.assertEqual((out / "estimate.tum").read_text(encoding="utf-8"), expected or self.estimate, bag.name)
        return result

    @staticmethod
    def poses(run):
        return [[float(n) for n in line.split()] for line in (run / "estimate.tum").read_text().splitlines()]

    @staticmethod
    def distance(a, b):
        """The largest between two estimates of the same times [m]."""
        return max(math.dist(p[1:4], q[1:4]) for p, q in zip(a, b, strict=True))

    # What we write, read by others.

    def test_file(self):
        self.assertEqual((self.file["header"]["profile"], self.file["header"]["library"]), ("ros2", "ear-msckf"))
        self.assertEqual(int(self.file["statistics"]["messageCount"]), len(self.messages))
        for attachment in self.file["attachments"]:
            self.assertEqual(attachment["text"], (self.mav0 / attachment["name"][len("calibration/"):]).read_text())
        self.assertEqual(len(self.file["attachments"]), 5)
        logs = [int(m["log"]) for m in self.messages]
        self.assertEqual(logs, sorted(logs))

    def test_imu(self):
        written = rows(self.mav0 / "imu0/data.csv")
        self.assertEqual(len(written), len(self.on("/imu0")))
        for row, message in zip(written, self.on("/imu0")):
            w, a = message["angular_velocity"], message["linear_acceleration"]
            self.assertEqual(stamp(message), int(row[0]))
            self.assertEqual([w["x"], w["y"], w["z"], a["x"], a["y"], a["z"]], [float(n) for n in row[1:]])
            self.assertEqual((message["header"]["frame_id"], message["orientation_covariance"][0]), ("imu0", -1))

    def test_wheels(self):
        resolution = int(re.search(r"resolution: (\d+)", sensor_yaml(self.mav0, "encoder0"))[1])
        written = rows(self.mav0 / "encoder0/data.csv")
        self.assertEqual(len(written), len(self.on("/wheels")))
        for row, message in zip(written, self.on("/wheels")):
            self.assertEqual((stamp(message), message["name"]), (int(row[0]), ["left", "right"]))
            for count, angle in zip(row[1:], message["position"]):
                self.assertAlmostEqual(int(count) * math.tau / resolution, angle, delta=1e-12)

    def test_ranges(self):
        written = rows(self.mav0 / "laser0/data.csv")
        for beam in range(3):
            messages = self.on("/laser/%d" % beam)
            self.assertEqual(len(written), len(messages))
            for row, message in zip(written, messages):
                self.assertEqual(stamp(message), int(row[0]))
                if row[1 + beam] == "nan":
                    self.assertEqual(message["range"], "Infinity")
                else:
                    self.assertAlmostEqual(float(row[1 + beam]), message["range"], delta=1e-6)

    def test_images(self):
        for camera in ("cam0", "cam1"):
            written = rows(self.mav0 / camera / "data.csv")
            messages = self.on("/%s/image_raw" % camera)
            self.assertEqual([int(row[0]) for row in written], [stamp(message) for message in messages])
            for row, message in list(zip(written, messages))[::13]:
                pixels = grey_pixels((self.mav0 / camera / "data" / row[1]).read_bytes())
                self.assertEqual(message["data"]["sha256"], hashlib.sha256(pixels).hexdigest())
                self.assertEqual((message["encoding"], message["width"], message["step"] * message["height"]),
                                 ("mono8", message["step"], len(pixels)))

    def test_late_images_are_logged_when_they_came(self):
        arrivals = {int(row[0]): int(row[1]) for row in rows(self.mav0 / "cam0/arrival.csv")}
        self.assertGreater(len(arrivals), 2)
        latest = 0  # one that was overtaken holds up those behind it
        for message in self.messages:
            if message["topic"] == "/cam0/image_raw":
                t_ns = stamp(message["message"])
                latest = max(latest, arrivals.get(t_ns, t_ns))
                self.assertEqual((int(message["log"]), int(message["publish"])), (latest, t_ns))

    def test_truth(self):
        written = rows(self.mav0 / "state_groundtruth_estimate0/data.csv")
        self.assertEqual(len(written), len(self.on("/truth")))
        for row, message in zip(written, self.on("/truth")):
            p, q = message["pose"]["position"], message["pose"]["orientation"]
            self.assertEqual([stamp(message), p["x"], p["y"], p["z"]], [int(row[0]), *map(float, row[1:4])])
            for value, number in zip([q["w"], q["x"], q["y"], q["z"]], row[4:8]):
                self.assertAlmostEqual(value, float(number), delta=1e-9)

    def test_calibration(self):
        (tf,) = self.on("/tf_static")
        poses = {(t["header"]["frame_id"], t["child_frame_id"]): pose(t["transform"]) for t in tf["transforms"]}
        for i, camera in enumerate(("cam0", "cam1")):
            text = sensor_yaml(self.mav0, camera)
            self.assert_near(poses["imu0", camera], numbers(text, "data"))
            (info,) = self.on("/%s/camera_info" % camera)
            fu, fv, cu, cv = numbers(text, "intrinsics")
            self.assertEqual(info["k"], [fu, 0, cu, 0, fv, cv, 0, 0, 1])
            self.assertEqual(info["d"][:4], numbers(text, "distortion_coefficients")[:4])
            self.assertEqual((info["header"]["frame_id"], info["distortion_model"]), (camera, "plumb_bob"))
            self.assertEqual([info["width"], info["height"]], numbers(text, "resolution"), i)
        inverse = product(poses["base_link", "imu0"], [list(row) for row in zip(*[iter(
            numbers(sensor_yaml(self.mav0, "encoder0"), "data"))] * 4)])  # base_link is the middle of the axle
        self.assert_near(inverse, [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1])
        beams = re.findall(r"origin: \[(.*?)\], direction: \[(.*?)\]", sensor_yaml(self.mav0, "laser0"))
        for i, (origin, direction) in enumerate(beams):
            found = poses["imu0", "laser0_%d" % i]
            self.assert_near([[row[0] for row in found[:3]]], [float(n) for n in direction.split(",")])
            self.assert_near([[row[3] for row in found[:3]]], [float(n) for n in origin.split(",")])

    def assert_near(self, matrix, expected):
        values = [value for row in matrix for value in row]
        self.assertLess(max(abs(a - b) for a, b in zip(values, expected, strict=True)), 1e-9)

    # What we and others write, read by us.

    def test_our_own(self):
        told = self.assert_same_estimate(self.bag).stderr
        self.assertIn("left: /cam0/image_raw, right: /cam1/image_raw", told)
        for source, name in ((self.bag, "of_bag"), (self.recording, "of_recording")):
            self.done("export", source, "--format", "euroc", "--out", self.work / name)
            self.done("run", self.work / name, "--out", self.work / (name + "-out"))
        far = self.distance(self.poses(self.work / "of_bag-out"), self.poses(self.work / "of_recording-out"))
        self.assertLess(far, 1e-6)  # rotations of the calibration are rounded once more
        self.assertIn("laser0", self.done("check", self.bag).stdout)
        self.assertIn("pipeline", self.done("bench", self.bag).stdout)

    def test_mcap_of_others(self):
        expected = self.without_arrivals()
        for kind in ("zstd", "plain", "unchunked", "unindexed", "png"):
            bag = self.work / (kind + ".mcap")
            node("encode.mjs", self.bag, bag, kind, self.mav0)
            self.beside(bag)
            self.assert_same_estimate(bag, expected)

    def test_sqlite(self):
        expected = self.without_arrivals()
        plain, packed = self.work / "plain.raw", self.work / "packed.raw"
        node("encode.mjs", self.bag, plain, "raw")
        node("encode.mjs", self.bag, packed, "raw_zstd")
        for name, raw, extra in (("splits", plain, ""),
                                 ("messages", packed, "  compression_format: zstd\n  compression_mode: MESSAGE\n")):
            bag = self.work / name
            self.write_sqlite(bag, raw, extra)
            self.beside(bag)
            self.assert_same_estimate(bag, expected)
        files = self.work / "files"
        self.write_sqlite(files, plain, "  compression_format: zstd\n  compression_mode: FILE\n")
        self.beside(files)
        for file in files.glob("*.db3"):
            node("pack.mjs", file, str(file) + ".zstd")
            file.unlink()
        metadata = files / "metadata.yaml"
        metadata.write_text(metadata.read_text().replace(".db3", ".db3.zstd"))
        self.assert_same_estimate(files, expected)

    def without_arrivals(self):
        """The estimate without late frames: others' files do not say that images are ordered by arrival."""
        folder = self.work / "without_arrivals"
        if not folder.exists():
            shutil.copytree(self.recording, folder)
            (folder / "mav0/cam0/arrival.csv").unlink()
            self.done("run", folder, "--out", folder / "out")
        return (folder / "out/estimate.tum").read_text(encoding="utf-8")

    @staticmethod
    def write_sqlite(bag, raw, extra):
        """A folder as rosbag2 writes it, in two files."""
        bag.mkdir()
        names = ["part_0.db3", "part_1.db3"]
        files = []
        for name in names:
            files.append(sqlite3.connect(bag / name))
            files[-1].execute("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, "
                              "serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL)")
            files[-1].execute("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, "
                              "timestamp INTEGER NOT NULL, data BLOB NOT NULL)")
            files[-1].execute("CREATE INDEX timestamp_idx ON messages (timestamp ASC)")
        topics, first = {}, None
        with raw.open("rb") as stream:
            while head := stream.read(4):
                message = json.loads(stream.read(struct.unpack("<I", head)[0]))
                data = stream.read(struct.unpack("<I", stream.read(4))[0])
                first = first or int(message["log"])
                topic = topics.setdefault(message["topic"], len(topics) + 1)
                part = files[int(message["log"]) - first > 2_000_000_000]
                part.execute("INSERT OR IGNORE INTO topics VALUES (?, ?, ?, 'cdr', '')",
                             (topic, message["topic"], message["type"]))
                part.execute("INSERT INTO messages (topic_id, timestamp, data) VALUES (?, ?, ?)",
                             (topic, int(message["log"]), data))
        for file in files:
            file.commit()
            file.close()
        (bag / "metadata.yaml").write_text("rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: sqlite3\n"
                                           "  relative_file_paths:\n" + "".join("    - %s\n" % n for n in names) + extra)

    def test_calibration_from_the_drivers_messages(self):
        """Cameras and lasers from CameraInfo, tf_static and the ranges; noise and wheels from sensor.yaml."""
        bag = self.work / "drivers.mcap"
        node("encode.mjs", self.bag, bag, "zstd")
        for sensor in ("imu0", "encoder0"):
            (self.work / "drivers.calibration" / sensor).mkdir(parents=True)
            shutil.copy(self.mav0 / sensor / "sensor.yaml", self.work / "drivers.calibration" / sensor)
        out = self.work / "drivers-out"
        self.done("run", bag, "--out", out)
        self.without_arrivals()
        far = self.distance(self.poses(out), self.poses(self.work / "without_arrivals/out"))
        self.assertLess(far, 2e-3)  # the lasers' noise is not in their messages; else it is a matter of 1e-16

    def test_torn(self):
        whole = self.bag.read_bytes()
        torn = self.work / "torn.mcap"
        torn.write_bytes(whole[:len(whole) * 6 // 10])
        by_others = [json.loads(line) for line in node("decode.mjs", torn, "--torn").splitlines()]
        result = self.done("run", torn, "--out", self.work / "torn-out")
        self.assertIn("bag: torn", result.stderr)
        found = (self.work / "torn-out/estimate.tum").read_text().splitlines()
        self.assertEqual(found, self.estimate.splitlines()[:len(found)])
        last = max(stamp(m["message"]) for m in by_others if m["topic"] == "/imu0")
        self.assertGreater(float(found[-1].split()[0]), 1e-9 * last - 0.3)

    def test_full_disk(self):
        """A file that may not grow any further, as on a full disk, can be read up to there."""
        limited = self.work / "limited.mcap"
        command = "trap '' XFSZ; ulimit -f 8000; exec \"$0\" \"$@\""
        result = subprocess.run(["bash", "-c", command, PROGRAM, "export", self.recording, "--format", "mcap", "--out",
                                 limited], capture_output=True, text=True, check=False)
        self.assertNotEqual(result.returncode, 0)
        self.assertIn("limited.mcap: cannot be written: File too large; it holds what was written up to byte", result.stderr)
        by_others = [json.loads(line) for line in node("decode.mjs", limited, "--torn").splitlines()]
        self.assertGreater(len(by_others), 300)
        self.assertIn("bag: torn", self.done("run", limited, "--out", self.work / "limited-out").stderr)

    def test_kill(self):
        out = self.work / "killed.mcap"
        enough = self.bag.stat().st_size * 6 // 10  # with less, the recording may end before the estimate could begin
        with subprocess.Popen([PROGRAM, "export", self.recording, "--format", "mcap", "--out", out],
                              stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as program:
            while program.poll() is None and (not out.exists() or out.stat().st_size < enough):
                pass
            program.kill()
        self.assertGreater(len(node("decode.mjs", out, "--torn").splitlines()), 100)
        self.done("run", out, "--out", self.work / "killed-out")

    def test_wrong_topics_are_named(self):
        config = self.work / "topics.yaml"
        config.write_text("topics: {imu: /nothing}\n")
        self.assertIn("/nothing: no such topic; there are: ", ear("run", self.bag, "--config", config).stderr)
        config.write_text("topics: {imu: /wheels}\n")
        self.assertIn("/wheels: is of type sensor_msgs/msg/JointState, not sensor_msgs/msg/Imu",
                      ear("run", self.bag, "--config", config).stderr)
        config.write_text("topics: {imu: /imu0, right: /truth, left: /cam0/image_raw}\n")
        self.assertIn("/truth: ", ear("run", self.bag, "--config", config).stderr)


if __name__ == "__main__":
    reason = install_decoder()
    if not reason and "built without ROS 2 bags" in ear("run", "nothing.mcap").stderr:
        reason = "built without ROS 2 bags"
    if reason:
        print("skipped: " + reason)
        sys.exit(77)
    unittest.main()
