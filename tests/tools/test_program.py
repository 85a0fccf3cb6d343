"""The ear program from outside: what it says to a wrong command line, and the way from a simulation to a result.

test_program.py EAR_PROGRAM [TEST...]
"""

import csv
import json
import os
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

PROGRAM = Path(sys.argv.pop(1)).resolve()


def ear(*arguments, folder=None, environment=None):
    command = [str(PROGRAM), *map(str, arguments)]
    return subprocess.run(command, cwd=folder, env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)


POSE = "T_BS: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n"
STANDING = {  # of a sensor: period [ms], what follows the stamp, sensor.yaml
    "imu0": (5, "0.001,0.002,0.003,0.1,0.2,9.8", POSE + "rate_hz: 200\ngyroscope_noise_density: 1e-3\n"
             "gyroscope_random_walk: 2e-5\naccelerometer_noise_density: 1e-2\naccelerometer_random_walk: 3e-4\n"),
    "encoder0": (10, "100,100", POSE + "rate_hz: 100\nresolution: 262144\nwraps: true\nwheel_radius: [0.075, 0.075]\n"
                 "wheel_separation: 0.4\nnoise_counts: 2.0\n"),
    "laser0": (20, "0.075", "rate_hz: 50\nbeams:\n  - {name: rear, origin: [0, 0, 0], direction: [0, 0, -1]}\n"
               "range: [0.02, 4.0]\nnoise: 0.004\n"),
}


def write_standing(recording, *sensors):
    """Three seconds of a vehicle that stands, without a camera."""
    for sensor in sensors:
        period_ms, row, calibration = STANDING[sensor]
        folder = recording / "mav0" / sensor
        folder.mkdir(parents=True)
        stamps = range(0, 3_000_000_000, period_ms * 1_000_000)
        rows = "".join(f"{stamp},{row}\n" for stamp in stamps)
        (folder / "data.csv").write_text("#timestamp [ns],...\n" + rows, encoding="utf-8")
        (folder / "sensor.yaml").write_text(calibration, encoding="utf-8")


class CommandLine(unittest.TestCase):
    def assert_refused(self, result, message):
        """An exit code of its own making (a signal's is negative), and the reason on the error stream."""
        self.assertGreater(result.returncode, 0, result)
        self.assertIn(message, result.stderr)

    def test_help(self):
        self.assertEqual(ear("--help").returncode, 0)
        for subcommand in ("run", "simulate", "evaluate", "check", "bench", "export", "experiments"):
            self.assertIn(subcommand, ear("--help").stdout)
            self.assertEqual(ear(subcommand, "--help").returncode, 0)

    def test_version(self):
        result = ear("--version")
        self.assertEqual(result.returncode, 0)
        self.assertRegex(result.stdout, r"\Aear \d+\.\d+\.\d+, commit ([0-9a-f]{12}(-changed)?|unknown)\n"
                                        r"kernels: (\w+) \(here are( \w+)*\)\noptional parts:( \w+)+\n\Z")
        first = re.search(r"here are (\w+)", result.stdout)[1]
        environment = {**os.environ, "EAR_KERNELS": first}
        self.assertIn(f"kernels: {first} (", ear("--version", environment=environment).stdout)
        environment["EAR_KERNELS"] = "mmx"
        for command in (("bench", "."), ("live", "--sensors", ".")):
            self.assert_refused(ear(*command, environment=environment), 'EAR_KERNELS: no kernels are called "mmx"')

    def test_no_arguments(self):
        self.assert_refused(ear(), "subcommand")

    def test_unknown_subcommand(self):
        self.assert_refused(ear("dance"), 'no subcommand "dance"; there are run, ')

    def test_unknown_option(self):
        self.assert_refused(ear("run", "recording", "--dance"), "--dance")

    def test_missing_recording(self):
        with tempfile.TemporaryDirectory() as folder:
            missing = Path(folder) / "missing"
            self.assert_refused(ear("run", missing, "--out", Path(folder) / "out"), str(missing))
            self.assert_refused(ear("evaluate", missing, missing), str(missing))

    def test_bench_compares_only_with_its_own(self):
        with tempfile.TemporaryDirectory() as folder:
            other = Path(folder) / "other.json"
            for text in ("{}", "not JSON"):
                other.write_text(text, encoding="utf-8")
                for what in (folder, "--suite"):
                    self.assert_refused(ear("bench", what, "--compare", other), f"{other}: not the output of ear bench")

    def test_bench_takes_a_recording_or_the_suite(self):
        for arguments in ((), (".", "--suite")):
            self.assert_refused(ear("bench", *arguments), "bench: give either RECORDING or --suite")
        self.assert_refused(ear("bench", ".", "--repeat", "2"), "--suite")

    def test_check_reports_a_missing_recording(self):
        result = ear("check", "missing")  # its findings are its output, not an error of the program
        self.assertEqual(result.returncode, 2)
        self.assertIn("missing: no such folder", result.stdout)

    def test_check_and_run_refuse_the_same(self):
        """Inertial samples and lasers alone; and settings that the estimator does not take."""
        with tempfile.TemporaryDirectory() as folder:
            recording, out = Path(folder) / "recording", Path(folder) / "out"
            write_standing(recording, "imu0", "laser0")
            reason = "neither a camera nor wheels"
            self.assert_refused(ear("run", recording, "--out", out), reason)
            result = ear("check", recording)
            self.assertEqual(result.returncode, 2, result)
            self.assertIn(reason, result.stdout)

            write_standing(recording, "encoder0")
            self.assertEqual(ear("check", recording).returncode, 0)
            config = Path(folder) / "config.yaml"
            config.write_text("filter:\n  window: 1\n", encoding="utf-8")
            self.assert_refused(ear("run", recording, "--out", out, "--config", config), "filter.window")
            result = ear("check", recording, "--config", config)
            self.assertEqual(result.returncode, 2, result)
            self.assertIn("filter.window", result.stdout)

    def test_learned_calibration_is_in_the_summary(self):
        with tempfile.TemporaryDirectory() as folder:
            recording, out = Path(folder) / "recording", Path(folder) / "out"
            write_standing(recording, "imu0", "laser0", "encoder0")
            self.assertEqual(ear("run", recording, "--out", out).returncode, 0)
            calibration = json.loads((out / "summary.json").read_text(encoding="utf-8"))["calibration"]
            self.assertEqual(len(calibration["T_BO"]), 16)
            self.assertEqual([beam["name"] for beam in calibration["beams"]], ["rear"])
            self.assertNotIn("T_BC0", calibration)

    def test_log(self):
        with tempfile.TemporaryDirectory() as folder:
            recording, out, log = Path(folder) / "recording", Path(folder) / "out", Path(folder) / "log.txt"
            write_standing(recording, "imu0", "encoder0")
            with (recording / "mav0/encoder0/data.csv").open("a", encoding="utf-8") as file:
                file.write("torn")
            run = ("run", recording, "--out", out)
            quiet = ear(*run, "--log-file", log)  # after the subcommand, as its own options
            self.assertEqual(quiet.returncode, 0, quiet)
            self.assertRegex(quiet.stderr, r"^ear: warning: encoder0: torn last line, 1 times, first at .*data.csv:\d+")
            self.assertNotIn("tracking", quiet.stderr)
            self.assertRegex(log.read_text(encoding="utf-8"), r"(?m)^20\S+ \S+ info: at \S+ s: tracking$")
            self.assertIn("info: at", ear("--log-level", "info", *run).stderr)
            self.assertEqual(ear(*run, "--log-level", "error").stderr, "")
            self.assert_refused(ear("--log-level", "error", "run", "missing"), "ear: error: missing")
            self.assert_refused(ear(*run, "--log-level", "loud"), "--log-level")
            self.assert_refused(ear(*run, "--log-file", log / "below"), "cannot be written")

    def test_unknown_sequence(self):
        with tempfile.TemporaryDirectory() as folder:
            self.assert_refused(ear("simulate", "moon1", "--out", Path(folder) / "out"), "moon1")


class EndToEnd(unittest.TestCase):
    def run_ear(self, *arguments):
        result = ear(*arguments)
        self.assertEqual(result.returncode, 0, result)
        return result.stdout

    def test_shortest_suite(self):
        with tempfile.TemporaryDirectory() as folder:
            old = Path(folder) / "before.json"
            suite = ("bench", "--suite", "--folder", folder, "--recordings", "standing", "--rates", "10", "--features", "20,40",
                     "--seconds", "0.8", "--repeat", "1")
            old.write_text(self.run_ear(*suite, "--json"), encoding="utf-8")
            cells = json.loads(old.read_text(encoding="utf-8"))["suite"]
            self.assertEqual([(cell["recording"], cell["rate_hz"], cell["features"]) for cell in cells],
                             [("standing", 10, 20), ("standing", 10, 40)])
            for cell in cells:
                self.assertEqual(cell["frames"], 8)
                means = {figure["name"]: figure["value"] for figure in cell["figures"]}
                self.assertGreater(means["pipeline"], 0.0)
            made = Path(folder) / "standing_10hz" / "simulation.yaml"
            written = made.stat().st_mtime_ns
            self.assertIn("standing", self.run_ear(*suite, "--compare", old))
            self.assertEqual(made.stat().st_mtime_ns, written, "the recording was made again")

    def check_bench(self, recording, old):
        old.write_text(self.run_ear("bench", recording, "--json"), encoding="utf-8")
        figures = json.loads(old.read_text(encoding="utf-8"))
        stages = {stage["name"]: stage for stage in figures["stages_ms"]}
        self.assertGreater(figures["frames"], 150)
        for name in ("floor", "pipeline", "read", "track", "filter", "samples"):
            self.assertGreater(stages[name]["mean"], 0.0, name)
        self.assertGreater(figures["peak_memory_mb"], 5.0)
        text = self.run_ear("bench", recording, "--compare", old)
        self.assertRegex(text, r"pipeline +\d+\.\d+ +\d+\.\d+ +[+-]\d+\.\d %")
        self.assertRegex(text, r"\n\| [^|]+ \| \d+ \| \d+ \| \w+ \| \w+ \| recording \| 150 \|( \d+\.\d\d \|){3} \S+ \|\n\Z")

    def check_smoother(self, recording, output):
        if "{filter,smoother}" not in ear("run", "--help").stdout:
            return  # built without Ceres
        self.run_ear("run", recording, "--estimator", "smoother", "--out", output)
        figures = json.loads(self.run_ear("evaluate", output, recording, "--json"))["estimates"][0]
        self.assertGreater(figures["coverage"], 0.7)
        self.assertLess(figures["ate_rmse_m"], 0.02)

    def test_from_simulation_to_report(self):
        with tempfile.TemporaryDirectory() as folder:
            recording, output, report = (Path(folder) / name for name in ("recording", "output", "report.html"))
            self.run_ear("simulate", "flat1", "--seed", "5", "--duration", "6", "--out", recording)
            self.run_ear("check", recording)
            self.run_ear("run", recording, "--out", output)
            self.check_bench(recording, Path(folder) / "bench.json")
            self.check_smoother(recording, Path(folder) / "smoothed")
            evaluation = json.loads(self.run_ear("evaluate", output, recording, "--json", "--report", report))

            with (output / "states.csv").open(encoding="utf-8") as states:
                rows = list(csv.DictReader(states))
            poses = (output / "estimate.tum").read_text(encoding="utf-8").splitlines()
            self.assertGreater(len(rows), 120)
            self.assertEqual(len(rows), sum(not pose.startswith("#") for pose in poses))
            self.assertEqual(json.loads((output / "summary.json").read_text())["counts"]["estimates"], len(rows))
            self.assertIn("<svg", report.read_text(encoding="utf-8"))
            figures = evaluation["estimates"][0]
            self.assertGreater(figures["coverage"], 0.7)  # after about a second of standing
            self.assertGreater(figures["length_m"], 1.0)
            self.assertLess(figures["ate_rmse_m"], 0.02)
            self.assertLess(figures["ground"]["z_rmse_m"], 0.02)
            self.assertLess(figures["ground"]["slope_along"]["rmse_deg"], 2.0)
            self.check_switch("motion_prediction", recording, Path(folder), (output / "estimate.tum").read_text())

    def check_switch(self, setting, recording, folder, estimate):
        """A setting of the front end that is true by default reaches it."""
        config = folder / "switched.yaml"
        config.write_text(f"frontend:\n  {setting}: false\n", encoding="utf-8")
        self.run_ear("run", recording, "--config", config, "--out", folder / "switched")
        switched = (folder / "switched" / "estimate.tum").read_text(encoding="utf-8")
        self.assertNotEqual(switched, estimate)
        self.assertEqual(len(switched.splitlines()), len(estimate.splitlines()))


if __name__ == "__main__":
    unittest.main()
