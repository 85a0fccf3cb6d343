// The page, with its style and script: compiled in from src/view/page.
#pragma once

#include <string>

namespace ear::view {

[[nodiscard]] const std::string& page();

}  // namespace ear::view
