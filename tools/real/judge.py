"""Estimates on recordings against their truth, as a table. The figures are those of docs/evaluation.md."""

import json
import re
import subprocess

# Where a truth is not the recording's state_groundtruth_estimate0: its file; and what its positions may be off by [m].
TRUTH_FILES = {"lawn_wheels": "mav0/uwb0/data.csv"}
TRUTH_ERRORS = {
    "kitti_a": 0.3,  # its stamps are known to 30 ms, at 10 m/s
    "ucsd_20": 0.7,  # of lidar scans, in a plane
    "lawn_wheels": 2.0,  # radio; its height alone scatters by 0.6 m
}
USUAL_ERROR = 0.1  # [m] that of `ear evaluate`: motion capture and simulations are better

COLUMNS = [  # title, path in the JSON of `ear evaluate`, factor, decimals
    ("time [s]", ["duration_s"], 1, 1),
    ("length [m]", ["length_m"], 1, 1),
    ("ATE [m]", ["ate_rmse_m"], 1, 4),
    ("[%]", ["ate_percent"], 1, 3),
    ("NEES position (3)", ["nees", "position", "mean"], 1, 1),
    ("orientation (3)", ["nees", "orientation", "mean"], 1, 1),
    ("coverage [%]", ["coverage"], 100, 1),
    ("far off [%]", ["false_tracking", "far_off_percent"], 1, 1),
    ("false tracking [%]", ["false_tracking", "percent"], 1, 1),
]

ALARMS = [
    ("alarms per hour", ["alarms_per_hour"], 1, 0),
    ("others than imprecise", ["accusations_per_hour"], 1, 0),
]


def truth_of(recording):
    """The file or folder that `ear evaluate` takes for the truth, or nothing, and what it may be off by [m]."""
    truth = recording / TRUTH_FILES.get(recording.name, "mav0/state_groundtruth_estimate0/data.csv")
    if not truth.exists():
        return None, USUAL_ERROR
    simulated = (recording / "mav0/truth_extra.csv").exists()  # it is beside the truth, and has figures of its own
    return recording if simulated else truth, TRUTH_ERRORS.get(recording.name, USUAL_ERROR)


def judge(program, output, recording):
    """The figures of a run's output folder as `ear evaluate --json` names them; nothing where there is no truth."""
    truth, error = truth_of(recording)
    if truth is None:
        return None
    command = [str(program), "evaluate", str(output), str(truth), "--truth-error", str(error), "--json"]
    done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"{recording}: {done.stderr.strip()}")
    return {**json.loads(done.stdout)["estimates"][0], "truth_error_m": error}


def alarms(summary, figures):
    """How often per hour the health left `tracking` while the position was not far off; and how often it then said more than
    that the position is imprecise. Before its first `tracking` nothing counts."""
    off = [(s["from_ns"], s["to_ns"]) for s in figures["false_tracking"]["stretches"]]
    count, accusations, before = 0, 0, ""
    for change in summary["health"]:
        word = re.split("[:,]", change["is"])[0]
        if before == "tracking" and word in ("degraded", "lost") and not any(a <= change["t_ns"] <= b for a, b in off):
            count += 1
            accusations += not change["is"].startswith("degraded: position imprecise;")
        before = word
    per_hour = 3600.0 / summary["duration_s"] if summary["duration_s"] > 0 else 0.0
    return {"alarms_per_hour": per_hour * count, "accusations_per_hour": per_hour * accusations}


def judge_with_alarms(program, output, recording):
    """As judge(), with those of alarms(). `output` is of `ear run`."""
    figures = judge(program, output, recording)
    if figures is None:
        return None
    return {**figures, **alarms(json.loads((output / "summary.json").read_text(encoding="utf-8")), figures)}


def figure(figures, path):
    """The one at the end of the path, or nothing."""
    for key in path:
        figures = figures.get(key) if figures else None
    return figures


def cell(figures, path, factor, decimals):
    value = figure(figures, path)
    return "-" if value is None else f"{factor * value:.{decimals}f}"


def table(judged):
    """Markdown; one row per pair of a name and its figures."""
    columns = COLUMNS + ALARMS if any(figures and "alarms_per_hour" in figures for _, figures in judged) else COLUMNS
    titles = ["recording", *(title for title, *_ in columns), "truth to [m]"]
    lines = ["| " + " | ".join(titles) + " |", "|---" * len(titles) + "|"]
    for name, figures in judged:
        error = f"{figures['truth_error_m']:g}" if figures else "-"
        lines.append("| " + " | ".join([name, *(cell(figures, *column) for _, *column in columns), error]) + " |")
    return "\n".join(lines)
