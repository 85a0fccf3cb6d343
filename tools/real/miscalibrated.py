"""Recordings whose calibration is as wrong as on real rigs: sensor.yaml, clocks and gyroscope, drawn at random.

The standard deviations are those of `ear simulate --calibration-error 1` (docs/simulator.md). What a recording lacks is left out;
the errors that a real one has already are added to.
"""

import math
import random
import re
import statistics

from real.altered import CAMERAS, Copy, later, through_matrix
from real.judge import figure
from real.layout import NO_TURN, BadInput, multiply, rotate, turned

DEGREE = math.pi / 180
LIST = r": *\[([^\]]*)\]"


def turn(draws, sigma):
    """A rotation by a vector of three independent angles [rad]."""
    return turned(NO_TURN, shift(draws, sigma))


def shift(draws, sigma):
    return [draws.gauss(0.0, sigma) for _ in range(3)]


def moved(text, R, p):
    """T_BS turned by R in the body and moved by p."""
    def change(T):
        for i in range(3):
            T[4 * i + 3] += p[i]
        turned = multiply(R, [T[4 * i : 4 * i + 3] for i in range(3)])
        return [x for i in range(3) for x in (*turned[i], T[4 * i + 3])] + T[12:]

    return changed(text, "data", change)


def changed(text, key, function):
    """The first list with this key becomes `function` of it."""
    found = re.search(key + LIST, text)
    if found is None:
        raise BadInput(f"no list '{key}' in a sensor.yaml")
    values = function([float(x) for x in found[1].split(",")])
    return text[: found.start(1)] + ", ".join(f"{x:.12g}" for x in values) + text[found.end(1) :]


def change_cameras(copy, draws):
    R, p = turn(draws, 0.2 * DEGREE), shift(draws, 1e-3)
    apart, aside = turn(draws, 0.02 * DEGREE), shift(draws, 5e-5)
    for camera in CAMERAS:
        longer, u, v = 1 + draws.gauss(0.0, 1e-3), draws.gauss(0.0, 0.5), draws.gauss(0.0, 0.5)
        copy.rewrite(camera, lambda text: changed(
            moved(text, R, p), "intrinsics", lambda f: [longer * f[0], longer * f[1], f[2] + u, f[3] + v]))
    copy.rewrite(CAMERAS[1], lambda text: moved(text, apart, aside))


def change_wheels(copy, draws):
    R, p = turn(draws, 0.3 * DEGREE), shift(draws, 3e-3)
    larger, wider = 1 + draws.gauss(0.0, 4e-3), 1 + draws.gauss(0.0, 5e-3)
    apart = [draws.gauss(0.0, 1e-3) for _ in range(2)]
    copy.rewrite("encoder0", lambda text: changed(
        moved(text, R, p), "wheel_radius", lambda radius: [r * (larger + a) for r, a in zip(radius, apart)]))
    copy.change_value("encoder0", "wheel_separation", lambda width: wider * width)


def change_beams(copy, draws):
    def change(text):
        lines = text.split("\n")
        for i, line in enumerate(lines):
            if "direction" in line:
                R, p = turn(draws, 0.3 * DEGREE), shift(draws, 2e-3)
                line = changed(line, "origin", lambda o, p=p: [a + b for a, b in zip(o, p)])
                lines[i] = changed(line, "direction", lambda d, R=R: rotate(R, d))
        return "\n".join(lines)

    copy.rewrite("laser0", change)


def miscalibrated(recording, seed, folder):
    """A copy of the recording with errors drawn by `seed`, in `folder`, which must not be there."""
    copy, draws = Copy(recording, folder), random.Random(seed)
    change_cameras(copy, draws)
    if (copy.mav0 / "encoder0/sensor.yaml").exists():
        change_wheels(copy, draws)
    change_beams(copy, draws)
    for sensors in (CAMERAS, ["encoder0"], ["laser0"]):
        copy.change(sensors, later(draws.gauss(0.0, 2e-3)))
    copy.change(["imu0"], through_matrix([[(i == j) + draws.gauss(0.0, 3e-3) for j in range(3)] for i in range(3)]))
    return folder


def mean_of(runs, *path):
    values = [figure(run, path) for run in runs]
    return f"{statistics.mean(values):.1f}" if values and None not in values else "-"


def table(rows):
    """Markdown. `rows`: name, sensors, figures without errors, those of each draw; of runs without an estimate nothing."""
    lines = ["| recording | sensors | ATE as it is [m] | drawn: median | worst | of | NEES position | orientation | far off [%] | false tracking [%] |",
             "|---" * 10 + "|"]
    for row in rows:
        runs = [run for run in row["drawn"] if run]
        errors = [run["ate_rmse_m"] for run in runs]
        cells = [row["name"], row["sensors"], f"{row['as_it_is']['ate_rmse_m']:.3g}" if row["as_it_is"] else "none",
                 f"{statistics.median(errors):.3g}" if errors else "none", f"{max(errors):.3g}" if errors else "",
                 f"{len(runs)} / {len(row['drawn'])}", mean_of(runs, "nees", "position", "mean"), mean_of(runs, "nees", "orientation", "mean"),
                 mean_of(runs, "false_tracking", "far_off_percent"), mean_of(runs, "false_tracking", "percent")]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)
