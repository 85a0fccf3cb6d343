#include <doctest/doctest.h>

#include "src/recording/config_fields.h"
#include "src/recording/config_file.h"
#include "tests/recording/support.h"

using namespace ear;
using namespace ear::test;

namespace {

const fs::path kShipped = fs::path(EAR_SOURCE_DIR) / "config/default.yaml";

template <typename T>
constexpr bool kIsSettings = !std::is_arithmetic_v<T> && !std::is_enum_v<T>;

// Keys and values of all settings: "filter.prior.gyro_bias=0.1".
template <typename T>
void list_settings(const T& settings, const std::string& prefix, std::vector<std::string>& out) {
  visit(settings, [&](const char* key, const auto& field) {
    if constexpr (kIsSettings<std::decay_t<decltype(field)>>) {
      list_settings(field, prefix + key + ".", out);
    } else {
      std::ostringstream text;
      text.precision(17);
      text << prefix << key << "=";
      if constexpr (std::is_enum_v<std::decay_t<decltype(field)>>) {
        text << static_cast<int>(field);
      } else {
        text << field;
      }
      out.push_back(text.str());
    }
  });
}

std::vector<std::string> settings_of(const Config& config) {
  std::vector<std::string> out;
  list_settings(config, "", out);
  return out;
}

// The keys that the comment at the head of the file names: "#   filter.impact.accel_range    why".
std::vector<std::string> keys_at_head(const fs::path& file) {
  std::vector<std::string> keys;
  std::ifstream stream(file);
  for (std::string line; std::getline(stream, line) && !line.empty();) {
    std::istringstream words(line);
    std::string hash;
    std::string key;
    words >> hash >> key;
    if (line.rfind("#   ", 0) == 0) keys.push_back(key);
  }
  return keys;
}

// Changes every setting, so that a key that is not loaded or saved shows.
template <typename T>
void change_all(T& settings) {
  visit(settings, [](const char*, auto& field) {
    using Field = std::decay_t<decltype(field)>;
    if constexpr (kIsSettings<Field>) {
      change_all(field);
    } else if constexpr (std::is_same_v<Field, bool>) {
      field = !field;
    } else if constexpr (std::is_enum_v<Field>) {
      field = names_of(Field{}).front().second == field ? names_of(Field{}).back().second
                                                        : names_of(Field{}).front().second;
    } else {
      field = static_cast<Field>(field * 2 + 1);
    }
  });
}

// How many fields an aggregate has: as many as it can be initialised with.
struct Anything {
  template <typename T>
  operator T() const;  // NOLINT(google-explicit-constructor): it stands for a value of any type
};
template <typename T, typename Enable, typename... Values>
struct FieldCount : std::integral_constant<int, static_cast<int>(sizeof...(Values)) - 1> {};
template <typename T, typename... Values>
struct FieldCount<T, std::void_t<decltype(T{Values{}...})>, Values...> : FieldCount<T, void, Values..., Anything> {};

// Fields that no file sets: `kernels` are the processor's, and change no result.
template <typename T>
constexpr int kNotInFiles = 0;
template <>
constexpr int kNotInFiles<FrontendConfig> = 1;
template <>
constexpr int kNotInFiles<FilterConfig> = 1;

// Checks that visit() knows every field, here and below.
template <typename T>
void check_all_fields_visited(const std::string& name) {
  CAPTURE(name);
  int visited = 0;
  T settings{};
  visit(settings, [&](const char* key, auto& field) {
    ++visited;
    using Field = std::decay_t<decltype(field)>;
    if constexpr (kIsSettings<Field>) check_all_fields_visited<Field>(key);
  });
  CHECK(visited + kNotInFiles<T> == FieldCount<T, void>::value);
}

}  // namespace

TEST_CASE("config: every field of the settings has a key") { check_all_fields_visited<Config>("Config"); }

TEST_CASE("config: the shipped file states every setting and its default") {
  const std::vector<std::string> shipped = settings_of(load_config(kShipped));
  const std::vector<std::string> defaults = settings_of(Config{});
  REQUIRE(shipped.size() == defaults.size());
  for (std::size_t i = 0; i < shipped.size(); ++i) CHECK(shipped[i] == defaults[i]);
  // Each key stands in it: without its line, the file would not load another value for it.
  const std::string text = read_text(kShipped);
  for (const std::string& setting : settings_of(Config{})) {
    const std::string path = setting.substr(0, setting.find('='));
    CAPTURE(path);
    CHECK(contains(text, "  " + path.substr(path.rfind('.') + 1) + ":"));
  }
}

TEST_CASE("config: the keys that a new vehicle should look at exist, and the documentation explains them") {
  const std::vector<std::string> keys = keys_at_head(kShipped);
  CHECK((keys.size() >= 5 && keys.size() <= 7));
  const std::string documentation = read_text(fs::path(EAR_SOURCE_DIR) / "docs/recordings.md");
  for (const std::string& key : keys) {
    CAPTURE(key);
    const std::vector<std::string> settings = settings_of(Config{});
    CHECK(std::any_of(settings.begin(), settings.end(),
                      [&](const std::string& setting) { return setting.rfind(key + "=", 0) == 0; }));
    CHECK(contains(documentation, "`" + key + "`"));
  }
}

TEST_CASE("config: what is saved is loaded again") {
  const TempFolder folder;
  Config config;
  change_all(config);
  CHECK(settings_of(config) != settings_of(Config{}));
  save_config(config, folder / "config.yaml");
  CHECK(settings_of(load_config(folder / "config.yaml")) == settings_of(config));
}

TEST_CASE("config: keys may be left out") {
  const TempFolder folder;
  write_text(folder / "a.yaml", "filter:\n  window: 7\n");
  const Config config = load_config(folder / "a.yaml");
  CHECK(config.filter.window == 7);
  CHECK(config.filter.huber_px == Config{}.filter.huber_px);
  write_text(folder / "empty.yaml", "# nothing\n");
  CHECK(settings_of(load_config(folder / "empty.yaml")) == settings_of(Config{}));
}

TEST_CASE("config: errors name file, line and key") {
  const TempFolder folder;
  const auto error = [&](const std::string& text) {
    write_text(folder / "a.yaml", text);
    return input_error_of([&] { (void)load_config(folder / "a.yaml"); });
  };
  CHECK(contains(error("filter:\n  windw: 7\n"), "a.yaml:2: filter.windw: there is no such setting"));
  CHECK(contains(error("odometry: 7\n"), "a.yaml:1: odometry: there is no such setting"));
  CHECK(contains(error("filter:\n  window: many\n"), "a.yaml:2: filter.window: 'many' is not a whole number"));
  CHECK(contains(error("filter:\n  window: 7.5\n"), "a.yaml:2: filter.window: '7.5' is not a whole number"));
  CHECK(contains(error("filter:\n\n  huber_px: [1]\n"), "a.yaml:3: filter.huber_px: a list or map is not a number"));
  CHECK(contains(error("filter:\n  huber_px: .inf\n"), "a.yaml:2: filter.huber_px: '.inf' is not a finite number"));
  CHECK(contains(error("filter:\n  prior:\n    axle: -1e-3\n"), "a.yaml:3: filter.prior.axle: must not be negative"));
  CHECK(contains(error("filter:\n  online_calibration:\n    time_offset: 3\n"),
                 "a.yaml:3: filter.online_calibration.time_offset: '3' is not true or false"));
  CHECK(contains(error("filter: 3\n"), "a.yaml:1: filter: keys and values expected"));
  CHECK(contains(error("filter:\n  window: 7\n  window: 8\n"), "a.yaml:3: filter.window: stated twice"));
  CHECK(contains(error("filter: [\n"), "not valid YAML"));
  CHECK(contains(input_error_of([&] { (void)load_config(folder / "none.yaml"); }), "none.yaml"));
}
