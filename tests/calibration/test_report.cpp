#include "tools/calibration/report.h"

#include "tests/smoother/support.h"

using namespace ear;
using namespace ear::calibration;

namespace {

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
  return found;
}

Result some_result() {
  Result result;
  result.calibration.cameras.resize(1);
  result.calibration.cameras[0].width = 640;
  result.calibration.cameras[0].height = 480;
  result.calibration.lasers = LaserCalibration{};
  result.calibration.lasers->beams.push_back({"front <left>", {}, {}});
  result.findings.push_back({"wheel separation", "mm", 400.0, 0.0, 5.0, 5.0, false, "", 0.0, "turn on the spot"});
  for (int i = 0; i < 100; ++i) {
    const double t = 0.1 * i;
    result.before.push_back({Term::pixel, 0, 0, t, {3.0, 0.0}, {100.0, 100.0}});
    result.after.push_back({Term::pixel, 0, 0, t, {0.3, 0.0}, {100.0, 100.0}});
    result.after.push_back({Term::beam, 0, 0, t, {1.0, 0.0}, {0.1 * i, 0.0}});
  }
  return result;
}

}  // namespace

TEST_CASE("calibration report: a refusal in words, a panel for each sensor, the image, and where beams hit") {
  const std::string page = to_html("drive & home", some_result());
  CHECK(page.find("drive &amp; home") != std::string::npos);
  CHECK(page.find("turn on the spot") != std::string::npos);
  CHECK(page.find("kept") != std::string::npos);
  CHECK(page.find("front &lt;left&gt;") != std::string::npos);
  CHECK(page.find("front <left>") == std::string::npos);
  // Left camera and beam over time, the image, the hits; no wheels and no right camera, for they have no residuals.
  CHECK(count(page, "<svg") == 4);
  CHECK(page.find("data-name=\"before\"") != std::string::npos);
  CHECK(page.find("data-name=\"after\"") != std::string::npos);
  CHECK(page.find("nan") == std::string::npos);
}
