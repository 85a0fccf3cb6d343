// The filter, fed by bytes: each first says what is done. Regular samples of a vehicle that stands let it start; what
// comes between them may be anything.
#include "filter/filter.h"
#include "tests/fuzz/support.h"

namespace {

using namespace ear;

Calibration calibration() {
  Calibration c;
  c.cameras.resize(2);
  for (CameraCalibration& camera : c.cameras) {
    camera.width = 640;
    camera.height = 480;
    camera.fu = camera.fv = 400.0;
    camera.T_BC.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  }
  c.cameras[1].T_BC.translation().y() = -0.1;
  c.encoder.emplace();
  c.lasers.emplace();
  for (const double y : {0.1, -0.1, 0.0}) {
    c.lasers->beams.push_back({"", {y == 0.0 ? -0.1 : 0.1, y, 0.1}, -Eigen::Vector3d::UnitZ()});
  }
  return c;
}

class Vehicle {
 public:
  explicit Vehicle(fuzz::Bytes bytes) : bytes_(bytes), filter_({}, calibration()) {}

  void run() {
    while (bytes_.any()) act(bytes_.take<std::uint8_t>());
  }

 private:
  void act(std::uint8_t what) {
    switch (what % 8) {
      case 0:
        return stand(bytes_.take<std::uint8_t>());
      case 1: {
        ImuSample s{stamp(), number3(), number3()};
        return filter_.add_imu(s);
      }
      case 2:
        return filter_.add_encoder({stamp(), bytes_.take<std::int64_t>(), bytes_.take<std::int64_t>()});
      case 3: {
        LaserSample s{stamp(), {}};
        for (int i = bytes_.take<std::uint8_t>() % 5; i > 0; --i) s.range.push_back(bytes_.take<double>());
        return filter_.add_laser(s);
      }
      case 4: {
        FeatureFrame frame{stamp(), {}};
        for (int i = bytes_.take<std::uint8_t>() % 40; i > 0; --i) {
          frame.features.push_back({bytes_.take<std::uint8_t>(), small2(), small2(), i % 2 == 0});
        }
        return check(filter_.process(frame));
      }
      case 5:
        return check(filter_.process_without_image(stamp()));
      case 6: {
        const std::optional<NavState> state = filter_.predict(stamp());
        if (state) fuzz::require(state->p_WB.allFinite() && state->v_W.allFinite(), "the prediction is finite");
        static_cast<void>(filter_.motion_to(stamp()));
        return;
      }
      default: {
        FeatureFrame frame{now_ns_, {{bytes_.take<std::uint8_t>(), number2(), number2(), true}}};
        return check(filter_.process(frame));
      }
    }
  }

  /// `count` periods of 10 ms at rest, or in a steady motion.
  void stand(int count) {
    const Eigen::Vector3d force(0.02 * static_cast<double>(bytes_.take<std::int8_t>()), 0.0, 9.81);
    for (int i = 0; i < count && periods_left_ > 0; ++i, --periods_left_) {
      now_ns_ += 10'000'000;
      filter_.add_imu({now_ns_, Eigen::Vector3d::Zero(), force});
      filter_.add_encoder({now_ns_, 0, 0});
      filter_.add_laser({now_ns_, {0.175, 0.175, 0.175}});
      if (i % 5 == 4) check(filter_.process_without_image(now_ns_));
    }
  }

  TimeNs stamp() {
    const auto kind = bytes_.take<std::uint8_t>();
    if (kind % 4 == 0) return bytes_.take<TimeNs>();
    now_ns_ += 1'000'000 * static_cast<TimeNs>(kind / 4);
    return now_ns_;
  }
  Eigen::Vector2d small2() {
    const auto one = [this] { return 0.01 * static_cast<double>(bytes_.take<std::int8_t>()); };
    const double u = one();
    return {u, one()};
  }
  Eigen::Vector2d number2() {
    const double u = bytes_.take<double>();
    return {u, bytes_.take<double>()};
  }
  Eigen::Vector3d number3() {
    const Eigen::Vector2d two = number2();
    return {two.x(), two.y(), bytes_.take<double>()};
  }
  static void check(const std::optional<Estimate>& estimate) {
    if (estimate) fuzz::check(*estimate);
  }

  fuzz::Bytes bytes_;
  Filter filter_;
  TimeNs now_ns_ = 1'000'000'000;
  int periods_left_ = 300;  ///< at rest: so long runs do not slow down the search
};

}  // namespace

// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer's name
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Vehicle({data, size}).run();
  return 0;
}
