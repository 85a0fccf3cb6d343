#include "tools/suite_figures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace ear::tools {
namespace {

const std::vector<std::string> kShown = {"floor", "pipeline", "p99", "filter", "samples", "ratio"};

template <typename... Values>
std::string text_of(const char* format, Values... values) {
  std::array<char, 300> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

const Scattered* find(const SuiteCell& cell, const std::string& name) {
  for (const auto& [figure, value] : cell.figures) {
    if (figure == name) return &value;
  }
  return nullptr;
}

const SuiteCell* find_same(const SuiteFigures& figures, const SuiteCell& cell) {
  for (const SuiteCell& other : figures.cells) {
    if (other.recording == cell.recording && other.rate_hz == cell.rate_hz && other.features == cell.features)
      return &other;
  }
  return nullptr;
}

std::string head_of_row(const SuiteCell& cell) {
  return text_of("%-9s %3.0f Hz %4d", cell.recording.c_str(), cell.rate_hz, cell.features);
}

std::string head_of_table() {
  std::string text = text_of("%-9s %6s %4s", "", "", "feat");
  for (const std::string& name : kShown) text += text_of(" %15s", name.c_str());
  return text + "\n";
}

/// [%] of a value, and what of it may be chance.
struct Change {
  double percent = 0.0, chance = 0.0;
};

Change change_of(const Scattered& before, const Scattered& after) {
  if (!(before.value > 0.0) || !(after.value > 0.0)) return {};
  const double ratio = after.value / before.value;
  return {100.0 * (ratio - 1.0),
          100.0 * ratio * std::hypot(before.scatter / before.value, after.scatter / after.value)};
}

nlohmann::json json_of(const SuiteCell& cell) {
  nlohmann::json figures = nlohmann::json::array();
  for (const auto& [name, value] : cell.figures) {
    figures.push_back({{"name", name}, {"value", value.value}, {"scatter", value.scatter}});
  }
  return {{"recording", cell.recording},
          {"rate_hz", cell.rate_hz},
          {"features", cell.features},
          {"frames", cell.frames},
          {"figures", figures}};
}

SuiteCell cell_of(const nlohmann::json& json) {
  SuiteCell cell{json.at("recording"), json.at("rate_hz"), json.at("features"), json.at("frames"), {}};
  for (const nlohmann::json& figure : json.at("figures")) {
    cell.figures.emplace_back(figure.at("name"), Scattered{figure.at("value"), figure.at("scatter")});
  }
  return cell;
}

}  // namespace

Scattered scattered(std::vector<double> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const std::size_t middle = values.size() / 2;
  const double median = values.size() % 2 == 1 ? values[middle] : 0.5 * (values[middle - 1] + values[middle]);
  return {median, 0.5 * (values.back() - values.front())};
}

SuiteCell suite_cell(double rate_hz, const std::vector<BenchFigures>& runs) {
  if (runs.empty()) return {};
  const BenchFigures& first = runs.front();
  SuiteCell cell{first.recording, rate_hz, first.points, first.frames, {}};
  const auto add = [&](const std::string& name, auto figure_of) {
    std::vector<double> values;
    for (const BenchFigures& run : runs) values.push_back(figure_of(run));
    cell.figures.emplace_back(name, scattered(std::move(values)));
  };
  for (const auto& stage : first.stages) {
    const std::string& name = stage.first;
    add(name, [&](const BenchFigures& run) { return run.stage(name).mean; });
  }
  add("p99", [](const BenchFigures& run) { return run.stage("pipeline").p99; });
  add("ratio", [](const BenchFigures& run) { return run.ratio; });
  if (first.allocations) add("allocations", [](const BenchFigures& run) { return run.allocations->mean; });
  return cell;
}

nlohmann::json to_json(const SuiteFigures& figures) {
  nlohmann::json cells = nlohmann::json::array();
  for (const SuiteCell& cell : figures.cells) cells.push_back(json_of(cell));
  const Machine& machine = figures.machine;
  return {{"processor", machine.processor}, {"cores", machine.cores},   {"clock_mhz", machine.clock_mhz},
          {"governor", machine.governor},   {"commit", figures.commit}, {"kernels", figures.kernels},
          {"runs", figures.runs},           {"suite", std::move(cells)}};
}

SuiteFigures suite_figures_of(const nlohmann::json& json) {
  try {
    SuiteFigures figures;
    figures.machine = {json.at("processor"), json.at("cores"), json.at("clock_mhz"), json.at("governor")};
    figures.commit = json.at("commit");
    figures.kernels = json.at("kernels");
    figures.runs = json.at("runs");
    for (const nlohmann::json& cell : json.at("suite")) figures.cells.push_back(cell_of(cell));
    return figures;
  } catch (const nlohmann::json::exception& error) {
    throw std::runtime_error(std::string("not the output of ear bench --suite --json: ") + error.what());
  }
}

std::string table_of(const SuiteFigures& figures) {
  std::string text =
      text_of("%s, %.0f MHz, governor %s; commit %s, kernels %s; %d runs, one thread\n",
              figures.machine.processor.c_str(), figures.machine.clock_mhz, figures.machine.governor.c_str(),
              figures.commit.c_str(), figures.kernels.c_str(), figures.runs);
  text += "[ms per frame] median of the runs' means +- half of their range\n" + head_of_table();
  for (const SuiteCell& cell : figures.cells) {
    text += head_of_row(cell);
    for (const std::string& name : kShown) {
      const Scattered* const figure = find(cell, name);
      text += figure ? text_of(" %7.3f +-%5.3f", figure->value, figure->scatter) : text_of(" %15s", "-");
    }
    text += "\n";
  }
  return text;
}

std::string comparison_of(const SuiteFigures& before, const SuiteFigures& after) {
  std::string text = "changes [%] from " + before.commit + " (kernels " + before.kernels + ") to " + after.commit +
                     " (" + after.kernels + "); * beyond the scatter of the runs\n";
  if (before.machine.processor != after.machine.processor) {
    text += "different processors: " + before.machine.processor + " and " + after.machine.processor + "\n";
  }
  text += head_of_table();
  for (const SuiteCell& cell : after.cells) {
    const SuiteCell* const old = find_same(before, cell);
    if (!old) continue;
    text += head_of_row(cell);
    for (const std::string& name : kShown) {
      const Scattered* const was = find(*old, name);
      const Scattered* const is = find(cell, name);
      if (!was || !is) {
        text += text_of(" %15s", "-");
        continue;
      }
      const Change change = change_of(*was, *is);
      text += text_of(" %+7.1f +-%4.1f%c", change.percent, change.chance,
                      std::abs(change.percent) > change.chance ? '*' : ' ');
    }
    text += "\n";
  }
  return text;
}

std::string line_to_paste(const BenchFigures& figures, const Machine& machine, const std::string& commit,
                          const std::string& kernels) {
  const Distribution& pipeline = figures.stage("pipeline");
  return text_of("| %s | %d | %.0f | %s | %s | %s | %d | %.2f | %.2f | %.2f | %s |", machine.processor.c_str(),
                 machine.cores, machine.clock_mhz, machine.governor.c_str(), kernels.c_str(), figures.recording.c_str(),
                 figures.points, pipeline.mean, pipeline.p99, figures.ratio, commit.c_str());
}

}  // namespace ear::tools
