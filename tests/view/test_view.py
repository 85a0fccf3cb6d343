"""The view under a real run: viewers change no estimate, and a browser shows what is in the run's files.

test_view.py EAR_PROGRAM SCRATCH [TEST...]. The browser is Debian's chromium, led by playwright-core from npm's registry;
without them its test is skipped.
"""

import csv
import json
import math
import os
import re
import shutil
import socket
import subprocess
import sys
import threading
import time
import unittest
import urllib.request
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))
from temporary_folder import InTemporaryFolder

PROGRAM = Path(sys.argv.pop(1)).resolve()
SCRATCH = Path(sys.argv.pop(1)).resolve()
HERE = Path(__file__).resolve().parent

SIMULATED = ["fly1", "--seed", 842, "--duration", 16, "--camera-rate", 10]  # it takes off after 7 s


class Run:
    """`ear run --view` in the background."""

    def __init__(self, recording, out, *options):
        command = [PROGRAM, "run", recording, "--out", out, "--view", 0, *options]
        self.process = subprocess.Popen([*map(str, command)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        line = self.process.stderr.readline()
        self.url = re.fullmatch(r"view: (http://127\.0\.0\.1:\d+/\S*)\n", line)[1]
        self.port = int(re.search(r":(\d+)/", self.url)[1])

    def end(self):
        output, errors = self.process.communicate(timeout=300)
        if self.process.returncode != 0:
            raise AssertionError(errors)
        return output


def reader(run, name, stop):
    """A viewer that follows: as the page does it."""
    last = 0
    while not stop.is_set():
        try:
            with urllib.request.urlopen(f"{run.url}moments?viewer={name}&n={last}", timeout=5) as answer:
                moments = json.load(answer)["moments"]
            if moments:
                last = moments[-1]["n"]
                urllib.request.urlopen(f"{run.url}image?viewer={name}&n={last}", timeout=5).read()
        except OSError:
            return  # the run has ended
        time.sleep(0.1)


class SimulatedRecording(InTemporaryFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.recording = cls.work / "flight"
        subprocess.run([*map(str, [PROGRAM, "simulate", *SIMULATED, "--out", cls.recording])], capture_output=True, check=True)


class Viewers(SimulatedRecording):
    def run_with(self, viewers):
        """The bytes of the run's files with so many viewers, of which the last one never reads."""
        out = self.work / f"with-{viewers}"
        run = Run(self.recording, out, "--real-time")
        stop = threading.Event()
        threads = [threading.Thread(target=reader, args=(run, f"v{i}", stop)) for i in range(viewers - (viewers > 1))]
        for thread in threads:
            thread.start()
        with socket.create_connection(("127.0.0.1", run.port)) as deaf:
            if viewers > 1:
                time.sleep(2)
                deaf.sendall(b"GET /image?viewer=deaf&n=1 HTTP/1.1\r\nHost: localhost\r\n\r\n" * 2000)
            output = run.end()
        stop.set()
        for thread in threads:
            thread.join()
        counts = {what: int(n) for n, what in re.findall(r"(\d+) ([a-z ]+)", output.split("view: ")[1])}
        return {name: (out / name).read_bytes() for name in ("estimate.tum", "states.csv")}, counts

    def test_no_estimate_changes(self):
        subprocess.run([PROGRAM, "run", self.recording, "--out", self.work / "without"], capture_output=True, check=True)
        without = {name: (self.work / "without" / name).read_bytes() for name in ("estimate.tum", "states.csv")}
        self.assertGreater(len(without["states.csv"]), 50_000)
        for viewers in (0, 1, 8):
            with self.subTest(viewers=viewers):
                files, counts = self.run_with(viewers)
                self.assertEqual(files, without)
                if viewers == 0:
                    self.assertEqual(counts["requests answered"], 0)
                if viewers == 1:
                    self.assertGreater(counts["requests answered"], 50)
                if viewers == 8:
                    self.assertGreater(counts["requests answered"], 300)
                    self.assertEqual(counts["cut off"], 1)


class Options(SimulatedRecording):
    def refused(self, *options):
        command = [PROGRAM, "run", self.recording, "--out", self.work / "refused", *options]
        done = subprocess.run([*map(str, command)], capture_output=True, text=True, check=False)
        self.assertNotEqual(done.returncode, 0)
        return done.stderr

    def test_words(self):
        self.assertIn("view: others can reach 0.0.0.0, so a token is needed", self.refused("--view", 0, "--view-address", "0.0.0.0"))
        self.assertIn("at least 8 letters", self.refused("--view", 0, "--view-token", "short"))
        self.assertIn("--view", self.refused("--real-time"))
        with socket.create_server(("127.0.0.1", 0)) as taken:
            port = taken.getsockname()[1]
            self.assertIn(f"view: cannot listen on 127.0.0.1:{port}", self.refused("--view", port))

    def test_token(self):
        run = Run(self.recording, self.work / "token", "--view-token", "correct-horse-9", "--view-hold", 3)
        self.assertTrue(run.url.endswith("?token=correct-horse-9"))
        with urllib.request.urlopen(run.url, timeout=5) as answer:
            self.assertEqual(answer.status, 200)
        with self.assertRaisesRegex(urllib.error.HTTPError, "401"):
            urllib.request.urlopen(run.url.split("?")[0], timeout=5)
        run.end()


def browser_or_reason():
    """The environment with which look.mjs finds its browser, or the reason why there is none."""
    chromium = shutil.which("chromium")
    if not chromium:
        return None, "no chromium here; Debian's package chromium"
    if not shutil.which("npm") or not shutil.which("node"):
        return None, "no Node.js and npm here"
    shutil.copytree(HERE / "browser", SCRATCH, dirs_exist_ok=True)
    if not (SCRATCH / "node_modules/playwright-core").is_dir():
        try:
            done = subprocess.run(["npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund"], cwd=SCRATCH,
                                  stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False, timeout=240)
        except subprocess.TimeoutExpired:
            return None, "npm's registry does not answer"
        if done.returncode != 0:
            return None, "npm could not install playwright-core: " + done.stderr[-300:]
    return {**os.environ, "CHROMIUM": chromium}, ""


class Browser(SimulatedRecording):
    def look(self):
        environment, reason = browser_or_reason()
        if environment is None:
            self.skipTest(reason)
        out = self.work / "seen"
        run = Run(self.recording, out, "--real-time", "--view-hold", 15)
        done = subprocess.run(["node", "look.mjs", run.url, SCRATCH, "13"], cwd=SCRATCH, env=environment, capture_output=True,
                              text=True, check=False)
        run.end()
        self.assertEqual(done.returncode, 0, done.stderr)
        with (out / "states.csv").open(encoding="utf-8") as file:
            rows = {row["t_ns"]: row for row in csv.DictReader(file)}
        return json.loads(done.stdout), rows

    def compare(self, seen, rows):
        """The numbers that a person reads are those of the file at that time."""
        row, state = rows[seen["t"]], seen["state"]
        for axis in "xyz":
            self.assertEqual(state[f"position {axis}"], f"{float(row[f'p_{axis}']):.3f} m")
        speed = math.hypot(*(float(row[f"v_{axis}"]) for axis in "xyz"))
        self.assertAlmostEqual(float(state["speed"].split()[0]), speed, delta=0.006)
        self.assertAlmostEqual(float(state["sigma, vertical"].split()[0]), 100 * math.sqrt(float(row["cov_z_z"])), delta=0.06)
        self.assertEqual(state["quality"], f"{row['quality']} of 100")
        self.assertEqual(seen["health"].replace(",", ";"), row["health"])
        self.assertIn(f"{row['tracks']} features, {row['stereo']} by both cameras; {row['features_used']} used", seen["features"])
        mode = {"standing": "standing", "rolling": "on the ground", "free": "in the air"}[row["mode"]]
        self.assertEqual(seen["contact"], mode)

    def test_page(self):
        seen, rows = self.look()
        self.assertEqual(seen["console"], [])
        self.assertEqual(len(set(seen["requests"])), 1, "all from the program itself")
        self.assertLess(seen["bytes"], 300_000)
        controls = ("above", "perspective", "pause", "scrub")  # between them parts that scroll, if they do
        self.assertEqual(tuple(name for name in seen["reached"] if name in controls)[:4], controls)
        for moment in ("paused", "narrow", "scrubbed", "live"):
            with self.subTest(moment=moment):
                self.compare(seen[moment], rows)
        self.assertEqual(seen["paused"]["contact"], "in the air")
        self.assertTrue(seen["still"])
        self.assertTrue(seen["turned"])
        self.assertTrue(seen["right"])
        self.assertGreater(seen["pixels"]["right"], 100)
        back = (int(seen["paused"]["t"]) - int(seen["scrubbed"]["t"])) * 1e-9
        self.assertTrue(2.0 < back < 8.0, back)  # 30 moments: 3 s where none is dropped
        self.assertGreater(int(seen["live"]["t"]), int(seen["paused"]["t"]))
        self.assertEqual(seen["paused"]["sources"], 9)
        self.assertIn("tracking", seen["paused"]["events"])
        for canvas in ("above", "perspective"):  # ground, flight, truth, beams, ellipse
            for name, count in seen["pixels"][canvas].items():
                self.assertGreater(count, 15, f"{name} of {canvas}")
        self.assertGreater(seen["pixels"]["sky"], 100)  # features not tested yet,
        self.assertGreater(seen["pixels"]["yellow"], 100)  # those that updated the filter,
        self.assertGreater(seen["pixels"]["age"], 50)  # and the colours of the age, on request
        self.assertGreater(seen["uses"][0], 10)
        self.assertGreater(seen["uses"][1], 10)
        self.assertGreater(seen["pixels"]["error"], 50)
        self.assertLessEqual(seen["overflow"], 0, "a telephone's screen is wide enough")
        self.assertTrue((SCRATCH / "wide.png").stat().st_size > 30_000 and (SCRATCH / "narrow.png").stat().st_size > 20_000)


if __name__ == "__main__":
    unittest.main()
