// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

namespace risley::app {

/// Text in columns for people: the first column is left-aligned, the others right.
class Table {
 public:
  /// @param head  empty for a table of names and values; then all columns are left-aligned
  explicit Table(std::vector<std::string> head = {});
  void add(std::vector<std::string> row);
  /// Prints on stdout.
  void print() const;

 private:
  bool has_head_;
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace risley::app
