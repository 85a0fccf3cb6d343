// Files that may be rosbag2's databases.
#include "tests/fuzz/bag_support.h"

// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer's name
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const ear::fuzz::Folder kFolder;
  ear::fuzz::read_bag(kFolder.write("bag.db3", {reinterpret_cast<const char*>(data), size}));
  return 0;
}
