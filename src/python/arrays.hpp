// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <pybind11/numpy.h>

#include "python/bind.hpp"

namespace risley::python {

/// A column as a read-only array, without a copy. It keeps its owner alive.
/// @param owner  of the column's memory
template <class T, class Owner>
py::array_t<T> view_of(const std::vector<T>& column, const std::shared_ptr<const Owner>& owner) {
  using Held = std::shared_ptr<const Owner>;
  const py::capsule base(new Held(owner), [](void* held) { delete static_cast<Held*>(held); });
  py::array_t<T> array(static_cast<py::ssize_t>(column.size()), column.data(), base);
  array.attr("flags").attr("writeable") = false;
  return array;
}

/// An array that takes ownership of a vector.
template <class T>
py::array_t<T> array_of(std::vector<T> values) {
  auto owner = std::make_unique<std::vector<T>>(std::move(values));
  const auto size = static_cast<py::ssize_t>(owner->size());
  T* const data = owner->data();
  const py::capsule base(owner.release(),
                         [](void* held) { delete static_cast<std::vector<T>*>(held); });
  return py::array_t<T>(size, data, base);
}

/// A matrix [rows, columns], or a vector, as a separate array.
inline py::array_t<double> array_of(const Eigen::MatrixXd& matrix) {
  py::array_t<double> array({matrix.rows(), matrix.cols()});
  Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
      array.mutable_data(), matrix.rows(), matrix.cols()) = matrix;
  return array;
}

using Numbers = py::array_t<double, py::array::c_style>;
using Times = py::array_t<std::int64_t, py::array::c_style>;
using Bytes = py::array_t<std::uint8_t, py::array::c_style>;

/// Numbers of any shape; a contiguous array of double is used without a copy.
/// @throws TypeError, ValueError naming the argument
Numbers numbers_from(const py::handle& values, std::string_view name);
/// Whole numbers. @throws as numbers_from()
Times times_from(const py::handle& values, std::string_view name);
/// Whole numbers 0 to 255. @throws as numbers_from()
Bytes bytes_from(const py::handle& values, std::string_view name);

using Shape = std::vector<py::ssize_t>;
/// "(3, 4)"
std::string shape_text(const Shape& shape);
std::string shape_text(const py::array& array);
Shape shape_of(const py::array& array);

/// The common shape of arrays, as numpy broadcasts them.
/// @throws InvalidArgument naming the first that is incompatible with those before it
Shape broadcast_shape(const std::vector<std::pair<std::string, py::array>>& arrays);
/// The array in that shape, contiguous; itself if it has it.
py::array broadcast_to(const py::array& array, const Shape& shape);

inline std::span<const double> span_of(const Numbers& array) {
  return {array.data(), static_cast<std::size_t>(array.size())};
}

}  // namespace risley::python
