#!/usr/bin/env python3
"""Accuracy on rendered recordings: simulates, runs and evaluates, and prints the tables of docs/results.md.

    tools/benchmarks/accuracy.py EAR [--sequences flat1 fly1] [--seeds 101 102 103 104 105] [--work DIR] [--keep]

Every recording is run with the true calibration and with the slightly wrong one; the pictures are rendered once.
"""
import argparse
import json
import shutil
import statistics
import subprocess
from pathlib import Path


def call(*arguments):
    return subprocess.run([str(a) for a in arguments], check=True, capture_output=True, text=True).stdout


def evaluate(ear, recording, out):
    call(ear, "run", recording, "--out", out)
    return json.loads(call(ear, "evaluate", out, recording, "--json"))["estimates"][0]


def one_seed(ear, sequence, seed, work):
    """Figures with the true calibration and with the wrong one."""
    true, wrong = work / f"{sequence}-{seed}-true", work / f"{sequence}-{seed}-wrong"
    if not true.exists():
        call(ear, "simulate", sequence, "--seed", seed, "--out", true, "--perfect-calibration")
    if not wrong.exists():
        call(ear, "simulate", sequence, "--seed", seed, "--out", wrong, "--images-from", true)
    return [evaluate(ear, r, work / (r.name + "-run")) for r in (true, wrong)]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("ear", type=Path)
    parser.add_argument("--sequences", nargs="+", default=["flat1", "fly1"])
    parser.add_argument("--seeds", nargs="+", type=int, default=[101, 102, 103, 104, 105])
    parser.add_argument("--work", type=Path, default=Path("build/accuracy"))
    parser.add_argument("--keep", action="store_true", help="keep the recordings, about 1 GB each")
    args = parser.parse_args()
    args.work.mkdir(parents=True, exist_ok=True)
    print("| sequence | calibration | ATE RMSE, median [% of length] | worst | per seed |\n|---|---|---|---|---|", flush=True)
    for sequence in args.sequences:
        figures = [one_seed(args.ear, sequence, seed, args.work) for seed in args.seeds]
        for which, calibration in enumerate(("true", "slightly wrong")):
            ate = [f[which]["ate_percent"] for f in figures]
            per_seed = ", ".join(f"{a:.3f}" for a in ate)
            print(f"| {sequence} | {calibration} | {statistics.median(ate):.3f} | {max(ate):.3f} | {per_seed} |", flush=True)
    if not args.keep:
        shutil.rmtree(args.work)


if __name__ == "__main__":
    main()
