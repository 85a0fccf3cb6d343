#include "src/view/server.h"

#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>

#include "src/view/answers.h"
#include "src/view/connection.h"
#include "src/view/workers.h"

namespace ear::view {
namespace {

constexpr std::chrono::seconds kKeepAlive{5};
constexpr int kMostRequests = 10'000;  // of one connection

/// httplib parses requests and writes answers; connections are ours, within bounds.
class Http final : public httplib::Server {
 public:
  explicit Http(Answers& answers) {
    new_task_queue = [] { return new Workers; };
    set_pre_routing_handler([&answers](const httplib::Request& request, httplib::Response& response) {
      const Answer answer = answers.to(parts_of(request));
      response.status = answer.status;
      response.set_header("Cache-Control", "no-store");
      response.set_header("X-Content-Type-Options", "nosniff");
      response.set_header("Referrer-Policy", "no-referrer");
      response.set_header(
          "Content-Security-Policy",
          "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src 'self' "
          "blob: data:; connect-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'");
      response.set_content(answer.body, answer.type);
      return HandlerResponse::Handled;
    });
    set_socket_options([](socket_t socket) {  // a port that another process has is an error
      const int yes = 1;
      setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    });
  }

  void accept_here() { accepting_ = std::this_thread::get_id(); }
  [[nodiscard]] ServerCounts counts() const { return {answered_, refused_, crowded_, cut_off_}; }

 private:
  static Request parts_of(const httplib::Request& given) {
    Request request{given.method, given.path, given.get_header_value("Host"), "", {}};
    for (const auto& [name, value] : given.params) request.query.emplace(name, value);
    const std::string bearer = "Bearer ", header = given.get_header_value("Authorization");
    if (header.rfind(bearer, 0) == 0) request.token = header.substr(bearer.size());
    if (request.token.empty() && given.has_param("token")) request.token = given.get_param_value("token");
    return request;
  }

  bool process_and_close_socket(socket_t socket) override {
    if (std::this_thread::get_id() == accepting_) {
      ++crowded_;  // Workers has no room for it
    } else {
      serve(socket);
    }
    ::shutdown(socket, SHUT_RDWR);
    ::close(socket);
    return true;
  }

  void serve(socket_t socket) {
    Connection connection(socket);
    const auto running = [this] { return svr_sock_ != INVALID_SOCKET; };
    for (int i = 0; i < kMostRequests && running(); ++i) {
      if (!connection.wait_for_request(kKeepAlive, running)) return;
      bool closed = false;
      const bool written = process_request(connection, i + 1 == kMostRequests, closed, [](httplib::Request& request) {
        request.ranges.clear();  // many ranges of one image would make a huge answer
        request.headers.erase("Accept-Encoding");
      });
      if (connection.too_slow()) ++cut_off_;
      if (connection.status() >= 400) ++refused_;
      if (connection.status() == 200) ++answered_;
      if (!written || closed || connection.status() != 200) return;
    }
  }

  std::thread::id accepting_;
  std::atomic<std::uint64_t> answered_ = 0, refused_ = 0, crowded_ = 0, cut_off_ = 0;
};

}  // namespace

class Server::Impl {
 public:
  Impl(const ServerOptions& options, const Feed& feed)
      : answers_(feed, options.token, [this] { return std::to_string(refused()); }), http_(answers_) {
    if (options.token.empty() && !is_loopback(options.address)) {
      throw std::invalid_argument("view: others can reach " + options.address + ", so a token is needed");
    }
    port_ = options.port;
    if (options.port == 0) {
      port_ = http_.bind_to_any_port(options.address);
    } else if (!http_.bind_to_port(options.address, options.port)) {
      port_ = -1;
    }
    if (port_ < 0) {
      throw std::runtime_error("view: cannot listen on " + options.address + ":" + std::to_string(options.port));
    }
    thread_ = std::thread([this] {  // of ordinary priority: it has next to nothing to do, but at once
      http_.accept_here();
      http_.listen_after_bind();
      ended_ = true;
    });
  }

  ~Impl() {
    while (!http_.is_running() && !ended_) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    http_.stop();
    thread_.join();
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  Impl(Impl&&) = delete;
  Impl& operator=(Impl&&) = delete;

  [[nodiscard]] int port() const { return port_; }
  [[nodiscard]] ServerCounts counts() const { return http_.counts(); }

 private:
  [[nodiscard]] std::uint64_t refused() const { return counts().refused + counts().crowded + counts().cut_off; }

  Answers answers_;
  Http http_;
  int port_ = -1;
  std::atomic<bool> ended_ = false;
  std::thread thread_;
};

Server::Server(const ServerOptions& options, const Feed& feed) : impl_(std::make_unique<Impl>(options, feed)) {}
Server::~Server() = default;
int Server::port() const { return impl_->port(); }
ServerCounts Server::counts() const { return impl_->counts(); }

}  // namespace ear::view
