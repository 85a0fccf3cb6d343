"""The module's interface: what it hands out, what it refuses and in which words, and the stub that describes it.

test_interface.py ROOT EAR_PROGRAM [TEST...], with the module on PYTHONPATH.
"""

import copy
import gc
import subprocess
import sys
import tempfile
import threading
import time
import unittest
from pathlib import Path

import numpy as np

import ear

ROOT = Path(sys.argv.pop(1)).resolve()
PROGRAM = Path(sys.argv.pop(1)).resolve()


def simulated(**changes):
    return ear.Simulation("flat1", **{"seed": 811, "duration": 8.0, **changes})


def camera(**changes):
    return ear.CameraCalibration(**{"width": 640, "height": 480, "fu": 385.0, "fv": 385.0, "cu": 319.5, "cv": 239.5, **changes})


class Values(unittest.TestCase):
    def test_fields_by_keyword_and_place(self):
        sample = ear.ImuSample(7, [1, 2, 3], accel_B=np.array([0.0, 0.0, 9.81], dtype=np.float32))
        self.assertEqual(sample.t_ns, 7)
        self.assertEqual(sample.gyro_B.tolist(), [1.0, 2.0, 3.0])
        self.assertAlmostEqual(sample.accel_B[2], 9.81, places=5)

    def test_replace_leaves_the_original(self):
        before = ear.Calibration(cameras=[camera()])
        after = before.replace(camera_time_offset=0.003)
        self.assertEqual((before.camera_time_offset, after.camera_time_offset), (0.0, 0.003))
        with self.assertRaises(AttributeError):
            before.camera_time_offset = 1.0

    def test_nothing_inside_is_shared(self):
        calibration = ear.Calibration(cameras=[camera()])
        calibration.cameras[0].T_BC[0, 3] = 5.0  # a copy, as all arrays of values are
        self.assertEqual(calibration.cameras[0].T_BC[0, 3], 0.0)
        cameras = calibration.cameras
        del calibration
        gc.collect()
        self.assertEqual(cameras[0].width, 640)

    def test_refusals_name_field_and_value(self):
        for make, words in (
            (lambda: ear.ImuSample(t_ns=1.5), "t_ns: expected an integer number of nanoseconds, got float 1.5"),
            (lambda: ear.ImuSample(t_ns=True), "t_ns: expected an integer number of nanoseconds, got bool True"),
            (lambda: ear.ImuSample(gyro_B=[1, 2]),
             "gyro_B: expected numbers of the shape (3,), got an array of int64 with the shape (2,)"),
            (lambda: ear.ImuSample(gyro_B="abc"), "gyro_B: expected numbers of the shape (3,), got str 'abc'"),
            (lambda: ear.ImuSample(gyro_B=[1, 2, 3j]), "gyro_B: expected numbers of the shape (3,), got an array of complex128"),
            (lambda: ear.ImuSample(time=3), "ImuSample: there is no time; there are t_ns, gyro_B, accel_B"),
            (lambda: ear.CameraCalibration(width="640"), "width: expected an integer, got str '640'"),
            (lambda: ear.CameraCalibration(distortion=[0.1, 0.2]), "distortion: expected 5 values, got list [0.1, 0.2]"),
            (lambda: ear.Calibration(cameras=[3]), "cameras[0]: expected an CameraCalibration, got int 3"),
            (lambda: ear.ImuSample(1, 2, 3, 4), "at most 3"),
        ):
            with self.subTest(words=words):
                with self.assertRaises(TypeError) as caught:
                    make()
                self.assertIn(words, str(caught.exception))
        with self.assertRaisesRegex(OverflowError, "t_ns: expected 64 bits"):
            ear.ImuSample(t_ns=2**70)

    def test_numpy_integers_are_times(self):
        self.assertEqual(ear.EncoderSample(np.int64(5), np.int32(-1), 2).left_count, -1)

    def test_they_print_themselves(self):
        text = str(simulated(tracks=False).calibration)
        for line in ("cameras:", "    width: 640", "encoder:", "  wraps: true", "    name: "):
            self.assertIn(line, text)


class Settings(unittest.TestCase):
    def test_inner_settings_are_those_of_the_outer(self):
        config = ear.Config()
        config.filter.window = 8
        config.filter.odometer.model = "gyro"
        self.assertEqual((config.filter.window, config.filter.odometer.model), (8, "gyro"))
        other = copy.deepcopy(config)
        other.filter.window = 9
        self.assertEqual(config.filter.window, 8)

    def test_an_inner_one_keeps_the_outer(self):
        inner = ear.Config().filter.odometer
        gc.collect()
        self.assertEqual(inner.model, "terrain")

    def test_text_is_a_settings_file(self):
        config = ear.Config()
        config.filter.window = 9
        config.filter.anomaly.enabled = False
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "config.yaml"
            file.write_text(str(config), encoding="utf-8")
            self.assertEqual(str(ear.load_config(file)), str(config))
            ear.save_config(config, file)
            self.assertEqual(str(ear.load_config(file)), str(config))

    def test_they_are_those_of_the_default_file(self):
        self.assertEqual(str(ear.load_config(ROOT / "config/default.yaml")), str(ear.Config()))

    def test_refusals(self):
        config = ear.Config()
        with self.assertRaisesRegex(TypeError, "window: expected an integer, got float 2.5"):
            config.filter.window = 2.5
        with self.assertRaisesRegex(ValueError, "model: str 'car' is none of none, differential, gyro, terrain"):
            config.filter.odometer.model = "car"
        with self.assertRaises(AttributeError):
            config.filter.windows = 3

    def test_words_are_those_of_the_program(self):
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "bad.yaml"
            file.write_text("filter:\n  windows: 3\n", encoding="utf-8")
            program = subprocess.run([PROGRAM, "run", folder, "--config", file], capture_output=True, text=True, check=False)
            with self.assertRaises(ear.InputError) as caught:
                ear.load_config(file)
            self.assertIn(str(caught.exception), program.stderr)
            with self.assertRaises(ear.InputError) as caught:
                ear.Recording(folder)
            program = subprocess.run([PROGRAM, "run", folder], capture_output=True, text=True, check=False)
            self.assertIn(str(caught.exception), program.stderr)


class Images(unittest.TestCase):
    def setUp(self):
        T_BC1 = np.eye(4)
        T_BC1[0, 3] = 0.05
        self.odometry = ear.Odometry(ear.Calibration(cameras=[camera(), camera(T_BC=T_BC1)]))
        self.image = np.zeros((480, 640), np.uint8)

    def refused(self, kind, words, left, right=None, t_ns=0):
        with self.assertRaises(kind) as caught:
            self.odometry.add_stereo(t_ns, left, right)
        self.assertIn(words, str(caught.exception))

    def test_what_is_no_image(self):
        expected = "left: expected a NumPy array of uint8 with the shape (height, width), got "
        self.refused(TypeError, expected + "an array of float64 with the shape (480, 640)", self.image.astype(float))
        self.refused(TypeError, expected + "an array of uint8 with the shape (480, 640, 3)", np.zeros((480, 640, 3), np.uint8))
        self.refused(TypeError, expected + "list [[1, 2]]", [[1, 2]])
        self.refused(TypeError, expected + "an array of int8", self.image.astype(np.int8))
        self.refused(TypeError, expected + "an array of uint8 with the shape (0, 640)", self.image[:0])
        self.refused(ValueError, "right: expected 480x640 (height x width) as camera 1 is calibrated, got 240x640",
                     self.image, self.image[:240])
        self.refused(TypeError, "t_ns: expected an integer number of nanoseconds, got float 0.0", self.image, t_ns=0.0)

    def test_strides(self):
        for image in (np.zeros((480, 1280), np.uint8)[:, ::2], np.zeros((640, 480), np.uint8).T, self.image[::-1],
                      self.image[:, ::-1], np.broadcast_to(np.zeros(640, np.uint8), (480, 640))):
            self.refused(ValueError, "left: expected pixels of a row side by side and rows in order, got strides of", image)

    def test_parts_of_images_and_read_only_ones_are_taken(self):
        self.image.setflags(write=False)
        for image in (self.image, np.zeros((500, 700), np.uint8)[10:490, 20:660], np.zeros((960, 640), np.uint8)[::2]):
            self.assertIsNone(self.odometry.add_stereo(0, image, image))

    def test_samples_in_blocks(self):
        times = np.arange(5) * 5_000_000
        self.odometry.add_imu(times, np.zeros((5, 3)), np.tile([0.0, 0.0, 9.81], (5, 1)))
        self.assertEqual(self.odometry.input_counts.imu.accepted, 5)
        with self.assertRaisesRegex(TypeError, r"gyro_B: expected numbers of the shape \(5, 3\), got .* \(4, 3\)"):
            self.odometry.add_imu(times, np.zeros((4, 3)), np.zeros((5, 3)))
        with self.assertRaisesRegex(TypeError, "t_ns: expected an integer number of nanoseconds, or an array of them"):
            self.odometry.add_imu(times * 1e-9, np.zeros((5, 3)), np.zeros((5, 3)))

    def test_bad_calibration_has_the_words_of_the_library(self):
        with self.assertRaisesRegex(ValueError, "performance.budget_ms: a time"):
            config = ear.Config()
            config.performance.budget_ms = -1.0
            ear.Odometry(ear.Calibration(cameras=[camera()]), config)


class FilterAlone(unittest.TestCase):
    def test_fed_from_python_is_replay(self):
        simulation = simulated()
        whole = ear.replay(simulation, ear.Filter(simulation.calibration))
        self.assertGreater(len(whole), 100)
        one = ear.Filter(simulation.calibration)
        add = {ear.ImuSample: one.add_imu, ear.EncoderSample: one.add_encoder, ear.LaserSample: one.add_laser}
        single = []
        for sample in simulation:
            if type(sample) in add:
                add[type(sample)](sample)
                continue
            again = ear.FeatureFrame(sample.t_ns, sample.ids, sample.left, sample.right, sample.right_skipped, sample.repeated)
            if one.common_stamp(again.t_ns) is not None and (estimate := one.process(again)):
                single.append(estimate)
        self.assertEqual([e.state.t_ns for e in whole], [e.state.t_ns for e in single])
        for a, b in zip(whole, single):
            self.assertEqual(a.covariance.tobytes(), b.covariance.tobytes())
            self.assertEqual(a.state.p_WB.tobytes(), b.state.p_WB.tobytes())

    def test_health_in_words(self):
        simulation = simulated()
        odometry = ear.Filter(simulation.calibration)
        self.assertEqual(odometry.health.status, ear.HealthStatus.initialising)
        self.assertIn(odometry.health.reason_text, str(odometry.health))
        last = ear.replay(simulation, odometry)[-1]
        self.assertEqual(str(last.health), "tracking")
        self.assertEqual(set(last.health.sources), {"camera_left", "camera_right", "wheel_left", "wheel_right", "beam_0",
                                                    "beam_1", "beam_2", "gyroscope", "accelerometer"})

    def test_bad_frames(self):
        with self.assertRaisesRegex(TypeError, r"left: expected numbers of the shape \(2, 2\)"):
            ear.FeatureFrame(0, [1, 2], np.zeros((3, 2)))
        with self.assertRaisesRegex(TypeError, r"ids: expected integers of the shape \(n,\), got"):
            ear.FeatureFrame(0, [1.5, 2.0], np.zeros((2, 2)))

    def test_other_threads_go_on_while_it_estimates(self):
        simulation = simulated(duration=20.0)
        thread = threading.Thread(target=ear.replay, args=(simulation, ear.Filter(simulation.calibration)))
        turns, longest, before = 0, 0.0, time.monotonic()
        thread.start()
        while thread.is_alive():
            time.sleep(0.001)
            now = time.monotonic()
            turns, longest, before = turns + 1, max(longest, now - before), now
        self.assertGreater(turns, 20, f"longest wait {longest} s")

    def test_two_threads_share_one_filter(self):
        simulation = simulated(duration=3.0)
        shared = ear.Filter(simulation.calibration)
        samples = [s for s in simulation if isinstance(s, ear.ImuSample)]

        def feed():
            for sample in samples:
                shared.add_imu(sample)

        threads = [threading.Thread(target=feed) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        counts = shared.input_counts.imu
        self.assertEqual(counts.accepted + counts.rejected, 4 * len(samples))


class Stub(unittest.TestCase):
    def test_it_is_what_the_module_is(self):
        sys.path.insert(0, str(ROOT / "python/stub"))
        import make_stub
        self.assertEqual(make_stub.STUB.read_text(encoding="utf-8"), make_stub.stub(), "run python/stub/make_stub.py")

    def test_it_is_python(self):
        compile((ROOT / "python/ear/__init__.pyi").read_text(encoding="utf-8"), "stub", "exec")


if __name__ == "__main__":
    unittest.main()
