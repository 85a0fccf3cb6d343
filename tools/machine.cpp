#include "tools/machine.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <map>
#include <string>
#include <thread>

namespace ear::tools {
namespace {

/// Without what surrounds it: boards end their names with a zero.
std::string trimmed(const std::string& text) {
  const std::string around(" \t\r\n\0", 5);
  const std::size_t first = text.find_first_not_of(around);
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(around) - first + 1);
}

std::string first_line(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::string line;
  std::getline(stream, line);
  return trimmed(line);
}

/// The first value of each key.
std::map<std::string, std::string> read_cpuinfo(const std::filesystem::path& file) {
  std::map<std::string, std::string> values;
  std::ifstream stream(file);
  for (std::string line; std::getline(stream, line);) {
    const std::size_t colon = line.find(':');
    if (colon != std::string::npos) values.emplace(trimmed(line.substr(0, colon)), trimmed(line.substr(colon + 1)));
  }
  return values;
}

double number(const std::string& text) { return std::strtod(text.c_str(), nullptr); }

}  // namespace

Machine this_machine(const std::filesystem::path& root) {
  std::map<std::string, std::string> info = read_cpuinfo(root / "proc/cpuinfo");
  const std::filesystem::path clock = root / "sys/devices/system/cpu/cpu0/cpufreq";
  Machine machine;
  machine.processor = info["model name"];
  if (machine.processor.empty()) machine.processor = first_line(root / "proc/device-tree/model");
  if (machine.processor.empty()) machine.processor = info["Hardware"];
  if (machine.processor.empty()) machine.processor = "unknown";
  machine.cores = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  machine.clock_mhz = 1e-3 * number(first_line(clock / "scaling_max_freq"));
  if (!(machine.clock_mhz > 0.0)) machine.clock_mhz = number(info["cpu MHz"]);
  machine.governor = first_line(clock / "scaling_governor");
  if (machine.governor.empty()) machine.governor = "unknown";
  return machine;
}

}  // namespace ear::tools
