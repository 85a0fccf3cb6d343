"""A run of the robot of a course at UCSD: EncodersN.npz and ImuN.npz in one folder, arrays of numpy, times in seconds.

Four wheels, skid-steered: those of one side count together. The stamps are those of arrival, of wheels and IMU alike. The
effective track width is that by which wheels and gyroscope agree; by ruler it is 0.394 m. The noise of the IMU is a guess."""

from real.layout import (ENCODER_FIELDS, IDENTITY, IMU_FIELDS, BadInput, Recording, encoder_yaml, growing, imu_yaml, rate,
                         read_archive)

RADIUS = 0.127  # [m] by ruler
TRACK = 0.753  # [m] effective
COUNTS = 720  # of two wheels in a revolution
GRAVITY = 9.80665  # [m/s^2] of the unit of the accelerometer


def only(folder, pattern):
    found = sorted(folder.glob(pattern))
    if len(found) != 1:
        raise BadInput(f"{folder}: {len(found)} files {pattern} where one is expected: a folder for each run")
    return found[0]


def read(path, names):
    arrays = read_archive(path, ["time_stamps", *names])
    times = growing([round(row * 1e9) for row in arrays["time_stamps"][0]], path)
    for name in names:
        if len(arrays[name]) != len(times):
            raise BadInput(f"{path}: {len(arrays[name])} columns of {name}, but {len(times)} time_stamps")
    return times, arrays


def read_encoder(path):
    """Counts since the first reading; the file has those since the reading before, front right and left, rear the same."""
    times, arrays = read(path, ["counts"])
    left, right, rows = 0, 0, []
    for time, wheels in zip(times, arrays["counts"]):
        if len(wheels) != 4:
            raise BadInput(f"{path}: counts of {len(wheels)} wheels where 4 are expected")
        left, right = left + round(wheels[1] + wheels[3]), right + round(wheels[0] + wheels[2])
        rows.append((time, [str(left), str(right)]))
    return rows


def read_imu(path):
    times, arrays = read(path, ["angular_velocity", "linear_acceleration"])
    return [(t, [*w, *(GRAVITY * x for x in a)])
            for t, w, a in zip(times, arrays["angular_velocity"], arrays["linear_acceleration"])]


def convert(folder, out):
    encoder, imu = read_encoder(only(folder, "Encoders*.npz")), read_imu(only(folder, "Imu*.npz"))
    with Recording(out) as recording:
        recording.write("imu0", IMU_FIELDS, imu,
                        imu_yaml("of a skid-steered robot", rate([t for t, _ in imu]), (1e-3, 2e-5), (2e-2, 1e-3)))
        recording.write("encoder0", ENCODER_FIELDS, encoder,
                        encoder_yaml("two wheels on each side", IDENTITY, rate([t for t, _ in encoder]), COUNTS, RADIUS,
                                     TRACK, 1.0))
    return ["there is no truth; the track width is an effective one, and the noise a guess: see the sensor.yaml files"]
