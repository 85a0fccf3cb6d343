#include "tools/paper/catalogue.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <iterator>

#include "tools/paper/measure/configuration.h"

namespace ear::paper {
namespace {

using Texts = std::vector<std::string>;

bool contains(const Texts& list, const std::string& text) {
  return std::find(list.begin(), list.end(), text) != list.end();
}

Cell cell(const std::string& sequence, const std::string& configuration, Figure figure, double rate = 30.0) {
  return {{{sequence, rate, configuration}}, figure, {}};
}

/// Names in a table: "flat3" -> "Flat3".
std::string capital(std::string name) {
  name[0] = static_cast<char>(std::toupper(name[0]));
  return name;
}

/// The configurations that this program has, of those.
Texts built(const Texts& names) {
  Texts list;
  std::copy_if(names.begin(), names.end(), std::back_inserter(list),
               [](const std::string& name) { return is_built(find_configuration(name).estimator); });
  return list;
}

/// A row of the paper's table, and what it was called there.
struct Printed {
  std::string sequence;
  Texts figures;
};

// The printed figures: He et al., EAR-SLAM, tables I to V.

TableDefinition table_one(const Texts& wanted) {
  const std::vector<Printed> printed{{"flat1", {"0.308", "0.782", "0.249", "0.633", "0.089", "0.227"}},
                                     {"flat2", {"0.350", "0.738", "0.269", "0.567", "0.062", "0.130"}},
                                     {"flat3", {"0.252", "0.568", "0.255", "0.573", "0.098", "0.221"}},
                                     {"wave1", {"0.122", "0.318", "0.323", "0.814", "0.097", "0.246"}},
                                     {"wave2", {"0.263", "0.711", "0.241", "0.653", "0.055", "0.148"}},
                                     {"wave3", {"0.206", "0.728", "0.313", "1.107", "0.071", "0.252"}},
                                     {"slope", {"0.214", "0.402", "0.489", "0.815", "0.131", "0.252"}},
                                     {"lawn", {"1.177", "1.935", "0.871", "1.145", "0.198", "0.308"}},
                                     {"fly1", {"0.156", "0.470", "0.267", "0.807", "0.119", "0.360"}},
                                     {"fly2", {"0.406", "0.690", "0.429", "0.728", "0.319", "0.542"}}};
  TableDefinition table{"I",
                        "RMSE of the position [m], and in % of the length",
                        "Printed: VINS-Fusion and MSCKF-VIO use stereo camera and IMU, EAR-SLAM all sensors.",
                        {"VINS-Fusion", "%", "MSCKF-VIO", "%", "EAR-SLAM", "%"},
                        {},
                        {}};
  const Texts configurations = built({"none", "default", "smoother"});
  for (const std::string& name : configurations) {
    const std::string title = name == "none" ? "here, cameras and IMU" : "here, " + find_configuration(name).title;
    table.our_columns.insert(table.our_columns.end(), {title, "%"});
  }
  for (const Printed& row : printed) {
    if (!contains(wanted, row.sequence)) continue;
    Row ours{capital(row.sequence), row.figures, {}};
    for (const std::string& name : configurations) {
      ours.ours.push_back(cell(row.sequence, name, Figure::ate));
      ours.ours.push_back(cell(row.sequence, name, Figure::ate_percent));
    }
    table.rows.push_back(ours);
  }
  return table;
}

TableDefinition table_two(const Texts& wanted) {
  const std::vector<std::pair<Printed, Texts>> printed{
      {{"flat1", {"0.308", "0.160", "0.113", "0.089"}}, {"0.109", "0.076", "0.079", "0.039"}},
      {{"flat2", {"0.350", "0.210", "0.119", "0.062"}}, {"0.206", "0.078", "0.097", "0.022"}},
      {{"flat3", {"0.252", "0.148", "0.143", "0.098"}}, {"0.199", "0.056", "0.059", "0.028"}},
      {{"wave1", {"0.122", "0.140", "0.128", "0.097"}}, {"0.047", "0.072", "0.041", "0.031"}},
      {{"wave2", {"0.263", "0.120", "0.083", "0.055"}}, {"0.070", "0.088", "0.054", "0.024"}},
      {{"wave3", {"0.218", "0.161", "0.143", "0.071"}}, {"0.033", "0.060", "0.038", "0.039"}},
      {{"slope", {"0.214", "0.235", "0.150", "0.131"}}, {"0.097", "0.180", "0.096", "0.061"}},
      {{"lawn", {"1.177", "0.643", "0.524", "0.198"}}, {"0.056", "0.367", "0.089", "0.060"}}};
  const Texts configurations{"none", "differential", "gyro", "terrain"};
  TableDefinition table{"II",
                        "Models of the odometer: RMSE of position and height [m]",
                        "Printed: without wheels, two-wheel odometer, with the gyroscope's rotation, terrain-aware.",
                        {"VINS-Fusion", "odom", "gyro-odom", "EAR-SLAM"},
                        {"here, none", "differential", "gyro", "terrain"},
                        {}};
  for (const auto& [position, height] : printed) {
    if (!contains(wanted, position.sequence)) continue;
    Row p{capital(position.sequence) + ", position", position.figures, {}};
    Row z{capital(position.sequence) + ", z", height, {}};
    for (const std::string& name : configurations) {
      p.ours.push_back(cell(position.sequence, name, Figure::ate));
      z.ours.push_back(cell(position.sequence, name, Figure::z));
    }
    table.rows.insert(table.rows.end(), {p, z});
  }
  return table;
}

struct PrintedRate {
  double rate;
  Texts figures;
};

TableDefinition table_three(const Texts& wanted) {
  const std::vector<PrintedRate> flat3{{15.0, {"0.215", "0.291", "0.186", "0.097"}},
                                       {10.0, {"1.223", "-", "0.239", "0.143"}},
                                       {5.0, {"-", "-", "0.499", "0.373"}}};
  const Texts configurations = built({"none", "default", "smoother"});
  TableDefinition table{"III",
                        "Covered lenses and slow cameras: RMSE of the position [m]",
                        "\"-\": fails. Printed EAR-SLAM at 15 Hz: as in table V. There is no loop closure here.",
                        {"VINS-Fusion", "MSCKF-VIO", "EAR-SLAM", "with loop closure"},
                        {},
                        {}};
  for (const std::string& name : configurations) {
    table.our_columns.push_back(name == "none" ? "here, cameras and IMU" : "here, " + find_configuration(name).title);
  }
  const auto add = [&](const std::string& sequence, const std::string& label, double rate, const Texts& figures) {
    if (!contains(wanted, sequence)) return;
    Row row{label, figures, {}};
    for (const std::string& name : configurations) row.ours.push_back(cell(sequence, name, Figure::ate, rate));
    table.rows.push_back(row);
  };
  add("occlusion1", "Occlusion1", 30.0, {"-", "-", "0.245", ""});
  add("occlusion2", "Occlusion2", 30.0, {"-", "-", "0.337", ""});
  for (const PrintedRate& row : flat3) {
    add("flat3", "Flat3, " + std::to_string(static_cast<int>(row.rate)) + " Hz", row.rate, row.figures);
  }
  return table;
}

TableDefinition table_four(const Texts& wanted) {
  const std::vector<Printed> printed{{"sway1", {"0.001", "0.371", "0.144", "0.081"}},
                                     {"sway2", {"0.003", "0.500", "0.252", "0.043"}},
                                     {"sway3", {"0.023", "0.528", "0.508", "0.051"}}};
  TableDefinition table{"IV",
                        "Swaying on standing wheels: distance between the ends of the path [m]",
                        "The last column is the error of the last position, the first pose aligned.",
                        {"truth", "VINS-Fusion", "MSCKF-VIO", "EAR-SLAM"},
                        {"here, truth", "cameras and IMU", "all sensors", "cameras and IMU, error", "all, error"},
                        {}};
  for (const Printed& row : printed) {
    if (!contains(wanted, row.sequence)) continue;
    table.rows.push_back(
        {capital(row.sequence),
         row.figures,
         {cell(row.sequence, "default", Figure::true_end_distance), cell(row.sequence, "none", Figure::end_distance),
          cell(row.sequence, "default", Figure::end_distance), cell(row.sequence, "none", Figure::start_to_end),
          cell(row.sequence, "default", Figure::start_to_end)}});
  }
  return table;
}

TableDefinition table_five(const Texts& wanted) {
  const Texts configurations{"weights-off", "weights-mahalanobis", "weights-distance", "gates-off", "all-off"};
  TableDefinition table{
      "V",
      "Anomaly weights: RMSE of Flat3, start-to-end error of Sway [m]",
      "",
      {"without", "with"},
      {"here, without", "with, Mahalanobis", "with, distance", "with, gates off", "without, gates and scores off"},
      {}};
  const auto add = [&](const std::string& sequence, const std::string& label, Figure figure, double rate,
                       const Texts& figures) {
    if (!contains(wanted, sequence)) return;
    Row row{label, figures, {}};
    for (const std::string& name : configurations) row.ours.push_back(cell(sequence, name, figure, rate));
    table.rows.push_back(row);
  };
  add("flat3", "Flat3, 15 Hz", Figure::ate, 15.0, {"0.231", "0.186"});
  add("flat3", "Flat3, 10 Hz", Figure::ate, 10.0, {"0.321", "0.239"});
  add("flat3", "Flat3, 5 Hz", Figure::ate, 5.0, {"0.754", "0.499"});
  add("sway1", "Sway1", Figure::start_to_end, 30.0, {"0.121", "0.081"});
  add("sway2", "Sway2", Figure::start_to_end, 30.0, {"0.055", "0.043"});
  add("sway3", "Sway3", Figure::start_to_end, 30.0, {"0.499", "0.051"});
  return table;
}

TableDefinition all_sequences(const Texts& wanted) {
  TableDefinition table{
      "all",
      "All sequences, all sensors",
      "Definitions: docs/evaluation.md. NEES of the position, 3 where the covariance is right, is the mean of a run. "
      "Time per frame: processor time of one thread, median and 99th percentile.",
      {},
      {"RMSE [m]", "[%]", "z [m]", "rotation [deg]", "end [m]", "NEES", "coverage [%]", "frame [ms]", "99 % [ms]"},
      {}};
  for (const std::string& sequence : wanted) {
    Row row{capital(sequence), {}, {}};
    for (const Figure figure : {Figure::ate, Figure::ate_percent, Figure::z, Figure::rotation, Figure::start_to_end,
                                Figure::nees, Figure::coverage, Figure::frame_ms, Figure::worst_frame_ms}) {
      row.ours.push_back(cell(sequence, "default", figure));
    }
    table.rows.push_back(row);
  }
  return table;
}

constexpr std::array<double, 4> kAblationRates{30.0, 15.0, 10.0, 5.0};

std::string rate_text(double rate) { return std::to_string(static_cast<int>(rate)) + " Hz"; }

}  // namespace

std::optional<double> figure_of(const Result& r, Figure figure) {
  if (figure == Figure::coverage) return 100.0 * r.coverage;
  if (!r.followed()) return std::nullopt;
  switch (figure) {
    case Figure::ate:
      return r.ate;
    case Figure::ate_percent:
      return r.length < 5.0 ? std::nullopt : std::optional(100.0 * r.ate / r.length);  // swaying is no travel
    case Figure::z:
      return r.z;
    case Figure::rotation:
      return r.rotation;
    case Figure::start_to_end:
      return r.start_to_end;
    case Figure::end_distance:
      return r.end_distance;
    case Figure::true_end_distance:
      return r.true_end_distance;
    case Figure::nees:
      return r.nees_position;
    case Figure::frame_ms:
      return r.frame_ms;
    case Figure::worst_frame_ms:
      return r.worst_frame_ms;
    case Figure::coverage:
      break;
  }
  return std::nullopt;
}

bool operator==(const Setup& a, const Setup& b) {
  return a.sequence == b.sequence && a.camera_rate_hz == b.camera_rate_hz && a.configuration == b.configuration;
}

const Texts& paper_sequences() {
  static const Texts kNames{"flat1", "flat2", "flat3", "wave1", "wave2", "wave3",      "slope",     "lawn",
                            "fly1",  "fly2",  "sway1", "sway2", "sway3", "occlusion1", "occlusion2"};
  return kNames;
}

std::vector<TableDefinition> paper_tables(const Texts& sequences) {
  std::vector<TableDefinition> tables{all_sequences(sequences), table_one(sequences),  table_two(sequences),
                                      table_three(sequences),   table_four(sequences), table_five(sequences)};
  tables.erase(std::remove_if(tables.begin(), tables.end(), [](const TableDefinition& t) { return t.rows.empty(); }),
               tables.end());
  return tables;
}

std::vector<TableDefinition> ablation_tables(const Texts& sequences, bool tracks) {
  TableDefinition summary{"ablation",
                          "What each ingredient gives: RMSE of the position over that of the default",
                          "Geometric mean over the sequences of the ratio of medians: 1.10 is an error 10 % larger.",
                          {},
                          {},
                          {}};
  for (const double rate : kAblationRates) summary.our_columns.push_back(rate_text(rate));
  std::vector<TableDefinition> tables;
  tables.reserve(kAblationRates.size() + 1);
  for (const double rate : kAblationRates) {
    tables.push_back({"ablation, " + rate_text(rate),
                      "The same at " + rate_text(rate) + ": RMSE of the position [m]",
                      "",
                      {},
                      sequences,
                      {}});
  }
  for (const std::string& name : ablation()) {
    const Configuration& configuration = find_configuration(name);
    if (tracks ? configuration.images_only : configuration.tracks_only) continue;
    const std::string& title = configuration.title;
    Row means{title, {}, {}};
    for (std::size_t i = 0; i < kAblationRates.size(); ++i) {
      Cell mean{{}, Figure::ate, "default"};
      Row row{title, {}, {}};
      for (const std::string& sequence : sequences) {
        mean.setups.push_back({sequence, kAblationRates[i], name});
        row.ours.push_back(cell(sequence, name, Figure::ate, kAblationRates[i]));
      }
      means.ours.push_back(mean);
      tables[i].rows.push_back(row);
    }
    summary.rows.push_back(means);
  }
  tables.insert(tables.begin(), summary);
  return tables;
}

std::vector<Setup> setups_of(const std::vector<TableDefinition>& tables) {
  std::vector<Setup> setups;
  const auto add = [&](const Setup& setup) {
    if (std::find(setups.begin(), setups.end(), setup) == setups.end()) setups.push_back(setup);
  };
  for (const TableDefinition& table : tables) {
    for (const Row& row : table.rows) {
      for (const Cell& cell : row.ours) {
        for (const Setup& setup : cell.setups) {
          add(setup);
          if (!cell.against.empty()) add({setup.sequence, setup.camera_rate_hz, cell.against});
        }
      }
    }
  }
  return setups;
}

}  // namespace ear::paper
