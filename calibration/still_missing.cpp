#include "calibration/still_missing.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "calibration/wanted_motion.h"

namespace ear::calibration {
namespace {

struct Wanted {
  const char* entry;  ///< a part of its name; the first that fits counts
  double relative;    ///< of the value given
  double sigma;       ///< in the entry's unit
};

constexpr std::array kWanted{
    Wanted{"gyroscope", 0.0, 0.5},
    Wanted{"wheel radius, mean", 1.5e-3, 0.0},
    Wanted{"wheel radius, left", 0.0, 0.1},
    Wanted{"wheel separation", 2e-3, 0.0},
    Wanted{"focal length", 1e-3, 0.0},
    Wanted{"principal point", 0.0, 0.3},
    Wanted{"time offset", 0.0, 0.3},
    Wanted{"direction", 0.0, 0.15},
    Wanted{"axle turned", 0.0, 0.05},
    Wanted{"rotation in cam0", 0.0, 0.02},
    Wanted{"position in cam0", 0.0, 0.15},
    Wanted{"rotation", 0.0, 0.05},
    Wanted{"origin", 0.0, 4.0},
    Wanted{"position", 0.0, 2.0},
};

}  // namespace

double wanted_sigma(const Finding& finding) {
  for (const Wanted& wanted : kWanted) {
    if (finding.name.find(wanted.entry) == std::string::npos) continue;
    return wanted.relative * std::abs(finding.given) + wanted.sigma;
  }
  return 0.0;
}

std::vector<MissingMotion> still_missing(const std::vector<Finding>& findings) {
  std::vector<MissingMotion> missing;
  for (const Finding& finding : findings) {
    const double wanted = wanted_sigma(finding);
    // What was given well enough needs no motion, shown or not.
    if (wanted > 0.0 ? finding.posterior <= wanted : finding.shown) continue;
    const std::string motion = motion_that_shows(finding.name);
    const auto same = [&](const MissingMotion& other) { return other.motion == motion; };
    auto found = std::find_if(missing.begin(), missing.end(), same);
    if (found == missing.end()) found = missing.insert(missing.end(), {motion, {}});
    found->entries.push_back(finding.name);
  }
  std::stable_sort(missing.begin(), missing.end(),
                   [](const MissingMotion& a, const MissingMotion& b) { return a.entries.size() > b.entries.size(); });
  return missing;
}

std::string missing_text(const std::vector<Finding>& findings) {
  const std::vector<MissingMotion> missing = still_missing(findings);
  std::size_t open = 0;
  for (const MissingMotion& motion : missing) open += motion.entries.size();
  std::string text = std::to_string(findings.size() - open) + " of " + std::to_string(findings.size()) +
                     " numbers are known well enough";
  for (const MissingMotion& motion : missing) {
    text += "\n  " + motion.motion + ":";
    for (const std::string& entry : motion.entries) text += (&entry == &motion.entries[0] ? " " : ", ") + entry;
  }
  return text;
}

}  // namespace ear::calibration
