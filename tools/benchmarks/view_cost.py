"""What the view costs the estimator: view_cost.py EAR_PROGRAM RECORDING [ROUNDS]

The processor time of the estimator's thread of `ear live`, which a recording feeds in real time: without a view, with one that
nobody looks at, and with one viewer who asks for all that the page asks for, ten times a second. Medians over the rounds, which
take three times as long as the recording each.
"""

import json
import re
import statistics
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request
from pathlib import Path


def estimator_seconds(process):
    """The time so far; nothing before and after the thread's life."""
    for task in Path(f"/proc/{process.pid}/task").glob("*"):
        try:
            if (task / "comm").read_text(encoding="ascii").strip() == "estimator":
                return int((task / "schedstat").read_text(encoding="ascii").split()[0]) * 1e-9
        except (FileNotFoundError, ProcessLookupError, IndexError):
            continue
    return None


def look(url, process):
    """As the page does it."""
    last = 0
    while process.poll() is None:
        try:
            moments = json.load(urllib.request.urlopen(f"{url}moments?viewer=a&n={last}", timeout=5))["moments"]
            if moments:
                last = moments[-1]["n"]
                for what in ("image", "features"):
                    urllib.request.urlopen(f"{url}{what}?viewer=a&n={last}", timeout=5).read()
        except OSError:
            pass  # it has ended: poll() says so
        time.sleep(0.1)


def run(program, recording, viewers, folder):
    """Milliseconds of processor time per frame; `viewers` None: no view."""
    config = folder / "live.yaml"
    config.write_text("budget_ms: 0\nframe_slots: 64\nlog: {level: info}\n", encoding="utf-8")
    options = [] if viewers is None else ["--view", "0"]
    process = subprocess.Popen([program, "live", "--sensors", recording, "--config", config, "--out", folder / "out", *options],
                               stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    used = 0.0
    for line in process.stderr:
        found = re.search(r"view: (http\S+)", line)
        if viewers and found:
            threading.Thread(target=look, args=(found[1], process), daemon=True).start()
        if "ready" in line:
            break
    threading.Thread(target=process.stderr.read, daemon=True).start()  # its pipe is not to fill
    while process.poll() is None:
        used = estimator_seconds(process) or used
        time.sleep(0.02)
    frames = len((folder / "out/estimate.tum").read_text(encoding="utf-8").splitlines())
    return 1e3 * used / frames


def main(program, recording, rounds=3):
    with tempfile.TemporaryDirectory() as folder:
        found = {viewers: [] for viewers in (None, 0, 1)}
        for _ in range(rounds):
            for viewers, values in found.items():
                values.append(run(program, recording, viewers, Path(folder)))
    for viewers, name in ((None, "no view"), (0, "nobody looks"), (1, "one viewer")):
        values = found[viewers]
        print(f"{name:28} {statistics.median(values):.3f} ms per frame ({min(values):.3f} to {max(values):.3f})")


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], *(int(n) for n in sys.argv[3:4]))
