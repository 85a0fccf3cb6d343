// What a request is answered with: who may ask, and the few things that there are. It changes nothing.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "src/view/feed.h"

namespace ear::view {

/// The parts of a request that are looked at.
struct Request {
  std::string method;
  std::string path;
  std::string host;   ///< the header
  std::string token;  ///< of the query or the header
  std::map<std::string, std::string> query;
};

struct Answer {
  int status = 200;
  std::string type = "text/plain; charset=utf-8";
  std::string body;
};

/// Of whoever asks; a viewer that is silent for some seconds is gone.
class Viewers {
 public:
  static constexpr std::size_t kMost = 8;
  static constexpr std::chrono::seconds kGone{5};
  using Time = std::chrono::steady_clock::time_point;

  /// May this one look? It then counts as there.
  [[nodiscard]] bool admit(const std::string& viewer, Time now);
  [[nodiscard]] std::size_t count(Time now) const;

 private:
  mutable std::mutex mutex_;
  std::map<std::string, Time> last_seen_;
};

class Answers {
 public:
  /// `token` is empty where none is needed: then only requests to this machine by its own names are answered.
  Answers(const Feed& feed, std::string token, std::function<std::string()> counts)
      : feed_(feed), token_(std::move(token)), counts_(std::move(counts)) {}

  [[nodiscard]] Answer to(const Request& request);
  [[nodiscard]] std::size_t viewers() const { return viewers_.count(std::chrono::steady_clock::now()); }

 private:
  [[nodiscard]] std::optional<Answer> refusal(const Request& request) const;
  [[nodiscard]] Answer data(const Request& request) const;

  const Feed& feed_;
  std::string token_;
  std::function<std::string()> counts_;
  Viewers viewers_;
};

/// A number as a query has it: digits alone, at most 18.
[[nodiscard]] std::optional<std::uint64_t> number_in(const std::string& text);

/// Addresses that only this machine reaches.
[[nodiscard]] bool is_loopback(const std::string& address);

}  // namespace ear::view
