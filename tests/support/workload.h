// How much of the long tests runs with sanitizers, which make them about ten times as long: decided here alone.
#pragma once

#include <initializer_list>
#include <vector>

namespace ear::test {

#ifdef EAR_SANITIZED
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

/// Those of the cases that are run: all, or with sanitizers the first. For cases that are judged one by one.
template <typename T>
std::vector<T> workload(std::initializer_list<T> cases) {
  return kSanitized ? std::vector<T>{*cases.begin()} : std::vector<T>(cases);
}

/// doctest::skip(kStatistics): a figure over several runs has no smaller workload. The code that it runs is run by the
/// other test cases of its file.
inline constexpr bool kStatistics = kSanitized;

/// doctest::skip(kLong): minutes with sanitizers, through code that other test cases of the file run as well.
inline constexpr bool kLong = kSanitized;

}  // namespace ear::test
