// Images between NumPy and the estimator, without a copy in either direction.
#pragma once

#include <memory>
#include <string>

#include "ear/calibration.h"
#include "ear/types.h"
#include "python/binding/convert.h"

namespace ear::python {

/// A view of an array's pixels, valid as long as the array is. It may be read-only, and rows may be apart, as in a part
/// of a larger image. None is an empty view. Throws TypeError for what is no 2-D array of uint8 and ValueError for
/// pixels of a row that are not side by side, both in words.
[[nodiscard]] ImageView view_of(py::handle image, const std::string& name);

/// Throws ValueError unless the image is of the camera's size; an empty one fits, and so does one without a camera.
void require_size(const ImageView& image, const Calibration& calibration, std::size_t camera, const std::string& name);

/// A read-only array of these pixels, which `owner` keeps; None for an empty view.
[[nodiscard]] py::object array_of(const ImageView& image, std::shared_ptr<const void> owner);

}  // namespace ear::python
