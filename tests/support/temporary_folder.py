"""For tests in Python that make files once and look at them in several tests."""

import tempfile
import unittest
from pathlib import Path


class InTemporaryFolder(unittest.TestCase):
    """`work` is a folder that goes away after the class's last test."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.work = Path(folder.name)
