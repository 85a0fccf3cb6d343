#include "src/recording/folder_source.h"

#include <array>
#include <opencv2/core/mat.hpp>
#include <string>
#include <utility>

#include "src/recording/calibration_files.h"
#include "src/recording/frame_images.h"
#include "src/recording/frame_list.h"
#include "src/recording/image_file.h"
#include "src/recording/recording.h"
#include "src/recording/rows.h"
#include "src/recording/sample_stream.h"

namespace ear {
namespace {

namespace fs = std::filesystem;

// Turns the rows of the cameras into frames. Lives on the background thread.
class FrameDecoder {
 public:
  FrameDecoder(const fs::path& mav0, const std::vector<CameraCalibration>& cameras, const RecordingOptions& options)
      : files_(mav0, cameras.size() == 2, options.camera_rate_hz), sizes_(cameras, options.accept_bad_calibration) {}

  // The next frame that has a left image.
  DecodedFrame next() {
    DecodedFrame decoded;
    while (const std::optional<FrameFiles> files = files_.next(decoded.warnings)) {
      std::array<cv::Mat, 2> images{read(files->left, 0, decoded.warnings), {}};
      if (!files->right.empty()) images[1] = read(files->right, 1, decoded.warnings);
      if (images[0].empty()) continue;
      decoded.frame = make_frame(files->t_ns, files->arrival_ns, std::move(images));
      break;
    }
    return decoded;
  }

 private:
  // An image, empty if it cannot be used.
  cv::Mat read(const fs::path& file, std::size_t camera, Warnings& warnings) {
    cv::Mat image = read_image(file, "cam" + std::to_string(camera), warnings);
    if (image.empty() || sizes_.accept(camera, image.cols, image.rows, file, warnings)) return image;
    return {};
  }

  FrameList files_;
  ImageSizes sizes_;
};

class FolderSource : public SampleSource {
 public:
  FolderSource(const fs::path& folder, RecordingOptions options)
      : mav0_(find_mav0(folder)), options_(std::move(options)) {}

  fs::path path() const override { return mav0_; }

  Calibration calibration(Warnings& warnings) override {
    return load_calibration(mav0_, options_.calibration_files, warnings);
  }

  void open(const Calibration& calibration) override {
    imu_.emplace(csv("imu0"), "imu0", parse_imu_row);
    if (calibration.encoder) encoder_.emplace(csv("encoder0"), "encoder0", parse_encoder_row);
    if (calibration.lasers) {
      laser_.emplace(csv("laser0"), "laser0",
                     [lasers = *calibration.lasers](const CsvRow& row) { return parse_laser_row(row, lasers); });
    }
    if (!calibration.cameras.empty()) frames_.emplace(mav0_, calibration.cameras, options_);
  }

  TimeSpan span() override {
    Warnings ignored;  // the reading itself will report them
    const auto first = SampleStream<ImuSample>(csv("imu0"), "imu0", parse_imu_row).next(ignored);
    if (!first) throw InputError(located(csv("imu0"), 0, "", "no inertial sample that could be used"));
    return {first->t_ns, last_stamp(csv("imu0")).value_or(first->t_ns)};
  }

  std::optional<ImuSample> next_imu(Warnings& warnings) override { return imu_->next(warnings); }
  std::optional<EncoderSample> next_encoder(Warnings& warnings) override {
    return encoder_ ? encoder_->next(warnings) : std::nullopt;
  }
  std::optional<LaserSample> next_laser(Warnings& warnings) override {
    return laser_ ? laser_->next(warnings) : std::nullopt;
  }
  DecodedFrame next_frame() override { return frames_ ? frames_->next() : DecodedFrame{}; }

 private:
  fs::path csv(const char* sensor) const { return mav0_ / sensor / "data.csv"; }

  fs::path mav0_;
  RecordingOptions options_;
  std::optional<SampleStream<ImuSample>> imu_;
  std::optional<SampleStream<EncoderSample>> encoder_;
  std::optional<SampleStream<LaserSample>> laser_;
  std::optional<FrameDecoder> frames_;
};

}  // namespace

std::unique_ptr<SampleSource> open_folder(const fs::path& folder, const RecordingOptions& options) {
  return std::make_unique<FolderSource>(folder, options);
}

}  // namespace ear
