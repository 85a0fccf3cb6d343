#include "src/view/feed.h"

#include <algorithm>
#include <utility>

#include "frontend/lens.h"
#include "src/jpeg.h"
#include "src/view/moment_text.h"
#include "src/view/workers.h"

namespace ear::view {
namespace {

constexpr std::chrono::milliseconds kEarly{20};  // frames at 10 Hz tremble, and every one of them shall be shown
constexpr int kImageWidth = 480;                 // [px] that the page gets at most: 12 kB an image

}  // namespace

Feed::Feed(const Description& description)
    : description_(description_text(description)), cameras_(description.calibration.cameras) {
  thread_ = std::thread([this] { run(); });
}

Feed::~Feed() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

bool Feed::due() const { return std::chrono::steady_clock::now() + kEarly >= next_; }

void Feed::offer(Moment moment) {
  next_ = std::max(next_ + kInterval, std::chrono::steady_clock::now());
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock || waiting_) {
    ++dropped_;
    return;
  }
  waiting_ = std::move(moment);
  changed_.notify_all();
}

void Feed::finish() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return !waiting_ && !busy_; });
  ended_ = true;
}

void Feed::run() {
  lower_priority();
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return waiting_ || stopping_; });
    if (stopping_) return;
    const Moment moment = *std::exchange(waiting_, std::nullopt);
    busy_ = true;
    lock.unlock();
    keep(moment);
    lock.lock();
    busy_ = false;
    changed_.notify_all();
  }
}

void Feed::keep(const Moment& moment) {
  std::vector<Lens> lenses;
  for (const CameraCalibration& camera : cameras_) lenses.emplace_back(camera);
  const auto lens = [&](std::size_t camera) { return camera < lenses.size() ? &lenses[camera] : nullptr; };
  const auto image = [](const ImageView& view) {
    return view.empty() ? Text{} : std::make_shared<const std::string>(jpeg(view, kImageWidth));
  };
  Entry entry;
  entry.summary = std::make_shared<const std::string>(summary_text(moment));
  entry.features = std::make_shared<const std::string>(features_text(moment, lens(0), lens(1)));
  entry.image = image(moment.left);
  entry.right = image(moment.right);
  std::optional<Path::Point> where;
  if (moment.estimate) where = Path::Point{moment.estimate->state.p_WB, moment.truth};
  history_.add(std::move(entry), where);
}

}  // namespace ear::view
