#include "tools/experiments/seeds.h"

#include <stdexcept>

namespace ear::experiments {
namespace {

std::uint64_t parse_seed(const std::string& text) {
  if (text.empty() || text.find_first_not_of("0123456789") != std::string::npos) {
    throw std::invalid_argument("--seeds: '" + text + "' is no seed: a number, or two as in 501..505");
  }
  return std::stoull(text);
}

}  // namespace

std::vector<std::uint64_t> parse_seeds(const std::vector<std::string>& texts) {
  std::vector<std::uint64_t> seeds;
  for (const std::string& text : texts) {
    const std::size_t dots = text.find("..");
    const std::uint64_t first = parse_seed(text.substr(0, dots));
    const std::uint64_t last = dots == std::string::npos ? first : parse_seed(text.substr(dots + 2));
    for (std::uint64_t seed = first; seed <= last; ++seed) seeds.push_back(seed);
  }
  return seeds;
}

}  // namespace ear::experiments
