"""ear experiments, small: it measures, goes on where it was interrupted, and says the same in every form.

test_experiments.py EAR_PROGRAM [TEST...]
"""

import json
import re
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

PROGRAM = Path(sys.argv.pop(1)).resolve()
SMALL = ["--only", "flat1,sway1", "--duration", "6", "--tracks", "--seeds", "2"]


def command(out, options):
    return [PROGRAM, "experiments", *options, "--out", str(out)]


def run(out, options):
    return subprocess.run(command(out, options), capture_output=True, text=True, check=False)


def measured(done):
    """How many runs it says that it made, and of how many."""
    return tuple(int(number) for number in re.match(r"(\d+) of (\d+) runs measured", done.stdout).groups())


def results(out):
    return {file.name: file.stat().st_mtime_ns for file in (out / "runs").glob("*.json")}


def markdown_tables(text):
    """{identifier: [[cell, ...], ...]} without heading."""
    tables = {}
    for part in re.split(r"^## Table ", text, flags=re.MULTILINE)[1:]:
        lines = [line for line in part.splitlines() if line.startswith("|")]
        tables[part.split(".")[0]] = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]
    return tables


class Tracks(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.out = Path(folder.name) / "out"

    def test_measures_once(self):
        first = run(self.out, SMALL)
        self.assertEqual(first.returncode, 0, first.stderr)
        made, _ = measured(first)
        self.assertGreater(made, 8)
        before = results(self.out)
        self.assertEqual(len(before), made)
        pages = {name: (self.out / name).read_text() for name in ("results.md", "results.json", "report.html")}

        self.assertEqual(measured(run(self.out, SMALL))[0], 0)
        self.assertEqual(results(self.out), before)
        for name, text in pages.items():
            self.assertEqual((self.out / name).read_text(), text)

        # One seed more: what is there stays.
        more = run(self.out, [*SMALL[:-1], "3"])
        self.assertEqual(measured(more)[0], made // 2)
        self.assertEqual({name: results(self.out)[name] for name in before}, before)

    def test_interrupted_goes_on(self):
        many = [*SMALL[:-1], "50"]  # so that it is not done before it is interrupted
        process = subprocess.Popen(command(self.out, many), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        deadline = time.monotonic() + 120
        while not results(self.out) and time.monotonic() < deadline:
            time.sleep(0.01)
        process.send_signal(signal.SIGKILL)
        process.wait()
        before = results(self.out)
        self.assertTrue(before)
        self.assertFalse((self.out / "results.md").exists())

        done = run(self.out, SMALL)
        self.assertEqual(done.returncode, 0, done.stderr)
        after = results(self.out)
        self.assertEqual(measured(done)[0], len(after) - len(before))
        self.assertEqual({name: after[name] for name in before}, before)

    def test_forms_agree(self):
        run(self.out, SMALL)
        said = json.loads((self.out / "results.json").read_text())
        tables = markdown_tables((self.out / "results.md").read_text())
        page = (self.out / "report.html").read_text()
        self.assertEqual([table["id"] for table in said["tables"]], list(tables))
        self.assertEqual(said["seeds"], [1, 2])
        compared = 0
        for table in said["tables"]:
            for row, cells in zip(table["rows"], tables[table["id"]], strict=True):
                self.assertEqual(cells[:1 + len(row["printed"])], [row["label"], *row["printed"]])
                for value, cell in zip(row["ours"], cells[1 + len(row["printed"]):], strict=True):
                    self.assertIn(f"<td>{cell}</td>", page)
                    if value["median"] is None:
                        self.assertTrue(cell.startswith("-"))
                        continue
                    self.assertAlmostEqual(float(cell.split()[0]), value["median"],
                                           delta=6e-5 + 6e-3 * abs(value["median"]))
                    compared += 1
        self.assertGreater(compared, 15)
        self.assertIn("<h2>sway1</h2>", page)
        self.assertNotRegex(page, r"(src|href)=")  # nothing from elsewhere

    def test_ablation(self):
        done = run(self.out, ["--ablation", "--only", "flat1", "--duration", "6", "--seeds", "1", "--tracks"])
        self.assertEqual(done.returncode, 0, done.stderr)
        said = json.loads((self.out / "results.json").read_text())
        default = said["tables"][0]["rows"][0]
        self.assertEqual([value["median"] for value in default["ours"]], [1.0] * 4)

    def test_refuses(self):
        for options, message in [
            (["--only", "flat9"], "no sequence 'flat9'; there are flat1"),
            (["--seeds", "0"], "--seeds"),
            (["--duration", "-1"], "--duration"),
            (["--out", "/dev/null/x", "--tracks"], "/dev/null"),
        ]:
            with self.subTest(options=options):
                done = subprocess.run([PROGRAM, "experiments", *options], capture_output=True, text=True, check=False)
                self.assertNotEqual(done.returncode, 0)
                self.assertIn(message, done.stderr + done.stdout)


class Images(unittest.TestCase):
    def test_renders_once(self):
        options = ["--only", "sway1", "--duration", "2.5", "--seeds", "1"]
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder)
            # A recording that was interrupted begins anew.
            first = run(out, options)
            self.assertEqual(first.returncode, 0, first.stderr)
            (recording,) = (out / "recordings").iterdir()
            image = next((recording / "mav0/cam0/data").iterdir())
            made = image.stat().st_mtime_ns
            for file in list((out / "runs").glob("*.json"))[:1]:
                file.unlink()
            self.assertEqual(measured(run(out, options))[0], 1)
            self.assertEqual(image.stat().st_mtime_ns, made)

            recording.rename(recording.with_name(recording.name + ".part"))
            for file in (out / "runs").glob("*.json"):
                file.unlink()
            self.assertEqual(run(out, [*options, "--discard-recordings"]).returncode, 0)
            self.assertEqual(list((out / "recordings").iterdir()), [])


if __name__ == "__main__":
    unittest.main()
