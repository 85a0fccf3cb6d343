"""The examples in Python run: test_examples.py ROOT [TEST...], with the module on PYTHONPATH.

The notebook needs Debian's python3-nbclient and python3-ipykernel; without them its test is skipped.
"""

import importlib
import os
import re
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree
from pathlib import Path

import ear

ROOT = Path(sys.argv.pop(1)).resolve()
EXAMPLES = ROOT / "examples/python"


def run(example, *arguments):
    command = [sys.executable, "-B", EXAMPLES / example, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


class Examples(unittest.TestCase):
    def test_frames_of_a_camera(self):
        with tempfile.TemporaryDirectory() as folder:
            ear.Simulation("flat1", seed=832, duration=3.0, camera_rate_hz=10.0, tracks=False).write(folder)
            lines = run("camera_frames.py", folder).splitlines()
        self.assertIn("no estimate: initialising", lines[0])
        self.assertRegex(lines[-1], r"^\d+ +-?\d+\.\d{3} +-?\d+\.\d{3} +-?\d+\.\d{3} m  tracking$")
        self.assertGreater(len(lines), 20)

    def test_comparison_of_settings(self):
        with tempfile.TemporaryDirectory() as folder:
            printed = run("compare_settings.py", Path(folder) / "plot.svg", 3, 12)
            drawing = xml.etree.ElementTree.parse(Path(folder) / "plot.svg").getroot()
        medians = {model: float(m) for model, m in re.findall(r"(\w+) +median (\S+) m", printed)}
        self.assertLess(medians["terrain"], medians["gyro"])  # what the paper's model is for
        self.assertEqual(len(drawing.findall("{http://www.w3.org/2000/svg}circle")), 6)

    def test_page(self):
        page = (ROOT / "docs/python.md").read_text(encoding="utf-8")
        code = "".join(re.findall(r"^```python\n(.*?)^```", page, re.DOTALL | re.MULTILINE))
        self.assertGreater(len(code), 1000)
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([sys.executable, "-B", "-c", code], cwd=folder, capture_output=True, check=True)

    def test_notebook(self):
        try:
            import nbclient
            import nbformat
            importlib.import_module("ipykernel")  # what runs the cells
        except ImportError as missing:
            self.skipTest(f"{missing}: Debian's python3-nbclient and python3-ipykernel run notebooks")
        notebook = nbformat.read(EXAMPLES / "covered_lens.ipynb", as_version=4)
        with tempfile.TemporaryDirectory() as folder:
            os.environ["IPYTHONDIR"] = os.environ["JUPYTER_RUNTIME_DIR"] = folder
            nbclient.NotebookClient(notebook, timeout=240, kernel_name="python3",
                                    resources={"metadata": {"path": str(EXAMPLES)}}).execute()
        outputs = [output for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs]
        printed = "".join(output.get("text", "") for output in outputs)
        error = float(re.search(r"all sensors: (\S+) m", printed)[1])
        self.assertTrue(0.005 < error < 0.245, error)  # the second is what the paper prints for its estimator
        (drawing,) = (output.data["image/svg+xml"] for output in outputs if "data" in output)
        self.assertIn("<polyline", drawing)
        print(f"notebook: {error} m")


if __name__ == "__main__":
    unittest.main()
