#include "src/live_state.h"

#include "filter/ekf/propagation.h"

namespace ear {

void LiveState::set(const std::optional<NavState>& state, TimeNs sample_ns) { latest_.put({state, sample_ns}); }

void LiveState::add(const ImuSample& sample) {
  if (is_time(sample.t_ns) && sample.gyro_B.allFinite() && sample.accel_B.allFinite()) take(sample);
  if (const Given* const given = latest_.take()) begin(*given);
}

/// Where the stamps jump, the estimator decides what that means.
void LiveState::take(const ImuSample& sample) {
  if (!samples_.empty()) {
    const double dt = seconds_between(samples_.back().t_ns, sample.t_ns);
    if (dt == 0.0) return;
    if (dt < 0.0 || dt > kLongest) {
      samples_.clear();
      state_.reset();
    } else if (state_) {
      carry_on(samples_.back(), sample);
    }
  }
  if (samples_.full()) samples_.pop();
  samples_.push(sample);
}

/// From the state that was set through all samples after it. One that is older than all samples is of no use.
void LiveState::begin(const Given& given) {
  if (!given.state) {
    state_.reset();
    return;
  }
  std::size_t next = samples_.size();
  while (next > 0 && samples_[next - 1].t_ns > given.sample_ns) --next;
  if (next == 0) return;
  const NavState& from = *given.state;
  state_ = ImuState{from.t_ns, from.q_WB.toRotationMatrix(), from.v_W, from.p_WB, from.b_g, from.b_a};
  age_ = 0.0;
  for (; next < samples_.size(); ++next) carry_on(samples_[next - 1], samples_[next]);
}

void LiveState::carry_on(const ImuSample& from, const ImuSample& to) {
  const double dt = seconds_between(from.t_ns, to.t_ns);
  const TimeNs t_ns = state_->t_ns + (to.t_ns - from.t_ns);
  state_ = integrate(*state_, 0.5 * (from.gyro_B + to.gyro_B), 0.5 * (from.accel_B + to.accel_B), dt);
  state_->t_ns = t_ns;
  age_ += dt;
}

std::optional<NavState> LiveState::state() const {
  if (!state_ || age_ > kLongest) return std::nullopt;
  return nav_state(*state_);
}

}  // namespace ear
