"""The view under a real run: viewers change no estimate, and a browser shows what is in the run's files.

test_view.py EAR_PROGRAM SCRATCH [TEST...]. The browser is Debian's chromium, led by playwright-core from npm's registry;
without them its test is skipped.
"""

import csv
import json
import math
import re
import socket
import subprocess
import sys
import threading
import time
import unittest
import urllib.request
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))
from browser import browser_or_reason
from temporary_folder import InTemporaryFolder

PROGRAM = Path(sys.argv.pop(1)).resolve()
SCRATCH = Path(sys.argv.pop(1)).resolve()
HERE = Path(__file__).resolve().parent

SIMULATED = ["fly1", "--seed", 842, "--camera-rate", 10]  # it takes off after 7 s


class Shown:
    """`ear run --view` or `ear live --view` in the background."""

    def __init__(self, *command):
        command = [PROGRAM, *command, "--view", 0]
        self.process = subprocess.Popen([*map(str, command)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        for line in self.process.stderr:
            if found := re.fullmatch(r"view: (http://127\.0\.0\.1:(\d+)/\S*)\n", line):
                self.url, self.port = found[1], int(found[2])
                return
        raise AssertionError("it does not say where it is")

    def end(self):
        """What it said."""
        output, errors = self.process.communicate(timeout=300)
        if self.process.returncode != 0:
            raise AssertionError(errors)
        return output + errors


class Run(Shown):
    def __init__(self, recording, out, *options):
        super().__init__("run", recording, "--out", out, *options)


def files_in(folder):
    return {name: (folder / name).read_bytes() for name in ("estimate.tum", "states.csv")}


def counts_in(output):
    """Of the line in which a program that ends says what its view did."""
    return {what: int(n) for n, what in re.findall(r"(\d+) ([a-z ]+)", output.split("view: ")[-1])}


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
    duration = 16  # [s]

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.recording = cls.work / "flight"
        command = [PROGRAM, "simulate", *SIMULATED, "--duration", cls.duration, "--out", cls.recording]
        subprocess.run([*map(str, command)], capture_output=True, check=True)


class Viewers(SimulatedRecording):
    def run_with(self, viewers):
        """The bytes of the run's files with so many viewers, of which the last one never reads."""
        out = self.work / f"with-{viewers}"
        pace = ["--real-time"] if viewers else []  # nobody looks: no need to wait
        run = Run(self.recording, out, *pace)
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
        return files_in(out), counts_in(output)

    def test_no_estimate_changes(self):
        subprocess.run([PROGRAM, "run", self.recording, "--out", self.work / "without"], capture_output=True, check=True)
        without = files_in(self.work / "without")
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


class Live(SimulatedRecording):
    """`ear live --view`, with a recording in place of the sensors."""

    duration = 9

    def live(self):
        config = self.work / "live.yaml"
        config.write_text("budget_ms: 0\nframe_slots: 64\n", encoding="utf-8")  # a busy machine leaves nothing out
        return "live", "--sensors", self.recording, "--config", config

    def test_page(self):
        """What the page gets is what the files have, and the estimates are those of `ear run`."""
        out = self.work / "live"
        shown = Shown(*self.live(), "--out", out)
        ask = lambda path: urllib.request.urlopen(shown.url + path + "viewer=a", timeout=5).read()
        about = json.loads(ask("about?"))
        moments, uses, images = {}, [], []
        while shown.process.poll() is None:
            last = max(moments, default=0)
            try:
                moments.update((moment["n"], moment) for moment in json.loads(ask(f"moments?n={last}&"))["moments"])
                if moments and max(moments) > last and moments[max(moments)]["image"]:
                    uses += [feature[2] for feature in json.loads(ask(f"features?n={max(moments)}&"))]
                    images.append(ask(f"image?n={max(moments)}&camera={'right' if len(images) % 2 else 'left'}&"))
            except OSError:
                break  # it has ended
            time.sleep(0.1)
        output = shown.end()
        self.assertEqual((about["title"], about["live"], about["cameras"]), ("flight", True, [[640, 480], [640, 480]]))
        with (out / "states.csv").open(encoding="utf-8") as file:
            rows = {row["t_ns"]: row for row in csv.DictReader(file)}
        there = [moment for moment in moments.values() if "state" in moment]
        self.assertGreater(len(there), 20)
        for moment in there:
            row = rows[moment["t_ns"]]
            for value, axis in zip(moment["state"]["p"], "xyz", strict=True):
                self.assertAlmostEqual(value, float(row[f"p_{axis}"]), delta=2e-6)
            self.assertEqual(moment["state"]["used"], int(row["features_used"]))
            self.assertEqual(moment["health"].replace(",", ";"), row["health"])
        self.assertTrue(all(image.startswith(b"\xff\xd8") for image in images))
        self.assertEqual(len({len(image) for image in images[:2]}), 2, "left and right")
        for use in (0, 1, 5):  # not tested yet, used before or now, used as it ended
            self.assertGreater(uses.count(use), 20, use)
        self.assertGreater(counts_in(output)["requests answered"], 60)
        subprocess.run([PROGRAM, "run", self.recording, "--out", self.work / "run"], capture_output=True, check=True)
        if "; 0 frames did not wait" not in output:
            self.skipTest("the machine was so slow that readings came late, which may change the last digits")
        self.assertEqual(files_in(out), files_in(self.work / "run"))

    def test_options(self):
        for options, words in ((("--view", 0, "--view-address", "0.0.0.0"), "others can reach 0.0.0.0, so a token is needed"),
                               (("--view", 0, "--view-token", "short"), "at least 8 letters"),
                               (("--view-token", "correct-horse-9"), "--view")):
            done = subprocess.run([*map(str, [PROGRAM, *self.live(), *options])], capture_output=True, text=True, check=False)
            self.assertNotEqual(done.returncode, 0)
            self.assertIn(words, done.stderr)


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


class Browser(SimulatedRecording):
    def look(self):
        environment, reason = browser_or_reason(HERE / "browser", SCRATCH)
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
