// What a test cannot do here, for lack of a library, a recording or a hook.
#pragma once

#include <string>

namespace ear::test {

/// Says that the test case at hand, or a part of it, is left out: the program then ends with 77, which ctest reports as
/// skipped and not as passed.
void skip(const std::string& reason);

}  // namespace ear::test
