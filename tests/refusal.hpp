// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

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
