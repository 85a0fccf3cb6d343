"""What the documentation shows is what works. test_documentation.py ROOT EAR_PROGRAM [TEST...]

- README.md: its console blocks run, in order, in an empty folder; its C++ example is the file that a test builds.
- Every page: its links lead somewhere, to a heading where they name one, and the options in its console blocks exist.
- The index names every page, and no line but a table's is too long to read beside the code.
Commands that take long stand in blocks called sh.
"""

import os
import re
import shlex
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(sys.argv.pop(1)).resolve()
PROGRAM = Path(sys.argv.pop(1)).resolve()
README = ROOT / "README.md"
LONGEST_LINE = 160
PAGES = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").rglob("*.md"))]


def blocks(page, language):
    return re.findall(rf"^```{language}\n(.*?)^```", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)


def commands(page):
    """The commands of a page's console blocks; a line that ends in a backslash goes on in the next."""
    lines = "".join(blocks(page, "console")).replace("\\\n", " ").splitlines()
    return [line[2:] for line in lines if line.startswith("$ ")]


def anchors(page):
    """What a link can name in a page: its headings as GitHub writes them."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return [re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings]


class Documentation(unittest.TestCase):
    def test_links(self):
        for page in PAGES:
            for link, anchor in re.findall(r"\]\(([^)#\s]*)(?:#([^)\s]+))?\)", page.read_text(encoding="utf-8")):
                if "://" in link:
                    continue
                with self.subTest(page=page.name, link=link, anchor=anchor):
                    target = page.parent / link if link else page
                    self.assertTrue(target.exists())
                    if anchor:
                        self.assertIn(anchor, anchors(target))

    def test_index_names_every_page(self):
        index = (ROOT / "docs/README.md").read_text(encoding="utf-8")
        for page in sorted((ROOT / "docs").rglob("*.md")):
            if page.name != "README.md":
                self.assertIn(f"({page.relative_to(ROOT / 'docs')})", index)

    def test_named_files_exist(self):
        folders = "|".join(sorted(path.name for path in ROOT.iterdir() if path.is_dir() and path.name != "build"))
        for page in PAGES:
            for name in re.findall(rf"`((?:{folders})/[\w./-]*)`", page.read_text(encoding="utf-8")):
                with self.subTest(page=page.name, name=name):
                    self.assertTrue((ROOT / name).exists())

    def test_lines_fit(self):
        for page in PAGES:
            for number, line in enumerate(page.read_text(encoding="utf-8").splitlines(), start=1):
                if not line.lstrip().startswith("|"):
                    with self.subTest(page=page.name, line=number):
                        self.assertLessEqual(len(line), LONGEST_LINE)

    def test_embedding_example(self):
        example = (ROOT / "tests/tools/consumer/embed_odometry.cpp").read_text(encoding="utf-8")
        self.assertEqual(blocks(README, "cpp"), [example])

    def test_options_exist(self):
        for page in PAGES:
            for command in commands(page):
                words = shlex.split(command, comments=True)
                if words[0] != "ear" or words[1].startswith("-"):
                    continue
                answer = subprocess.run([PROGRAM, words[1], "--help"], capture_output=True, text=True, check=False)
                for option in (word for word in words[2:] if word.startswith("--")):
                    with self.subTest(page=page.name, command=command):
                        self.assertRegex(answer.stdout, rf"{option}\b")


class ReadmeCommands(unittest.TestCase):
    def test_console_blocks_run(self):
        self.assertTrue(commands(README))
        environment = {**os.environ, "PATH": f"{PROGRAM.parent}:{os.environ['PATH']}"}
        with tempfile.TemporaryDirectory() as folder:
            for command in commands(README):
                done = subprocess.run(command, shell=True, cwd=folder, env=environment, stdin=subprocess.DEVNULL,
                                      capture_output=True, text=True, check=False)
                self.assertEqual(done.returncode, 0, done)


if __name__ == "__main__":
    unittest.main()
