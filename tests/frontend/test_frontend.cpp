#include "frontend/frontend.h"

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/core/utility.hpp>
#include <set>
#include <stdexcept>

#include "scene.h"

namespace ear {
namespace {

constexpr double kNoise = 2.0;  // [grey values]
constexpr int kFeatures = 80;

// Wrong: by 0.06 m. Guessed, and wrongly so: by 3 degrees about the optical axis.
enum class Known { nothing, guessed_rotation, wrong_rotation, rotation, motion, wrong_motion };

// A stereo vehicle in a scene. Drives the front end along poses and compares what it sees with where things are.
class Run {
 public:
  explicit Run(std::vector<TexturedRectangle> scene, std::vector<CameraCalibration> cameras = test_stereo_pair())
      : scene_(std::move(scene)), cameras_(std::move(cameras)), frontend_({kFeatures, 0.3}, cameras_) {
    for (const CameraCalibration& camera : cameras_) renderers_.emplace_back(camera);
  }

  const FeatureFrame& step(const Eigen::Isometry3d& T_WB, Known known, bool with_right = true) {
    MotionPrediction prediction;
    if (known != Known::nothing && frames_ > 0) {
      prediction = exact_motion(T_WB_, T_WB);
      prediction.translation_known = known == Known::motion || known == Known::wrong_motion;
      if (known == Known::wrong_motion) prediction.p_B0B1.x() += 0.06;
      if (known == Known::guessed_rotation || known == Known::wrong_rotation) {
        prediction.R_B1B0 = Eigen::AngleAxisd(0.05, Eigen::Vector3d::UnitZ()) * prediction.R_B1B0;
        prediction.rotation_known = known == Known::wrong_rotation;
      }
    }
    cv::Mat left = renderers_[0].render(T_WB, scene_);
    add_noise(left, kNoise, random_);
    cv::Mat right;
    if (with_right && cameras_.size() > 1) {
      right = renderers_[1].render(T_WB, scene_);
      add_noise(right, kNoise, random_);
    }
    T_WB_ = T_WB;
    ++frames_;
    const FeatureFrame& frame = frontend_.process({frames_ * 100'000'000, view_of(left), view_of(right)}, prediction);
    count(frame);
    compare(frame);
    return frame;
  }

  // Features of the last frame: seen in the one before as well, new, and seen by both cameras.
  [[nodiscard]] int tracked() const { return tracked_; }
  [[nodiscard]] int detected() const { return static_cast<int>(ids_.size()) - tracked_; }
  [[nodiscard]] int stereo() const { return stereo_; }

  Frontend& frontend() { return frontend_; }
  std::vector<TexturedRectangle>& scene() { return scene_; }

  // Error of features seen before, against the place that they had when first seen [px].
  [[nodiscard]] double rms_px() const { return std::sqrt(squares_ / std::max(1, count_)); }
  [[nodiscard]] double stereo_rms_px() const { return std::sqrt(stereo_squares_ / std::max(1, stereo_count_)); }
  [[nodiscard]] double wrong_share() const { return static_cast<double>(wrong_) / std::max(1, count_ + wrong_); }
  [[nodiscard]] double wrong_stereo_share() const {
    return static_cast<double>(stereo_wrong_) / std::max(1, stereo_count_ + stereo_wrong_);
  }
  [[nodiscard]] int compared() const { return count_; }
  // Mean of that error, positive downwards: what is left when noise averages out.
  [[nodiscard]] double mean_down_px() const { return down_ / std::max(1, count_); }

 private:
  void count(const FeatureFrame& frame) {
    std::set<std::uint64_t> now;
    tracked_ = stereo_ = 0;
    for (const FeatureObservation& feature : frame.features) {
      now.insert(feature.id);
      tracked_ += ids_.count(feature.id) != 0 ? 1 : 0;
      stereo_ += feature.has_right ? 1 : 0;
    }
    ids_.swap(now);
  }

  void compare(const FeatureFrame& frame) {
    const Eigen::Isometry3d T_WC = T_WB_ * cameras_[0].T_BC;
    for (const FeatureObservation& feature : frame.features) {
      const auto known = places_.find(feature.id);
      if (known == places_.end()) {
        if (const auto place = hit(T_WC, feature.left, scene_)) places_[feature.id] = *place;
        continue;
      }
      const auto seen = [&](const CameraCalibration& camera) -> Eigen::Vector2d {
        return ((T_WB_ * camera.T_BC).inverse() * known->second).hnormalized();
      };
      const double error = cameras_[0].fu * (feature.left - seen(cameras_[0])).norm();
      if (error > 2.0) {
        ++wrong_;
      } else {
        squares_ += error * error;
        down_ += cameras_[0].fv * (feature.left - seen(cameras_[0])).y();
        ++count_;
      }
      if (!feature.has_right) continue;
      const double stereo_error = cameras_[1].fu * (feature.right - seen(cameras_[1])).norm();
      if (stereo_error > 2.0) {
        ++stereo_wrong_;
      } else {
        stereo_squares_ += stereo_error * stereo_error;
        ++stereo_count_;
      }
    }
  }

  std::vector<TexturedRectangle> scene_;
  std::vector<CameraCalibration> cameras_;
  std::vector<Camera> renderers_;
  Frontend frontend_;
  std::mt19937 random_{11};
  Eigen::Isometry3d T_WB_ = Eigen::Isometry3d::Identity();
  std::int64_t frames_ = 0;
  std::set<std::uint64_t> ids_;  // of the last frame
  int tracked_ = 0, stereo_ = 0;
  std::map<std::uint64_t, Eigen::Vector3d> places_;
  double squares_ = 0.0, stereo_squares_ = 0.0, down_ = 0.0;
  int count_ = 0, wrong_ = 0, stereo_count_ = 0, stereo_wrong_ = 0;
};

Eigen::Isometry3d at(const Eigen::Vector3d& p, double roll = 0.0, double yaw = 0.0) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = p;
  T.linear() = (Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()) * Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ()))
                   .toRotationMatrix();
  return T;
}

}  // namespace

TEST_CASE("front end: features stay where they are while the camera moves on all axes") {
  for (const LensModel lens : {LensModel::radial_tangential, LensModel::equidistant}) {
    Run run({wall(2.0, 20)}, test_stereo_pair(lens));
    for (int i = 0; i < 12; ++i) {
      const FeatureFrame& frame =
          run.step(at({0.03 * i, 0.01 * i, 0.05 * i}, 0.02 * i, 0.01 * std::sin(i)), Known::motion);
      CHECK(frame.features.size() > 60);
      CHECK(run.stereo() > 0.8 * static_cast<double>(frame.features.size()));
    }
    CHECK(run.compared() > 600);
    CHECK(run.rms_px() < 0.1);
    CHECK(run.stereo_rms_px() < 0.15);
    CHECK(run.wrong_share() < 0.005);
    CHECK(run.wrong_stereo_share() < 0.005);
  }
}

TEST_CASE("front end: features on a floor do not slide while the camera drives over it") {
  // As an affine map, the patch's perspective would pull them down by 0.1 px and more, which is read as climbing.
  Run run({floor_below(0.25, 24)});
  for (int i = 0; i < 20; ++i) run.step(at({0.0, 0.0, 0.02 * i}), Known::motion);
  CHECK(run.compared() > 300);
  CHECK(std::abs(run.mean_down_px()) < 0.02);
  CHECK(run.wrong_share() < 0.005);
}

TEST_CASE("front end: turns of more than 10 degrees from frame to frame, with the gyroscope") {
  for (const bool roll : {false, true}) {
    CAPTURE(roll);
    Run run({wall(2.0, 21)});
    run.step(at({0, 0, 0}), Known::rotation);
    for (const int i : {1, 2, 3, 2, 1, 0}) {
      const double angle = 0.21 * i;  // 12 degrees
      run.step(roll ? at({0, 0, 0}, angle) : at({0, 0, 0}, 0.0, 0.5 * angle), Known::rotation);
      CHECK(run.tracked() > 30);
    }
    CHECK(run.rms_px() < 0.15);
    CHECK(run.wrong_share() < 0.01);
  }
}

TEST_CASE("front end: large motion over near ground is followed with depth and prediction") {
  // 0.2 m towards and along a wall at 0.9 m: flow up to 60 px.
  const auto poses = [](int i) { return at({0.2 * i, 0.02 * i, 0.05 * i}); };
  const auto tracked = [&](Known known) {
    Run run({wall(0.9, 22)});
    int sum = 0;
    for (int i = 0; i < 4; ++i) {
      run.step(poses(i), known);
      sum += run.tracked();
    }
    CHECK(run.wrong_share() < 0.02);
    return sum;
  };
  const int with_motion = tracked(Known::motion);
  const int with_nothing = tracked(Known::nothing);
  CHECK(with_motion > 110);
  CHECK(with_nothing < with_motion / 2);
}

TEST_CASE("front end: a prediction that was good and is off by ten pixels costs no features") {
  Run run({wall(2.0, 25)});
  for (int i = 0; i < 9; ++i) {
    CAPTURE(i);
    run.step(at({0.03 * i, 0.0, 0.0}), i == 4 || i == 7 ? Known::wrong_motion : Known::motion);
    if (i > 0) CHECK(run.tracked() > 60);
  }
  CHECK(run.rms_px() < 0.1);
  CHECK(run.wrong_share() < 0.005);
}

TEST_CASE("front end: what is too near for the stereo pair is followed, also while all else hardly moves") {
  // The right half shows a wall at 0.2 m, with more disparity than is searched. It moves by 8 px per frame, the rest by
  // less than one: features without depth are looked for too close to where they were, and found all the same.
  TexturedRectangle near = wall(0.2, 27);
  near.corner_W.x() = 0.02;
  Run run({wall(2.0, 26), near});
  for (int i = 0; i < 8; ++i) {
    CAPTURE(i);
    run.step(at({0.008 * std::max(0, i - 3), 0.0, 0.0}), Known::motion);
    if (i == 0) continue;
    CHECK(run.stereo() < 50);
    CHECK(run.tracked() > 70);
  }
  CHECK(run.rms_px() < 0.15);
  CHECK(run.wrong_share() < 0.01);
}

TEST_CASE("front end: one camera follows large motion by the depths that the motion shows") {
  auto cameras = test_stereo_pair();
  cameras.pop_back();
  const auto tracked = [&](Known known) {  // along a wall at 1.2 m, faster and faster: flow up to 30 px
    Run run({wall(1.2, 28)}, cameras);
    for (int i = 0; i < 10; ++i) run.step(at({0.01 * i * (i + 1), 0.0, 0.0}), known);
    CHECK(run.rms_px() < 0.15);
    CHECK(run.wrong_share() < 0.01);
    return run.tracked();
  };
  const int with_motion = tracked(Known::motion);
  CHECK(with_motion > 50);
  CHECK(tracked(Known::rotation) < with_motion / 2);
}

TEST_CASE("front end: one camera's flows are not judged by a turn that is a guess, or wrong") {
  auto cameras = test_stereo_pair();
  cameras.pop_back();
  const auto tracked = [&](Known known) {
    Run run({wall(2.0, 29)}, cameras);
    for (int i = 0; i < 6; ++i) run.step(at({0.03 * i, 0.0, 0.02 * i}), known);
    return run.tracked();
  };
  CHECK(tracked(Known::guessed_rotation) > 60);
  CHECK(tracked(Known::wrong_rotation) > 60);  // of a gyroscope whose bias has jumped
}

TEST_CASE("front end: slow motion needs no prediction") {
  Run run({wall(2.0, 23)});
  for (int i = 0; i < 6; ++i) run.step(at({0.04 * i, 0.0, 0.0}), Known::nothing);
  CHECK(run.tracked() > 60);
  CHECK(run.rms_px() < 0.1);
}

TEST_CASE("front end: what moves by itself is not kept") {
  TexturedRectangle box = wall(1.2, 24);
  box.texture = box.texture(cv::Rect(0, 0, 120, 110)).clone();
  box.corner_W = {-0.2, -0.2, 1.2};
  Run run({wall(2.0, 25), box});
  int on_box = 0;
  for (int i = 0; i < 6; ++i) {
    run.scene()[1].corner_W = {-0.2 + 0.04 * i, -0.2 + 0.03 * i, 1.2};
    const FeatureFrame& frame = run.step(at({0.02 * i, 0.0, 0.0}), Known::motion);
    const int detected = run.detected();
    // Features that survive the step: all but the newest, which come last.
    for (std::size_t k = 0; i > 0 && k + static_cast<std::size_t>(detected) < frame.features.size(); ++k) {
      const auto place = hit(at({0.02 * i, 0.0, 0.0}), frame.features[k].left, run.scene());
      // Well inside the box; on its edges a patch may belong to the wall.
      if (!place || std::abs(place->z() - 1.2) > 1e-6) continue;
      const Eigen::Vector3d in = *place - run.scene()[1].corner_W;
      if (in.x() > 0.06 && in.y() > 0.06 && in.x() < 0.5 && in.y() < 0.45) ++on_box;
    }
  }
  CHECK(on_box <= 2);
}

TEST_CASE("front end: one camera, or one image, is enough") {
  SUBCASE("one camera") {
    auto cameras = test_stereo_pair();
    cameras.pop_back();
    for (const Known known : {Known::motion, Known::rotation, Known::nothing}) {
      Run run({wall(2.0, 26)}, cameras);
      for (int i = 0; i < 6; ++i) {
        const FeatureFrame& frame = run.step(at({0.03 * i, 0.0, 0.02 * i}, 0.02 * i), known);
        for (const auto& feature : frame.features) CHECK_FALSE(feature.has_right);
      }
      CHECK(run.tracked() > 60);
      CHECK(run.rms_px() < 0.1);
    }
  }
  SUBCASE("the right image is missing for a while") {
    Run run({wall(2.0, 27)});
    for (int i = 0; i < 8; ++i) {
      const bool there = i < 3 || i > 5;
      run.step(at({0.03 * i, 0.0, 0.0}), Known::motion, there);
      CHECK((run.stereo() > 50) == there);
      if (i > 0) CHECK(run.tracked() > 60);
    }
    CHECK(run.wrong_stereo_share() < 0.005);
  }
}

namespace {

// What the dark leaves of a scene: a share of its light, and what the sensor adds to it. Some of that is the same in
// every image of a camera.
struct Darkness {
  double light = 0.0;
  Noise changing;
  Noise fixed;
};

// Mean number of features per frame, and of those that the frame before had as well.
struct Count {
  double features = 0.0, tracked = 0.0;
};

// Over 30 frames of a turn with 4 px of flow per frame, predicted exactly.
Count features_in(const Darkness& darkness) {
  constexpr int kFrames = 30;
  const auto cameras = test_stereo_pair();
  const std::vector<Camera> renderers{Camera(cameras[0]), Camera(cameras[1])};
  Frontend frontend({kFeatures, 0.3}, cameras);
  const std::vector<TexturedRectangle> scene{wall(2.0, 33)};
  std::mt19937 random(34);
  std::array<cv::Mat, 2> dark;
  for (cv::Mat& image : dark) {
    image = cv::Mat(240, 320, CV_8U, cv::Scalar(10));
    add_noise(image, darkness.fixed, random);
  }
  Count count;
  Eigen::Isometry3d T_WB0 = Eigen::Isometry3d::Identity();
  std::set<std::uint64_t> before;
  for (int i = 0; i < kFrames; ++i) {
    const Eigen::Isometry3d T_WB = at({0.0, 0.0, 0.01 * i}, 0.0, 0.02 * i);
    std::array<cv::Mat, 2> images;
    for (std::size_t k = 0; k < 2; ++k) {
      images[k] = dark[k].clone();
      if (darkness.light > 0.0) images[k] += darkness.light * renderers[k].render(T_WB, scene);
      add_noise(images[k], darkness.changing, random);
    }
    std::set<std::uint64_t> now;
    for (const FeatureObservation& feature :
         frontend.process({i, view_of(images[0]), view_of(images[1])}, exact_motion(T_WB0, T_WB)).features) {
      now.insert(feature.id);
      count.features += 1.0 / kFrames;
      count.tracked += before.count(feature.id) != 0 ? 1.0 / kFrames : 0.0;
    }
    before.swap(now);
    T_WB0 = T_WB;
  }
  return count;
}

}  // namespace

TEST_CASE("front end: noise gives no features in the dark, and leaves those of a dim scene") {
  struct Case {
    double sigma;  // of what changes from image to image [grey values]
    Noise fixed;
  };
  for (const Case& sensor : {Case{4.0, {}}, Case{2.5, {2.0}}, Case{1.0, {0.0, 0.001}}, Case{2.5, {0.0, 0.005}},
                             Case{1.0, {3.0, 0.001, 4.0}}}) {
    CAPTURE(sensor.sigma);
    CAPTURE(sensor.fixed.pixel);
    CAPTURE(sensor.fixed.hot_share);
    CAPTURE(sensor.fixed.row);
    CHECK(features_in({0.0, {sensor.sigma}, sensor.fixed}).features < 1.0);
    CHECK(features_in({0.3, {sensor.sigma}, sensor.fixed}).tracked > 65.0);
  }
}

TEST_CASE("front end: black, white and returning images") {
  const auto cameras = test_stereo_pair();
  Frontend frontend({kFeatures, 0.3}, cameras);
  const cv::Mat scene = Camera(cameras[0]).render(at({0, 0, 0}), {wall(2.0, 28)});
  const cv::Mat other = Camera(cameras[1]).render(at({0, 0, 0}), {wall(2.0, 28)});
  std::set<std::uint64_t> first;
  for (const auto& feature : frontend.process({0, view_of(scene), view_of(other)}, {}).features)
    first.insert(feature.id);
  CHECK(first.size() == kFeatures);
  TimeNs t = 1;
  for (const int grey : {0, 255}) {
    const cv::Mat flat(240, 320, CV_8U, cv::Scalar(grey));
    CHECK(frontend.process({t++, view_of(flat), view_of(flat)}, {}).features.empty());
  }
  const FeatureFrame& back = frontend.process({t, view_of(scene), view_of(other)}, {});
  CHECK(back.features.size() == kFeatures);
  for (const auto& feature : back.features) CHECK(first.count(feature.id) == 0);
}

TEST_CASE("front end: an image that repeats the last gives its features again, whatever is predicted, and says so") {
  const auto cameras = test_stereo_pair();
  Frontend frontend({kFeatures, 0.3}, cameras);
  const cv::Mat left = Camera(cameras[0]).render(at({0, 0, 0}), {wall(2.0, 30)});
  const cv::Mat right = Camera(cameras[1]).render(at({0, 0, 0}), {wall(2.0, 30)});
  const FeatureFrame first = frontend.process({0, view_of(left), view_of(right)}, {});
  REQUIRE(first.features.size() > kFeatures / 2);
  CHECK_FALSE(first.repeated);
  const MotionPrediction moved = exact_motion(at({0, 0, 0}), at({0.1, 0.0, 0.0}));
  // In memory of its own, with rows that lie further apart and other bytes between them.
  cv::Mat wide(left.rows, left.cols + 37, CV_8U, cv::Scalar(99));
  left.copyTo(wide(cv::Rect(0, 0, left.cols, left.rows)));
  ImageView copy = view_of(left);
  copy.data = wide.data;
  copy.stride = static_cast<std::ptrdiff_t>(wide.step);
  const FeatureFrame again = frontend.process({1, copy, view_of(right)}, moved);
  CHECK(again.t_ns == 1);
  CHECK(again.repeated);
  REQUIRE(again.features.size() == first.features.size());
  for (std::size_t i = 0; i < first.features.size(); ++i) {
    CHECK(again.features[i].id == first.features[i].id);
    CHECK(again.features[i].left == first.features[i].left);
    CHECK(again.features[i].right == first.features[i].right);
  }
  CHECK(frontend.timing().pyramid == 0.0);

  // One grey value at a corner of the image is enough to be another one; the same again is a repetition of that.
  TimeNs t = 2;
  for (const cv::Point pixel : {cv::Point(0, 0), cv::Point(left.cols - 1, left.rows - 1)}) {
    cv::Mat other = left.clone();
    other.at<std::uint8_t>(pixel) ^= 1U;
    CHECK_FALSE(frontend.process({t++, view_of(other), view_of(right)}, {}).repeated);
    CHECK(frontend.timing().pyramid > 0.0);
    CHECK(frontend.process({t++, view_of(other), view_of(right)}, {}).repeated);
  }
  CHECK_FALSE(frontend.process({t++, view_of(left), view_of(right)}, {}).repeated);
  CHECK(frontend.process({t++, view_of(left), view_of(left)}, {}).repeated);          // the right image alone
  CHECK_FALSE(frontend.process({t++, view_of(right), view_of(right)}, {}).repeated);  // the left one alone
  std::uint64_t last_id = 0;
  for (const FeatureObservation& feature : frontend.process({t++, view_of(right), view_of(right)}, {}).features) {
    last_id = std::max(last_id, feature.id);
  }
  frontend.reset();
  const FeatureFrame fresh = frontend.process({t, view_of(right), view_of(right)}, {});
  CHECK_FALSE(fresh.repeated);  // there is none before it
  CHECK(fresh.features.size() > kFeatures / 2);
  for (const FeatureObservation& feature : fresh.features) CHECK(feature.id > last_id);
}

TEST_CASE("front end: ids are unique in a frame and never come back, also after reset") {
  Run run({wall(2.0, 29)});
  std::set<std::uint64_t> gone;
  std::set<std::uint64_t> last;
  for (int i = 0; i < 8; ++i) {
    if (i == 5) run.frontend().reset();
    std::set<std::uint64_t> now;
    for (const auto& feature : run.step(at({0.15 * i, 0.0, 0.0}), Known::motion).features) {
      CHECK(now.insert(feature.id).second);
      CHECK(gone.count(feature.id) == 0);
    }
    for (const auto id : last) {
      if (now.count(id) == 0) gone.insert(id);
    }
    if (i == 5) CHECK(run.tracked() == 0);
    last = now;
  }
  CHECK(gone.size() > 50);
}

TEST_CASE("front end: images that do not fit the calibration are refused, and change nothing") {
  const auto cameras = test_stereo_pair();
  Frontend frontend({kFeatures, 0.3}, cameras);
  const cv::Mat good = Camera(cameras[0]).render(at({0, 0, 0}), {wall(2.0, 30)});
  const cv::Mat small = good(cv::Rect(0, 0, 300, 240));
  const FeatureFrame before = frontend.process({0, view_of(good), {}}, {});
  REQUIRE(before.features.size() == kFeatures);
  CHECK_THROWS_AS(frontend.process({1, view_of(small), view_of(good)}, {}), std::invalid_argument);
  CHECK_THROWS_AS(frontend.process({1, view_of(good), view_of(small)}, {}), std::invalid_argument);
  CHECK_THROWS_AS(frontend.process({1, {}, view_of(good)}, {}), std::invalid_argument);
  cv::Mat next = good.clone();
  next.at<std::uint8_t>(0, 0) ^= 1U;  // else it would be the image before, which is given again
  const FeatureFrame& after = frontend.process({2, view_of(next), {}}, {});
  REQUIRE(after.features.size() == kFeatures);
  for (std::size_t i = 0; i < kFeatures; ++i) CHECK(after.features[i].id == before.features[i].id);
  CHECK_THROWS_AS(Frontend({kFeatures, 0.3}, {}), std::invalid_argument);
  CHECK_THROWS_AS(Frontend({0, 0.3}, cameras), std::invalid_argument);
  CHECK_THROWS_AS(Frontend({kFeatures, 0.0}, cameras), std::invalid_argument);
}

TEST_CASE("front end: the same images give the same features, whatever the number of threads") {
  const auto features = [](int threads) {
    const int before = cv::getNumThreads();
    cv::setNumThreads(threads);
    TexturedRectangle box = wall(1.0, 32);
    box.texture = box.texture(cv::Rect(0, 0, 100, 100)).clone();
    Run run({wall(2.0, 31), box});
    std::vector<double> all;
    for (int i = 0; i < 5; ++i) {
      for (const auto& f : run.step(at({0.1 * i, 0.0, 0.0}), Known::nothing).features) {
        all.insert(all.end(), {static_cast<double>(f.id), f.left.x(), f.left.y(), f.right.x(), f.right.y()});
      }
    }
    cv::setNumThreads(before);
    return all;
  };
  const std::vector<double> one = features(1);
  CHECK(one.size() > 1000);
  CHECK(one == features(1));
  CHECK(one == features(2));
}

}  // namespace ear
