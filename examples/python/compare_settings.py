"""Two settings over simulated seeds, with a plot: compare_settings.py PLOT.svg [SEEDS [SECONDS]]

What does the paper's model of the wheels bring over wheels that roll along the body? Both see the same ten drives.
"""

import statistics
import sys
from pathlib import Path

import ear
import plot

FIRST_SEED = 831


def position_error(simulation, model):
    """RMSE of the position [m]."""
    config = ear.FilterConfig()
    config.odometer.model = model
    estimates = ear.replay(simulation, ear.Filter(simulation.calibration, config))
    return ear.evaluate(estimates, simulation)["ate_rmse_m"]


def main(file, seeds=10, seconds=25.0):
    errors = {"terrain": [], "gyro": []}
    for seed in range(FIRST_SEED, FIRST_SEED + seeds):
        simulation = ear.Simulation("slope", seed=seed, duration=seconds, calibration_error=1.0)
        for model, found in errors.items():
            found.append(position_error(simulation, model))
    for model, found in errors.items():
        print(f"{model:8} median {statistics.median(found):.4f} m, worst {max(found):.4f} m of {len(found)} drives")
    title = f"Position error (RMSE) over {seeds} drives of `slope`, by odometer.model"
    Path(file).write_text(plot.groups(title, "m", errors), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1], *(int(n) for n in sys.argv[2:3]), *(float(n) for n in sys.argv[3:4]))
