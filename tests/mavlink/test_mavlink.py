"""What `ear run --mavlink` sends, read by another implementation of MAVLink, against the estimate's files and the truth.

test_mavlink.py EAR_PROGRAM SCRATCH_FOLDER

node-mavlink comes from npm's registry into SCRATCH_FOLDER. Where that is not possible, the tests are skipped: exit code 77.
"""

import csv
import json
import re
import shutil
import socket
import subprocess
import sys
import threading
import time
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))
from temporary_folder import InTemporaryFolder

PROGRAM = Path(sys.argv.pop(1)).resolve()
SCRATCH = Path(sys.argv.pop(1)).resolve()
HERE = Path(__file__).resolve().parent

LOCAL_FRD, BODY_FRD, ESTIMATOR_VIO = 20, 12, 3
WORDS = ("mode", "health")  # columns of states.csv that are no numbers
ONBOARD_CONTROLLER, AUTOPILOT_INVALID, ACTIVE = 18, 8, 4
THIS_COMPONENT = 197
HALF_TURN = [[1, 0, 0], [0, -1, 0], [0, 0, -1]]


def install_decoder():
    """The folder with node-mavlink, or the reason why there is none."""
    if not shutil.which("npm") or not shutil.which("node"):
        return None, "no Node.js and npm here"
    shutil.copytree(HERE / "decoder", SCRATCH, dirs_exist_ok=True)
    if not (SCRATCH / "node_modules/node-mavlink").is_dir():
        command = ["npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund"]
        try:
            done = subprocess.run(command, cwd=SCRATCH, stdin=subprocess.DEVNULL, capture_output=True, text=True,
                                  check=False, timeout=240)
        except subprocess.TimeoutExpired:
            return None, "npm's registry does not answer"
        if done.returncode != 0:
            errors = [line for line in done.stderr.splitlines() if "error" in line]
            return None, "npm could not install node-mavlink: " + "; ".join(errors[:2])
    return SCRATCH, ""


def node(script, data=b""):
    return subprocess.run(["node", script], cwd=SCRATCH, input=data, capture_output=True, check=True).stdout.decode()


def reference_packets():
    lines = (HERE / "reference_packets.txt").read_text(encoding="utf-8").splitlines()
    return {name: bytes.fromhex(code) for name, code in (line.split() for line in lines)}


# Matrices are lists of rows.
def transposed(a):
    return [list(column) for column in zip(*a)]


def product(a, b):
    return [[sum(x * y for x, y in zip(row, column)) for column in zip(*b)] for row in a]


def applied(a, v):
    return [sum(x * y for x, y in zip(row, v)) for row in a]


def rotation(w, x, y, z):
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]


def vehicle_axes(recording):
    """R_BV from the odometer's calibration: V is x forward, y right, z down."""
    text = (recording / "mav0/encoder0/sensor.yaml").read_text(encoding="utf-8")
    numbers = [float(n) for n in re.search(r"T_BS:.*?data: \[(.*?)\]", text, re.DOTALL)[1].split(",")]
    return product([numbers[0:3], numbers[4:7], numbers[8:11]], HALF_TURN)


def rows(file):
    with file.open(encoding="utf-8") as lines:
        return list(csv.reader(lines))


class FlightController:
    """Takes all that comes to a UDP port, and asks for the time ten times a second."""

    def __init__(self):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.settimeout(0.1)
        self.address = "127.0.0.1:%d" % self.socket.getsockname()[1]
        self.packets = []
        self.requests = 0
        self.stop = False
        self.thread = threading.Thread(target=self.listen)
        self.thread.start()

    def listen(self):
        request = reference_packets()["time_request"]
        next_request = 0.0
        while True:
            try:
                packet, peer = self.socket.recvfrom(2048)
            except socket.timeout:
                if self.stop:  # and all that came was taken
                    return
                continue
            self.packets.append(packet)
            if time.monotonic() >= next_request and not self.stop:
                self.socket.sendto(request, peer)
                self.requests += 1
                next_request = time.monotonic() + 0.1

    def close(self):
        self.stop = True
        self.thread.join()
        self.socket.close()


class Stream(InTemporaryFolder):
    """One run at 15 frames a second, so that every other message is a predicted one."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.recording = cls.work / "recording"
        output = cls.work / "output"
        cls.ear("simulate", "flat1", "--seed", "5", "--duration", "5", "--camera-rate", "15", "--out", cls.recording)
        controller = FlightController()
        begin = time.monotonic()
        try:
            cls.printed = cls.ear("run", cls.recording, "--out", output, "--mavlink", "udp:" + controller.address)
        finally:
            cls.duration = time.monotonic() - begin
            controller.close()
        cls.requests = controller.requests
        cls.packets = [json.loads(line) for line in node("decode.mjs", b"".join(controller.packets)).splitlines()]
        cls.sent = len(controller.packets)
        with (output / "states.csv").open(encoding="utf-8") as states:
            cls.states = {int(row["t_ns"]) // 1000: {key: float(row[key]) for key in row if key not in WORDS}
                          for row in csv.DictReader(states)}
        cls.R_BV = vehicle_axes(cls.recording)
        cls.odometry = cls.fields("ODOMETRY")
        cls.of_frames = [(m, cls.states[int(m["timeUsec"])]) for m in cls.odometry if int(m["timeUsec"]) in cls.states]

    @classmethod
    def ear(cls, *arguments):
        done = subprocess.run([PROGRAM, *map(str, arguments)], stdin=subprocess.DEVNULL, capture_output=True, text=True,
                              check=False)
        if done.returncode != 0:
            raise AssertionError(done)
        return done.stdout

    @classmethod
    def fields(cls, name):
        return [packet["fields"] for packet in cls.packets if packet["name"] == name]

    def assert_near(self, a, b, tolerance):
        self.assertEqual(len(a), len(b))
        self.assertLessEqual(max(abs(x - y) for x, y in zip(a, b)), tolerance, (a, b))

    def R_VW(self, state):
        R_WB = rotation(*(state["q_" + axis] for axis in "wxyz"))
        return transposed(product(R_WB, self.R_BV))

    def test_every_packet_is_understood(self):
        self.assertEqual(len(self.packets), self.sent)
        for before, packet in zip(self.packets, self.packets[1:]):
            self.assertEqual(packet["header"]["seq"], (before["header"]["seq"] + 1) % 256)
        for packet in self.packets:
            self.assertEqual((packet["header"]["magic"], packet["header"]["sysid"], packet["header"]["compid"]),
                             (0xFD, 1, THIS_COMPONENT))

    def test_kind_of_odometry(self):
        for message in self.odometry:
            self.assertEqual((message["frameId"], message["childFrameId"], message["estimatorType"]),
                             (LOCAL_FRD, BODY_FRD, ESTIMATOR_VIO))
            self.assertEqual(message["resetCounter"], 0)
            self.assertGreater(message["quality"], 20)

    def test_rate_and_stamps(self):
        stamps = [int(message["timeUsec"]) for message in self.odometry]
        self.assertEqual(len(self.of_frames), len(self.states))  # each frame's, stamped with its exposure
        self.assertGreater(len(stamps), 1.8 * len(self.states))
        for before, stamp in zip(stamps[1:], stamps[2:]):  # how long to fill is known from the second frame on
            self.assertTrue(15e3 < stamp - before < 55e3, stamp - before)
        rate = 1e6 * (len(stamps) - 1) / (stamps[-1] - stamps[0])
        self.assertTrue(29.0 < rate < 50.0, rate)

    def test_pose(self):
        for message, state in self.of_frames:
            self.assert_near([message[axis] for axis in "xyz"], [state["p_x"], -state["p_y"], -state["p_z"]], 1e-5)
            R_LV = product(HALF_TURN, transposed(self.R_VW(state)))
            for sent, expected in zip(rotation(*message["q"]), R_LV):
                self.assert_near(sent, expected, 1e-5)

    def test_twist(self):
        imu = [[float(value) for value in row] for row in rows(self.recording / "mav0/imu0/data.csv")[1:]]
        for message, state in self.of_frames:
            velocity = applied(self.R_VW(state), [state["v_" + axis] for axis in "xyz"])
            self.assert_near([message["v" + axis] for axis in "xyz"], velocity, 1e-5)
            after = next((i for i, row in enumerate(imu) if row[0] >= state["t_ns"]), len(imu) - 1)
            a, b = imu[after - 1], imu[after]
            part = (state["t_ns"] - a[0]) / (b[0] - a[0])
            rate = [(1 - part) * a[i] + part * b[i] - state["b_g_" + axis] for i, axis in enumerate("xyz", start=1)]
            self.assert_near([message[axis + "speed"] for axis in ("roll", "pitch", "yaw")],
                             applied(transposed(self.R_BV), rate), 1e-3)

    def test_pose_covariance(self):
        names = ["x", "y", "z", "rx", "ry", "rz"]
        for message, state in self.of_frames:
            P = [[state["cov_%s_%s" % tuple(sorted((a, b), key=names.index))] for b in names] for a in names]
            J = [[*row, 0, 0, 0] for row in HALF_TURN] + [[0, 0, 0, *row] for row in self.R_VW(state)]
            expected = product(product(J, P), transposed(J))
            upper = [expected[i][j] for i in range(6) for j in range(i, 6)]
            self.assert_near(message["poseCovariance"], upper, 1e-5 * max(map(abs, upper)))
            self.assertTrue(all(message["velocityCovariance"][i] > 0 for i in (0, 6, 11, 15, 18, 20)))

    def test_velocity_is_the_true_one(self):
        """Signs and frames once more, against what really happened."""
        truth = {int(row[0]): [float(value) for value in row[1:]]
                 for row in rows(self.recording / "mav0/state_groundtruth_estimate0/data.csv")[1:]}
        stamps = sorted(truth)
        fastest = 0.0
        for message in self.odometry:
            nearest = min(stamps, key=lambda t: abs(t - 1000 * int(message["timeUsec"])))
            row = truth[nearest]
            R_VW = transposed(product(rotation(*row[3:7]), self.R_BV))
            velocity = applied(R_VW, row[7:10])
            self.assert_near([message["v" + axis] for axis in "xyz"], velocity, 0.1)
            fastest = max(fastest, velocity[0])
        self.assertGreater(fastest, 0.3)  # it drove forward, or this says nothing

    def test_predictions_lie_between_frames(self):
        for before, message, after in zip(self.odometry, self.odometry[1:], self.odometry[2:]):
            if int(message["timeUsec"]) in self.states:
                continue
            for axis in "xyz":
                self.assertLess(abs(message[axis] - 0.5 * (before[axis] + after[axis])), 0.03)

    def test_heartbeats(self):
        beats = self.fields("HEARTBEAT")
        self.assertGreaterEqual(len(beats), 4)
        for beat in beats:
            self.assertEqual((beat["type"], beat["autopilot"]), (ONBOARD_CONTROLLER, AUTOPILOT_INVALID))
        self.assertEqual(beats[-1]["systemStatus"], ACTIVE)
        self.assertNotEqual(beats[0]["systemStatus"], ACTIVE)

    def test_nothing_before_the_start_and_texts_about_it(self):
        names = [packet["name"] for packet in self.packets]
        texts = [fields["text"] for fields in self.fields("STATUSTEXT")]
        self.assertEqual(texts, ["ear: not started", "ear: tracking"])
        self.assertGreater(names.index("ODOMETRY"), names.index("STATUSTEXT", names.index("STATUSTEXT") + 1))

    def test_time_requests(self):
        answers = self.fields("TIMESYNC")
        self.assertGreaterEqual(len(answers), self.requests - 3)  # those that came when the program had ended
        self.assertGreater(len(answers), 10)
        asked = 123456789012345  # in the reference packet
        for answer in answers:
            self.assertEqual((int(answer["ts1"]), answer["targetSystem"], answer["targetComponent"]), (asked, 1, 1))
        newest_us = 0
        for packet in self.packets:  # the clock of the answers is that of the stamps; on a busy machine it runs ahead
            if packet["name"] == "ODOMETRY":
                newest_us = int(packet["fields"]["timeUsec"])
            elif packet["name"] == "TIMESYNC" and newest_us:
                self.assertTrue(0 <= int(packet["fields"]["tc1"]) / 1e3 - newest_us < 60e6)

    def test_real_time_and_report(self):
        self.assertGreater(self.duration, 4.9)
        self.assertIn("mavlink: %d odometry messages" % len(self.odometry), self.printed)

    def test_without_wheels_the_mounting_must_be_stated(self):
        folder = self.work / "wheelless/mav0"
        folder.mkdir(parents=True)
        for sensor in ("imu0", "cam0", "cam1"):
            (folder / sensor).symlink_to(self.recording / "mav0" / sensor)
        done = subprocess.run([PROGRAM, "run", folder.parent, "--out", folder, "--mavlink", "udp:127.0.0.1:9"],
                              capture_output=True, text=True, check=False)
        self.assertGreater(done.returncode, 0)
        self.assertIn("--mavlink-mounting", done.stderr)


class Reference(unittest.TestCase):
    def test_reference_packets_are_what_node_mavlink_makes(self):
        self.assertEqual(node("encode.mjs"), (HERE / "reference_packets.txt").read_text(encoding="utf-8"))


if __name__ == "__main__":
    decoder, reason = install_decoder()
    if decoder is None:
        print("skipped: " + reason)
        sys.exit(77)
    unittest.main()
