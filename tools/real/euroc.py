"""EuRoC MAV as ASL publishes it: SEQUENCE/mav0/{imu0,cam0,cam1,state_groundtruth_estimate0}. It is our layout, so nothing is
changed: every row is read, every image looked for, images are linked."""

from real.layout import IMU_FIELDS, TRUTH_FIELDS, BadInput, Recording, read_csv, read_lines, read_numbers


def copy_yaml(mav0, recording, sensor):
    text = "\n".join(read_lines(mav0 / sensor / "sensor.yaml")) + "\n"
    if "T_BS" not in text:
        raise BadInput(f"{mav0 / sensor / 'sensor.yaml'}: T_BS: is missing")
    recording.write_yaml(sensor, text)


def copy_numbers(mav0, recording, sensor, heading):
    path = mav0 / sensor / "data.csv"
    read_numbers(path, heading.split(","))
    (recording.sensor(sensor) / "data.csv").write_text("\n".join(read_lines(path)) + "\n", encoding="utf-8")


def convert(folder, out):
    mav0 = folder / "mav0" if (folder / "mav0").is_dir() else folder
    with Recording(out) as recording:
        copy_numbers(mav0, recording, "imu0", IMU_FIELDS)
        copy_yaml(mav0, recording, "imu0")
        for camera in ("cam0", "cam1"):
            if (mav0 / camera).exists():
                rows = read_csv(mav0 / camera / "data.csv", ["timestamp", "filename"])
                recording.link_images(camera, [(time, mav0 / camera / "data" / name) for _, time, (name,) in rows])
                copy_yaml(mav0, recording, camera)
        if (mav0 / "state_groundtruth_estimate0").exists():
            copy_numbers(mav0, recording, "state_groundtruth_estimate0", TRUTH_FIELDS)
            return []
    return ["no state_groundtruth_estimate0: nothing to compare an estimate with"]
