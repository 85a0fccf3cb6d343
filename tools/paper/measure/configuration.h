// How an estimator is set up for a run: the columns of the tables.
#pragma once

#include <string>
#include <vector>

#include "ear/calibration.h"
#include "ear/config.h"

namespace ear::paper {

/// Who makes the estimate. The optimiser gets the same tracks and the same weights.
enum class Estimator { filter, smoother };

/// As `ear run --estimator` names it.
[[nodiscard]] std::string name_of(Estimator estimator);

/// Whether this program has it.
[[nodiscard]] bool is_built(Estimator estimator);

struct Configuration {
  std::string name;   ///< on files and in JSON: short, without spaces
  std::string title;  ///< for people
  Config config;
  Estimator estimator = Estimator::filter;
  bool lasers = true;      ///< false: the estimator is given none
  bool pitch_rate = true;  ///< false: the encoders' angles come without the body's pitch, so that (5) gives nothing
  bool beams_together = false;  ///< true: a reading of the lasers in which one has no return is left out
  bool tracks_only = false;     ///< it changes samples, which only a simulation in memory allows
  bool images_only = false;     ///< it changes the front end
};

/// All that can be asked for by name: the default settings, the odometer models, the anomaly weights on and off, the
/// smoother, and the default with one ingredient left out or exchanged (ablation()).
[[nodiscard]] const std::vector<Configuration>& configurations();

/// The names of the ablation's rows; the first is the default.
[[nodiscard]] const std::vector<std::string>& ablation();

/// Throws std::invalid_argument if there is none of that name.
[[nodiscard]] const Configuration& find_configuration(const std::string& name);

/// Everything that distinguishes its results from those of others, as text: "filter.window: 12\n" ...
[[nodiscard]] std::string settings_text(const Configuration& configuration);

/// What the estimator is given of this calibration.
[[nodiscard]] Calibration given(const Configuration& configuration, Calibration calibration);

}  // namespace ear::paper
