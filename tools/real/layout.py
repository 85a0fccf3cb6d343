"""Files of others in, recordings of ours out (docs/recordings.md). Bad input is a BadInput that names file, line and field."""

import array
import ast
import math
import re
import shutil
import sys
import zipfile
from datetime import datetime, timezone


class BadInput(Exception):
    """What is wrong with a file that was given, and where."""


# ---- in ----------------------------------------------------------------------------------------------------------------


def read_lines(path):
    try:
        return path.read_text(encoding="utf-8").splitlines()
    except FileNotFoundError:
        raise BadInput(f"{path}: is missing") from None
    except (OSError, UnicodeDecodeError) as error:
        raise BadInput(f"{path}: cannot be read: {error}") from None


def number(text, where, field):
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise BadInput(f"{where}: {field}: '{text.strip()}' is no finite number")
    return value


def stamp(text, where):
    if not re.fullmatch(r"\s*\d+\s*", text):
        raise BadInput(f"{where}: timestamp: '{text.strip()}' is not a whole number of nanoseconds")
    return int(text)


def read_csv(path, fields):
    """Rows (where, time [ns], rest) of a csv with these fields, the first of them a stamp that grows."""
    rows, last = [], None
    for line, text in enumerate(read_lines(path), start=1):
        if not text.strip() or text.lstrip().startswith("#"):
            continue
        where, parts = f"{path}:{line}", text.split(",")
        if len(parts) != len(fields):
            raise BadInput(f"{where}: {len(parts)} fields where {len(fields)} are expected: the line is torn")
        time = stamp(parts[0], where)
        if last is not None and time <= last:
            raise BadInput(f"{where}: timestamp: not later than the line before")
        last = time
        rows.append((where, time, [part.strip() for part in parts[1:]]))
    if not rows:
        raise BadInput(f"{path}: holds no rows")
    return rows


def read_numbers(path, fields):
    """The same with numbers: rows (time [ns], values)."""
    return [(time, [number(part, where, field) for part, field in zip(parts, fields[1:])])
            for where, time, parts in read_csv(path, fields)]


def read_array(path, columns):
    """Rows of a two-dimensional .npy file of numbers, or of a one-dimensional one where `columns` is 1."""
    try:
        return parse_array(path.read_bytes(), path, columns)
    except FileNotFoundError:
        raise BadInput(f"{path}: is missing") from None


def read_archive(path, names):
    """Arrays of a .npz file, by name: columns as lists, so that an array of c x n has n columns of c."""
    try:
        with zipfile.ZipFile(path) as archive:
            members = {name: archive.read(name + ".npy") for name in names}
    except FileNotFoundError:
        raise BadInput(f"{path}: is missing") from None
    except KeyError as error:
        raise BadInput(f"{path}: {error.args[0]}") from None
    except (zipfile.BadZipFile, EOFError, OSError) as error:
        raise BadInput(f"{path}: cannot be read: {error}") from None
    return {name: transpose(parse_array(data, f"{path}, {name}")) for name, data in members.items()}


def parse_array(data, path, columns=None):
    """Rows of the bytes of a .npy file; as many columns as there are where it is not said."""
    if data[:6] != b"\x93NUMPY" or len(data) < 12:
        raise BadInput(f"{path}: is no numpy array")
    begin, size = (10, int.from_bytes(data[8:10], "little")) if data[6] == 1 else (12, int.from_bytes(data[8:12], "little"))
    try:
        header = ast.literal_eval(data[begin : begin + size].decode("latin1").strip())
        kind, shape, fortran = header["descr"], header["shape"], header["fortran_order"]
    except (SyntaxError, ValueError, KeyError, TypeError):
        raise BadInput(f"{path}: the header of the array is torn") from None
    codes = {"<f8": "d", "<f4": "f", "<i8": "q", "<i2": "h"}
    if kind not in codes or len(shape) not in (1, 2):
        raise BadInput(f"{path}: an array of {kind} with shape {shape}: only one or two dimensions of {', '.join(codes)} are read")
    width = shape[1] if len(shape) == 2 else 1
    if columns is not None and width != columns:
        raise BadInput(f"{path}: {width} columns where {columns} are expected")
    values = array.array(codes[kind])
    body = data[begin + size :]
    if len(body) != shape[0] * width * values.itemsize:
        raise BadInput(f"{path}: {len(body)} bytes for {shape[0]} rows of {width}: the file is torn")
    values.frombytes(body)
    if sys.byteorder == "big":
        values.byteswap()
    rows = [list(values[i :: shape[0]] if fortran else values[i * width : (i + 1) * width]) for i in range(shape[0])]
    for i, row in enumerate(rows):
        for column, value in enumerate(row):
            if not math.isfinite(value):
                raise BadInput(f"{path}: row {i}, column {column}: {value} is no finite number")
    return rows


def growing(times, path):
    for i, (a, b) in enumerate(zip(times, times[1:])):
        if b <= a:
            raise BadInput(f"{path}: row {i + 1}: the time is not later than that of the row before")
    return times


def date_ns(text, where):
    """'2011-09-26 13:02:25.964389445' in UTC [ns]."""
    match = re.fullmatch(r"\s*(\d{4}-\d\d-\d\d \d\d:\d\d:\d\d)(?:\.(\d{1,9}))?\s*", text)
    if not match:
        raise BadInput(f"{where}: timestamp: '{text.strip()}' is no date and time")
    try:
        seconds = datetime.strptime(match[1], "%Y-%m-%d %H:%M:%S").replace(tzinfo=timezone.utc)
    except ValueError:
        raise BadInput(f"{where}: timestamp: '{text.strip()}' is no date and time") from None
    return int(seconds.timestamp()) * 1_000_000_000 + int((match[2] or "0").ljust(9, "0"))


# ---- rotations and poses, as lists of rows ------------------------------------------------------------------------------

NO_TURN = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]


def multiply(A, B):
    return [[sum(a * b for a, b in zip(row, column)) for column in zip(*B)] for row in A]


def transpose(A):
    return [list(column) for column in zip(*A)]


def rotate(R, v):
    return [sum(a * b for a, b in zip(row, v)) for row in R]


def pose(R, p):
    """4 x 4: x_A = R x_B + p."""
    return [[*row, x] for row, x in zip(R, p)] + [[0.0, 0.0, 0.0, 1.0]]


def inverse(T):
    R = transpose([row[:3] for row in T[:3]])
    return pose(R, [-x for x in rotate(R, [row[3] for row in T[:3]])])


def matrix(w, x, y, z):
    """Rotation of a Hamilton quaternion."""
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]


def turned(R, v):
    """R Exp(v)."""
    angle = math.sqrt(sum(a * a for a in v))
    if angle < 1e-12:
        return R
    s = math.sin(angle / 2) / angle
    return multiply(R, matrix(math.cos(angle / 2), *(s * a for a in v)))


def quaternion(R):
    """w, x, y, z with w >= 0, by the largest of the four."""
    squares = [1 + R[0][0] + R[1][1] + R[2][2], 1 + R[0][0] - R[1][1] - R[2][2],
               1 - R[0][0] + R[1][1] - R[2][2], 1 - R[0][0] - R[1][1] + R[2][2]]
    largest = max(range(4), key=lambda i: squares[i])
    d = 2 * math.sqrt(squares[largest])
    x, y, z = (R[2][1] - R[1][2]) / d, (R[0][2] - R[2][0]) / d, (R[1][0] - R[0][1]) / d
    a, b, c = (R[0][1] + R[1][0]) / d, (R[0][2] + R[2][0]) / d, (R[1][2] + R[2][1]) / d
    q = [[d / 4, x, y, z], [x, d / 4, a, b], [y, a, d / 4, c], [z, b, c, d / 4]][largest]
    return [-v for v in q] if q[0] < 0 else q


FLIP = [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]]  # [forward, right, down] to [forward, left, up], and back


def trapezoids(rows):
    """The integrals, from the first row on, of rows (time [ns], values per second): rows of the same times."""
    sums, result = [0.0] * len(rows[0][1]), []
    for i, (time, values) in enumerate(rows):
        if i > 0:
            before, last = rows[i - 1]
            half = 0.5e-9 * (time - before)
            sums = [x + half * (a + b) for x, a, b in zip(sums, last, values)]
        result.append((time, sums))
    return result


# ---- out ---------------------------------------------------------------------------------------------------------------

IMU_FIELDS = "timestamp [ns],w_x [rad/s],w_y [rad/s],w_z [rad/s],a_x [m/s^2],a_y [m/s^2],a_z [m/s^2]"
TRUTH_FIELDS = ("timestamp [ns],p_x [m],p_y [m],p_z [m],q_w [],q_x [],q_y [],q_z [],v_x [m/s],v_y [m/s],v_z [m/s],"
                "b_w_x [rad/s],b_w_y [rad/s],b_w_z [rad/s],b_a_x [m/s^2],b_a_y [m/s^2],b_a_z [m/s^2]")
ENCODER_FIELDS = "timestamp [ns],left [count],right [count]"


class Recording:
    """A folder that is there as a whole or not at all: `with Recording(out) as recording: ...`."""

    def __init__(self, out):
        self.out = out
        self.part = out.with_name(out.name + ".part")

    def __enter__(self):
        if self.out.exists():
            raise BadInput(f"{self.out}: is there already")
        shutil.rmtree(self.part, ignore_errors=True)
        (self.part / "mav0").mkdir(parents=True)
        return self

    def __exit__(self, kind, _error, _trace):
        if kind is None:
            self.part.rename(self.out)
        else:
            shutil.rmtree(self.part, ignore_errors=True)

    def sensor(self, name):
        folder = self.part / "mav0" / name
        folder.mkdir(exist_ok=True)
        return folder

    def write(self, sensor, heading, rows, yaml=None):
        """Rows of a stamp and texts or numbers."""
        folder = self.sensor(sensor)
        with (folder / "data.csv").open("w", encoding="utf-8") as file:
            file.write("#" + heading + "\n")
            for time, values in rows:
                file.write(",".join([str(time), *(v if isinstance(v, str) else f"{v:.9g}" for v in values)]) + "\n")
        if yaml is not None:
            (folder / "sensor.yaml").write_text(yaml, encoding="utf-8")

    def write_truth(self, rows):
        """Rows (time [ns], p, q, v)."""
        full = [(t, [f"{x:.9f}" for x in [*p, *q, *v]] + ["0"] * 6) for t, p, q, v in rows]
        self.write("state_groundtruth_estimate0", TRUTH_FIELDS, full)

    def link_images(self, sensor, images):
        """Rows of a stamp and the path of an image: links to it, so that a recording takes no room of its own."""
        folder = self.sensor(sensor) / "data"
        folder.mkdir(exist_ok=True)
        rows = []
        for time, image in images:
            if not image.is_file():
                raise BadInput(f"{image}: is missing")
            name = f"{time}{image.suffix}"
            (folder / name).symlink_to(image.resolve())
            rows.append((time, [name]))
        self.write(sensor, "timestamp [ns],filename", rows)

    def write_yaml(self, sensor, yaml):
        (self.sensor(sensor) / "sensor.yaml").write_text(yaml, encoding="utf-8")


def pose_yaml(T):
    rows = ",\n         ".join(", ".join(f"{x:.12g}" for x in row) for row in T)
    return f"T_BS:\n  rows: 4\n  cols: 4\n  data: [{rows}]\n"


IDENTITY = pose(NO_TURN, [0.0, 0.0, 0.0])


def imu_yaml(comment, rate_hz, gyroscope, accelerometer):
    """Noise: density and random walk of each, in SI."""
    return (f"sensor_type: imu\ncomment: {comment}\n" + pose_yaml(IDENTITY) + f"rate_hz: {rate_hz:g}\n"
            f"gyroscope_noise_density: {gyroscope[0]:.3e}\ngyroscope_random_walk: {gyroscope[1]:.3e}\n"
            f"accelerometer_noise_density: {accelerometer[0]:.3e}\naccelerometer_random_walk: {accelerometer[1]:.3e}\n")


def encoder_yaml(comment, T_BS, rate_hz, counts, radius, track, noise):
    """`counts` of a revolution; `radius`, `track` [m]; `noise` [counts]."""
    return (f"sensor_type: wheel_encoder\ncomment: {comment}\n" + pose_yaml(T_BS) + f"rate_hz: {rate_hz:.0f}\n"
            f"resolution: {counts}\nwraps: false\nwheel_radius: [{radius}, {radius}]\nwheel_separation: {track}\n"
            f"noise_counts: {noise}\n")


def camera_yaml(comment, rate_hz, T_BS, size, intrinsics, distortion):
    model = "radial-tangential" if any(distortion) else "none"
    coefficients = ", ".join(f"{x:.9g}" for x in distortion) if any(distortion) else ""
    return (f"sensor_type: camera\ncomment: {comment}\n" + pose_yaml(T_BS) + f"rate_hz: {rate_hz:g}\n"
            f"resolution: [{size[0]}, {size[1]}]\ncamera_model: pinhole\n"
            f"intrinsics: [{', '.join(f'{x:.9g}' for x in intrinsics)}]\n"
            f"distortion_model: {model}\n" + (f"distortion_coefficients: [{coefficients}]\n" if coefficients else ""))


def rate(times):
    """Of the median interval [Hz]."""
    intervals = sorted(b - a for a, b in zip(times, times[1:]))
    return 1e9 / intervals[len(intervals) // 2] if intervals else 0.0
