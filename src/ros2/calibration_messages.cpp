#include "src/ros2/calibration_messages.h"

#include <algorithm>
#include <utility>

#include "src/ros2/laser_messages.h"

namespace ear::ros2 {
namespace {

constexpr int kDeepest = 100;  // links from a frame to its root: more is a circle

std::string without_slash(const std::string& frame) { return frame.substr(frame.find('/') == 0 ? 1 : 0); }

Eigen::Isometry3d pose_of(const Transform& transform) {
  const Quaternion& q = transform.rotation;
  const Eigen::Quaterniond rotation(q.w, q.x, q.y, q.z);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = rotation.normalized().toRotationMatrix();
  pose.translation() = Eigen::Vector3d(transform.translation.x, transform.translation.y, transform.translation.z);
  return pose;
}

Transform transform_of(const Eigen::Isometry3d& pose) {
  const Eigen::Quaterniond q(pose.linear());
  const Eigen::Vector3d& p = pose.translation();
  return {{p.x(), p.y(), p.z()}, {q.x(), q.y(), q.z(), q.w()}};
}

bool rectified(const std::string& topic) { return topic.find("rect") != std::string::npos; }

Eigen::Matrix3d rectification(const CameraInfo& info) {
  const Eigen::Matrix3d R = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(info.r.data());
  return R.isZero() ? Eigen::Matrix3d::Identity() : R;
}

void read_lens(const CameraInfo& info, const std::string& topic, CameraCalibration& camera) {
  const std::string& model = info.distortion_model;
  const bool fisheye = model == "equidistant" || model == "fisheye";
  if (!fisheye && !model.empty() && model != "plumb_bob" && model != "rational_polynomial" && model != "none") {
    throw InputError(topic + ": distortion_model '" + model + "' is not known: plumb_bob, equidistant");
  }
  camera.lens = fisheye ? LensModel::equidistant : LensModel::radial_tangential;
  const std::size_t most = fisheye ? 4 : 5;
  for (std::size_t i = 0; i < info.d.size(); ++i) {
    if (i < most) {
      camera.distortion[i] = info.d[i];
    } else if (info.d[i] != 0.0) {
      throw InputError(topic + ": d has " + std::to_string(info.d.size()) + " coefficients, of which only the first " +
                       std::to_string(most) + " may be other than 0");
    }
  }
}

CameraCalibration intrinsics(const CameraInfo& info, const std::string& topic, bool rect) {
  if (info.binning_x > 1 || info.binning_y > 1 || info.roi.width > 0 || info.roi.height > 0) {
    throw InputError(topic + ": binning or a region of interest: only whole images can be used");
  }
  CameraCalibration camera;
  camera.width = static_cast<int>(std::min<std::uint32_t>(info.width, 65536));
  camera.height = static_cast<int>(std::min<std::uint32_t>(info.height, 65536));
  camera.fu = rect ? info.p[0] : info.k[0];
  camera.fv = rect ? info.p[5] : info.k[4];
  camera.cu = rect ? info.p[2] : info.k[2];
  camera.cv = rect ? info.p[6] : info.k[5];
  if (!(camera.fu > 0.0 && camera.fv > 0.0)) {
    throw InputError(topic + ": not calibrated: the focal length in " + (rect ? "p" : "k") + " is not positive");
  }
  if (!rect) read_lens(info, topic, camera);
  return camera;
}

}  // namespace

void FrameTree::add(const TransformStamped& transform) {
  const std::string child = without_slash(transform.child_frame_id);
  parents_[child] = {without_slash(transform.header.frame_id), pose_of(transform.transform)};
}

std::pair<std::string, Eigen::Isometry3d> FrameTree::root_of(std::string frame) const {
  Eigen::Isometry3d T_root_frame = Eigen::Isometry3d::Identity();
  for (int depth = 0; depth < kDeepest; ++depth) {
    const auto link = parents_.find(frame);
    if (link == parents_.end()) break;
    T_root_frame = link->second.T_parent_child * T_root_frame;
    frame = link->second.parent;
  }
  return {frame, T_root_frame};
}

std::optional<Eigen::Isometry3d> FrameTree::transform(const std::string& a, const std::string& b) const {
  const std::string from = without_slash(b), to = without_slash(a);
  if (from == to) return Eigen::Isometry3d::Identity();
  const auto [root_a, T_root_a] = root_of(to);
  const auto [root_b, T_root_b] = root_of(from);
  if (root_a != root_b) return std::nullopt;
  return T_root_a.inverse() * T_root_b;
}

void CalibrationMessages::take(const RawMessage& message) {
  if (message.topic.empty()) return;
  if (message.topic == topics_.tf_static) {
    for (const TransformStamped& transform : decode<TfMessage>(message).transforms) frames_.add(transform);
  } else if (message.topic == topics_.left_info) {
    infos_[0] = decode<CameraInfo>(message);
  } else if (message.topic == topics_.right_info) {
    infos_[1] = decode<CameraInfo>(message);
  } else if (message.topic == (topics_.imu_apart() ? topics_.gyro : topics_.imu)) {
    if (imu_frame_.empty()) imu_frame_ = decode<Imu>(message).header.frame_id;
  } else {
    for (std::size_t i = 0; i < beams_.size(); ++i) {
      if (message.topic == topics_.beams[i] && !beams_[i]) beams_[i] = range_message(message);
    }
  }
}

std::string CalibrationMessages::missing_for_cameras() const {
  const std::size_t count = topics_.left.empty() ? 0 : topics_.right.empty() ? 1 : 2;
  for (std::size_t i = 0; i < count; ++i) {
    if (!infos_[i]) return "no CameraInfo on " + (i == 0 ? topics_.left_info : topics_.right_info);
    const std::string& frame = infos_[i]->header.frame_id;
    if (imu_frame_.empty()) return "no message of the IMU with a frame_id";
    if (!frames_.transform(imu_frame_, frame)) {
      return "no transform from '" + frame + "' to '" + imu_frame_ + "' on " + topics_.tf_static;
    }
  }
  return "";
}

std::string CalibrationMessages::missing_for_beams() const {
  for (std::size_t i = 0; i < topics_.beam_count(); ++i) {
    if (!beams_[i]) return "no message on " + topics_.beams[i];
    if (imu_frame_.empty()) return "no message of the IMU with a frame_id";
    const std::string& frame = beams_[i]->header.frame_id;
    if (!frames_.transform(imu_frame_, frame)) {
      return "no transform from '" + frame + "' to '" + imu_frame_ + "' on " + topics_.tf_static;
    }
  }
  return "";
}

Eigen::Isometry3d CalibrationMessages::required(const std::string& frame, const std::string& topic) const {
  if (const auto T_B_frame = frames_.transform(imu_frame_, frame)) return *T_B_frame;
  throw InputError(topic + ": no transform from '" + frame + "' to '" + imu_frame_ + "' on " + topics_.tf_static);
}

CameraCalibration CalibrationMessages::camera(std::size_t index) const {
  const CameraInfo& info = infos_[index].value();
  const std::string& topic = index == 0 ? topics_.left_info : topics_.right_info;
  const bool rect = rectified(index == 0 ? topics_.left : topics_.right);
  CameraCalibration camera = intrinsics(info, topic, rect);
  camera.T_BC = required(info.header.frame_id, topic);
  if (rect) camera.T_BC.linear() = Eigen::Matrix3d(camera.T_BC.linear() * rectification(info).transpose());
  const bool shared_frame = index == 1 && info.header.frame_id == infos_[0]->header.frame_id;
  if (shared_frame) {
    const double baseline = -info.p[3] / info.p[0];
    if (!(baseline > 0.0)) {
      throw InputError(topic + ": has the frame of the left camera, '" + info.header.frame_id +
                       "', and p says no distance from it");
    }
    camera.T_BC = camera.T_BC * Eigen::Translation3d(baseline, 0.0, 0.0);
  }
  return camera;
}

std::vector<CameraCalibration> CalibrationMessages::cameras() const {
  const std::string missing = missing_for_cameras();
  if (!missing.empty()) throw InputError("calibration of the cameras: " + missing);
  std::vector<CameraCalibration> cameras;
  if (!topics_.left.empty()) cameras.push_back(camera(0));
  if (!topics_.left.empty() && !topics_.right.empty()) cameras.push_back(camera(1));
  return cameras;
}

LaserCalibration CalibrationMessages::lasers() const {
  const std::string missing = missing_for_beams();
  if (!missing.empty()) throw InputError("calibration of the lasers: " + missing);
  LaserCalibration lasers;
  for (std::size_t i = 0; i < topics_.beam_count(); ++i) {
    const Range& range = beams_[i].value();
    const Eigen::Isometry3d T_BL = required(range.header.frame_id, topics_.beams[i]);
    lasers.beams.push_back({"beam_" + std::to_string(i), T_BL.translation(), T_BL.linear().col(0)});
    lasers.range_min = i == 0 ? range_of(range.min_range) : std::max(lasers.range_min, range_of(range.min_range));
    lasers.range_max = i == 0 ? range_of(range.max_range) : std::min(lasers.range_max, range_of(range.max_range));
  }
  return lasers;
}

std::optional<Eigen::Isometry3d> CalibrationMessages::T_B_base() const {
  return frames_.transform(imu_frame_, topics_.base_frame);
}

CameraInfo camera_info(const CameraCalibration& camera, std::size_t index, TimeNs t_ns) {
  const bool fisheye = camera.lens == LensModel::equidistant;
  CameraInfo info;
  info.header = {time_of_stamp(t_ns), "cam" + std::to_string(index)};
  info.width = static_cast<std::uint32_t>(camera.width);
  info.height = static_cast<std::uint32_t>(camera.height);
  info.distortion_model = fisheye ? "equidistant" : "plumb_bob";
  info.d.assign(camera.distortion.begin(), camera.distortion.end() - (fisheye ? 1 : 0));
  info.k = {camera.fu, 0.0, camera.cu, 0.0, camera.fv, camera.cv, 0.0, 0.0, 1.0};
  info.r = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
  info.p = {camera.fu, 0.0, camera.cu, 0.0, 0.0, camera.fv, camera.cv, 0.0, 0.0, 0.0, 1.0, 0.0};
  return info;
}

TfMessage static_frames(const Calibration& calibration, const std::string& base_frame, TimeNs t_ns) {
  TfMessage tf;
  const Time stamp = time_of_stamp(t_ns);
  const auto add = [&](const std::string& parent, const std::string& child, const Eigen::Isometry3d& T_parent_child) {
    tf.transforms.push_back({{stamp, parent}, child, transform_of(T_parent_child)});
  };
  if (calibration.encoder) add(base_frame, "imu0", calibration.encoder->T_BO.inverse());
  for (std::size_t i = 0; i < calibration.cameras.size(); ++i) {
    add("imu0", "cam" + std::to_string(i), calibration.cameras[i].T_BC);
  }
  for (std::size_t i = 0; calibration.lasers && i < calibration.lasers->beams.size(); ++i) {
    const LaserBeam& beam = calibration.lasers->beams[i];
    Eigen::Isometry3d T_BL = Eigen::Isometry3d::Identity();
    T_BL.linear() = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitX(), beam.d_B).toRotationMatrix();
    T_BL.translation() = beam.p_BL;
    add("imu0", "laser0_" + std::to_string(i), T_BL);
  }
  return tf;
}

}  // namespace ear::ros2
