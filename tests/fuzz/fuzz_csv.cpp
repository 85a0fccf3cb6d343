// The readers of csv files. First byte: which one. All that may happen are samples in strictly growing time, warnings,
// or an InputError.
#include "src/recording/rows.h"
#include "src/recording/sample_stream.h"
#include "tests/fuzz/support.h"

namespace {

template <typename Sample>
void read_all(const std::filesystem::path& file, const typename ear::SampleStream<Sample>::ParseRow& parse) {
  ear::Warnings warnings;
  ear::SampleStream<Sample> stream(file, "fuzz", parse);
  bool any = false;
  ear::TimeNs last_ns = 0;
  while (const std::optional<Sample> sample = stream.next(warnings)) {
    ear::fuzz::require(!any || sample->t_ns > last_ns, "time grows");
    any = true;
    last_ns = sample->t_ns;
  }
}

}  // namespace

// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer's name
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const ear::fuzz::Folder kFolder;
  if (size == 0) return 0;
  const std::filesystem::path file = kFolder.write("data.csv", {reinterpret_cast<const char*>(data) + 1, size - 1});
  try {
    switch (data[0] % 5) {
      case 0:
        read_all<ear::ImuSample>(file, ear::parse_imu_row);
        break;
      case 1:
        read_all<ear::EncoderSample>(file, ear::parse_encoder_row);
        break;
      case 2: {
        ear::LaserCalibration lasers;
        lasers.beams.resize(3);
        read_all<ear::LaserSample>(file, [&](const ear::CsvRow& row) { return ear::parse_laser_row(row, lasers); });
        break;
      }
      case 3:
        read_all<ear::ImageRow>(file, ear::parse_image_row);
        break;
      default:
        read_all<ear::ArrivalRow>(file, ear::parse_arrival_row);
        break;
    }
  } catch (const ear::InputError&) {
  }
  return 0;
}
