// Sixteen whole numbers of 16 bits side by side: one register of AVX2, two of SSE and NEON, or whatever the compiler
// makes of two groups of eight. See eight.h, of which this is the other half.
#pragma once

#include "frontend/eight.h"

#if defined(__SSSE3__) || defined(__aarch64__)  // AVX2 has it, too
#define EAR_HAS_PICK 1
#else
#define EAR_HAS_PICK 0
#endif

namespace ear::EAR_VARIANT {

using Eight16 = std::int16_t __attribute__((vector_size(16)));

#if defined(__AVX2__)

using Words = std::int16_t __attribute__((vector_size(32)));

/// The lower eight are all `low`, the upper ones `high`.
inline Words spread(std::int16_t low, std::int16_t high) {
  return reinterpret_cast<Words>(_mm256_set_m128i(_mm_set1_epi16(high), _mm_set1_epi16(low)));
}
inline Words spread(std::int16_t both) { return reinterpret_cast<Words>(_mm256_set1_epi16(both)); }

/// Where `mask` is all ones the second, where it is 0 the first.
inline Words choose(Words first, Words second, Words mask) {
  return reinterpret_cast<Words>(_mm256_blendv_epi8(reinterpret_cast<__m256i>(first), reinterpret_cast<__m256i>(second),
                                                    reinterpret_cast<__m256i>(mask)));
}

/// Products of neighbours 0 and 1, 2 and 3 ..., added.
inline Ints dot(Words a, Words b) {
  return reinterpret_cast<Ints>(_mm256_madd_epi16(reinterpret_cast<__m256i>(a), reinterpret_cast<__m256i>(b)));
}

/// The upper 16 bits of each product: a b / 65536, rounded down.
inline Words multiply_high(Words a, Words b) {
  return reinterpret_cast<Words>(_mm256_mulhi_epi16(reinterpret_cast<__m256i>(a), reinterpret_cast<__m256i>(b)));
}

/// 16 bytes from `low` and 16 from `high`.
inline Words bytes_at(const std::uint8_t* low, const std::uint8_t* high) {
  return reinterpret_cast<Words>(
      _mm256_inserti128_si256(_mm256_castsi128_si256(_mm_loadu_si128(reinterpret_cast<const __m128i*>(low))),
                              _mm_loadu_si128(reinterpret_cast<const __m128i*>(high)), 1));
}

/// Of each half's 16 bytes those with these numbers; the numbers' upper bytes are 128.
inline Words pick(Words bytes, Words numbers) {
  return reinterpret_cast<Words>(
      _mm256_shuffle_epi8(reinterpret_cast<__m256i>(bytes), reinterpret_cast<__m256i>(numbers)));
}

/// Sixteen bytes.
inline Words words_at(const std::uint8_t* p) {
  return reinterpret_cast<Words>(_mm256_cvtepu8_epi16(_mm_loadu_si128(reinterpret_cast<const __m128i*>(p))));
}

/// Numbers of 16 bits.
inline Words narrow(Ints first, Ints second) {
  const __m256i fours = _mm256_packs_epi32(reinterpret_cast<__m256i>(first), reinterpret_cast<__m256i>(second));
  return reinterpret_cast<Words>(_mm256_permute4x64_epi64(fours, 0xd8));  // first, second, first, second
}

/// Of 32 bytes: 0, 2, 4 ... times `even` plus 1, 3, 5 ... times `odd`; from 0 to 127 both.
inline Words pairs(const std::uint8_t* p, std::int16_t even, std::int16_t odd) {
  const __m256i factors = _mm256_set1_epi16(static_cast<std::int16_t>(odd << 8 | even));
  return reinterpret_cast<Words>(
      _mm256_maddubs_epi16(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(p)), factors));
}

/// Of 32 bytes 0, 2, 4 ...
inline Words evens(const std::uint8_t* p) { return load<Words>(p) & std::int16_t{0xff}; }

/// Sixteen numbers from 0 to 255, as bytes.
inline void store_bytes(std::uint8_t* p, Words numbers) {
  const auto all = reinterpret_cast<__m256i>(numbers);
  _mm_storeu_si128(reinterpret_cast<__m128i*>(p),
                   _mm_packus_epi16(_mm256_castsi256_si128(all), _mm256_extracti128_si256(all, 1)));
}

inline Floats floats_at(const std::int16_t* p) {
  const __m128i words = _mm_loadu_si128(reinterpret_cast<const __m128i*>(p));
  return to_floats(reinterpret_cast<Ints>(_mm256_cvtepi16_epi32(words)));
}

#else

struct Words {
  Eight16 low, high;
  Words operator+(const Words& b) const { return {low + b.low, high + b.high}; }
  Words operator-(const Words& b) const { return {low - b.low, high - b.high}; }
  Words operator*(const Words& b) const { return {low * b.low, high * b.high}; }
  Words operator+(std::int16_t b) const { return {low + b, high + b}; }
  Words operator&(std::int16_t b) const { return {low & b, high & b}; }
  Words operator&(const Words& b) const { return {low & b.low, high & b.high}; }
  Words operator|(std::int16_t b) const { return {low | b, high | b}; }
  Words operator<<(std::int16_t b) const { return {low << b, high << b}; }
  Words operator>>(std::int16_t b) const { return {low >> b, high >> b}; }
};

inline Words spread(std::int16_t low, std::int16_t high) { return {Eight16{} + low, Eight16{} + high}; }
inline Words spread(std::int16_t both) { return spread(both, both); }

inline Eight16 choose(Eight16 first, Eight16 second, Eight16 mask) {
#if defined(__SSE4_1__)
  return reinterpret_cast<Eight16>(_mm_blendv_epi8(reinterpret_cast<__m128i>(first), reinterpret_cast<__m128i>(second),
                                                   reinterpret_cast<__m128i>(mask)));
#else
  return first ^ ((first ^ second) & mask);
#endif
}
inline Words choose(const Words& first, const Words& second, const Words& mask) {
  return {choose(first.low, second.low, mask.low), choose(first.high, second.high, mask.high)};
}

inline Ints4 dot(Eight16 a, Eight16 b) {
#if defined(__SSE2__)
  return reinterpret_cast<Ints4>(_mm_madd_epi16(reinterpret_cast<__m128i>(a), reinterpret_cast<__m128i>(b)));
#elif defined(__aarch64__)
  const auto x = reinterpret_cast<int16x8_t>(a);
  const auto y = reinterpret_cast<int16x8_t>(b);
  return reinterpret_cast<Ints4>(vpaddq_s32(vmull_s16(vget_low_s16(x), vget_low_s16(y)), vmull_high_s16(x, y)));
#else
  Ints4 sums{};
  for (int i = 0; i < 4; ++i) sums[i] = a[2 * i] * b[2 * i] + a[2 * i + 1] * b[2 * i + 1];
  return sums;
#endif
}
inline Ints dot(const Words& a, const Words& b) { return {dot(a.low, b.low), dot(a.high, b.high)}; }

inline Eight16 multiply_high(Eight16 a, Eight16 b) {
#if defined(__SSE2__)
  return reinterpret_cast<Eight16>(_mm_mulhi_epi16(reinterpret_cast<__m128i>(a), reinterpret_cast<__m128i>(b)));
#elif defined(__aarch64__)
  const auto x = reinterpret_cast<int16x8_t>(a);
  const auto y = reinterpret_cast<int16x8_t>(b);
  const int32x4_t low = vmull_s16(vget_low_s16(x), vget_low_s16(y));
  return reinterpret_cast<Eight16>(vuzp2q_s16(vreinterpretq_s16_s32(low), vreinterpretq_s16_s32(vmull_high_s16(x, y))));
#else
  Eight16 result{};
  for (int i = 0; i < 8; ++i) result[i] = static_cast<std::int16_t>((a[i] * b[i]) >> 16);
  return result;
#endif
}
inline Words multiply_high(const Words& a, const Words& b) {
  return {multiply_high(a.low, b.low), multiply_high(a.high, b.high)};
}

#if EAR_HAS_PICK
inline Words bytes_at(const std::uint8_t* low, const std::uint8_t* high) {
  return {load<Eight16>(low), load<Eight16>(high)};
}

inline Eight16 pick(Eight16 bytes, Eight16 numbers) {
#if defined(__SSSE3__)
  return reinterpret_cast<Eight16>(
      _mm_shuffle_epi8(reinterpret_cast<__m128i>(bytes), reinterpret_cast<__m128i>(numbers)));
#else
  return reinterpret_cast<Eight16>(
      vqtbl1q_u8(reinterpret_cast<uint8x16_t>(bytes), reinterpret_cast<uint8x16_t>(numbers)));
#endif
}
inline Words pick(const Words& bytes, const Words& numbers) {
  return {pick(bytes.low, numbers.low), pick(bytes.high, numbers.high)};
}
#endif

/// Eight bytes.
inline Eight16 words_of(const std::uint8_t* p) {
#if defined(__aarch64__)
  return reinterpret_cast<Eight16>(vmovl_u8(vld1_u8(p)));
#elif defined(__SSE2__)
  return reinterpret_cast<Eight16>(
      _mm_unpacklo_epi8(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(p)), _mm_setzero_si128()));
#else
  Eight16 result{};
  for (int i = 0; i < 8; ++i) result[i] = p[i];
  return result;
#endif
}
inline Words words_at(const std::uint8_t* p) { return {words_of(p), words_of(p + 8)}; }

inline Eight16 narrow(const Ints& numbers) {
#if defined(__SSE2__)
  return reinterpret_cast<Eight16>(
      _mm_packs_epi32(reinterpret_cast<__m128i>(numbers.low), reinterpret_cast<__m128i>(numbers.high)));
#else
  Eight16 result{};
  for (int i = 0; i < 4; ++i) {
    result[i] = static_cast<std::int16_t>(numbers.low[i]);
    result[i + 4] = static_cast<std::int16_t>(numbers.high[i]);
  }
  return result;
#endif
}
inline Words narrow(const Ints& first, const Ints& second) { return {narrow(first), narrow(second)}; }

inline Eight16 eight_pairs(const std::uint8_t* p, std::int16_t even, std::int16_t odd) {
#if defined(__SSSE3__)
  const __m128i factors = _mm_set1_epi16(static_cast<std::int16_t>(odd << 8 | even));
  return reinterpret_cast<Eight16>(_mm_maddubs_epi16(_mm_loadu_si128(reinterpret_cast<const __m128i*>(p)), factors));
#elif defined(__SSE2__) || defined(__aarch64__)
  const auto both = load<Eight16>(p);
  return (both & 0xff) * even + ((both >> 8) & 0xff) * odd;
#else
  Eight16 result{};
  for (int i = 0; i < 8; ++i) result[i] = static_cast<std::int16_t>(p[2 * i] * even + p[2 * i + 1] * odd);
  return result;
#endif
}
inline Words pairs(const std::uint8_t* p, std::int16_t even, std::int16_t odd) {
  return {eight_pairs(p, even, odd), eight_pairs(p + 16, even, odd)};
}

inline Words evens(const std::uint8_t* p) {
#if defined(__SSE2__) || defined(__aarch64__)
  return Words{load<Eight16>(p), load<Eight16>(p + 16)} & std::int16_t{0xff};
#else
  return pairs(p, 1, 0);
#endif
}

inline void store_bytes(std::uint8_t* p, const Words& numbers) {
#if defined(__SSE2__)
  _mm_storeu_si128(reinterpret_cast<__m128i*>(p),
                   _mm_packus_epi16(reinterpret_cast<__m128i>(numbers.low), reinterpret_cast<__m128i>(numbers.high)));
#elif defined(__aarch64__)
  vst1q_u8(p, vcombine_u8(vmovn_u16(reinterpret_cast<uint16x8_t>(numbers.low)),
                          vmovn_u16(reinterpret_cast<uint16x8_t>(numbers.high))));
#else
  for (int i = 0; i < 8; ++i) {
    p[i] = static_cast<std::uint8_t>(numbers.low[i]);
    p[i + 8] = static_cast<std::uint8_t>(numbers.high[i]);
  }
#endif
}

#if !EAR_HAS_PICK
inline bool any(Eight16 a) {
#if defined(__SSE2__)
  return _mm_movemask_epi8(_mm_cmpeq_epi16(reinterpret_cast<__m128i>(a), _mm_setzero_si128())) != 0xffff;
#else
  std::int16_t all = 0;
  for (int i = 0; i < 8; ++i) all = static_cast<std::int16_t>(all | a[i]);
  return all != 0;
#endif
}
#endif

using Four16 = std::int16_t __attribute__((vector_size(8)));

inline Floats floats_at(const std::int16_t* p) {
#if defined(__SSE2__)
  const __m128i words = _mm_loadu_si128(reinterpret_cast<const __m128i*>(p));
  const Ints numbers{reinterpret_cast<Ints4>(_mm_unpacklo_epi16(words, words)),
                     reinterpret_cast<Ints4>(_mm_unpackhi_epi16(words, words))};
  return to_floats(numbers >> 16);
#else
  return to_floats(
      Ints{__builtin_convertvector(load<Four16>(p), Ints4), __builtin_convertvector(load<Four16>(p + 4), Ints4)});
#endif
}

#endif  // __AVX2__

}  // namespace ear::EAR_VARIANT
