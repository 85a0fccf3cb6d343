// Eight numbers side by side: one register of AVX2, two of SSE and NEON, or whatever the compiler makes of two groups
// of four. Only the variants of the kernels include this, each compiled for its own processor: EAR_VARIANT keeps their
// functions apart.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#if defined(__AVX2__)
#include <immintrin.h>
#elif defined(__SSE4_1__)
#include <smmintrin.h>
#elif defined(__SSE2__)
#include <emmintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#endif

namespace ear::EAR_VARIANT {

#if defined(__AVX2__)

using Floats = float __attribute__((vector_size(32)));
using Ints = int __attribute__((vector_size(32)));

inline Floats to_floats(Ints a) { return __builtin_convertvector(a, Floats); }
inline Ints to_ints(Floats a) { return __builtin_convertvector(a, Ints); }  // towards 0

inline float sum(Floats a) {  // of both halves, then of both halves of that
  const auto all = reinterpret_cast<__m256>(a);
  const __m128 four = _mm_add_ps(_mm256_castps256_ps128(all), _mm256_extractf128_ps(all, 1));
  const __m128 two = _mm_add_ps(four, _mm_movehl_ps(four, four));
  return two[0] + two[1];
}

/// Products of the lower and of the upper 16 bits, added.
inline Ints add_products(Ints a, Ints b) {
  return reinterpret_cast<Ints>(_mm256_madd_epi16(reinterpret_cast<__m256i>(a), reinterpret_cast<__m256i>(b)));
}

#else

using Floats4 = float __attribute__((vector_size(16)));
using Ints4 = int __attribute__((vector_size(16)));

struct Floats {
  Floats4 low, high;
  Floats operator+(const Floats& b) const { return {low + b.low, high + b.high}; }
  Floats operator-(const Floats& b) const { return {low - b.low, high - b.high}; }
  Floats operator*(const Floats& b) const { return {low * b.low, high * b.high}; }
  Floats operator+(float b) const { return {low + b, high + b}; }
  Floats operator-(float b) const { return {low - b, high - b}; }
  Floats operator*(float b) const { return {low * b, high * b}; }
  Floats& operator+=(const Floats& b) { return *this = *this + b; }
};

struct Ints {
  Ints4 low, high;
  Ints operator+(const Ints& b) const { return {low + b.low, high + b.high}; }
  Ints operator-(const Ints& b) const { return {low - b.low, high - b.high}; }
  Ints operator|(const Ints& b) const { return {low | b.low, high | b.high}; }
  Ints operator+(int b) const { return {low + b, high + b}; }
  Ints operator-(int b) const { return {low - b, high - b}; }
  Ints operator|(int b) const { return {low | b, high | b}; }
  Ints operator*(int b) const { return {low * b, high * b}; }
  Ints operator&(int b) const { return {low & b, high & b}; }
  Ints operator&(const Ints& b) const { return {low & b.low, high & b.high}; }
  Ints operator<<(int b) const { return {low << b, high << b}; }
  Ints operator>>(int b) const { return {low >> b, high >> b}; }
  Ints operator>(int b) const { return {low > b, high > b}; }
  Ints& operator+=(const Ints& b) { return *this = *this + b; }
};

inline Floats to_floats(const Ints& a) {
  return {__builtin_convertvector(a.low, Floats4), __builtin_convertvector(a.high, Floats4)};
}

inline Ints to_ints(const Floats& a) {
  return {__builtin_convertvector(a.low, Ints4), __builtin_convertvector(a.high, Ints4)};
}

inline float sum(const Floats& a) {
  const Floats4 s = a.low + a.high;
#if defined(__SSE2__)
  const auto four = reinterpret_cast<__m128>(s);
  const __m128 two = _mm_add_ps(four, _mm_movehl_ps(four, four));
  return two[0] + two[1];
#else
  return (s[0] + s[2]) + (s[1] + s[3]);
#endif
}

inline Ints4 add_products(Ints4 a, Ints4 b) {
#if defined(__SSE2__)
  return reinterpret_cast<Ints4>(_mm_madd_epi16(reinterpret_cast<__m128i>(a), reinterpret_cast<__m128i>(b)));
#else
  return (a & 0xffff) * (b & 0xffff) + (a >> 16) * (b >> 16);
#endif
}
inline Ints add_products(const Ints& a, const Ints& b) {
  return {add_products(a.low, b.low), add_products(a.high, b.high)};
}

#endif  // __AVX2__

template <class Eight, class Number>
Eight load(const Number* p) {
  Eight result;
  std::memcpy(&result, p, sizeof(result));
  return result;
}

template <class Eight, class Number>
void store(Number* p, const Eight& numbers) {
  std::memcpy(p, &numbers, sizeof(numbers));
}

/// All the same.
inline Floats all(float value) { return Floats{} + value; }
inline Ints all(int value) { return Ints{} + value; }

}  // namespace ear::EAR_VARIANT
