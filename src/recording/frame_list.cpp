#include "src/recording/frame_list.h"

#include <utility>

namespace ear {
namespace {

// Triggered cameras share their stamps exactly; drivers that stamp each image on arrival differ a little.
constexpr TimeNs kSameTime = 3'000'000;

std::filesystem::path csv_of(const std::filesystem::path& mav0, const char* camera) {
  return mav0 / camera / "data.csv";
}

}  // namespace

FrameList::FrameList(const std::filesystem::path& mav0, bool stereo, double camera_rate_hz)
    : mav0_(mav0), left_(csv_of(mav0, "cam0"), "cam0", parse_image_row), rate_(camera_rate_hz) {
  if (stereo) right_ = std::make_unique<SampleStream<ImageRow>>(csv_of(mav0, "cam1"), "cam1", parse_image_row);
  const std::filesystem::path arrivals = mav0 / "cam0" / "arrival.csv";
  if (std::filesystem::exists(arrivals)) {
    arrivals_ = std::make_unique<SampleStream<ArrivalRow>>(arrivals, "cam0 arrival", parse_arrival_row);
  }
}

std::optional<FrameFiles> FrameList::next(Warnings& warnings) {
  while (std::optional<FrameFiles> frame = next_pair(warnings)) {
    if (rate_.due(frame->t_ns)) return frame;
  }
  return std::nullopt;
}

std::optional<FrameFiles> FrameList::next_pair(Warnings& warnings) {
  const std::optional<ImageRow> left = left_.next(warnings);
  if (!left) return std::nullopt;
  FrameFiles frame{left->t_ns, arrival_of(left->t_ns, warnings), mav0_ / "cam0" / "data" / left->filename, {}};
  if (right_) frame.right = matching_right(left->t_ns, warnings);
  return frame;
}

std::filesystem::path FrameList::matching_right(TimeNs t_ns, Warnings& warnings) {
  if (!right_ahead_) right_ahead_ = right_->next(warnings);
  while (right_ahead_ && right_ahead_->t_ns < t_ns - kSameTime) {
    warnings.add("cam1: image without a left one",
                 located(right_->file(), 0, std::to_string(right_ahead_->t_ns), "no image of cam0 at this time"));
    right_ahead_ = right_->next(warnings);
  }
  if (!right_ahead_ || right_ahead_->t_ns > t_ns + kSameTime) {
    warnings.add("cam0: image without a right one",
                 located(left_.file(), 0, std::to_string(t_ns), "no image of cam1 at this time"));
    return {};
  }
  std::filesystem::path file = mav0_ / "cam1" / "data" / right_ahead_->filename;
  right_ahead_.reset();
  return file;
}

TimeNs FrameList::arrival_of(TimeNs t_ns, Warnings& warnings) {
  if (!arrivals_) return t_ns;
  while (!arrival_ahead_ || arrival_ahead_->t_ns < t_ns) {
    arrival_ahead_ = arrivals_->next(warnings);
    if (!arrival_ahead_) {
      arrivals_.reset();
      return t_ns;
    }
  }
  return arrival_ahead_->t_ns == t_ns ? arrival_ahead_->arrival_ns : t_ns;
}

}  // namespace ear
