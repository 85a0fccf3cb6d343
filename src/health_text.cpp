#include "src/health_text.h"

namespace ear {
namespace {

const char* to_text(Aiding aiding) {
  switch (aiding) {
    case Aiding::none:
      return "inertia alone";
    case Aiding::standing:
      return "standing still";
    case Aiding::wheels:
      return "wheels";
    case Aiding::cameras:
      return "cameras";
    case Aiding::cameras_and_wheels:
      return "cameras and wheels";
  }
  return "";
}

}  // namespace

std::string to_text(HealthStatus status) {
  switch (status) {
    case HealthStatus::initialising:
      return "initialising";
    case HealthStatus::tracking:
      return "tracking";
    case HealthStatus::degraded:
      return "degraded";
    case HealthStatus::lost:
      return "lost";
  }
  return "";
}

std::string to_text(const Health& health) {
  std::string text = to_text(health.status);
  if (health.load_step > 0) text += ", load step " + std::to_string(health.load_step);
  if (health.status != HealthStatus::degraded) return text;
  const char* separator = ": without ";
  for (std::size_t source = 0; source < kSourceCount; ++source) {
    if (!health.faulty[source]) continue;
    text += separator + std::string(kSourceNames[source]);
    separator = ", ";
  }
  return text + "; carried by " + to_text(health.aiding);
}

}  // namespace ear
