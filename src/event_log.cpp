#include "src/event_log.h"

#include <array>
#include <cmath>
#include <cstdio>

#include "src/health_text.h"
#include "src/log/log.h"

namespace ear {
namespace {

std::string at(TimeNs t_ns) {
  std::array<char, 48> text{};
  std::snprintf(text.data(), text.size(), "at %.3f s: ", 1e-9 * static_cast<double>(t_ns));
  return text.data();
}

// "3 implausible, 1 too late"
std::string reasons(const StreamCounts& counts) {
  std::string text;
  const auto add = [&](std::uint64_t count, const char* reason) {
    if (count > 0) text += (text.empty() ? "" : ", ") + std::to_string(count) + " " + reason;
  };
  add(counts.not_finite, "not finite");
  add(counts.implausible, "implausible");
  add(counts.not_later, "not later than the one before");
  add(counts.far_ahead, "far ahead");
  add(counts.too_late, "too late");
  add(counts.repeated, "repeated");
  return text;
}

}  // namespace

void EventLog::note(TimeNs t_ns, const Health& health, const InputCounts& counts) {
  note_health(t_ns, health);
  note_refused(t_ns, "imu", counts_.imu, counts.imu);
  note_refused(t_ns, "encoder", counts_.encoder, counts.encoder);
  note_refused(t_ns, "laser", counts_.laser, counts.laser);
  note_refused(t_ns, "camera", counts_.camera, counts.camera);
  if (counts.clock_jumps > counts_.clock_jumps) {
    warn(t_ns, "clock jump", "the clock of one sensor jumped against all others; the jump was taken out");
  }
  counts_ = counts;
}

void EventLog::note_unusable(TimeNs t_ns, const std::string& reason) {
  warn(t_ns, "unusable images", "images not used: " + reason);
}

/// A state that was written within the interval waits, so that one that comes and goes does not fill the log; the state
/// that stays is written in the end.
void EventLog::note_health(TimeNs t_ns, const Health& health) {
  const bool same = health.status == written_.status && health.reason == written_.reason &&
                    health.faulty == written_.faulty && health.aiding == written_.aiding &&
                    health.imprecise == written_.imprecise && health.misaligned == written_.misaligned &&
                    health.load_step == written_.load_step && health.reset_counter == written_.reset_counter;
  if (same) return;
  const std::string text = to_text(health);
  const auto before = states_.find(text);
  if (before != states_.end() && std::abs(seconds_between(before->second, t_ns)) < kInterval) return;
  states_[text] = t_ns;
  written_ = health;
  if (health.status == HealthStatus::lost) {
    log_warning(at(t_ns) + text + "; no estimate until it has started again");
  } else {
    log_info(at(t_ns) + text);
  }
}

void EventLog::note_refused(TimeNs t_ns, const char* stream, const StreamCounts& before, const StreamCounts& now) {
  if (now.rejected() > before.rejected()) {
    warn(t_ns, std::string(stream) + " refused", std::string(stream) + ": refused so far: " + reasons(now));
  }
  if (now.gaps > before.gaps) {
    if (const auto held_back = limit_.allows(std::string(stream) + " gap", t_ns)) {
      log_info(at(t_ns) + stream + ": a gap" + held_back_text(*held_back));
    }
  }
}

void EventLog::warn(TimeNs t_ns, const std::string& kind, const std::string& message) {
  if (const auto held_back = limit_.allows(kind, t_ns)) log_warning(at(t_ns) + message + held_back_text(*held_back));
}

}  // namespace ear
