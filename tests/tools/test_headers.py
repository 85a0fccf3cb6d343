"""The headers of the installed package: all of the filter's, in their folders, and with each all that it includes.

test_headers.py ROOT PREFIX [TEST...]
"""

import re
import sys
import unittest
from pathlib import Path

ROOT = Path(sys.argv.pop(1)).resolve()
PREFIX = Path(sys.argv.pop(1)).resolve()

INCLUDE = re.compile(r'^\s*#\s*include\s*"([^"]+)"', re.MULTILINE)


def headers(folder):
    return {str(file.relative_to(folder)) for file in folder.rglob("*.h")}


class Headers(unittest.TestCase):
    def test_all_of_the_filter(self):
        missing = headers(ROOT / "filter") - headers(PREFIX / "include/ear-filter/filter")  # older ones may be left there
        self.assertEqual(missing, set())

    def test_what_they_include(self):
        """As the compiler looks for it: beside the header, then in the package's folders."""
        folders = {"include": "ear", "ear-filter": "filter", "ear-src": "src"}
        roots = (PREFIX / "include", PREFIX / "include/ear-filter", PREFIX / "include/ear-src")
        for root in roots:
            for file in sorted((root / folders[root.name]).rglob("*.h")):
                for include in INCLUDE.findall(file.read_text(encoding="utf-8")):
                    with self.subTest(file=file, include=include):
                        places = (file.parent, *roots)
                        self.assertTrue(any((place / include).is_file() for place in places))


if __name__ == "__main__":
    unittest.main()
