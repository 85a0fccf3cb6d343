// A board with markers in the images of a recording: OpenCV's ChArUco boards.
#pragma once

#include <filesystem>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "calibration/board.h"

namespace ear::calibration {

/// The board that was printed.
struct PrintedBoard {
  BoardShape shape;
  double marker = 0.03;                    ///< [m] edge of a marker
  std::string dictionary = "DICT_4X4_50";  ///< OpenCV's name
};

/// Empty where boards can be found; else what is missing in this program, for messages.
[[nodiscard]] std::string missing_board_parts();

/// Finds the board in one image after the other. Without the parts, or for a board that cannot be, the constructor
/// throws std::invalid_argument.
class BoardFinder {
 public:
  explicit BoardFinder(const PrintedBoard& board);

  /// Corners found, those that lie on a flat board of this shape; empty where there are fewer than six. 8-bit grey.
  [[nodiscard]] std::vector<SeenCorner> find(const cv::Mat& image);

  /// Images in which there were markers of the dictionary.
  [[nodiscard]] std::size_t with_markers() const { return with_markers_; }
  /// Images in which corners were found, but not as they lie on the board.
  [[nodiscard]] std::size_t misfits() const { return misfits_; }

 private:
  PrintedBoard board_;
  std::size_t with_markers_ = 0;
  std::size_t misfits_ = 0;
};

/// What the images of a recording show of the board.
struct BoardRecording {
  std::vector<BoardView> views;  ///< at rest or nearly, and each unlike the one before; poses are not yet known
  std::vector<CameraCalibration> cameras;  ///< sizes only
  std::size_t images = 0;                  ///< that were searched
  double duration = 0.0;                   ///< [s]
};

/// `folder`: RECORDING or RECORDING/mav0; needs cam0/data.csv alone. `progress` is told how many images were searched.
/// Throws InputError for what cannot be read, std::invalid_argument in words where there is no such board in it.
[[nodiscard]] BoardRecording find_board(const std::filesystem::path& folder, const PrintedBoard& board,
                                        const std::function<void(std::size_t)>& progress);

}  // namespace ear::calibration
