// Parts of the report: the paths in perspective, and what the camera saw at the moments that matter.
#pragma once

#include <string>
#include <vector>

#include "tools/evaluation/moments.h"
#include "tools/evaluation/report.h"

namespace ear::evaluation {

/// A canvas that the script below draws on.
[[nodiscard]] std::string space_canvas();

/// One figure for each moment, numbered as in the drawing. `start_ns`: what times are counted from.
[[nodiscard]] std::string filmstrip(const std::vector<Moment>& moments, TimeNs start_ns);

/// What the script draws: "const drawn = ...". Paths are thinned to some thousand points. `classes`: of the entries.
[[nodiscard]] std::string space_data(const Trajectory& truth, const std::vector<ReportEntry>& entries,
                                     const std::vector<std::string>& classes, const std::vector<Moment>& moments);

/// Draws it; compiled in from src/view/page/stage.js and tools/evaluation/page.
[[nodiscard]] const char* perspective_script();

}  // namespace ear::evaluation
