"""Frames from a camera's Python library into the estimator: camera_frames.py RECORDING

What a stereo camera with an IMU delivers is a stream of NumPy images and inertial samples with stamps. `Camera` stands in
for the library of yours: it hands out those of a recording. The rest is what a program needs.
"""

import sys

import ear


class Camera:
    """In place of a camera's library: calls back with (t_ns, left, right) and (t_ns, gyro [rad/s], accel [m/s^2])."""

    def __init__(self, folder):
        self.recording = ear.Recording(folder)
        self.calibration = self.recording.calibration.replace(encoder=None, lasers=None)  # a camera and its IMU

    def run(self, on_images, on_imu):
        for sample in self.recording:
            if isinstance(sample, ear.StereoFrame):
                on_images(sample.t_ns, sample.left, sample.right)
            elif isinstance(sample, ear.ImuSample):
                on_imu(sample.t_ns, sample.gyro_B, sample.accel_B)


def main(folder):
    camera = Camera(folder)
    odometry = ear.Odometry(camera.calibration)
    waiting = []  # images, until the inertial samples of their time are there

    def on_imu(t_ns, gyro, accel):
        odometry.add_imu(t_ns, gyro, accel)
        while waiting and odometry.frame_time(waiting[0][0]) < t_ns:
            estimate = odometry.add_stereo(*waiting.pop(0))
            if estimate:
                x, y, z = estimate.state.p_WB
                print(f"{estimate.state.t_ns} {x:8.3f} {y:8.3f} {z:8.3f} m  {estimate.health}")
            else:
                print(f"no estimate: {odometry.health}")

    camera.run(lambda t_ns, left, right: waiting.append((t_ns, left, right)), on_imu)


if __name__ == "__main__":
    main(sys.argv[1])
