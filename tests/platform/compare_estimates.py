"""What two builds make of the same samples: compare_estimates.py A B.

A and B are outputs of the program estimates. Fails if a frame of one has no estimate in the other, or they differ by
more than the tolerances below; prints the largest differences.
"""

import sys

# Of position [m], velocity [m/s] and rotation [rad]; the standard deviations as a ratio; features of a frame. Where the
# tracks are the same, only the order and rounding of sums differ. Images are rendered and followed in single precision:
# a feature that is found on one processor may be lost on the other.
TOLERANCES = {
    "filter": {"position": 1e-8, "velocity": 1e-8, "rotation": 1e-8, "sigma": 1e-8, "features": 0},
    "pipeline": {"position": 1e-4, "velocity": 1e-4, "rotation": 1e-4, "sigma": 1e-3, "features": 2},
}


def read(path):
    estimates = {}
    with open(path, encoding="ascii") as file:
        for line in file:
            part, t, features, *values = line.split()
            values = [float(value) for value in values]
            estimates[part, t] = (int(features), values[:3], values[3:6], values[6:10], values[10:])
    return estimates


def distance(a, b):
    return sum((x - y) ** 2 for x, y in zip(a, b)) ** 0.5


def differences(a, b):
    return {
        "position": distance(a[1], b[1]),
        "velocity": distance(a[2], b[2]),
        "rotation": 2.0 * min(distance(a[3], b[3]), distance(a[3], [-x for x in b[3]])),
        "sigma": max(abs(x / y - 1.0) for x, y in zip(a[4], b[4])),
        "features": abs(a[0] - b[0]),
    }


def main(first, second):
    a, b = read(first), read(second)
    failed = a.keys() != b.keys()
    if failed:
        print(f"not the same frames: {len(a)} and {len(b)} estimates")
    for part, tolerances in TOLERANCES.items():
        frames = [key for key in a if key[0] == part and key in b]
        if not frames:
            print(f"{part}: no estimate")
            failed = True
            continue
        worst = [differences(a[key], b[key]) for key in frames]
        for name, tolerance in tolerances.items():
            largest = max(difference[name] for difference in worst)
            verdict = "" if largest <= tolerance else "  TOO MUCH"
            failed = failed or largest > tolerance
            print(f"{part:8} {name:8} at most {largest:9.3g}, allowed {tolerance:g}, {len(frames)} frames{verdict}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
