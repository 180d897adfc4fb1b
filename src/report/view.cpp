// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "report/view.hpp"

#include <limits>

#include <fmt/format.h>

#include "risley/core/error.hpp"

namespace risley::report {

const json::Json& View::expect(bool right, const char* what) const {
  if (right) return *json_;
  throw FileError(*file_, {},
                  fmt::format("{}: expected {}, found {}", place_, what, json_->type_name()));
}

View View::operator[](const std::string& key) const {
  expect(json_->is_object(), "an object");
  const std::string place = place_.empty() ? key : place_ + "." + key;
  const auto found = json_->find(key);
  if (found == json_->end()) throw FileError(*file_, {}, place + " is missing");
  return {*found, *this, place};
}

bool View::has(const std::string& key) const {
  const auto found = expect(json_->is_object(), "an object").find(key);
  return found != json_->end() && !found->is_null();
}

double View::number() const {
  if (json_->is_null()) return std::numeric_limits<double>::quiet_NaN();
  return expect(json_->is_number(), "a number").get<double>();
}

std::uint64_t View::count() const {
  const bool right = json_->is_number_unsigned() ||
                     (json_->is_number_integer() && json_->get<std::int64_t>() >= 0);
  return expect(right, "a count").get<std::uint64_t>();
}

bool View::flag() const { return expect(json_->is_boolean(), "true or false").get<bool>(); }

const std::string& View::text() const {
  return expect(json_->is_string(), "a text").get_ref<const std::string&>();
}

std::vector<View> View::list() const {
  std::vector<View> list;
  for (const json::Json& one : expect(json_->is_array(), "a list")) {
    list.push_back({one, *this, fmt::format("{}[{}]", place_, list.size())});
  }
  return list;
}

std::vector<double> View::numbers() const {
  std::vector<double> numbers;
  for (const View& one : list()) numbers.push_back(one.number());
  return numbers;
}

std::vector<std::string> View::texts() const {
  std::vector<std::string> texts;
  for (const View& one : list()) texts.push_back(one.text());
  return texts;
}

std::vector<std::pair<std::string, View>> View::entries() const {
  std::vector<std::pair<std::string, View>> entries;
  for (const auto& [name, one] : expect(json_->is_object(), "an object").items()) {
    entries.emplace_back(name, View(one, *this, place_ + "." + name));
  }
  return entries;
}

}  // namespace risley::report
