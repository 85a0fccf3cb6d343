#include "src/rosbag2/bag_source.h"

#include <deque>
#include <functional>
#include <optional>
#include <utility>

#include "src/recording/frame_images.h"
#include "src/recording/input_error.h"
#include "src/recording/sample_order.h"
#include "src/ros2/image_messages.h"
#include "src/ros2/imu_messages.h"
#include "src/ros2/laser_messages.h"
#include "src/ros2/wheel_messages.h"
#include "src/rosbag2/bag.h"
#include "src/rosbag2/bag_calibration.h"

namespace ear::rosbag2 {
namespace {

namespace fs = std::filesystem;

/// The samples of one sensor: messages of its topics, converted as they are asked for.
template <typename Sample>
class SensorStream {
 public:
  using Numbered = typename SampleOrder<Sample>::Numbered;
  /// Appends a message's samples; of no message, at the end, what is left.
  using Convert = std::function<void(const OwnedMessage*, std::vector<Sample>&, Warnings&)>;

  SensorStream(const Bag& bag, std::string name, const std::vector<std::string>& topics, Convert convert)
      : file_(bag.path()),
        name_(std::move(name)),
        pass_(bag.pass(topics)),
        convert_(std::move(convert)),
        order_(file_, name_) {}

  std::optional<Sample> next(Warnings& warnings) {
    return order_.next([this](Warnings& w) { return read(w); }, warnings);
  }

 private:
  std::optional<Numbered> read(Warnings& warnings) {
    while (ready_.empty() && !ended_) fill(warnings);
    if (ready_.empty()) return std::nullopt;
    Sample sample = std::move(ready_.front());
    ready_.pop_front();
    return Numbered{std::move(sample), 0};
  }

  // A sensor whose first message is not what it should be is unusable; later ones are left out.
  void fill(Warnings& warnings) {
    std::vector<Sample> samples;
    try {
      const std::optional<OwnedMessage> message = pass_.next(warnings);
      ended_ = !message;
      convert_(message ? &*message : nullptr, samples, warnings);
    } catch (const InputError& error) {
      if (!any_) throw InputError(located(file_, 0, "", error.what()));
      warnings.add(name_ + ": malformed message", located(file_, 0, "", error.what()));
    }
    for (Sample& sample : samples) {
      any_ = true;
      ready_.push_back(std::move(sample));
    }
  }

  fs::path file_;
  std::string name_;
  BagPass pass_;
  Convert convert_;
  SampleOrder<Sample> order_;
  std::deque<Sample> ready_;
  bool any_ = false;
  bool ended_ = false;
};

/// Frames of one or two cameras. Lives on the background thread.
class FrameStream {
 public:
  FrameStream(const Bag& bag, const ros2::SensorTopics& topics, const std::vector<CameraCalibration>& cameras,
              const RecordingOptions& options)
      : file_(bag.path()),
        topics_(topics),
        pass_(bag.pass(topics_of(topics, cameras.size()))),
        pairing_(cameras.size() == 2),
        sizes_(cameras, options.accept_bad_calibration),
        rate_(options.camera_rate_hz),
        logged_on_arrival_(logged_on_arrival(bag.find(topics.left))) {}

  DecodedFrame next() {
    DecodedFrame decoded;
    while (true) {
      while (ready_.empty() && !ended_) fill(decoded.warnings);
      if (ready_.empty()) return decoded;
      RecordedFrame frame = std::move(ready_.front());
      ready_.pop_front();
      if (!rate_.due(frame.t_ns) || !fits(frame.left, 0, decoded.warnings)) continue;
      if (!fits(frame.right, 1, decoded.warnings)) frame.right = {};
      decoded.frame = std::move(frame);
      return decoded;
    }
  }

 private:
  static std::vector<std::string> topics_of(const ros2::SensorTopics& topics, std::size_t cameras) {
    return cameras == 2 ? std::vector<std::string>{topics.left, topics.right} : std::vector<std::string>{topics.left};
  }

  static bool logged_on_arrival(const BagTopic* topic) {
    if (topic == nullptr) return false;
    const auto log_time = topic->metadata.find("log_time");
    return log_time != topic->metadata.end() && log_time->second == "arrival";
  }

  bool fits(const ImageView& image, std::size_t camera, Warnings& warnings) {
    return !image.empty() && sizes_.accept(camera, image.width, image.height, file_, warnings);
  }

  void fill(Warnings& warnings) {
    std::vector<RecordedFrame> frames;
    try {
      const std::optional<OwnedMessage> message = pass_.next(warnings);
      ended_ = !message;
      if (message) {
        take(*message, frames, warnings);
      } else {
        pairing_.finish(frames, warnings);
      }
    } catch (const InputError& error) {
      if (!any_) throw InputError(located(file_, 0, "", error.what()));
      warnings.add("cameras: malformed message", located(file_, 0, "", error.what()));
    }
    for (RecordedFrame& frame : frames) ready_.push_back(std::move(frame));
  }

  void take(const OwnedMessage& message, std::vector<RecordedFrame>& frames, Warnings& warnings) {
    const std::size_t camera = message.topic == topics_.left ? 0 : 1;
    ros2::GreyImage image = ros2::grey_image(message, "cam" + std::to_string(camera), warnings);
    if (logged_on_arrival_) image.arrival_ns = message.received_ns;
    any_ = true;
    pairing_.take(camera, std::move(image), frames, warnings);
  }

  fs::path file_;
  ros2::SensorTopics topics_;
  BagPass pass_;
  ros2::StereoPairing pairing_;
  ImageSizes sizes_;
  FrameRate rate_;
  bool logged_on_arrival_;  // frames are ordered by the log's time, as RecordingWriter writes it
  std::deque<RecordedFrame> ready_;
  bool any_ = false;
  bool ended_ = false;
};

class BagSource : public SampleSource {
 public:
  BagSource(const fs::path& path, const ros2::SensorTopics& stated, RecordingOptions options,
            std::vector<std::string>& notes)
      : options_(std::move(options)), bag_(path, opening_) {
    std::vector<ros2::Topic> there;
    for (const BagTopic& topic : bag_.topics()) there.push_back({topic.name, topic.type});
    require_stated(stated);
    topics_ = ros2::guess_topics(stated, there, notes);
    if (topics_.imu.empty() && !topics_.imu_apart()) {
      throw InputError(located(path, 0, "", "no topic of an IMU (sensor_msgs/msg/Imu); there are: " + all_topics()));
    }
  }

  fs::path path() const override { return bag_.path(); }

  Calibration calibration(Warnings& warnings) override {
    warnings.add(opening_);
    return bag_calibration(bag_, topics_, options_, warnings);
  }

  void open(const Calibration& calibration) override {
    imu_ = open_imu();
    if (calibration.encoder) {
      wheels_.emplace(bag_, "encoder0", std::vector<std::string>{topics_.wheels},
                      wheels(calibration.encoder->resolution));
    }
    if (calibration.lasers) {
      lasers_.emplace(bag_, "laser0", std::vector<std::string>(topics_.beams.begin(), topics_.beams.end()),
                      lasers(*calibration.lasers));
    }
    if (!calibration.cameras.empty()) frames_.emplace(bag_, topics_, calibration.cameras, options_);
  }

  TimeSpan span() override {
    Warnings ignored;  // the reading itself reports them
    const auto first = open_imu()->next(ignored);
    const std::string& topic = topics_.imu_apart() ? topics_.gyro : topics_.imu;
    if (!first) throw InputError(located(bag_.path(), 0, topic, "no inertial sample that could be used"));
    TimeSpan span{first->t_ns, first->t_ns};
    const auto last = bag_.last(topic);
    try {
      if (last) span.last_ns = ros2::stamp_of(*last, ros2::decode<ros2::Imu>(*last).header);
    } catch (const InputError&) {  // damaged: the length is not known
    }
    return span;
  }

  std::optional<ImuSample> next_imu(Warnings& warnings) override { return imu_->next(warnings); }
  std::optional<EncoderSample> next_encoder(Warnings& warnings) override {
    return wheels_ ? wheels_->next(warnings) : std::nullopt;
  }
  std::optional<LaserSample> next_laser(Warnings& warnings) override {
    return lasers_ ? lasers_->next(warnings) : std::nullopt;
  }
  DecodedFrame next_frame() override { return frames_ ? frames_->next() : DecodedFrame{}; }

 private:
  std::string all_topics() const {
    std::string text;
    for (const BagTopic& topic : bag_.topics())
      text += (text.empty() ? "" : ", ") + topic.name + " (" + topic.type + ")";
    return text.empty() ? "none" : text;
  }

  void require_stated(const ros2::SensorTopics& stated) const {
    std::vector<std::string> names{stated.imu, stated.gyro, stated.accel, stated.left, stated.right, stated.wheels};
    names.insert(names.end(), stated.beams.begin(), stated.beams.end());
    for (const std::string& name : names) {
      if (name.empty() || bag_.find(name) != nullptr) continue;
      throw InputError(located(bag_.path(), 0, name, "no such topic; there are: " + all_topics()));
    }
  }

  std::unique_ptr<SensorStream<ImuSample>> open_imu() const {
    const auto names = topics_.imu_apart() ? std::vector<std::string>{topics_.gyro, topics_.accel}
                                           : std::vector<std::string>{topics_.imu};
    const auto convert = [messages = ros2::ImuMessages(topics_)](
                             const OwnedMessage* message, std::vector<ImuSample>& samples, Warnings& warnings) mutable {
      if (message == nullptr) return;
      std::vector<ImuSample> all;
      messages.take(*message, all, warnings);
      for (const ImuSample& sample : all) {
        if (sample.gyro_B.allFinite() && sample.accel_B.allFinite()) {
          samples.push_back(sample);
        } else {
          warnings.add("imu0: value is not finite", message->topic + ": " + std::to_string(sample.t_ns) + " ns");
        }
      }
    };
    return std::make_unique<SensorStream<ImuSample>>(bag_, "imu0", names, convert);
  }

  SensorStream<EncoderSample>::Convert wheels(std::int64_t resolution) const {
    return [messages = ros2::WheelMessages(topics_, resolution)](
               const OwnedMessage* message, std::vector<EncoderSample>& samples, Warnings& /*warnings*/) mutable {
      if (message != nullptr) samples.push_back(messages.take(*message));
    };
  }

  SensorStream<LaserSample>::Convert lasers(const LaserCalibration& calibration) const {
    return [messages = ros2::LaserMessages(topics_, calibration)](
               const OwnedMessage* message, std::vector<LaserSample>& samples, Warnings& /*warnings*/) mutable {
      if (message != nullptr) {
        messages.take(*message, samples);
      } else {
        messages.finish(samples);
      }
    };
  }

  RecordingOptions options_;
  Warnings opening_;
  Bag bag_;
  ros2::SensorTopics topics_;
  std::unique_ptr<SensorStream<ImuSample>> imu_;
  std::optional<SensorStream<EncoderSample>> wheels_;
  std::optional<SensorStream<LaserSample>> lasers_;
  std::optional<FrameStream> frames_;
};

}  // namespace

std::unique_ptr<SampleSource> open_bag(const fs::path& bag, const ros2::SensorTopics& stated,
                                       const RecordingOptions& options, std::vector<std::string>& notes) {
  return std::make_unique<BagSource>(bag, stated, options, notes);
}

}  // namespace ear::rosbag2
