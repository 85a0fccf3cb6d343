"""The Debian package that cpack makes: what it says of itself, what is in it, and that its program runs from there.

test_debian_package.py BUILD_FOLDER CPACK VERSION [TEST...]
"""

import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))
from temporary_folder import InTemporaryFolder

BUILD = Path(sys.argv.pop(1)).resolve()
CPACK = sys.argv.pop(1)
VERSION = sys.argv.pop(1)


def output_of(*command, **options):
    return subprocess.run([*map(str, command)], capture_output=True, text=True, check=True, **options).stdout


class DebianPackage(InTemporaryFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        output_of(CPACK, "-G", "DEB", "-B", cls.work, cwd=BUILD)
        (cls.package,) = cls.work.glob("ear-msckf_*.deb")
        cls.python = next(cls.work.glob("python3-ear_*.deb"), None)

    def field(self, name):
        return output_of("dpkg-deb", "--field", self.package, name).strip()

    def test_name(self):
        architecture = output_of("dpkg", "--print-architecture").strip()
        self.assertEqual(self.package.name, f"ear-msckf_{VERSION}_{architecture}.deb")
        self.assertEqual(self.field("Version"), VERSION)
        self.assertEqual(self.field("Architecture"), architecture)

    def test_dependencies(self):
        """They are those of the program, with versions; none is a package for building."""
        depends = self.field("Depends")
        for library in (r"libc6 \(>=", r"libstdc\+\+6 \(>=", r"libopencv-video\d+", r"libyaml-cpp\d", r"libspdlog\d"):
            self.assertRegex(depends, library)
        self.assertNotIn("-dev", depends)
        for package in ("libeigen3-dev", "libopencv-dev", "libspdlog-dev"):
            self.assertIn(package, self.field("Recommends"))
        names = [re.split(r"[ |]", entry.strip())[0] for entry in depends.split(",")]
        for name in names:  # a typing error would be a package that does not exist
            with self.subTest(package=name):
                self.assertIn("installed", output_of("dpkg-query", "--show", "--showformat=${Status}", name))

    def test_contents(self):
        files = {line.split()[5] for line in output_of("dpkg-deb", "--contents", self.package).splitlines()}
        self.assertTrue(all(file.startswith("./usr/") or file in ("./", "./usr/") for file in files), files)
        for file in ("bin/ear", "include/ear/ear_c.h", "include/ear/odometry.h", "include/ear-filter/filter/filter.h",
                     "include/ear-src/src/mavlink/link.h",
                     "share/doc/ear-msckf/copyright"):
            self.assertIn(f"./usr/{file}", files)
        for ending in ("/libear.a", "/libear_filter.a", "/libear_frontend.a", "/libear_log.a", "/libear_mavlink.a",
                       "/libear_recording.a", "/libear_live.a", "/systemd/system/ear-live.service", "/cmake/ear/earConfig.cmake"):
            self.assertTrue(any(file.endswith(ending) for file in files), ending)
        self.assertFalse([file for file in files if file.endswith((".cpp", ".o", ".py"))])

    def test_python_package(self):
        if self.python is None:
            self.skipTest("the Python module is not built here")
        self.assertIn("python3-numpy", output_of("dpkg-deb", "--field", self.python, "Depends"))
        self.assertRegex(output_of("dpkg-deb", "--field", self.python, "Depends"), r"libopencv-imgproc\d+")
        with tempfile.TemporaryDirectory() as root:
            output_of("dpkg", "--extract", self.python, root)
            files = {str(file.relative_to(root)) for file in Path(root).rglob("*") if file.is_file()}
            self.assertTrue({"usr/lib/python3/dist-packages/ear/__init__.pyi", "usr/lib/python3/dist-packages/ear/py.typed",
                             "usr/share/doc/python3-ear/copyright"} <= files, files)
            self.assertTrue(all(file.startswith(("usr/lib/python3/", "usr/share/doc/python3-ear/")) for file in files))
            names = output_of("/usr/bin/python3", "-c", "import ear; print(ear.sequences(), ear.__file__)", cwd=root,
                              env={"PYTHONPATH": f"{root}/usr/lib/python3/dist-packages"})
            self.assertIn("'fly1'", names)
            self.assertIn(root, names)

    def test_program_runs_from_it(self):
        with tempfile.TemporaryDirectory() as root:
            output_of("dpkg", "--extract", self.package, root)
            self.assertIn("simulate", output_of(Path(root) / "usr/bin/ear", "--help", cwd=root))
            script = Path(root).rglob("earTargets*.cmake")
            for file in script:  # it can be moved: no path of the machine that built it
                self.assertNotIn(str(BUILD), file.read_text(encoding="utf-8"))


if __name__ == "__main__":
    unittest.main()
