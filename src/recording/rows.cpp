#include "src/recording/rows.h"

#include <array>
#include <cmath>
#include <limits>

#include "src/recording/sample_stream.h"

namespace ear {
namespace {

[[noreturn]] void malformed(const std::string& column, std::string_view field, const char* expected) {
  throw RowError{RowError::Kind::malformed, column, "'" + std::string(field) + "' is not " + expected};
}

void require_columns(const CsvRow& row, std::size_t count) {
  if (row.fields.size() >= count) return;
  throw RowError{RowError::Kind::malformed, "line",
                 std::to_string(row.fields.size()) + " fields, not " + std::to_string(count)};
}

TimeNs time(const CsvRow& row, std::size_t index, const char* column) {
  const auto t_ns = parse_integer(row.fields[index]);
  if (!t_ns) malformed(column, row.fields[index], "a whole number of nanoseconds");
  if (*t_ns <= -kLargestStamp || *t_ns >= kLargestStamp) {
    malformed(column, row.fields[index], "within 142 years of the clock's zero");
  }
  return *t_ns;
}

TimeNs stamp(const CsvRow& row) { return time(row, 0, "timestamp"); }

double number(const CsvRow& row, std::size_t index, const std::string& column) {
  const auto value = parse_double(row.fields[index]);
  if (!value) malformed(column, row.fields[index], "a number");
  return *value;
}

double finite_number(const CsvRow& row, std::size_t index, const char* column) {
  const double value = number(row, index, column);
  if (!std::isfinite(value)) throw RowError{RowError::Kind::not_finite, column, std::string(row.fields[index])};
  return value;
}

std::int64_t count(const CsvRow& row, std::size_t index, const char* column) {
  if (const auto whole = parse_integer(row.fields[index])) return *whole;
  const double value = finite_number(row, index, column);  // some programs write every number with a point
  if (std::abs(value) > 9e15) malformed(column, row.fields[index], "a number of counts");
  return std::llround(value);
}

}  // namespace

ImuSample parse_imu_row(const CsvRow& row) {
  constexpr std::array kColumns{"w_x", "w_y", "w_z", "a_x", "a_y", "a_z"};
  require_columns(row, 1 + kColumns.size());
  ImuSample sample;
  sample.t_ns = stamp(row);
  for (std::size_t i = 0; i < kColumns.size(); ++i) {
    Eigen::Vector3d& vector = i < 3 ? sample.gyro_B : sample.accel_B;
    vector(static_cast<Eigen::Index>(i % 3)) = finite_number(row, 1 + i, kColumns[i]);
  }
  return sample;
}

EncoderSample parse_encoder_row(const CsvRow& row) {
  require_columns(row, 3);
  return {stamp(row), count(row, 1, "left"), count(row, 2, "right")};
}

LaserSample parse_laser_row(const CsvRow& row, const LaserCalibration& lasers) {
  const std::size_t beams = lasers.beams.size();
  if (row.fields.size() != beams + 1) {
    throw RowError{RowError::Kind::malformed, "line",
                   std::to_string(row.fields.size()) + " fields, not a timestamp and " + std::to_string(beams) +
                       " beams as in sensor.yaml"};
  }
  LaserSample sample;
  sample.t_ns = stamp(row);
  sample.range.reserve(beams);
  for (std::size_t i = 0; i < beams; ++i) {
    const double range = number(row, i + 1, lasers.beams[i].name);
    const bool hit = range >= lasers.range_min && range <= lasers.range_max;
    sample.range.push_back(hit ? range : std::numeric_limits<double>::quiet_NaN());
  }
  return sample;
}

ImageRow parse_image_row(const CsvRow& row) {
  require_columns(row, 2);
  const TimeNs t_ns = stamp(row);
  if (row.fields[1].empty()) malformed("filename", row.fields[1], "a file name");
  return {t_ns, std::string(row.fields[1])};
}

ArrivalRow parse_arrival_row(const CsvRow& row) {
  require_columns(row, 2);
  return {stamp(row), time(row, 1, "arrival")};
}

}  // namespace ear
