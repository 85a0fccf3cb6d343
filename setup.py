"""`pip install .`: builds the Python module `ear` by CMake. Offline, with Debian's packages alone:
`pip install --no-build-isolation --no-deps .` (docs/python.md)."""

import os
import re
import subprocess
import sys
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

ROOT = Path(__file__).resolve().parent
VERSION = re.search(r"project\(ear VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text(encoding="utf-8"))[1]


class CMakeBuild(build_ext):
    def build_extension(self, ext):
        build = Path(self.build_temp).resolve()
        installed = build / "installed"
        subprocess.run(["cmake", "-S", ROOT, "-B", build, "-DCMAKE_BUILD_TYPE=Release", "-DEAR_BUILD_TESTS=OFF",
                        "-DEAR_WITH_PYTHON=ON", f"-DEAR_PYTHON={sys.executable}", "-DEAR_PYTHON_DIR=.",
                        f"-DCMAKE_INSTALL_PREFIX={installed}", *os.environ.get("EAR_CMAKE_OPTIONS", "").split()], check=True)
        subprocess.run(["cmake", "--build", build, "--target", "ear_python", "--parallel",
                        os.environ.get("CMAKE_BUILD_PARALLEL_LEVEL", "2")], check=True)
        subprocess.run(["cmake", "--install", build, "--component", "python"], check=True)
        target = Path(self.get_ext_fullpath(ext.name)).resolve()
        target.parent.mkdir(parents=True, exist_ok=True)
        (module,) = (installed / "ear").glob("_ear*.so")
        self.copy_file(str(module), str(target))


setup(
    name="ear-msckf",
    version=VERSION,
    description="Localisation of vehicles that drive and fly, from cameras, IMU, wheels and lasers",
    packages=["ear"],
    package_dir={"": "python"},
    package_data={"ear": ["*.pyi", "py.typed"]},
    ext_modules=[Extension("ear._ear", sources=[])],
    cmdclass={"build_ext": CMakeBuild},
    install_requires=["numpy"],
    python_requires=">=3.9",
    zip_safe=False,
)
