// In the place of bag_ros.cpp where the library for ROS bags is not installed.
#include "src/bag/bag.h"
#include "src/recording/input_error.h"

namespace ear {
namespace {

InputError absent(const std::filesystem::path& file) {
  return InputError(located(file, 0, "", "this program was built without ROS bags: see docs/bags.md"));
}

}  // namespace

bool bags_are_built() { return false; }

class BagWriter::Impl {};

BagWriter::BagWriter(const std::filesystem::path& file, const BagTopics& /*topics*/,
                     const Calibration& /*calibration*/) {
  throw absent(file);
}
BagWriter::~BagWriter() = default;
BagWriter::BagWriter(BagWriter&&) noexcept = default;
BagWriter& BagWriter::operator=(BagWriter&&) noexcept = default;
void BagWriter::write(const ImuSample& /*sample*/) {}
void BagWriter::write(const EncoderSample& /*sample*/) {}
void BagWriter::write(const LaserSample& /*sample*/) {}
void BagWriter::write(const StereoFrame& /*frame*/, TimeNs /*arrival_ns*/) {}
void BagWriter::write_truth(TimeNs /*t_ns*/, const Eigen::Quaterniond& /*q_WB*/, const Eigen::Vector3d& /*p_WB*/) {}
void BagWriter::close() {}

void unpack_bag(const std::filesystem::path& bag, const BagTopics& /*topics*/, const std::filesystem::path& /*out*/) {
  throw absent(bag);
}

}  // namespace ear
