"""Plants faults in a small made-up project and looks at what the lint says. test_lint_python.py PYFLAKES [TEST...]"""

import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))
import lint_python
from temporary_folder import InTemporaryFolder

PYFLAKES = sys.argv.pop(1)


class Lint(InTemporaryFolder):
    def said_of(self, text, name="tools/a.py"):
        file = self.work / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
        said = lint_python.lint(self.work, PYFLAKES)
        file.unlink()
        return said

    def test_faults(self):
        self.assertIn("'os' imported but unused", self.said_of("import os\n"))
        self.assertIn("undefined name 'nothing'", self.said_of("print(nothing)\n"))
        self.assertIn("invalid syntax", self.said_of("def\n"))
        self.assertIn("'os' imported but unused", self.said_of("#!/usr/bin/env python3\nimport os\n", "tools/b"))

    def test_others(self):
        self.assertEqual(self.said_of("import os\nprint(os.name)\n"), "")
        self.assertIn("no Python sources", self.said_of("import os\n", "build/a.py"))


if __name__ == "__main__":
    unittest.main()
