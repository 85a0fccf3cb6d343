// Stands before glibc's malloc, as its manual allows ("Replacing malloc"), counts and passes on.
#include "tools/allocation_counter.h"

#include <cerrno>
#include <cstddef>

#ifdef __has_feature  // clang; g++ has macros for them
#define EAR_SANITIZED_BY_CLANG (__has_feature(address_sanitizer) || __has_feature(thread_sanitizer))
#else
#define EAR_SANITIZED_BY_CLANG 0
#endif
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) && !EAR_SANITIZED_BY_CLANG
#define EAR_COUNTS_ALLOCATIONS 1
#else
#define EAR_COUNTS_ALLOCATIONS 0
#endif

namespace {

thread_local std::uint64_t calls = 0;

}  // namespace

namespace ear::tools {

bool counts_allocations() { return EAR_COUNTS_ALLOCATIONS != 0; }
std::uint64_t thread_allocations() { return calls; }

}  // namespace ear::tools

#if EAR_COUNTS_ALLOCATIONS
// NOLINTBEGIN(bugprone-reserved-identifier,readability-identifier-naming): these are glibc's names
extern "C" {

void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* block, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) {
  ++calls;
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  ++calls;
  return __libc_calloc(count, size);
}
void* realloc(void* block, std::size_t size) {
  ++calls;
  return __libc_realloc(block, size);
}
void* memalign(std::size_t alignment, std::size_t size) {
  ++calls;
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) { return memalign(alignment, size); }
int posix_memalign(void** block, std::size_t alignment, std::size_t size) {
  void* const result = memalign(alignment, size);
  if (result == nullptr) return ENOMEM;
  *block = result;
  return 0;
}
}
// NOLINTEND(bugprone-reserved-identifier,readability-identifier-naming)
#endif
