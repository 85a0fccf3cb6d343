// Serves the view: one page, and what it asks for. docs/view.md has what is refused.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "src/view/feed.h"

namespace ear::view {

struct ServerOptions {
  std::string address = "127.0.0.1";
  int port = 0;       ///< 0: any that is free
  std::string token;  ///< who does not know it is refused; needed where others can reach the address
};

/// What came since the start.
struct ServerCounts {
  std::uint64_t answered = 0;
  std::uint64_t refused = 0;  ///< by a status from 400 on: malformed, too large, without token, unknown, too many
  std::uint64_t crowded = 0;  ///< connections closed at once, as too many wait
  std::uint64_t cut_off = 0;  ///< connections closed as the peer did not read in time
};

class Server {
 public:
  /// `feed` must outlive it. Throws std::invalid_argument for an address that others reach without a token, and
  /// std::runtime_error where it cannot listen.
  Server(const ServerOptions& options, const Feed& feed);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;
  Server(Server&&) = delete;
  Server& operator=(Server&&) = delete;

  [[nodiscard]] int port() const;
  [[nodiscard]] ServerCounts counts() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ear::view
