// Rows of the csv files of docs/recordings.md, as samples.
#pragma once

#include <string>

#include "ear/calibration.h"
#include "ear/types.h"
#include "src/recording/csv.h"

namespace ear {

/// One row of a camera's data.csv.
struct ImageRow {
  TimeNs t_ns = 0;
  std::string filename;  ///< inside the camera's data folder
};

/// One row of a camera's arrival.csv.
struct ArrivalRow {
  TimeNs t_ns = 0;  ///< the frame's stamp
  TimeNs arrival_ns = 0;
};

/// timestamp [ns], w_x, w_y, w_z [rad/s], a_x, a_y, a_z [m/s^2]. Throws RowError.
[[nodiscard]] ImuSample parse_imu_row(const CsvRow& row);

/// timestamp [ns], left, right [count]. Throws RowError.
[[nodiscard]] EncoderSample parse_encoder_row(const CsvRow& row);

/// timestamp [ns], one range per beam [m]. Readings outside of the sensor's range become NaN. Throws RowError.
[[nodiscard]] LaserSample parse_laser_row(const CsvRow& row, const LaserCalibration& lasers);

/// timestamp [ns], file name. Throws RowError.
[[nodiscard]] ImageRow parse_image_row(const CsvRow& row);

/// timestamp [ns], arrival [ns]. Throws RowError.
[[nodiscard]] ArrivalRow parse_arrival_row(const CsvRow& row);

}  // namespace ear
