// Values between C++ and Python. What does not fit is refused in words: the field, what was expected, what came.
//
// from_python<T>(object, name) and to_python(value) know numbers, text, choices, fixed Eigen types, optionals, arrays
// and vectors of these, and every class that is bound. Vectors and matrices are NumPy arrays of float64.
#pragma once

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace ear::python {

namespace py = pybind11;

/// What came, for messages: "float 1.5", "an array of float32 with the shape (3, 2)".
[[nodiscard]] std::string described(py::handle given);

/// Throws TypeError: "name: expected ..., got ...".
[[noreturn]] void refuse(const std::string& name, const std::string& expected, py::handle given);

/// An integer of Python or NumPy; a float is none, nor is a bool. Throws TypeError, and OverflowError beyond 64 bits.
[[nodiscard]] std::int64_t integer_from(py::handle given, const std::string& name);

/// A number that is not complex. Throws TypeError.
[[nodiscard]] double number_from(py::handle given, const std::string& name);

/// A str or an os.PathLike. Throws TypeError.
[[nodiscard]] std::filesystem::path path_from(py::handle given, const std::string& name);

/// Numbers of any real type as float64, in rows: `rows` x `columns`, or for `columns` 0 a list of `rows`. A negative
/// number of rows is any. Throws TypeError.
[[nodiscard]] py::array_t<double> numbers_from(py::handle given, py::ssize_t rows, py::ssize_t columns,
                                               const std::string& name);

/// As a settings file or a calibration shows it: one line per field, what is inside indented.
[[nodiscard]] std::string text_of(py::handle fields, const std::string& indent = "");

template <typename T>
struct IsOptional : std::false_type {};
template <typename T>
struct IsOptional<std::optional<T>> : std::true_type {};
template <typename T>
struct IsVector : std::false_type {};
template <typename T>
struct IsVector<std::vector<T>> : std::true_type {};
template <typename T>
struct IsArray : std::false_type {};
template <typename T, std::size_t N>
struct IsArray<std::array<T, N>> : std::true_type {};

template <typename T>
inline constexpr bool kIsEigen = std::is_base_of_v<Eigen::MatrixBase<T>, T>;

template <typename T>
[[nodiscard]] py::object to_python(const T& value) {
  if constexpr (IsOptional<T>::value) {
    return value ? to_python(*value) : py::none();
  } else if constexpr (std::is_same_v<T, Eigen::Isometry3d>) {
    return py::cast(Eigen::Matrix4d(value.matrix()));
  } else if constexpr (std::is_same_v<T, Eigen::Quaterniond>) {
    return py::cast(Eigen::Vector4d(value.w(), value.x(), value.y(), value.z()));
  } else if constexpr (IsArray<T>::value || IsVector<T>::value) {
    py::tuple list(value.size());
    for (std::size_t i = 0; i < value.size(); ++i) list[i] = to_python(typename T::value_type(value[i]));
    return list;
  } else {
    return py::cast(value);
  }
}

namespace detail {

template <typename T>
[[nodiscard]] T eigen_from(py::handle given, const std::string& name) {
  constexpr bool kColumn = T::ColsAtCompileTime == 1;
  const py::array_t<double> numbers =
      numbers_from(given, T::RowsAtCompileTime, kColumn ? 0 : T::ColsAtCompileTime, name);
  T value;
  for (py::ssize_t row = 0; row < value.rows(); ++row) {
    for (py::ssize_t column = 0; column < value.cols(); ++column) {
      value(row, column) = numbers.data()[row * value.cols() + column];
    }
  }
  return value;
}

template <typename T>
[[nodiscard]] T integral_from(py::handle given, const std::string& name) {
  const std::int64_t value = integer_from(given, name);
  if (value < std::numeric_limits<T>::min() || value > std::numeric_limits<T>::max()) {
    refuse(name, "an integer that fits", given);
  }
  return static_cast<T>(value);
}

template <>
[[nodiscard]] inline std::uint64_t integral_from(py::handle given, const std::string& name) {
  const std::int64_t value = integer_from(given, name);
  if (value < 0) refuse(name, "an integer that is not negative", given);
  return static_cast<std::uint64_t>(value);
}

}  // namespace detail

template <typename T>
[[nodiscard]] T from_python(py::handle given, const std::string& name);

namespace detail {

/// Items of a list, tuple or array.
template <typename T>
[[nodiscard]] std::vector<T> items_from(py::handle given, const std::string& name) {
  if (!py::isinstance<py::sequence>(given) && !py::isinstance<py::array>(given)) refuse(name, "a sequence", given);
  if (py::isinstance<py::str>(given)) refuse(name, "a sequence, which text is not", given);
  std::vector<T> items;
  for (const py::handle item : given) {
    items.push_back(from_python<T>(item, name + "[" + std::to_string(items.size()) + "]"));
  }
  return items;
}

}  // namespace detail

template <typename T>
T from_python(py::handle given, const std::string& name) {
  if constexpr (IsOptional<T>::value) {
    return given.is_none() ? T{} : T{from_python<typename T::value_type>(given, name)};
  } else if constexpr (std::is_same_v<T, bool>) {
    if (!py::isinstance<py::bool_>(given)) refuse(name, "True or False", given);
    return given.cast<bool>();
  } else if constexpr (std::is_integral_v<T>) {
    return detail::integral_from<T>(given, name);
  } else if constexpr (std::is_same_v<T, double>) {
    return number_from(given, name);
  } else if constexpr (std::is_same_v<T, std::string>) {
    if (!py::isinstance<py::str>(given)) refuse(name, "text", given);
    return given.cast<std::string>();
  } else if constexpr (std::is_same_v<T, std::filesystem::path>) {
    return path_from(given, name);
  } else if constexpr (std::is_same_v<T, Eigen::Isometry3d>) {
    Eigen::Isometry3d isometry;
    isometry.matrix() = detail::eigen_from<Eigen::Matrix4d>(given, name);
    return isometry;
  } else if constexpr (std::is_same_v<T, Eigen::Quaterniond>) {
    const auto wxyz = detail::eigen_from<Eigen::Vector4d>(given, name);
    return Eigen::Quaterniond(wxyz(0), wxyz(1), wxyz(2), wxyz(3));
  } else if constexpr (kIsEigen<T>) {
    return detail::eigen_from<T>(given, name);
  } else if constexpr (IsVector<T>::value) {
    return detail::items_from<typename T::value_type>(given, name);
  } else if constexpr (IsArray<T>::value) {
    const auto items = detail::items_from<typename T::value_type>(given, name);
    T value{};
    if (items.size() != value.size()) refuse(name, std::to_string(value.size()) + " values", given);
    std::copy(items.begin(), items.end(), value.begin());
    return value;
  } else {
    if (!py::isinstance<T>(given))
      refuse(name, "an " + py::type::of<T>().attr("__name__").template cast<std::string>(), given);
    return given.cast<T>();
  }
}

}  // namespace ear::python
