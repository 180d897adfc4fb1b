// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

namespace risley::report {

// Structs to JSON and back. What a struct holds is listed once for both directions:
//   template <class Archive, FieldsOf<Moments> T>
//   void fields(Archive& archive, T& moments) { archive("mean", moments.mean); ... }
// and an enumeration gives its names:
//   std::span<const char* const> enum_names(SeriesKind);
// A number that is not finite is null.

using Json = nlohmann::ordered_json;

template <class T, class Struct>
concept FieldsOf = std::same_as<std::remove_const_t<T>, Struct>;

/// A field that is missing or of another kind; the message names it.
class FieldError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

template <class T>
Json to_json(const T& value);
/// @param place  name of the value, for messages  @throws FieldError
template <class T>
void from_json(const Json& json, const std::string& place, T& value);

/// Puts fields into an object.
class FieldWriter {
 public:
  explicit FieldWriter(Json& object) : object_(object) {}
  template <class T>
  void operator()(const char* name, const T& value) {
    object_[name] = to_json(value);
  }

 private:
  Json& object_;
};

namespace archive {

template <class T>
struct IsVector : std::false_type {};
template <class T>
struct IsVector<std::vector<T>> : std::true_type {};
template <class T>
struct IsOptional : std::false_type {};
template <class T>
struct IsOptional<std::optional<T>> : std::true_type {};
template <class T>
struct IsPair : std::false_type {};
template <class A, class B>
struct IsPair<std::pair<A, B>> : std::true_type {};

inline void expect(bool right, const std::string& place, const char* what, const Json& found) {
  if (!right) {
    throw FieldError(place + ": expected " + what + ", found " + std::string(found.type_name()));
  }
}

}  // namespace archive

/// Takes fields from an object.
class FieldReader {
 public:
  FieldReader(const Json& object, std::string place) : object_(object), place_(std::move(place)) {}
  template <class T>
  void operator()(const char* name, T& value) {
    const std::string place = place_.empty() ? name : place_ + "." + name;
    const auto found = object_.find(name);
    if (found == object_.end()) {
      // What older versions did not write yet.
      if constexpr (archive::IsOptional<T>::value) return value.reset();
      throw FieldError(place + " is missing");
    }
    from_json(*found, place, value);
  }

 private:
  const Json& object_;
  std::string place_;
};

template <class T>
Json to_json(const T& value) {
  if constexpr (std::is_enum_v<T>) {
    return enum_names(value)[static_cast<std::size_t>(value)];
  } else if constexpr (std::is_floating_point_v<T>) {
    return std::isfinite(value) ? Json(value) : Json(nullptr);
  } else if constexpr (std::is_arithmetic_v<T> || std::same_as<T, std::string>) {
    return value;
  } else if constexpr (archive::IsVector<T>::value) {
    Json array = Json::array();
    for (const auto& one : value) array.push_back(to_json(one));
    return array;
  } else if constexpr (archive::IsOptional<T>::value) {
    return value ? to_json(*value) : Json(nullptr);
  } else if constexpr (archive::IsPair<T>::value) {
    return Json::array({to_json(value.first), to_json(value.second)});
  } else if constexpr (std::same_as<T, Eigen::MatrixXd>) {
    Json rows = Json::array();
    for (Eigen::Index i = 0; i < value.rows(); ++i) {
      rows.push_back(Json::array());
      for (Eigen::Index j = 0; j < value.cols(); ++j) rows.back().push_back(to_json(value(i, j)));
    }
    return rows;
  } else {
    Json object = Json::object();
    FieldWriter writer(object);
    fields(writer, value);
    return object;
  }
}

template <class T>
void from_json(const Json& json, const std::string& place, T& value) {
  using archive::expect;
  if constexpr (std::is_enum_v<T>) {
    expect(json.is_string(), place, "a name", json);
    const auto names = enum_names(value);
    const auto& name = json.get_ref<const std::string&>();
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (name != names[i]) continue;
      value = static_cast<T>(i);
      return;
    }
    throw FieldError(place + ": unknown name '" + name + "'");
  } else if constexpr (std::is_floating_point_v<T>) {
    expect(json.is_number() || json.is_null(), place, "a number or null", json);
    value = json.is_null() ? std::numeric_limits<T>::quiet_NaN() : json.get<T>();
  } else if constexpr (std::same_as<T, bool>) {
    expect(json.is_boolean(), place, "true or false", json);
    value = json.get<bool>();
  } else if constexpr (std::is_integral_v<T>) {
    expect(json.is_number_integer(), place, "a whole number", json);
    const bool fits = json.is_number_unsigned() ? std::in_range<T>(json.get<std::uint64_t>())
                                                : std::in_range<T>(json.get<std::int64_t>());
    if (!fits) throw FieldError(place + ": " + json.dump() + " is out of range");
    value = json.get<T>();
  } else if constexpr (std::same_as<T, std::string>) {
    expect(json.is_string(), place, "a text", json);
    value = json.get<std::string>();
  } else if constexpr (archive::IsVector<T>::value) {
    expect(json.is_array(), place, "a list", json);
    value.clear();
    for (std::size_t i = 0; i < json.size(); ++i) {
      typename T::value_type one{};
      from_json(json[i], place + "[" + std::to_string(i) + "]", one);
      value.push_back(std::move(one));
    }
  } else if constexpr (archive::IsOptional<T>::value) {
    value.reset();
    if (json.is_null()) return;
    typename T::value_type one{};
    from_json(json, place, one);
    value = std::move(one);
  } else if constexpr (archive::IsPair<T>::value) {
    expect(json.is_array() && json.size() == 2, place, "a pair", json);
    from_json(json[0], place + "[0]", value.first);
    from_json(json[1], place + "[1]", value.second);
  } else if constexpr (std::same_as<T, Eigen::MatrixXd>) {
    std::vector<std::vector<double>> rows;
    from_json(json, place, rows);
    const std::size_t columns = rows.empty() ? 0 : rows.front().size();
    value.resize(static_cast<Eigen::Index>(rows.size()), static_cast<Eigen::Index>(columns));
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (rows[i].size() != columns) throw FieldError(place + ": rows of different lengths");
      for (std::size_t j = 0; j < columns; ++j) {
        value(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = rows[i][j];
      }
    }
  } else {
    expect(json.is_object(), place, "an object", json);
    FieldReader reader(json, place);
    fields(reader, value);
  }
}

}  // namespace risley::report
