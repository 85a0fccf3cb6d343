#include "src/recording/recording.h"

#include <array>
#include <string>
#include <utility>

#include "src/log/log.h"
#include "src/recording/calibration_files.h"
#include "src/recording/folder_source.h"

namespace ear {
namespace {

namespace fs = std::filesystem;

void require_usable(const Calibration& calibration, const fs::path& place, bool accept_errors, Warnings& warnings) {
  for (const Finding& finding : check_calibration(calibration)) {
    const std::string where = located(place, 0, finding.where, finding.message);
    if (finding.severity == Severity::error && !accept_errors) throw InputError(where);
    warnings.add("calibration: " + finding.where, where);
  }
}

}  // namespace

class Recording::Impl {
 public:
  Impl(std::unique_ptr<SampleSource> source, const RecordingOptions& options)
      : source_(std::move(source)), calibration_(usable_calibration(options)), span_(source_->span()) {
    source_->open(calibration_);
    if (!calibration_.cameras.empty()) {
      frames_ = std::make_unique<FrameQueue>([this] { return source_->next_frame(); });
    }
    refill_imu();
    refill_encoder();
    refill_laser();
    refill_frame();
  }

  std::optional<Sample> next() {
    // In the order of precedence at equal times: a later one must be strictly earlier.
    const std::array<std::optional<TimeNs>, 4> times{
        stamp(next_imu_, 0.0), stamp(next_encoder_, encoder_offset_), stamp(next_laser_, laser_offset_),
        next_frame_ ? std::optional(next_frame_->arrival_ns) : std::nullopt};
    std::size_t earliest = 0;
    for (std::size_t i = 1; i < times.size(); ++i) {
      if (times[i] && (!times[earliest] || *times[i] < *times[earliest])) earliest = i;
    }
    if (!times[earliest]) return std::nullopt;
    log_new_warnings();
    switch (earliest) {
      case 0:
        return take(next_imu_, &Impl::refill_imu);
      case 1:
        return take(next_encoder_, &Impl::refill_encoder);
      case 2:
        return take(next_laser_, &Impl::refill_laser);
      default:
        return take(next_frame_, &Impl::refill_frame);
    }
  }

  const Calibration& calibration() const { return calibration_; }
  const std::vector<Warning>& warnings() const { return warnings_.list(); }
  TimeSpan span() const { return span_; }

 private:
  Calibration usable_calibration(const RecordingOptions& options) {
    Calibration calibration = source_->calibration(warnings_);
    if (options.mono && calibration.cameras.size() > 1) calibration.cameras.resize(1);
    require_usable(calibration, source_->path(), options.accept_bad_calibration, warnings_);
    return calibration;
  }

  // The first of each kind, where it happened; how often it was is known at the end.
  void log_new_warnings() {
    for (; logged_ < warnings_.list().size(); ++logged_) {
      const Warning& warning = warnings_.list()[logged_];
      log_info(warning.kind + ", at " + warning.first);
    }
  }

  template <typename T>
  static std::optional<TimeNs> stamp(const std::optional<T>& sample, double offset) {
    return sample ? std::optional<TimeNs>(later_by(offset, sample->t_ns)) : std::nullopt;
  }

  template <typename T>
  Sample take(std::optional<T>& sample, void (Impl::*refill)()) {
    Sample taken = std::move(*sample);
    (this->*refill)();
    return taken;
  }

  void refill_imu() { next_imu_ = source_->next_imu(warnings_); }
  void refill_encoder() { next_encoder_ = source_->next_encoder(warnings_); }
  void refill_laser() { next_laser_ = source_->next_laser(warnings_); }
  void refill_frame() {
    if (!frames_) return;
    DecodedFrame decoded = frames_->pop();
    warnings_.add(decoded.warnings);
    next_frame_ = std::move(decoded.frame);
  }

  Warnings warnings_;
  std::size_t logged_ = 0;  // kinds of them
  std::unique_ptr<SampleSource> source_;
  Calibration calibration_;
  double encoder_offset_ = calibration_.encoder ? calibration_.encoder->time_offset : 0.0;  // [s] to IMU time
  double laser_offset_ = calibration_.lasers ? calibration_.lasers->time_offset : 0.0;      // the same
  TimeSpan span_;
  std::unique_ptr<FrameQueue> frames_;  // after the source, which its thread uses
  std::optional<ImuSample> next_imu_;
  std::optional<EncoderSample> next_encoder_;
  std::optional<LaserSample> next_laser_;
  std::optional<RecordedFrame> next_frame_;
};

Recording::Recording(const fs::path& folder, const RecordingOptions& options)
    : Recording(open_folder(folder, options), options) {}
Recording::Recording(std::unique_ptr<SampleSource> source, const RecordingOptions& options)
    : impl_(std::make_unique<Impl>(std::move(source), options)) {}
Recording::~Recording() = default;
Recording::Recording(Recording&&) noexcept = default;
Recording& Recording::operator=(Recording&&) noexcept = default;

const Calibration& Recording::calibration() const { return impl_->calibration(); }
std::optional<Sample> Recording::next() { return impl_->next(); }
const std::vector<Warning>& Recording::warnings() const { return impl_->warnings(); }
TimeSpan Recording::span() const { return impl_->span(); }

TimeNs time_of(const Sample& sample) {
  return std::visit([](const auto& s) { return s.t_ns; }, sample);
}

fs::path find_mav0(const fs::path& folder) {
  if (!fs::is_directory(folder)) throw InputError(located(folder, 0, "", "no such folder"));
  fs::path mav0 = fs::is_directory(folder / "mav0") ? folder / "mav0" : folder;
  if (!fs::is_directory(mav0 / "imu0")) {
    throw InputError(located(mav0 / "imu0", 0, "", "no such folder: a recording needs an IMU"));
  }
  return mav0;
}

}  // namespace ear
