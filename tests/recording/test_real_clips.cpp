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
};

}  // namespace

TEST_CASE("real clips: every sample is read, none is left out, and nothing speaks against using them") {
  const fs::path data = fs::path(EAR_SOURCE_DIR) / "../shared/data";
  const std::vector<Clip> clips{{"micro_euroc", {29120, 95}},
                                {"euroc_v101_mono", {1391, 90}},
                                {"kitti_a", {2083, 200}},
                                {"comma2k19", {6256, 4974}},
                                {"hop", {8219, 4109, 2055, 616}}};
  for (const Clip& clip : clips) {
    CAPTURE(clip.name);
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
  }
}
