#include "frontend/surface_patch.h"

#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <vector>

#include "scene.h"

namespace ear {
namespace {

// A floor 0.25 m below the first camera, and how that camera rolls towards it.
const SurfacePatch kFloor{{0.0, 4.0, 0.0}};
const Eigen::Vector2d kRay(0.1, 0.3);

Transfer forward(double distance) {
  const Eigen::AngleAxisd turn(0.02, Eigen::Vector3d(0.5, 0.7, 0.5).normalized());
  return {turn.toRotationMatrix(), Eigen::Vector3d(0.005, -0.01, -distance)};
}

Transfer chained(const Transfer& first, const Transfer& second) {
  return {second.R_10 * first.R_10, second.R_10 * first.p_10 + second.p_10};
}

// Where another camera sees what this one sees at a pixel, by way of the point in space.
Eigen::Vector2d moved(const Eigen::Vector2d& pixel, const SurfacePatch& surface, const Transfer& motion,
                      const Lens& lens) {
  const Eigen::Vector3d ray = lens.to_normalized(pixel)->homogeneous();
  const Eigen::Vector3d point = ray / surface.n.dot(ray);
  return *lens.to_pixel((motion.R_10 * point + motion.p_10).hnormalized());
}

Eigen::Vector2d seen_at(const Warp& warp, const Eigen::Vector2f& offset) {
  const float scale = 1.0F + warp.perspective.dot(offset);
  return (warp.centre + warp.affine * offset / scale).cast<double>();
}

const std::array<Eigen::Vector2f, 5> kOffsets{
    {{-7.5F, -7.5F}, {7.5F, -7.5F}, {-7.5F, 7.5F}, {7.5F, 7.5F}, {0.0F, 7.5F}}};

}  // namespace

TEST_CASE("surface patch: one through a point has its inverse depth there, and its gradient beside it") {
  const Eigen::Vector2d gradient(0.3, -0.5);
  const SurfacePatch surface = SurfacePatch::through(kRay, 2.0, gradient);
  CHECK(surface.inverse_depth(kRay) == doctest::Approx(2.0));
  const Eigen::Vector2d beside(0.02, 0.01);
  CHECK(surface.inverse_depth(kRay + beside) == doctest::Approx(2.0 + gradient.dot(beside)));
  CHECK(SurfacePatch::through(kRay, 2.0).gradient().norm() == 0.0);
}

TEST_CASE("surface patch: one that would be seen edge-on leans less, and one at infinity does not lean") {
  const SurfacePatch steep = SurfacePatch::through(kRay, 2.0, {0.0, 500.0});
  CHECK(steep.inverse_depth(kRay) == doctest::Approx(2.0));
  CHECK(steep.gradient().y() == doctest::Approx(40.0));
  CHECK(SurfacePatch::through(kRay, 0.0, {3.0, 4.0}).n.norm() == 0.0);
}

TEST_CASE("surface patch: points of its plane are on the plane that another camera sees") {
  const Transfer motion = forward(0.2);
  const auto in_other = [&](const Eigen::Vector2d& ray) -> Eigen::Vector3d {
    return motion.R_10 * ray.homogeneous() / kFloor.inverse_depth(ray) + motion.p_10;
  };
  const SurfacePatch after = kFloor.seen_after(motion, kRay, in_other(kRay).hnormalized());
  for (const Eigen::Vector2d& ray : {kRay, Eigen::Vector2d(-0.3, 0.2), Eigen::Vector2d(0.0, 0.5)}) {
    CHECK(after.n.dot(in_other(ray)) == doctest::Approx(1.0));
  }
}

TEST_CASE("surface patch: a camera that has come to its plane keeps the depth and forgets the lean") {
  const Transfer down{Eigen::Matrix3d::Identity(), {0.0, -0.24, 0.0}};
  const Eigen::Vector2d found(0.12, 0.012);
  const SurfacePatch after = kFloor.seen_after(down, kRay, found);
  CHECK(after.inverse_depth(found) == doctest::Approx(kFloor.inverse_depth(kRay)));
  CHECK(after.gradient().norm() == 0.0);
}

TEST_CASE("surface patch: a warp that is carried over puts every pixel of the patch where its point is seen") {
  for (const LensModel model : {LensModel::radial_tangential, LensModel::equidistant}) {
    const Lens lens(test_stereo_pair(model).front());
    const Warp warp{lens.to_pixel(kRay)->cast<float>()};
    const Transfer motion = forward(0.1);
    const auto carried = carry_over(warp, kRay, kFloor, motion, lens, lens);
    REQUIRE(carried);
    Warp flat = *carried;
    flat.perspective.setZero();
    double error = 0.0;
    double flat_error = 0.0;
    for (const Eigen::Vector2f& offset : kOffsets) {
      const Eigen::Vector2d truth = moved((warp.centre + offset).cast<double>(), kFloor, motion, lens);
      error = std::max(error, (seen_at(*carried, offset) - truth).norm());
      flat_error = std::max(flat_error, (seen_at(flat, offset) - truth).norm());
    }
    CHECK(error < 0.1);        // what lenses bend within a patch
    CHECK(flat_error > 0.15);  // an affine map alone
  }
}

TEST_CASE("surface patch: two motions one after the other are as good as one") {
  const Lens lens(test_stereo_pair().front());
  const Transfer first = forward(0.1);
  const Transfer second = forward(0.15);
  const Warp warp{lens.to_pixel(kRay)->cast<float>()};
  const auto halfway = carry_over(warp, kRay, kFloor, first, lens, lens);
  REQUIRE(halfway);
  const Eigen::Vector2d ray = *lens.to_normalized(halfway->centre.cast<double>());
  const auto in_steps = carry_over(*halfway, ray, kFloor.seen_after(first, kRay, ray), second, lens, lens);
  const auto at_once = carry_over(warp, kRay, kFloor, chained(first, second), lens, lens);
  REQUIRE(in_steps);
  REQUIRE(at_once);
  for (const Eigen::Vector2f& offset : kOffsets) {
    CHECK((seen_at(*in_steps, offset) - seen_at(*at_once, offset)).norm() < 0.05);
  }
}

TEST_CASE("surface patch: what comes to lie behind the camera is not carried over") {
  const Lens lens(test_stereo_pair().front());
  CHECK_FALSE(carry_over({lens.to_pixel(kRay)->cast<float>()}, kRay, kFloor, forward(1.0), lens, lens));
}

}  // namespace ear
