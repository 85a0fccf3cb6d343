#include "tools/evaluation/space_section.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string_view>

#include "tools/evaluation/plot.h"

namespace ear::evaluation {
namespace {

constexpr std::size_t kMostPoints = 1500;  // of one path: more than there are columns of pixels

std::string base64(std::string_view bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve(4 * (bytes.size() / 3 + 1));
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const auto byte = [&](std::size_t k) {
      return i + k < bytes.size() ? static_cast<std::uint32_t>(static_cast<unsigned char>(bytes[i + k])) : 0U;
    };
    const std::uint32_t three = byte(0) << 16U | byte(1) << 8U | byte(2);
    for (std::size_t k = 0; k < 4; ++k) {
      text += i + k <= bytes.size() ? kDigits[three >> (18U - 6U * k) & 63U] : '=';
    }
  }
  return text;
}

std::string point(const Eigen::Vector3d& p, const char* more = "") {
  if (!p.allFinite()) return "null";
  std::array<char, 96> text{};
  std::snprintf(text.data(), text.size(), "[%.3f,%.3f,%.3f%s]", p.x(), p.y(), p.z(), more);
  return text.data();
}

/// Every how many of so many points are drawn.
std::size_t step_of(std::size_t points) { return std::max<std::size_t>(1, (points + kMostPoints - 1) / kMostPoints); }

std::string truth_path(const Trajectory& truth) {
  std::string list;
  const std::size_t step = step_of(truth.size());
  for (std::size_t i = 0; i < truth.size(); i += step) list += point(truth[i].p_WB) + ",";
  return "[" + list + point(truth.back().p_WB) + "]";
}

/// Thinned, but for where it is interrupted.
std::string path(const ReportEntry& entry) {
  const std::vector<Frame>& frames = entry.evaluation.frames;
  const std::vector<std::string>& mode = entry.estimate.mode;
  const bool has_wheels = std::find(mode.begin(), mode.end(), "rolling") != mode.end();
  const std::size_t step = step_of(frames.size());
  std::string list;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const bool joined = i > 0 && frames[i].match.segment == frames[i - 1].match.segment;
    if (i > 0 && !joined) list += "null,";
    if (joined && i % step != 0 && i + 1 < frames.size()) continue;
    const bool flies = has_wheels && mode[frames[i].match.index] == "free";
    list += point(frames[i].aligned.p_WB, flies ? ",1" : "") + (i + 1 < frames.size() ? "," : "");
  }
  return "[" + list + "]";
}

/// Where the estimate was at the moment, in the truth's world.
std::string place(const Moment& moment, const ReportEntry& entry) {
  const std::vector<Frame>& frames = entry.evaluation.frames;
  const auto nearest = std::min_element(frames.begin(), frames.end(), [&](const Frame& a, const Frame& b) {
    const auto off = [&](const Frame& f) { return std::abs(seconds_between(f.match.truth.t_ns, moment.t_ns)); };
    return off(a) < off(b);
  });
  return point(nearest->aligned.p_WB);
}

}  // namespace

std::string space_canvas() {
  return "<canvas id=\"space\" tabindex=\"0\" role=\"img\" aria-label=\"The paths in perspective. Drag or arrow keys "
         "turn "
         "them, plus and minus zoom, Home resets.\"></canvas>\n";
}

std::string filmstrip(const std::vector<Moment>& moments, TimeNs start_ns) {
  std::string strip = "<ol class=\"film\">\n";
  for (const Moment& moment : moments) {
    std::array<char, 40> time{};
    std::snprintf(time.data(), time.size(), "%.1f s", seconds_between(start_ns, moment.t_ns));
    const std::string words = escaped(moment.words);
    strip += "<li>";
    if (!moment.jpeg.empty())
      strip += "<img alt=\"left camera: " + words + "\" src=\"data:image/jpeg;base64," + base64(moment.jpeg) + "\">";
    strip += "<b>" + std::string(time.data()) + "</b> " + words + "</li>\n";
  }
  return strip + "</ol>";
}

std::string space_data(const Trajectory& truth, const std::vector<ReportEntry>& entries,
                       const std::vector<std::string>& classes, const std::vector<Moment>& moments) {
  std::string paths, places;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    paths += (i > 0 ? ",\n" : "") + ("{of:\"" + classes[i] + "\",points:") + path(entries[i]) + "}";
  }
  for (const Moment& moment : moments) places += (places.empty() ? "" : ",") + place(moment, entries.front());
  return "const drawn = {truth:" + truth_path(truth) + ",\nentries:[" + paths + "],\nmoments:[" + places + "]};\n";
}

}  // namespace ear::evaluation
