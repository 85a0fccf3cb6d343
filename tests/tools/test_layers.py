"""Plants includes in a small made-up project and looks at what the layer check says."""

import tempfile
import unittest
from pathlib import Path

import layers


class Layers(unittest.TestCase):
    def faults(self, files):
        """What the check says of a project with these files (path: text)."""
        with tempfile.TemporaryDirectory() as folder:
            for path, text in files.items():
                file = Path(folder) / path
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_text(text, encoding="utf-8")
            return layers.check(Path(folder))

    def assert_fault(self, path, include, others=()):
        files = {path: f"// first line\n#include {include}\n", **{other: "" for other in others}}
        self.assertEqual(self.faults(files), [f"{path}:2: {layers.layer_of(path)} may not include {include[1:-1]}"])

    def test_what_may_be_seen(self):
        self.assertEqual(
            self.faults(
                {
                    "include/ear/types.h": "#include <Eigen/Core>\n#include <vector>\n",
                    "filter/a.h": '#include <Eigen/QR>\n#include <optional>\n#include "ear/types.h"\n',
                    "filter/a.cpp": '#include "filter/a.h"\n#include "a.h"\n#include <ear/types.h>\n',
                    "frontend/a.cpp": "#include <opencv2/core.hpp>\n#include <thread>\n",
                    "src/a.cpp": '#include "filter/a.h"\n#include "src/log/a.h"\n',
                    "src/a.h": "",
                    "src/log/a.h": "",
                    "src/log/a.cpp": "#include <spdlog/spdlog.h>\n",
                    "tools/simulator/b.h": "",
                    "tools/run.cpp": '#include "src/a.h"\n#include "tools/simulator/b.h"\n#include <CLI/CLI.hpp>\n',
                    "tools/simulator/a.h": "// #include <frontend/a.h> is only talked about\n",
                    "tests/filter/a.cpp": '#include "filter/a.h"\n#include <doctest/doctest.h>\n',
                }
            ),
            [],
        )

    def test_public_headers_see_no_library_but_eigen(self):
        self.assert_fault("include/ear/a.h", "<opencv2/core.hpp>")
        self.assert_fault("include/ear/a.h", '"filter/b.h"', others=["filter/b.h"])
        self.assert_fault("include/ear/a.h", '"../../filter/b.h"', others=["filter/b.h"])

    def test_filter_sees_no_system(self):
        for include in ("<opencv2/core.hpp>", "<yaml-cpp/yaml.h>", "<spdlog/spdlog.h>", "<boost/optional.hpp>",
                        "<fstream>", "<chrono>", "<thread>", "<unistd.h>"):
            self.assert_fault("filter/a.cpp", include)
        self.assert_fault("filter/a.cpp", '"frontend/b.h"', others=["frontend/b.h"])
        self.assert_fault("filter/a.cpp", '"../src/b.h"', others=["src/b.h"])

    def test_frontend_does_not_know_the_filter(self):
        self.assert_fault("frontend/a.cpp", '"filter/b.h"', others=["filter/b.h"])
        self.assert_fault("frontend/a.cpp", "<spdlog/spdlog.h>")

    def test_nothing_points_at_the_tools(self):
        self.assert_fault("src/a.cpp", '"tools/commands.h"', others=["tools/commands.h"])
        self.assert_fault("src/recording/a.cpp", '"filter/b.h"', others=["filter/b.h"])
        self.assert_fault("src/a.cpp", '"src/recording/b.h"', others=["src/recording/b.h"])

    def test_truth_shares_no_code_with_the_models(self):
        for folder in ("filter", "frontend", "src", "tools/evaluation"):
            self.assert_fault("tools/simulator/a.cpp", f'"{folder}/b.h"', others=[f"{folder}/b.h"])
        self.assert_fault("tools/evaluation/a.cpp", '"filter/b.h"', others=["filter/b.h"])

    def test_no_code_outside_the_layers(self):
        self.assertEqual(self.faults({"extra/a.cpp": ""}), ["extra/a.cpp: no entry of LAYERS holds this file"])


if __name__ == "__main__":
    unittest.main()
