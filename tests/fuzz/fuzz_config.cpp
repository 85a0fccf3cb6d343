// The reader of settings. All that may happen are settings, which are written and read back as they were, and which the
// filter takes or refuses by name; or an InputError.
#include "filter/filter.h"
#include "src/recording/config_file.h"
#include "src/recording/input_error.h"
#include "tests/fuzz/support.h"

// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer's name
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const ear::fuzz::Folder kFolder;
  const std::filesystem::path file = kFolder.write("config.yaml", {reinterpret_cast<const char*>(data), size});
  try {
    const ear::Config config = ear::load_config(file);
    ear::save_config(config, kFolder.path() / "saved.yaml");
    static_cast<void>(ear::load_config(kFolder.path() / "saved.yaml"));
    ear::Calibration calibration;
    calibration.encoder.emplace();
    const ear::Filter filter(config.filter, calibration);
  } catch (const ear::InputError&) {
  } catch (const std::invalid_argument&) {
  }
  return 0;
}
