#include "src/live/intake.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace ear::live {
namespace {

constexpr double kRepeat = 10.0;  // [s] between words about the same

}  // namespace

Intake::Intake(LiveEstimator& estimator, const Calibration& calibration, const LiveClock& clock, IntakeTaps taps)
    : estimator_(estimator), calibration_(calibration), clock_(clock), taps_(std::move(taps)) {
  const TimeNs begin = clock.now();
  imu_ = std::make_unique<StreamWatch>("imu", calibration.imu.rate_hz, begin);
  if (calibration.encoder) encoder_ = std::make_unique<StreamWatch>("wheels", calibration.encoder->rate_hz, begin);
  if (calibration.lasers) laser_ = std::make_unique<StreamWatch>("beams", calibration.lasers->rate_hz, begin);
  if (calibration.cameras.empty()) return;
  cameras_ = std::make_unique<StreamWatch>("cameras", calibration.cameras.front().rate_hz, begin);
  if (calibration.cameras.size() == 2) {
    swap_ = std::make_unique<SwapWatch>(calibration.cameras[0], calibration.cameras[1]);
  }
}

bool Intake::add(const ImuSample& sample) {
  imu_->note(sample.t_ns, clock_.now());
  std::optional<NavState> state;
  const bool taken = estimator_.add_imu(sample, &state);
  if (taken && taps_.imu) taps_.imu(sample, state);
  return taken;
}

bool Intake::add(const EncoderSample& sample) {
  if (!encoder_) return false;
  encoder_->note(sample.t_ns, clock_.now());
  const bool taken = estimator_.add_encoder(sample);
  if (taken && taps_.encoder) taps_.encoder(sample);
  return taken;
}

bool Intake::add(const QueuedOdometry::Ranges& ranges) {
  if (!laser_) return false;
  laser_->note(ranges.t_ns, clock_.now());
  const bool taken = estimator_.add_laser(ranges);
  if (taken && taps_.laser) taps_.laser(ranges);
  return taken;
}

bool Intake::add(const LaserSample& sample) {
  QueuedOdometry::Ranges ranges;
  ranges.t_ns = sample.t_ns;
  ranges.range.fill(std::numeric_limits<double>::quiet_NaN());
  std::copy_n(sample.range.begin(), std::min(sample.range.size(), ranges.range.size()), ranges.range.begin());
  return add(ranges);
}

bool Intake::add(const StereoFrame& frame) {
  if (!cameras_) return false;
  cameras_->note(frame.t_ns, clock_.now());
  const bool right_fits = frame.right.empty() || calibration_.cameras.size() < 2 || fits(frame.right, 1);
  if (!fits(frame.left, 0) || !right_fits) {
    wrong_width_ = fits(frame.left, 0) ? frame.right.width : frame.left.width;
    wrong_height_ = fits(frame.left, 0) ? frame.right.height : frame.left.height;
    return false;
  }
  if (swap_) swap_->take(frame);
  const bool taken = estimator_.add_stereo(frame);
  if (taken && taps_.stereo) taps_.stereo(frame);
  return taken;
}

bool Intake::fits(const ImageView& view, std::size_t camera) const {
  const CameraCalibration& wanted = calibration_.cameras[camera];
  return view.width == wanted.width && view.height == wanted.height && !view.empty();
}

std::vector<StreamWatch*> Intake::streams() const {
  std::vector<StreamWatch*> all;
  for (StreamWatch* stream : {imu_.get(), encoder_.get(), laser_.get(), cameras_.get()}) {
    if (stream != nullptr) all.push_back(stream);
  }
  return all;
}

std::vector<std::string> Intake::look() {
  const TimeNs now = clock_.now();
  std::vector<std::string> words;
  for (StreamWatch* stream : streams()) {
    for (std::string& text : stream->look(now)) words.push_back(std::move(text));
  }
  if (std::string text = swap_ ? swap_->look() : ""; !text.empty()) words.push_back(std::move(text));
  if (wrong_width_ > 0 && (said_size_ns_ == 0 || seconds_between(said_size_ns_, now) > kRepeat)) {
    const CameraCalibration& wanted = calibration_.cameras.front();
    words.push_back("cameras: images of " + std::to_string(wrong_width_) + "x" + std::to_string(wrong_height_) +
                    " are refused, the calibration says " + std::to_string(wanted.width) + "x" +
                    std::to_string(wanted.height));
    wrong_width_ = 0;
    said_size_ns_ = now;
  }
  return words;
}

std::string Intake::rates() const {
  std::string text;
  for (const StreamWatch* stream : streams()) {
    text += (text.empty() ? "" : ", ") + stream->name() + " ";
    text += stream->silent() ? "silent" : std::to_string(std::lround(stream->rate_hz())) + " Hz";
  }
  return text;
}

bool Intake::complete() const {
  for (const StreamWatch* stream : streams()) {
    if (stream->count() == 0) return false;
  }
  return true;
}

}  // namespace ear::live
