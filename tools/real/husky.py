"""A drive of a Husky of a course at Michigan: the folder Parking of their repository, csv files with times in two columns.

Four wheels, skid-steered, whose controller says 10 times a second how fast each side turns; counts are integrated from that.
The IMU is the sound one of two (gx5_1); its axes [right, back, down] were told from the drive. The effective track width is
that of the maker's controller. The truth is stereo SLAM; its axes [forward, right, down] become forward, left, up. Where the
recorder fell behind, speeds are missing for seconds: the recording ends at the first such gap. Of the other IMU (gx5_0) the
gyroscope has a bias of 0.55 rad/s."""

import math

from real.layout import (ENCODER_FIELDS, FLIP, IDENTITY, IMU_FIELDS, BadInput, Recording, encoder_yaml, growing, imu_yaml,
                         matrix, multiply, number, quaternion, rate, read_lines, rotate, stamp, transpose, trapezoids)

RADIUS = 0.1651  # [m] of the maker
TRACK = 1.0703  # [m] effective: 0.5708 by ruler, times 1.875 of the maker's controller
COUNTS = 262144
LONGEST_GAP = 1_000_000_000  # [ns] between two readings of the speeds
TURN = [[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]  # [right, back, down] to [forward, left, up]


def read_rows(path, fields):
    """Rows (time [ns], values) of a csv with a heading, whose first columns are seconds and nanoseconds."""
    lines = [text.split(",") for text in read_lines(path)]
    expected = ["Sec", "NanoSec", "0-ref Sec", *fields]
    if not lines or [field.lstrip("\ufeff") for field in lines[0]] != expected:
        raise BadInput(f"{path}:1: fields other than {','.join(expected)}")
    rows = []
    for line, parts in enumerate(lines[1:], start=2):
        where = f"{path}:{line}"
        if len(parts) != len(expected):
            raise BadInput(f"{where}: {len(parts)} fields where {len(expected)} are expected: the line is torn")
        time = stamp(parts[0], where) * 1_000_000_000 + round(number(parts[1], where, "NanoSec"))
        rows.append((time, [number(part, where, field) for part, field in zip(parts[3:], fields)]))
    if not rows:
        raise BadInput(f"{path}: holds no rows")
    growing([time for time, _ in rows], path)
    return rows


def until_gap(rows):
    gaps = (i for i in range(1, len(rows)) if rows[i][0] - rows[i - 1][0] > LONGEST_GAP)
    return rows[: next(gaps, len(rows))]


def convert(folder, out):
    speeds = until_gap(read_rows(folder / "Encoder_data_parking.csv", ["w_left", "w_right"]))
    encoder = [(t, [str(round(r * COUNTS / (2.0 * math.pi))) for r in turned]) for t, turned in trapezoids(speeds)]
    end = encoder[-1][0]
    imu = [(t, [*rotate(TURN, row[3:]), *rotate(TURN, row[:3])])
           for t, row in read_rows(folder / "gx5_1_IMU_data_parking.csv", ["a_x", "a_y", "a_z", "w_x", "w_y", "w_z"]) if t <= end]
    truth = []
    for t, (x, y, z, qx, qy, qz, qw) in read_rows(folder / "Camera_ground_truth_parking.csv",
                                                  ["X", "Y", "Z", "qX", "qY", "qZ", "qW"]):
        if t <= end:
            R = multiply(multiply(FLIP, matrix(qw, qx, qy, qz)), transpose(FLIP))
            truth.append((t, rotate(FLIP, [x, y, z]), quaternion(R), [0.0, 0.0, 0.0]))
    with Recording(out) as recording:
        recording.write("imu0", IMU_FIELDS, imu, imu_yaml("gx5_1, turned to forward, left, up", rate([t for t, _ in imu]),
                                                          (1e-3, 2e-5), (2e-2, 1e-3)))
        recording.write("encoder0", ENCODER_FIELDS, encoder,
                        encoder_yaml("integrated from the speeds of the two sides", IDENTITY, rate([t for t, _ in encoder]),
                                     COUNTS, RADIUS, TRACK, 400.0))
        recording.write_truth(truth)
    return ["where the IMU is between the wheels, the track width and the noise are guesses: see the sensor.yaml files"]
