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

const char* to_text(Reason reason) {
  switch (reason) {
    case Reason::none:
      return "";
    case Reason::no_frame:
      return "no image came, and no step was asked for, that inertial samples reach";
    case Reason::few_samples:
      return "inertial samples are missing";
    case Reason::other_gravity:
      return "it stands, but the mean specific force is not gravity: another unit, or a broken accelerometer";
    case Reason::moves_unseen:
      return "it does not stand still, and nothing shows how far: no wheels on the ground, no two cameras, no change "
             "of speed with one";
    case Reason::few_readings:
      return "it does not stand still, and the readings of the wheels do not span 1.5 s yet";
    case Reason::wheel_gaps:
      return "it does not stand still, and readings of the wheels are missing, or too far apart";
    case Reason::wheels_contradict:
      return "it does not stand still, and wheels and inertial samples show different motions";
    case Reason::few_frames:
      return "it does not stand still, and frames whose features fit each other do not span 1.5 s yet";
    case Reason::cameras_contradict:
      return "it does not stand still, and cameras and inertial samples show different motions";
    case Reason::start_is_ahead:
      return "the time of the start that was given has not come";
    case Reason::start_is_past:
      return "the inertial samples do not reach back to the time of the start that was given";
    case Reason::vague_velocity:
      return "the velocity is not known well enough yet";
    case Reason::inertia_alone:
      return "nothing but inertial samples for two seconds";
    case Reason::velocity_lost:
      return "the velocity is too uncertain";
    case Reason::images_contradict:
      return "the images do not show what the state expects";
    case Reason::not_a_number:
      return "the state is not a number, or farther away than any vehicle gets";
    case Reason::clock_or_gap:
      return "no inertial samples for two seconds, or their clock was set back";
    case Reason::proving:
      return "what is measured fits again, but not yet for half a second";
  }
  return "";
}

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
  if (health.status == HealthStatus::tracking) return text;
  if (health.status != HealthStatus::degraded) {
    return health.reason == Reason::none ? text : text + ": " + to_text(health.reason);
  }
  const char* separator = ": without ";
  for (std::size_t source = 0; source < kSourceCount; ++source) {
    if (!health.faulty[source]) continue;
    text += separator + std::string(kSourceNames[source]);
    separator = ", ";
  }
  separator = health.faulty.any() ? ", " : ": ";
  if (health.imprecise) {
    text += separator + std::string("position imprecise");
    separator = ", ";
  }
  if (health.misaligned) text += separator + std::string("sensors point elsewhere than the calibration says");
  return text + "; carried by " + to_text(health.aiding);
}

}  // namespace ear
