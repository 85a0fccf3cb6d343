"""Public recordings that this estimator could take, and what is known of those that are here in our layout."""

from typing import NamedTuple


class DataSet(NamedTuple):
    name: str
    what: str
    fit: str  # what it is good for here, or what keeps it from being used
    licence: str  # as far as known here; the source decides
    source: str
    converter: str = ""  # module in tools/real


DATA_SETS = [
    DataSet("euroc", "EuRoC MAV: a drone indoors, stereo 20 Hz, IMU 200 Hz, motion capture or Leica", "as it is",
            "of ASL, ETH Zurich: see the source", "https://projects.asl.ethz.ch/datasets/doku.php?id=kmavvisualinertialdatasets", "euroc"),
    DataSet("kitti_raw", "KITTI raw: a car, stereo 10 Hz, OXTS 100 Hz (extract), RTK GPS/INS",
            "grey cameras and OXTS; starts in motion", "CC BY-NC-SA 3.0", "https://www.cvlibs.net/datasets/kitti/raw_data.php", "kitti_raw"),
    DataSet("comma2k19", "comma2k19: a car on a motorway, phone IMU 100 Hz, speeds of four wheels, INS/GNSS/vision poses",
            "wheels and IMU; the video is left out (rolling shutter)", "MIT", "https://github.com/commaai/comma2k19", "comma2k19"),
    DataSet("tum_vi", "TUM VI: hand-held, stereo fisheye 20 Hz, IMU 200 Hz, motion capture at start and end",
            "EuRoC's layout, with --calibration of its dso/ folder; its truth is mocap0", "CC BY 4.0",
            "https://cvg.cit.tum.de/data/datasets/visual-inertial-dataset"),
    DataSet("uzh_fpv", "UZH-FPV: racing drones, stereo fisheye 30 Hz, IMU 500 Hz, laser tracker", "bags: ear run takes ROS 1 bags",
            "CC BY-NC-SA 3.0", "https://fpv.ifi.uzh.ch/"),
    DataSet("kitti_odometry", "KITTI odometry: 22 drives, stereo 10 Hz", "has no IMU: the same drives are in kitti_raw",
            "CC BY-NC-SA 3.0", "https://www.cvlibs.net/datasets/kitti/eval_odometry.php"),
    DataSet("kaist_urban", "KAIST Complex Urban: a car, stereo 10 Hz, IMU 100 Hz, wheel encoders, GPS and lidar SLAM",
            "the only one with stereo and encoders; no converter yet", "CC BY-NC-SA 4.0",
            "https://sites.google.com/view/complex-urban-dataset"),
    DataSet("nclt", "NCLT: a Segway on a campus for hours, wheel speeds, IMU 47 Hz, GPS and lidar SLAM",
            "wheels and IMU; no converter yet", "ODbL", "http://robots.engin.umich.edu/nclt/"),
    DataSet("px4_logs", "PX4 flight logs: IMU, GPS, the flight controller's own estimate",
            "no images and no wheels: nothing carries an estimate", "CC BY (PX4)", "https://review.px4.io/"),
    DataSet("ucsd", "a course at UCSD: a skid-steered robot indoors, encoders 40 Hz, IMU 100 Hz; no truth but lidar SLAM by students",
            "wheels and IMU; the scans of its lidar are left out", "none stated: local only",
            "https://github.com/shangweihung/Simultaneous-Localization-and-Mapping", "ucsd"),
    DataSet("husky", "a course at Michigan: a skid-steered Husky on a parking ground, wheel speeds 10 Hz, two IMU 100 Hz, stereo SLAM",
            "wheels and IMU; of two minutes, before its recorder fell behind", "none stated: local only",
            "https://github.com/XihangYU630/inekf_wheeled", "husky"),
    DataSet("wid", "WID: a car, IMU 120 Hz in it and on each wheel, RTK GNSS 4 Hz",
            "wheels by the gyroscopes on them, their scale by gravity; mounting and track width not stated; no converter yet",
            "none stated: local only", "https://github.com/ansfl/WID"),
    DataSet("robot_localization", "a Husky outdoors: wheel speeds 10 Hz, IMU 30 Hz, GPS to about a metre (test1.bag)",
            "wheels and IMU; the stamps of the wheels are some 90 ms early; no converter yet", "BSD",
            "https://github.com/cra-ros-pkg/robot_localization"),
    DataSet("boreal_tc", "BorealTC: a Husky on snow, ice, asphalt and indoors: wheel speeds 6.5 Hz, IMU 100 Hz, no truth",
            "for whether it runs at all: its times are even ones, and wheels and IMU up to 0.8 s apart", "CC0 (data)",
            "https://github.com/norlab-ulaval/BorealTC"),
    DataSet("maebot", "a course at Michigan: a MAEBot of 10 cm on its arena, encoders and IMU 26 Hz in one packet, lidar SLAM of the staff",
            "wheels and IMU; 59 s; wheels are some 5 % larger than stated; an LCM log, no converter yet", "none stated: local only",
            "https://github.com/rmchapin/eecs467"),
    DataSet("mbot", "a course at Michigan: an MBot drives four squares, then stands for 78 s, encoders and IMU 50 Hz, no truth",
            "wheels and IMU; the IMU is turned by 90 degrees, the track width is not stated; an LCM log, no converter yet",
            "none stated: local only", "https://github.com/leekt0124/ROB550-botlab"),
    DataSet("roomba", "Roombas in a laboratory: encoders and IMU 64 to 82 Hz, no truth", "wheels and IMU, for half a minute; no converter yet",
            "none stated: local only", "https://github.com/mathman93/RoombaCI-Clemson"),
    DataSet("lawn_wheels", "a mower on grass: wheel speeds in coarse steps, IMU 66.7 Hz, position by radio",
            "here as lawn_wheels; its original layout is not documented", "none stated: local only", "not stated"),
]


class Held(NamedTuple):
    what: str
    of: str  # data set, or who made it
    note: str  # what a reader must know to judge the figures


HELD = {
    "hop": Held("drive, hop, landing, drive; simulated by others; all sensors", "made for this project",
                "the truth is exact"),
    "micro_euroc": Held("V1_01 standing, its rotors starting; stereo", "euroc",
                        "3 s of images in 145 s of inertial samples: hence the coverage. It moves 2 cm: no per cent, and no error "
                        "can be beyond 0.1 m"),
    "euroc_v101_mono": Held("V1_01 in motion, one camera", "euroc",
                            "it starts in motion, by how the accelerometer and the images change; its alarm accuses the gyroscope, which is sound"),
    "euroc_mh01_mono": Held("MH_01 reversed in time: stands 4 s, then flies 5 m; one camera", "euroc",
                            "the errors are millimetres, where those of the truth count in NEES: while it stands, the truth's heading moves by 1.3 mrad in 1.8 s, "
                            "where the estimate's standard deviation is 0.16; the orientation's NEES is 47 there"),
    "kitti_a": Held("a car, stereo 10 Hz, starts at 4 m/s", "kitti_raw",
                    "of the IMU only 16 % of the packets exist, and its samples are 53 ms late against the attitude of the truth, "
                    "which comes from the same device: in the turn at the start that is 1.2 degrees of yaw. From 1.8 to 7 s the truth rises by 1.0 m, "
                    "by its own vertical velocities by 0.3 m: on the way of 158 m these 0.7 m alone are 0.4 %. Its alarm is true: two images that no "
                    "inertial samples reach"),
    "comma2k19": Held("a car on a motorway without a camera: wheels and a phone's IMU", "comma2k19",
                      "the odometer's mounting is a guess, and the wheels are 1 % larger than stated"),
    "ucsd_20": Held("a skid-steered robot indoors: wheels and IMU", "ucsd",
                    "the truth is a plane, good to 0.7 m, and the wheels scrub in every turn"),
    "lawn_wheels": Held("a mower on grass: coarse wheels and IMU", "lawn_wheels",
                        "the truth is positions by radio, whose height alone scatters by 0.6 m; it begins 31 s after the estimate. "
                        "NEES takes it for exact. The IMU is turned by 90 degrees against its calibration: its y points forward, "
                        "and the health says so; `imu_turned` below has it right"),
}
