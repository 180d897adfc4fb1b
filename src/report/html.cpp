// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/html.hpp"

#include <algorithm>
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
  const std::string text = fmt::vformat(format, fmt::make_format_args(value));
  const std::size_t mark = text.find('e');
  if (mark == std::string::npos) return without_minus_zero(text);
  const auto digits = std::count_if(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(mark),
                                    [](char c) { return c >= '0' && c <= '9'; });
  return plain_text(value, static_cast<int>(digits));
}

std::string millimetres(double metres) { return finite_text("{:.1f}", kMillimetres * metres); }

}  // namespace risley::report
