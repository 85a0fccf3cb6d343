// Estimators as Python holds them, and what Odometry and Filter have in common.
#pragma once

#include "ear/odometry.h"
#include "filter/filter.h"
#include "python/binding/guarded.h"
#include "src/health_text.h"

namespace ear::python {

/// An Odometry, with the calibration that its images are compared with.
struct CalibratedOdometry {
  CalibratedOdometry(const Config& config, const Calibration& given) : odometry(config, given), calibration(given) {}
  Odometry odometry;
  Calibration calibration;
};

using GuardedOdometry = Guarded<CalibratedOdometry>;
using GuardedFilter = Guarded<Filter>;

inline Odometry& estimator_of(CalibratedOdometry& held) { return held.odometry; }
inline Filter& estimator_of(Filter& held) { return held; }

/// The two rows, or the one, that add_imu() takes.
template <typename G>
void add_imu(G& self, py::handle t_ns, py::handle gyro, py::handle accel) {
  if (!py::isinstance<py::array>(t_ns) || t_ns.cast<py::array>().ndim() == 0) {
    const ImuSample sample{integer_from(t_ns, "t_ns"), from_python<Eigen::Vector3d>(gyro, "gyro_B"),
                           from_python<Eigen::Vector3d>(accel, "accel_B")};
    self.quick([&](auto& held) { estimator_of(held).add_imu(sample); });
    return;
  }
  const auto times = t_ns.cast<py::array>();
  if (times.ndim() != 1 || (times.dtype().kind() != 'i' && times.dtype().kind() != 'u')) {
    refuse("t_ns", "an integer number of nanoseconds, or an array of them of the shape (n,)", t_ns);
  }
  const py::array_t<TimeNs, py::array::c_style | py::array::forcecast> stamps(times);
  const auto rates = numbers_from(gyro, stamps.size(), 3, "gyro_B").unchecked<2>();
  const auto forces = numbers_from(accel, stamps.size(), 3, "accel_B").unchecked<2>();
  const TimeNs* const first = stamps.data();
  self.work([&](auto& held) {
    for (py::ssize_t i = 0; i < rates.shape(0); ++i) {
      estimator_of(held).add_imu(
          {first[i], {rates(i, 0), rates(i, 1), rates(i, 2)}, {forces(i, 0), forces(i, 1), forces(i, 2)}});
    }
  });
}

/// What both have; `type` is the class of a GuardedOdometry or a GuardedFilter.
template <typename G>
void bind_common(py::class_<G>& type) {
  using py::arg;
  type.def(
          "add_imu", [](G& self, const ImuSample& s) { self.quick([&](auto& e) { estimator_of(e).add_imu(s); }); },
          arg("sample"))
      .def("add_imu", &add_imu<G>, arg("t_ns"), arg("gyro_B"), arg("accel_B"),
           "One sample, or several: t_ns of the shape (n,), rates [rad/s] and specific forces [m/s^2] of (n, 3).")
      .def(
          "add_encoder",
          [](G& self, const EncoderSample& s) { self.quick([&](auto& e) { estimator_of(e).add_encoder(s); }); },
          arg("sample"))
      .def(
          "add_encoder",
          [](G& self, py::handle t_ns, py::handle left, py::handle right) {
            const EncoderSample sample{integer_from(t_ns, "t_ns"), integer_from(left, "left_count"),
                                       integer_from(right, "right_count")};
            self.quick([&](auto& e) { estimator_of(e).add_encoder(sample); });
          },
          arg("t_ns"), arg("left_count"), arg("right_count"))
      .def(
          "add_laser",
          [](G& self, const LaserSample& s) { self.quick([&](auto& e) { estimator_of(e).add_laser(s); }); },
          arg("sample"))
      .def(
          "add_laser",
          [](G& self, py::handle t_ns, py::handle range) {
            const LaserSample sample{integer_from(t_ns, "t_ns"), from_python<std::vector<double>>(range, "range")};
            self.quick([&](auto& e) { estimator_of(e).add_laser(sample); });
          },
          arg("t_ns"), arg("range"))
      .def(
          "start_at",
          [](G& self, const GivenStart& start) { self.quick([&](auto& e) { estimator_of(e).start_at(start); }); },
          arg("start"))
      .def(
          "predict",
          [](G& self, py::handle t_ns) {
            const TimeNs t = integer_from(t_ns, "t_ns");
            return to_python(self.quick([&](auto& e) { return estimator_of(e).predict(t); }));
          },
          arg("t_ns"), "The newest state carried on by the inertial samples to this time [ns], or None.")
      .def_property_readonly("status",
                             [](G& self) { return self.quick([](auto& e) { return estimator_of(e).status(); }); })
      .def_property_readonly(
          "health", [](G& self) { return self.quick([](auto& e) { return Health(estimator_of(e).health()); }); })
      .def_property_readonly(
          "input_counts", [](G& self) { return self.quick([](auto& e) { return estimator_of(e).input_counts(); }); });
}

}  // namespace ear::python
