#include <doctest/doctest.h>

#include <cmath>

#include "src/recording/recording.h"
#include "tests/recording/support.h"

using namespace ear;
using namespace ear::test;

namespace {

struct Contents {
  std::vector<Sample> samples;
  std::vector<ImuSample> imu;
  std::vector<EncoderSample> encoder;
  std::vector<LaserSample> laser;
  std::vector<RecordedFrame> frames;
  std::vector<Warning> warnings;
};

Contents read_all(const fs::path& folder, const RecordingOptions& options = {}) {
  Recording recording(folder, options);
  Contents all;
  while (const auto sample = recording.next()) {
    all.samples.push_back(*sample);
    std::visit(Overloaded{[&](const ImuSample& s) { all.imu.push_back(s); },
                          [&](const EncoderSample& s) { all.encoder.push_back(s); },
                          [&](const LaserSample& s) { all.laser.push_back(s); },
                          [&](const RecordedFrame& s) { all.frames.push_back(s); }},
               *sample);
  }
  all.warnings = recording.warnings();
  return all;
}

// The only warning there is.
Warning only_warning(const Contents& all) {
  REQUIRE(all.warnings.size() == 1);
  return all.warnings.front();
}

std::string imu_rows(const std::string& rows) { return "#timestamp,w_x,w_y,w_z,a_x,a_y,a_z\n" + rows; }

}  // namespace

TEST_CASE("recording: all sensors in time order, of equal times IMU, encoder, laser, images") {
  const TempFolder folder;
  write_full_recording(folder / "mav0");
  const Contents all = read_all(folder.path());
  CHECK(all.imu.size() == 101);
  CHECK(all.encoder.size() == 101);
  CHECK(all.laser.size() == 51);
  CHECK(all.frames.size() == 10);
  CHECK(all.warnings.empty());
  for (std::size_t i = 1; i < all.samples.size(); ++i) {
    CAPTURE(i);
    const TimeNs before = time_of(all.samples[i - 1]);
    const TimeNs now = time_of(all.samples[i]);
    CHECK((before < now || (before == now && all.samples[i - 1].index() < all.samples[i].index())));
  }
}

TEST_CASE("recording: wheels and lasers come where they belong by the IMU's clock, with the stamps that they had") {
  const TempFolder folder;
  write_full_recording(folder / "mav0");
  write_text(folder / "mav0/encoder0/sensor.yaml", kEncoderYaml + "timeshift_encoder_imu: 0.05\n");
  write_text(folder / "mav0/laser0/sensor.yaml", kLaserYaml + "timeshift_laser_imu: -0.03\n");
  const Contents all = read_all(folder.path());
  REQUIRE(all.samples.size() == 101 + 101 + 51 + 10);
  CHECK(all.encoder[1].t_ns == 10'000'000);
  CHECK(all.laser[1].t_ns == 20'000'000);
  const auto imu_time = [](const Sample& sample) {
    return time_of(sample) + (sample.index() == 1 ? 50'000'000 : sample.index() == 2 ? -30'000'000 : 0);
  };
  for (std::size_t i = 1; i < all.samples.size(); ++i) {
    CAPTURE(i);
    const TimeNs before = imu_time(all.samples[i - 1]);
    const TimeNs now = imu_time(all.samples[i]);
    CHECK((before < now || (before == now && all.samples[i - 1].index() < all.samples[i].index())));
  }
}

TEST_CASE("recording: values arrive as written") {
  const TempFolder folder;
  write_full_recording(folder / "mav0");
  const Contents all = read_all(folder / "mav0");  // the inner folder is accepted too
  CHECK(all.imu[1].t_ns == 10'000'000);
  CHECK(all.imu[1].gyro_B == Eigen::Vector3d(0.01, 0.02, 0.03));
  CHECK(all.imu[1].accel_B == Eigen::Vector3d(0.1, 0.2, 9.8));
  CHECK(all.encoder[2].left_count == 80);
  CHECK(all.encoder[2].right_count == 7);
  REQUIRE(all.laser[0].range.size() == 3);
  CHECK(all.laser[0].range[0] == 0.12);
  CHECK(std::isnan(all.laser[0].range[1]));
  CHECK(std::isnan(all.laser[0].range[2]));  // beyond the sensor's range: no return
  CHECK(all.frames[3].t_ns == 300'000'000);
  CHECK(all.frames[3].left.width == 16);
  CHECK(all.frames[3].left.height == 12);
  CHECK(all.frames[3].left.data[0] == 3);
  CHECK(all.frames[3].right.data[11 * all.frames[3].right.stride + 15] == 3);
}

TEST_CASE("recording: reads the same again, and a frame outlives its recording") {
  const TempFolder folder;
  write_full_recording(folder / "mav0");
  const Contents first = read_all(folder.path());
  const Contents second = read_all(folder.path());
  REQUIRE(first.samples.size() == second.samples.size());
  for (std::size_t i = 0; i < first.samples.size(); ++i) CHECK(time_of(first.samples[i]) == time_of(second.samples[i]));
  for (std::size_t i = 0; i < first.frames.size(); ++i) CHECK(first.frames[i].left.data[5] == static_cast<int>(i));
}

TEST_CASE("recording: can be left early while the images are still being decoded") {
  const TempFolder folder;
  write_full_recording(folder / "mav0");
  Recording recording(folder.path());
  CHECK(recording.next());
  CHECK(recording.span().first_ns == 0);
  CHECK(recording.span().last_ns == 1'000'000'000);
}

TEST_CASE("recording: works without wheels, lasers, cameras, or the second camera") {
  const TempFolder folder;
  write_imu(folder / "mav0", 20);
  CHECK(read_all(folder.path()).samples.size() == 20);
  CHECK(Recording(folder.path()).calibration().cameras.empty());
  CHECK_FALSE(Recording(folder.path()).calibration().encoder);

  write_camera(folder / "mav0", "cam0", 2);
  const Contents mono = read_all(folder.path());
  CHECK(mono.frames.size() == 2);
  CHECK(mono.frames[0].right.empty());
  CHECK(mono.warnings.empty());

  write_camera(folder / "mav0", "cam1", 2);
  CHECK_FALSE(read_all(folder.path()).frames[0].right.empty());
  RecordingOptions options;
  options.mono = true;
  CHECK(read_all(folder.path(), options).frames[0].right.empty());
  CHECK(Recording(folder.path(), options).calibration().cameras.size() == 1);
}

TEST_CASE("recording: what must be there is missing") {
  const TempFolder folder;
  CHECK(contains(input_error_of([&] { Recording(folder / "none"); }), "no such folder"));
  CHECK(contains(input_error_of([&] { Recording{folder.path()}; }), "imu0"));

  write_imu(folder / "mav0", 5);
  fs::remove(folder / "mav0/imu0/data.csv");
  CHECK(contains(input_error_of([&] { Recording{folder.path()}; }), "imu0/data.csv"));

  write_imu(folder / "mav0", 0);
  CHECK(contains(input_error_of([&] { Recording{folder.path()}; }), "no inertial sample"));

  write_imu(folder / "mav0", 5);
  write_camera(folder / "mav0", "cam0", 2);
  fs::remove(folder / "mav0/cam0/sensor.yaml");
  CHECK(contains(input_error_of([&] { Recording{folder.path()}; }), "cam0/sensor.yaml"));

  write_camera(folder / "mav0", "cam1", 2);
  fs::remove_all(folder / "mav0/cam0");
  CHECK(contains(input_error_of([&] { Recording{folder.path()}; }), "cam0"));
}

TEST_CASE("recording: a first row that is malformed is an error with file, line and field") {
  const TempFolder folder;
  const fs::path csv = folder / "mav0/imu0/data.csv";
  write_imu(folder / "mav0", 5);
  const auto error = [&] { return input_error_of([&] { Recording{folder.path()}; }); };

  write_text(csv, imu_rows("1.5,0,0,0,0,0,9.8\n"));
  CHECK(contains(error(), "imu0/data.csv:2: timestamp: '1.5' is not a whole number of nanoseconds"));
  write_text(csv, imu_rows("9223372036854775807,0,0,0,0,0,9.8\n"));
  CHECK(contains(error(), "imu0/data.csv:2: timestamp: '9223372036854775807' is not within 142 years of the clock's"));
  write_text(csv, imu_rows("1,0,0,0,0,up,9.8\n"));
  CHECK(contains(error(), "imu0/data.csv:2: a_y: 'up' is not a number"));
  write_text(csv, imu_rows("1,0,0,0,0,0\n"));
  CHECK(contains(error(), "imu0/data.csv:2: line: 6 fields, not 7"));
}

TEST_CASE("recording: what it survives is left out, counted, and located") {
  const TempFolder folder;
  write_imu(folder / "mav0", 5);
  const fs::path csv = folder / "mav0/imu0/data.csv";
  const std::string good1 = "10,0,0,0,0,0,9.8\n";
  const std::string good2 = "20,0,0,0,0,0,9.8\n";

  SUBCASE("a torn last line") {
    write_text(csv, imu_rows(good1 + good2 + "30,0,0,0"));
    const Contents all = read_all(folder.path());
    CHECK(all.imu.size() == 2);
    CHECK(only_warning(all).kind == "imu0: torn last line");
    CHECK(contains(only_warning(all).first, "imu0/data.csv:4: line: 4 fields, not 7"));
  }
  SUBCASE("values that are not finite") {
    write_text(csv, imu_rows(good1 + "15,0,nan,0,0,0,9.8\n16,0,0,0,0,0,inf\n" + good2));
    const Contents all = read_all(folder.path());
    CHECK(all.imu.size() == 2);
    CHECK(only_warning(all).kind == "imu0: value is not finite");
    CHECK(only_warning(all).count == 2);
    CHECK(contains(only_warning(all).first, "imu0/data.csv:3: w_y"));
  }
  SUBCASE("a malformed line") {
    write_text(csv, imu_rows(good1 + "15,0,x,0,0,0,9.8\n" + good2));
    const Contents all = read_all(folder.path());
    CHECK(all.imu.size() == 2);
    CHECK(only_warning(all).kind == "imu0: malformed line");
    CHECK(contains(only_warning(all).first, ":3: w_y: 'x' is not a number"));
  }
  SUBCASE("two lines run into one") {
    write_text(csv, imu_rows(good1 + "15,0,0,0,0,0,9.816,0,0,0,0,0,9.8\n" + good2));
    CHECK(only_warning(read_all(folder.path())).kind == "imu0: malformed line");
  }
  SUBCASE("a duplicate stamp") {
    write_text(csv, imu_rows(good1 + good1 + good2));
    const Contents all = read_all(folder.path());
    CHECK(all.imu.size() == 2);
    CHECK(only_warning(all).kind == "imu0: duplicate stamp");
    CHECK(contains(only_warning(all).first, "imu0/data.csv:3: timestamp"));
  }
  SUBCASE("a backward stamp") {
    write_text(csv, imu_rows(good1 + good2 + "5,0,0,0,0,0,9.8\n30,0,0,0,0,0,9.8\n"));
    const Contents all = read_all(folder.path());
    CHECK(all.imu.size() == 3);
    CHECK(only_warning(all).kind == "imu0: backward stamp");
    CHECK(contains(only_warning(all).first, "imu0/data.csv:4: timestamp"));
  }
  SUBCASE("stamps that are no times") {
    write_text(csv,
               imu_rows(good1 + "-9223372036854775808,0,0,0,0,0,9.8\n4500000000000000000,0,0,0,0,0,9.8\n" + good2));
    const Contents all = read_all(folder.path());
    CHECK(all.imu.size() == 2);
    CHECK(only_warning(all).kind == "imu0: malformed line");
    CHECK(only_warning(all).count == 2);
  }
  SUBCASE("one stamp far too late costs one sample, not all that follow") {
    write_text(csv, imu_rows(good1 + "99999,0,0,0,0,0,9.8\n" + good2 + "30,0,0,0,0,0,9.8\n"));
    const Contents all = read_all(folder.path());
    CHECK(all.imu.size() == 3);
    CHECK(only_warning(all).count == 1);
    CHECK(contains(only_warning(all).first, "imu0/data.csv:3: timestamp"));
  }
  SUBCASE("CRLF and a complete last line without an end are no problem") {
    write_text(csv, "#t\r\n10,0,0,0,0,0,9.8\r\n20, 0, 0, 0, 0, 0, 9.8");
    const Contents all = read_all(folder.path());
    CHECK(all.imu.size() == 2);
    CHECK(all.warnings.empty());
  }
}

TEST_CASE("recording: encoder counts that are nan are left out; some programs write whole numbers with a point") {
  const TempFolder folder;
  write_full_recording(folder / "mav0");
  write_text(folder / "mav0/encoder0/data.csv", "#t,l,r\n1,10.0,20.0\n2,nan,20\n3,30,40\n");
  const Contents all = read_all(folder.path());
  REQUIRE(all.encoder.size() == 2);
  CHECK(all.encoder[0].left_count == 10);
  CHECK(only_warning(all).kind == "encoder0: value is not finite");
  CHECK(contains(only_warning(all).first, "encoder0/data.csv:3: left"));
}

TEST_CASE("recording: as many laser columns as beams") {
  const TempFolder folder;
  write_full_recording(folder / "mav0");
  write_text(folder / "mav0/laser0/data.csv", "#t\n1,0.1,0.1\n");
  CHECK(contains(input_error_of([&] { read_all(folder.path()); }), "laser0/data.csv:2: line: 3 fields"));
}

TEST_CASE("recording: images that cannot be read are counted; a left one costs its frame, a right one only itself") {
  const TempFolder folder;
  write_full_recording(folder / "mav0");
  fs::remove(folder / "mav0/cam0/data/200000000.png");
  write_text(folder / "mav0/cam1/data/500000000.png", "this is no image");
  const Contents all = read_all(folder.path());
  CHECK(all.frames.size() == 9);
  REQUIRE(all.warnings.size() == 2);
  CHECK(all.warnings[0].kind == "cam0: unreadable image");
  CHECK(contains(all.warnings[0].first, "cam0/data/200000000.png"));
  CHECK(all.warnings[1].kind == "cam1: unreadable image");
  CHECK(all.frames[4].t_ns == 500'000'000);
  CHECK(all.frames[4].right.empty());
}

TEST_CASE("recording: an image that was cut off is unreadable") {
  const TempFolder folder;
  write_full_recording(folder / "mav0");
  for (const char* name : {"cut.png", "cut.jpg"}) {
    CAPTURE(name);
    const fs::path file = folder / (std::string("mav0/cam0/data/") + name);
    write_image(file, 99);
    const std::string bytes = read_text(file);
    write_text(folder / "mav0/cam0/data.csv", std::string("#t,f\n0,000000000.png\n100000000,") + name + "\n");
    write_image(folder / "mav0/cam0/data/000000000.png", 1);
    RecordingOptions mono;
    mono.mono = true;
    CHECK(read_all(folder.path(), mono).frames.size() == 2);
    write_text(file, bytes.substr(0, bytes.size() - 20));
    CHECK(read_all(folder.path(), mono).frames.size() == 1);
  }
}

TEST_CASE("recording: any type of image becomes 8-bit grey") {
  const TempFolder folder;
  write_imu(folder / "mav0", 5);
  write_camera(folder / "mav0", "cam0", 1);
  const auto read_one = [&](const std::string& name, int value, int type) {
    write_image(folder / ("mav0/cam0/data/" + name), value, type);
    write_text(folder / "mav0/cam0/data.csv", "#t,f\n0," + name + "\n");
    return read_all(folder.path());
  };
  for (const char* name : {"a.pgm", "a.jpg", "a.bmp", "a.tif"}) {
    CAPTURE(name);
    const Contents all = read_one(name, 77, CV_8UC1);
    REQUIRE(all.frames.size() == 1);
    CHECK(std::abs(all.frames[0].left.data[0] - 77) <= 1);
    CHECK(all.warnings.empty());
  }
  CHECK(read_one("colour.png", 50, CV_8UC3).frames.at(0).left.data[0] == 50);

  const Contents deep = read_one("deep.png", 77 * 256, CV_16UC1);
  CHECK(deep.frames.at(0).left.data[0] == 77);
  CHECK(only_warning(deep).kind == "cam0: 16-bit image scaled down to 8 bits");
}

TEST_CASE("recording: image size against calibration") {
  const TempFolder folder;
  write_full_recording(folder / "mav0");
  write_image(folder / "mav0/cam0/data/300000000.png", 3, CV_8UC1, {20, 12});
  const Contents all = read_all(folder.path());
  CHECK(all.frames.size() == 9);
  CHECK(only_warning(all).kind == "cam0: image size differs from calibration");

  write_image(folder / "mav0/cam0/data/0.png", 3, CV_8UC1, {20, 12});
  const std::string error = input_error_of([&] { read_all(folder.path()); });
  CHECK(contains(error, "cam0/data/0.png: resolution: 20x12 px, but the calibration says 16x12"));
}

TEST_CASE("recording: left and right belong together by time") {
  const TempFolder folder;
  write_full_recording(folder / "mav0");
  // 0: equal. 100 ms: 2 ms late. 200 ms: missing. 250 ms: right alone. 300 ms: equal.
  write_text(folder / "mav0/cam0/data.csv",
             "#t,f\n0,0.png\n100000000,100000000.png\n200000000,200000000.png\n300000000,300000000.png\n");
  write_text(folder / "mav0/cam1/data.csv",
             "#t,f\n0,0.png\n102000000,100000000.png\n250000000,200000000.png\n300000000,300000000.png\n");
  const Contents all = read_all(folder.path());
  REQUIRE(all.frames.size() == 4);
  CHECK(all.frames[1].t_ns == 100'000'000);
  REQUIRE_FALSE(all.frames[1].right.empty());
  CHECK(all.frames[1].right.data[0] == 1);
  CHECK(all.frames[2].right.empty());
  CHECK(all.frames[3].right.data[0] == 3);
  REQUIRE(all.warnings.size() == 2);
  CHECK(all.warnings[0].kind == "cam0: image without a right one");
  CHECK(all.warnings[1].kind == "cam1: image without a left one");
}

TEST_CASE("recording: a lower camera rate keeps evenly spaced frames, stamps that tremble or not") {
  const TempFolder folder;
  write_imu(folder / "mav0", 101);
  write_camera(folder / "mav0", "cam0", 10);
  const auto kept = [&](double rate_hz) {
    RecordingOptions options;
    options.camera_rate_hz = rate_hz;
    std::vector<int> images;
    for (const RecordedFrame& frame : read_all(folder.path(), options).frames) images.push_back(frame.left.data[0]);
    return images;
  };
  CHECK(kept(0.0).size() == 10);
  CHECK(kept(10.0).size() == 10);
  CHECK(kept(30.0).size() == 10);
  CHECK(kept(5.0) == std::vector<int>{0, 2, 4, 6, 8});
  CHECK(kept(2.5) == std::vector<int>{0, 4, 8});

  std::string csv = "#t,f\n";
  for (int i = 0; i < 10; ++i) {
    const int tremble = i % 3 == 0 ? 0 : (i % 3 == 1 ? 4'000'000 : -4'000'000);
    csv += std::to_string(i * 100'000'000 + tremble) + "," + std::to_string(i * 100'000'000) + ".png\n";
  }
  write_text(folder / "mav0/cam0/data.csv", csv);
  CHECK(kept(10.0).size() == 10);
  CHECK(kept(5.0) == std::vector<int>{0, 2, 4, 6, 8});
}

TEST_CASE("recording: a clock that is hours off is an error that names the sensor and the key") {
  const TempFolder folder;
  write_full_recording(folder / "mav0");
  write_text(folder / "mav0/laser0/sensor.yaml", kLaserYaml + "timeshift_laser_imu: 7200\n");
  CHECK(contains(input_error_of([&] { read_all(folder.path()); }),
                 "laser0: timeshift_laser_imu: 7200 s: not a number of seconds, at most 3600"));
}

TEST_CASE("recording: a calibration that cannot be is an error, an odd one a warning") {
  const TempFolder folder;
  write_full_recording(folder / "mav0");
  write_text(folder / "mav0/cam1/sensor.yaml", camera_yaml("0.3"));  // left of cam0
  CHECK(contains(input_error_of([&] { Recording{folder.path()}; }), "cam1: T_BS: cameras are swapped"));
}

TEST_CASE("recording: an error met on the background thread arrives at the reader") {
  const TempFolder folder;
  write_full_recording(folder / "mav0");
  write_text(folder / "mav0/cam0/data.csv", "#t,f\nzero,a.png\n1.5,a.png\n");
  CHECK(contains(input_error_of([&] { read_all(folder.path()); }), "cam0/data.csv:3: timestamp"));
}
