// How often a thread asks for memory. A program that links allocation_counter.cpp has its malloc counted; in no
// library.
#pragma once

#include <cstdint>

namespace ear::tools {

/// False where malloc belongs to somebody else: built with a sanitizer, or not on glibc.
[[nodiscard]] bool counts_allocations();

/// Calls of malloc and its relatives by this thread since it started, with those behind operator new; free() not
/// counted.
[[nodiscard]] std::uint64_t thread_allocations();

}  // namespace ear::tools
