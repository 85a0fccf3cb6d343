#include <doctest/doctest.h>

#include <cmath>

#include "src/ros2/calibration_messages.h"
#include "src/ros2/outgoing.h"
#include "tests/recording/support.h"
#include "tests/ros2/support.h"

using namespace ear;
using namespace ear::ros2;
using ear::test::contains;
using ear::test::header;
using ear::test::input_error_of;
using ear::test::Sent;

namespace {

constexpr TimeNs kStart = 1'700'000'000'000'000'000;

Eigen::Isometry3d pose(double roll, double pitch, double yaw, const Eigen::Vector3d& p) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = (Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
                Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX()))
                   .toRotationMatrix();
  T.translation() = p;
  return T;
}

TransformStamped link(const std::string& parent, const std::string& child, const Eigen::Isometry3d& T) {
  const Pose p = pose_message(Eigen::Quaterniond(T.linear()), T.translation());
  return {header(kStart, parent), child, {{p.position.x, p.position.y, p.position.z}, p.orientation}};
}

Calibration vehicle() {
  Calibration calibration;
  calibration.cameras.resize(2);
  for (std::size_t i = 0; i < 2; ++i) {
    CameraCalibration& camera = calibration.cameras[i];
    camera.T_BC = pose(-1.57, 0.01, -1.58, {0.1, 0.05 - 0.1 * double(i), 0.02});
    camera.width = 640;
    camera.height = 480;
    camera.fu = 400.0 + double(i);
    camera.fv = 401.0;
    camera.cu = 320.5;
    camera.cv = 240.25;
    camera.distortion = {0.1, -0.2, 1e-3, 2e-3, 0.05};
  }
  calibration.cameras[1].lens = LensModel::equidistant;
  calibration.cameras[1].distortion[4] = 0.0;
  calibration.encoder.emplace().T_BO = pose(0.01, 0.02, -0.03, {-0.05, 0.01, -0.1});
  calibration.lasers.emplace().beams = {{"a", {0.1, 0.1, 0.0}, {0.0, 0.0, -1.0}},
                                        {"b", {0.1, -0.1, 0.0}, Eigen::Vector3d(0.3, 0.1, -1.0).normalized()},
                                        {"c", {-0.1, 0.0, 0.0}, {-1.0, 0.0, 0.0}}};
  return calibration;
}

SensorTopics topics_named(const std::string& left, const std::string& right) {
  SensorTopics topics = default_topics();
  topics.left = left;
  topics.right = right;
  return topics;
}

bool same(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) { return (a.matrix() - b.matrix()).norm() < 1e-12; }

}  // namespace

TEST_CASE("frames: a tree, whichever way one goes in it") {
  const Eigen::Isometry3d T_ab = pose(0.1, 0.2, 0.3, {1, 2, 3}), T_bc = pose(-0.3, 0.2, 0.1, {0, 1, 0}),
                          T_ad = pose(0.5, 0.0, -1.0, {0.3, 0, 1});
  FrameTree tree;
  tree.add(link("a", "b", T_ab));
  tree.add(link("/b", "c", T_bc));  // older drivers write a slash
  tree.add(link("a", "d", T_ad));
  CHECK(same(*tree.transform("a", "c"), T_ab * T_bc));
  CHECK(same(*tree.transform("c", "/a"), (T_ab * T_bc).inverse()));
  CHECK(same(*tree.transform("d", "c"), T_ad.inverse() * T_ab * T_bc));
  CHECK(same(*tree.transform("x", "x"), Eigen::Isometry3d::Identity()));
  CHECK_FALSE(tree.transform("a", "x"));
  tree.add(link("c", "a", T_ab));  // a circle ends, with whatever
  static_cast<void>(tree.transform("a", "x"));
}

TEST_CASE("calibration: what we publish comes back") {
  const Calibration expected = vehicle();
  CalibrationMessages messages(default_topics());
  CHECK(contains(messages.missing_for_cameras(), "no CameraInfo on /cam0/camera_info"));
  messages.take(Sent("/cam0/camera_info", camera_info(expected.cameras[0], 0, kStart)));
  messages.take(Sent("/cam1/camera_info", camera_info(expected.cameras[1], 1, kStart)));
  CHECK(contains(messages.missing_for_cameras(), "no message of the IMU"));
  messages.take(Sent("/imu0", imu_message(ImuSample{})));
  CHECK(contains(messages.missing_for_cameras(), "no transform from 'cam0' to 'imu0' on /tf_static"));
  CHECK(contains(input_error_of([&] { static_cast<void>(messages.cameras()); }), "no transform"));
  messages.take(Sent("/tf_static", static_frames(expected, "base_link", kStart)));
  CHECK(messages.missing_for_cameras().empty());
  CHECK(contains(messages.missing_for_beams(), "no message on /laser/0"));
  const LaserSample sample{kStart, {1.0, 1.0, 1.0}};
  for (std::size_t i = 0; i < 3; ++i) {
    messages.take(Sent("/laser/" + std::to_string(i), range_message(sample, i, *expected.lasers)));
  }
  CHECK(messages.missing_for_beams().empty());

  const std::vector<CameraCalibration> cameras = messages.cameras();
  REQUIRE(cameras.size() == 2);
  for (std::size_t i = 0; i < 2; ++i) {
    CHECK(same(cameras[i].T_BC, expected.cameras[i].T_BC));
    CHECK(cameras[i].width == 640);
    CHECK(cameras[i].fu == expected.cameras[i].fu);
    CHECK(cameras[i].cv == expected.cameras[i].cv);
    CHECK(cameras[i].lens == expected.cameras[i].lens);
    CHECK(cameras[i].distortion == expected.cameras[i].distortion);
  }
  const LaserCalibration lasers = messages.lasers();
  REQUIRE(lasers.beams.size() == 3);
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK((lasers.beams[i].p_BL - expected.lasers->beams[i].p_BL).norm() < 1e-12);
    CHECK((lasers.beams[i].d_B - expected.lasers->beams[i].d_B).norm() < 1e-12);
  }
  CHECK(lasers.range_min == expected.lasers->range_min);
  CHECK(lasers.range_max == expected.lasers->range_max);
  CHECK(same(*messages.T_B_base(), expected.encoder->T_BO));
}

TEST_CASE("calibration: rectified images have P, turned by R; a shared frame has its baseline in P") {
  const Eigen::Isometry3d T_BC = pose(-1.5, 0.1, -1.6, {0.1, 0.05, 0.0});
  const Eigen::Matrix3d R = pose(0.01, -0.02, 0.03, {0, 0, 0}).linear();  // from the camera to the rectified one
  CameraInfo left = camera_info(vehicle().cameras[0], 0, kStart);
  for (int i = 0; i < 9; ++i) left.r[std::size_t(i)] = R(i / 3, i % 3);
  left.p = {380.0, 0.0, 310.0, 0.0, 0.0, 381.0, 230.0, 0.0, 0.0, 0.0, 1.0, 0.0};
  CameraInfo right = left;
  right.p[3] = -380.0 * 0.095;

  CalibrationMessages messages(topics_named("/l/image_rect", "/r/image_rect"));
  messages.take(Sent("/imu0", imu_message(ImuSample{})));
  TfMessage tf;
  tf.transforms = {link("imu0", "cam0", T_BC)};
  messages.take(Sent("/tf_static", tf));
  messages.take(Sent("/cam0/camera_info", left));
  messages.take(Sent("/cam1/camera_info", right));
  const std::vector<CameraCalibration> cameras = messages.cameras();
  CHECK(cameras[0].fu == 380.0);
  CHECK(cameras[0].cv == 230.0);
  CHECK(cameras[0].distortion == std::array<double, 5>{});
  // A point in the camera's frame, and the same in the rectified one, are one point of the body.
  const Eigen::Vector3d p_C(0.3, -0.2, 2.0);
  CHECK((cameras[0].T_BC * (R * p_C) - T_BC * p_C).norm() < 1e-12);
  CHECK((cameras[0].T_BC.inverse() * cameras[1].T_BC.translation() - Eigen::Vector3d(0.095, 0, 0)).norm() < 1e-12);

  right.p[3] = 0.0;
  messages.take(Sent("/cam1/camera_info", right));
  CHECK(contains(input_error_of([&] { static_cast<void>(messages.cameras()); }),
                 "/cam1/camera_info: has the frame of the left camera, 'cam0', and p says no distance from it"));
}

TEST_CASE("calibration: what cannot be used is refused in words") {
  const auto error = [](const CameraInfo& info) {
    SensorTopics topics = default_topics();
    topics.right.clear();
    CalibrationMessages messages(topics);
    messages.take(Sent("/imu0", imu_message(ImuSample{})));
    messages.take(Sent("/tf_static", static_frames(vehicle(), "base_link", kStart)));
    messages.take(Sent("/cam0/camera_info", info));
    return input_error_of([&] { static_cast<void>(messages.cameras()); });
  };
  CameraInfo info = camera_info(vehicle().cameras[0], 0, kStart);
  CHECK(error(info).empty());
  info.d.resize(8);
  info.distortion_model = "rational_polynomial";
  CHECK(error(info).empty());
  info.d[6] = 0.1;
  CHECK(contains(error(info), "of which only the first 5 may be other than 0"));
  info.distortion_model = "thin_prism";
  CHECK(contains(error(info), "distortion_model 'thin_prism' is not known"));
  info = camera_info(vehicle().cameras[0], 0, kStart);
  info.binning_x = 2;
  CHECK(contains(error(info), "binning"));
  info = CameraInfo{};
  info.header.frame_id = "cam0";
  CHECK(contains(error(info), "not calibrated: the focal length in k is not positive"));
}
