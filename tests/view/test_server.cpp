// The view's server against well-meaning, slow and hostile peers. They speak by plain sockets.
#include <arpa/inet.h>
#include <doctest/doctest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "src/view/answers.h"
#include "src/view/page.h"
#include "src/view/server.h"

using namespace ear;
using namespace ear::view;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

namespace {

class Socket {
 public:
  explicit Socket(int port) : fd_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(port));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    connected_ = connect(fd_, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0;
  }
  ~Socket() { close(fd_); }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  Socket(Socket&&) = delete;
  Socket& operator=(Socket&&) = delete;

  [[nodiscard]] bool connected() const { return connected_; }
  void write(const std::string& text) const {
    std::size_t sent = 0;
    while (sent < text.size()) {
      const ssize_t count = send(fd_, text.data() + sent, text.size() - sent, MSG_NOSIGNAL);
      if (count <= 0) return;  // the other side has had enough: what tests of large requests want
      sent += static_cast<std::size_t>(count);
    }
  }
  /// All that comes until the other side closes, or nothing comes for a while.
  [[nodiscard]] std::string read(milliseconds patience = milliseconds(4000)) const {
    std::string text;
    std::vector<char> buffer(65536);
    pollfd wanted{fd_, POLLIN, 0};
    while (poll(&wanted, 1, static_cast<int>(patience.count())) > 0) {
      const ssize_t count = recv(fd_, buffer.data(), buffer.size(), 0);
      if (count <= 0) break;
      text.append(buffer.data(), static_cast<std::size_t>(count));
    }
    return text;
  }

 private:
  int fd_;
  bool connected_ = false;
};

std::string get(const std::string& target, const std::string& headers = "", const std::string& host = "localhost") {
  return "GET " + target + " HTTP/1.1\r\nHost: " + host + "\r\nConnection: close\r\n" + headers + "\r\n";
}

std::string ask(int port, const std::string& request) {
  const Socket socket(port);
  socket.write(request);
  return socket.read();
}

int status_of(const std::string& answer) {
  return answer.rfind("HTTP/1.1 ", 0) == 0 ? std::stoi(answer.substr(9, 3)) : 0;
}

/// A feed with some moments and a large image, and its server.
struct Served {
  explicit Served(const std::string& token = "") : feed(Description{}), server({"127.0.0.1", 0, token}, feed) {
    for (int i = 0; i < 3; ++i) {
      Moment moment;
      moment.left = {pixels->data(), 640, 480, 640};
      moment.pixels = pixels;
      feed.offer(moment);
      feed.finish();
    }
  }
  [[nodiscard]] int port() const { return server.port(); }

  std::shared_ptr<std::vector<std::uint8_t>> pixels = noise();
  Feed feed;
  Server server;

 private:
  static std::shared_ptr<std::vector<std::uint8_t>> noise() {
    auto made = std::make_shared<std::vector<std::uint8_t>>(640 * 480);
    std::uint32_t value = 1;
    for (std::uint8_t& pixel : *made)
      pixel = static_cast<std::uint8_t>((value = value * 1664525U + 1013904223U) >> 24U);
    return made;
  }
};

}  // namespace

TEST_CASE("server: the page and what it asks for") {
  const Served served;
  const std::string page = ask(served.port(), get("/"));
  CHECK(status_of(page) == 200);
  CHECK(page.find("<canvas id=\"above\"") != std::string::npos);
  CHECK(page.find("Content-Security-Policy") != std::string::npos);
  CHECK(page.size() < 300'000);
  CHECK(view::page().find("view.css") == std::string::npos);  // it is in one piece
  CHECK(ask(served.port(), get("/about?viewer=a")).find("\"sources\"") != std::string::npos);
  CHECK(ask(served.port(), get("/moments?viewer=a&n=1")).find("\"n\":3") != std::string::npos);
  CHECK(ask(served.port(), get("/moments?viewer=a&n=1")).find("\"n\":1,") == std::string::npos);
  CHECK(ask(served.port(), get("/image?viewer=a&n=2")).find("image/jpeg") != std::string::npos);
  CHECK(status_of(ask(served.port(), get("/features?viewer=a&n=2"))) == 200);
  CHECK(status_of(ask(served.port(), get("/path?viewer=a"))) == 200);
  CHECK(served.server.counts().refused == 0);
  CHECK(served.server.counts().answered == 7);
}

TEST_CASE("server: what is malformed, unknown, too large or would change something is refused and counted") {
  const Served served;
  const std::vector<std::pair<std::string, int>> requests{
      {get("/../../etc/passwd"), 404},
      {get("/..%2f..%2fetc/passwd"), 404},
      {get("/%2e%2e/%2e%2e/etc/passwd"), 404},
      {get("//etc/passwd"), 404},
      {get("/image?viewer=a&n=99"), 404},
      {get("/image?viewer=a&n=-1"), 400},
      {get("/image?viewer=a&n=1e3"), 400},
      {get("/image?viewer=a&n=99999999999999999999"), 400},
      {get("/image?viewer=a"), 400},
      {get("/moments?n=0"), 400},
      {get("/moments?viewer=<script>&n=0"), 400},
      {get("/moments?viewer=" + std::string(33, 'a') + "&n=0"), 400},
      {get("/", "", "evil.example"), 403},
      {get("/", "", "localhost.evil.example"), 403},
      {"POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 5\r\n\r\nhello", 405},
      {"PUT /moments HTTP/1.1\r\nHost: localhost\r\nContent-Length: 0\r\n\r\n", 405},
      {"DELETE / HTTP/1.1\r\nHost: localhost\r\n\r\n", 405},
      {"nonsense\r\n\r\n", 400},
      {"GET / HTTP/9.9\r\n\r\n", 400},
      {std::string("\0\1\2\3\r\n\r\n", 8), 400},
      {"GET /" + std::string(9000, 'a') + " HTTP/1.1\r\nHost: localhost\r\n\r\n", 414},
      {get("/", "X-Large: " + std::string(40'000, 'x') + "\r\n"), 400},
  };
  for (const auto& [request, status] : requests) {
    const std::string first = request.substr(0, 60);
    CAPTURE(first);
    const std::uint64_t before = served.server.counts().refused;
    const std::string answer = ask(served.port(), request);
    CHECK(status_of(answer) == status);
    CHECK(answer.find("root:") == std::string::npos);
    CHECK(served.server.counts().refused == before + 1);
  }
  CHECK(status_of(ask(served.port(), get("/"))) == 200);
}

TEST_CASE("server: many headers, many ranges and compression are no way to a huge answer") {
  const Served served;
  std::string headers;
  for (int i = 0; i < 3000; ++i) headers += "X-" + std::to_string(i) + ": y\r\n";
  CHECK(status_of(ask(served.port(), get("/", headers))) == 400);
  std::string ranges = "Range: bytes=0-";
  for (int i = 0; i < 1000; ++i) ranges += ",0-";
  const std::string answer =
      ask(served.port(), get("/image?viewer=a&n=1", ranges + "\r\nAccept-Encoding: br, gzip\r\n"));
  CHECK(status_of(answer) == 200);
  CHECK(answer.size() < 400'000);
  CHECK(answer.find("Content-Encoding") == std::string::npos);
}

TEST_CASE("server: with a token, nobody without it gets anything") {
  const std::string token = "correct-horse-9";
  const Served served(token);
  for (const char* const wrong : {"", "?token=", "?token=correct-horse-", "?token=correct-horse-9x",
                                  "?token=Correct-horse-9", "?token=correct-horse-9correct-horse-9"}) {
    CAPTURE(wrong);
    CHECK(status_of(ask(served.port(), get(std::string("/") + wrong))) == 401);
  }
  CHECK(served.server.counts().refused == 6);
  CHECK(status_of(ask(served.port(), get("/?token=" + token, "", "vehicle.local:8080"))) == 200);
  CHECK(status_of(ask(served.port(), get("/", "Authorization: Bearer " + token + "\r\n"))) == 200);
  CHECK(status_of(ask(served.port(), get("/moments?viewer=a&n=0&token=" + token))) == 200);
}

TEST_CASE("server: an address that others reach needs a token, and a port that is taken is an error") {
  const Feed feed(Description{});
  CHECK_THROWS_AS(Server({"0.0.0.0", 0, ""}, feed), std::invalid_argument);
  const Server first({"127.0.0.1", 0, ""}, feed);
  CHECK_THROWS_AS(Server({"127.0.0.1", first.port(), ""}, feed), std::runtime_error);
  CHECK(is_loopback("127.0.0.1"));
  CHECK_FALSE(is_loopback("192.168.0.7"));
}

TEST_CASE("server: the ninth viewer is told so, until one of the eight has gone") {
  Viewers viewers;
  const Viewers::Time start{};
  for (char name = 'a'; name < 'i'; ++name) CHECK(viewers.admit(std::string(1, name), start));
  CHECK_FALSE(viewers.admit("i", start));
  CHECK(viewers.admit("a", start + Viewers::kGone));
  CHECK(viewers.count(start + Viewers::kGone + milliseconds(1)) == 1);
  CHECK(viewers.admit("i", start + Viewers::kGone + milliseconds(1)));

  const Served served;
  for (int i = 0; i < 8; ++i) CHECK(status_of(ask(served.port(), get("/about?viewer=v" + std::to_string(i)))) == 200);
  CHECK(status_of(ask(served.port(), get("/about?viewer=v8"))) == 503);
}

TEST_CASE("server: a connection that says nothing, or half a request, ends; others are answered meanwhile") {
  const Served served;
  const Socket silent(served.port());
  const Socket half(served.port());
  half.write("GET / HTTP/1.1\r\nHost: local");
  const auto start = steady_clock::now();
  CHECK(status_of(ask(served.port(), get("/"))) == 200);
  CHECK(steady_clock::now() - start < milliseconds(1500));
  const std::string end = half.read(milliseconds(6000));
  CHECK((status_of(end) == 400 || end.empty()));
  CHECK(steady_clock::now() - start < milliseconds(5000));
}

TEST_CASE("server: who never reads is cut off, and counted") {
  const Served served;
  const Socket greedy(served.port());
  std::string many;
  for (int i = 0; i < 400; ++i) many += "GET /image?viewer=a&n=1 HTTP/1.1\r\nHost: localhost\r\n\r\n";
  greedy.write(many);
  const auto start = steady_clock::now();
  while (served.server.counts().cut_off == 0 && steady_clock::now() - start < milliseconds(10'000)) {
    std::this_thread::sleep_for(milliseconds(20));
  }
  CHECK(served.server.counts().cut_off == 1);
  CHECK(status_of(ask(served.port(), get("/"))) == 200);
}

TEST_CASE("server: a thousand connections at once are bounded, counted, and soon over") {
  rlimit files{};
  getrlimit(RLIMIT_NOFILE, &files);
  files.rlim_cur = std::min<rlim_t>(files.rlim_max, 4096);
  setrlimit(RLIMIT_NOFILE, &files);
  const Served served;
  std::vector<std::unique_ptr<Socket>> crowd;
  for (int i = 0; i < 1000; ++i) crowd.push_back(std::make_unique<Socket>(served.port()));
  const auto start = steady_clock::now();
  while (served.server.counts().crowded < 500 && steady_clock::now() - start < milliseconds(10'000)) {
    std::this_thread::sleep_for(milliseconds(20));
  }
  CHECK(served.server.counts().crowded >= 500);  // the others came in as silent ones were given up
  crowd.clear();
  std::this_thread::sleep_for(milliseconds(300));
  CHECK(status_of(ask(served.port(), get("/"))) == 200);
}

TEST_CASE("feed: the one who offers never waits, and what is too much is dropped and counted") {
  Feed feed(Description{});
  auto pixels = std::make_shared<std::vector<std::uint8_t>>(4000 * 3000, 100);
  Moment moment;
  moment.left = {pixels->data(), 4000, 3000, 4000};
  moment.pixels = pixels;
  CHECK(feed.due());
  const auto start = steady_clock::now();
  for (int i = 0; i < 50; ++i) feed.offer(moment);
  CHECK(steady_clock::now() - start < milliseconds(50));
  CHECK(feed.dropped() >= 45);
  CHECK_FALSE(feed.due());
  feed.finish();
  CHECK(feed.ended());
  CHECK(feed.history().find(1).has_value());
  CHECK(pixels.use_count() == 2);  // ours and the moment's: nothing is held longer than needed
}
