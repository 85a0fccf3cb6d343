// The estimator's health in words, for people.
#pragma once

#include <string>

#include "ear/health.h"

namespace ear {

[[nodiscard]] std::string to_text(HealthStatus status);

/// What a start waits for, or how the estimate was lost, such as "nothing but inertial samples for two seconds". Empty
/// for Reason::none.
[[nodiscard]] const char* to_text(Reason reason);

/// Such as "lost: the state is not a number", "degraded: without wheel_left, beam_0; carried by cameras".
[[nodiscard]] std::string to_text(const Health& health);

}  // namespace ear
