// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "python/arrays.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "risley/core/error.hpp"

namespace risley::python {
namespace {

std::string type_text(const py::handle& object) {
  return py::str(py::type::handle_of(object).attr("__name__"));
}

/// The numpy array made from it, which must be of one of the kinds b, i, u, f.
py::array numpy_array(const py::handle& values, std::string_view name, std::string_view kinds,
                      std::string_view wanted) {
  py::array array = py::array::ensure(values);
  if (!array) {
    PyErr_Clear();
    throw py::type_error(fmt::format("{} is a {}, expected {}", name, type_text(values), wanted));
  }
  const char kind =
      array.size() == 0 && py::isinstance<py::list>(values) ? 'i' : array.dtype().kind();
  if (kinds.find(kind) == std::string_view::npos) {
    throw py::type_error(fmt::format("{} has the type {}, expected {}", name,
                                     std::string(py::str(array.dtype())), wanted));
  }
  return array;
}

}  // namespace

std::string shape_text(const Shape& shape) {
  return fmt::format("({}{})", fmt::join(shape, ", "), shape.size() == 1 ? "," : "");
}

std::string shape_text(const py::array& array) { return shape_text(shape_of(array)); }

Shape shape_of(const py::array& array) { return {array.shape(), array.shape() + array.ndim()}; }

Numbers numbers_from(const py::handle& values, std::string_view name) {
  const py::array array = numpy_array(values, name, "iuf", "numbers");
  return Numbers(py::array_t<double, py::array::c_style | py::array::forcecast>(array));
}

Times times_from(const py::handle& values, std::string_view name) {
  const py::array array = numpy_array(values, name, "iu", "whole numbers");
  return Times(py::array_t<std::int64_t, py::array::c_style | py::array::forcecast>(array));
}

Bytes bytes_from(const py::handle& values, std::string_view name) {
  constexpr int kMost = 255;
  const py::array array = numpy_array(values, name, "biu", "whole numbers");
  if (py::isinstance<Bytes>(array)) return Bytes(array);
  const Times whole(py::array_t<std::int64_t, py::array::c_style | py::array::forcecast>{array});
  Bytes bytes(shape_of(array));
  for (py::ssize_t i = 0; i < whole.size(); ++i) {
    const std::int64_t value = whole.data()[i];
    if (value < 0 || value > kMost) {
      throw InvalidArgument(
          fmt::format("{} = {} in row {}, allowed 0 to {}", name, value, i, kMost));
    }
    bytes.mutable_data()[i] = static_cast<std::uint8_t>(value);
  }
  return bytes;
}

Shape broadcast_shape(const std::vector<std::pair<std::string, py::array>>& arrays) {
  Shape common;
  for (const auto& [name, array] : arrays) {
    const Shape own = shape_of(array);
    Shape wider = common.size() >= own.size() ? common : own;
    const Shape& other = common.size() >= own.size() ? own : common;
    const std::size_t skipped = wider.size() - other.size();
    for (std::size_t i = 0; i < other.size(); ++i) {
      py::ssize_t& length = wider[skipped + i];
      if (length == 1) {
        length = other[i];
      } else if (other[i] != 1 && other[i] != length) {
        throw InvalidArgument(
            fmt::format("{} has the shape {}, which does not fit {} of the argument before it",
                        name, shape_text(own), shape_text(common)));
      }
    }
    common = wider;
  }
  return common;
}

py::array broadcast_to(const py::array& array, const Shape& shape) {
  if (shape_of(array) == shape) return array;
  return py::module_::import("numpy").attr("broadcast_to")(array, shape).attr("copy")();
}

}  // namespace risley::python
