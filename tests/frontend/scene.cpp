#include "scene.h"

#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

namespace ear {
namespace {

constexpr int kSubpixels = 2;  // along each side of a pixel

struct Hit {
  double distance = std::numeric_limits<double>::infinity();  // along the ray, in units of its z
  Eigen::Vector2d texel = Eigen::Vector2d::Zero();
  const TexturedRectangle* rectangle = nullptr;
};

// A rectangle as one camera sees it: what a ray needs to be intersected.
class SeenRectangle {
 public:
  SeenRectangle(const TexturedRectangle& rectangle, const Eigen::Isometry3d& T_WC) : rectangle_(&rectangle) {
    const Eigen::Matrix3d R_CW = T_WC.linear().transpose();
    along_u_C_ = R_CW * rectangle.along_u_W;
    along_v_C_ = R_CW * rectangle.along_v_W;
    normal_C_ = along_u_C_.cross(along_v_C_);
    corner_C_ = T_WC.inverse() * rectangle.corner_W;
  }

  void intersect(const Eigen::Vector3d& ray_C, Hit& best) const {
    const double distance = normal_C_.dot(corner_C_) / normal_C_.dot(ray_C);
    if (!(distance > 1e-3 && distance < best.distance)) return;
    const Eigen::Vector3d on_C = distance * ray_C - corner_C_;
    const Eigen::Vector2d texel =
        Eigen::Vector2d(on_C.dot(along_u_C_), on_C.dot(along_v_C_)) / rectangle_->metres_per_texel;
    if (texel.minCoeff() < 0.0 || texel.x() > rectangle_->texture.cols - 2 ||
        texel.y() > rectangle_->texture.rows - 2) {
      return;
    }
    best = {distance, texel, rectangle_};
  }

 private:
  const TexturedRectangle* rectangle_;
  Eigen::Vector3d along_u_C_, along_v_C_, normal_C_, corner_C_;
};

std::vector<SeenRectangle> seen_from(const Eigen::Isometry3d& T_WC, const std::vector<TexturedRectangle>& scene) {
  std::vector<SeenRectangle> seen;
  for (const TexturedRectangle& rectangle : scene) seen.emplace_back(rectangle, T_WC);
  return seen;
}

Hit first_hit(const Eigen::Vector2d& ray, const std::vector<SeenRectangle>& scene) {
  Hit best;
  for (const SeenRectangle& rectangle : scene) rectangle.intersect(ray.homogeneous(), best);
  return best;
}

float texture_at(const Hit& hit) {
  const int u = static_cast<int>(hit.texel.x());
  const int v = static_cast<int>(hit.texel.y());
  const auto a = static_cast<float>(hit.texel.x() - u);
  const auto b = static_cast<float>(hit.texel.y() - v);
  const cv::Mat& t = hit.rectangle->texture;
  const auto at = [&](int row, int column) { return static_cast<float>(t.at<std::uint8_t>(row, column)); };
  return (1.0F - b) * ((1.0F - a) * at(v, u) + a * at(v, u + 1)) +
         b * ((1.0F - a) * at(v + 1, u) + a * at(v + 1, u + 1));
}

}  // namespace

cv::Mat random_texture(int width, int height, unsigned seed, double contrast) {
  std::mt19937 random(seed);
  cv::Mat sum = cv::Mat::zeros(height, width, CV_32F);
  for (const double scale : {1.5, 4.0, 12.0}) {
    cv::Mat noise(height, width, CV_32F);
    for (int row = 0; row < height; ++row) {
      for (int column = 0; column < width; ++column) {
        noise.at<float>(row, column) = static_cast<float>(random() % 2048) / 1024.0F - 1.0F;
      }
    }
    cv::GaussianBlur(noise, noise, cv::Size(), scale);
    cv::Scalar mean, deviation;
    cv::meanStdDev(noise, mean, deviation);
    sum += noise / deviation[0];
  }
  cv::Mat texture;
  sum.convertTo(texture, CV_8U, 28.0 * contrast, 128.0);
  return texture;
}

Camera::Camera(const CameraCalibration& calibration)
    : calibration_(calibration), rays_(calibration.height * kSubpixels, calibration.width * kSubpixels, CV_64FC2) {
  const Lens lens(calibration);
  for (int row = 0; row < rays_.rows; ++row) {
    for (int column = 0; column < rays_.cols; ++column) {
      const Eigen::Vector2d pixel((column + 0.5) / kSubpixels - 0.5, (row + 0.5) / kSubpixels - 0.5);
      const auto ray = lens.to_normalized(pixel);
      const double none = std::numeric_limits<double>::quiet_NaN();
      rays_.at<cv::Vec2d>(row, column) = ray ? cv::Vec2d(ray->x(), ray->y()) : cv::Vec2d(none, none);
    }
  }
}

cv::Mat Camera::render(const Eigen::Isometry3d& T_WB, const std::vector<TexturedRectangle>& scene) const {
  const std::vector<SeenRectangle> seen = seen_from(T_WB * calibration_.T_BC, scene);
  cv::Mat fine(rays_.size(), CV_32F);
  for (int row = 0; row < fine.rows; ++row) {
    for (int column = 0; column < fine.cols; ++column) {
      const cv::Vec2d& ray = rays_.at<cv::Vec2d>(row, column);
      const Hit hit = first_hit({ray[0], ray[1]}, seen);
      fine.at<float>(row, column) = hit.rectangle != nullptr ? texture_at(hit) : 128.0F;
    }
  }
  cv::Mat mean;
  cv::resize(fine, mean, cv::Size(calibration_.width, calibration_.height), 0.0, 0.0, cv::INTER_AREA);
  cv::Mat image;
  mean.convertTo(image, CV_8U);
  return image;
}

void add_noise(cv::Mat& image, double sigma, std::mt19937& random) {
  std::normal_distribution<double> noise(0.0, sigma);
  for (int row = 0; row < image.rows; ++row) {
    for (int column = 0; column < image.cols; ++column) {
      auto& pixel = image.at<std::uint8_t>(row, column);
      pixel = cv::saturate_cast<std::uint8_t>(pixel + noise(random));
    }
  }
}

void add_noise(cv::Mat& image, const Noise& noise, std::mt19937& random) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  for (int row = 0; row < image.rows; ++row) {
    const double offset = noise.row * normal(random);
    for (int column = 0; column < image.cols; ++column) {
      auto& pixel = image.at<std::uint8_t>(row, column);
      const double heat = uniform(random) < noise.hot_share ? 150.0 * uniform(random) : 0.0;
      pixel = cv::saturate_cast<std::uint8_t>(pixel + offset + heat + noise.pixel * normal(random));
    }
  }
}

std::vector<CameraCalibration> test_stereo_pair(LensModel lens) {
  CameraCalibration left;
  left.width = 320;
  left.height = 240;
  left.fu = 200.0;
  left.fv = 201.0;
  left.cu = 158.3;
  left.cv = 121.7;
  left.lens = lens;
  left.distortion = lens == LensModel::equidistant ? std::array<double, 5>{-0.01, 0.02, -0.01, 0.002}
                                                   : std::array<double, 5>{-0.05, 0.04, 0.0006, -0.0004};
  CameraCalibration right = left;
  right.fu = 201.5;
  right.cu = 161.2;
  right.T_BC = Eigen::Translation3d(0.08, 0.001, -0.0005) *
               Eigen::AngleAxisd(0.01, Eigen::Vector3d(0.3, 0.8, -0.5).normalized());
  return {left, right};
}

std::optional<Eigen::Vector3d> hit(const Eigen::Isometry3d& T_WC, const Eigen::Vector2d& ray,
                                   const std::vector<TexturedRectangle>& scene) {
  const Hit first = first_hit(ray, seen_from(T_WC, scene));
  if (first.rectangle == nullptr) return std::nullopt;
  return T_WC * Eigen::Vector3d(first.distance * ray.homogeneous());
}

ImageView view_of(const cv::Mat& image) {
  return {image.data, image.cols, image.rows, static_cast<std::ptrdiff_t>(image.step[0])};
}

MotionPrediction exact_motion(const Eigen::Isometry3d& T_WB0, const Eigen::Isometry3d& T_WB1) {
  const Eigen::Isometry3d T_B0B1 = T_WB0.inverse() * T_WB1;
  return {T_B0B1.linear().transpose(), T_B0B1.translation(), true, true};
}

TexturedRectangle wall(double distance, unsigned seed) {
  TexturedRectangle rectangle;
  rectangle.metres_per_texel = 0.004 * distance;  // about a pixel of the test cameras
  rectangle.texture = random_texture(1000, 800, seed);
  rectangle.corner_W =
      Eigen::Vector3d(-500.0 * rectangle.metres_per_texel, -400.0 * rectangle.metres_per_texel, distance);
  return rectangle;
}

TexturedRectangle floor_below(double height, unsigned seed) {
  TexturedRectangle rectangle;
  rectangle.metres_per_texel = 0.002;
  rectangle.texture = random_texture(1000, 1500, seed);
  rectangle.corner_W = {-1.0, height, 0.1};
  rectangle.along_v_W = Eigen::Vector3d::UnitZ();
  return rectangle;
}

}  // namespace ear
