// The program's figures against those of reference.py, which shares no code with it.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/evaluation/support.h"
#include "tests/support/skip.h"
#include "tools/evaluation/evaluate.h"
#include "tools/evaluation/read.h"
#include "tools/evaluation/summary.h"

namespace ear::evaluation {
namespace {

using Json = nlohmann::json;

constexpr double kTolerance = 1e-6;
constexpr std::array<const char*, 6> kErrorNames{"x", "y", "z", "rx", "ry", "rz"};

std::string pose_text(const Pose& pose) {
  std::ostringstream text;
  text << std::setprecision(17) << pose.t_ns;
  for (int i = 0; i < 3; ++i) text << ',' << pose.p_WB(i);
  text << ',' << pose.q_WB.w() << ',' << pose.q_WB.x() << ',' << pose.q_WB.y() << ',' << pose.q_WB.z();
  return text.str();
}

Slope slope_at(double t) { return {0.2 * std::sin(t), 0.1 * std::cos(1.3 * t)}; }

/// Truth with a gap from 12 to 13.5 s.
std::string truth_file(const Trajectory& truth) {
  std::string text = "#timestamp [ns],p_x,p_y,p_z,q_w,q_x,q_y,q_z\n";
  for (const Pose& pose : truth) {
    const double t = seconds_between(kStart, pose.t_ns);
    if (t <= 12.0 || t >= 13.5) text += pose_text(pose) + "\n";
  }
  return text;
}

/// What the ground is like from the truth's start to its end: the vehicle flies now and then.
std::string terrain_file() {
  std::ostringstream text;
  text << "#timestamp [ns],mode [0 ground 1 air],slope_along [rad],slope_across [rad],slip [m/s]\n"
       << std::setprecision(17);
  for (const Pose& pose : walk(30.0, 20.0)) {
    const double t = seconds_between(kStart, pose.t_ns);
    text << pose.t_ns << ',' << (std::sin(0.7 * t) > 0.5 ? 1 : 0) << ',' << slope_at(t).along << ','
         << slope_at(t).across << ",0\n";
  }
  return text.str();
}

std::string states_file(const std::vector<Pose>& poses, std::mt19937_64& rng) {
  std::ostringstream text;
  text << "t_ns,p_x,p_y,p_z,q_w,q_x,q_y,q_z";
  for (std::size_t i = 0; i < 6; ++i)
    for (std::size_t j = i; j < 6; ++j) text << ",cov_" << kErrorNames[i] << '_' << kErrorNames[j];
  text << ",on_ground,slope_along,slope_across,sigma_slope_along,sigma_slope_across,health" << std::setprecision(17)
       << '\n';
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  for (const Pose& pose : poses) {
    PoseCovariance L;
    for (int i = 0; i < 36; ++i) L(i % 6, i / 6) = 0.03 * normal(rng);
    const PoseCovariance P = L * L.transpose() + 1e-3 * PoseCovariance::Identity();
    text << pose_text(pose);
    for (int i = 0; i < 6; ++i)
      for (int j = i; j < 6; ++j) text << ',' << P(i, j);
    const Slope slope = slope_at(seconds_between(kStart, pose.t_ns));
    text << ',' << (uniform(rng) < 0.8 ? 1 : 0);
    if (uniform(rng) < 0.1) {
      text << ",nan,nan,nan,nan";  // not known
    } else {
      text << ',' << slope.along + 0.02 * normal(rng) << ',' << slope.across + 0.02 * normal(rng) << ",0.01,0.02";
    }
    text << (uniform(rng) < 0.7 ? ",tracking\n" : ",degraded: without beam_0\n");
  }
  return text.str();
}

/// Drifting and noisy, in a world of its own, with a gap from 20 to 21 s, from before the truth until after its end.
Trajectory estimate_poses(std::mt19937_64& rng, double extent) {
  Trajectory poses;
  Eigen::Vector3d drift = Eigen::Vector3d::Zero();
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();
  for (double t = -1.013; t < 31.0; t += 0.1 + 0.02 * gaussian(rng, 0.5).x()) {
    drift += gaussian(rng, 0.01);
    turn += gaussian(rng, 0.002);
    if (t > 20.0 && t < 21.0) continue;
    Pose pose = pose_at(t);
    pose.p_WB = extent * pose.p_WB + drift * std::min(1.0, extent);
    pose.q_WB = exp_rotation(turn) * pose.q_WB;
    if (t > 16.0 && t < 18.5) pose.p_WB.x() += 20.0;  // far off
    if (poses.empty() || pose.t_ns > poses.back().t_ns) poses.push_back(pose);
  }
  return moved(isometry({0.05, -0.08, 1.9}, {3, -7, 0.4}), poses);
}

Json reference(const std::filesystem::path& estimate, const std::filesystem::path& truth,
               const std::filesystem::path& terrain, const TemporaryFolder& folder) {
  const std::filesystem::path answer = folder / "reference.json";
  const std::string command = std::string(EAR_NUMPY_PYTHON) + " -B " + EAR_SOURCE_DIR +
                              "/tests/evaluation/reference.py \"" + estimate.string() + "\" \"" + truth.string() +
                              "\" \"" + terrain.string() + "\" > \"" + answer.string() + "\"";
  REQUIRE(std::system(command.c_str()) == 0);
  std::ifstream file(answer);
  return Json::parse(file);
}

/// Every figure of the reference must be there and the same; what the program says beyond it is not compared.
void compare(const Json& expected, const Json& actual, const std::string& where) {
  CAPTURE(where);
  if (expected.is_object()) {
    for (const auto& item : expected.items()) {
      std::string path = where;
      path.append("/").append(item.key());
      CAPTURE(path);
      REQUIRE(actual.contains(item.key()));
      compare(item.value(), actual[item.key()], path);
    }
  } else if (expected.is_array()) {
    REQUIRE(actual.size() == expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i) compare(expected[i], actual[i], where + "/" + std::to_string(i));
  } else if (expected.is_number_float()) {
    REQUIRE(actual.is_number());
    const double a = actual.get<double>();
    const double e = expected.get<double>();
    CHECK(std::abs(a - e) <= kTolerance * std::max(1.0, std::abs(e)));
  } else {
    CHECK(actual == expected);
  }
}

void check_against_reference(double extent, unsigned seed) {
  if (std::string(EAR_NUMPY_PYTHON).empty()) {
    test::skip("no python3 with numpy was found when this was configured");
    return;
  }
  std::mt19937_64 rng{seed};
  const TemporaryFolder folder("reference");
  Trajectory truth = walk(30.0, 50.0);
  for (Pose& pose : truth) pose.p_WB = extent * pose.p_WB + gaussian(rng, 0.002 * std::min(1.0, extent));
  const std::filesystem::path recording = folder / "recording";
  const std::filesystem::path truth_path =
      folder.write("recording/mav0/state_groundtruth_estimate0/data.csv", truth_file(truth));
  const std::filesystem::path terrain_path = folder.write("recording/mav0/truth_extra.csv", terrain_file());
  const std::filesystem::path estimate_path = folder.write("states.csv", states_file(estimate_poses(rng, extent), rng));

  const Json expected = reference(estimate_path, truth_path, terrain_path, folder);
  for (const AlignmentKind kind : {AlignmentKind::se3, AlignmentKind::yaw, AlignmentKind::none}) {
    CAPTURE(to_string(kind));
    Estimate estimate = read_estimate(estimate_path);
    for (const bool with_covariance : {true, false}) {
      if (!with_covariance) estimate.covariance.clear();
      const Evaluation result = evaluate(estimate, read_truth(recording), kind, read_terrain(recording));
      CHECK(result.in_gaps > 0);
      CHECK(result.outside > 0);
      CHECK(result.false_tracking->share > 0.0);
      const Json ours = Json::parse(to_json({result}, "truth"))["estimates"][0];
      Json theirs = expected[to_string(kind)];
      if (!with_covariance) {
        if (kind == AlignmentKind::se3) theirs["start_to_end"].erase("error_m");  // aligned by all six
        theirs["nees"] = nullptr;
        theirs.erase("false_tracking");
      }
      compare(theirs, ours, "");
    }
  }
}

TEST_CASE("all figures agree with an independent numpy script: a room") { check_against_reference(1.0, 41); }

TEST_CASE("all figures agree with an independent numpy script: 300 m") { check_against_reference(12.0, 42); }

TEST_CASE("all figures agree with an independent numpy script: nearly standing") { check_against_reference(0.01, 43); }

}  // namespace
}  // namespace ear::evaluation
