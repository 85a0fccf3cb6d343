"""The commands of docs/drone.md, against the simulator: those of its console block run in order, in an empty folder.

test_drone_commands.py ROOT EAR_PROGRAM [TEST...]
"""

import os
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT, PROGRAM = Path(sys.argv.pop(1)).resolve(), Path(sys.argv.pop(1)).resolve()


class Drone(unittest.TestCase):
    def test_rehearsal(self):
        page = (ROOT / "docs/drone.md").read_text(encoding="utf-8")
        commands = re.findall(r"^\$ (.*)$", "".join(re.findall(r"^```console\n(.*?)^```", page, re.DOTALL | re.MULTILINE)),
                              re.MULTILINE)
        self.assertGreater(len(commands), 3)
        environment = {**os.environ, "PATH": f"{PROGRAM.parent}:{os.environ['PATH']}"}
        with tempfile.TemporaryDirectory() as folder:
            # Those of its sh blocks are for the vehicle: here with the rehearsal in place of its sensors.
            (Path(folder) / "live.yaml").write_text("calibration: rehearsal\n", encoding="utf-8")
            on_board = re.findall(r"^ear .*$", "".join(re.findall(r"^```sh\n(.*?)^```", page, re.DOTALL | re.MULTILINE)), re.MULTILINE)
            self.assertTrue(on_board)
            commands += [c.replace("/etc/ear/", "").replace("ear live", "ear live --sensors rehearsal") for c in on_board]
            for command in commands:
                done = subprocess.run(command, shell=True, cwd=folder, env=environment, stdin=subprocess.DEVNULL,
                                      capture_output=True, text=True, check=False)
                is_check = command.endswith("--check")  # nobody lifts the vehicle here
                with self.subTest(command=command):
                    self.assertEqual(done.returncode, 1 if is_check else 0, done)
                    if is_check:
                        self.assertIn("check: stand: right", done.stderr)
                        self.assertNotIn("WRONG", done.stderr)

    def test_configurations(self):
        """Those of both pages are read without a word: what is missing is the hardware."""
        for page in ("docs/drone.md", "docs/live.md"):
            blocks = re.findall(r"^```yaml\n(.*?)^```", (ROOT / page).read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
            self.assertTrue(blocks)
            for block in blocks:
                with self.subTest(page=page, block=block), tempfile.TemporaryDirectory() as folder:
                    (Path(folder) / "estimator.yaml").write_text("", encoding="utf-8")
                    file = Path(folder) / "live.yaml"
                    file.write_text(re.sub(r"calibration: \S+", "calibration: not-there", block), encoding="utf-8")
                    done = subprocess.run([PROGRAM, "live", "--config", file], stdin=subprocess.DEVNULL, capture_output=True,
                                          text=True, check=False)
                    self.assertEqual(done.returncode, 1)
                    self.assertIn("not-there", done.stderr)  # not the configuration


if __name__ == "__main__":
    unittest.main()
