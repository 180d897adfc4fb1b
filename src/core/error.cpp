// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/core/error.hpp"

#include <fmt/format.h>

namespace risley {
namespace {

std::string message(const std::string& path, const FilePlace& place, const std::string& problem) {
  if (place.byte_offset) return fmt::format("{}: byte {}: {}", path, *place.byte_offset, problem);
  if (place.line) return fmt::format("{}: line {}: {}", path, *place.line, problem);
  return fmt::format("{}: {}", path, problem);
}

}  // namespace

FileError::FileError(std::string path, FilePlace place, std::string problem)
    : Error(message(path, place, problem)),
      path_(std::move(path)),
      place_(place),
      problem_(std::move(problem)) {}

}  // namespace risley
