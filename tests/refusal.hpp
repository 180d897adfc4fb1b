// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cctype>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <ostream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/error.hpp"

namespace risley {

/// The message of the error that a call throws, "" without one.
template <class Exception = InvalidArgument, class Call>
std::string refusal(Call&& call) {
  try {
    call();
  } catch (const Exception& error) {
    return error.what();
  }
  return {};
}

/// "line: problem" of the FileError that a call throws, "" without one.
template <class Call>
std::string line_and_problem(Call&& call) {
  try {
    call();
  } catch (const FileError& error) {
    return std::to_string(error.place().line.value_or(0)) + ": " + error.problem();
  }
  return {};
}

/// Matches a message that names a field, parameter, column or the like as a whole, whatever its
/// other words; with a line from 1 on also "line N" or "N: ", as line_and_problem() begins.
struct NamesField {
  using is_gtest_matcher = void;

  explicit NamesField(std::string named, std::uint64_t in_line = 0)
      : field(std::move(named)), line(in_line) {}

  bool MatchAndExplain(std::string_view message, std::ostream*) const {
    const std::string number = std::to_string(line);
    if (line > 0 && message.find(number + ": ") == message.npos &&
        message.find("line " + number) == message.npos) {
      return false;
    }
    for (std::size_t at = message.find(field); at != message.npos;
         at = message.find(field, at + 1)) {
      const std::size_t end = at + field.size();
      const auto is_part = [](char c) {
        return std::isalnum(static_cast<unsigned char>(c)) || c == '_';
      };
      if (end == message.size() || !is_part(message[end])) return true;
    }
    return false;
  }
  void DescribeTo(std::ostream* stream) const {
    *stream << "names " << field;
    if (line > 0) *stream << " of line " << line;
  }
  void DescribeNegationTo(std::ostream* stream) const { *stream << "does not name " << field; }

  std::string field;
  std::uint64_t line;
};

/// A text with its first `what` replaced.
inline std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return at == std::string::npos ? text : text.replace(at, what.size(), by);
}

/// Expects a call to be refused with these words, or, if they end with "...", with words that begin
/// so; "" is no refusal.
inline void expect_refusal(std::string_view words, const std::function<void()>& call) {
  const std::string said = refusal(call);
  if (words.ends_with("...")) {
    words.remove_suffix(3);
    EXPECT_TRUE(said.starts_with(words)) << said << "\nexpected " << words;
  } else {
    EXPECT_EQ(said, words);
  }
}

/// Calls, each with the words that it is refused with, as expect_refusal().
struct Refused {
  std::string_view words;
  std::function<void()> call;
};
inline void expect_refusals(const std::vector<Refused>& all) {
  for (const Refused& one : all) expect_refusal(one.words, one.call);
}

/// As above, of subject.run() after each change of a new subject.
template <class Subject>
struct RefusedAfter {
  std::string_view words;
  std::function<void(Subject& subject)> change;
};
template <class Subject>
void expect_refusals(const std::vector<RefusedAfter<Subject>>& all) {
  for (const RefusedAfter<Subject>& one : all) {
    Subject subject;
    one.change(subject);
    expect_refusal(one.words, [&] { subject.run(); });
  }
}

}  // namespace risley
