// The estimates of whole runs on simulated feature tracks, one line a run and one a few seconds: what a change of the
// code must leave as it is. `replays REFERENCE` compares with the committed ones, `replays` prints new ones.
//
// All fifteen sequences at one seed, with all sensors and by cameras and IMU alone, some with faults and some with a
// calibration error (without one the errors are of fixed sizes). A run's digest is of every bit of every estimate: it
// may differ where another compiler rounds otherwise, and is shown only. Positions must agree within kTolerance.
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <iterator>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "filter/filter.h"
#include "tools/experiments/replay_simulation.h"
#include "tools/simulator/faults.h"
#include "tools/simulator/sequence.h"
#include "tools/simulator/simulation.h"

namespace ear {
namespace {

constexpr std::uint64_t kSeed = 77;
constexpr double kStep = 10.0;       // [s] between the positions that are written
constexpr double kTolerance = 1e-6;  // [m]
constexpr double kShortRun = 20.0;   // [s] of the runs with a fault

struct Run {
  std::string sequence;
  std::string fault;
  bool wheels = true;
  std::optional<double> calibration_error = std::nullopt;  ///< simulator::Options::calibration_error

  [[nodiscard]] std::string name() const {
    std::ostringstream text;
    text << sequence << (wheels ? "" : "/stereo_inertial") << (fault.empty() ? "" : "/" + fault);
    if (calibration_error) text << "/calibration_error=" << *calibration_error;
    return text.str();
  }
};

std::vector<Run> all_runs() {
  std::vector<Run> runs;
  for (const std::string& sequence : simulator::sequence_names()) {
    runs.push_back({sequence, "", true});
    runs.push_back({sequence, "", false});
  }
  for (const std::string sequence : {"flat1", "fly1"}) {
    for (const std::string fault :
         {"imu_gap@8+0.5", "imu_spikes@5+10", "imu_saturated@5+10", "clock_jump.imu@8", "clock_jump.camera@8",
          "camera_swapped@8+1", "camera_dropped@8+2", "imu_bias_jump@9", "wheel_lifted.left@8+3", "laser_stuck@6+4",
          "encoder_frozen@7+3"}) {
      runs.push_back({sequence, fault, true});
    }
  }
  for (const std::string sequence : {"flat1", "fly1"}) runs.push_back({sequence, "", true, 1.0});
  for (const std::string sequence : {"flat1", "fly1"}) runs.push_back({sequence, "imu_spikes:3@5+10", true});
  return runs;
}

/// FNV-1a, 64 bits.
class Digest {
 public:
  void add(const void* data, std::size_t size) {
    const auto* const bytes = static_cast<const unsigned char*>(data);
    for (std::size_t i = 0; i < size; ++i) value_ = (value_ ^ bytes[i]) * 1099511628211ULL;
  }
  [[nodiscard]] std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 14695981039346656037ULL;
};

void replay(const Run& run, std::ostream& out) {
  simulator::Options options;
  options.sequence = run.sequence;
  options.seed = kSeed;
  options.calibration_error = run.calibration_error;
  if (!run.fault.empty()) {
    options.faults.push_back(simulator::parse_fault(run.fault));
    options.duration = kShortRun;
  }
  const simulator::Simulation simulation(options);
  FilterConfig config;
  if (!run.wheels) config.odometer.model = OdometerModel::none;
  Filter filter(config, simulation.calibration());
  Digest digest;
  std::size_t count = 0;
  std::ostringstream positions;
  positions.precision(9);
  positions << std::fixed;
  double next = 0.0;
  const TimeNs first_ns = simulation.frame_times().front();
  const auto add = [&](TimeNs stamp_ns, const Estimate& estimate) {
    const NavState& x = estimate.state;
    digest.add(&x.t_ns, sizeof(x.t_ns));
    digest.add(x.q_WB.coeffs().data(), 4 * sizeof(double));
    for (const Eigen::Vector3d* v : {&x.p_WB, &x.v_W, &x.b_g, &x.b_a}) digest.add(v->data(), 3 * sizeof(double));
    digest.add(estimate.covariance.data(), static_cast<std::size_t>(estimate.covariance.size()) * sizeof(double));
    ++count;
    const double t = seconds_between(first_ns, stamp_ns);
    if (t < next) return;
    next += kStep;
    positions << "  " << t << ' ' << x.p_WB.x() << ' ' << x.p_WB.y() << ' ' << x.p_WB.z() << '\n';
  };
  experiments::ReplayOptions replay_options;
  replay_options.wheels = run.wheels;
  experiments::replay(simulation, filter, add, replay_options);
  out << run.name() << ' ' << count << ' ' << std::hex << std::setfill('0') << std::setw(16) << digest.value()
      << std::dec << '\n'
      << positions.str();
}

/// How far two rows of numbers are apart; infinity if they are no such rows, or their times differ.
double difference(const std::string& a, const std::string& b) {
  std::istringstream in_a(a), in_b(b);
  const std::vector<double> x{std::istream_iterator<double>(in_a), {}}, y{std::istream_iterator<double>(in_b), {}};
  if (x.size() != 4 || y.size() != 4 || x[0] != y[0]) return INFINITY;
  double largest = 0.0;
  for (std::size_t i = 1; i < 4; ++i) largest = std::max(largest, std::abs(x[i] - y[i]));
  return largest;
}

struct Comparison {
  int runs = 0;
  int other_bits = 0;  ///< runs whose digest differs
  int faults = 0;      ///< rows that are missing or too far off
  double largest = 0.0;
};

Comparison compare(std::istream& reference, std::istream& now) {
  Comparison result;
  std::string expected, found, run;
  while (true) {
    const bool more = static_cast<bool>(std::getline(reference, expected));
    if (more != static_cast<bool>(std::getline(now, found))) ++result.faults;
    if (!more || !now) return result;
    if (expected.rfind("  ", 0) != 0) {
      run = expected.substr(0, expected.find(' '));
      ++result.runs;
      const auto without_digest = [](const std::string& line) { return line.substr(0, line.rfind(' ')); };
      if (without_digest(expected) != without_digest(found)) {
        ++result.faults;
        std::cout << "expected " << expected << ", found " << found << '\n';
      }
      if (expected != found) {
        ++result.other_bits;
        std::cout << run << ": other bits\n";
      }
    } else if (const double off = difference(expected, found); !(off <= kTolerance)) {
      ++result.faults;
      result.largest = std::max(result.largest, off);
      std::cout << run << ':' << expected << " is now" << found << '\n';
    } else {
      result.largest = std::max(result.largest, off);
    }
  }
}

}  // namespace
}  // namespace ear

int main(int argc, char** argv) {
  std::stringstream now;
  for (const ear::Run& run : ear::all_runs()) ear::replay(run, now);
  if (argc < 2) {
    std::cout << now.str();
    return 0;
  }
  std::ifstream reference(argv[1]);
  if (!reference) {
    std::cout << argv[1] << ": cannot be read\n";
    return 1;
  }
  const ear::Comparison result = ear::compare(reference, now);
  std::cout << result.runs << " runs, " << result.other_bits << " with other bits; positions at most " << result.largest
            << " m off, " << result.faults << " faults\n";
  return result.runs > 0 && result.faults == 0 ? 0 : 1;
}
