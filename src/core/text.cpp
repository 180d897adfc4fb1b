// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/core/text.hpp"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <vector>

namespace risley {
namespace {

/// In lower case and without what joins words.
std::string letters_of(std::string_view text) {
  std::string letters = lower_case(std::string(text));
  std::erase_if(letters, [](char c) { return c == '-' || c == '_' || c == ' '; });
  return letters;
}

/// Changed, missing, added and swapped letters, counted as few as possible.
std::size_t distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> before, last(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) last[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t changed = last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, changed});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        row[j] = std::min(row[j], before[j - 2] + 1);
      }
    }
    before = last;
    last = row;
  }
  return last.back();
}

}  // namespace

std::string lower_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

std::string near_miss(std::string_view word, std::span<const std::string> names) {
  constexpr std::size_t kLongest = 64;  // of what could be meant
  if (word.size() > kLongest) return {};
  const std::string wanted = letters_of(word);
  std::string best;
  std::size_t least = kLongest;
  for (const std::string& name : names) {
    const std::string known = letters_of(name);
    const std::size_t apart = distance(wanted, known);
    if (3 * apart <= known.size() && apart < least) {
      least = apart;
      best = name;
    }
  }
  return best;
}

}  // namespace risley
