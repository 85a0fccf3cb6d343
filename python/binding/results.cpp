// Estimates to files, and estimates against the truth: the figures of `ear evaluate --json`.
#include <cstdlib>
#include <map>
#include <system_error>

#include "python/binding/bindings.h"
#include "python/binding/convert.h"
#include "src/health_text.h"
#include "src/recording/input_error.h"
#include "src/recording/writers.h"
#include "tools/evaluation/evaluate.h"
#include "tools/evaluation/read.h"
#include "tools/evaluation/summary.h"
#include "tools/experiments/simulation_truth.h"

namespace ear::python {
namespace {

namespace fs = std::filesystem;

void write_states(const fs::path& file, const std::vector<Estimate>& estimates) {
  StatesWriter states(file);
  for (const Estimate& estimate : estimates) states.write(estimate, to_text(estimate.health));
}

void write_tum(const fs::path& file, const std::vector<Estimate>& estimates) {
  TumWriter trajectory(file);
  for (const Estimate& estimate : estimates) trajectory.write(estimate);
}

/// A file that goes with this object.
class TemporaryFile {
 public:
  TemporaryFile() : folder_((fs::temp_directory_path() / "ear-python-XXXXXX").string()) {
    if (mkdtemp(folder_.data()) == nullptr) throw InputError(located(folder_, 0, "", "cannot be created"));
  }
  ~TemporaryFile() {
    std::error_code ignored;  // a temporary folder that stays is no reason to fail
    fs::remove_all(folder_, ignored);
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  TemporaryFile(TemporaryFile&&) = delete;
  TemporaryFile& operator=(TemporaryFile&&) = delete;

  [[nodiscard]] fs::path path() const { return fs::path(folder_) / "states.csv"; }

 private:
  std::string folder_;
};

/// Estimates in memory are judged as those that `ear run` writes, with the digits of a states.csv.
evaluation::Estimate read_estimates(const std::vector<Estimate>& estimates) {
  const TemporaryFile file;
  write_states(file.path(), estimates);
  evaluation::Estimate estimate = evaluation::read_estimate(file.path());
  estimate.name = "estimate";
  return estimate;
}

evaluation::Estimate read_estimates(const fs::path& path) {
  evaluation::Estimate estimate = evaluation::read_estimate(path);
  estimate.name = evaluation::distinct_names({path}).front();
  return estimate;
}

evaluation::AlignmentKind kind_from(const std::string& align) {
  using evaluation::AlignmentKind;
  for (const AlignmentKind kind : {AlignmentKind::se3, AlignmentKind::yaw, AlignmentKind::none}) {
    if (align == evaluation::to_string(kind)) return kind;
  }
  throw py::value_error("align: '" + align + "' is none of se3, yaw, none");
}

struct KnownTruth {
  evaluation::Truth truth;
  std::vector<evaluation::TerrainTruth> terrain;
};

KnownTruth truth_of(const simulator::Simulation& simulation, const evaluation::Estimate& estimate) {
  std::vector<TimeNs> times;
  for (const evaluation::Pose& pose : estimate.poses) times.push_back(pose.t_ns);
  experiments::SimulationTruth known = experiments::truth_of(simulation, times);
  KnownTruth result;
  result.truth.poses = std::move(known.poses);
  result.terrain = std::move(known.terrain);
  return result;
}

KnownTruth truth_of(const fs::path& path, const evaluation::Estimate&) {
  return {evaluation::read_truth_or_positions(path), evaluation::read_terrain(path)};
}

template <typename E, typename T>
std::string figures(const E& given, const T& truth, evaluation::AlignmentKind kind, double truth_error) {
  const py::gil_scoped_release released;
  const evaluation::Estimate estimate = read_estimates(given);
  KnownTruth known = truth_of(truth, estimate);
  known.truth.error = truth_error;
  return evaluation::to_json({evaluation::evaluate(estimate, known.truth, kind, known.terrain)}, "");
}

py::object evaluate(py::handle estimate, py::handle truth, const std::string& align, double truth_error) {
  const evaluation::AlignmentKind kind = kind_from(align);
  if (!(truth_error > 0.0)) throw py::value_error("truth_error: expected a length above 0 [m]");
  const bool simulated = py::isinstance<simulator::Simulation>(truth);
  const bool in_memory = py::isinstance<py::list>(estimate) || py::isinstance<py::tuple>(estimate);
  const auto with_truth = [&](const auto& given) {
    if (simulated) return figures(given, truth.cast<const simulator::Simulation&>(), kind, truth_error);
    return figures(given, path_from(truth, "truth"), kind, truth_error);
  };
  const std::string json = in_memory ? with_truth(from_python<std::vector<Estimate>>(estimate, "estimate"))
                                     : with_truth(path_from(estimate, "estimate"));
  return py::module_::import("json").attr("loads")(json)["estimates"][py::int_(0)];
}

template <void (*write)(const fs::path&, const std::vector<Estimate>&)>
void write_to(py::handle file, py::handle estimates) {
  write(path_from(file, "file"), from_python<std::vector<Estimate>>(estimates, "estimates"));
}

}  // namespace

void bind_results(py::module_& module) {
  using py::arg;
  module.def("write_states", &write_to<&write_states>, arg("file"), arg("estimates"), "The states.csv of `ear run`.");
  module.def("write_tum", &write_to<&write_tum>, arg("file"), arg("estimates"), "The estimate.tum of `ear run`.");
  module.def(
      "evaluate", &evaluate, arg("estimate"), arg("truth"), arg("align") = "yaw",
      arg("truth_error") = evaluation::Truth{}.error,
      "The figures of `ear evaluate --json`. estimate: a path, or a list of Estimate; truth: a path, or a Simulation.");
}

}  // namespace ear::python
