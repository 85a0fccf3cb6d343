// In the place of recorder.cpp where MCAP files are not built in.
#include "src/live/recorder.h"
#include "src/recording/input_error.h"

namespace ear::rosbag2 {
class RecordingWriter {};  // none is ever made
}  // namespace ear::rosbag2

namespace ear::live {

Recorder::Recorder(const std::filesystem::path& file, const Calibration& /*calibration*/,
                   const std::filesystem::path& /*calibration_folder*/) {
  throw InputError(located(file, 0, "",
                           "MCAP files are not built in: install libfastcdr-dev, libzstd-dev, liblz4-dev, "
                           "libsqlite3-dev and zlib1g-dev, and build again"));
}
Recorder::~Recorder() = default;
void Recorder::add(const QueuedOdometry::Ranges& /*ranges*/) {}
void Recorder::add(const StereoFrame& /*frame*/) {}
void Recorder::add(const std::string& /*topic*/, const std::string& /*type*/, TimeNs /*t_ns*/,
                   std::vector<std::uint8_t> /*cdr*/) {}
void Recorder::push(Item /*item*/) {}
void Recorder::close() {}
std::vector<std::string> Recorder::look() { return {}; }

}  // namespace ear::live
