"""A segment of comma2k19: ROUTE/SEGMENT/{processed_log,global_pose}, arrays of numpy, times in seconds since boot.

The body is the phone: its axes [forward, right, down] become forward, left, up. The gyroscope is the one without the phone's
own correction, which jumps. The wheels' counts are integrated from the speeds of the rear wheels. Where the rear axle is in
the phone is a guess, and the noise of the IMU that of phones. The images are a video of one rolling shutter: left out."""

import math

from real.layout import (ENCODER_FIELDS, FLIP, IMU_FIELDS, BadInput, Recording, encoder_yaml, growing, imu_yaml, matrix,
                         multiply, pose, quaternion, rate, read_array, rotate, transpose, trapezoids)

RADIUS = 0.34  # [m] nominal
TRACK = 1.57  # [m] of a RAV4
COUNTS = 262144
AXLE = [-1.6, 0.0, -1.3]  # [m] from the windscreen, by eye


def read_times(path):
    return growing([round(row[0] * 1e9) for row in read_array(path, 1)], path)


def read_log(folder, columns):
    times, values = read_times(folder / "t"), read_array(folder / "value", columns)
    if len(times) != len(values):
        raise BadInput(f"{folder / 'value'}: {len(values)} rows, but {folder / 't'} has {len(times)}")
    return times, values


def read_imu(log):
    times, gyroscope = read_log(log / "IMU/gyro_uncalibrated", 3)
    others, accelerometer = read_log(log / "IMU/accelerometer", 3)
    if times != others:
        raise BadInput(f"{log / 'IMU/accelerometer/t'}: has other times than {log / 'IMU/gyro_uncalibrated/t'}")
    return [(t, [*rotate(FLIP, w), *rotate(FLIP, a)]) for t, w, a in zip(times, gyroscope, accelerometer)]


def read_encoder(log):
    """Counts of the rear wheels: trapezoids of their speeds."""
    times, speeds = read_log(log / "CAN/wheel_speed", 4)
    per_metre = COUNTS / (2.0 * math.pi * RADIUS)
    rolled = trapezoids([(time, wheels[2:]) for time, wheels in zip(times, speeds)])
    return [(time, [str(round(r * per_metre)) for r in metres]) for time, metres in rolled]


def east_north_up(p):
    """Rows of the rotation from the earth's frame to east, north, up at the position p [m], on the WGS 84 ellipsoid."""
    a, e2 = 6378137.0, 6.69437999014e-3
    longitude, flat = math.atan2(p[1], p[0]), math.hypot(p[0], p[1])
    latitude = math.atan2(p[2], flat * (1.0 - e2))
    for _ in range(5):
        latitude = math.atan2(p[2] + e2 * a / math.sqrt(1.0 - e2 * math.sin(latitude) ** 2) * math.sin(latitude), flat)
    sa, ca, so, co = math.sin(latitude), math.cos(latitude), math.sin(longitude), math.cos(longitude)
    return [[-so, co, 0.0], [-sa * co, -sa * so, ca], [ca * co, ca * so, sa]]


def read_truth(poses):
    times = read_times(poses / "frame_times")
    arrays = {}
    for name, columns in (("positions", 3), ("velocities", 3), ("orientations", 4)):
        arrays[name] = read_array(poses / f"frame_{name}", columns)
        if len(arrays[name]) != len(times):
            raise BadInput(f"{poses / f'frame_{name}'}: {len(arrays[name])} rows, but frame_times has {len(times)}")
    origin, R = arrays["positions"][0], east_north_up(arrays["positions"][0])
    for time, p, v, q in zip(times, *arrays.values()):
        R_WB = multiply(multiply(R, matrix(*q)), transpose(FLIP))
        yield time, rotate(R, [x - o for x, o in zip(p, origin)]), quaternion(R_WB), rotate(R, v)


def convert(folder, out):
    log = folder / "processed_log"
    imu, encoder, truth = read_imu(log), read_encoder(log), list(read_truth(folder / "global_pose"))
    with Recording(out) as recording:
        recording.write("imu0", IMU_FIELDS, imu, imu_yaml("phone on the windscreen, turned to forward, left, up",
                                                          rate([t for t, _ in imu]), (5e-4, 2e-5), (1e-2, 5e-4)))
        recording.write("encoder0", ENCODER_FIELDS, encoder,
                        encoder_yaml("integrated from the speeds of the rear wheels",
                                     pose([[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0]], AXLE), rate([t for t, _ in encoder]),
                                     COUNTS, RADIUS, TRACK, 200.0))
        recording.write_truth(truth)
    return ["where the rear axle is, the wheels' radius and the noise are guesses: see the sensor.yaml files"]
