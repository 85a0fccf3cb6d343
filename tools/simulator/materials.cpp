#include "tools/simulator/materials.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <string>

#include "tools/simulator/random.h"

namespace ear::simulator {
namespace {

int pixels_across(double length, double texel) { return std::max(1, static_cast<int>(std::ceil(length / texel))); }

int missing_pixels(int pixels) { return (kTextureMultiple - pixels % kTextureMultiple) % kTextureMultiple; }

// A surface to paint on: grey levels as floats, first row on top, lengths in metres.
class Canvas {
 public:
  Canvas(double width, double height, double texel, Rng& rng)
      : rng_(rng),
        texel_(texel),
        width_(width),
        height_(height),
        image_(pixels_across(height, texel), pixels_across(width, texel), CV_32FC1) {}

  [[nodiscard]] double width() const { return width_; }
  [[nodiscard]] double height() const { return height_; }
  [[nodiscard]] Rng& rng() { return rng_; }
  [[nodiscard]] double uniform(double low, double high) { return simulator::uniform(rng_, low, high); }

  void fill(double grey) { image_ = grey; }

  // Random variation with features from `largest` down to `smallest` [m], each octave weaker than the one before; along
  // x all is longer by `stretch`.
  void fractal(double amplitude, double largest, double smallest, double persistence = 0.75, double stretch = 1.0) {
    cv::RNG generator(rng_());
    cv::Mat sum;
    for (double size = largest; size >= smallest; size *= 0.5, amplitude *= persistence) {
      cv::Mat octave(cells(height_, size), cells(width_, size * stretch), CV_32FC1);
      generator.fill(octave, cv::RNG::NORMAL, 0.0, amplitude);
      if (!sum.empty()) {
        cv::Mat finer;
        cv::resize(sum, finer, octave.size(), 0.0, 0.0, cv::INTER_CUBIC);
        octave += finer;
      }
      sum = octave;
    }
    cv::Mat fine;
    cv::resize(sum, fine, image_.size(), 0.0, 0.0, sum.cols > image_.cols ? cv::INTER_AREA : cv::INTER_CUBIC);
    image_ += fine;
  }

  // All shapes: metres from the top left corner, added to or blended over what is there.
  void rectangle(double x, double y, double w, double h, double grey) {
    cv::rectangle(image_, point(x, y), point(x + w, y + h), cv::Scalar(grey), cv::FILLED, cv::LINE_AA, kShift);
  }
  void shade(double x, double y, double w, double h, double difference) {
    const cv::Rect area = cv::Rect(pixel(x), pixel(y), pixel(w), pixel(h)) & cv::Rect({}, image_.size());
    if (!area.empty()) image_(area) += difference;
  }
  void circle(double x, double y, double radius, double grey) {
    cv::circle(image_, point(x, y), static_cast<int>(radius / texel_ * kUnit), cv::Scalar(grey), cv::FILLED,
               cv::LINE_AA, kShift);
  }
  void line(double x0, double y0, double x1, double y1, double thickness, double grey) {
    cv::line(image_, point(x0, y0), point(x1, y1), cv::Scalar(grey), std::max(1, pixel(thickness)), cv::LINE_AA,
             kShift);
  }
  void polygon(const std::vector<Eigen::Vector2d>& corners, double grey) {
    std::vector<cv::Point> points;
    points.reserve(corners.size());
    for (const Eigen::Vector2d& corner : corners) points.push_back(point(corner.x(), corner.y()));
    cv::fillPoly(image_, std::vector<std::vector<cv::Point>>{points}, cv::Scalar(grey), cv::LINE_AA, kShift);
  }
  void text(const std::string& words, double x, double y, double size, double grey) {
    constexpr double kGlyphHeight = 21.0;  // [px] of a capital of this font at scale 1
    cv::putText(image_, words, {pixel(x), pixel(y)}, cv::FONT_HERSHEY_DUPLEX, size / texel_ / kGlyphHeight,
                cv::Scalar(grey), std::max(1, pixel(size * 0.12)), cv::LINE_AA);
  }

  [[nodiscard]] Texture finish(double brightness) {
    cv::Mat bytes;
    image_.convertTo(bytes, CV_8UC1, brightness);
    cv::flip(bytes, bytes, 0);  // panels count from below
    cv::Mat padded;
    cv::copyMakeBorder(bytes, padded, 0, missing_pixels(bytes.rows), 0, missing_pixels(bytes.cols),
                       cv::BORDER_REPLICATE);
    return {padded, texel_};
  }

 private:
  static constexpr int kShift = 4;  // drawing in sixteenths of a pixel
  static constexpr double kUnit = 16.0;

  [[nodiscard]] static int cells(double length, double size) {
    constexpr int kFewest = 4;
    return std::max(kFewest, static_cast<int>(length / size));
  }
  [[nodiscard]] int pixel(double metres) const { return static_cast<int>(std::lround(metres / texel_)); }
  [[nodiscard]] cv::Point point(double x, double y) const {
    return {static_cast<int>(std::lround(x / texel_ * kUnit)), static_cast<int>(std::lround(y / texel_ * kUnit))};
  }

  Rng& rng_;
  double texel_;
  double width_, height_;
  cv::Mat image_;
};

std::string random_word(Canvas& canvas) {
  const auto length = static_cast<std::size_t>(canvas.uniform(2.0, 10.0));
  std::string word;
  for (std::size_t i = 0; i < length; ++i)
    word += static_cast<char>('a' + static_cast<int>(canvas.uniform(0.0, 25.99)));
  return word;
}

void text_block(Canvas& canvas, double x, double y, double w, double h, double size, double grey) {
  for (double line = y + size; line < y + h; line += 1.7 * size) {
    std::string words;
    while (0.8 * size * static_cast<double>(words.size()) < w - 4.0 * size) words += random_word(canvas) + ' ';
    canvas.text(words, x, line, size, grey);
  }
}

// Short dark and light marks: scratches, dirt, what any used surface has.
void scuffs(Canvas& canvas, double per_square_metre, double longest, double contrast) {
  const int count = static_cast<int>(per_square_metre * canvas.width() * canvas.height());
  for (int i = 0; i < count; ++i) {
    const double x = canvas.uniform(0.0, canvas.width());
    const double y = canvas.uniform(0.0, canvas.height());
    const double angle = canvas.uniform(0.0, 6.28);
    const double length = longest * std::pow(canvas.uniform(0.1, 1.0), 3.0);
    const double size = canvas.uniform(0.003, 0.012);
    if (canvas.uniform(0.0, 1.0) < 0.6) {
      canvas.shade(x, y, canvas.uniform(0.003, 0.02), canvas.uniform(0.003, 0.02), canvas.uniform(-contrast, contrast));
    } else {
      canvas.line(x, y, x + length * std::cos(angle), y + length * std::sin(angle), size * 0.4,
                  110.0 + canvas.uniform(-contrast, contrast));
    }
  }
}

// Planks of wood, each with its own tone and grain.
void paint_floor(Canvas& canvas) {
  constexpr double kPlank = 0.16;
  canvas.fill(118.0);
  canvas.fractal(9.0, 3.0, 0.2, 0.8);            // worn and clean regions
  canvas.fractal(10.0, 0.06, 0.004, 0.9, 10.0);  // grain along x
  canvas.fractal(9.0, 0.03, 0.002, 0.95);        // dust and pores
  for (double y = 0.0; y < canvas.height(); y += kPlank) {
    for (double x = -canvas.uniform(0.0, 1.4); x < canvas.width();) {
      const double length = canvas.uniform(0.7, 1.6);
      canvas.shade(x, y, length, kPlank, canvas.uniform(-26.0, 26.0));
      canvas.rectangle(x - 0.0015, y, 0.003, kPlank, 45.0);
      if (canvas.uniform(0.0, 1.0) < 0.35) {  // a knot
        const double at = x + canvas.uniform(0.1, 0.9) * length;
        canvas.circle(at, y + canvas.uniform(0.03, 0.13), canvas.uniform(0.004, 0.014), canvas.uniform(50.0, 75.0));
      }
      x += length;
    }
    canvas.rectangle(0.0, y - 0.0015, canvas.width(), 0.003, 50.0);
  }
  scuffs(canvas, 70.0, 0.25, 55.0);
}

// Painted plaster: weak structure, a skirting board, sockets, cable ducts, and worn places.
void paint_wall(Canvas& canvas) {
  canvas.fill(165.0);
  canvas.fractal(7.0, 3.0, 0.25, 0.7);
  canvas.fractal(5.0, 0.12, 0.003, 0.9);
  const double floor_line = canvas.height() - 0.3;
  scuffs(canvas, 5.0, 0.3, 40.0);
  for (double x = canvas.uniform(0.3, 1.5); x < canvas.width() - 0.2; x += canvas.uniform(0.9, 2.2)) {
    const double y = floor_line - canvas.uniform(0.25, 1.3);
    canvas.rectangle(x, y, 0.085, 0.085, 215.0);
    canvas.rectangle(x + 0.01, y + 0.01, 0.065, 0.065, 190.0);
    canvas.circle(x + 0.030, y + 0.042, 0.007, 40.0);
    canvas.circle(x + 0.055, y + 0.042, 0.007, 40.0);
    canvas.rectangle(x + 0.035, y - canvas.uniform(0.4, 2.0), 0.018, 0.4, 195.0);
  }
  for (int i = 0; i < 3; ++i) {  // a board with notes, a door or a window recess
    const double x = canvas.uniform(0.2, canvas.width() - 1.4);
    const double y = canvas.uniform(0.3, 1.2);
    const double grey = canvas.uniform(90.0, 200.0);
    canvas.rectangle(x - 0.03, y - 0.03, 1.16, 0.86, 70.0);
    canvas.rectangle(x, y, 1.1, 0.8, grey);
    for (int note = 0; note < 9; ++note) {
      const double nx = x + canvas.uniform(0.02, 0.9);
      const double ny = y + canvas.uniform(0.02, 0.55);
      const double nw = canvas.uniform(0.08, 0.2);
      const double nh = canvas.uniform(0.08, 0.25);
      canvas.rectangle(nx, ny, nw, nh, canvas.uniform(120.0, 240.0));
      text_block(canvas, nx + 0.01, ny + 0.01, nw, nh - 0.02, 0.014, 50.0);
    }
  }
  canvas.rectangle(0.0, floor_line - 0.09, canvas.width(), 0.09, 95.0);
  canvas.rectangle(0.0, floor_line - 0.095, canvas.width(), 0.008, 60.0);
}

// Bricks, each of its own tone.
void paint_bricks(Canvas& canvas) {
  constexpr double kBrick = 0.24;
  constexpr double kCourse = 0.08;
  canvas.fill(150.0);
  bool shifted = false;
  for (double y = 0.0; y < canvas.height(); y += kCourse, shifted = !shifted) {
    for (double x = shifted ? -0.5 * kBrick : 0.0; x < canvas.width(); x += kBrick) {
      canvas.rectangle(x + canvas.uniform(0.004, 0.009), y + canvas.uniform(0.004, 0.008),
                       kBrick - canvas.uniform(0.010, 0.018), kCourse - canvas.uniform(0.010, 0.016),
                       canvas.uniform(75.0, 140.0));
    }
  }
  canvas.fractal(9.0, 2.0, 0.004, 0.85);
  scuffs(canvas, 6.0, 0.1, 40.0);
}

// Acoustic tiles, lamps, air outlets.
void paint_ceiling(Canvas& canvas) {
  constexpr double kTile = 0.6;
  canvas.fill(150.0);
  canvas.fractal(5.0, 2.0, 0.3, 0.7);
  canvas.fractal(7.0, 0.04, 0.008, 0.9);
  for (double y = 0.0; y < canvas.height(); y += kTile) {
    for (double x = 0.0; x < canvas.width(); x += kTile) {
      canvas.shade(x, y, kTile, kTile, canvas.uniform(-9.0, 9.0));
      const double what = canvas.uniform(0.0, 1.0);
      if (what < 0.08) {
        canvas.rectangle(x + 0.04, y + 0.04, kTile - 0.08, kTile - 0.08, 250.0);
        for (double bar = 0.1; bar < kTile - 0.05; bar += 0.1) canvas.rectangle(x + 0.04, y + bar, 0.52, 0.008, 190.0);
      } else if (what < 0.13) {
        for (double slot = 0.08; slot < kTile - 0.08; slot += 0.06)
          canvas.rectangle(x + 0.08, y + slot, 0.44, 0.02, 70.0);
      } else if (what < 0.2) {
        canvas.circle(x + canvas.uniform(0.2, 0.4), y + canvas.uniform(0.2, 0.4), 0.05, 60.0);
      }
    }
  }
  for (double y = 0.0; y < canvas.height(); y += kTile) canvas.rectangle(0.0, y - 0.006, canvas.width(), 0.012, 95.0);
  for (double x = 0.0; x < canvas.width(); x += kTile) canvas.rectangle(x - 0.006, 0.0, 0.012, canvas.height(), 95.0);
}

void paint_wood(Canvas& canvas) {
  canvas.fill(canvas.uniform(85.0, 150.0));
  canvas.fractal(12.0, 0.12, 0.004, 0.85, 12.0);
  canvas.fractal(5.0, 0.02, 0.003, 0.9);
  const double board = canvas.uniform(0.18, 0.4);
  for (double x = board; x < canvas.width(); x += board) canvas.rectangle(x, 0.0, 0.004, canvas.height(), 40.0);
  canvas.rectangle(0.0, 0.0, canvas.width(), 0.012, 60.0);
  scuffs(canvas, 30.0, 0.08, 40.0);
}

void paint_cardboard(Canvas& canvas) {
  canvas.fill(canvas.uniform(110.0, 160.0));
  canvas.fractal(4.0, 0.8, 0.004, 0.85);
  canvas.rectangle(0.45 * canvas.width(), 0.0, 0.06, canvas.height(), 185.0);
  for (int i = 0; i < 3; ++i) {
    const double w = canvas.uniform(0.08, 0.2);
    const double h = canvas.uniform(0.05, 0.14);
    const double x = canvas.uniform(0.0, std::max(0.01, canvas.width() - w));
    const double y = canvas.uniform(0.0, std::max(0.01, canvas.height() - h));
    canvas.rectangle(x, y, w, h, 225.0);
    text_block(canvas, x + 0.008, y + 0.006, w, 0.6 * h, 0.012, 40.0);
    for (double bar = x + 0.01; bar < x + w - 0.01; bar += canvas.uniform(0.004, 0.009)) {
      canvas.rectangle(bar, y + 0.65 * h, canvas.uniform(0.001, 0.004), 0.28 * h, 30.0);
    }
  }
  canvas.text(random_word(canvas), 0.05 * canvas.width(), 0.5 * canvas.height(), 0.07, 60.0);
  scuffs(canvas, 15.0, 0.1, 35.0);
}

void paint_poster(Canvas& canvas) {
  const double w = canvas.width();
  const double h = canvas.height();
  canvas.fill(canvas.uniform(60.0, 220.0));
  canvas.fractal(14.0, 0.5, 0.006, 0.8);
  for (int i = 0; i < 26; ++i) {
    const double x = canvas.uniform(0.0, w);
    const double y = canvas.uniform(0.0, h);
    const double size = 0.35 * w * std::pow(canvas.uniform(0.15, 1.0), 2.0);
    const double grey = canvas.uniform(20.0, 240.0);
    const double kind = canvas.uniform(0.0, 3.0);
    if (kind < 1.0) {
      canvas.circle(x, y, 0.5 * size, grey);
    } else if (kind < 2.0) {
      canvas.rectangle(x, y, size, canvas.uniform(0.3, 1.2) * size, grey);
    } else {
      canvas.polygon({{x, y},
                      {x + canvas.uniform(-size, size), y + canvas.uniform(0.0, size)},
                      {x + canvas.uniform(-size, size), y - canvas.uniform(0.0, size)}},
                     grey);
    }
  }
  canvas.rectangle(0.08 * w, 0.72 * h, 0.84 * w, 0.22 * h, 230.0);
  text_block(canvas, 0.1 * w, 0.74 * h, 0.8 * w, 0.19 * h, 0.02, 30.0);
  canvas.text(random_word(canvas), 0.08 * w, 0.16 * h, 0.09, canvas.uniform(0.0, 1.0) < 0.5 ? 20.0 : 235.0);
}

// Boards full of books and boxes.
void paint_shelf(Canvas& canvas) {
  canvas.fill(45.0);
  canvas.fractal(6.0, 0.5, 0.01);
  constexpr double kBoard = 0.34;
  for (double y = 0.04; y < canvas.height(); y += kBoard) {
    for (double x = 0.02; x < canvas.width() - 0.03;) {
      const double thickness = canvas.uniform(0.012, 0.06);
      const double height = canvas.uniform(0.18, 0.29);
      const double grey = canvas.uniform(50.0, 225.0);
      if (canvas.uniform(0.0, 1.0) < 0.93) {
        const double top = y + kBoard - 0.025 - height;
        canvas.rectangle(x, top, thickness - 0.002, height, grey);
        canvas.rectangle(x, top + canvas.uniform(0.02, 0.06), thickness - 0.002, canvas.uniform(0.008, 0.04),
                         canvas.uniform(30.0, 240.0));
      }
      x += thickness;
    }
    canvas.rectangle(0.0, y + kBoard - 0.025, canvas.width(), 0.022, 130.0);
  }
  canvas.rectangle(0.0, 0.0, 0.02, canvas.height(), 120.0);
  canvas.rectangle(canvas.width() - 0.02, 0.0, 0.02, canvas.height(), 120.0);
  canvas.fractal(5.0, 0.1, 0.004);
}

void paint_concrete(Canvas& canvas) {
  canvas.fill(125.0);
  canvas.fractal(13.0, 1.0, 0.004, 0.82);
  for (double y = canvas.uniform(0.4, 0.8); y < canvas.height(); y += 0.9) {
    canvas.rectangle(0.0, y, canvas.width(), 0.006, 70.0);
    for (double x = 0.1; x < canvas.width(); x += 0.25) canvas.circle(x, y + 0.45, 0.014, 55.0);
  }
  scuffs(canvas, 40.0, 0.06, 50.0);
}

void paint_metal(Canvas& canvas) {
  canvas.fill(canvas.uniform(95.0, 150.0));
  canvas.fractal(5.0, 0.5, 0.004, 0.85, 6.0);
  for (double x = 0.0; x < canvas.width(); x += 0.45) {
    canvas.rectangle(x, 0.0, 0.006, canvas.height(), 45.0);
    canvas.rectangle(x + 0.36, 0.5 * canvas.height(), 0.02, 0.12, 200.0);
    for (double y = 0.1; y < 0.35; y += 0.03) canvas.rectangle(x + 0.12, y, 0.2, 0.008, 55.0);
    canvas.rectangle(x + 0.1, 0.45, 0.14, 0.06, 225.0);
    canvas.text(random_word(canvas), x + 0.11, 0.49, 0.025, 40.0);
  }
  scuffs(canvas, 25.0, 0.1, 40.0);
}

// Blades in all directions over darker earth, with bare and mown places.
void paint_grass(Canvas& canvas) {
  canvas.fill(88.0);
  canvas.fractal(14.0, 4.0, 0.1, 0.8);
  canvas.fractal(14.0, 0.08, 0.002, 0.95);
  const int blades = static_cast<int>(1200.0 * canvas.width() * canvas.height());
  for (int i = 0; i < blades; ++i) {
    const double x = canvas.uniform(0.0, canvas.width());
    const double y = canvas.uniform(0.0, canvas.height());
    const double angle = canvas.uniform(0.0, 6.28);
    const double length = canvas.uniform(0.03, 0.10);
    canvas.line(x, y, x + length * std::cos(angle), y + length * std::sin(angle), 0.004, canvas.uniform(45.0, 165.0));
  }
  for (int i = 0; i < static_cast<int>(3.0 * canvas.width() * canvas.height()); ++i) {  // daisies, leaves, stones
    canvas.circle(canvas.uniform(0.0, canvas.width()), canvas.uniform(0.0, canvas.height()),
                  canvas.uniform(0.008, 0.03), canvas.uniform(30.0, 235.0));
  }
}

// Pebbles of many sizes, trodden earth.
void paint_gravel(Canvas& canvas) {
  canvas.fill(120.0);
  const int pebbles = static_cast<int>(900.0 * canvas.width() * canvas.height());
  for (int i = 0; i < pebbles; ++i) {
    const double size = 0.003 + 0.025 * std::pow(canvas.uniform(0.0, 1.0), 6.0);
    const double x = canvas.uniform(0.0, canvas.width());
    const double y = canvas.uniform(0.0, canvas.height());
    canvas.circle(x + 0.3 * size, y + 0.3 * size, size, 60.0);  // its shadow
    canvas.circle(x, y, size, canvas.uniform(70.0, 190.0));
  }
  canvas.fractal(14.0, 3.0, 0.1, 0.8);
  canvas.fractal(12.0, 0.08, 0.002, 0.95);
  scuffs(canvas, 30.0, 0.3, 50.0);
}

// Leaves in light and shade.
void paint_foliage(Canvas& canvas) {
  canvas.fill(70.0);
  canvas.fractal(26.0, 0.8, 0.01, 0.85);
  const int leaves = static_cast<int>(300.0 * canvas.width() * canvas.height());
  for (int i = 0; i < leaves; ++i) {
    canvas.circle(canvas.uniform(0.0, canvas.width()), canvas.uniform(0.0, canvas.height()),
                  canvas.uniform(0.01, 0.035), canvas.uniform(25.0, 150.0));
  }
}

// Plaster with rows of windows.
void paint_facade(Canvas& canvas) {
  canvas.fill(canvas.uniform(135.0, 190.0));
  canvas.fractal(8.0, 3.0, 0.02, 0.8);
  for (double y = 0.8; y + 1.6 < canvas.height(); y += 2.8) {
    for (double x = canvas.uniform(0.4, 1.2); x + 1.2 < canvas.width(); x += canvas.uniform(1.8, 3.0)) {
      canvas.rectangle(x - 0.08, y - 0.08, 1.26, 1.66, 215.0);
      canvas.rectangle(x, y, 1.1, 1.5, canvas.uniform(35.0, 90.0));
      canvas.rectangle(x + 0.52, y, 0.06, 1.5, 205.0);
      canvas.rectangle(x, y + 0.5, 1.1, 0.05, 205.0);
      canvas.rectangle(x, y + canvas.uniform(0.9, 1.4), 1.1, 0.2, canvas.uniform(80.0, 180.0));  // a curtain, a sill
    }
  }
  scuffs(canvas, 3.0, 0.5, 35.0);
}

// Clouds; nothing in them is sharp.
void paint_sky(Canvas& canvas) {
  canvas.fill(205.0);
  canvas.fractal(16.0, 40.0, 2.0, 0.6);
}

struct Look {
  double texel;  // [m]
  void (*paint)(Canvas&);
};

Look look_of(Material material) {
  switch (material) {
    case Material::floor:
      return {0.0022, paint_floor};
    case Material::wall:
      return {0.003, paint_wall};
    case Material::brick:
      return {0.003, paint_bricks};
    case Material::ceiling:
      return {0.005, paint_ceiling};
    case Material::wood:
      return {0.0025, paint_wood};
    case Material::cardboard:
      return {0.0025, paint_cardboard};
    case Material::poster:
      return {0.002, paint_poster};
    case Material::shelf:
      return {0.0025, paint_shelf};
    case Material::concrete:
      return {0.0025, paint_concrete};
    case Material::metal:
      return {0.0025, paint_metal};
    case Material::grass:
      return {0.002, paint_grass};
    case Material::gravel:
      return {0.002, paint_gravel};
    case Material::foliage:
      return {0.005, paint_foliage};
    case Material::facade:
      return {0.008, paint_facade};
    case Material::sky:
      return {0.1, paint_sky};
  }
  return {0.003, paint_wall};
}

Texture paint(const Panel& panel, double brightness, Rng& rng) {
  const Look look = look_of(panel.material);
  Canvas canvas(panel.width, panel.height, look.texel, rng);
  look.paint(canvas);
  canvas.fractal(5.0, 4.0, 0.8, 0.8);  // uneven light
  return canvas.finish(brightness);
}

// Light comes from the ceiling's lamps and a window in the east: surfaces differ by where they face.
double brightness_of(const Panel& panel) {
  const Eigen::Vector3d& n_W = panel.normal_W;
  return 1.0 + 0.14 * n_W.x() + 0.06 * n_W.y() + 0.12 * n_W.z();
}

}  // namespace

Texture paint_panel(const Panel& panel, Rng& rng) { return paint(panel, 1.0, rng); }

Appearance paint_room(const Scene& scene, std::uint64_t seed) {
  Rng rng = make_rng(seed, Stream::scene);
  const Panel ground{Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(),
                     scene.size.x(),          scene.size.y(),           scene.ground};
  Appearance appearance{{}, paint(ground, 1.12, rng)};
  for (const Panel& panel : scene.panels) appearance.panels.push_back(paint(panel, brightness_of(panel), rng));
  return appearance;
}

}  // namespace ear::simulator
