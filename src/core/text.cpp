// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/core/text.hpp"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <fmt/format.h>

namespace risley {
namespace {

bool is_mark(char c) { return c == '-' || c == '_' || c == ' '; }

/// In lower case and without joining characters.
std::string letters_of(std::string_view text) {
  std::string letters = lower_case(std::string(text));
  std::erase_if(letters, is_mark);
  return letters;
}

/// The least number of changed, missing, added and swapped letters.
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

/// A character of UTF-8 at the front of a text.
struct Utf8Character {
  std::uint32_t code = 0;
  std::size_t bytes = 0;  ///< 0 where there is none
};

Utf8Character first_character(std::string_view text) {
  constexpr std::uint32_t kLeast[] = {0, 0, 0x80, 0x800, 0x10000};  // by the number of bytes
  constexpr std::uint32_t kGreatest = 0x10ffff, kFirstSurrogate = 0xd800, kLastSurrogate = 0xdfff;
  const auto byte = [text](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char lead = byte(0);
  if (lead < 0x80U) return {lead, 1};
  const std::size_t bytes = lead >= 0xf0U ? 4 : lead >= 0xe0U ? 3 : 2;
  if (lead < 0xc0U || lead > 0xf7U || text.size() < bytes) return {};
  std::uint32_t code = lead & (0x7fU >> bytes);
  for (std::size_t i = 1; i < bytes; ++i) {
    if ((byte(i) & 0xc0U) != 0x80U) return {};
    code = code << 6U | (byte(i) & 0x3fU);
  }
  const bool surrogate = code >= kFirstSurrogate && code <= kLastSurrogate;
  if (code < kLeast[bytes] || code > kGreatest || surrogate) return {};
  return {code, bytes};
}

/// Control characters of C0 and C1, line separators, and marks of the direction of writing.
bool is_obeyed(std::uint32_t code) {
  return code < 0x20 || (code >= 0x7f && code <= 0x9f) || (code >= 0x2028 && code <= 0x202e) ||
         (code >= 0x2066 && code <= 0x2069);
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
  if (!best.empty() || wanted.empty()) return best;
  for (const std::string& name : names) {
    if (name.size() > word.size() && name.starts_with(word) && is_mark(name[word.size()])) {
      return name;
    }
  }
  return {};
}

std::string did_you_mean(std::string_view word, std::span<const std::string> names) {
  const std::string meant = near_miss(word, names);
  return meant.empty() ? "" : fmt::format(", did you mean {}?", meant);
}

std::string printable(std::string_view text, bool lines) {
  std::string shown;
  shown.reserve(text.size());
  while (!text.empty()) {
    const Utf8Character first = first_character(text);
    const bool stays = first.code == '\t' || (lines && first.code == '\n');
    if (first.bytes == 0) {
      shown += fmt::format("\\x{:02x}", static_cast<unsigned char>(text.front()));
    } else if (is_obeyed(first.code) && !stays) {
      shown += fmt::format("\\u{:04x}", first.code);
    } else {
      shown += text.substr(0, first.bytes);
    }
    text.remove_prefix(std::max<std::size_t>(first.bytes, 1));
  }
  return shown;
}

std::string grouped(std::uint64_t number) {
  const std::string digits = std::to_string(number);
  std::string text;
  for (std::size_t i = 0; i < digits.size(); ++i) {
    if (i > 0 && (digits.size() - i) % 3 == 0) text += ' ';
    text += digits[i];
  }
  return text;
}

}  // namespace risley
