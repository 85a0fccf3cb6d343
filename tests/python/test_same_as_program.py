"""The module does what the program does, to the bit.

test_same_as_program.py EAR_PROGRAM CLIPS [TEST...]. Without the clip `hop` in CLIPS its test is skipped.
"""

import json
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np

import ear

PROGRAM = Path(sys.argv.pop(1)).resolve()
CLIPS = Path(sys.argv.pop(1)).resolve()


def run_program(*arguments):
    return subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, check=True).stdout


def fed_by_hand(recording, odometry):
    """What `ear run` does, sample by sample: a frame is handed over when the first inertial sample after it is in."""
    estimates, waiting = [], []

    def hand_over():
        frame = waiting.pop(0)
        estimate = odometry.add_stereo(frame.t_ns, frame.left, frame.right)
        if estimate:
            estimates.append(estimate)

    for sample in recording:
        if isinstance(sample, ear.ImuSample):
            odometry.add_imu(sample.t_ns, sample.gyro_B, sample.accel_B)
            while waiting and sample.t_ns >= odometry.frame_time(waiting[0].t_ns):
                hand_over()
        elif isinstance(sample, ear.EncoderSample):
            odometry.add_encoder(sample.t_ns, sample.left_count, sample.right_count)
        elif isinstance(sample, ear.LaserSample):
            odometry.add_laser(sample.t_ns, sample.range)
        else:
            waiting.append(sample)
    while waiting:
        hand_over()
    return estimates


class SameAsProgram(unittest.TestCase):
    def compare(self, recording, folder):
        out = folder / "program"
        run_program("run", recording, "--out", out)
        opened = ear.Recording(recording)
        replayed = ear.replay(opened, ear.Odometry(opened.calibration))
        opened = ear.Recording(recording)
        by_hand = fed_by_hand(opened, ear.Odometry(opened.calibration))
        self.assertGreater(len(replayed), 20)
        for name, estimates in (("replayed", replayed), ("by_hand", by_hand)):
            with self.subTest(way=name):
                ear.write_states(folder / f"{name}.csv", estimates)
                ear.write_tum(folder / f"{name}.tum", estimates)
                self.assertEqual((folder / f"{name}.csv").read_bytes(), (out / "states.csv").read_bytes())
                self.assertEqual((folder / f"{name}.tum").read_bytes(), (out / "estimate.tum").read_bytes())
        self.assertEqual(len(replayed), len(by_hand))
        for a, b in zip(replayed, by_hand):  # all bits, of which the files have nine digits
            for x, y in ((a.covariance, b.covariance), (a.state.p_WB, b.state.p_WB), (a.state.q_WB, b.state.q_WB)):
                self.assertEqual(x.tobytes(), y.tobytes())
        self.evaluate(recording, out, replayed)

    def evaluate(self, recording, out, estimates):
        for align in ("yaw", "se3"):
            program = json.loads(run_program("evaluate", out, recording, "--json", "--align", align))["estimates"][0]
            self.assertEqual(ear.evaluate(out, recording, align=align), program)
            self.assertEqual({**ear.evaluate(estimates, recording, align=align), "name": program["name"]}, program)

    def test_hop(self):
        if not (CLIPS / "hop").is_dir():
            self.skipTest(f"no recording {CLIPS / 'hop'}")
        with tempfile.TemporaryDirectory() as folder:
            self.compare(CLIPS / "hop", Path(folder))

    def test_simulated(self):
        with tempfile.TemporaryDirectory() as folder:
            recording = Path(folder) / "recording"
            ear.Simulation("flat1", seed=812, duration=4.0, camera_rate_hz=10.0, tracks=False).write(recording)
            self.compare(recording, Path(folder))
            self.images(recording, Path(folder))

    def images(self, recording, folder):
        """They are those of the files, shared, read-only, and live as long as somebody has them."""
        opened = ear.Recording(recording)
        frames = [sample for sample in opened if isinstance(sample, ear.StereoFrame)]
        del opened
        self.assertEqual((frames[0].left.shape, frames[0].left.dtype), ((480, 640), np.uint8))
        self.assertEqual(frames[0].left.ctypes.data, frames[0].left.ctypes.data)
        with self.assertRaisesRegex(ValueError, "read-only"):
            frames[0].left[0, 0] = 1
        last = frames[-1].left
        before = last.tobytes()
        del frames
        self.assertEqual(last.tobytes(), before)

    def test_simulation_written_twice(self):
        """The simulator of the module is that of the program."""
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            run_program("simulate", "fly1", "--seed", 813, "--duration", 3, "--no-images", "--out", folder / "program")
            ear.Simulation("fly1", seed=813, duration=3.0, tracks=False).write(folder / "module", images=False)
            files = sorted(path.relative_to(folder / "program") for path in (folder / "program").rglob("*") if path.is_file())
            self.assertGreater(len(files), 8)
            for file in files:
                self.assertEqual((folder / "program" / file).read_bytes(), (folder / "module" / file).read_bytes(), file)

    def test_callback(self):
        with tempfile.TemporaryDirectory() as name:
            ear.Simulation("flat1", seed=814, duration=2.0, camera_rate_hz=5.0, tracks=False).write(name)
            opened = ear.Recording(name)
            odometry = ear.Odometry(opened.calibration)
            seen = []

            def on_frame(t_ns, estimate):
                seen.append((t_ns, estimate, odometry.health.status))  # it may ask who calls it
                if len(seen) == 5:
                    raise KeyError("enough")

            with self.assertRaisesRegex(KeyError, "enough"):
                ear.replay(opened, odometry, on_frame)
            self.assertEqual(len(seen), 5)
            self.assertGreater(odometry.input_counts.imu.accepted, 0)  # it is free again

    def test_program_words_where_nothing_can_be_judged(self):
        with self.assertRaises(RuntimeError) as caught:
            ear.evaluate("/nowhere/estimate", "/nowhere/truth")
        program = subprocess.run([PROGRAM, "evaluate", "/nowhere/estimate", "/nowhere/truth"], capture_output=True,
                                 text=True, check=False)
        self.assertTrue("/nowhere/" in str(caught.exception) and "/nowhere/" in program.stderr)


if __name__ == "__main__":
    unittest.main()
