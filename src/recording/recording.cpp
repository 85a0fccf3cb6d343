#include "src/recording/recording.h"

#include <array>
#include <opencv2/core/mat.hpp>
#include <string>
#include <utility>

#include "src/log/log.h"
#include "src/recording/calibration_files.h"
#include "src/recording/frame_list.h"
#include "src/recording/image_file.h"
#include "src/recording/rows.h"
#include "src/recording/sample_stream.h"

namespace ear {
namespace {

namespace fs = std::filesystem;

ImageView view_of(const cv::Mat& image) {
  if (image.empty()) return {};
  return {image.data, image.cols, image.rows, static_cast<std::ptrdiff_t>(image.step[0])};
}

RecordedFrame make_frame(const FrameFiles& files, std::array<cv::Mat, 2> images) {
  auto pixels = std::make_shared<const std::array<cv::Mat, 2>>(std::move(images));
  RecordedFrame frame;
  frame.t_ns = files.t_ns;
  frame.arrival_ns = files.arrival_ns;
  frame.left = view_of((*pixels)[0]);
  frame.right = view_of((*pixels)[1]);
  frame.pixels = std::move(pixels);
  return frame;
}

std::string size_text(int width, int height) { return std::to_string(width) + "x" + std::to_string(height); }

// Turns the rows of the cameras into frames. Lives on the background thread.
class FrameDecoder {
 public:
  FrameDecoder(const fs::path& mav0, std::vector<CameraCalibration> cameras, const RecordingOptions& options)
      : files_(mav0, cameras.size() == 2, options.camera_rate_hz),
        cameras_(std::move(cameras)),
        any_size_(options.accept_bad_calibration) {}

  // The next frame that has a left image.
  DecodedFrame operator()() {
    DecodedFrame decoded;
    while (const std::optional<FrameFiles> files = files_.next(decoded.warnings)) {
      std::array<cv::Mat, 2> images{read(files->left, 0, decoded.warnings), {}};
      if (!files->right.empty()) images[1] = read(files->right, 1, decoded.warnings);
      if (images[0].empty()) continue;
      decoded.frame = make_frame(*files, std::move(images));
      break;
    }
    return decoded;
  }

 private:
  // An image, empty if it cannot be used. A camera whose first image does not fit its calibration is unusable.
  cv::Mat read(const fs::path& file, std::size_t index, Warnings& warnings) {
    const std::string name = "cam" + std::to_string(index);
    cv::Mat image = read_image(file, name, warnings);
    if (image.empty()) return image;
    const CameraCalibration& camera = cameras_[index];
    const bool first = !std::exchange(seen_[index], true);
    if (image.cols == camera.width && image.rows == camera.height) return image;

    const std::string where = located(
        file, 0, "resolution",
        size_text(image.cols, image.rows) + " px, but the calibration says " + size_text(camera.width, camera.height));
    if (first && !any_size_) throw InputError(where);
    warnings.add(name + ": image size differs from calibration", where);
    return any_size_ ? image : cv::Mat();
  }

  FrameList files_;
  std::vector<CameraCalibration> cameras_;
  bool any_size_;
  std::array<bool, 2> seen_{};
};

void require_usable(const Calibration& calibration, const fs::path& mav0, bool accept_errors, Warnings& warnings) {
  for (const Finding& finding : check_calibration(calibration)) {
    const std::string where = located(mav0, 0, finding.where, finding.message);
    if (finding.severity == Severity::error && !accept_errors) throw InputError(where);
    warnings.add("calibration: " + finding.where, where);
  }
}

TimeSpan span_of(const fs::path& csv) {
  Warnings ignored;  // the reading itself will report them
  const auto first = SampleStream<ImuSample>(csv, "imu0", parse_imu_row).next(ignored);
  if (!first) throw InputError(located(csv, 0, "", "no inertial sample that could be used"));
  return {first->t_ns, last_stamp(csv).value_or(first->t_ns)};
}

}  // namespace

class Recording::Impl {
 public:
  Impl(const fs::path& folder, const RecordingOptions& options)
      : mav0_(find_mav0(folder)),
        calibration_(usable_calibration(options)),
        span_(span_of(mav0_ / "imu0" / "data.csv")),
        imu_(mav0_ / "imu0" / "data.csv", "imu0", parse_imu_row) {
    if (calibration_.encoder) encoder_.emplace(mav0_ / "encoder0" / "data.csv", "encoder0", parse_encoder_row);
    if (calibration_.lasers) {
      laser_.emplace(mav0_ / "laser0" / "data.csv", "laser0",
                     [lasers = *calibration_.lasers](const CsvRow& row) { return parse_laser_row(row, lasers); });
    }
    if (!calibration_.cameras.empty()) {
      auto decoder = std::make_shared<FrameDecoder>(mav0_, calibration_.cameras, options);
      frames_ = std::make_unique<FrameQueue>([decoder] { return (*decoder)(); });
    }
    refill_imu();
    refill_encoder();
    refill_laser();
    refill_frame();
  }

  std::optional<Sample> next() {
    // In the order of precedence at equal times: a later one must be strictly earlier.
    const std::array<std::optional<TimeNs>, 4> times{
        stamp(next_imu_), stamp(next_encoder_), stamp(next_laser_),
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
    Calibration calibration = load_calibration(mav0_, options.calibration_files, warnings_);
    if (options.mono && calibration.cameras.size() > 1) calibration.cameras.resize(1);
    require_usable(calibration, mav0_, options.accept_bad_calibration, warnings_);
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
  static std::optional<TimeNs> stamp(const std::optional<T>& sample) {
    return sample ? std::optional<TimeNs>(sample->t_ns) : std::nullopt;
  }

  template <typename T>
  Sample take(std::optional<T>& sample, void (Impl::*refill)()) {
    Sample taken = std::move(*sample);
    (this->*refill)();
    return taken;
  }

  void refill_imu() { next_imu_ = imu_.next(warnings_); }
  void refill_encoder() {
    if (encoder_) next_encoder_ = encoder_->next(warnings_);
  }
  void refill_laser() {
    if (laser_) next_laser_ = laser_->next(warnings_);
  }
  void refill_frame() {
    if (!frames_) return;
    DecodedFrame decoded = frames_->pop();
    warnings_.add(decoded.warnings);
    next_frame_ = std::move(decoded.frame);
  }

  Warnings warnings_;
  std::size_t logged_ = 0;  // kinds of them
  fs::path mav0_;
  Calibration calibration_;
  TimeSpan span_;
  SampleStream<ImuSample> imu_;
  std::optional<SampleStream<EncoderSample>> encoder_;
  std::optional<SampleStream<LaserSample>> laser_;
  std::unique_ptr<FrameQueue> frames_;
  std::optional<ImuSample> next_imu_;
  std::optional<EncoderSample> next_encoder_;
  std::optional<LaserSample> next_laser_;
  std::optional<RecordedFrame> next_frame_;
};

Recording::Recording(const fs::path& folder, const RecordingOptions& options)
    : impl_(std::make_unique<Impl>(folder, options)) {}
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
