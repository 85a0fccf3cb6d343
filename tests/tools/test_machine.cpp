#include "tools/machine.h"

#include <doctest/doctest.h>

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace ear::tools {
namespace {

/// A file system with what is needed of it.
class Root {
 public:
  Root() : path_(std::filesystem::temp_directory_path() / ("ear_machine_" + std::to_string(::getpid()))) {}
  ~Root() { std::filesystem::remove_all(path_); }
  Root(const Root&) = delete;
  Root& operator=(const Root&) = delete;
  Root(Root&&) = delete;
  Root& operator=(Root&&) = delete;

  void write(const std::string& file, const std::string& text) const {
    std::filesystem::create_directories((path_ / file).parent_path());
    std::ofstream(path_ / file) << text;
  }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

TEST_CASE("machine: a processor with a name, and a clock that it does not govern") {
  const Root root;
  root.write("proc/cpuinfo",
             "processor\t: 0\nmodel name\t: Some CPU @ 2.50GHz\ncpu MHz\t\t: 2500.004\n"
             "processor\t: 1\nmodel name\t: Another\ncpu MHz\t\t: 100.0\n");
  const Machine machine = this_machine(root.path());
  CHECK(machine.processor == "Some CPU @ 2.50GHz");
  CHECK(machine.clock_mhz == doctest::Approx(2500.004));
  CHECK(machine.governor == "unknown");
  CHECK(machine.cores >= 1);
}

TEST_CASE("machine: a board, which ends its name with a zero, and a governed clock") {
  const Root root;
  root.write("proc/cpuinfo", "processor\t: 0\nBogoMIPS\t: 108.00\n");
  root.write("proc/device-tree/model", std::string("Some Board 5\0", 13));
  root.write("sys/devices/system/cpu/cpu0/cpufreq/scaling_max_freq", "2400000\n");
  root.write("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "ondemand\n");
  const Machine machine = this_machine(root.path());
  CHECK(machine.processor == "Some Board 5");
  CHECK(machine.clock_mhz == doctest::Approx(2400.0));
  CHECK(machine.governor == "ondemand");
}

TEST_CASE("machine: one that tells nothing") {
  const Machine machine = this_machine("/nowhere");
  CHECK(machine.processor == "unknown");
  CHECK(machine.clock_mhz == 0.0);
  CHECK(machine.governor == "unknown");
}

}  // namespace
}  // namespace ear::tools
