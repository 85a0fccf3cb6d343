"""A recording over the wire to `ear live` in real time, and what came of it: delays, memory, samples, agreement.

long_run.py EAR_PROGRAM PLAYER [--recording FOLDER | --sequence fly1] [--seconds 600] [--load 2] [--record] [--budget-ms B]

Prints one line of JSON. The vehicle stands once the recording has ended. Delays are those from when an image is handed to the
publisher's DDS to when the odometry of its stamp is there again, so both ways over the wire are in it. With --load so many
busy processes run beside it. test_long_run.py judges the same.
"""

import argparse
import csv
import json
import os
import re
import signal
import subprocess
import tempfile
import time
from pathlib import Path

import loopback

CONFIG = """calibration: {recording}
{budget}
ros: {{domain: {domain}}}
topics: {{imu: /imu0, left: /cam0/image_raw, right: /cam1/image_raw, wheels: /wheels,
  beam_0: /laser/0, beam_1: /laser/1, beam_2: /laser/2}}
"""


def resident_mb(pid):
    status = Path(f"/proc/{pid}/status").read_text(encoding="utf-8")
    return int(re.search(r"VmRSS:\s+(\d+) kB", status)[1]) / 1024


def positions(file):
    rows = (line.split() for line in file.read_text(encoding="utf-8").splitlines())
    return {row[0]: [float(value) for value in row[1:4]] for row in rows}


def farthest(a, b):
    """Of the stamps of b: the largest difference [m], and how many a lacks."""
    shared = [stamp for stamp in b if stamp in a]
    far = max((abs(x - y) for stamp in shared for x, y in zip(a[stamp], b[stamp])), default=float("nan"))
    return far, len(b) - len(shared)


def run(program, player, recording, folder, seconds, load=0, record=False, budget=""):
    """What one run came to, as a dictionary."""
    domain = 100 + os.getpid() % 100
    config = folder / "live.yaml"
    config.write_text(CONFIG.format(recording=recording, domain=domain, budget=budget), encoding="utf-8")
    environment = {**os.environ, "CYCLONEDDS_URI": loopback.URI}
    arguments = ["--record", folder / "record.mcap"] if record else []
    before = os.getloadavg()[0]
    busy = [subprocess.Popen(["sh", "-c", "while :; do :; done"]) for _ in range(load)]
    resident = []
    log = folder / "live.log"
    try:
        with log.open("w", encoding="utf-8") as err:
            live = subprocess.Popen([program, "live", "--config", config, "--out", folder / "live", *arguments],
                                    stdin=subprocess.DEVNULL, stderr=err, env=environment)
            while "ready" not in log.read_text(encoding="utf-8") and live.poll() is None:
                time.sleep(0.05)
            play = subprocess.Popen([player, recording, str(domain), "reliable", folder / "odometry.csv", str(seconds)],
                                    stdout=subprocess.PIPE, text=True)
            while play.poll() is None:
                time.sleep(1.0)
                resident.append(resident_mb(live.pid))
            sent = int(play.stdout.read().split()[0])
            after = os.getloadavg()[0]
            live.send_signal(signal.SIGTERM)
            code = live.wait(60)
    finally:
        for process in busy:
            process.kill()
    text = log.read_text(encoding="utf-8")
    with (folder / "odometry.csv").open(encoding="utf-8") as lines:
        delays = sorted(1e-6 * int(row[4]) for row in csv.reader(lines) if int(row[4]) >= 0)
    quarter = max(len(resident) // 4, 1)
    return {"exit": code, "seconds": seconds, "load": [before, after], "inertial_sent": sent,
            "inertial_taken": int(re.search(r" (\d+) inertial samples, \d+ of these refused", text)[1]),
            "inertial_refused": int(re.search(r"inertial samples, (\d+) of these refused", text)[1]),
            "impatient_frames": int(re.search(r"; (\d+) frames did not wait", text)[1]),
            "load_steps": text.count("load step "), "odometry": len(delays),
            "delay_ms": {name: round(delays[min(int(part * len(delays)), len(delays) - 1)], 1) if delays else None
                         for name, part in (("median", 0.5), ("p99", 0.99), ("most", 1.0))},
            "resident_mb": [round(max(resident[i * quarter:(i + 1) * quarter] or [0]), 1) for i in range(4)]}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program", type=Path)
    parser.add_argument("player", type=Path)
    parser.add_argument("--recording", type=Path)
    parser.add_argument("--sequence", default="fly1")
    parser.add_argument("--seconds", type=float, default=600)
    parser.add_argument("--load", type=int, default=0)
    parser.add_argument("--record", action="store_true")
    parser.add_argument("--budget-ms")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        recording = args.recording or folder / "recording"
        if not args.recording:
            subprocess.run([args.program, "simulate", args.sequence, "--seed", "5", "--out", recording], check=True,
                           stdout=subprocess.DEVNULL)
        budget = f"budget_ms: {args.budget_ms}" if args.budget_ms is not None else ""
        print(json.dumps(run(args.program.resolve(), args.player.resolve(), recording.resolve(), folder, args.seconds, args.load,
                             args.record, budget)))


if __name__ == "__main__":
    main()
