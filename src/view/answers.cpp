#include "src/view/answers.h"

#include <algorithm>
#include <utility>

#include "src/view/page.h"

namespace ear::view {
namespace {

using std::chrono::steady_clock;

Answer refuse(int status, const std::string& why) { return {status, "text/plain; charset=utf-8", why + "\n"}; }
Answer json(std::string body) { return {200, "application/json", std::move(body)}; }

/// Takes as long wherever they differ.
bool same(const std::string& given, const std::string& wanted) {
  std::size_t different = given.size() ^ wanted.size();
  for (std::size_t i = 0; i < given.size(); ++i) {
    different |= static_cast<unsigned char>(given[i] ^ (wanted.empty() ? 0 : wanted[i % wanted.size()]));
  }
  return different == 0;
}

/// A name without the port: "[::1]:8080" -> "::1".
std::string without_port(const std::string& host) {
  if (!host.empty() && host.front() == '[') return host.substr(1, host.find(']') - 1);
  return host.substr(0, host.find(':'));
}

bool is_name(const std::string& viewer) {
  constexpr std::size_t kLongest = 32;
  return !viewer.empty() && viewer.size() <= kLongest && std::all_of(viewer.begin(), viewer.end(), [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z');
  });
}

}  // namespace

std::optional<std::uint64_t> number_in(const std::string& text) {
  constexpr std::size_t kMostDigits = 18;
  if (text.empty() || text.size() > kMostDigits) return std::nullopt;
  if (!std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; })) return std::nullopt;
  return std::stoull(text);
}

bool is_loopback(const std::string& address) {
  return address == "localhost" || address == "::1" || address.rfind("127.", 0) == 0;
}

bool Viewers::admit(const std::string& viewer, Time now) {
  const std::lock_guard lock(mutex_);
  for (auto it = last_seen_.begin(); it != last_seen_.end();) {
    it = now - it->second > kGone ? last_seen_.erase(it) : std::next(it);
  }
  if (last_seen_.count(viewer) == 0 && last_seen_.size() >= kMost) return false;
  last_seen_[viewer] = now;
  return true;
}

std::size_t Viewers::count(Time now) const {
  const std::lock_guard lock(mutex_);
  return static_cast<std::size_t>(std::count_if(last_seen_.begin(), last_seen_.end(),
                                                [&](const auto& viewer) { return now - viewer.second <= kGone; }));
}

std::optional<Answer> Answers::refusal(const Request& request) const {
  if (request.method != "GET" && request.method != "HEAD") return refuse(405, "only GET: nothing can be changed here");
  if (token_.empty() && !is_loopback(without_port(request.host))) {
    return refuse(403, "without a token only requests to localhost are answered");
  }
  if (!token_.empty() && !same(request.token, token_)) return refuse(401, "the token is missing or wrong");
  return std::nullopt;
}

Answer Answers::to(const Request& request) {
  if (const auto refused = refusal(request)) return *refused;
  if (request.path == "/") return {200, "text/html; charset=utf-8", page()};
  const auto viewer = request.query.find("viewer");
  const bool known = request.path == "/about" || request.path == "/path" || request.path == "/moments" ||
                     request.path == "/features" || request.path == "/image";
  if (!known) return refuse(404, "there is no such page");
  if (viewer == request.query.end() || !is_name(viewer->second)) return refuse(400, "viewer: letters a-z and digits");
  if (!viewers_.admit(viewer->second, steady_clock::now())) {
    return refuse(503, "there are " + std::to_string(Viewers::kMost) + " viewers already");
  }
  return data(request);
}

Answer Answers::data(const Request& request) const {
  if (request.path == "/about") return json(feed_.description());
  if (request.path == "/path") return json(feed_.history().path());
  const auto given = request.query.find("n");
  const std::optional<std::uint64_t> n = given == request.query.end() ? std::nullopt : number_in(given->second);
  if (!n) return refuse(400, "n: a number");
  if (request.path == "/moments") {
    return json("{\"ended\":" + std::string(feed_.ended() ? "true" : "false") +
                ",\"viewers\":" + std::to_string(viewers()) + ",\"dropped\":" + std::to_string(feed_.dropped()) +
                ",\"refused\":" + counts_() + ",\"moments\":" + feed_.history().summaries_after(*n) + "}");
  }
  const std::optional<Entry> entry = feed_.history().find(*n);
  if (!entry) return refuse(404, "this moment is not kept (any more)");
  if (request.path == "/features") return json(*entry->features);
  const auto camera = request.query.find("camera");
  const Text& image = camera != request.query.end() && camera->second == "right" ? entry->right : entry->image;
  if (!image) return refuse(404, "there is no image of this moment");
  return {200, "image/jpeg", *image};
}

}  // namespace ear::view
