"""`pip install .` works offline, with Debian's packages: test_pip.py ROOT SCRATCH [TEST...]

It compiles what the module needs, which takes minutes. Without pip and setuptools it is skipped: exit code 77.
"""

import importlib.util
import shutil
import subprocess
import sys
import unittest
from pathlib import Path

ROOT = Path(sys.argv.pop(1)).resolve()
SCRATCH = Path(sys.argv.pop(1)).resolve()


class Pip(unittest.TestCase):
    def test_install(self):
        shutil.rmtree(SCRATCH, ignore_errors=True)
        command = [sys.executable, "-m", "pip", "install", "--no-index", "--no-build-isolation", "--no-deps", "--quiet",
                   "--target", SCRATCH, ROOT]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr[-3000:])
        answer = subprocess.run([sys.executable, "-c", "import ear; print(ear.__version__, ear.__file__)"], cwd=SCRATCH,
                                env={"PYTHONPATH": str(SCRATCH)}, capture_output=True, text=True, check=True).stdout
        self.assertIn(str(SCRATCH), answer)
        self.assertTrue((SCRATCH / "ear/__init__.pyi").is_file())
        self.assertTrue((SCRATCH / "ear/py.typed").is_file())


if __name__ == "__main__":
    for needed in ("pip", "setuptools", "wheel"):
        if importlib.util.find_spec(needed) is None:
            print(f"skipped: no {needed} here; Debian's python3-{needed}")
            sys.exit(77)
    unittest.main()
