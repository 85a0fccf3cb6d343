"""Localisation of vehicles that drive and fly, from cameras, IMU, wheels and lasers: the C++ interface as it is.

for sample in ear.Recording(folder): ...          # NumPy arrays, in time order
odometry = ear.Odometry(recording.calibration)    # add_imu, add_encoder, add_laser, add_stereo
estimates = ear.replay(recording, odometry)       # all of it, as `ear run` does
figures = ear.evaluate(estimates, folder)         # as `ear evaluate --json`
"""

from ear._ear import *  # noqa: F401,F403
from ear._ear import __version__  # noqa: F401
