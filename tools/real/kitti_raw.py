"""A drive of KITTI raw: DATE/DATE_drive_NNNN_{extract,sync}/{oxts,image_00,image_01}, and DATE/calib_*.txt.

The body is the OXTS, x forward, y left, z up. Its packets come at 100 Hz in the extract, at 10 Hz with the images in the
sync, which is too slow: with a sync, whose images are rectified, the packets are those of the extract beside it. The images
of an extract are as they were taken, and its calibration has the lenses. The truth is the OXTS's own solution, RTK GPS and
inertial, so its attitude shares the gyroscopes with what is estimated."""

import math

from real.layout import (IMU_FIELDS, BadInput, Recording, camera_yaml, date_ns, imu_yaml, inverse, multiply, number, pose,
                         quaternion, rate, read_lines)

EARTH = 6378137.0  # [m] radius of KITTI's Mercator projection
OXTS = ("lat lon alt roll pitch yaw vn ve vf vl vu ax ay az af al au wx wy wz wf wl wu pos_accuracy vel_accuracy navstat numsats "
        "posmode velmode orimode").split()


def read_calibration(path):
    """Numbers by key; lines without any, as the date, are left out."""
    entries = {}
    for line, text in enumerate(read_lines(path), start=1):
        key, colon, rest = text.partition(":")
        if colon and key.strip() != "calib_time":
            entries[key.strip()] = [number(word, f"{path}:{line}", key.strip()) for word in rest.split()]

    def entry(key, count):
        if key not in entries:
            raise BadInput(f"{path}: {key}: is missing")
        if len(entries[key]) != count:
            raise BadInput(f"{path}: {key}: {len(entries[key])} numbers where {count} are expected")
        return entries[key]

    return entry


def square(values):
    return [values[0:3], values[3:6], values[6:9]]


def read_pose(entry, suffix=""):
    return pose(square(entry("R" + suffix, 9)), entry("T" + suffix, 3))


def cameras(folder, rectified):
    """Of both grey cameras: T_BS, size, intrinsics and distortion."""
    cam = read_calibration(folder / "calib_cam_to_cam.txt")
    T_C0B = multiply(read_pose(read_calibration(folder / "calib_velo_to_cam.txt")),
                     read_pose(read_calibration(folder / "calib_imu_to_velo.txt")))
    result = []
    for suffix in ("_00", "_01"):
        if rectified:
            P, size = cam("P_rect" + suffix, 12), cam("S_rect" + suffix, 2)
            K, distortion = [P[0], P[5], P[2], P[6]], []
            shift = [(P[3] - P[2] * P[11]) / P[0], (P[7] - P[6] * P[11]) / P[5], P[11]]
            T_CC0 = pose(square(cam("R_rect_00", 9)), shift)
        else:
            k, size, distortion = cam("K" + suffix, 9), cam("S" + suffix, 2), cam("D" + suffix, 5)
            K, T_CC0 = [k[0], k[4], k[2], k[5]], read_pose(cam, suffix)
        result.append((inverse(multiply(T_CC0, T_C0B)), [round(x) for x in size], K, distortion))
    return result


def read_times(path):
    times = [date_ns(text, f"{path}:{line}") for line, text in enumerate(read_lines(path), start=1) if text.strip()]
    if not times:
        raise BadInput(f"{path}: holds no times")
    return times


def read_images(folder):
    times = read_times(folder / "timestamps.txt")
    images = sorted((folder / "data").glob("*.png"))
    rows = [(times[int(image.stem)], image) for image in images if image.stem.isdigit() and int(image.stem) < len(times)]
    if not rows:
        raise BadInput(f"{folder / 'data'}: holds no images")
    return rows, len(images) - len(rows)


def read_packets(oxts):
    """Packets (time [ns], values by name), and how many were left out because their stamp does not grow."""
    times, packets, left_out = read_times(oxts / "timestamps.txt"), [], 0
    for i, time in enumerate(times):
        path = oxts / "data" / f"{i:010d}.txt"
        if not path.exists():  # KITTI has a few such gaps itself
            left_out += 1
            continue
        words = " ".join(read_lines(path)).split()
        if len(words) != len(OXTS):
            raise BadInput(f"{path}:1: {len(words)} fields where {len(OXTS)} are expected: the line is torn")
        if packets and time <= packets[-1][0]:
            left_out += 1
            continue
        packets.append((time, {field: number(word, f"{path}:1", field) for field, word in zip(OXTS, words)}))
    if len(packets) < 2:
        raise BadInput(f"{oxts / 'data'}: holds {len(packets)} usable packets")
    return packets, left_out


def read_truth(packets):
    first = packets[0][1]
    scale = math.cos(math.radians(first["lat"]))

    def position(o):
        return [scale * EARTH * math.radians(o["lon"]),
                scale * EARTH * math.log(math.tan(math.radians(90.0 + o["lat"]) / 2.0)), o["alt"]]

    origin = position(first)
    for time, o in packets:
        (sr, cr), (sp, cp), (sy, cy) = ((math.sin(o[a]), math.cos(o[a])) for a in ("roll", "pitch", "yaw"))
        R = [[cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
             [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
             [-sp, cp * sr, cp * cr]]
        yield time, [a - b for a, b in zip(position(o), origin)], quaternion(R), [o["ve"], o["vn"], o["vu"]]


def convert(folder, out):
    rectified = not folder.name.endswith("_extract")
    source = folder.with_name(folder.name.removesuffix("_sync") + "_extract") if rectified else folder
    if not (source / "oxts").is_dir():
        raise BadInput(f"{source / 'oxts'}: is missing: the packets at 100 Hz are in the extract (the sync's have 10 Hz)")
    packets, left_out = read_packets(source / "oxts")
    with Recording(out) as recording:
        rows = [(t, [o[name] for name in ("wx", "wy", "wz", "ax", "ay", "az")]) for t, o in packets]
        times = [t for t, _ in rows]
        recording.write("imu0", IMU_FIELDS, rows, imu_yaml("OXTS RT3003; the noise is a cautious guess", rate(times),
                                                           (1e-3, 1e-5), (5e-2, 1e-3)))
        without_time = 0
        for name, source_name, camera in zip(("cam0", "cam1"), ("image_00", "image_01"), cameras(folder.parent, rectified)):
            images, extra = read_images(folder / source_name)
            without_time += extra
            recording.link_images(name, images)
            recording.write_yaml(name, camera_yaml("KITTI grey " + source_name, rate([t for t, _ in images]), *camera))
        recording.write_truth(read_truth(packets))
    notes = ["the noise of the IMU is a guess: see imu0/sensor.yaml"]
    if left_out:
        notes.append(f"{left_out} packets are missing or not later than the one before: left out")
    if without_time:
        notes.append(f"{without_time} images without a time: left out")
    return notes
