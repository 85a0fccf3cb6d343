#include "src/recording/yaml_map.h"

#include <Eigen/SVD>
#include <algorithm>
#include <fstream>
#include <set>
#include <sstream>
#include <utility>

namespace ear {
namespace {

constexpr double kRounding = 1e-3;  // a rotation written with four digits is not a mistake

std::size_t line_of(const YAML::Node& node) {
  const YAML::Mark mark = node.Mark();
  return mark.is_null() ? 0 : static_cast<std::size_t>(mark.line) + 1;
}

std::string read_text(const std::filesystem::path& file) {
  std::ifstream stream;
  if (std::filesystem::is_regular_file(file)) stream.open(file, std::ios::binary);
  if (!stream.is_open()) throw InputError(located(file, 0, "", "no such file, or it cannot be read"));
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

Eigen::Matrix3d without_rounding(const Eigen::Matrix3d& R) {
  if ((R.transpose() * R - Eigen::Matrix3d::Identity()).norm() > kRounding || R.determinant() < 0.0) return R;
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(R, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return svd.matrixU() * svd.matrixV().transpose();
}

}  // namespace

YamlMap YamlMap::load(const std::filesystem::path& file) {
  std::string text = read_text(file);
  if (text.rfind("%YAML:", 0) == 0) text[0] = '#';  // a comment keeps the numbers of the lines
  try {
    YAML::Node root = YAML::Load(text);
    if (root.IsNull()) root = YAML::Node(YAML::NodeType::Map);  // an empty file says nothing
    return {file, root, ""};
  } catch (const YAML::ParserException& problem) {
    const std::size_t line = problem.mark.is_null() ? 0 : static_cast<std::size_t>(problem.mark.line) + 1;
    throw InputError(located(file, line, "", "not valid YAML: " + problem.msg));
  }
}

YamlMap::YamlMap(std::filesystem::path file, const YAML::Node& node, std::string prefix)
    : file_(std::move(file)), node_(node), prefix_(std::move(prefix)) {
  if (node_.IsMap()) return;
  const std::string key = prefix_.empty() ? "" : prefix_.substr(0, prefix_.size() - 1);
  throw InputError(located(file_, line_of(node_), key, "keys and values expected"));
}

std::optional<double> YamlMap::sigma(const std::string& key) const {
  if (!has(key)) return std::nullopt;
  const auto value = get<double>(key);
  if (!(value > 0.0)) throw error(key, shown(node_[key]) + " is not positive: it is a standard deviation");
  return value;
}

std::vector<double> YamlMap::numbers(const std::string& key, std::size_t size) const {
  const YAML::Node list = required(key);
  if (!list.IsSequence()) throw error_at(list, key, "a list of numbers expected");
  std::vector<double> values;
  for (const YAML::Node& item : list) values.push_back(convert<double>(item, key));
  if (size > 0 && values.size() != size) {
    throw error_at(list, key, std::to_string(values.size()) + " numbers, not " + std::to_string(size));
  }
  return values;
}

std::vector<std::string> YamlMap::texts(const std::string& key) const {
  const YAML::Node list = required(key);
  if (!list.IsSequence()) throw error_at(list, key, "a list of texts expected");
  std::vector<std::string> values;
  for (const YAML::Node& item : list) values.push_back(convert<std::string>(item, key));
  return values;
}

Eigen::Vector3d YamlMap::vector3(const std::string& key) const {
  const std::vector<double> v = numbers(key, 3);
  return {v[0], v[1], v[2]};
}

Eigen::Isometry3d YamlMap::pose(const std::string& key) const {
  const YAML::Node value = required(key);
  const YAML::Node list = value.IsMap() ? value["data"] : value;
  if (!list || !list.IsSequence()) throw error_at(value, key, "a 4x4 matrix expected");

  std::vector<double> entries;
  for (const YAML::Node& item : list) {
    if (item.IsSequence()) {
      for (const YAML::Node& entry : item) entries.push_back(convert<double>(entry, key));
    } else {
      entries.push_back(convert<double>(item, key));
    }
  }
  if (entries.size() != 16) throw error_at(list, key, std::to_string(entries.size()) + " numbers, not 16");

  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> T(entries.data());
  if ((T.row(3) - Eigen::RowVector4d::UnitW()).norm() > 1e-9) throw error_at(list, key, "last row is not 0, 0, 0, 1");
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = without_rounding(T.topLeftCorner<3, 3>());
  pose.translation() = T.topRightCorner<3, 1>();
  return pose;
}

YamlMap YamlMap::child(const std::string& key) const { return {file_, required(key), prefix_ + key + "."}; }

std::vector<YamlMap> YamlMap::children(const std::string& key) const {
  const YAML::Node list = required(key);
  if (!list.IsSequence()) throw error_at(list, key, "a list expected");
  std::vector<YamlMap> maps;
  for (const YAML::Node& item : list) {
    maps.emplace_back(file_, item, prefix_ + key + "[" + std::to_string(maps.size()) + "].");
  }
  return maps;
}

void YamlMap::require_only(const std::vector<std::string>& known) const {
  std::set<std::string> seen;
  for (const auto& entry : node_) {
    const std::string& key = entry.first.Scalar();
    if (!seen.insert(key).second) throw error_at(entry.first, key, "stated twice");
    if (std::find(known.begin(), known.end(), key) == known.end()) {
      throw error_at(entry.first, key, "there is no such setting");
    }
  }
}

InputError YamlMap::error(const std::string& key, const std::string& message) const {
  return error_at(has(key) ? node_[key] : node_, key, message);
}

YAML::Node YamlMap::required(const std::string& key) const {
  if (!has(key)) throw error(key, "missing");
  return node_[key];
}

InputError YamlMap::error_at(const YAML::Node& node, const std::string& key, const std::string& message) const {
  return InputError(located(file_, line_of(node), prefix_ + key, message));
}

}  // namespace ear
