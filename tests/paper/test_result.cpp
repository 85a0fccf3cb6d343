#include <doctest/doctest.h>

#include <filesystem>
#include <fstream>

#include "tools/paper/measure/result.h"

using namespace ear::paper;
namespace fs = std::filesystem;

namespace {

struct Folder {
  fs::path path = fs::temp_directory_path() / "ear_test_result";
  Folder() { fs::create_directories(path); }
  ~Folder() { fs::remove_all(path); }
};

}  // namespace

TEST_CASE("result: a file gives back what was written") {
  const Folder folder;
  Result result;
  result.estimated = true;
  result.coverage = 0.75;
  result.ate = 0.0123456789;
  result.nees_position = 2.5;
  result.worst_frame_ms = 7.5;
  result.moments = {{1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, std::nullopt}, {}};
  result.moments.back().nees = 11.0;
  write_complete(folder.path / "a.json", to_json(result));
  const Result read = read_result(folder.path / "a.json");
  CHECK(read.estimated);
  CHECK(read.coverage == result.coverage);
  CHECK(read.ate == result.ate);
  CHECK(read.nees_position == result.nees_position);
  CHECK_FALSE(read.nees_orientation);
  CHECK(read.worst_frame_ms == result.worst_frame_ms);
  REQUIRE(read.moments.size() == 2);
  CHECK(read.moments[0].error == 9.0);
  CHECK_FALSE(read.moments[0].nees);
  CHECK(read.moments[1].nees == 11.0);
  CHECK(to_json(read) == to_json(result));
}

TEST_CASE("result: writing leaves nothing else behind") {
  const Folder folder;
  write_complete(folder.path / "a.json", "text");
  CHECK(std::distance(fs::directory_iterator(folder.path), fs::directory_iterator()) == 1);
}

TEST_CASE("result: a file that holds none is named") {
  const Folder folder;
  const fs::path file = folder.path / "torn.json";
  std::ofstream(file) << "{\"estimated\": true, \"cov";
  try {
    static_cast<void>(read_result(file));
    FAIL("read");
  } catch (const std::runtime_error& error) {
    CHECK(std::string(error.what()).find(file.string()) == 0);
  }
}

TEST_CASE("result: half the time without an estimate is no following") {
  Result result;
  result.estimated = true;
  result.coverage = 0.49;
  CHECK_FALSE(result.followed());
  result.coverage = 0.51;
  CHECK(result.followed());
}
