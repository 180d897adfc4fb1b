// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>

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

}  // namespace risley
