#include "tools/bench_figures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numeric>
#include <stdexcept>

namespace ear::tools {
namespace {

template <typename... Values>
std::string line(const char* format, Values... values) {
  std::array<char, 200> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return std::string(text.data()) + "\n";
}

nlohmann::json json_of(const Distribution& d) {
  return {{"mean", d.mean}, {"p50", d.p50}, {"p95", d.p95}, {"p99", d.p99}, {"max", d.max}};
}

Distribution distribution_of_json(const nlohmann::json& json) {
  return {json.at("mean"), json.at("p50"), json.at("p95"), json.at("p99"), json.at("max")};
}

/// Those whose share of the pipeline is shown: parts of it that do not overlap.
bool is_part(const std::string& stage) { return stage != "floor" && stage != "pipeline" && stage != "read"; }

}  // namespace

Distribution distribution_of(std::vector<double> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const double count = static_cast<double>(values.size());
  const auto quantile = [&](double share) {
    const double rank = std::max(1.0, std::ceil(share * count));
    return values[static_cast<std::size_t>(rank) - 1];
  };
  return {std::accumulate(values.begin(), values.end(), 0.0) / count, quantile(0.5), quantile(0.95), quantile(0.99),
          values.back()};
}

const Distribution& BenchFigures::stage(const std::string& name) const {
  for (const auto& [stage, distribution] : stages) {
    if (stage == name) return distribution;
  }
  throw std::invalid_argument("no stage called " + name);
}

nlohmann::json to_json(const BenchFigures& figures) {
  nlohmann::json stages = nlohmann::json::array();
  for (const auto& [name, distribution] : figures.stages) {
    nlohmann::json stage = json_of(distribution);
    stage["name"] = name;
    stages.push_back(stage);
  }
  nlohmann::json json = {{"recording", figures.recording}, {"frames", figures.frames},
                         {"points", figures.points},       {"stages_ms", stages},
                         {"ratio", figures.ratio},         {"peak_memory_mb", figures.peak_memory_mb}};
  if (figures.allocations) json["allocations"] = json_of(*figures.allocations);
  return json;
}

BenchFigures bench_figures_of(const nlohmann::json& json) {
  try {
    BenchFigures figures;
    figures.recording = json.at("recording");
    figures.frames = json.at("frames");
    figures.points = json.at("points");
    for (const nlohmann::json& stage : json.at("stages_ms")) {
      figures.stages.emplace_back(stage.at("name"), distribution_of_json(stage));
    }
    figures.ratio = json.at("ratio");
    figures.peak_memory_mb = json.at("peak_memory_mb");
    if (json.contains("allocations")) figures.allocations = distribution_of_json(json.at("allocations"));
    return figures;
  } catch (const nlohmann::json::exception& error) {
    throw std::runtime_error(std::string("not the output of ear bench --json: ") + error.what());
  }
}

std::string table_of(const BenchFigures& figures) {
  std::string text = line("%zu stereo frames, %d points, one thread", figures.frames, figures.points);
  text += line("%-10s %8s %8s %8s %8s %8s %7s", "ms", "mean", "p50", "p95", "p99", "max", "share");
  const double whole = figures.stage("pipeline").mean;
  for (const auto& [name, d] : figures.stages) {
    text += line("%-10s %8.3f %8.3f %8.3f %8.3f %8.3f", name.c_str(), d.mean, d.p50, d.p95, d.p99, d.max);
    text.pop_back();
    text += is_part(name) && whole > 0.0 ? line(" %5.1f %%", 100.0 * d.mean / whole) : std::string("\n");
  }
  text += line("ratio of the medians, pipeline to floor: %.3f", figures.ratio);
  if (figures.allocations) {
    text += line("allocations per frame: mean %.1f, median %.0f, most %.0f", figures.allocations->mean,
                 figures.allocations->p50, figures.allocations->max);
  } else {
    text += "allocations are not counted in this build\n";
  }
  return text + line("peak memory, with the recording's reader: %.1f MB", figures.peak_memory_mb);
}

std::string comparison_of(const BenchFigures& before, const BenchFigures& after) {
  std::string text;
  if (before.recording != after.recording) {
    text += "different recordings: " + before.recording + " and " + after.recording + "\n";
  }
  const auto row = [](const char* name, double old_mean, double new_mean, double old_p99, double new_p99) {
    const double change = old_mean > 0.0 ? 100.0 * (new_mean / old_mean - 1.0) : 0.0;
    return line("%-12s %9.3f %9.3f %+7.1f %% %9.3f %9.3f", name, old_mean, new_mean, change, old_p99, new_p99);
  };
  text += line("%-12s %9s %9s %9s %9s %9s", "", "mean", "now", "change", "p99", "now");
  for (const auto& [name, now] : after.stages) {
    for (const auto& [old_name, old] : before.stages) {
      if (name == old_name) text += row(name.c_str(), old.mean, now.mean, old.p99, now.p99);
    }
  }
  if (before.allocations && after.allocations) {
    text += row("allocations", before.allocations->mean, after.allocations->mean, before.allocations->p99,
                after.allocations->p99);
  }
  text += row("ratio", before.ratio, after.ratio, before.ratio, after.ratio);
  return text +
         row("memory [MB]", before.peak_memory_mb, after.peak_memory_mb, before.peak_memory_mb, after.peak_memory_mb);
}

}  // namespace ear::tools
