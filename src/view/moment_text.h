// A moment as the page reads it: JSON. docs/view.md has the fields.
#pragma once

#include <string>

#include "frontend/lens.h"
#include "src/view/moment.h"

namespace ear::view {

/// The fields of a JSON object, without its braces: History adds the number.
[[nodiscard]] std::string summary_text(const Moment& moment);

/// A list of [id, age, use, x, y]: use as FeatureUse has it, plus 4 where the feature has ended; x and y [px] in the
/// left image, and behind them those in the right one where it was seen there. A feature without a pixel is left out.
[[nodiscard]] std::string features_text(const Moment& moment, const Lens* left, const Lens* right);

/// What stays the same.
[[nodiscard]] std::string description_text(const Description& description);

}  // namespace ear::view
