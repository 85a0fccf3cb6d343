"""Which layer may include what. check(root) returns one line of text per include that its layer may not see.

Run as a program, it checks the project: layers.py ROOT.
"""

import re
import sys
from pathlib import Path

STANDARD = ["freestanding", "hosted"]  # the C++ library; the filter has only the first, see HOSTED

RECORDS = ["filter/ekf/records.h", "filter/ekf/displacement.h", "filter/ekf/gate.h", "filter/sources/cameras/frame_agreement.h"]
SOURCES = ["filter/sources/", "filter/sources/cameras/", "filter/sources/cameras/frame_agreement.h", "filter/sources/wheels/",
           "filter/sources/ground/", "filter/sources/standstill/"]
BELOW_SOURCES = ["filter/ekf/", *RECORDS[:3], "filter/ingest/", "filter/kernels/", "include/ear/", "eigen", "freestanding"]
FILTER = ["filter/", "filter/advice.h", "filter/ingest/", "filter/ekf/", *RECORDS, *SOURCES, "filter/start/", "filter/health/"]

# What the files of a folder may include: layers and libraries. A file belongs to the longest folder that holds it.
LAYERS = {
    "include/ear/": ["include/ear/", "eigen", *STANDARD],
    # Inside the filter data flows one way: ingest -> ekf -> sources -> start; health sees records and no state.
    "filter/": [*FILTER, "include/ear/", "eigen", "freestanding"],
    "filter/advice.h": ["filter/ekf/displacement.h", "include/ear/", "freestanding"],
    "filter/ingest/": ["filter/ingest/", "include/ear/", "eigen", "freestanding"],
    "filter/kernels/": ["filter/kernels/", "filter/kernels/four.h", "include/ear/", "freestanding"],
    "filter/kernels/four.h": ["vector unit", "freestanding"],
    "filter/ekf/": ["filter/ekf/", *RECORDS[:3], "filter/ingest/", "filter/kernels/", "include/ear/", "eigen", "freestanding"],
    "filter/ekf/displacement.h": ["include/ear/", "eigen", "freestanding"],
    "filter/ekf/gate.h": ["freestanding"],
    "filter/ekf/records.h": ["include/ear/", "eigen", "freestanding"],
    "filter/sources/": [*SOURCES, *BELOW_SOURCES, "filter/advice.h"],
    "filter/sources/cameras/": ["filter/sources/cameras/", "filter/sources/cameras/frame_agreement.h", *BELOW_SOURCES],
    "filter/sources/cameras/frame_agreement.h": [],
    "filter/sources/wheels/": ["filter/sources/wheels/", *BELOW_SOURCES],
    "filter/sources/ground/": ["filter/sources/ground/", *BELOW_SOURCES],
    "filter/sources/standstill/": ["filter/sources/standstill/", *BELOW_SOURCES],
    "filter/start/": ["filter/start/", *SOURCES, *BELOW_SOURCES, "filter/advice.h"],
    "filter/health/": ["filter/health/", "filter/ingest/", *RECORDS, "filter/advice.h", "include/ear/", "eigen", "freestanding"],
    "smoother/": ["smoother/", *FILTER, "include/ear/", "eigen", "ceres", "freestanding"],
    "calibration/": ["calibration/", "smoother/", *FILTER, "include/ear/", "eigen", "ceres", "freestanding"],
    "frontend/": ["frontend/", "frontend/eight.h", "include/ear/", "eigen", "opencv", *STANDARD],
    "frontend/eight.h": ["vector unit", "freestanding"],
    "src/": ["src/", "src/rate_history.h", "src/log/", *FILTER, "frontend/", "include/ear/", "eigen", "opencv", *STANDARD],
    "src/log/": ["src/log/", "include/ear/", "spdlog", "posix", *STANDARD],
    "src/recording/": ["src/recording/", "src/log/", "include/ear/", "eigen", "opencv", "yaml-cpp", "json", *STANDARD],
    "src/bag/": ["src/bag/", "src/recording/", "include/ear/", "eigen", "ros", "yaml-cpp", *STANDARD],
    "src/rate_history.h": ["include/ear/", "eigen", *STANDARD],
    "src/mavlink/": ["src/mavlink/", "src/rate_history.h", *FILTER, "include/ear/", "eigen", "posix", *STANDARD],
    # Bags and live publishers hand over the same bytes: only src/ros2/ knows what they mean.
    "src/ros2/": ["src/ros2/", "src/recording/", "include/ear/", "eigen", "opencv", "fastcdr", *STANDARD],
    "src/rosbag2/": ["src/rosbag2/", "src/ros2/", "src/recording/", "src/log/", "include/ear/", "eigen", "posix", *STANDARD],
    "src/dds/": ["src/dds/", "include/ear/", "cyclone", *STANDARD],
    "src/view/": ["src/view/", "src/", *FILTER, "frontend/", "include/ear/", "eigen", "opencv", "json", "httplib", "posix", *STANDARD],
    "src/live/": ["src/live/", "src/", "src/rate_history.h", "src/dds/", "src/ros2/", "src/rosbag2/", "src/mavlink/", "src/recording/", "src/log/",
                  *FILTER, "include/ear/", "eigen", "opencv", "posix", "yaml-cpp", *STANDARD],
    # Simulated truth shares no code with the models, and an evaluation does not know what made the estimate.
    "tools/simulator/": ["tools/simulator/", "include/ear/", "eigen", "opencv", *STANDARD],
    "tools/evaluation/": ["tools/evaluation/", "include/ear/", "eigen", "json", *STANDARD],
}
EVERYTHING = [*LAYERS, "eigen", "opencv", "yaml-cpp", "json", "spdlog", "posix", "ceres", *STANDARD]
LAYERS["tools/"] = ["tools/", "cli11", *EVERYTHING]
LAYERS["tests/"] = ["tests/", "tests/live/fast_dds_", "tools/", "doctest", *EVERYTHING]
LAYERS["tests/calibration/test_mujoco"] = [*LAYERS["tests/"], "mujoco"]
LAYERS["tests/live/fast_dds_"] = ["tests/live/fast_dds_", "include/ear/", "src/recording/", "fastdds", "fastcdr", *STANDARD]
LAYERS["python/"] = ["python/", "tools/", "pybind11", *EVERYTHING]
LAYERS["tests/tools/consumer/"] = ["include/ear/", *FILTER, *STANDARD]
LAYERS["examples/c/"] = ["include/ear/", "posix", *STANDARD]
LAYERS["examples/mavlink/"] = ["include/ear/", "src/mavlink/", *STANDARD]
LAYERS["examples/recording/"] = ["include/ear/", "src/recording/", *STANDARD]
LAYERS["examples/live/"] = ["include/ear/", "src/live/", *STANDARD]
LAYERS["examples/filter_only/"] = ["include/ear/", *FILTER, "eigen", *STANDARD]

# Files, output, clocks and threads: the filter would build for a microcontroller.
HOSTED = ["atomic", "chrono", "condition_variable", "cstdio", "ctime", "filesystem", "fstream", "future", "iostream",
          "mutex", "shared_mutex", "thread"]

LIBRARIES = {"Eigen": "eigen", "unsupported": "eigen", "opencv2": "opencv", "yaml-cpp": "yaml-cpp", "spdlog": "spdlog",
             "nlohmann": "json", "CLI": "cli11", "doctest": "doctest", "sys": "posix", "arpa": "posix", "netinet": "posix", "ceres": "ceres", "glog": "ceres",
             "fastcdr": "fastcdr", "dds": "cyclone", "fastdds": "fastdds", "linux": "posix", "rosbag": "ros",
             "pybind11": "pybind11", "mujoco": "mujoco", "httplib.h": "httplib", "sensor_msgs": "ros", "geometry_msgs": "ros"}

VECTOR_UNIT = ["arm_neon.h", "emmintrin.h", "immintrin.h", "smmintrin.h"]  # what compilers offer of the processor's

INCLUDE = re.compile(r'^\s*#\s*include\s*["<]([^">]+)[">]')


def layer_of(file):
    return max((layer for layer in LAYERS if str(file).startswith(layer)), key=len, default=None)


def target_of(root, includer, name):
    """What an include points at: a layer of the project, or a library."""
    for folder in (includer.parent, Path("."), Path("include")):
        file = (root / folder / name).resolve()
        if file.is_file() and file.is_relative_to(root):
            return layer_of(file.relative_to(root))
    if "/" in name:
        return LIBRARIES.get(name.split("/")[0])
    if name in VECTOR_UNIT:
        return "vector unit"
    if name.endswith(".h"):
        return LIBRARIES.get(name, "freestanding" if name in ("stddef.h", "stdint.h") else "posix")
    return "hosted" if name in HOSTED else "freestanding"


def sources(root):
    """All C and C++ files of the project, relative to its root."""
    for folder in sorted(root.iterdir()):
        if folder.is_dir() and folder.name not in (".git", "build", "install"):
            yield from (file.relative_to(root) for file in sorted(folder.rglob("*")) if file.suffix in (".h", ".c", ".cpp"))


def check(root):
    root = root.resolve()
    faults = []
    for file in sources(root):
        layer = layer_of(file)
        if layer is None:
            faults.append(f"{file}: no entry of LAYERS holds this file")
            continue
        for number, line in enumerate((root / file).read_text(encoding="utf-8").splitlines(), start=1):
            include = INCLUDE.match(line)
            if include and target_of(root, file, include[1]) not in LAYERS[layer]:
                faults.append(f"{file}:{number}: {layer} may not include {include[1]}")
    return faults


if __name__ == "__main__":
    found = check(Path(sys.argv[1]))
    print("\n".join(found) or "layers: every include points the right way")
    sys.exit(1 if found else 0)
