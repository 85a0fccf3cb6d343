// Four numbers side by side: one register of AVX2, two of SSE2 and NEON, or whatever the compiler makes of two pairs.
// Only the variants of the kernels include this, each compiled for its own processor: EAR_VARIANT keeps their functions
// apart.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#if defined(__AVX2__)
#include <immintrin.h>
#elif defined(__SSE2__)
#include <emmintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#endif

// NOLINTBEGIN(modernize-avoid-c-arrays): the kernels use no functions of std::array, see kernels_body.h
namespace ear::EAR_VARIANT {

using Two = double __attribute__((vector_size(16)));

#if defined(__AVX2__)

using Four = double __attribute__((vector_size(32)));

inline Four all(double value) { return Four{value, value, value, value}; }

inline double sum(Four a) {
  const Two halves = {a[0] + a[2], a[1] + a[3]};
  return halves[0] + halves[1];
}

inline Four root(Four a) { return reinterpret_cast<Four>(_mm256_sqrt_pd(reinterpret_cast<__m256d>(a))); }

/// Where a > b the first, else the second.
inline Four where_greater(Four a, Four b, Four first, Four second) { return a > b ? first : second; }

/// A matrix of four columns, each column becomes a row.
inline void transpose(Four (&m)[4]) {
  const __m256d a = _mm256_unpacklo_pd(m[0], m[1]);
  const __m256d b = _mm256_unpackhi_pd(m[0], m[1]);
  const __m256d c = _mm256_unpacklo_pd(m[2], m[3]);
  const __m256d d = _mm256_unpackhi_pd(m[2], m[3]);
  m[0] = _mm256_permute2f128_pd(a, c, 0x20);
  m[1] = _mm256_permute2f128_pd(b, d, 0x20);
  m[2] = _mm256_permute2f128_pd(a, c, 0x31);
  m[3] = _mm256_permute2f128_pd(b, d, 0x31);
}

#else

struct Four {
  Two low, high;
  Four operator+(const Four& b) const { return {low + b.low, high + b.high}; }
  Four operator-(const Four& b) const { return {low - b.low, high - b.high}; }
  Four operator*(const Four& b) const { return {low * b.low, high * b.high}; }
  Four operator/(const Four& b) const { return {low / b.low, high / b.high}; }
  Four operator-() const { return {-low, -high}; }
  Four& operator+=(const Four& b) { return *this = *this + b; }
  Four& operator-=(const Four& b) { return *this = *this - b; }
};

inline Four all(double value) { return {Two{value, value}, Two{value, value}}; }

inline double sum(const Four& a) {
  const Two halves = a.low + a.high;
  return halves[0] + halves[1];
}

inline Two root(Two a) {
#if defined(__SSE2__)
  return reinterpret_cast<Two>(_mm_sqrt_pd(reinterpret_cast<__m128d>(a)));
#elif defined(__aarch64__)
  return reinterpret_cast<Two>(vsqrtq_f64(reinterpret_cast<float64x2_t>(a)));
#else
  return Two{__builtin_sqrt(a[0]), __builtin_sqrt(a[1])};
#endif
}
inline Four root(const Four& a) { return {root(a.low), root(a.high)}; }

inline Four where_greater(const Four& a, const Four& b, const Four& first, const Four& second) {
  return {a.low > b.low ? first.low : second.low, a.high > b.high ? first.high : second.high};
}

inline void transpose(Four (&m)[4]) {
  const Four a = m[0], b = m[1], c = m[2], d = m[3];
  m[0] = {Two{a.low[0], b.low[0]}, Two{c.low[0], d.low[0]}};
  m[1] = {Two{a.low[1], b.low[1]}, Two{c.low[1], d.low[1]}};
  m[2] = {Two{a.high[0], b.high[0]}, Two{c.high[0], d.high[0]}};
  m[3] = {Two{a.high[1], b.high[1]}, Two{c.high[1], d.high[1]}};
}

#endif

inline Four load(const double* p) {
  Four result;
  std::memcpy(&result, p, sizeof(result));
  return result;
}

inline void store(double* p, const Four& numbers) { std::memcpy(p, &numbers, sizeof(numbers)); }

}  // namespace ear::EAR_VARIANT
// NOLINTEND(modernize-avoid-c-arrays)
