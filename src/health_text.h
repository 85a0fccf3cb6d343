// The estimator's health in words, for people.
#pragma once

#include <string>

#include "ear/health.h"

namespace ear {

[[nodiscard]] std::string to_text(HealthStatus status);

/// Such as "degraded: without wheel_left, beam_0; carried by cameras".
[[nodiscard]] std::string to_text(const Health& health);

}  // namespace ear
