"""What it costs to feed stereo frames from NumPy: python_overhead.py RECORDING [--most MS], with the module on PYTHONPATH.

Per frame, the time of the call of add_stereo() less the stages that the estimator measures itself: Python's part, and what
little C++ does beside its stages. With --most, fails where the median is more [ms].
"""

import argparse
import statistics
import sys
import time

import ear


def overheads(path):
    recording = ear.Recording(path)
    odometry = ear.Odometry(recording.calibration)
    waiting, result = None, []
    for sample in recording:
        if isinstance(sample, ear.StereoFrame):
            waiting = sample
        elif isinstance(sample, ear.ImuSample):
            odometry.add_imu(sample)
            if waiting and sample.t_ns > waiting.t_ns:
                left, right = waiting.left, waiting.right
                start = time.perf_counter()
                odometry.add_stereo(waiting.t_ns, left, right)
                call = time.perf_counter() - start
                times = odometry.stage_times
                stages = sum(getattr(times, stage) for stage in times._fields)
                if stages > 0.0:
                    result.append(1e3 * (call - stages))
                waiting = None
        elif isinstance(sample, ear.EncoderSample):
            odometry.add_encoder(sample)
        else:
            odometry.add_laser(sample)
    return left.shape, result


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("recording")
    parser.add_argument("--most", type=float, help="[ms]")
    arguments = parser.parse_args()
    shape, found = overheads(arguments.recording)
    median, worst = statistics.median(found), statistics.quantiles(found, n=20)[-1]
    print(f"{len(found)} stereo frames of {shape[1]}x{shape[0]}: {median:.4f} ms beside the estimator's stages (median), "
          f"{worst:.4f} ms (95 %)")
    sys.exit(1 if arguments.most is not None and median > arguments.most else 0)
