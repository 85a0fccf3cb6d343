#include "tools/simulator/film.h"

#include <cstddef>
#include <utility>

#include "tools/simulator/picture_maker.h"

namespace ear::simulator {
namespace {

Options without_tracks(Options options) {
  options.tracks = false;
  return options;
}

}  // namespace

Film::Film(Options options) : simulation(without_tracks(std::move(options))) {
  const PictureMaker maker(simulation);
  for (const Frame& frame : simulation.frames()) {
    pictures.push_back({maker.make({frame.exposure, 0}), maker.make({frame.exposure, 1})});
  }
}

StereoFrame Film::frame(std::size_t i) const {
  const auto view = [](const cv::Mat& m) {
    return ImageView{m.data, m.cols, m.rows, static_cast<std::ptrdiff_t>(m.step)};
  };
  return {simulation.frame_times()[i], view(pictures[i][0]), view(pictures[i][1])};
}

}  // namespace ear::simulator
