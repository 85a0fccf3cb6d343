#include "tools/calibration/board_images.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <stdexcept>
#include <utility>

#ifdef EAR_WITH_ARUCO
#include <opencv2/aruco/charuco.hpp>
#endif

#include "src/recording/frame_list.h"
#include "src/recording/image_file.h"
#include "src/recording/input_error.h"

namespace ear::calibration {
namespace {

namespace fs = std::filesystem;

constexpr double kRate = 5.0;              // [Hz] of the images that are searched
constexpr std::size_t kFewestCorners = 6;  // corners
constexpr double kOffBoard = 0.25;  // of a square: a corner that far from the plane's is another, or the board is
constexpr double kWhole = 0.7;      // of the corners must lie on it
constexpr double kFast = 150.0;     // [px/s] blurred
constexpr double kUnlike = 15.0;    // [px] in the mean
constexpr std::size_t kMostViews = 150;

#ifdef EAR_WITH_ARUCO
int dictionary_id(const std::string& name) {
  static const std::map<std::string, int> kNames{{"DICT_4X4_50", cv::aruco::DICT_4X4_50},
                                                 {"DICT_4X4_100", cv::aruco::DICT_4X4_100},
                                                 {"DICT_4X4_250", cv::aruco::DICT_4X4_250},
                                                 {"DICT_4X4_1000", cv::aruco::DICT_4X4_1000},
                                                 {"DICT_5X5_50", cv::aruco::DICT_5X5_50},
                                                 {"DICT_5X5_100", cv::aruco::DICT_5X5_100},
                                                 {"DICT_5X5_250", cv::aruco::DICT_5X5_250},
                                                 {"DICT_5X5_1000", cv::aruco::DICT_5X5_1000},
                                                 {"DICT_6X6_50", cv::aruco::DICT_6X6_50},
                                                 {"DICT_6X6_100", cv::aruco::DICT_6X6_100},
                                                 {"DICT_6X6_250", cv::aruco::DICT_6X6_250},
                                                 {"DICT_6X6_1000", cv::aruco::DICT_6X6_1000},
                                                 {"DICT_7X7_50", cv::aruco::DICT_7X7_50},
                                                 {"DICT_7X7_100", cv::aruco::DICT_7X7_100},
                                                 {"DICT_7X7_250", cv::aruco::DICT_7X7_250},
                                                 {"DICT_7X7_1000", cv::aruco::DICT_7X7_1000},
                                                 {"DICT_ARUCO_ORIGINAL", cv::aruco::DICT_ARUCO_ORIGINAL}};
  const auto found = kNames.find(name);
  if (found != kNames.end()) return found->second;
  std::string known;
  for (const auto& [known_name, id] : kNames) known += " " + known_name;
  throw std::invalid_argument("there is no dictionary '" + name + "'; there are:" + known);
}

cv::Ptr<cv::aruco::CharucoBoard> charuco(const PrintedBoard& board) {
  const auto dictionary = cv::aruco::getPredefinedDictionary(dictionary_id(board.dictionary));
  const BoardShape& shape = board.shape;
  if (shape.columns < 3 || shape.rows < 3 || !(shape.square > board.marker) || !(board.marker > 0.0)) {
    throw std::invalid_argument("a board has 3 x 3 squares at least, and its markers are smaller than its squares");
  }
  if (shape.columns * shape.rows / 2 > dictionary->bytesList.rows) {
    throw std::invalid_argument("a board of " + std::to_string(shape.columns) + " x " + std::to_string(shape.rows) +
                                " squares has more markers than " + board.dictionary);
  }
  return cv::aruco::CharucoBoard::create(shape.columns, shape.rows, static_cast<float>(shape.square),
                                         static_cast<float>(board.marker), dictionary);
}
#endif

/// Those corners that a plane's picture explains; nothing where they are too few.
std::vector<SeenCorner> on_a_plane(const BoardShape& shape, const std::vector<SeenCorner>& corners) {
  std::vector<cv::Point2d> there, here;
  for (const SeenCorner& corner : corners) {
    const Eigen::Vector2d at = shape.at(corner.corner) / shape.square;
    there.emplace_back(at.x(), at.y());
    here.emplace_back(corner.px.x(), corner.px.y());
  }
  const auto largest = [&](auto of) {
    double low = 1e9, high = -1e9;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      low = std::min(low, of(i));
      high = std::max(high, of(i));
    }
    return high - low;
  };
  const double width =
      std::hypot(largest([&](std::size_t i) { return here[i].x; }), largest([&](std::size_t i) { return here[i].y; }));
  const double squares = std::hypot(largest([&](std::size_t i) { return there[i].x; }),
                                    largest([&](std::size_t i) { return there[i].y; }));
  std::vector<std::uint8_t> fits;
  const cv::Mat H = cv::findHomography(there, here, cv::RANSAC, kOffBoard * width / squares, fits);
  std::vector<SeenCorner> kept;
  for (std::size_t i = 0; i < corners.size() && !H.empty(); ++i) {
    if (fits[i] != 0) kept.push_back(corners[i]);
  }
  const bool whole = static_cast<double>(kept.size()) >= kWhole * static_cast<double>(corners.size());
  return whole && kept.size() >= kFewestCorners ? kept : std::vector<SeenCorner>{};
}

/// To fractions of a pixel. What aruco gives lies half a pixel to the lower right (4.6 counts from the pixel's border).
/// The window stays clear of the markers, whose edges pull: with one of twice the size, errors were twice as large.
void refine(const cv::Mat& image, const PrintedBoard& board, std::vector<SeenCorner>& corners) {
  const double clear =
      std::sqrt(0.5) * (1.0 - board.marker / board.shape.square);  // of the distance to the next corner
  for (SeenCorner& corner : corners) {
    double nearest = 1e9;
    for (const SeenCorner& other : corners) {
      if (other.corner != corner.corner) nearest = std::min(nearest, (other.px - corner.px).norm());
    }
    const int half = std::clamp(static_cast<int>(clear * nearest - 2.0), 2, 10);
    std::vector<cv::Point2f> point{{static_cast<float>(corner.px.x()), static_cast<float>(corner.px.y())}};
    cv::cornerSubPix(image, point, {half, half}, {-1, -1},
                     cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 40, 1e-3));
    corner.px = {point[0].x, point[0].y};
  }
}

/// How far corners seen in both lie apart, in the mean [px]. Nothing where hardly any are.
std::optional<double> moved_by(const BoardView& from, const BoardView& to) {
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t camera = 0; camera < 2; ++camera) {
    for (const SeenCorner& a : from.seen[camera]) {
      for (const SeenCorner& b : to.seen[camera]) {
        if (a.corner != b.corner) continue;
        sum += (b.px - a.px).norm();
        ++count;
      }
    }
  }
  if (count < kFewestCorners) return std::nullopt;
  return sum / static_cast<double>(count);
}

/// Those at rest or nearly, each unlike the one before.
std::vector<BoardView> chosen(const std::vector<BoardView>& all) {
  const auto speed = [&](std::size_t i, std::size_t j) -> double {
    const double dt = seconds_between(all[i].t_ns, all[j].t_ns);
    const std::optional<double> way = moved_by(all[i], all[j]);
    return way && dt > 0.0 ? *way / dt : 1e9;
  };
  std::vector<BoardView> views;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const double before = i > 0 ? speed(i - 1, i) : 1e9;
    const double after = i + 1 < all.size() ? speed(i, i + 1) : 1e9;
    if (all.size() > 1 && std::min(before, after) > kFast) continue;
    if (!views.empty() && moved_by(views.back(), all[i]).value_or(1e9) < kUnlike) continue;
    views.push_back(all[i]);
  }
  if (views.size() <= kMostViews) return views;
  std::vector<BoardView> fewer;
  for (std::size_t i = 0; i < kMostViews; ++i) fewer.push_back(views[i * views.size() / kMostViews]);
  return fewer;
}

fs::path folder_of_images(const fs::path& folder) {
  for (const fs::path& mav0 : {folder / "mav0", folder}) {
    if (fs::exists(mav0 / "cam0" / "data.csv")) return mav0;
  }
  throw InputError(located(folder, 0, "", "no cam0/data.csv in it or in its mav0: images of a board are needed"));
}

std::string size_of(const PrintedBoard& board) {
  return std::to_string(board.shape.columns) + " x " + std::to_string(board.shape.rows);
}

void require_board(const BoardRecording& found, const BoardFinder& finder, const PrintedBoard& board,
                   const fs::path& folder) {
  const std::string place = folder.string() + ": ";
  if (finder.with_markers() == 0) {
    throw std::invalid_argument(place + "no markers of " + board.dictionary + " in any of " +
                                std::to_string(found.images) +
                                " images: no board, or one of another --dictionary, or too small in the image");
  }
  if (found.views.empty() || finder.misfits() * 2 > finder.with_markers()) {
    throw std::invalid_argument(place + std::to_string(finder.with_markers()) + " of " + std::to_string(found.images) +
                                " images show markers, but the corners between them do not lie as on a flat board of " +
                                size_of(board) + " squares: what is --board (columns x rows), and --marker?");
  }
}

}  // namespace

std::string missing_board_parts() {
#ifdef EAR_WITH_ARUCO
  return {};
#else
  return "OpenCV's aruco module was not there when this program was built: install Debian's libopencv-contrib-dev and "
         "build again";
#endif
}

BoardFinder::BoardFinder(const PrintedBoard& board) : board_(board) {
#ifdef EAR_WITH_ARUCO
  static_cast<void>(charuco(board));
#else
  throw std::invalid_argument(missing_board_parts());
#endif
}

std::vector<SeenCorner> BoardFinder::find(const cv::Mat& image) {
  std::vector<SeenCorner> corners;
#ifdef EAR_WITH_ARUCO
  const auto board = charuco(board_);
  std::vector<std::vector<cv::Point2f>> markers;
  std::vector<int> ids;
  cv::aruco::detectMarkers(image, board->dictionary, markers, ids);
  if (ids.size() < 2) return corners;
  ++with_markers_;
  std::vector<cv::Point2f> points;
  std::vector<int> names;
  cv::aruco::interpolateCornersCharuco(markers, ids, image, board, points, names);
  for (std::size_t i = 0; i < points.size(); ++i) corners.push_back({names[i], {points[i].x, points[i].y}});
  const bool enough = corners.size() >= kFewestCorners;
  corners = enough ? on_a_plane(board_.shape, corners) : std::vector<SeenCorner>{};
  // Markers in plenty, and yet no corner between them: those of another board.
  refine(image, board_, corners);
  if (corners.empty() && (enough || ids.size() >= kFewestCorners)) ++misfits_;
#else
  static_cast<void>(image);
#endif
  return corners;
}

BoardRecording find_board(const fs::path& folder, const PrintedBoard& board,
                          const std::function<void(std::size_t)>& progress) {
  BoardFinder finder(board);
  const fs::path mav0 = folder_of_images(folder);
  const bool stereo = fs::exists(mav0 / "cam1" / "data.csv");
  FrameList files(mav0, stereo, kRate);
  Warnings warnings;
  BoardRecording found;
  found.cameras.resize(stereo ? 2 : 1);
  std::vector<BoardView> all;
  std::optional<TimeNs> first_ns;
  while (const std::optional<FrameFiles> frame = files.next(warnings)) {
    first_ns = first_ns.value_or(frame->t_ns);
    found.duration = seconds_between(*first_ns, frame->t_ns);
    BoardView view;
    view.t_ns = frame->t_ns;
    const std::array<fs::path, 2> paths{frame->left, frame->right};
    for (std::size_t camera = 0; camera < found.cameras.size(); ++camera) {
      if (paths[camera].empty()) continue;
      const cv::Mat image = read_image(paths[camera], "cam" + std::to_string(camera), warnings);
      if (image.empty()) continue;
      CameraCalibration& size = found.cameras[camera];
      if (size.width == 0) std::tie(size.width, size.height) = std::pair(image.cols, image.rows);
      if (size.width != image.cols || size.height != image.rows) {
        throw InputError(located(paths[camera], 0, "", "another size than the images before"));
      }
      view.seen[camera] = finder.find(image);
      progress(++found.images);
    }
    if (!view.seen[0].empty() || !view.seen[1].empty()) all.push_back(std::move(view));
  }
  if (found.images == 0) throw InputError(located(mav0, 0, "", "no image that can be read"));
  for (const CameraCalibration& camera : found.cameras) {
    if (camera.width == 0) throw InputError(located(mav0, 0, "", "a camera without an image that can be read"));
  }
  found.views = chosen(all);
  require_board(found, finder, board, folder);
  return found;
}

}  // namespace ear::calibration
