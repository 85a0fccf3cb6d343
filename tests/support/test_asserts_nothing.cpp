// Not a test of the project but of its main(): see CMakeLists.txt.
#include <doctest/doctest.h>

#include "tests/support/skip.h"

TEST_CASE("main: a test case that asserts nothing") {}

TEST_CASE("main: a test case that is skipped") { ear::test::skip("to see that it is reported"); }
