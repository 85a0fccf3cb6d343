"""The program estimates agrees with itself, and compare_estimates.py sees what differs. PROGRAM is the one argument."""

import contextlib
import io
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import compare_estimates


class Compare(unittest.TestCase):
    program = None

    def compare(self, a, b):
        with tempfile.TemporaryDirectory() as folder:
            files = [Path(folder, name) for name in ("a", "b")]
            for file, text in zip(files, (a, b)):
                file.write_text(text, encoding="ascii")
            with contextlib.redirect_stdout(io.StringIO()) as output:
                return compare_estimates.main(*files), output.getvalue()

    def test_all(self):
        text = subprocess.run([self.program], check=True, capture_output=True, text=True).stdout
        lines = text.splitlines(keepends=True)
        self.assertGreater(sum(line.startswith("filter") for line in lines), 200)
        self.assertGreater(sum(line.startswith("pipeline") for line in lines), 50)
        self.assertEqual(self.compare(text, text)[0], 0)

        result, output = self.compare(text, "".join(lines[:-1]))
        self.assertEqual(result, 1)
        self.assertIn("not the same frames", output)

        words = lines[100].split()
        words[3] = str(float(words[3]) + 1e-5)  # x [m]
        result, output = self.compare(text, "".join([*lines[:100], " ".join(words) + "\n", *lines[101:]]))
        self.assertEqual(result, 1)
        self.assertIn("TOO MUCH", output)


if __name__ == "__main__":
    Compare.program = sys.argv.pop()
    unittest.main()
