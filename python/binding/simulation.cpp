// Simulated drives: samples and feature tracks in memory, or a recording on disk.
#include "tools/simulator/simulation.h"

#include <pybind11/stl.h>

#include <thread>

#include "python/binding/bindings.h"
#include "python/binding/estimators.h"
#include "python/binding/value.h"
#include "tools/experiments/replay_simulation.h"
#include "tools/simulator/picture_files.h"
#include "tools/simulator/recording_writer.h"
#include "tools/simulator/sequence.h"

namespace ear::python {
namespace {

using simulator::Simulation;

std::shared_ptr<Simulation> simulate(const std::string& sequence, py::handle seed, py::handle duration,
                                     double camera_rate_hz, py::handle calibration_error,
                                     const std::vector<std::string>& faults, bool tracks) {
  simulator::Options options;
  options.sequence = sequence;
  options.seed = from_python<std::uint64_t>(seed, "seed");
  options.duration = from_python<std::optional<double>>(duration, "duration");
  options.camera_rate_hz = camera_rate_hz;
  options.calibration_error = from_python<std::optional<double>>(calibration_error, "calibration_error");
  options.tracks = tracks;
  const py::gil_scoped_release released;
  for (const std::string& fault : faults) options.faults.push_back(simulator::parse_fault(fault));
  return std::make_shared<Simulation>(options);
}

/// Its samples in the order in which they arrive; frames are those of features.
class Deliveries {
 public:
  explicit Deliveries(std::shared_ptr<const Simulation> simulation) : simulation_(std::move(simulation)) {}

  [[nodiscard]] py::object next() {
    const auto& deliveries = simulation_->deliveries();
    while (next_ < deliveries.size()) {
      const simulator::Delivery& delivery = deliveries[next_++];
      switch (delivery.stream) {
        case simulator::SensorStream::imu:
          return py::cast(simulation_->imu()[delivery.index]);
        case simulator::SensorStream::encoder:
          return py::cast(simulation_->encoders()[delivery.index]);
        case simulator::SensorStream::laser:
          return py::cast(simulation_->lasers()[delivery.index]);
        case simulator::SensorStream::camera:
          if (simulation_->options().tracks) return py::cast(simulation_->tracks(delivery.index));
      }
    }
    throw py::stop_iteration();
  }

 private:
  std::shared_ptr<const Simulation> simulation_;
  std::size_t next_ = 0;
};

py::dict truth(const Simulation& simulation) {
  const std::vector<TimeNs>& times = simulation.truth_times();
  const auto n = static_cast<py::ssize_t>(times.size());
  py::array_t<TimeNs> t_ns(n);
  py::array_t<double> p({n, py::ssize_t{3}}), q({n, py::ssize_t{4}}), v({n, py::ssize_t{3}});
  for (py::ssize_t i = 0; i < n; ++i) {
    const simulator::Truth at = simulation.truth(times[static_cast<std::size_t>(i)]);
    const Eigen::Quaterniond q_WB(at.R_WB);
    t_ns.mutable_at(i) = at.t_ns;
    for (int axis = 0; axis < 3; ++axis) {
      p.mutable_at(i, axis) = at.p_WB(axis);
      v.mutable_at(i, axis) = at.v_W(axis);
    }
    q.mutable_at(i, 0) = q_WB.w();
    for (int axis = 0; axis < 3; ++axis) q.mutable_at(i, axis + 1) = q_WB.vec()(axis);
  }
  py::dict result;
  result["t_ns"] = t_ns;
  result["p_WB"] = p;
  result["q_WB"] = q;
  result["v_W"] = v;
  return result;
}

void write(const Simulation& simulation, py::handle folder, bool images, int threads) {
  const std::filesystem::path where = path_from(folder, "folder");
  if (threads < 1) throw py::value_error("threads: expected at least 1, got " + std::to_string(threads));
  const py::gil_scoped_release released;
  simulator::write_recording(simulation, where, images ? simulator::WithCameras::yes : simulator::WithCameras::no);
  if (images) {
    simulator::render_images(simulation, simulator::all_pictures(simulation), where, threads,
                             [](std::size_t, std::size_t) {});
  }
}

py::list replay(const Simulation& simulation, GuardedFilter& filter) {
  std::vector<Estimate> estimates;
  filter.work([&](Filter& f) {
    experiments::ReplayOptions options;
    options.wheels = simulation.calibration().encoder.has_value();
    experiments::replay(
        simulation, f, [&](TimeNs, const Estimate& e) { estimates.push_back(e); }, options);
  });
  py::list list;
  for (const Estimate& estimate : estimates) list.append(estimate);
  return list;
}

}  // namespace

void bind_simulation(py::module_& module) {
  using py::arg;
  py::class_<Deliveries>(module, "SimulatedSamples", "The samples of a simulation in the order in which they arrive.")
      .def("__iter__", [](py::object self) { return self; })
      .def("__next__", &Deliveries::next);
  py::class_<Simulation, std::shared_ptr<Simulation>>(module, "Simulation",
                                                      "One simulated drive or flight; iterating gives its samples.")
      .def(py::init(&simulate), arg("sequence") = "flat1", arg("seed") = 1, arg("duration") = py::none(),
           arg("camera_rate_hz") = 30.0, arg("calibration_error") = py::none(),
           arg("faults") = std::vector<std::string>{}, arg("tracks") = true)
      .def("__iter__", [](std::shared_ptr<Simulation> self) { return Deliveries(std::move(self)); })
      .def_property_readonly("calibration", &Simulation::calibration, py::return_value_policy::copy)
      .def_property_readonly("true_calibration", &Simulation::true_calibration, py::return_value_policy::copy)
      .def_property_readonly("path_length", &Simulation::path_length)
      .def_property_readonly("truth", &truth, "t_ns (n,), p_WB (n, 3), q_WB (n, 4) and v_W (n, 3) as arrays.")
      .def("write", &write, arg("folder"), arg("images") = true,
           arg("threads") = static_cast<int>(std::max(1U, std::thread::hardware_concurrency())),
           "Writes it as a recording, with rendered images, or without cameras where they are not wanted.")
      .def("__repr__", [](const Simulation& self) {
        return "<Simulation " + self.options().sequence + " seed " + std::to_string(self.options().seed) + ">";
      });
  module.def("sequences", &simulator::all_sequence_names, "The names of all simulated sequences.");
  module.def("replay", &replay, arg("simulation"), arg("filter"), "Feeds all samples and tracks; all estimates.");
}

}  // namespace ear::python
