"""The report of a flight: one file with what the camera saw at take-off, strike and landing, and a drawing that turns.

test_report_page.py EAR_PROGRAM CLIPS SCRATCH [TEST...]. Without the clip `hop` in CLIPS it is skipped, and without a browser
its last test.
"""

import base64
import json
import re
import subprocess
import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))
from browser import browser_or_reason
from temporary_folder import InTemporaryFolder

PROGRAM = Path(sys.argv.pop(1)).resolve()
HOP = Path(sys.argv.pop(1)).resolve() / "hop"
SCRATCH = Path(sys.argv.pop(1)).resolve()
SCRIPTS = Path(__file__).resolve().parents[1] / "view/browser"


@unittest.skipUnless(HOP.is_dir(), "no clip `hop`")
class Report(InTemporaryFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.file = cls.work / "report.html"
        cls.ear("run", HOP, "--out", cls.work / "run")
        cls.ear("evaluate", cls.work / "run", HOP, "--report", cls.file)
        cls.text = cls.file.read_text(encoding="utf-8")
        moments = re.findall(r'<li>(?:<img alt="[^"]*" src="data:image/jpeg;base64,([^"]*)">)?<b>(\S+) s</b> (.*)</li>', cls.text)
        cls.moments = [(words, float(t), base64.b64decode(image)) for image, t, words in moments]

    @staticmethod
    def ear(*arguments):
        subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, check=True)

    def test_moments(self):
        """The vehicle leaves the ground after 12.7 s of the 41 s, and comes back after 25.6 s."""
        times = {words.split(":")[0]: t for words, t, _ in self.moments}
        self.assertTrue({"start", "take-off", "strike", "landing", "end"} <= times.keys(), times)
        self.assertAlmostEqual(times["take-off"], 12.7, delta=0.5)
        self.assertAlmostEqual(times["landing"], 25.6, delta=0.5)
        self.assertAlmostEqual(times["strike"], times["landing"], delta=0.5)
        self.assertEqual(sorted(t for _, t, _ in self.moments), [t for _, t, _ in self.moments])
        for words, _, image in self.moments:
            self.assertTrue(image.startswith(b"\xff\xd8") and image.endswith(b"\xff\xd9"), words)

    def test_one_file(self):
        self.assertLess(self.file.stat().st_size, 5_000_000)
        self.assertNotIn("http", self.text)
        self.assertEqual(set(re.findall(r'(?:src|href)="([a-z]+:[a-z/]+)', self.text)), {"data:image/jpeg"})

    def test_truth_without_images(self):
        """A file as the truth: the moments are there, and no images."""
        report = self.work / "plain.html"
        self.ear("evaluate", self.work / "run", HOP / "mav0/state_groundtruth_estimate0/data.csv", "--report", report)
        text = report.read_text(encoding="utf-8")
        self.assertIn("</b> take-off</li>", text)
        self.assertNotIn("<img", text)

    def test_browser(self):
        environment, reason = browser_or_reason(SCRIPTS, SCRATCH)
        if environment is None:
            self.skipTest(reason)
        done = subprocess.run(["node", "report.mjs", self.file, SCRATCH], cwd=SCRATCH, env=environment, capture_output=True,
                              text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        seen = json.loads(done.stdout)
        self.assertEqual(seen["console"], [])
        self.assertLessEqual(set(seen["requests"]), {"file", "data"})
        self.assertEqual(seen["turned"], [True] * 4, "by mouse, arrow key and plus; without the truth")
        self.assertTrue(seen["back"])
        self.assertEqual(seen["images"], [400] * len(self.moments))
        self.assertLessEqual(seen["overflow"], 0)


if __name__ == "__main__":
    unittest.main()
