"""Public recordings become ours: tools/real_data on small folders in the original layouts.

test_real_data.py ROOT EAR_PROGRAM [TEST...]
"""

import array
import io
import json
import math
import shutil
import subprocess
import sys
import tempfile
import unittest
import zipfile
from pathlib import Path

ROOT = Path(sys.argv.pop(1)).resolve()
PROGRAM = Path(sys.argv.pop(1)).resolve()
CLIPS = ROOT / "../shared/data"
sys.path.insert(0, str(ROOT / "tools"))
from real import judge, reference  # noqa: E402
from real.layout import BadInput, matrix, quaternion  # noqa: E402

EUROC_YAML = "T_BS:\n  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n"
# Of 2011_09_26, and what follows from it for the rectified grey cameras: their places in the body [m].
KITTI_IMU_TO_VELO = """calib_time: 25-May-2012 16:47:16
R: 9.999976e-01 7.553071e-04 -2.035826e-03 -7.854027e-04 9.998898e-01 -1.482298e-02 2.024406e-03 1.482454e-02 9.998881e-01
T: -8.086759e-01 3.195559e-01 -7.997231e-01
"""
KITTI_VELO_TO_CAM = """calib_time: 15-Mar-2012 11:37:16
R: 7.533745e-03 -9.999714e-01 -6.166020e-04 1.480249e-02 7.280733e-04 -9.998902e-01 9.998621e-01 7.523790e-03 1.480755e-02
T: -4.069766e-03 -7.631618e-02 -2.717806e-01
"""
KITTI_CAM_TO_CAM = """calib_time: 09-Jan-2012 13:57:47
S_00: 1.392000e+03 5.120000e+02
K_00: 9.842439e+02 0.0 6.900000e+02 0.0 9.808141e+02 2.331966e+02 0.0 0.0 1.0
D_00: -3.728755e-01 2.037299e-01 2.219027e-03 1.383707e-03 -7.233722e-02
R_00: 1.0 0.0 0.0 0.0 1.0 0.0 0.0 0.0 1.0
T_00: 0.0 0.0 0.0
S_rect_00: 1.242000e+03 3.750000e+02
R_rect_00: 9.999239e-01 9.837760e-03 -7.445048e-03 -9.869795e-03 9.999421e-01 -4.278459e-03 7.402527e-03 4.351614e-03 9.999631e-01
P_rect_00: 7.215377e+02 0.0 6.095593e+02 0.0 0.0 7.215377e+02 1.728540e+02 0.0 0.0 0.0 1.0 0.0
S_01: 1.392000e+03 5.120000e+02
K_01: 9.895267e+02 0.0 7.020000e+02 0.0 9.878386e+02 2.455590e+02 0.0 0.0 1.0
D_01: -3.644661e-01 1.790019e-01 1.148107e-03 -6.298563e-04 -5.314062e-02
R_01: 1.0 0.0 0.0 0.0 1.0 0.0 0.0 0.0 1.0
T_01: -0.537 0.0 0.0
S_rect_01: 1.242000e+03 3.750000e+02
P_rect_01: 7.215377e+02 0.0 6.095593e+02 -3.875744e+02 0.0 7.215377e+02 1.728540e+02 0.0 0.0 0.0 1.0 0.0
"""
KITTI_PLACES = {"cam0": (1.083301978, -0.309888901, 0.729919795), "cam1": (1.083838455, -0.847034374, 0.732207721)}


def npy(rows, fortran=False):
    """A numpy file of numbers; `rows`: lists, or numbers for one dimension."""
    flat = not isinstance(rows[0], list)
    shape = f"({len(rows)},)" if flat else f"({len(rows)}, {len(rows[0])})"
    values = rows if flat else [x for row in (zip(*rows) if fortran else rows) for x in row]
    header = f"{{'descr': '<f8', 'fortran_order': {fortran}, 'shape': {shape}, }}".encode()
    header += b" " * (-(len(header) + 11) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header + array.array("d", values).tobytes()


def csv_rows(file):
    return [line.split(",") for line in file.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]


def numbers_of(yaml, key):
    text = yaml.read_text(encoding="utf-8").partition(key + ":")[2].partition("]")[0].partition("[")[2]
    return [float(x) for x in text.split(",")]


class RealData(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.work = Path(folder.name)
        self.out = self.work / "out"

    def write(self, name, content):
        path = self.work / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())

    def tool(self, *arguments):
        command = [sys.executable, "-B", str(ROOT / "tools/real_data"), *map(str, arguments)]
        return subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)

    def convert(self, name, folder):
        result = self.tool("convert", name, self.work / folder, "--out", self.out)
        self.assertEqual(result.returncode, 0, result)
        return self.out / "mav0"

    def assert_refused(self, name, folder, *messages):
        result = self.tool("convert", name, self.work / folder, "--out", self.out)
        self.assertEqual(result.returncode, 1, result)
        for message in messages:
            self.assertIn(message, result.stderr)
        self.assertNotIn("Traceback", result.stderr)
        self.assertEqual(list(self.work.glob("out*")), [])  # nothing half done is left


class Euroc(RealData):
    def setUp(self):
        super().setUp()
        self.write("s/mav0/imu0/data.csv", "#timestamp [ns],...\r\n1000,1,2,3,4,5,6\r\n2000,1,2,3,4,5,6\r\n")
        self.write("s/mav0/imu0/sensor.yaml", EUROC_YAML)
        self.write("s/mav0/cam0/data.csv", "#timestamp [ns],filename\n1000,1000.png\n")
        self.write("s/mav0/cam0/sensor.yaml", EUROC_YAML)
        self.write("s/mav0/cam0/data/1000.png", "an image")
        self.write("s/mav0/state_groundtruth_estimate0/data.csv", "#\n" + "1000" + ",0.5" * 16 + "\n")

    def test_it_stays_what_it_is(self):
        mav0 = self.convert("euroc", "s")
        self.assertEqual([row[0] for row in csv_rows(mav0 / "imu0/data.csv")], ["1000", "2000"])
        self.assertEqual((mav0 / "cam0/data/1000.png").read_text(encoding="utf-8"), "an image")
        self.assertEqual(len(csv_rows(mav0 / "state_groundtruth_estimate0/data.csv")[0]), 17)
        self.assertIn("is there already", self.tool("convert", "euroc", self.work / "s", "--out", self.out).stderr)

    def test_bad_input(self):
        self.write("s/mav0/imu0/data.csv", "1000,1,2,3,4,5,6\n2000,1,2,3,4\n")
        self.assert_refused("euroc", "s", "imu0/data.csv:2: 5 fields where 7 are expected: the line is torn")
        self.write("s/mav0/imu0/data.csv", "1000,1,2,3,4,5,6\n1000,1,2,3,4,5,6\n")
        self.assert_refused("euroc", "s", "imu0/data.csv:2: timestamp: not later")
        self.write("s/mav0/imu0/data.csv", "1000,1,2,3,4,5,6\n2000,1,2,x,4,5,6\n")
        self.assert_refused("euroc", "s", "imu0/data.csv:2: w_z [rad/s]: 'x' is no finite number")
        self.write("s/mav0/imu0/data.csv", "1.5,1,2,3,4,5,6\n")
        self.assert_refused("euroc", "s", "imu0/data.csv:1: timestamp: '1.5' is not a whole number")

    def test_missing_files(self):
        (self.work / "s/mav0/cam0/data/1000.png").unlink()
        self.assert_refused("euroc", "s", "cam0/data/1000.png: is missing")
        (self.work / "s/mav0/imu0/sensor.yaml").unlink()
        self.assert_refused("euroc", "s", "imu0/sensor.yaml: is missing")
        self.assert_refused("euroc", "nowhere", "nowhere: no such folder")


class Kitti(RealData):
    def setUp(self):
        super().setUp()
        self.write("d/calib_imu_to_velo.txt", KITTI_IMU_TO_VELO)
        self.write("d/calib_velo_to_cam.txt", KITTI_VELO_TO_CAM)
        self.write("d/calib_cam_to_cam.txt", KITTI_CAM_TO_CAM)
        packets = "".join(f"2011-09-26 14:05:35.{i:02d}0000001\n" for i in range(3))
        for drive in ("d/x_extract", "d/x_sync"):
            self.write(f"{drive}/oxts/timestamps.txt", packets)
            for camera in ("image_00", "image_01"):
                self.write(f"{drive}/{camera}/timestamps.txt", "2011-09-26 14:05:35.500923136\n")
                self.write(f"{drive}/{camera}/data/0000000000.png", "an image")
        for i in range(3):
            self.write(f"d/x_extract/oxts/data/{i:010d}.txt", self.packet(east=i))

    def packet(self, east):
        """A level car that points north, so many metres east of the first packet."""
        longitude = 8.4 + math.degrees(east / (6378137.0 * math.cos(math.radians(49.0))))
        words = [49.0, longitude, 116.0, 0.0, 0.0, math.pi / 2, 3.0, 0.1, 3.0, 0.0, 0.2, 0.5, 0.6, 9.8, 0, 0, 0,
                 0.01, 0.02, 0.03, 0, 0, 0, 0.1, 0.1, 4, 9, 5, 5, 6]
        return " ".join(map(repr, words)) + "\n"

    def test_rectified_images_with_the_packets_of_the_extract(self):
        mav0 = self.convert("kitti_raw", "d/x_sync")
        for camera, place in KITTI_PLACES.items():
            T = numbers_of(mav0 / camera / "sensor.yaml", "data")
            for i in range(3):
                self.assertAlmostEqual(T[4 * i + 3], place[i], places=6)
            self.assertAlmostEqual(T[2], 0.999964108, places=6)
            self.assertEqual(numbers_of(mav0 / camera / "sensor.yaml", "intrinsics"), [721.5377, 721.5377, 609.5593, 172.854])
            self.assertIn("distortion_model: none", (mav0 / camera / "sensor.yaml").read_text(encoding="utf-8"))
            self.assertEqual(csv_rows(mav0 / camera / "data.csv"), [["1317045935500923136", "1317045935500923136.png"]])
        rows = csv_rows(mav0 / "imu0/data.csv")
        self.assertEqual(rows[0], ["1317045935000000001", "0.01", "0.02", "0.03", "0.5", "0.6", "9.8"])
        truth = [[float(x) for x in row] for row in csv_rows(mav0 / "state_groundtruth_estimate0/data.csv")]
        self.assertAlmostEqual(truth[2][1], 2.0, places=6)  # x is east
        self.assertAlmostEqual(truth[2][2], 0.0, places=6)
        for value, expected in zip(truth[0][4:11], [math.sqrt(0.5), 0, 0, math.sqrt(0.5), 0.1, 3.0, 0.2]):
            self.assertAlmostEqual(value, expected, places=8)

    def test_images_as_taken(self):
        mav0 = self.convert("kitti_raw", "d/x_extract")
        self.assertEqual(numbers_of(mav0 / "cam0/sensor.yaml", "intrinsics"), [984.2439, 980.8141, 690.0, 233.1966])
        self.assertEqual(len(numbers_of(mav0 / "cam1/sensor.yaml", "distortion_coefficients")), 5)
        left, right = (numbers_of(mav0 / camera / "sensor.yaml", "data") for camera in ("cam0", "cam1"))
        self.assertAlmostEqual(math.dist(left[3::4][:3], right[3::4][:3]), 0.537, places=6)

    def test_bad_input(self):
        self.write("d/x_extract/oxts/data/0000000001.txt", "49.0 8.4 116.0\n")
        self.assert_refused("kitti_raw", "d/x_extract", "0000000001.txt:1: 3 fields where 30 are expected: the line is torn")
        self.write("d/x_extract/oxts/data/0000000001.txt", self.packet(1).replace("9.8", "nan"))
        self.assert_refused("kitti_raw", "d/x_extract", "0000000001.txt:1: az: 'nan' is no finite number")
        self.write("d/x_extract/oxts/timestamps.txt", "2011-09-26 14:05:35\nyesterday\n")
        self.assert_refused("kitti_raw", "d/x_extract", "timestamps.txt:2: timestamp: 'yesterday' is no date and time")

    def test_calibration_that_is_not_there(self):
        self.write("d/calib_velo_to_cam.txt", "R: 1 0 0\nT: 0 0 0\n")
        self.assert_refused("kitti_raw", "d/x_extract", "calib_velo_to_cam.txt: R: 3 numbers where 9 are expected")
        (self.work / "d/calib_cam_to_cam.txt").unlink()
        self.assert_refused("kitti_raw", "d/x_extract", "calib_cam_to_cam.txt: is missing")

    def test_a_packet_that_is_missing_or_late(self):
        (self.work / "d/x_extract/oxts/data/0000000001.txt").unlink()
        result = self.tool("convert", "kitti_raw", self.work / "d/x_extract", "--out", self.out)
        self.assertIn("1 packets are missing", result.stdout)
        self.assertEqual(len(csv_rows(self.out / "mav0/imu0/data.csv")), 2)

    def test_a_sync_alone(self):
        (self.work / "d/x_extract").rename(self.work / "d/elsewhere")
        self.assert_refused("kitti_raw", "d/x_sync", "x_extract/oxts: is missing: the packets at 100 Hz are in the extract")


class Comma(RealData):
    def setUp(self):
        super().setUp()
        log = "s/processed_log"
        for sensor, rows in (("gyro_uncalibrated", [[0.1, 0.2, 0.3]] * 3), ("accelerometer", [[1.0, 2.0, -9.8]] * 3)):
            self.write(f"{log}/IMU/{sensor}/t", npy([10.0, 10.01, 10.02]))
            self.write(f"{log}/IMU/{sensor}/value", npy(rows, fortran=True))
        self.write(f"{log}/CAN/wheel_speed/t", npy([10.0, 11.0]))
        self.write(f"{log}/CAN/wheel_speed/value", npy([[9.0, 9.0, 2.0, 4.0], [9.0, 9.0, 4.0, 4.0]]))
        # On the equator at the prime meridian east, north, up are the earth's y, z, x. The phone looks north.
        north = quaternion([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])  # columns: forward, right, down
        self.write("s/global_pose/frame_times", npy([10.0, 10.05]))
        self.write("s/global_pose/frame_positions", npy([[6378137.0, 0.0, 0.0], [6378138.0, 2.0, 3.0]]))
        self.write("s/global_pose/frame_velocities", npy([[0.0, 0.0, 5.0]] * 2))
        self.write("s/global_pose/frame_orientations", npy([north, north]))

    def test_segment(self):
        mav0 = self.convert("comma2k19", "s")
        self.assertEqual(csv_rows(mav0 / "imu0/data.csv")[1], ["10010000000", "0.1", "-0.2", "-0.3", "1", "-2", "9.8"])
        per_metre = 262144 / (2 * math.pi * 0.34)
        self.assertEqual(csv_rows(mav0 / "encoder0/data.csv")[1], ["11000000000", str(round(3 * per_metre)), str(round(4 * per_metre))])
        truth = [[float(x) for x in row] for row in csv_rows(mav0 / "state_groundtruth_estimate0/data.csv")]
        for value, expected in zip(truth[1][1:4], [2.0, 3.0, 1.0]):
            self.assertAlmostEqual(value, expected, places=6)
        forward = [row[0] for row in matrix(*truth[0][4:8])]
        for value, expected in zip([*forward, *truth[0][8:11]], [0.0, 1.0, 0.0, 0.0, 5.0, 0.0]):
            self.assertAlmostEqual(value, expected, places=6)

    def test_bad_input(self):
        name, whole = "s/processed_log/IMU/gyro_uncalibrated/value", npy([[0.1, 0.2, 0.3]] * 3)
        self.write(name, whole[:-5])
        self.assert_refused("comma2k19", "s", "gyro_uncalibrated/value: 67 bytes for 3 rows of 3: the file is torn")
        self.write(name, whole[:20])
        self.assert_refused("comma2k19", "s", "gyro_uncalibrated/value: the header of the array is torn")
        self.write(name, "hello, world, hello")
        self.assert_refused("comma2k19", "s", "gyro_uncalibrated/value: is no numpy array")
        self.write(name, npy([[0.1, math.nan, 0.3]] * 3))
        self.assert_refused("comma2k19", "s", "gyro_uncalibrated/value: row 0, column 1: nan is no finite number")
        self.write(name, npy([[0.1, 0.2, 0.3]] * 2))
        self.assert_refused("comma2k19", "s", "gyro_uncalibrated/value: 2 rows, but", "gyro_uncalibrated/t has 3")
        self.write("s/processed_log/IMU/gyro_uncalibrated/t", npy([10.0, 10.0, 10.1]))
        self.assert_refused("comma2k19", "s", "gyro_uncalibrated/t: row 1: the time is not later")

    def test_missing_file(self):
        (self.work / "s/global_pose/frame_positions").unlink()
        self.assert_refused("comma2k19", "s", "global_pose/frame_positions: is missing")


class Husky(RealData):
    HEADING = "Sec,NanoSec,0-ref Sec,"

    def setUp(self):
        super().setUp()
        self.rows("Encoder_data_parking.csv", "w_left,w_right",
                  "10,0,0,0,0", "10,100000000,0.1,2,4", "10,200000000,0.2,2,4", "11,900000000,1.9,2,4")
        self.rows("gx5_1_IMU_data_parking.csv", "a_x,a_y,a_z,w_x,w_y,w_z", "10,50000000,0,1,2,-9.8,0.1,0.2,0.3", "11,0,1,1,2,-9.8,0,0,0")
        self.rows("Camera_ground_truth_parking.csv", "X,Y,Z,qX,qY,qZ,qW", "10,50000000.5,0,1,2,3,0,0,0.6,0.8")

    def rows(self, name, fields, *lines):
        self.write("p/" + name, "\n".join([self.HEADING + fields, *lines]) + "\n")

    def test_drive(self):
        mav0 = self.convert("husky", "p")
        turn = 262144 / (2.0 * math.pi)  # counts of a radian
        expected = [["10000000000", "0", "0"], ["10100000000", str(round(0.1 * turn)), str(round(0.2 * turn))],
                    ["10200000000", str(round(0.3 * turn)), str(round(0.6 * turn))]]
        self.assertEqual(csv_rows(mav0 / "encoder0/data.csv"), expected)  # up to the gap
        self.assertEqual(csv_rows(mav0 / "imu0/data.csv"), [["10050000000", "-0.2", "-0.1", "-0.3", "-2", "-1", "9.8"]])
        truth = [float(x) for x in csv_rows(mav0 / "state_groundtruth_estimate0/data.csv")[0]]
        for value, expected in zip(truth, [10.05e9, 1.0, -2.0, -3.0, 0.8, 0.0, 0.0, -0.6]):
            self.assertAlmostEqual(value, expected, places=6)

    def test_bad_input(self):
        name = "Encoder_data_parking.csv"
        self.rows(name, "w_left", "10,0,0,0")
        self.assert_refused("husky", "p", f"{name}:1: fields other than Sec,NanoSec,0-ref Sec,w_left,w_right")
        self.rows(name, "w_left,w_right", "10,0,0,0")
        self.assert_refused("husky", "p", f"{name}:2: 4 fields where 5 are expected: the line is torn")
        self.rows(name, "w_left,w_right", "10,0,0,0,nan")
        self.assert_refused("husky", "p", f"{name}:2: w_right: 'nan' is no finite number")
        self.rows(name, "w_left,w_right", "10,5,0,0,0", "10,5,0,0,0")
        self.assert_refused("husky", "p", f"{name}: row 1: the time is not later than that of the row before")
        self.rows(name, "w_left,w_right")
        self.assert_refused("husky", "p", f"{name}: holds no rows")
        (self.work / "p" / name).unlink()
        self.assert_refused("husky", "p", f"{name}: is missing")


class Ucsd(RealData):
    def setUp(self):
        super().setUp()
        self.encoders = {"time_stamps": npy([10.0, 10.025, 10.05]), "counts": npy([[0, 4, 8], [0, 1, 2], [0, 5, 8], [0, 1, 3]])}
        self.write_archive("r/Encoders7.npz", self.encoders)
        self.imu = {"time_stamps": npy([10.0, 10.01]), "angular_velocity": npy([[0.1, 0.4], [0.2, 0.5], [0.3, 0.6]]),
                    "linear_acceleration": npy([[0.0, 0.1], [0.0, -0.1], [1.0, 1.0]])}
        self.write_archive("r/Imu7.npz", self.imu)

    def write_archive(self, name, arrays):
        content = io.BytesIO()
        with zipfile.ZipFile(content, "w") as archive:
            for member, data in arrays.items():
                archive.writestr(member + ".npy", data)
        self.write(name, content.getvalue())

    def test_run(self):
        mav0 = self.convert("ucsd", "r")
        self.assertEqual(csv_rows(mav0 / "encoder0/data.csv"),
                         [["10000000000", "0", "0"], ["10025000000", "2", "9"], ["10050000000", "7", "25"]])
        row = [float(x) for x in csv_rows(mav0 / "imu0/data.csv")[1]]
        for value, expected in zip(row, [10.01e9, 0.4, 0.5, 0.6, 0.980665, -0.980665, 9.80665]):
            self.assertAlmostEqual(value, expected, places=6)

    def test_bad_input(self):
        self.write_archive("r/Encoders7.npz", {**self.encoders, "counts": npy([[0, 4], [0, 1], [0, 5], [0, 1]])})
        self.assert_refused("ucsd", "r", "Encoders7.npz: 2 columns of counts, but 3 time_stamps")
        self.write_archive("r/Encoders7.npz", {**self.encoders, "counts": npy([[0, 4, 8], [0, 1, 2]])})
        self.assert_refused("ucsd", "r", "Encoders7.npz: counts of 2 wheels where 4 are expected")
        self.write_archive("r/Encoders7.npz", {"time_stamps": self.encoders["time_stamps"]})
        self.assert_refused("ucsd", "r", "Encoders7.npz: There is no item named 'counts.npy' in the archive")
        self.write("r/Encoders7.npz", "hello")
        self.assert_refused("ucsd", "r", "Encoders7.npz: cannot be read: File is not a zip file")
        (self.work / "r/Encoders7.npz").unlink()
        self.assert_refused("ucsd", "r", "0 files Encoders*.npz where one is expected")


class References(RealData):
    """A truth of a body that swings and turns, and inertial samples of it."""

    def recording(self, late_s=0.0, lever=(0.0, 0.0, 0.0), climb_m_s=0.0):
        folder = self.work / "swinging"
        for name in ("imu0", "state_groundtruth_estimate0"):
            (folder / "mav0" / name).mkdir(parents=True)

        def pose(t):  # position, velocity, acceleration, heading, its rate
            p = [math.sin(2.0 * t), math.cos(1.3 * t), 0.3 * math.sin(3.1 * t)]
            v = [2.0 * math.cos(2.0 * t), -1.3 * math.sin(1.3 * t), 0.93 * math.cos(3.1 * t)]
            a = [-4.0 * p[0], -1.69 * p[1], -9.61 * p[2]]
            return p, v, a, 0.8 * math.sin(1.7 * t), 1.36 * math.cos(1.7 * t)

        def write(name, rows):
            lines = [",".join([str(round(1e9 * t)), *(repr(x) for x in values)]) for t, values in rows]
            (folder / "mav0" / name / "data.csv").write_text("# of a test\n" + "\n".join(lines) + "\n", encoding="utf-8")

        imu, truth = [], []
        for k in range(1600):
            _, _, a, heading, rate = pose(k / 200)
            c, s = math.cos(heading), math.sin(heading)
            imu.append((k / 200, [0.02, -0.01, rate + 0.05, c * a[0] + s * a[1] + 0.1, -s * a[0] + c * a[1], a[2] + 9.81]))
        for k in range(10, 790):
            t = k / 100
            p, v, _, _, _ = pose(t - late_s)
            heading = pose(t)[3]
            c, s = math.cos(heading), math.sin(heading)
            p[0] += c * lever[0] - s * lever[1]
            p[1] += s * lever[0] + c * lever[1]
            p[2] += lever[2] + climb_m_s * min(max(t - 3.0, 0.0), 2.0)
            truth.append((t, [*p, math.cos(heading / 2), 0.0, 0.0, math.sin(heading / 2), *v]))
        write("imu0", imu)
        write("state_groundtruth_estimate0", truth)
        return folder

    def test_sound(self):
        figures = reference.judge(self.recording(lever=(0.05, -0.02, 0.1)))
        self.assertLess(figures["turn_scatter_rad"], 1e-3)
        self.assertLess(figures["worst_velocity_m_s"], 0.15)  # of the lever
        self.assertEqual(figures["delay_s"], 0.0)
        self.assertLess(figures["position_scatter_m"], 1e-4)

    def test_late_positions(self):
        for late_s in (0.008, -0.013):
            figures = reference.judge(self.recording(late_s=late_s))
            self.assertAlmostEqual(figures["delay_s"], late_s, delta=1.1e-3)
            shutil.rmtree(self.work / "swinging")

    def test_positions_that_contradict_velocities(self):
        self.assertAlmostEqual(reference.judge(self.recording(climb_m_s=0.35))["worst_velocity_m_s"], 0.35, delta=0.01)

    def test_bad_input(self):
        folder = self.recording()
        path = folder / "mav0/state_groundtruth_estimate0/data.csv"
        path.write_text(path.read_text(encoding="utf-8") + "9000000000,1,2,3\n", encoding="utf-8")
        with self.assertRaisesRegex(BadInput, "data.csv:782: .*torn"):
            reference.judge(folder)
        path.write_text("1,2,3\n", encoding="utf-8")
        with self.assertRaisesRegex(BadInput, "q_w"):
            reference.judge(folder)


class Tool(RealData):
    def test_list(self):
        result = self.tool("--data", self.work, "list")
        self.assertEqual(result.returncode, 0, result)
        for text in ("kitti_raw (convert)", "CC BY-NC-SA 3.0", "https://github.com/commaai/comma2k19", "hop (not there)"):
            self.assertIn(text, result.stdout)

    def test_no_converter(self):
        self.assert_refused("lawn_wheels", "", "no converter for lawn_wheels", "layout is not documented", "there are comma2k19, euroc")

    def test_nothing_to_run_or_report(self):
        run = self.tool("--data", self.work / "data", "--out", self.work / "o", "run", "--ear", PROGRAM)
        self.assertEqual(run.returncode, 0, run)
        self.assertIn(f"skipped: no recordings in {self.work / 'data'}", run.stdout)
        self.assertIn("nowhere: no folder with a mav0", self.tool("--data", self.work, "run", "nowhere", "--ear", PROGRAM).stderr)
        self.assertIn("results.json: is missing", self.tool("--out", self.work, "report").stderr)

    def test_quaternions(self):
        for q in ([0.5, 0.5, -0.5, 0.5], [0.1, 0.7, -0.7, 0.1], [0.0, 0.0, 0.6, 0.8], [0.0, 1.0, 0.0, 0.0]):
            for value, expected in zip(quaternion(matrix(*q)), q):
                self.assertAlmostEqual(value, expected)

    def test_alarms_count_while_the_position_is_right(self):
        figures = {"false_tracking": {"stretches": [{"from_ns": 60, "to_ns": 70}]}}
        said = [(0, "initialising: it moves"), (10, "tracking"), (20, "degraded: position imprecise; carried by wheels"),
                (30, "degraded: without left wheel; carried by wheels"), (40, "tracking"), (50, "degraded: without left wheel, position imprecise; carried by standing still"),
                (55, "tracking"), (65, "degraded: without left wheel; carried by wheels"), (80, "tracking"), (90, "lost: velocity")]
        summary = {"duration_s": 1800.0, "health": [{"t_ns": t, "is": text} for t, text in said]}
        self.assertEqual(judge.alarms(summary, figures), {"alarms_per_hour": 6.0, "accusations_per_hour": 4.0})
        self.assertEqual(judge.alarms({**summary, "duration_s": 0.0}, figures), {"alarms_per_hour": 0.0, "accusations_per_hour": 0.0})

    def test_a_real_recording(self):
        if not (CLIPS / "comma2k19").exists():
            self.skipTest(f"no folder {CLIPS / 'comma2k19'}")
        run = self.tool("--data", CLIPS, "--out", self.work, "run", "comma2k19", "--ear", PROGRAM)
        self.assertEqual(run.returncode, 0, run)
        result = json.loads((self.work / "results.json").read_text(encoding="utf-8"))[0]
        self.assertGreater(result["figures"]["length_m"], 900.0)
        self.assertEqual(result["figures"]["alarms_per_hour"], 0.0)
        page = self.work / "page.md"
        self.assertEqual(self.tool("--out", self.work, "report", "--page", page).returncode, 0)
        self.assertRegex(page.read_text(encoding="utf-8"), r"\n\| comma2k19 \| 58")


if __name__ == "__main__":
    unittest.main()
