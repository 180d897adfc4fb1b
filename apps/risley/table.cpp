// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "table.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "command.hpp"

namespace risley::app {

Table::Table(std::vector<std::string> head) : has_head_(!head.empty()) {
  if (has_head_) rows_.push_back(std::move(head));
}

void Table::add(std::vector<std::string> row) { rows_.push_back(std::move(row)); }

void Table::print() const {
  std::vector<std::size_t> width;
  for (const auto& row : rows_) {
    width.resize(std::max(width.size(), row.size()));
    for (std::size_t i = 0; i < row.size(); ++i) width[i] = std::max(width[i], row[i].size());
  }
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    std::string line;
    for (std::size_t i = 0; i < rows_[r].size(); ++i) {
      const std::string& cell = rows_[r][i];
      if (i > 0) line += "  ";
      line += has_head_ && i > 0 ? fmt::format("{:>{}}", cell, width[i])
                                 : fmt::format("{:<{}}", cell, width[i]);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    app::say("{}\n", line);
    if (r == 0 && has_head_) app::say("{}\n", std::string(line.size(), '-'));
  }
}

}  // namespace risley::app
