#include <doctest/doctest.h>

#include "src/recording/calibration_files.h"
#include "src/recording/calibration_writer.h"
#include "tests/recording/support.h"

using namespace ear;
using namespace ear::test;

namespace {

Calibration load(const fs::path& mav0, const std::vector<fs::path>& files = {}) {
  Warnings warnings;
  return load_calibration(mav0, files, warnings);
}

// Replaces a part of a file's text, which must be there.
void replace_in(const fs::path& file, const std::string& old_part, const std::string& new_part) {
  std::string text = read_text(file);
  const std::size_t at = text.find(old_part);
  REQUIRE(at != std::string::npos);
  write_text(file, text.replace(at, old_part.size(), new_part));
}

const std::string kCamchain =
    "cam0:\n"
    "  T_cam_imu:\n"
    "  - [0.0, -1.0, 0.0, 0.05]\n"
    "  - [0.0, 0.0, -1.0, 0.0]\n"
    "  - [1.0, 0.0, 0.0, -0.1]\n"
    "  - [0.0, 0.0, 0.0, 1.0]\n"
    "  cam_overlaps: [1]\n"
    "  camera_model: pinhole\n"
    "  distortion_coeffs: [0.1, 0.2, 0.3, 0.4]\n"
    "  distortion_model: equidistant\n"
    "  intrinsics: [10.5, 10.25, 8.0, 6.0]\n"
    "  resolution: [16, 12]\n"
    "  rostopic: /cam0/image_raw\n"
    "  timeshift_cam_imu: -0.0125\n"
    "cam1:\n"
    "  T_cn_cnm1:\n"
    "  - [1.0, 0.0, 0.0, -0.1]\n"
    "  - [0.0, 1.0, 0.0, 0.0]\n"
    "  - [0.0, 0.0, 1.0, 0.0]\n"
    "  - [0.0, 0.0, 0.0, 1.0]\n"
    "  camera_model: pinhole\n"
    "  distortion_coeffs: [0.0, 0.0, 0.0, 0.0]\n"
    "  distortion_model: radtan\n"
    "  intrinsics: [10.5, 10.25, 8.0, 6.0]\n"
    "  resolution: [16, 12]\n";

const std::string kKalibrImu =
    "rostopic: /imu0\nupdate_rate: 250.0\naccelerometer_noise_density: 0.02\naccelerometer_random_walk: 0.003\n"
    "gyroscope_noise_density: 0.004\ngyroscope_random_walk: 0.00005\n";

}  // namespace

TEST_CASE("calibration: all keys of sensor.yaml") {
  const TempFolder folder;
  write_full_recording(folder.path());
  const Calibration c = load(folder.path());

  REQUIRE(c.cameras.size() == 2);
  CHECK(c.cameras[0].T_BC.translation() == Eigen::Vector3d(0.1, 0.05, 0.0));
  CHECK((c.cameras[0].T_BC.linear() * Eigen::Vector3d::UnitZ()).isApprox(Eigen::Vector3d::UnitX()));
  CHECK(c.cameras[0].width == 16);
  CHECK(c.cameras[0].height == 12);
  CHECK(c.cameras[0].fu == 10.5);
  CHECK(c.cameras[0].fv == 10.25);
  CHECK(c.cameras[0].cu == 8.0);
  CHECK(c.cameras[0].cv == 6.0);
  CHECK(c.cameras[0].distortion == std::array<double, 5>{0.1, 0.2, 0.3, 0.4, 0.0});
  CHECK(c.cameras[0].rate_hz == 10.0);
  CHECK(c.imu.rate_hz == 100.0);
  CHECK(c.imu.gyro_noise == 0.001);
  CHECK(c.imu.gyro_random_walk == 0.00002);
  CHECK(c.imu.accel_noise == 0.01);
  CHECK(c.imu.accel_random_walk == 0.0003);
  REQUIRE(c.encoder);
  CHECK(c.encoder->T_BO.translation().z() == -0.05);
  CHECK(c.encoder->resolution == 4096);
  CHECK(c.encoder->wraps);
  CHECK(c.encoder->wheel_radius == std::array<double, 2>{0.075, 0.076});
  CHECK(c.encoder->track_width == 0.4);
  CHECK(c.encoder->noise_counts == 2.0);
  REQUIRE(c.lasers);
  REQUIRE(c.lasers->beams.size() == 3);
  CHECK(c.lasers->beams[1].name == "front_right");
  CHECK(c.lasers->beams[1].p_BL == Eigen::Vector3d(0.1, -0.1, 0.0));
  CHECK(c.lasers->beams[1].d_B == -Eigen::Vector3d::UnitZ());
  CHECK(c.lasers->range_max == 4.0);
  CHECK(c.lasers->noise == 0.004);
  CHECK(check_calibration(c).empty());
}

TEST_CASE("calibration: the time offset may stand in cam0's sensor.yaml") {
  const TempFolder folder;
  write_full_recording(folder.path());
  CHECK(load(folder.path()).camera_time_offset == 0.0);
  const fs::path file = folder.path() / "cam0" / "sensor.yaml";
  write_text(file, read_text(file) + "\ntimeshift_cam_imu: 0.0015\n");
  CHECK(load(folder.path()).camera_time_offset == 0.0015);
}

TEST_CASE("calibration: the time offsets of wheels and lasers stand in their sensor.yaml") {
  const TempFolder folder;
  write_full_recording(folder.path());
  CHECK(load(folder.path()).encoder->time_offset == 0.0);
  CHECK(load(folder.path()).lasers->time_offset == 0.0);
  write_text(folder / "encoder0/sensor.yaml",
             kEncoderYaml + "timeshift_encoder_imu: -0.021\ntimeshift_encoder_imu_sigma: 0.001\n");
  write_text(folder / "laser0/sensor.yaml",
             kLaserYaml + "timeshift_laser_imu: 0.034\ntimeshift_laser_imu_sigma: 0.002\n");
  const Calibration c = load(folder.path());
  CHECK(c.encoder->time_offset == -0.021);
  CHECK(c.encoder->time_offset_sigma == 0.001);
  CHECK(c.lasers->time_offset == 0.034);
  CHECK(c.lasers->time_offset_sigma == 0.002);
  CHECK(check_calibration(c).empty());
  write_text(folder / "encoder0/sensor.yaml", kEncoderYaml + "timeshift_encoder_imu: soon\n");
  CHECK(contains(input_error_of([&] { load(folder.path()); }),
                 "encoder0/sensor.yaml:9: timeshift_encoder_imu: 'soon' is not a number"));
}

TEST_CASE("calibration: names of lens models") {
  const TempFolder folder;
  write_full_recording(folder.path());
  const auto lens = [&](const std::string& name) {
    write_text(folder / "cam0/sensor.yaml", camera_yaml("0.05", name));
    return load(folder.path()).cameras.at(0);
  };
  for (const char* name : {"radial-tangential", "radtan", "plumb_bob"}) {
    CHECK(lens(name).lens == LensModel::radial_tangential);
  }
  for (const char* name : {"equidistant", "kannala_brandt4"}) CHECK(lens(name).lens == LensModel::equidistant);
  CHECK(lens("none").distortion == std::array<double, 5>{});
  const std::string error = input_error_of([&] { lens("fov"); });
  CHECK(contains(error, "cam0/sensor.yaml:15: distortion_model: 'fov' is not known"));
}

TEST_CASE("calibration: the fifth coefficient is k3; there is no sixth, and none of the equidistant model") {
  const TempFolder folder;
  write_full_recording(folder.path());
  const fs::path file = folder / "cam0/sensor.yaml";
  const auto with = [&](const std::string& lens, const std::string& coefficients) {
    write_text(file, camera_yaml("0.05", lens));
    replace_in(file, "0.1, 0.2, 0.3, 0.4", coefficients);
    return load(folder.path()).cameras[0];
  };
  const auto error = [&](const std::string& lens, const std::string& coefficients) {
    return input_error_of([&] { with(lens, coefficients); });
  };
  CHECK(with("plumb_bob", "0.1, 0.2, 0.3, 0.4, 0.5").distortion == std::array<double, 5>{0.1, 0.2, 0.3, 0.4, 0.5});
  CHECK(with("plumb_bob", "0.1, 0.2, 0.3, 0.4, 0.5, 0.0").distortion[4] == 0.5);  // a zero changes nothing
  CHECK(contains(error("plumb_bob", "0.1, 0.2, 0.3, 0.4, 0.5, 0.6"),
                 "cam0/sensor.yaml:16: distortion_coefficients: 6 coefficients, of which only the first five"));
  CHECK(contains(error("plumb_bob", "0.1, 0.2, 0.3"), "distortion_coefficients: 3 numbers, not 4 or 5"));
  CHECK(with("equidistant", "0.1, 0.2, 0.3, 0.4, 0.0").distortion[3] == 0.4);
  CHECK(contains(error("equidistant", "0.1, 0.2, 0.3, 0.4, 0.5"), "5 coefficients, of which only the first four"));
}

TEST_CASE("kalibr: radtan with k3") {
  const TempFolder folder;
  write_text(folder / "chain.yaml", kCamchain);
  write_text(folder / "imu.yaml", kKalibrImu);
  replace_in(folder / "chain.yaml", "[0.0, 0.0, 0.0, 0.0]\n  distortion_model",
             "[-0.3, 0.1, 0.0, 0.0, -0.02]\n  distortion_model");
  CHECK(load_kalibr(folder / "chain.yaml", folder / "imu.yaml").cameras[1].distortion[4] == -0.02);
}

TEST_CASE("calibration: errors name file, line and key") {
  const TempFolder folder;
  write_full_recording(folder.path());
  const auto error = [&] { return input_error_of([&] { load(folder.path()); }); };
  const fs::path camera = folder / "cam0/sensor.yaml";

  SUBCASE("a key is missing") {
    replace_in(camera, "intrinsics:", "intrinsic:");
    CHECK(contains(error(), "cam0/sensor.yaml:"));
    CHECK(contains(error(), "intrinsics: missing"));
  }
  SUBCASE("a number is none") {
    replace_in(camera, "10.25", "wide");
    CHECK(contains(error(), "cam0/sensor.yaml:14: intrinsics: 'wide' is not a number"));
  }
  SUBCASE("a number is not finite") {
    replace_in(camera, "10.25", ".nan");
    CHECK(contains(error(), "cam0/sensor.yaml:14: intrinsics: '.nan' is not a finite number"));
  }
  SUBCASE("an image of a size that none has") {
    std::string size = "16, 12";
    for (const char* next : {"16, 4.8e72", "-16, 12", "16, 12.5", "0, 12"}) {
      replace_in(camera, size, next);
      size = next;
      CHECK(contains(error(), "resolution: two whole numbers from 1 to 65536 expected"));
    }
  }
  SUBCASE("too few numbers") {
    replace_in(camera, "16, 12", "16");
    CHECK(contains(error(), "cam0/sensor.yaml:12: resolution: 1 numbers, not 2"));
  }
  SUBCASE("a pose is no 4x4 matrix") {
    replace_in(camera, "0, 0, 0, 1]", "0, 0, 1]");
    CHECK(contains(error(), "cam0/sensor.yaml:7: T_BS: 15 numbers, not 16"));
  }
  SUBCASE("a model that is not known") {
    replace_in(camera, "pinhole", "omni");
    CHECK(contains(error(), "cam0/sensor.yaml:13: camera_model: 'omni' is not known"));
  }
  SUBCASE("not YAML") {
    write_text(camera, "T_BS: [1, 2\nrate_hz: 20\n");
    CHECK(contains(error(), "cam0/sensor.yaml:"));
    CHECK(contains(error(), "not valid YAML"));
  }
  SUBCASE("empty") {
    write_text(camera, "");
    CHECK(contains(error(), "cam0/sensor.yaml"));
  }
  SUBCASE("a beam") {
    replace_in(folder / "laser0/sensor.yaml", "origin: [0.1, -0.1, 0]", "origin: [0.1, -0.1]");
    CHECK(contains(error(), "laser0/sensor.yaml:5: beams[1].origin: 2 numbers, not 3"));
  }
  SUBCASE("an encoder's resolution is no whole number") {
    replace_in(folder / "encoder0/sensor.yaml", "4096", "40.96");
    CHECK(contains(error(), "encoder0/sensor.yaml:4: resolution: '40.96' is not a whole number"));
  }
}

TEST_CASE("calibration: poses of another body are turned into the IMU's frame, with a warning") {
  const TempFolder folder;
  write_full_recording(folder.path());
  const Calibration before = load(folder.path());
  // The IMU sits 0.2 m ahead of the body of the files and is turned by 90 degrees about y.
  replace_in(folder / "imu0/sensor.yaml", "[1,0,0,0, 0,1,0,0,", "[0,0,1,0.2, 0,1,0,0,");
  replace_in(folder / "imu0/sensor.yaml", "0,0,1,0, 0,0,0,1]", "-1,0,0,0, 0,0,0,1]");
  Warnings warnings;
  const Calibration after = load_calibration(folder.path(), {}, warnings);
  CHECK(warnings.list().size() == 1);

  Eigen::Isometry3d T_FB = Eigen::Isometry3d::Identity();
  T_FB.translation().x() = 0.2;
  T_FB.linear() << 0, 0, 1, 0, 1, 0, -1, 0, 0;
  CHECK((T_FB * after.cameras[0].T_BC).isApprox(before.cameras[0].T_BC));
  CHECK((T_FB * after.encoder->T_BO).isApprox(before.encoder->T_BO));
  CHECK((T_FB * after.lasers->beams[0].p_BL).isApprox(before.lasers->beams[0].p_BL));
  CHECK((T_FB.linear() * after.lasers->beams[0].d_B).isApprox(before.lasers->beams[0].d_B));
}

TEST_CASE("kalibr: camchain and imu.yaml as they are") {
  const TempFolder folder;
  write_text(folder / "camchain-imucam.yaml", kCamchain);
  write_text(folder / "imu.yaml", kKalibrImu);
  const Calibration c = load_kalibr(folder / "camchain-imucam.yaml", folder / "imu.yaml");

  REQUIRE(c.cameras.size() == 2);
  // T_cam_imu takes the IMU's points to the camera: a camera at (0.1, 0.05, 0) that looks forward.
  CHECK(c.cameras[0].T_BC.translation().isApprox(Eigen::Vector3d(0.1, 0.05, 0.0)));
  CHECK((c.cameras[0].T_BC.linear() * Eigen::Vector3d::UnitZ()).isApprox(Eigen::Vector3d::UnitX()));
  // T_cn_cnm1 takes cam0's points to cam1, which lies 0.1 m to its right.
  CHECK(c.cameras[1].T_BC.translation().isApprox(Eigen::Vector3d(0.1, -0.05, 0.0)));
  CHECK(c.cameras[0].lens == LensModel::equidistant);
  CHECK(c.cameras[1].lens == LensModel::radial_tangential);
  CHECK(c.cameras[0].distortion[3] == 0.4);
  CHECK(c.camera_time_offset == -0.0125);  // t_imu = t_cam + shift
  CHECK(c.imu.rate_hz == 250.0);
  CHECK(c.imu.gyro_noise == 0.004);
  CHECK(c.imu.accel_random_walk == 0.003);
  CHECK(check_calibration(c).empty());
}

TEST_CASE("kalibr: replaces a recording's cameras and IMU, not its wheels and lasers") {
  const TempFolder folder;
  write_full_recording(folder / "mav0");
  write_text(folder / "chain.yaml", kCamchain);
  write_text(folder / "imu.yaml", kKalibrImu);
  const Calibration cameras_only = load(folder / "mav0", {folder / "chain.yaml"});
  CHECK(cameras_only.cameras[0].lens == LensModel::equidistant);
  CHECK(cameras_only.imu.rate_hz == 100.0);
  CHECK(cameras_only.encoder);
  const Calibration both = load(folder / "mav0", {folder / "imu.yaml", folder / "chain.yaml"});
  CHECK(both.imu.rate_hz == 250.0);
  CHECK(both.camera_time_offset == -0.0125);

  fs::remove(folder / "mav0/cam0/sensor.yaml");  // not needed any more
  fs::remove(folder / "mav0/imu0/sensor.yaml");
  CHECK(load(folder / "mav0", {folder / "imu.yaml", folder / "chain.yaml"}).cameras.size() == 2);

  fs::remove_all(folder / "mav0/cam1");  // calibrated, but not recorded
  CHECK(load(folder / "mav0", {folder / "imu.yaml", folder / "chain.yaml"}).cameras.size() == 1);
}

TEST_CASE("kalibr: imu.yaml with a key imu0, and files that are neither") {
  const TempFolder folder;
  write_full_recording(folder / "mav0");
  write_text(folder / "imu.yaml",
             "imu0:\n  accelerometer_noise_density: 0.02\n  accelerometer_random_walk: 0.003\n"
             "  gyroscope_noise_density: 0.004\n  gyroscope_random_walk: 0.00005\n  update_rate: 250.0\n");
  CHECK(load(folder / "mav0", {folder / "imu.yaml"}).imu.rate_hz == 250.0);

  write_text(folder / "other.yaml", "a: 1\n");
  CHECK(contains(input_error_of([&] { load(folder / "mav0", {folder / "other.yaml"}); }), "other.yaml: neither"));

  write_text(folder / "chain.yaml", kCamchain);
  replace_in(folder / "chain.yaml", "T_cam_imu", "T_cam_body");
  CHECK(contains(input_error_of([&] { load(folder / "mav0", {folder / "chain.yaml"}); }), "cam0.T_cam_imu: missing"));
}

TEST_CASE("calibration: standard deviations beside the values") {
  const TempFolder folder;
  write_full_recording(folder.path());
  const auto append = [&](const char* sensor, const std::string& text) {
    const fs::path file = folder / sensor / "sensor.yaml";
    write_text(file, read_text(file) + "\n" + text);
  };
  CHECK_FALSE(load(folder.path()).cameras[0].pose_sigma);
  CHECK_FALSE(load(folder.path()).encoder->wheel_radius_sigma);

  append("cam0", "T_BS_sigma: {rotation: 0.002, position: 0.001}\ntimeshift_cam_imu_sigma: 0.0005\n");
  append("cam1",
         "T_C0C1_sigma: {rotation: 0.0003, position: 0.00005}\n"
         "intrinsics_sigma: {focal_length: 0.4, principal_point: 0.2}\n");
  append("imu0",
         "gyroscope_bias_sigma: 0.01\naccelerometer_bias_sigma: 0.2\n"
         "gyroscope_scale_sigma: 0.01\naccelerometer_scale_sigma: 0.02\n");
  append("encoder0",
         "T_BS_sigma: {rotation: 0.004, position: 0.003}\nwheel_radius_sigma: 0.0003\n"
         "wheel_radius_difference_sigma: 0.0001\nwheel_separation_sigma: 0.002\nstamp_sigma: 0.004\n");
  append("laser0", "offset_sigma: 0.0015\n");
  const Calibration c = load(folder.path());
  REQUIRE(c.cameras[0].pose_sigma);
  CHECK(c.cameras[0].pose_sigma->rotation == 0.002);
  CHECK(c.cameras[0].pose_sigma->position == 0.001);
  REQUIRE(c.cameras[1].pose_sigma);
  CHECK(c.cameras[1].pose_sigma->position == 0.00005);
  CHECK_FALSE(c.cameras[0].intrinsics_sigma);
  REQUIRE(c.cameras[1].intrinsics_sigma);
  CHECK(c.cameras[1].intrinsics_sigma->focal_length == 0.4);
  CHECK(c.cameras[1].intrinsics_sigma->principal_point == 0.2);
  CHECK(c.camera_time_offset_sigma == 0.0005);
  CHECK(c.imu.gyro_bias_sigma == 0.01);
  CHECK(c.imu.accel_bias_sigma == 0.2);
  CHECK(c.imu.gyro_scale_sigma == 0.01);
  CHECK(c.imu.accel_scale_sigma == 0.02);
  CHECK(c.imu.gyro_matrix.isIdentity(0.0));
  REQUIRE(c.encoder->T_BO_sigma);
  CHECK(c.encoder->T_BO_sigma->rotation == 0.004);
  CHECK(c.encoder->wheel_radius_sigma == 0.0003);
  CHECK(c.encoder->wheel_radius_difference_sigma == 0.0001);
  CHECK(c.encoder->track_width_sigma == 0.002);
  CHECK(c.encoder->stamp_sigma == 0.004);
  CHECK(c.lasers->offset_sigma == 0.0015);
}

TEST_CASE("calibration: standard deviations that cannot be are errors that name file, line and key") {
  const TempFolder folder;
  write_full_recording(folder.path());
  const auto error_with = [&](const char* sensor, const std::string& text) {
    const fs::path file = folder / sensor / "sensor.yaml";
    const std::string before = read_text(file);
    write_text(file, before + "\n" + text + "\n");
    const std::string error = input_error_of([&] { load(folder.path()); });
    write_text(file, before);
    return error;
  };
  CHECK(contains(error_with("encoder0", "wheel_radius_sigma: 0"), ": wheel_radius_sigma: '0' is not positive"));
  CHECK(contains(error_with("encoder0", "wheel_separation_sigma: -0.1"),
                 "wheel_separation_sigma: '-0.1' is not positive"));
  CHECK(contains(error_with("imu0", "gyroscope_bias_sigma: .inf"),
                 "gyroscope_bias_sigma: '.inf' is not a finite number"));
  CHECK(contains(error_with("encoder0", "timeshift_encoder_imu_sigma: 0"),
                 ": timeshift_encoder_imu_sigma: '0' is not positive"));
  CHECK(contains(error_with("laser0", "offset_sigma: .nan"), "offset_sigma: '.nan' is not a finite number"));
  CHECK(contains(error_with("cam0", "T_BS_sigma: {rotation: 0.1}"), ": T_BS_sigma: {rotation: rad"));
  CHECK(contains(error_with("cam0", "T_BS_sigma: 0.1"), "T_BS_sigma: keys and values expected"));
  CHECK(contains(error_with("cam0", "T_BS_sigma: {rotation: 0.1, positon: 0.1}"),
                 "T_BS_sigma.positon: there is no such"));
  CHECK(contains(error_with("cam0", "intrinsics_sigma: 0.5"), "intrinsics_sigma: keys and values expected"));
  CHECK(contains(error_with("cam0", "intrinsics_sigma: [1, 1, 1, 1]"), "intrinsics_sigma: keys and values expected"));
  CHECK(contains(error_with("cam1", "intrinsics_sigma: {focal_length: 0.4}"),
                 ": intrinsics_sigma: {focal_length: px, principal_point: px} expected"));
  CHECK(contains(error_with("cam1", "intrinsics_sigma: {focal_length: 0, principal_point: 0.2}"),
                 "intrinsics_sigma.focal_length: '0' is not positive"));
  CHECK(contains(error_with("cam1", "intrinsics_sigma: {focal_length: 0.4, principal_point: 0.2, fu: 1}"),
                 "intrinsics_sigma.fu: there is no such"));
  CHECK(contains(error_with("cam0", "timeshift_cam_imu_sigma: soon"), "'soon' is not a number"));
  CHECK(contains(error_with("cam1", "T_BS_sigma: {rotation: 0.1, position: 0.1}"), "T_C0C1_sigma"));
}

TEST_CASE("kalibr: standard deviations beside its values") {
  const TempFolder folder;
  write_text(folder / "chain.yaml", kCamchain);
  replace_in(
      folder / "chain.yaml", "  cam_overlaps",
      "  T_cam_imu_sigma: {rotation: 0.002, position: 0.001}\n  timeshift_cam_imu_sigma: 0.0004\n  cam_overlaps");
  replace_in(folder / "chain.yaml", "cam1:\n",
             "cam1:\n  T_cn_cnm1_sigma: {rotation: 0.0003, position: 0.00004}\n"
             "  intrinsics_sigma: {focal_length: 0.4, principal_point: 0.2}\n");
  write_text(folder / "imu.yaml", kKalibrImu + "gyroscope_bias_sigma: 0.02\n");
  const Calibration c = load_kalibr(folder / "chain.yaml", folder / "imu.yaml");
  REQUIRE(c.cameras[0].pose_sigma);
  CHECK(c.cameras[0].pose_sigma->rotation == 0.002);
  REQUIRE(c.cameras[1].pose_sigma);
  CHECK(c.cameras[1].pose_sigma->position == 0.00004);
  REQUIRE(c.cameras[1].intrinsics_sigma);
  CHECK(c.cameras[1].intrinsics_sigma->principal_point == 0.2);
  CHECK(c.camera_time_offset_sigma == 0.0004);
  CHECK(c.imu.gyro_bias_sigma == 0.02);
}

TEST_CASE("calibration: what is written comes back, in the place of the recording's own") {
  const TempFolder folder;
  write_full_recording(folder / "recording");
  Calibration c = load(folder / "recording");
  c.cameras[0].T_BC.translation().z() += 0.01;
  c.cameras[0].fu = 11.0;
  c.cameras[0].distortion[4] = 0.05;
  c.cameras[0].lens = LensModel::radial_tangential;
  c.cameras[1].pose_sigma = PoseSigma{1e-4, 2e-4};
  c.cameras[0].intrinsics_sigma = IntrinsicsSigma{0.3, 0.25};
  c.camera_time_offset = -0.003;
  c.camera_time_offset_sigma = 1e-4;
  c.imu.gyro_noise = 0.002;
  c.imu.accel_bias_sigma = 0.3;
  c.imu.gyro_scale_sigma = 0.004;
  c.imu.accel_scale_sigma = 0.005;
  c.imu.gyro_matrix << 1.01, 0.001, -0.002, 0.003, 0.99, -0.004, 0.005, 0.006, 1.02;
  c.encoder->wheel_radius = {0.0751, 0.0749};
  c.encoder->wheel_radius_sigma = 1e-5;
  c.encoder->wheel_radius_difference_sigma = 2e-5;
  c.encoder->track_width_sigma = 3e-4;
  c.encoder->T_BO_sigma = PoseSigma{1e-3, 2e-3};
  c.encoder->stamp_sigma = 0.001;
  c.encoder->time_offset = -0.0123456789;
  c.encoder->time_offset_sigma = 2e-4;
  c.lasers->time_offset = 0.0345;
  c.lasers->time_offset_sigma = 3e-4;
  c.lasers->beams[0].p_BL.x() += 0.002;
  c.lasers->offset_sigma = 4e-3;
  write_calibration(c, folder / "result", "by a test", {{0.001, 0.002}});

  const Calibration back = load(folder / "recording", {folder / "result"});
  REQUIRE(back.cameras.size() == c.cameras.size());
  for (std::size_t i = 0; i < c.cameras.size(); ++i) {
    const CameraCalibration &a = c.cameras[i], &b = back.cameras[i];
    CHECK(b.T_BC.isApprox(a.T_BC, 1e-10));
    CHECK(std::array{b.fu, b.fv, b.cu, b.cv} == std::array{a.fu, a.fv, a.cu, a.cv});
    CHECK(b.distortion == a.distortion);
    CHECK(b.lens == a.lens);
    CHECK(b.rate_hz == a.rate_hz);
  }
  REQUIRE(back.cameras[0].intrinsics_sigma);
  CHECK(back.cameras[0].intrinsics_sigma->focal_length == 0.3);
  CHECK(back.cameras[0].intrinsics_sigma->principal_point == 0.25);
  CHECK_FALSE(back.cameras[1].intrinsics_sigma);
  CHECK(back.cameras[1].pose_sigma->rotation == 1e-4);
  CHECK(back.cameras[1].pose_sigma->position == 2e-4);
  CHECK(back.camera_time_offset == -0.003);
  CHECK(back.camera_time_offset_sigma == 1e-4);
  CHECK(back.imu.gyro_noise == 0.002);
  CHECK(back.imu.accel_random_walk == c.imu.accel_random_walk);
  CHECK(back.imu.accel_bias_sigma == 0.3);
  CHECK(back.imu.gyro_scale_sigma == 0.004);
  CHECK(back.imu.accel_scale_sigma == 0.005);
  CHECK(back.imu.gyro_matrix == c.imu.gyro_matrix);
  CHECK(back.encoder->T_BO.isApprox(c.encoder->T_BO, 1e-10));
  CHECK(back.encoder->T_BO_sigma->position == 2e-3);
  CHECK(back.encoder->wheel_radius == c.encoder->wheel_radius);
  CHECK(back.encoder->wheel_radius_sigma == 1e-5);
  CHECK(back.encoder->wheel_radius_difference_sigma == 2e-5);
  CHECK(back.encoder->track_width_sigma == 3e-4);
  CHECK(back.encoder->resolution == c.encoder->resolution);
  CHECK(back.encoder->wraps == c.encoder->wraps);
  CHECK(back.encoder->noise_counts == c.encoder->noise_counts);
  CHECK(back.encoder->stamp_sigma == 0.001);
  CHECK(back.encoder->time_offset == -0.0123456789);
  CHECK(back.encoder->time_offset_sigma == 2e-4);
  CHECK(back.lasers->time_offset == 0.0345);
  CHECK(back.lasers->time_offset_sigma == 3e-4);
  REQUIRE(back.lasers->beams.size() == c.lasers->beams.size());
  CHECK(back.lasers->beams[0].name == c.lasers->beams[0].name);
  CHECK(back.lasers->beams[0].p_BL.isApprox(c.lasers->beams[0].p_BL, 1e-10));
  CHECK(back.lasers->beams[0].d_B.isApprox(c.lasers->beams[0].d_B, 1e-10));
  CHECK(back.lasers->range_max == c.lasers->range_max);
  CHECK(back.lasers->offset_sigma == 4e-3);

  fs::create_directories(folder / "empty");
  const std::string error = input_error_of([&] { load(folder / "recording", {folder / "empty"}); });
  CHECK(error.find("no cam0/sensor.yaml, imu0/sensor.yaml or the like in this folder") != std::string::npos);
}
