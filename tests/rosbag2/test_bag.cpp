#include <doctest/doctest.h>
#include <sqlite3.h>

#include <cmath>
#include <memory>

#include "src/recording/folder_writer.h"
#include "src/recording/recording_check.h"
#include "src/ros2/outgoing.h"
#include "src/rosbag2/mcap_writer.h"
#include "src/rosbag2/recording_writer.h"
#include "src/rosbag2/rosbag2.h"
#include "tests/recording/support.h"

using namespace ear;
using namespace ear::test;

namespace {

/// Every sample of a recording, as text.
std::vector<std::string> samples_of(Recording& recording) {
  std::vector<std::string> all;
  const auto add = [&](const char* kind, TimeNs t_ns, const std::vector<double>& values) {
    std::ostringstream text;
    text.precision(17);
    text << kind << " " << t_ns;
    for (const double value : values) text << " " << value;
    all.push_back(text.str());
  };
  while (const auto sample = recording.next()) {
    std::visit(
        Overloaded{[&](const ImuSample& s) {
                     add("imu", s.t_ns,
                         {s.gyro_B.x(), s.gyro_B.y(), s.gyro_B.z(), s.accel_B.x(), s.accel_B.y(), s.accel_B.z()});
                   },
                   [&](const EncoderSample& s) {
                     add("encoder", s.t_ns, {double(s.left_count), double(s.right_count)});
                   },
                   [&](const LaserSample& s) { add("laser", s.t_ns, s.range); },
                   [&](const RecordedFrame& s) {
                     add("frame", s.t_ns,
                         {double(s.arrival_ns), double(s.left.data[5]),
                          s.right.empty() ? -1.0 : double(s.right.data[5])});
                   }},
        *sample);
  }
  return all;
}

Recording opened(const fs::path& bag, const RecordingOptions& options = {}) {
  std::vector<std::string> notes;
  return Recording(open_ros2_bag(bag, {}, options, notes), options);
}

/// Makes RECORDING/mav0 and its bag.
void write_both(const TempFolder& folder) {
  write_full_recording(folder / "recording/mav0");
  write_text(folder / "recording/mav0/cam0/arrival.csv", "#t,arrival\n300000000,350000000\n");
  Recording recording(folder / "recording");
  CHECK(write_mcap(recording, folder / "bag.mcap", folder / "recording/mav0", {}, [](std::size_t) {}) > 200);
}

struct CloseDatabase {
  void operator()(sqlite3* database) const { sqlite3_close(database); }
};

void run_sql(const fs::path& file, const std::string& text) {
  sqlite3* database = nullptr;
  REQUIRE(sqlite3_open(file.c_str(), &database) == SQLITE_OK);
  const std::unique_ptr<sqlite3, CloseDatabase> owned(database);
  REQUIRE(sqlite3_exec(database, text.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK);
}

const std::string kTables =
    "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT);"
    "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);"
    "INSERT INTO topics VALUES (1, '/imu', 'sensor_msgs/msg/Imu', 'cdr');";

std::string insert_imu(TimeNs t_ns) {
  const std::vector<std::uint8_t> bytes = ros2::encode(ros2::imu_message({t_ns, {0.1, 0.2, 0.3}, {0.0, 0.0, 9.8}}));
  std::ostringstream hex;
  hex << std::hex;
  for (const std::uint8_t byte : bytes) hex << (byte < 16 ? "0" : "") << int(byte);
  return "INSERT INTO messages (topic_id, timestamp, data) VALUES (1, " + std::to_string(t_ns) + ", x'" + hex.str() +
         "');";
}

std::vector<std::string> kinds(const std::vector<Warning>& warnings) {
  std::vector<std::string> all;
  for (const Warning& warning : warnings) all.push_back(warning.kind);
  return all;
}

}  // namespace

TEST_CASE("bag: the samples are those of the folder, to the last bit, in the same order") {
  const TempFolder folder;
  write_both(folder);
  Recording of_folder(folder / "recording"), of_bag = opened(folder / "bag.mcap");
  CHECK(of_bag.span().first_ns == of_folder.span().first_ns);
  CHECK(of_bag.span().last_ns == of_folder.span().last_ns);
  CHECK(of_bag.calibration().cameras[1].T_BC.matrix() == of_folder.calibration().cameras[1].T_BC.matrix());
  const std::vector<std::string> expected = samples_of(of_folder);
  CHECK(samples_of(of_bag) == expected);
  CHECK(of_bag.warnings().empty());

  Recording again = opened(folder / "bag.mcap");
  write_folder(again, folder / "unpacked");
  Recording of_unpacked(folder / "unpacked");
  CHECK(samples_of(of_unpacked) == expected);
}

TEST_CASE("bag: one camera, and a lower rate, as of a folder") {
  const TempFolder folder;
  write_both(folder);
  RecordingOptions options;
  options.mono = true;
  options.camera_rate_hz = 4.0;
  Recording of_folder(folder / "recording", options), of_bag = opened(folder / "bag.mcap", options);
  CHECK(samples_of(of_bag) == samples_of(of_folder));
}

TEST_CASE("bag: without a calibration cameras and lasers come from messages, wheels are left out") {
  const TempFolder folder;
  write_full_recording(folder / "recording/mav0");
  Recording recording(folder / "recording");
  CHECK(write_mcap(recording, folder / "bag.mcap", folder / "nothing", {}, [](std::size_t) {}) > 200);
  const Recording of_bag = opened(folder / "bag.mcap");
  CHECK_FALSE(of_bag.calibration().encoder);
  CHECK(of_bag.calibration().imu.rate_hz == 100.0);  // as its stamps are, in place of 200
  REQUIRE(of_bag.calibration().cameras.size() == 2);
  CHECK((of_bag.calibration().cameras[1].T_BC.matrix() - recording.calibration().cameras[1].T_BC.matrix()).norm() <
        1e-12);
  REQUIRE(of_bag.calibration().lasers);
  CHECK(of_bag.calibration().lasers->beams.size() == 3);
  CHECK(kinds(of_bag.warnings()) ==
        std::vector<std::string>{"calibration: imu0", "wheels are left out: no calibration"});

  // What stands beside the bag overrides messages.
  write_text(folder / "bag.calibration/cam0/sensor.yaml", camera_yaml("0.07"));
  write_text(folder / "bag.calibration/cam1/sensor.yaml", camera_yaml("-0.07"));
  write_text(folder / "bag.calibration/encoder0/sensor.yaml", kEncoderYaml);
  const Recording beside = opened(folder / "bag.mcap");
  CHECK(beside.calibration().cameras[0].T_BC.translation().y() == 0.07);
  CHECK(beside.calibration().encoder);
}

TEST_CASE("bag: cameras without any calibration are an error that says what is missing") {
  const TempFolder folder;
  {
    rosbag2::McapWriter writer(folder / "a.mcap");
    const auto imu = writer.add_channel("/imu", ros2::Imu::kType);
    const auto left = writer.add_channel("/left/image", ros2::Image::kType);
    const auto sample = ros2::encode(ros2::imu_message(ImuSample{}));
    const auto image = ros2::encode(ros2::Image{});
    writer.write(imu, 1, 1, {sample.data(), sample.size()});
    writer.write(left, 1, 1, {image.data(), image.size()});
  }
  CHECK(contains(input_error_of([&] { opened(folder / "a.mcap"); }),
                 "no CameraInfo on /left/camera_info; a folder of sensor.yaml files (topics: calibration)"));
  const RecordingReport report =
      check_recording([&](const RecordingOptions& options) { return opened(folder / "a.mcap", options); }, {});
  CHECK_FALSE(report.usable());
}

TEST_CASE("bag: without an IMU there is an error that lists what there is") {
  const TempFolder folder;
  {
    rosbag2::McapWriter writer(folder / "a.mcap");
    const auto text = writer.add_channel("/text", ros2::Text::kType);
    const auto bytes = ros2::encode(ros2::Text{"x"});
    writer.write(text, 1, 1, {bytes.data(), bytes.size()});
  }
  CHECK(contains(input_error_of([&] { opened(folder / "a.mcap"); }),
                 "no topic of an IMU (sensor_msgs/msg/Imu); there are: /text (std_msgs/msg/String)"));
}

TEST_CASE("bag: sqlite3, as one file and as a folder without metadata") {
  const TempFolder folder;
  fs::create_directories(folder / "bag");
  run_sql(folder / "bag/a_0.db3", kTables + insert_imu(1'000'000) + insert_imu(2'000'000));
  run_sql(folder / "bag/a_1.db3", kTables + insert_imu(3'000'000));
  Recording folder_of_two = opened(folder / "bag");
  CHECK(samples_of(folder_of_two).size() == 3);
  CHECK(folder_of_two.span().last_ns == 3'000'000);
  CHECK(kinds(folder_of_two.warnings())[0] == "bag: no metadata.yaml");
  Recording one = opened(folder / "bag/a_0.db3");
  CHECK(samples_of(one).size() == 2);
}

TEST_CASE("bag: sqlite3 files that are torn or none are named") {
  const TempFolder folder;
  std::string rows;
  for (int i = 1; i < 400; ++i) rows += insert_imu(i * 1'000'000);
  run_sql(folder / "a.db3", kTables + rows);
  const std::string whole = read_text(folder / "a.db3");
  write_text(folder / "torn.db3", whole.substr(0, whole.size() / 2));
  std::size_t found = 0;
  std::string said = input_error_of([&] {
    Recording torn = opened(folder / "torn.db3");
    found = samples_of(torn).size();
    said = torn.warnings().empty() ? "" : torn.warnings().back().first;
    for (const Warning& warning : torn.warnings()) {
      if (warning.kind == "bag: torn") throw InputError(warning.first);
    }
  });
  CHECK(contains(said, "torn.db3: sqlite3: "));
  CHECK(found < 399);

  write_text(folder / "text.db3", "no database, but a text");
  CHECK(contains(input_error_of([&] { opened(folder / "text.db3"); }), "text.db3: sqlite3: file is not a database"));
  run_sql(folder / "other.db3", "CREATE TABLE other(id INTEGER);");
  CHECK(contains(input_error_of([&] { opened(folder / "other.db3"); }), "other.db3: sqlite3: no such table: topics"));
}

TEST_CASE("bag: metadata that cannot be used is named") {
  const TempFolder folder;
  const auto error = [&](const std::string& text) {
    write_text(folder / "bag/metadata.yaml", "rosbag2_bagfile_information:\n" + text);
    return input_error_of([&] { opened(folder / "bag"); });
  };
  CHECK(contains(error("  storage_identifier: tape\n"), "'tape' is not known: mcap, sqlite3"));
  CHECK(contains(error("  storage_identifier: mcap\n  relative_file_paths: [a.mcap]\n"), "a.mcap: no such file"));
  CHECK(contains(error("  storage_identifier: mcap\n  relative_file_paths: []\n  compression_format: lz4\n"),
                 "'lz4' is not known: zstd"));
}

TEST_CASE("bag: messages that are wrong later on are left out and counted") {
  const TempFolder folder;
  {
    rosbag2::McapWriter writer(folder / "a.mcap");
    const auto imu = writer.add_channel("/imu", ros2::Imu::kType);
    for (int i = 1; i <= 20; ++i) {
      ImuSample sample;
      sample.t_ns = i * 1'000'000;
      if (i == 7) sample.accel_B.x() = std::nan("");
      if (i == 9) sample.t_ns = 3'000'000;  // runs backward
      auto bytes = ros2::encode(ros2::imu_message(sample));
      if (i == 5) bytes.resize(50);
      writer.write(imu, i * 1'000'000, 0, {bytes.data(), bytes.size()});
    }
  }
  Recording recording = opened(folder / "a.mcap");
  CHECK(samples_of(recording).size() == 17);
  CHECK(kinds(recording.warnings()) == std::vector<std::string>{"calibration: imu0", "imu0: malformed message",
                                                                "imu0: value is not finite", "imu0: backward stamp"});
}

TEST_CASE("bag: other encodings than CDR are named") {
  const TempFolder folder;
  run_sql(folder / "a.db3", kTables + insert_imu(1) + "UPDATE topics SET serialization_format = 'protobuf';");
  CHECK(contains(input_error_of([&] { opened(folder / "a.db3"); }), "/imu: messages are 'protobuf', not cdr"));
}
