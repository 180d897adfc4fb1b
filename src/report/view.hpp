// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "risley/report/report_file.hpp"

namespace risley::report {

/// A value in a report, for pages. Every access throws FileError, naming the place, if the value is
/// missing or of another kind. Views do not outlive the report.
class View {
 public:
  explicit View(const Report& report) : json_(&report.json), file_(&report.path) {}

  View operator[](const std::string& key) const;
  /// Whether an object has the key with a value other than null.
  bool has(const std::string& key) const;

  double number() const;  ///< NaN where it is null
  std::uint64_t count() const;
  bool flag() const;
  const std::string& text() const;
  std::vector<View> list() const;
  std::vector<double> numbers() const;
  std::vector<std::string> texts() const;
  /// Of an object, in its order.
  std::vector<std::pair<std::string, View>> entries() const;
  std::size_t size() const { return json_->size(); }
  const json::Json& json() const { return *json_; }
  const std::string& file() const { return *file_; }   ///< for errors
  const std::string& place() const { return place_; }  ///< in the file

 private:
  View(const json::Json& json, const View& parent, std::string place)
      : json_(&json), file_(parent.file_), place_(std::move(place)) {}
  const json::Json& expect(bool right, const char* what) const;

  const json::Json* json_;
  const std::string* file_;
  std::string place_;
};

}  // namespace risley::report
