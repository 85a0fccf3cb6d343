// Settings of the front end. Each default is one value for all recordings; docs/frontend.md says how it was found.
#pragma once

namespace ear {

struct FrontendConfig {
  int max_features = 150;  ///< tracks kept at a time
};

}  // namespace ear
