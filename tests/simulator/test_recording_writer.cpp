// Simulated recordings on disk: read back by the project's own reader, refused where they would mix, the same every
// time.
#include <doctest/doctest.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <sstream>
#include <string>
#include <variant>
#include <vector>

#include "src/recording/recording.h"
#include "tools/simulator/picture_files.h"
#include "tools/simulator/recording_writer.h"
#include "tools/simulator/simulation.h"

namespace ear::simulator {
namespace {

namespace fs = std::filesystem;
// A folder of its own for each case, gone afterwards.
class TemporaryFolder {
 public:
  TemporaryFolder() : path_(fs::temp_directory_path() / ("ear_simulator_" + std::to_string(getpid()))) {
    fs::remove_all(path_);
    fs::create_directories(path_);
  }
  ~TemporaryFolder() { fs::remove_all(path_); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  [[nodiscard]] fs::path operator/(const std::string& name) const { return path_ / name; }

 private:
  fs::path path_;
};

Options short_drive(std::uint64_t seed) {
  Options options;
  options.seed = seed;
  options.duration = 0.3;
  options.camera_rate_hz = 10.0;
  options.tracks = false;
  return options;
}

std::string bytes_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  REQUIRE(stream);
  return {std::istreambuf_iterator<char>(stream), {}};
}

std::vector<std::string> lines_of(const fs::path& file) {
  std::istringstream stream(bytes_of(file));
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

void no_progress(std::size_t, std::size_t) {}

}  // namespace

TEST_CASE("recording: the reader gets back calibration and samples") {
  const TemporaryFolder folder;
  Options options = short_drive(41);
  options.duration = 4.0;
  options.k3 = -0.0125;
  options.calibration_error = 1.0;
  const Simulation simulation(options);
  write_recording(simulation, folder / "r");

  ear::Recording recording(folder / "r");
  const ear::Calibration& read = recording.calibration();
  const ear::Calibration& given = simulation.calibration();
  REQUIRE(read.encoder);
  REQUIRE(read.lasers);
  CHECK((read.encoder->T_BO.matrix() - given.encoder->T_BO.matrix()).norm() < 1e-9);
  CHECK(read.encoder->wheel_radius[0] == doctest::Approx(given.encoder->wheel_radius[0]).epsilon(1e-8));
  CHECK(read.encoder->wheel_radius[1] == doctest::Approx(given.encoder->wheel_radius[1]).epsilon(1e-8));
  CHECK(read.encoder->track_width == doctest::Approx(given.encoder->track_width).epsilon(1e-8));
  CHECK(read.encoder->wraps);
  CHECK(read.imu.gyro_noise == given.imu.gyro_noise);
  CHECK(read.imu.accel_random_walk == given.imu.accel_random_walk);
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK((read.lasers->beams[i].d_B - given.lasers->beams[i].d_B).norm() < 1e-9);
    CHECK((read.lasers->beams[i].p_BL - given.lasers->beams[i].p_BL).norm() < 1e-8);
  }

  for (std::size_t i = 0; i < 2; ++i) {
    CHECK(read.cameras[i].distortion == given.cameras[i].distortion);
    CHECK(read.cameras[i].fu == doctest::Approx(given.cameras[i].fu).epsilon(1e-8));
    CHECK(read.cameras[i].cu == doctest::Approx(given.cameras[i].cu).epsilon(1e-8));
    CHECK((read.cameras[i].T_BC.matrix() - given.cameras[i].T_BC.matrix()).norm() < 1e-9);
  }
  CHECK(std::abs(read.camera_time_offset - given.camera_time_offset) < 1e-8);

  std::size_t imu = 0;
  std::size_t encoders = 0;
  std::size_t lasers = 0;
  while (const auto sample = recording.next()) {
    if (const auto* s = std::get_if<ear::ImuSample>(&*sample)) {
      const ear::ImuSample& expected = simulation.imu().at(imu++);
      CHECK(s->t_ns == expected.t_ns);
      CHECK((s->gyro_B - expected.gyro_B).norm() < 1e-8);
      CHECK((s->accel_B - expected.accel_B).norm() < 1e-8);
    } else if (const auto* e = std::get_if<ear::EncoderSample>(&*sample)) {
      CHECK(e->left_count == simulation.encoders().at(encoders).left_count);
      CHECK(e->right_count == simulation.encoders().at(encoders++).right_count);
    } else if (const auto* l = std::get_if<ear::LaserSample>(&*sample)) {
      CHECK(std::abs(l->range[2] - simulation.lasers().at(lasers++).range[2]) < 6e-5);
    }
  }
  CHECK(imu == simulation.imu().size());
  CHECK(encoders == simulation.encoders().size());
  CHECK(lasers == simulation.lasers().size());
}

TEST_CASE("recording: truth rows follow EuRoC's order") {
  const TemporaryFolder folder;
  const Simulation simulation(short_drive(42));
  write_recording(simulation, folder / "r");
  const std::vector<std::string> lines = lines_of(folder / "r/mav0/state_groundtruth_estimate0/data.csv");
  REQUIRE(lines.size() == simulation.imu().size() + 1);
  std::vector<double> row;
  std::istringstream fields(lines[11]);
  for (std::string field; std::getline(fields, field, ',');) row.push_back(std::stod(field));
  REQUIRE(row.size() == 17);
  const Truth truth = simulation.truth(simulation.imu()[10].t_ns);
  CHECK((Eigen::Vector3d(row[1], row[2], row[3]) - truth.p_WB).norm() < 1e-8);
  CHECK((Eigen::Quaterniond(row[4], row[5], row[6], row[7]).toRotationMatrix() - truth.R_WB).norm() < 1e-9);
  CHECK((Eigen::Vector3d(row[8], row[9], row[10]) - truth.v_W).norm() < 1e-8);
  CHECK((Eigen::Vector3d(row[11], row[12], row[13]) - truth.b_g).norm() < 1e-8);
  CHECK((Eigen::Vector3d(row[14], row[15], row[16]) - truth.b_a).norm() < 1e-8);
  CHECK(lines_of(folder / "r/mav0/truth_extra.csv").size() == lines.size());
}

TEST_CASE("recording: without cameras it is one of wheels, beams and IMU") {
  const TemporaryFolder folder;
  write_recording(Simulation(short_drive(45)), folder / "r", WithCameras::no);
  CHECK_FALSE(std::filesystem::exists(folder / "r/mav0/cam0"));
  CHECK_FALSE(std::filesystem::exists(folder / "r/mav0/cam1"));
  ear::Recording recording(folder / "r");
  CHECK(recording.calibration().cameras.empty());
  CHECK(recording.calibration().encoder);
  CHECK(recording.calibration().lasers);
}

TEST_CASE("recording: what is there already is not mixed with something else") {
  const TemporaryFolder folder;
  write_recording(Simulation(short_drive(43)), folder / "r");
  CHECK_THROWS_WITH_AS(write_recording(Simulation(short_drive(44)), folder / "r"), doctest::Contains("already"),
                       std::runtime_error);
}

TEST_CASE("recording: faults are listed, and the reader survives a clock that jumps") {
  const TemporaryFolder folder;
  Options options = short_drive(47);
  options.duration = 4.0;
  write_recording(Simulation(options), folder / "clean");
  options.faults = {parse_fault("laser_biased.rear@1.5+2=0.1"), parse_fault("clock_jump.imu@2+1"),
                    parse_fault("imu_gap@3.5+0.2"), parse_fault("imu_spikes.gyro:3@3+0.4")};
  const Simulation simulation(options);
  write_recording(simulation, folder / "r");
  CHECK(lines_of(folder / "clean/mav0/faults.csv").size() == 1);
  const std::vector<std::string> lines = lines_of(folder / "r/mav0/faults.csv");
  REQUIRE(lines.size() == 5);
  CHECK(lines[1] == "laser_biased,rear,1600000001500000000,1600000003500000000,0.1");
  CHECK(lines[3] == "imu_gap,,1600000003500000000,1600000003700000000,0");
  CHECK(lines[4] == "imu_spikes:3,gyro,1600000003000000000,1600000003400000000,40");
  const std::string truth = "mav0/state_groundtruth_estimate0/data.csv";
  CHECK(bytes_of(folder / "r" / truth) == bytes_of(folder / "clean" / truth));

  ear::Recording recording(folder / "r");
  std::size_t imu = 0;
  while (const auto sample = recording.next()) imu += std::holds_alternative<ear::ImuSample>(*sample) ? 1 : 0;
  // The clock goes back by 20 samples: no stamp may come twice or run backward.
  CHECK(imu == simulation.imu().size() - 20);
}

TEST_CASE("recording: pictures do not depend on the threads, and serve the other calibration, too") {
  const TemporaryFolder folder;
  Options options = short_drive(45);
  const Simulation imperfect(options);
  options.calibration_error = 0.0;
  const Simulation perfect(options);
  options.calibration_error = 1.0;
  const Simulation wrong(options);
  write_recording(imperfect, folder / "imperfect");
  std::size_t given = 0;
  render_images(imperfect, all_pictures(imperfect), folder / "imperfect", 1, [&](std::size_t done, std::size_t total) {
    CHECK(done == ++given);
    CHECK(total == 2 * imperfect.frame_times().size());
  });
  CHECK(given == 2 * imperfect.frame_times().size());
  render_images(imperfect, all_pictures(imperfect), folder / "threads", 3, no_progress);
  render_images(wrong, all_pictures(wrong), folder / "wrong", 1, no_progress);
  write_recording(perfect, folder / "perfect");
  CHECK_NOTHROW(require_same_pictures(perfect, folder / "imperfect"));
  CHECK(link_images(perfect, folder / "perfect", folder / "imperfect").empty());
  for (const ear::TimeNs t_ns : imperfect.frame_times()) {
    for (const std::size_t camera : {0U, 1U}) {
      const std::string bytes = bytes_of(image_path(folder / "imperfect", camera, t_ns));
      CHECK(bytes.size() > 50000);
      CHECK(bytes == bytes_of(image_path(folder / "threads", camera, t_ns)));
      CHECK(bytes == bytes_of(image_path(folder / "perfect", camera, t_ns)));
      CHECK(bytes == bytes_of(image_path(folder / "wrong", camera, t_ns)));
    }
  }
  CHECK(bytes_of(folder / "perfect/mav0/imu0/data.csv") == bytes_of(folder / "imperfect/mav0/imu0/data.csv"));
  CHECK(bytes_of(folder / "perfect/mav0/cam0/sensor.yaml") != bytes_of(folder / "imperfect/mav0/cam0/sensor.yaml"));

  CHECK_NOTHROW(require_same_pictures(wrong, folder / "imperfect"));

  const Simulation other(short_drive(46));
  CHECK_THROWS_WITH_AS(require_same_pictures(other, folder / "imperfect"), doctest::Contains("seed: 46"),
                       std::runtime_error);
  CHECK_THROWS_WITH_AS(require_same_pictures(other, folder / "nowhere"), doctest::Contains("simulation.yaml"),
                       std::runtime_error);
}

TEST_CASE("recording: late frames are read when they arrive") {
  const TemporaryFolder folder;
  Options options = short_drive(49);
  options.duration = 0.6;
  options.faults = {parse_fault("camera_late@0.2+0.1=0.15")};
  const Simulation simulation(options);
  write_recording(simulation, folder / "r");
  // Frames at 0.11, 0.21 (arrives at 0.37), 0.31 (behind it), 0.41, 0.51, 0.61 s.
  CHECK(lines_of(folder / "r/mav0/cam0/arrival.csv").size() == 3);
  render_images(simulation, all_pictures(simulation), folder / "r", 2, no_progress);
  ear::Recording recording(folder / "r");
  TimeNs imu_ns = 0;
  std::size_t frames = 0;
  while (const auto sample = recording.next()) {
    if (const auto* s = std::get_if<ear::ImuSample>(&*sample)) imu_ns = s->t_ns;
    const auto* frame = std::get_if<ear::RecordedFrame>(&*sample);
    if (frame == nullptr) continue;
    const Frame& expected = simulation.frames().at(frames++);
    CHECK(frame->t_ns == expected.t_ns);
    const bool late = expected.arrival_ns > expected.taken_ns + kFrameDelay;
    CHECK(late == (frames == 2 || frames == 3));
    CHECK(frame->arrival_ns == (late ? expected.arrival_ns : expected.t_ns));
    CHECK(std::abs(ear::seconds_between(frame->arrival_ns, imu_ns)) < 0.006);
  }
  CHECK(frames == 6);
  CHECK_FALSE(fs::exists(folder / "r/mav0/cam1/arrival.csv"));
}

TEST_CASE("recording: a faulty one takes from a clean one all pictures that are the same") {
  const TemporaryFolder folder;
  Options options = short_drive(48);
  options.duration = 0.4;  // frames at 0.11, 0.21, 0.31 and 0.41 s
  const Simulation clean(options);
  write_recording(clean, folder / "clean");
  render_images(clean, all_pictures(clean), folder / "clean", 2, no_progress);

  options.faults = {parse_fault("camera_dark.right@0.2+0.1"), parse_fault("camera_frozen.left@0.3+0.1"),
                    parse_fault("clock_jump@0.3+0.1=-0.1"), parse_fault("encoder_frozen@0.1+0.1")};
  const Simulation faulty(options);
  write_recording(faulty, folder / "direct");
  render_images(faulty, all_pictures(faulty), folder / "direct", 2, no_progress);
  write_recording(faulty, folder / "linked");
  CHECK_NOTHROW(require_same_pictures(faulty, folder / "clean"));
  const std::vector<Shot> missing = link_images(faulty, folder / "linked", folder / "clean");
  REQUIRE(missing.size() == 1);
  CHECK(missing[0].exposure == 1);
  CHECK(missing[0].camera == 1);
  render_images(faulty, missing, folder / "linked", 1, no_progress);
  write_recording(faulty, folder / "again");
  CHECK_NOTHROW(require_same_pictures(faulty, folder / "linked"));
  CHECK(link_images(faulty, folder / "again", folder / "linked").empty());
  const auto bytes = [&](const char* name, std::size_t camera, std::size_t exposure) {
    return bytes_of(image_path(folder / name, camera, faulty.exposures()[exposure]));
  };
  for (std::size_t exposure = 0; exposure < 4; ++exposure) {
    CAPTURE(exposure);
    for (const std::size_t camera : {0U, 1U}) {
      CHECK(bytes("direct", camera, exposure) == bytes("linked", camera, exposure));
      CHECK(bytes("direct", camera, exposure) == bytes("again", camera, exposure));
    }
    CHECK((bytes("direct", 0, exposure) == bytes("clean", 0, exposure)) == (exposure != 2));
    CHECK((bytes("direct", 1, exposure) == bytes("clean", 1, exposure)) == (exposure != 1));
  }
  CHECK(bytes("direct", 0, 2) == bytes("clean", 0, 1));

  // Stamps jump, file names do not: two frames have one stamp here.
  const std::vector<std::string> rows = lines_of(folder / "direct/mav0/cam0/data.csv");
  REQUIRE(rows.size() == 5);
  CHECK(rows[3] == "1600000000208300000,1600000000308300000.png");

  // Pictures with other faults, or with faults where none are wanted, are not the same.
  CHECK_THROWS_WITH_AS(require_same_pictures(clean, folder / "direct"), doctest::Contains("camera_dark.right"),
                       std::runtime_error);
  options.faults = {parse_fault("camera_dark.right@0.2+0.2")};
  CHECK_THROWS_WITH_AS(require_same_pictures(Simulation(options), folder / "direct"),
                       doctest::Contains("camera_dark.right@0.2+0.2"), std::runtime_error);
}

}  // namespace ear::simulator
