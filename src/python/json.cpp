// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "python/json.hpp"

#include <cmath>
#include <cstdint>

#include <nlohmann/json.hpp>

namespace risley::python {
namespace {

py::str text_of(const std::string& text) {
  PyObject* decoded =
      PyUnicode_DecodeUTF8(text.data(), static_cast<py::ssize_t>(text.size()), "replace");
  if (decoded == nullptr) throw py::error_already_set();
  return py::reinterpret_steal<py::str>(decoded);
}

}  // namespace

py::object python_of(const json::Json& value) {
  using Kind = json::Json::value_t;
  switch (value.type()) {
    case Kind::object: {
      py::dict object;
      for (const auto& [key, one] : value.items()) object[text_of(key)] = python_of(one);
      return object;
    }
    case Kind::array: {
      py::list list;
      for (const json::Json& one : value) list.append(python_of(one));
      return list;
    }
    case Kind::string:
      return text_of(value.get_ref<const std::string&>());
    case Kind::boolean:
      return py::bool_(value.get<bool>());
    case Kind::number_integer:
      return py::int_(value.get<std::int64_t>());
    case Kind::number_unsigned:
      return py::int_(value.get<std::uint64_t>());
    case Kind::number_float: {
      // As in a file, which cannot hold non-finite numbers.
      const double number = value.get<double>();
      if (!std::isfinite(number)) return py::none();
      return py::float_(number);
    }
    default:
      return py::none();
  }
}

py::object dict_of(const json::Json& found) {
  json::Json whole = {{"format_version", json::kFormatVersion}, {"version", RISLEY_VERSION}};
  whole.update(found);
  return python_of(whole);
}

}  // namespace risley::python
