#!/usr/bin/env python3
"""Accuracy on rendered recordings: simulates, runs and evaluates, and prints the tables of docs/results.md.

    tools/benchmarks/accuracy.py EAR [--sequences flat1 fly1 | all] [--seeds 101 102] [--odometer none terrain]
                                 [--calibration true wrong] [--work DIR] [--keep]

Every recording is run with the true calibration and with a wrong one (CALIBRATION_ERROR); the pictures are rendered
once. Recordings that are in DIR already, as SEQUENCE_SEED_wrong and SEQUENCE_SEED_true, are used and left there. What
`ear run` wrote stays in DIR/runs.
"""
import argparse
import json
import re
import shutil
import statistics
import subprocess
from pathlib import Path

# `ear simulate --calibration-error` of each calibration.
CALIBRATION_ERROR = {"true": 0, "wrong": 1}

# Columns of the table: title, path of the figure in the evaluation's JSON, factor, decimals.
COLUMNS = [
    ("ATE [m]", ["ate_rmse_m"], 1, 4),
    ("ATE [%]", ["ate_percent"], 1, 3),
    ("z [m]", ["z_rmse_m"], 1, 4),
    ("z on ground [m]", ["ground", "z_rmse_m"], 1, 4),
    ("rotation [deg]", ["rotation_rmse_deg"], 1, 3),
    ("start-end [m]", ["start_to_end", "error_m"], 1, 4),
    ("NEES p", ["nees", "position", "mean"], 1, 2),
    ("NEES R", ["nees", "orientation", "mean"], 1, 2),
    ("slope along [deg]", ["ground", "slope_along", "rmse_deg"], 1, 3),
    ("in 3 sigma [%]", ["ground", "slope_along", "inside_3_sigma"], 100, 1),
    ("slope across [deg]", ["ground", "slope_across", "rmse_deg"], 1, 3),
    ("in 3 sigma [%]", ["ground", "slope_across", "inside_3_sigma"], 100, 1),
    ("mode right [%]", ["ground", "mode_agreement"], 100, 1),
    ("coverage [%]", ["coverage"], 100, 1),
]


def call(*arguments):
    return subprocess.run([str(a) for a in arguments], check=True, capture_output=True, text=True).stdout


def all_sequences(ear):
    text = call(ear, "simulate", "--help").split("Sequences:")[1].split("\n\n")[0]
    return re.findall(r"^\s+(\w+): ", text, re.MULTILINE)


def recording(ear, sequence, seed, calibration, work, made):
    """The recording's folder, made if it is not there yet; pictures come from its sibling where that is there."""
    folders = {name: work / f"{sequence}_{seed}_{name}" for name in CALIBRATION_ERROR}
    folder = folders.pop(calibration)
    (sibling,) = folders.values()
    if not folder.exists():
        made.append(folder)
        call(ear, "simulate", sequence, "--seed", seed, "--out", folder,
             "--calibration-error", CALIBRATION_ERROR[calibration],
             *(["--images-from", sibling] if sibling.exists() else []))
    return folder


def evaluate(ear, folder, odometer, out):
    """The evaluation's JSON, or nothing if the run has no estimate."""
    try:
        call(ear, "run", folder, "--out", out, *(["--odometer", odometer] if odometer else []))
    except subprocess.CalledProcessError as error:
        print(error.stderr, flush=True)
        return None
    return json.loads(call(ear, "evaluate", out, folder, "--json"))["estimates"][0]


def figure(evaluation, path):
    for key in path:
        evaluation = evaluation and evaluation.get(key)
    return evaluation


def cells(evaluations):
    """The median over the seeds of each column; of ATE also the worst and each seed's."""
    done = [e for e in evaluations if e]
    row = [str(len(done)) if len(done) == len(evaluations) else f"{len(done)} of {len(evaluations)}"]
    for title, path, factor, decimals in COLUMNS:
        values = [factor * v for v in (figure(e, path) for e in done) if v is not None]
        row.append(f"{statistics.median(values):.{decimals}f}" if values else "-")
        if title.startswith("ATE"):
            row.append(f"{max(values):.{decimals}f}" if values else "-")
    return row


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("ear", type=Path)
    parser.add_argument("--sequences", nargs="+", default=["flat1", "fly1"])
    parser.add_argument("--seeds", nargs="+", type=int, default=[101, 102, 103, 104, 105])
    parser.add_argument("--odometer", nargs="+", default=[None], help="models to compare; without: the default")
    parser.add_argument("--calibration", nargs="+", choices=list(CALIBRATION_ERROR), default=list(CALIBRATION_ERROR))
    parser.add_argument("--work", type=Path, default=Path("build/accuracy"))
    parser.add_argument("--keep", action="store_true", help="keep the recordings that it makes, about 1 GB each")
    args = parser.parse_args()
    args.work.mkdir(parents=True, exist_ok=True)
    titles = ["sequence", "odometer", "calibration", "seeds"]
    for title, *_ in COLUMNS:
        titles += [title, "worst"] if title.startswith("ATE") else [title]
    print("| " + " | ".join(titles) + " |\n" + "|---" * len(titles) + "|", flush=True)

    for sequence in all_sequences(args.ear) if args.sequences == ["all"] else args.sequences:
        rows = {(odometer, calibration): [] for odometer in args.odometer for calibration in args.calibration}
        for seed in args.seeds:
            made = []
            for (odometer, calibration), evaluations in rows.items():
                folder = recording(args.ear, sequence, seed, calibration, args.work, made)
                out = args.work / "runs" / f"{folder.name}_{odometer or 'default'}"
                evaluations.append(evaluate(args.ear, folder, odometer, out))
            for folder in made if not args.keep else []:
                shutil.rmtree(folder)
        for (odometer, calibration), evaluations in rows.items():
            row = [sequence, odometer or "default", calibration, *cells(evaluations)]
            print("| " + " | ".join(row) + " |", flush=True)


if __name__ == "__main__":
    main()
