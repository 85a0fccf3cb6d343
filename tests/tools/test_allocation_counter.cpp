#include "tools/allocation_counter.h"

#include <doctest/doctest.h>

#include <cstdlib>
#include <memory>
#include <thread>

#include "tests/support/skip.h"

namespace ear::tools {
namespace {

/// How many allocations the function makes in this thread.
template <typename Function>
std::uint64_t allocations_of(const Function& function) {
  const std::uint64_t before = thread_allocations();
  function();
  return thread_allocations() - before;
}

TEST_CASE("allocations: every way to ask for memory is counted, in its own thread") {
  if (!counts_allocations()) {
    test::skip("no hook in malloc: built with a sanitizer, or not on glibc");
    return;
  }
  void* volatile block = nullptr;  // so that no call is left out
  CHECK(allocations_of([] {}) == 0);
  CHECK(allocations_of([&] { std::free(block = std::malloc(100)); }) == 1);
  CHECK(allocations_of([&] { std::free(block = std::calloc(10, 10)); }) == 1);
  CHECK(allocations_of([&] { std::free(block = std::realloc(std::malloc(10), 1000)); }) == 2);
  CHECK(allocations_of([&] { std::free(block = std::aligned_alloc(64, 128)); }) == 1);
  CHECK(allocations_of([&] { ::operator delete(block = ::operator new(8)); }) == 1);
  void* aligned = nullptr;
  CHECK(allocations_of([&] { CHECK(posix_memalign(&aligned, 256, 100) == 0); }) >= 1);
  CHECK(reinterpret_cast<std::uintptr_t>(aligned) % 256 == 0);
  std::free(aligned);

  std::uint64_t of_thread = 0;
  const std::uint64_t before = thread_allocations();
  std::thread thread([&] { of_thread = allocations_of([&] { std::free(block = std::malloc(100)); }); });
  thread.join();
  CHECK(of_thread == 1);
  CHECK(thread_allocations() - before < 5);  // what making the thread took
}

}  // namespace
}  // namespace ear::tools
