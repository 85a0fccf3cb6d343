// The figures and the errors over time as one HTML page that needs nothing else: no network, no other file.
#pragma once

#include <string>
#include <vector>

#include "tools/evaluation/evaluate.h"
#include "tools/evaluation/moments.h"

namespace ear::evaluation {

/// What the page shows of one estimate: its evaluation, and the estimate for its bounds and labels.
struct ReportEntry {
  Estimate estimate;
  Evaluation evaluation;
};

/// The page. `title` names what was driven, e.g. the recording. `entries` is not empty. `moments`: of the first entry.
[[nodiscard]] std::string to_html(const std::string& title, const Trajectory& truth,
                                  const std::vector<ReportEntry>& entries, const std::vector<Moment>& moments = {});

}  // namespace ear::evaluation
