#include "src/ros2/sha256.h"

#include <cmath>
#include <cstddef>

namespace ear::ros2 {
namespace {

using Words = std::array<std::uint32_t, 64>;

/// The first 32 bits behind the point of a root that is below 2^6.
std::uint32_t fraction_bits(double root) {
  return static_cast<std::uint32_t>((root - std::floor(root)) * 4294967296.0);
}

/// FIPS 180-4, 4.2.2 and 5.3.3: from the roots of the first primes, which a double holds to 46 bits behind the point.
struct Constants {
  Constants() {
    std::size_t count = 0;
    for (std::uint32_t n = 2; count < rounds.size(); ++n) {
      bool prime = true;
      for (std::uint32_t d = 2; d * d <= n; ++d) prime = prime && n % d != 0;
      if (!prime) continue;
      if (count < start.size()) start[count] = fraction_bits(std::sqrt(static_cast<double>(n)));
      rounds[count++] = fraction_bits(std::cbrt(static_cast<double>(n)));
    }
  }
  std::array<std::uint32_t, 8> start{};
  Words rounds{};
};

std::uint32_t turned(std::uint32_t x, unsigned bits) { return x >> bits | x << (32U - bits); }

/// The message with a one, zeros and its length in bits: whole blocks of 64 bytes.
std::string padded(const std::string& message) {
  std::string text = message + '\x80';
  text.append((64 + 56 - text.size() % 64) % 64, '\0');
  const std::uint64_t bits = 8 * std::uint64_t{message.size()};
  for (unsigned shift = 64; shift > 0; shift -= 8) text += static_cast<char>(bits >> (shift - 8U) & 0xFFU);
  return text;
}

/// The message schedule of the block that begins at `block`.
Words schedule(const char* block) {
  Words w{};
  for (std::size_t i = 0; i < 64; ++i) w[i / 4] = w[i / 4] << 8U | static_cast<std::uint8_t>(block[i]);
  for (std::size_t t = 16; t < 64; ++t) {
    const std::uint32_t a = w[t - 15], b = w[t - 2];
    w[t] = w[t - 16] + (turned(a, 7) ^ turned(a, 18) ^ a >> 3U) + w[t - 7] + (turned(b, 17) ^ turned(b, 19) ^ b >> 10U);
  }
  return w;
}

void digest(const Words& w, const Words& rounds, std::array<std::uint32_t, 8>& hash) {
  auto [a, b, c, d, e, f, g, h] = hash;
  for (std::size_t t = 0; t < 64; ++t) {
    const std::uint32_t one =
        h + (turned(e, 6) ^ turned(e, 11) ^ turned(e, 25)) + ((e & f) ^ (~e & g)) + rounds[t] + w[t];
    const std::uint32_t two = (turned(a, 2) ^ turned(a, 13) ^ turned(a, 22)) + ((a & b) ^ (a & c) ^ (b & c));
    h = g, g = f, f = e, e = d + one, d = c, c = b, b = a, a = one + two;
  }
  const std::array<std::uint32_t, 8> more{a, b, c, d, e, f, g, h};
  for (std::size_t i = 0; i < more.size(); ++i) hash[i] += more[i];
}

}  // namespace

std::array<std::uint8_t, 32> sha256(const std::string& message) {
  const Constants constants;
  std::array<std::uint32_t, 8> hash = constants.start;
  const std::string text = padded(message);
  for (std::size_t at = 0; at < text.size(); at += 64) digest(schedule(text.data() + at), constants.rounds, hash);
  std::array<std::uint8_t, 32> bytes{};
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    bytes[i] = static_cast<std::uint8_t>(hash[i / 4] >> (24U - 8U * (i % 4)));
  }
  return bytes;
}

}  // namespace ear::ros2
