#include "tools/simulator/faults.h"

#include <cmath>
#include <cstdio>
#include <stdexcept>

namespace ear::simulator {
namespace {

[[noreturn]] void refuse(const std::string& text, const std::string& reason) {
  throw std::invalid_argument("fault '" + text + "': " + reason);
}

std::string number_text(double value) {
  std::string text(32, '\0');
  text.resize(static_cast<std::size_t>(std::snprintf(text.data(), text.size(), "%.9g", value)));
  return text;
}

std::string list_of(const std::vector<std::string>& words) {
  std::string list;
  for (const std::string& word : words) list += (list.empty() ? "" : ", ") + word;
  return list;
}

double parse_number(const std::string& text, const std::string& word, const std::string& what) {
  std::size_t used = 0;
  double value = 0.0;
  try {
    value = std::stod(word, &used);
  } catch (const std::exception&) {
    used = 0;
  }
  if (word.empty() || used != word.size()) refuse(text, what + " '" + word + "' is not a number");
  return value;
}

// Cuts `text` at the last `mark` and returns what stood behind it, if there is one.
std::optional<std::string> cut(std::string& text, char mark) {
  const std::size_t at = text.rfind(mark);
  if (at == std::string::npos) return std::nullopt;
  std::string behind = text.substr(at + 1);
  text.resize(at);
  return behind;
}

FaultType find_type(const std::string& text, const std::string& name) {
  std::vector<std::string> names;
  for (FaultType& type : fault_types()) {
    if (name == type.name) return std::move(type);
    names.emplace_back(type.name);
  }
  refuse(text, "there is no '" + name + "'; there are " + list_of(names));
}

// A length that is no whole number is none that require_valid() takes.
int parse_length(const std::string& text, const std::string& word) {
  const double length = parse_number(text, word, "length");
  if (!(length >= 1.0 && length <= 1000.0 && length == std::floor(length))) {
    refuse(text, "length '" + word + "' is no number of samples");
  }
  return static_cast<int>(length);
}

// What the parameter of a fault is, if it has one.
std::optional<FaultType::Parameter> parameter_of(const FaultType& type, int length) {
  return length > 0 && type.length ? type.length->parameter : type.parameter;
}

std::size_t find_target(const std::string& text, const FaultType& type, const std::string& name) {
  for (std::size_t i = 0; i < type.targets.size(); ++i) {
    if (type.targets[i] == name) return i;
  }
  refuse(text, type.targets.empty() ? std::string(type.name) + " has no targets"
                                    : "there is no '" + name + "'; there are " + list_of(type.targets));
}

}  // namespace

std::vector<FaultType> fault_types() {
  using Kind = FaultKind;
  using Parameter = FaultType::Parameter;
  const std::vector<std::string> wheels{"both", "left", "right"};
  const std::vector<std::string> beams{"all", "front_left", "front_right", "rear"};
  const std::vector<std::string> cameras{"both", "left", "right"};
  const std::vector<std::string> imu{"both", "gyro", "accel"};
  const std::vector<std::string> streams{"all", "imu", "encoder", "laser", "camera"};
  return {
      {Kind::encoder_frozen, "encoder_frozen", "the counts stay at the last reading before it", wheels},
      {Kind::wheel_slipping, "wheel_slipping", "wheels turn more than they roll", wheels, 0, 5.0,
       Parameter{"of the distance; negative: they drag", -0.3, -1.0, 5.0}},
      {Kind::wheel_idle_spin, "wheel_idle_spin", "rims move over the ground, whatever the vehicle does", wheels, 0, 5.0,
       Parameter{"[m/s]", 0.3, -3.0, 3.0}},
      {Kind::wheel_lifted, "wheel_lifted", "a wheel off the ground coasts until it touches down again", wheels, 1},
      {Kind::laser_stuck, "laser_stuck", "a beam repeats the last range before it", beams, 1},
      {Kind::laser_biased, "laser_biased", "a beam reads too much", beams, 1, 5.0,
       Parameter{"[m], negative: too little", 0.05, -2.0, 2.0}},
      {Kind::laser_no_return, "laser_no_return", "a beam has no return", beams, 1},
      {Kind::people,
       "people",
       "people keep up with the vehicle and cross the view",
       {},
       0,
       5.0,
       Parameter{"[m] before it, less where there is less room", 1.5, 0.6, 10.0}},
      {Kind::camera_covered, "camera_covered", "a lens is covered", cameras},
      {Kind::camera_dark, "camera_dark", "there is too little light", cameras, 0, 5.0,
       Parameter{"of the light is left", 0.05, 0.001, 1.0}},
      {Kind::camera_overexposed, "camera_overexposed", "there is too much light", cameras, 0, 5.0,
       Parameter{"times the light that there should be", 4.0, 1.0, 1000.0}},
      {Kind::camera_frozen, "camera_frozen", "the last image before it comes again and again", cameras},
      {Kind::camera_swapped, "camera_swapped", "left and right images are exchanged", {}},
      {Kind::camera_dropped,
       "camera_dropped",
       "frames do not arrive",
       {},
       0,
       5.0,
       Parameter{"of the frames, the first at once", 1.0, 0.0, 1.0}},
      {Kind::camera_late,
       "camera_late",
       "frames arrive later, rightly stamped",
       {},
       0,
       5.0,
       Parameter{"[s] later than otherwise", 0.2, 0.0, 10.0}},
      {Kind::hard_landing,
       "hard_landing",
       "wheels strike the ground; the IMU is clipped at 4 g and 500 deg/s",
       {},
       0,
       5.0,
       Parameter{"times gravity, the peak of each touchdown meanwhile", 5.0, 4.0, 12.0}},
      {Kind::imu_spikes, "imu_spikes", "five samples per second are off, the first at once", imu, 0, 5.0,
       Parameter{"[m/s^2] of the accelerometer; a tenth of it [rad/s] of the gyroscope", 60.0, 1.0, 1000.0},
       FaultType::Length{"20 a minute, each of so many samples (1 to 5) that are off by the same", 5,
                         Parameter{"[m/s^2] one sigma of the accelerometer, per axis; 0.075 of it [rad/s] of the "
                                   "gyroscope",
                                   40.0, 1.0, 1000.0}}},
      {Kind::imu_saturated, "imu_saturated", "four jolts per second; all is clipped at 4 g and 500 deg/s", imu, 0, 5.0,
       Parameter{"times these limits is the size of a jolt", 2.0, 0.0, 20.0}},
      {Kind::imu_bias_jump, "imu_bias_jump", "the biases are different ones", imu, 0, 5.0,
       Parameter{"[rad/s] of the gyroscope; ten times it [m/s^2] of the accelerometer", 0.02, 0.0, 1.0}},
      {Kind::imu_gap, "imu_gap", "no samples", {}, 0, 0.3},
      {Kind::clock_jump, "clock_jump", "the stamps of a stream jump, and jump back at the end", streams, 4, 5.0,
       Parameter{"[s], negative: into the past", 0.1, -1000.0, 1000.0}},
  };
}

FaultType type_of(FaultKind kind) {
  for (FaultType& type : fault_types()) {
    if (type.kind == kind) return std::move(type);
  }
  throw std::logic_error("a kind of fault is missing from fault_types()");
}

Fault parse_fault(const std::string& text) {
  std::string rest = text;
  const auto parameter = cut(rest, '=');
  const auto duration = cut(rest, '+');
  const auto start = cut(rest, '@');
  const auto length = cut(rest, ':');
  const auto target = cut(rest, '.');
  const FaultType type = find_type(text, rest);
  if (!start) refuse(text, "when? NAME[.TARGET][:LENGTH]@START[+DURATION][=PARAMETER], times in seconds");

  Fault fault;
  fault.kind = type.kind;
  fault.target = target ? find_target(text, type, *target) : type.usual_target;
  fault.start = parse_number(text, *start, "start");
  fault.duration = duration ? parse_number(text, *duration, "duration") : type.usual_duration;
  if (length && !type.length) refuse(text, std::string(type.name) + " has no length");
  if (length) fault.length = parse_length(text, *length);
  const std::optional<FaultType::Parameter> meant = parameter_of(type, fault.length);
  if (parameter && !meant) refuse(text, std::string(type.name) + " has no parameter");
  if (meant) fault.parameter = parameter ? parse_number(text, *parameter, "parameter") : meant->usual;
  try {
    require_valid(fault);
  } catch (const std::invalid_argument& error) {
    refuse(text, error.what());
  }
  return fault;
}

void require_valid(const Fault& fault) {
  const FaultType type = type_of(fault.kind);
  const auto require = [&type](bool valid, const std::string& message) {
    if (!valid) throw std::invalid_argument(std::string(type.name) + ": " + message);
  };
  require(std::isfinite(fault.start) && fault.start >= 0.0, "the start must not be negative");
  require(std::isfinite(fault.duration) && fault.duration > 0.0, "the duration must be positive");
  require(fault.target < type.targets.size() || fault.target == 0, "there is no such target");
  const int longest = type.length ? type.length->highest : 0;
  require(fault.length >= 0 && fault.length <= longest, "the length must be within 1 to " + std::to_string(longest));
  const std::optional<FaultType::Parameter> parameter = parameter_of(type, fault.length);
  if (!parameter) return;
  require(fault.parameter >= parameter->lowest && fault.parameter <= parameter->highest,
          "the parameter must be within " + number_text(parameter->lowest) + " to " + number_text(parameter->highest));
}

std::string to_string(const Fault& fault) {
  const FaultType type = type_of(fault.kind);
  std::string text = type.name;
  if (!type.targets.empty()) text += '.' + type.targets.at(fault.target);
  if (fault.length > 0) text += ':' + std::to_string(fault.length);
  text += '@' + number_text(fault.start) + '+' + number_text(fault.duration);
  if (type.parameter) text += '=' + number_text(fault.parameter);
  return text;
}

std::string fault_help() {
  std::string help =
      "Faults: NAME[.TARGET][:LENGTH]@START[+DURATION][=PARAMETER], times in seconds; START is a stamp less 1600000000 "
      "s.\n"
      "What is left out is as said below; the target is the marked one, the duration 5 s.";
  for (const FaultType& type : fault_types()) {
    help += "\n  " + std::string(type.name);
    for (std::size_t i = 0; i < type.targets.size(); ++i) {
      help += (i == 0 ? "." : "|") + type.targets[i] + (i == type.usual_target ? "*" : "");
    }
    help += ": " + std::string(type.summary);
    if (type.usual_duration != Fault{}.duration) help += "; +" + number_text(type.usual_duration);
    if (type.parameter) help += "; =" + number_text(type.parameter->usual) + ' ' + type.parameter->meaning;
    if (type.length) {
      const FaultType::Parameter& parameter = type.length->parameter;
      help += "\n  " + std::string(type.name) + ":LENGTH: " + type.length->summary;
      help += "; =" + number_text(parameter.usual) + ' ' + parameter.meaning;
    }
  }
  return help;
}

Rng fault_rng(const Fault& fault, std::uint64_t seed) {
  std::vector<std::uint32_t> words{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32U),
                                   static_cast<std::uint32_t>(Stream::faults),
                                   static_cast<std::uint32_t>(std::llround(1e3 * fault.start))};
  for (const char letter : std::string(type_of(fault.kind).name)) words.push_back(static_cast<std::uint32_t>(letter));
  std::seed_seq sequence(words.begin(), words.end());
  return Rng(sequence);
}

}  // namespace ear::simulator
