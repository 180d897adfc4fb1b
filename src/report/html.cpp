// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/html.hpp"

#include <cmath>

#include <fmt/format.h>

#include "risley/core/number_text.hpp"

namespace risley::report {

std::string escape_html(std::string_view text) {
  std::string html;
  for (const char c : text) {
    switch (c) {
      case '&':
        html += "&amp;";
        break;
      case '<':
        html += "&lt;";
        break;
      case '>':
        html += "&gt;";
        break;
      case '"':
        html += "&quot;";
        break;
      case '\'':
        html += "&#39;";
        break;
      default:
        html += c;
    }
  }
  return html;
}

std::string count_text(std::uint64_t count) {
  std::string digits = std::to_string(count), text;
  for (std::size_t i = 0; i < digits.size(); ++i) {
    if (i > 0 && (digits.size() - i) % 3 == 0) text += "\u202f";
    text += digits[i];
  }
  return text;
}

std::string finite_text(std::string_view format, double value) {
  if (!std::isfinite(value)) return "–";
  return without_minus_zero(fmt::vformat(format, fmt::make_format_args(value)));
}

std::string millimetres(double metres) { return finite_text("{:.1f}", kMillimetres * metres); }

}  // namespace risley::report
