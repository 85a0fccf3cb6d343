// What long tests leave out with sanitizers, which make them about ten times as long. Whole tests are left out by their
// label (tests/doctest_main.cmake).
#pragma once

namespace ear::test {

/// doctest::skip(kStatistics): a figure over several runs has no smaller workload. The code that it runs is run by the
/// other test cases of its file.
#ifdef EAR_SANITIZED
inline constexpr bool kStatistics = true;
#else
inline constexpr bool kStatistics = false;
#endif

}  // namespace ear::test
