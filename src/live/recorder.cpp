#include "src/live/recorder.h"

#include <algorithm>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <utility>

#include "src/ros2/topics.h"
#include "src/rosbag2/recording_writer.h"

namespace ear::live {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostBytes = std::size_t{16} << 20U;  // that wait for the disk

/// Without gaps between rows.
ImageView copy(const ImageView& from, cv::Mat& to) {
  if (from.empty()) return {};
  to.create(from.height, from.width, CV_8UC1);
  for (int row = 0; row < from.height; ++row) {
    std::copy_n(from.data + row * from.stride, from.width, to.ptr(row));
  }
  return {to.data, from.width, from.height, from.width};
}

}  // namespace

Recorder::Recorder(const fs::path& file, const Calibration& calibration, const fs::path& calibration_folder)
    : beams_(calibration.lasers ? calibration.lasers->beams.size() : 0) {
  if (fs::exists(file)) throw InputError(located(file, 0, "", "is there already"));
  writer_ = std::make_unique<rosbag2::RecordingWriter>(file, ros2::default_topics(), calibration, calibration_folder);
  thread_ = std::thread([this] { run(); });
}

Recorder::~Recorder() { close(); }

void Recorder::close() {
  {
    const std::lock_guard lock(mutex_);
    end_ = true;
  }
  changed_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void Recorder::add(const QueuedOdometry::Ranges& ranges) {
  const auto end = ranges.range.begin() + static_cast<std::ptrdiff_t>(std::min(beams_, ranges.range.size()));
  push({LaserSample{ranges.t_ns, {ranges.range.begin(), end}}, sizeof(ranges)});
}

void Recorder::add(const StereoFrame& frame) {
  auto pixels = std::make_shared<std::array<cv::Mat, 2>>();
  RecordedFrame copied;
  copied.t_ns = copied.arrival_ns = frame.t_ns;
  copied.left = copy(frame.left, (*pixels)[0]);
  copied.right = copy(frame.right, (*pixels)[1]);
  copied.pixels = pixels;
  const std::size_t bytes = (*pixels)[0].total() + (*pixels)[1].total();
  push({std::move(copied), bytes});
}

void Recorder::add(const std::string& topic, const std::string& type, TimeNs t_ns, std::vector<std::uint8_t> cdr) {
  const std::size_t bytes = cdr.size();
  push({Message{topic, type, t_ns, std::move(cdr)}, bytes});
}

void Recorder::push(Item item) {
  {
    const std::lock_guard lock(mutex_);
    if (bytes_ + item.bytes > kMostBytes || end_ || !failure_.empty()) {
      ++left_out_;
      return;
    }
    bytes_ += item.bytes;
    items_.push_back(std::move(item));
  }
  changed_.notify_one();
}

void Recorder::run() {
  try {
    while (true) {
      std::deque<Item> items;
      {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [this] { return !items_.empty() || end_; });
        if (items_.empty()) break;
        items.swap(items_);
      }
      for (const Item& item : items) {
        std::visit(Overloaded{[&](const Message& m) { writer_->write_message(m.topic, m.type, m.t_ns, m.cdr); },
                              [&](const auto& sample) { writer_->write(sample); }},
                   item.what);
        const std::lock_guard lock(mutex_);
        bytes_ -= item.bytes;
      }
    }
    writer_->close();
  } catch (const std::exception& error) {  // the estimate goes on
    const std::lock_guard lock(mutex_);
    failure_ = error.what();
  }
}

std::vector<std::string> Recorder::look() {
  std::vector<std::string> words;
  const std::lock_guard lock(mutex_);
  if (!failure_.empty() && !std::exchange(said_failure_, true)) words.push_back(failure_ + ": no more is recorded");
  if (failure_.empty() && left_out_ > 0 && !std::exchange(said_left_out_, true)) {
    words.emplace_back("--record: the disk is too slow: messages are left out");
  }
  return words;
}

}  // namespace ear::live
