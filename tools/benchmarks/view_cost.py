"""What the view costs the estimator: view_cost.py EAR_PROGRAM RECORDING [ROUNDS]

The processor time of the thread that estimates: as fast as it goes without a view; in real time with one that nobody looks at,
and with one viewer who asks for all that the page asks for, ten times a second. Medians over the rounds.
"""

import json
import re
import statistics
import subprocess
import sys
import tempfile
import time
import urllib.request
from pathlib import Path


def thread_seconds(process):
    try:
        return int(Path(f"/proc/{process.pid}/task/{process.pid}/schedstat").read_text(encoding="ascii").split()[0]) * 1e-9
    except (FileNotFoundError, ProcessLookupError, IndexError):
        return None


def run(program, recording, viewers, out):
    """Milliseconds of processor time per frame; `viewers` None: no view."""
    options = [] if viewers is None else ["--view", "0", "--real-time"]
    process = subprocess.Popen([program, "run", recording, "--out", out, *options], stdout=subprocess.DEVNULL,
                               stderr=subprocess.PIPE, text=True)
    url = None if viewers is None else re.search(r"http\S+", process.stderr.readline())[0]
    last, used = 0, 0.0
    while process.poll() is None:
        used = thread_seconds(process) or used
        if not viewers:
            time.sleep(0.002)
            continue
        try:
            moments = json.load(urllib.request.urlopen(f"{url}moments?viewer=a&n={last}", timeout=5))["moments"]
            if moments:
                last = moments[-1]["n"]
                for what in ("image", "features"):
                    urllib.request.urlopen(f"{url}{what}?viewer=a&n={last}", timeout=5).read()
        except OSError:
            pass  # it has ended: poll() says so
        time.sleep(0.1)
    process.stderr.read()
    counts = json.loads((out / "summary.json").read_text(encoding="utf-8"))["counts"]
    return 1e3 * used / counts["frames"]


def main(program, recording, rounds=3):
    with tempfile.TemporaryDirectory() as folder:
        found = {viewers: [] for viewers in (None, 0, 1)}
        for _ in range(rounds):
            for viewers, values in found.items():
                values.append(run(program, recording, viewers, Path(folder) / "out"))
    for viewers, name in ((None, "no view, as fast as it goes"), (0, "nobody looks"), (1, "one viewer")):
        values = found[viewers]
        print(f"{name:28} {statistics.median(values):.3f} ms per frame ({min(values):.3f} to {max(values):.3f})")


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], *(int(n) for n in sys.argv[3:4]))
