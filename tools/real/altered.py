"""Recordings with something wrong in them: wrong rates, times, noise, units and wiring, sensors that end.

Nobody tuned to these. An estimate may be poor then, and may be refused; its health must not say "tracking" where it is far off.
"""

import bisect
import math
import random
import re
import shutil
from dataclasses import dataclass
from typing import Callable

from real.layout import NO_TURN, rotate, turned

GYRO, ACCEL = (1, 2, 3), (4, 5, 6)  # columns of imu0
CAMERAS = ("cam0", "cam1")
WHEELS = "encoder0"
BEAMS = "laser0"
TRUTHS = ("state_groundtruth_estimate0", "uwb0")
NO_SENSOR = ("state_groundtruth", "uwb", "ins_speed", "wheel_speed", "imu0_")  # truths, and originals that were made into others


class Copy:
    """A recording of our layout, copied into `folder`; images are links."""

    def __init__(self, recording, folder):
        self.mav0 = folder / "mav0"
        for source in sorted((recording / "mav0").iterdir()):
            target = self.mav0 / source.name
            if source.is_file():
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(source, target)
                continue
            target.mkdir(parents=True)
            for entry in source.iterdir():
                if entry.is_dir():
                    (target / entry.name).symlink_to(entry.resolve())
                else:
                    shutil.copyfile(entry, target / entry.name)

    def sensors(self):
        return sorted(p.parent.name for p in self.mav0.glob("*/data.csv") if not p.parent.name.startswith(NO_SENSOR))

    def rows(self, sensor):
        lines = (self.mav0 / sensor / "data.csv").read_text(encoding="utf-8").splitlines()
        return [line.split(",") for line in lines if line.strip() and not line.startswith("#")]

    def write(self, sensor, rows):
        text = "# altered\n" + "".join(",".join(row) + "\n" for row in rows)
        (self.mav0 / sensor / "data.csv").write_text(text, encoding="utf-8")

    def change(self, sensors, function):
        """`function`: rows to rows, for each of the sensors that there are."""
        for sensor in sensors:
            if (self.mav0 / sensor / "data.csv").exists():
                self.write(sensor, function(self.rows(sensor)))

    def rewrite(self, sensor, function):
        """sensor.yaml, if it is there, becomes `function` of what it was."""
        path = self.mav0 / sensor / "sensor.yaml"
        if path.exists():
            path.write_text(function(path.read_text(encoding="utf-8")), encoding="utf-8")

    def change_value(self, sensor, key, function):
        """A number in sensor.yaml, if it is there, becomes `function` of what it was. Returns that."""
        before = []

        def change(found):
            before.append(float(found[1]))
            return f"{key}: {function(before[0]):g}"

        self.rewrite(sensor, lambda text: re.sub(key + r": *([0-9.]+)", change, text, count=1))
        return before[0] if before else None

    def set_rate(self, sensor, divided_by):
        self.change_value(sensor, "rate_hz", lambda rate: rate / divided_by)


def each_value(columns, function):
    def change(rows):
        for row in rows:
            for column in columns:
                row[column] = repr(function(float(row[column]), column))
        return rows

    return change


def later(seconds):
    def change(rows):
        return [[str(int(row[0]) + round(1e9 * seconds)), *row[1:]] for row in rows]

    return change


def every(count):
    return lambda rows: rows[::count]


def means_of(count):
    def change(rows):
        groups = [rows[i : i + count] for i in range(0, len(rows) - count + 1, count)]
        mean = lambda group, column: repr(sum(float(row[column]) for row in group) / count)  # noqa: E731
        return [[str(sum(int(row[0]) for row in group) // count), *(mean(group, c) for c in GYRO + ACCEL)] for group in groups]

    return change


def without_part(begin, end):
    """Without the rows from one share of them to another."""
    return lambda rows: rows[: int(begin * len(rows))] + rows[int(end * len(rows)) :]


def slower_imu(count, change):
    def alter(copy):
        copy.change(["imu0"], change(count))
        copy.set_rate("imu0", count)

    return alter


def on(sensors, change):
    return lambda copy: copy.change(sensors, change)


def scattered_stamps(copy):
    draws, offsets = random.Random(1), {}
    milliseconds = lambda row: int(row[0]) // 10**6  # noqa: E731  both cameras alike
    for camera in CAMERAS:
        copy.change([camera], lambda rows: [
            [str(int(row[0]) + offsets.setdefault(milliseconds(row), round(draws.gauss(0.0, 3e6)))), *row[1:]] for row in rows])


def through_matrix(matrix, sensors=(GYRO,)):
    """What gyroscope or accelerometer measure that show what is there times this matrix."""
    def change(rows):
        for row in rows:
            for columns in sensors:
                for column, value in zip(columns, rotate(matrix, [float(row[column]) for column in columns])):
                    row[column] = repr(value)
        return rows

    return change


def noisy_imu(copy):
    draws = random.Random(3)
    copy.change(["imu0"], each_value(GYRO, lambda x, _: x + draws.gauss(0.0, 0.05)))
    copy.change(["imu0"], each_value(ACCEL, lambda x, _: x + draws.gauss(0.0, 0.5)))


def spikes(rows):
    """20 a minute, none within 0.1 s of another, of one to five samples that are off together."""
    draws, times = random.Random(7), [int(row[0]) for row in rows]
    at = times[0] + 3 * 10**9
    while at < times[-1]:
        first = bisect.bisect_left(times, at)
        off = [0.0, *(draws.gauss(0.0, 3.0) for _ in GYRO), *(draws.gauss(0.0, 40.0) for _ in ACCEL)]
        for row in rows[first : first + draws.randint(1, 5)]:
            row[1:] = [repr(float(row[column]) + off[column]) for column in GYRO + ACCEL]
        at += round(1e9 * (0.1 + draws.expovariate(1.0 / 2.9)))
    return rows


def lost_samples(copy):
    draws = random.Random(2)
    copy.change(["imu0"], lambda rows: [row for row in rows if draws.random() > 0.1])


def bursts(rows):
    """As a recorder that falls behind loses them: `husky` has eight such bursts a second, their lengths as here."""
    draws, kept, lost_until = random.Random(4), [], 0
    next_burst = int(rows[0][0])
    for row in rows:
        time = int(row[0])
        while time > next_burst:
            lost_until = next_burst + round(1e9 * min(0.1, draws.expovariate(1.0 / 0.02)))
            next_burst = max(lost_until, next_burst + round(1e9 * draws.expovariate(8.0)))
        if time > lost_until:
            kept.append(row)
    return kept


def from_middle(change):
    return lambda rows: rows[: len(rows) // 2] + change(rows[len(rows) // 2 :])


def repeated_samples(rows):
    """As a driver that hangs: half a second in ten."""
    begin, held = int(rows[0][0]) + 3 * 10**9, None
    for row in rows:
        hangs = int(row[0]) >= begin and (int(row[0]) - begin) % 10**10 < 5 * 10**8
        held = (held or row[1:]) if hangs else None
        row[1:] = held or row[1:]
    return rows


def lost_readings(rows):
    draws = random.Random(5)
    return [row for row in rows if draws.random() > 0.3]


def scattered_readings(rows):
    draws = random.Random(6)
    return sorted(([str(int(row[0]) + round(draws.gauss(0.0, 5e6))), *row[1:]] for row in rows), key=lambda row: int(row[0]))


def coarse_wheels(copy):
    """An encoder of 360 counts a turn; sensor.yaml says so."""
    coarser = 360 / copy.change_value(WHEELS, "resolution", lambda _: 360)
    copy.change_value(WHEELS, "noise_counts", lambda noise: max(1.0, noise * coarser))
    copy.change([WHEELS], lambda rows: [[time, *(str(math.floor(int(count) * coarser)) for count in counts)] for time, *counts in rows])


def slow_wheels(copy):
    """10 Hz."""
    rows = copy.rows(WHEELS)
    seconds = 1e-9 * (int(rows[-1][0]) - int(rows[0][0]))
    count = max(1, round(len(rows) / seconds / 10))
    copy.change([WHEELS], every(count))
    copy.set_rate(WHEELS, count)


def exchanged(a, b):
    def change(rows):
        for row in rows:
            row[a], row[b] = row[b], row[a]
        return rows

    return change


def stuck_left_wheel(rows):
    half = len(rows) // 2
    return rows[:half] + [[row[0], rows[half][1], row[2]] for row in rows[half:]]


def repeated_images(rows):
    """A driver that makes two frames of each."""
    later_rows = [[str((int(a[0]) + int(b[0])) // 2), *a[1:]] for a, b in zip(rows, rows[1:])]
    return [row for pair in zip(rows, later_rows) for row in pair] + rows[-1:]


def exchanged_images(copy):
    rows = {camera: copy.rows(camera) for camera in CAMERAS}
    folders = {camera: (copy.mav0 / camera / "data").resolve() for camera in CAMERAS}
    for camera, other in (CAMERAS, CAMERAS[::-1]):
        copy.write(camera, rows[other])
        (copy.mav0 / camera / "data").unlink()
        (copy.mav0 / camera / "data").symlink_to(folders[other])


def begin_late(copy):
    times = [int(row[0]) for row in copy.rows("imu0")]
    begin = times[0] + (times[-1] - times[0]) // 3
    copy.change(copy.sensors(), lambda rows: [row for row in rows if int(row[0]) >= begin])


LEANING = [[1.0, 0.01, 0.01], [0.01, 1.0, 0.01], [0.01, 0.01, 1.0]]
QUARTER_TURN = [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
YAWED, PITCHED = (turned(NO_TURN, axis) for axis in ([0.0, 0.0, -math.radians(5.0)], [0.0, math.radians(5.0), 0.0]))


@dataclass(frozen=True)
class Alteration:
    name: str
    what: str
    alter: Callable[[Copy], None]
    needs: tuple[str, ...] = ("imu0",)  # sensors without which it changes nothing


ALTERATIONS = [
    Alteration("nothing", "as it is", lambda copy: None),
    Alteration("camera_half", "every other image", on(CAMERAS, every(2)), ("cam0",)),
    Alteration("camera_third", "every third image", on(CAMERAS, every(3)), ("cam0",)),
    Alteration("camera_repeated", "each image comes twice, the second time half an interval later", on(CAMERAS, repeated_images), ("cam0",)),
    Alteration("camera_stamps", "stamps of the images scatter by 3 ms", scattered_stamps, ("cam0",)),
    Alteration("camera_late", "stamps of the images 50 ms late", on(CAMERAS, later(0.05)), ("cam0",)),
    Alteration("camera_ends", "no image in the second half", on(CAMERAS, without_part(0.5, 1.0)), ("cam0",)),
    Alteration("camera_gap", "no image in the third of five parts", on(CAMERAS, without_part(0.4, 0.6)), ("cam0",)),
    Alteration("right_ends", "no right image in the second half", on(["cam1"], without_part(0.5, 1.0)), ("cam1",)),
    Alteration("cameras_exchanged", "left and right images exchanged", exchanged_images, CAMERAS),
    Alteration("imu_means", "means of four inertial samples", slower_imu(4, means_of)),
    Alteration("imu_half", "every other inertial sample", slower_imu(2, every)),
    Alteration("imu_quarter", "every fourth inertial sample", slower_imu(4, every)),
    Alteration("imu_rate", "the same, and sensor.yaml states the rate of all", on(["imu0"], every(4))),
    Alteration("imu_lost", "a tenth of the inertial samples lost, at random", lost_samples),
    Alteration("imu_bursts", "inertial samples lost eight times a second, for up to 0.1 s", on(["imu0"], bursts)),
    Alteration("imu_frozen", "inertial samples repeat for half a second, every ten", on(["imu0"], repeated_samples)),
    Alteration("imu_late", "stamps of the inertial samples, which estimate and truth have, 20 ms late", on(["imu0", *TRUTHS], later(0.02))),
    Alteration("imu_very_late", "the same by 100 ms", on(["imu0", *TRUTHS], later(0.1))),
    Alteration("imu_noise", "white noise of 0.05 rad/s and 0.5 m/s^2 on each sample", noisy_imu),
    Alteration("imu_spikes", "spikes of one to five inertial samples, 20 a minute, of 3 rad/s and 40 m/s^2 per axis", on(["imu0"], spikes)),
    Alteration("gyro_bias", "gyroscope's bias of 0.05 rad/s in roll and yaw",
               on(["imu0"], each_value((1, 3), lambda x, column: x + (0.05 if column == 3 else -0.05)))),
    Alteration("gyro_jump", "gyroscope's bias jumps by 0.1 rad/s about all axes, in the middle",
               on(["imu0"], from_middle(each_value(GYRO, lambda x, column: x - 0.1 * (-1) ** column)))),
    Alteration("accel_jump", "accelerometer's bias jumps by 0.5 m/s^2 along all axes, in the middle",
               on(["imu0"], from_middle(each_value(ACCEL, lambda x, column: x + 0.5 * (-1) ** column)))),
    Alteration("gyro_scale", "gyroscope that measures 1 % too much", on(["imu0"], each_value(GYRO, lambda x, _: 1.01 * x))),
    Alteration("gyro_axes", "gyroscope whose axes measure 1 % of the turns about the other two", on(["imu0"], through_matrix(LEANING))),
    Alteration("accel_scale", "accelerometer that measures 1 % too much", on(["imu0"], each_value(ACCEL, lambda x, _: 1.01 * x))),
    Alteration("accel_axes", "accelerometer whose axes measure 1 % of the forces along the other two", on(["imu0"], through_matrix(LEANING, (ACCEL,)))),
    Alteration("accel_bias", "accelerometer's bias of 0.7 m/s^2 in x and y, nine times what the prior allows",
               on(["imu0"], each_value((4, 5), lambda x, column: x + (0.7 if column == 4 else -0.7)))),
    Alteration("imu_turned", "inertial sensors turned by 90 degrees about the vertical; so the mower's are right",
               on(["imu0"], through_matrix(QUARTER_TURN, (GYRO, ACCEL)))),
    Alteration("imu_yawed", "inertial sensors turned by 5 degrees about the vertical", on(["imu0"], through_matrix(YAWED, (GYRO, ACCEL)))),
    Alteration("imu_pitched", "the same about the left: until the vehicle turns, a slope", on(["imu0"], through_matrix(PITCHED, (GYRO, ACCEL)))),
    Alteration("gyro_degrees", "gyroscope in degrees per second", on(["imu0"], each_value(GYRO, lambda x, _: 57.29578 * x))),
    Alteration("accel_g", "accelerometer in g", on(["imu0"], each_value(ACCEL, lambda x, _: x / 9.80665))),
    Alteration("gyro_sign", "the yaw rate has the wrong sign", on(["imu0"], each_value((3,), lambda x, _: -x))),
    Alteration("wheels_exchanged", "left and right wheel exchanged", on([WHEELS], exchanged(1, 2)), (WHEELS,)),
    Alteration("wheels_sign", "wheels that count backwards",
               on([WHEELS], lambda rows: [[t, str(-int(left)), str(-int(right))] for t, left, right in rows]), (WHEELS,)),
    Alteration("wheel_ends", "the left wheel's counts stay, in the second half", on([WHEELS], stuck_left_wheel), (WHEELS,)),
    Alteration("wheels_lost", "three of ten readings of the wheels lost, at random", on([WHEELS], lost_readings), (WHEELS,)),
    Alteration("wheels_slow", "readings of the wheels at 10 Hz", slow_wheels, (WHEELS,)),
    Alteration("wheels_coarse", "wheels of 360 counts a turn", coarse_wheels, (WHEELS,)),
    Alteration("wheels_stamps", "stamps of the wheels scatter by 5 ms", on([WHEELS], scattered_readings), (WHEELS,)),
    Alteration("wheels_late", "stamps of the wheels 50 ms late", on([WHEELS], later(0.05)), (WHEELS,)),
    Alteration("beams_exchanged", "first and last beam exchanged", on([BEAMS], exchanged(1, 3)), (BEAMS,)),
    Alteration("beams_coarse", "beams that read in steps of 1 cm", on([BEAMS], each_value((1, 2, 3), lambda x, _: round(x, 2))), (BEAMS,)),
    Alteration("begins_late", "without the first third: it starts in motion", begin_late),
]


def altered(recording, alteration, folder):
    """A copy of the recording with the alteration in it, at `folder`, which is made anew; nothing where it lacks a sensor."""
    if not all((recording / "mav0" / sensor / "data.csv").exists() for sensor in alteration.needs):
        return None
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    alteration.alter(Copy(recording, folder))
    return folder


def cell(result):
    """What one run came to: ATE and false tracking, or "none" where there is no estimate."""
    if result is None:
        return ""
    if result["error"]:
        return "none"
    figures = result["figures"]
    if figures is None or figures.get("ate_rmse_m") is None:
        return "-"
    false = figures["false_tracking"]["percent"]
    return f"{figures['ate_rmse_m']:.3g}" + (f", **{false:.1f} %**" if false > 0.05 else "")


def table(results, names):
    """Markdown; `results`: by alteration, then by recording."""
    lines = ["| | " + " | ".join(names) + " |", "|---" * (len(names) + 1) + "|"]
    for alteration in ALTERATIONS:
        if alteration.name not in results:
            continue
        row = results[alteration.name]
        lines.append(f"| `{alteration.name}`: {alteration.what} | " + " | ".join(cell(row.get(name)) for name in names) + " |")
    return "\n".join(lines)
