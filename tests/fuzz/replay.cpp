// Runs a fuzz target without libFuzzer, in any build: on every file of the folders given, and on variants of each,
// always the same ones. An input that breaks the target is left in the working folder.
//
//   fuzz_csv VARIANTS FOLDER...
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <vector>

// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer's name
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

using Input = std::vector<std::uint8_t>;

constexpr std::size_t kLargest = 1U << 14U;
constexpr const char* kBroken = "broken_input";

Input current;  // a signal handler takes no arguments

/// Only what POSIX allows in a signal handler.
void keep_input(int signal) {
  const int file = open(kBroken, O_WRONLY | O_CREAT | O_TRUNC, 0644);
  if (file >= 0) {
    if (write(file, current.data(), current.size()) >= 0) close(file);
  }
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

std::vector<Input> read_all(const std::vector<std::filesystem::path>& folders) {
  std::vector<std::filesystem::path> files;
  for (const std::filesystem::path& folder : folders) {
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      if (entry.is_regular_file()) files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  std::vector<Input> inputs;
  for (const std::filesystem::path& path : files) {
    std::ifstream file(path, std::ios::binary);
    inputs.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  }
  return inputs;
}

class Variation {
 public:
  /// A few changes of bits, bytes and pieces, some of them from the other inputs.
  Input operator()(Input input, const std::vector<Input>& others) {
    for (std::size_t n = 1 + below(6); n > 0; --n) change(input, others[below(others.size())]);
    if (input.size() > kLargest) input.resize(kLargest);
    return input;
  }

 private:
  std::size_t below(std::size_t n) { return static_cast<std::size_t>(engine_() % n); }

  void change(Input& input, const Input& other) {
    static const std::vector<std::uint8_t> kTelling{0,   1,   0x7f, 0x80, 0xff, 0xf0, '-',
                                                    '0', '9', '.',  'e',  ',',  ':',  '\n'};
    const std::size_t at = below(input.size() + 1);
    const auto place = [&input](std::size_t i) { return input.begin() + static_cast<std::ptrdiff_t>(i); };
    if (at == input.size()) {
      input.push_back(static_cast<std::uint8_t>(engine_()));
      return;
    }
    const std::size_t length = 1 + below(std::min<std::size_t>(input.size() - at, 32));
    switch (below(6)) {
      case 0:
        input[at] ^= static_cast<std::uint8_t>(1U << below(8));
        break;
      case 1:
        input[at] = static_cast<std::uint8_t>(engine_());
        break;
      case 2:
        input[at] = kTelling[below(kTelling.size())];
        break;
      case 3:
        input.erase(place(at), place(at + length));
        break;
      case 4: {
        const Input piece(place(at), place(at + length));
        input.insert(place(below(input.size() + 1)), piece.begin(), piece.end());
        break;
      }
      default:
        if (other.empty()) break;
        const std::size_t from = below(other.size());
        const std::size_t to = from + 1 + below(std::min<std::size_t>(other.size() - from, 64));
        input.insert(place(at), other.begin() + static_cast<std::ptrdiff_t>(from),
                     other.begin() + static_cast<std::ptrdiff_t>(to));
        break;
    }
  }

  std::mt19937_64 engine_{1};
};

void run(const Input& input) {
  current = input;
  LLVMFuzzerTestOneInput(current.data(), current.size());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: %s VARIANTS FOLDER...\n", argv[0]);
    return 2;
  }
  for (const int signal : {SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL}) std::signal(signal, keep_input);
  const std::vector<Input> inputs = read_all({argv + 2, argv + argc});
  if (inputs.empty()) {
    std::fprintf(stderr, "no inputs\n");
    return 2;
  }
  const long variants = std::strtol(argv[1], nullptr, 10);
  Variation vary;
  for (const Input& input : inputs) {
    run(input);
    for (long i = 0; i < variants; ++i) run(vary(input, inputs));
  }
  std::printf("%zu inputs, %ld variants of each\n", inputs.size(), variants);
  return 0;
}
