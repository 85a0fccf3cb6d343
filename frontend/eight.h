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

inline float sum(Floats a) { return ((a[0] + a[4]) + (a[2] + a[6])) + ((a[1] + a[5]) + (a[3] + a[7])); }

inline bool any(Ints a) {
  const auto bits = reinterpret_cast<__m256i>(a);
  return _mm256_testz_si256(bits, bits) == 0;
}

/// Where a number is negative the second, else the first.
inline Ints choose(Ints first, Ints second, Ints number) {
  return reinterpret_cast<Ints>(_mm256_blendv_ps(reinterpret_cast<__m256>(first), reinterpret_cast<__m256>(second),
                                                 reinterpret_cast<__m256>(number)));
}

/// Products of the lower and of the upper 16 bits, added.
inline Ints add_products(Ints a, Ints b) {
  return reinterpret_cast<Ints>(_mm256_madd_epi16(reinterpret_cast<__m256i>(a), reinterpret_cast<__m256i>(b)));
}

/// Numbers from 0 to 255, as bytes.
inline void store_bytes(std::uint8_t* p, Ints numbers) {
  const auto all = reinterpret_cast<__m256i>(numbers);
  const __m128i words = _mm_packs_epi32(_mm256_castsi256_si128(all), _mm256_extracti128_si256(all, 1));
  _mm_storel_epi64(reinterpret_cast<__m128i*>(p), _mm_packus_epi16(words, words));
}

#define EAR_HAS_PICK 1
/// Bytes of the 16 at `bytes` by their numbers; 0 for numbers from 128 on.
inline Ints pick(const std::uint8_t* bytes, Ints numbers) {
  const __m128i row = _mm_loadu_si128(reinterpret_cast<const __m128i*>(bytes));
  return reinterpret_cast<Ints>(
      _mm256_shuffle_epi8(_mm256_broadcastsi128_si256(row), reinterpret_cast<__m256i>(numbers)));
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
  Ints operator&(int b) const { return {low & b, high & b}; }
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
  return (s[0] + s[2]) + (s[1] + s[3]);
}

inline Ints4 choose(Ints4 first, Ints4 second, Ints4 number) {
#if defined(__SSE4_1__)
  return reinterpret_cast<Ints4>(_mm_blendv_ps(reinterpret_cast<__m128>(first), reinterpret_cast<__m128>(second),
                                               reinterpret_cast<__m128>(number)));
#else
  const Ints4 mask = number >> 31;
  return (first & ~mask) | (second & mask);
#endif
}
inline Ints choose(const Ints& first, const Ints& second, const Ints& number) {
  return {choose(first.low, second.low, number.low), choose(first.high, second.high, number.high)};
}

inline bool any(const Ints& a) {
  const Ints4 both = a.low | a.high;
#if defined(__SSE2__)
  return _mm_movemask_epi8(_mm_cmpeq_epi32(reinterpret_cast<__m128i>(both), _mm_setzero_si128())) != 0xffff;
#elif defined(__aarch64__)
  return vmaxvq_u32(reinterpret_cast<uint32x4_t>(both)) != 0;
#else
  return (both[0] | both[1] | both[2] | both[3]) != 0;
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

inline void store_bytes(std::uint8_t* p, const Ints& numbers) {
#if defined(__SSE2__)
  const __m128i words =
      _mm_packs_epi32(reinterpret_cast<__m128i>(numbers.low), reinterpret_cast<__m128i>(numbers.high));
  _mm_storel_epi64(reinterpret_cast<__m128i*>(p), _mm_packus_epi16(words, words));
#else
  for (int i = 0; i < 4; ++i) {
    p[i] = static_cast<std::uint8_t>(numbers.low[i]);
    p[i + 4] = static_cast<std::uint8_t>(numbers.high[i]);
  }
#endif
}

#if defined(__SSSE3__)
#define EAR_HAS_PICK 1
inline Ints pick(const std::uint8_t* bytes, const Ints& numbers) {
  const __m128i row = _mm_loadu_si128(reinterpret_cast<const __m128i*>(bytes));
  return {reinterpret_cast<Ints4>(_mm_shuffle_epi8(row, reinterpret_cast<__m128i>(numbers.low))),
          reinterpret_cast<Ints4>(_mm_shuffle_epi8(row, reinterpret_cast<__m128i>(numbers.high)))};
}
#elif defined(__aarch64__)
#define EAR_HAS_PICK 1
inline Ints pick(const std::uint8_t* bytes, const Ints& numbers) {
  const uint8x16_t row = vld1q_u8(bytes);
  return {reinterpret_cast<Ints4>(vqtbl1q_u8(row, reinterpret_cast<uint8x16_t>(numbers.low))),
          reinterpret_cast<Ints4>(vqtbl1q_u8(row, reinterpret_cast<uint8x16_t>(numbers.high)))};
}
#else
#define EAR_HAS_PICK 0
inline Ints count_up() { return {Ints4{0, 1, 2, 3}, Ints4{4, 5, 6, 7}}; }

/// Eight bytes from `p`, each with the next one in the upper 16 bits.
inline Ints neighbours(const std::uint8_t* p) {
#if defined(__SSE2__)
  const __m128i zero = _mm_setzero_si128();
  const __m128i left = _mm_unpacklo_epi8(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(p)), zero);
  const __m128i right = _mm_unpacklo_epi8(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(p + 1)), zero);
  return {reinterpret_cast<Ints4>(_mm_unpacklo_epi16(left, right)),
          reinterpret_cast<Ints4>(_mm_unpackhi_epi16(left, right))};
#else
  Ints result{};
  for (int i = 0; i < 4; ++i) {
    result.low[i] = p[i] | (p[i + 1] << 16);
    result.high[i] = p[i + 4] | (p[i + 5] << 16);
  }
  return result;
#endif
}
#endif

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

/// One of the eight.
inline int at(const Ints& numbers, int index) {
  int number;
  std::memcpy(&number, reinterpret_cast<const unsigned char*>(&numbers) + 4 * index, sizeof(number));
  return number;
}

/// All the same.
inline Floats all(float value) { return Floats{} + value; }
inline Ints all(int value) { return Ints{} + value; }

}  // namespace ear::EAR_VARIANT
