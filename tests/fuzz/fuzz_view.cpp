// What the view makes of a request: lines for method, path, host, token, then name and value of each parameter.
// Whatever is asked, the answer is one of few, nobody without the token gets anything, and no more than eight viewers
// are let in.
#include <set>
#include <string>
#include <vector>

#include "src/view/answers.h"
#include "tests/fuzz/support.h"

namespace {

std::vector<std::string> lines_of(const std::uint8_t* data, std::size_t size) {
  std::vector<std::string> lines(1);
  for (std::size_t i = 0; i < size; ++i) {
    if (data[i] == '\n') {
      lines.emplace_back();
    } else {
      lines.back() += static_cast<char>(data[i]);
    }
  }
  return lines;
}

void ask(ear::view::Answers& answers, const ear::view::Request& request, const std::string& token) {
  const ear::view::Answer answer = answers.to(request);
  const std::set<int> known{200, 400, 401, 403, 404, 405, 503};
  ear::fuzz::require(known.count(answer.status) == 1, "the status is a known one");
  ear::fuzz::require(answer.status != 200 || request.token == token || token.empty(), "no answer without the token");
  ear::fuzz::require(answer.status == 200 || answer.body.size() < 200, "a refusal is short");
  ear::fuzz::require(answers.viewers() <= ear::view::Viewers::kMost, "no more than eight viewers");
}

}  // namespace

// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer's name
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const ear::view::Feed kFeed{ear::view::Description{}};
  const auto counts = [] { return std::string("0"); };
  ear::view::Answers open(kFeed, "", counts), closed(kFeed, "correct-horse-9", counts);
  const std::vector<std::string> lines = lines_of(data, size);
  ear::view::Request request;
  const auto line = [&](std::size_t i) { return i < lines.size() ? lines[i] : std::string(); };
  request = {line(0), line(1), line(2), line(3), {}};
  for (std::size_t i = 4; i + 1 < lines.size(); i += 2) request.query[lines[i]] = lines[i + 1];
  ask(open, request, "");
  ask(closed, request, "correct-horse-9");
  for (int viewer = 0; viewer < 12; ++viewer) {
    request.query["viewer"] = std::string(1, static_cast<char>('a' + viewer));
    ask(open, request, "");
  }
  return 0;
}
