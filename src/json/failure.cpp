// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <nlohmann/json.hpp>

#include "risley/core/error.hpp"
#include "risley/json/results.hpp"

namespace risley::json {

Json of(const FileError& error) {
  Json object = {{"error", error.what()}, {"file", error.path()}};
  if (error.place().byte_offset) object["byte_offset"] = *error.place().byte_offset;
  if (error.place().line) object["line"] = *error.place().line;
  return object;
}

}  // namespace risley::json
