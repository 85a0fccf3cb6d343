#include <doctest/doctest.h>

#include <set>
#include <string>

#include "tools/paper/measure/configuration.h"

using namespace ear;
using namespace ear::paper;

TEST_CASE("configurations: each name once, and every row of the ablation exists") {
  std::set<std::string> names;
  for (const Configuration& configuration : configurations()) CHECK(names.insert(configuration.name).second);
  for (const std::string& name : ablation()) CHECK(names.count(name) == 1);
  CHECK_THROWS_WITH_AS(static_cast<void>(find_configuration("nothing")), "no configuration 'nothing'",
                       std::invalid_argument);
}

TEST_CASE("configurations: what changes the estimate changes the text, and a name alone does not") {
  const Configuration& all = find_configuration("default");
  CHECK(settings_text(all) == settings_text(find_configuration("terrain")));
  std::set<std::string> texts;
  for (const std::string name : {"default", "none", "differential", "gyro", "no-lasers", "smoother"}) {
    CAPTURE(name);
    CHECK(texts.insert(settings_text(find_configuration(name))).second);
  }
  Configuration other = all;
  other.config.filter.window += 1;
  CHECK(settings_text(other) != settings_text(all));
  CHECK(settings_text(all).find("odometer.model: terrain\n") != std::string::npos);
}

TEST_CASE("configurations: without lasers the estimator is given none") {
  Calibration calibration;
  calibration.lasers.emplace();
  CHECK(given(find_configuration("default"), calibration).lasers);
  CHECK_FALSE(given(find_configuration("no-lasers"), calibration).lasers);
}
