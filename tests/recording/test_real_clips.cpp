// Public recordings that nobody on the team made. They lie beside the sources, not among them: without them, the tests
// are skipped.
#include <doctest/doctest.h>

#include <cmath>

#include "src/recording/recording_check.h"
#include "tests/recording/support.h"
#include "tests/support/skip.h"

using namespace ear;
using namespace ear::test;

namespace {

struct Clip {
  const char* name;
  std::vector<std::size_t> counts;  // samples of each stream, in the order of the report
  bool stands;                      // in some second
};

}  // namespace

TEST_CASE("real clips: every sample is read, none is left out, and nothing speaks against using them") {
  const fs::path data = fs::path(EAR_SOURCE_DIR) / "../shared/data";
  const std::vector<Clip> clips{{"micro_euroc", {29120, 95}, true},     {"euroc_v101_mono", {1391, 90}, false},
                                {"kitti_a", {2083, 200}, false},        {"comma2k19", {6256, 4974}, false},
                                {"hop", {8219, 4109, 2055, 616}, true}, {"euroc_mh01_mono", {3874, 376}, true},
                                {"lawn_wheels", {45309, 45309}, true},  {"ucsd_20", {12187, 4956}, true}};
  for (const Clip& clip : clips) {
    CAPTURE(std::string(clip.name));
    if (!fs::exists(data / clip.name)) {
      skip("no folder " + (data / clip.name).string());
      continue;
    }
    const RecordingReport report = check_recording(data / clip.name, {});
    CHECK(report.usable());
    CHECK(report.warnings.empty());
    std::vector<std::size_t> counts;
    for (const StreamReport& stream : report.streams) counts.push_back(stream.timing.count);
    CHECK(counts == clip.counts);
    CHECK(report.imu.standing_noise.has_value() == clip.stands);
  }
}
