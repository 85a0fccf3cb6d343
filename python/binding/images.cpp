#include "python/binding/images.h"

#include <utility>

namespace ear::python {
namespace {

std::string size_text(py::ssize_t height, py::ssize_t width) {
  return std::to_string(height) + "x" + std::to_string(width);
}

}  // namespace

ImageView view_of(py::handle image, const std::string& name) {
  if (image.is_none()) return {};
  if (!py::isinstance<py::array>(image)) refuse(name, "a NumPy array of uint8 with the shape (height, width)", image);
  const auto array = image.cast<py::array>();
  if (array.ndim() != 2 || !array.dtype().is(py::dtype::of<std::uint8_t>()) || array.size() == 0) {
    refuse(name, "a NumPy array of uint8 with the shape (height, width)", image);
  }
  const py::ssize_t height = array.shape(0), width = array.shape(1);
  const bool side_by_side = width == 1 || array.strides(1) == 1;
  if (!side_by_side || (height > 1 && array.strides(0) < width)) {
    throw py::value_error(name + ": expected pixels of a row side by side and rows in order, got strides of (" +
                          std::to_string(array.strides(0)) + ", " + std::to_string(array.strides(1)) +
                          ") bytes; numpy.ascontiguousarray() makes such an array");
  }
  constexpr py::ssize_t kLargest = std::numeric_limits<int>::max();
  if (height > kLargest || width > kLargest) refuse(name, "an image", image);
  return {static_cast<const std::uint8_t*>(array.data()), static_cast<int>(width), static_cast<int>(height),
          height > 1 ? array.strides(0) : width};
}

void require_size(const ImageView& image, const Calibration& calibration, std::size_t camera, const std::string& name) {
  if (image.empty() || camera >= calibration.cameras.size()) return;
  const CameraCalibration& expected = calibration.cameras[camera];
  if (image.width == expected.width && image.height == expected.height) return;
  throw py::value_error(name + ": expected " + size_text(expected.height, expected.width) +
                        " (height x width) as camera " + std::to_string(camera) + " is calibrated, got " +
                        size_text(image.height, image.width));
}

py::object array_of(const ImageView& image, std::shared_ptr<const void> owner) {
  if (image.empty()) return py::none();
  using Owner = std::shared_ptr<const void>;
  const py::capsule keeper(new Owner(std::move(owner)), [](void* kept) { delete static_cast<Owner*>(kept); });
  py::array array(py::dtype::of<std::uint8_t>(), {py::ssize_t{image.height}, py::ssize_t{image.width}},
                  {static_cast<py::ssize_t>(image.stride), py::ssize_t{1}}, image.data, keeper);
  array.attr("setflags")(py::arg("write") = false);  // others may share these pixels
  return std::move(array);
}

}  // namespace ear::python
