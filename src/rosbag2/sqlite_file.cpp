#include "src/rosbag2/sqlite_file.h"

#include <sqlite3.h>

#include <utility>

#include "src/recording/input_error.h"

namespace ear::rosbag2 {
namespace {

namespace fs = std::filesystem;

struct CloseDatabase {
  void operator()(sqlite3* database) const { sqlite3_close(database); }
};
struct EndStatement {
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};

/// A query on a connection of its own, so that each thread may have one.
class Query {
 public:
  Query(const fs::path& file, const std::string& text) : file_(file) {
    sqlite3* database = nullptr;
    const int opened = sqlite3_open_v2(file.c_str(), &database, SQLITE_OPEN_READONLY, nullptr);
    database_.reset(database);
    if (opened != SQLITE_OK) throw error();
    sqlite3_limit(database, SQLITE_LIMIT_LENGTH, static_cast<int>(kLargestPiece));
    sqlite3_stmt* statement = nullptr;
    const int prepared = sqlite3_prepare_v2(database, text.c_str(), -1, &statement, nullptr);
    statement_.reset(statement);
    if (prepared != SQLITE_OK) throw error();
  }

  void bind(const std::string& value) {
    if (sqlite3_bind_text(statement_.get(), 1, value.data(), static_cast<int>(value.size()), SQLITE_TRANSIENT) !=
        SQLITE_OK) {
      throw error();
    }
  }
  /// False at the end. Throws InputError for a damaged file.
  bool step() {
    const int result = sqlite3_step(statement_.get());
    if (result != SQLITE_ROW && result != SQLITE_DONE) throw error();
    return result == SQLITE_ROW;
  }
  [[nodiscard]] std::int64_t number(int column) { return sqlite3_column_int64(statement_.get(), column); }
  [[nodiscard]] std::string text(int column) {
    const auto* const begin = reinterpret_cast<const char*>(sqlite3_column_text(statement_.get(), column));
    return begin == nullptr ? std::string() : std::string(begin);
  }
  [[nodiscard]] std::vector<std::uint8_t> bytes(int column) {
    const auto* const begin = static_cast<const std::uint8_t*>(sqlite3_column_blob(statement_.get(), column));
    const int size = sqlite3_column_bytes(statement_.get(), column);
    return begin == nullptr ? std::vector<std::uint8_t>() : std::vector<std::uint8_t>(begin, begin + size);
  }

 private:
  [[nodiscard]] InputError error() const {
    return InputError(located(file_, 0, "", std::string("sqlite3: ") + sqlite3_errmsg(database_.get())));
  }

  fs::path file_;
  std::unique_ptr<sqlite3, CloseDatabase> database_;
  std::unique_ptr<sqlite3_stmt, EndStatement> statement_;
};

const std::string kMessages =
    "SELECT messages.timestamp, messages.data FROM messages WHERE messages.topic_id IN "
    "(SELECT id FROM topics WHERE name = ?1) ORDER BY messages.id";

class SqliteCursor : public TopicCursor {
 public:
  SqliteCursor(const fs::path& file, const std::string& topic, const std::string& query) : query_(file, query) {
    query_.bind(topic);
  }

  std::optional<BagMessage> next(Warnings& warnings) override {
    if (ended_) return std::nullopt;
    try {
      if (query_.step()) {
        auto bytes = std::make_shared<const std::vector<std::uint8_t>>(query_.bytes(1));
        return BagMessage{query_.number(0), {bytes->data(), bytes->size()}, bytes};
      }
    } catch (const InputError& error) {
      warnings.add("bag: torn", error.what());
    }
    ended_ = true;
    return std::nullopt;
  }

 private:
  Query query_;
  bool ended_ = false;
};

class SqliteFile : public BagFile {
 public:
  explicit SqliteFile(const fs::path& file) : file_(file) {
    if (!fs::is_regular_file(file)) throw InputError(located(file, 0, "", "no such file"));
    Query query(file, "SELECT name, type, serialization_format FROM topics ORDER BY id");
    while (query.step()) topics_.push_back({query.text(0), ros2::canonical_type(query.text(1)), query.text(2), {}});
  }

  const std::vector<BagTopic>& topics() const override { return topics_; }
  std::unique_ptr<TopicCursor> open(const std::string& topic) const override {
    return std::make_unique<SqliteCursor>(file_, topic, kMessages);
  }
  std::optional<BagMessage> last(const std::string& topic) const override {
    Warnings ignored;  // the reading itself reports them
    return SqliteCursor(file_, topic, kMessages + " DESC LIMIT 1").next(ignored);
  }

 private:
  fs::path file_;
  std::vector<BagTopic> topics_;
};

}  // namespace

std::unique_ptr<BagFile> open_sqlite(const fs::path& file) { return std::make_unique<SqliteFile>(file); }

}  // namespace ear::rosbag2
