// A figure that is right but for a share of it.
#pragma once

#include <doctest/doctest.h>

namespace ear::test {

/// `value`, give or take `share` of it. doctest's Approx(value).epsilon(share) allows share of 1 + |value|: of
/// something small it holds whatever comes out.
inline doctest::Approx about(double value, double share) { return doctest::Approx(value).epsilon(share).scale(0.0); }

}  // namespace ear::test
