// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <string_view>

#include "risley/core/error.hpp"

#include "trajectories/formats/format.hpp"

/// RTKLIB's solutions: places without attitudes. They are recognised in order to explain why they
/// are unsuitable.
namespace risley::trajectories {
namespace {

bool is_rtklib(const FileHead& head) {
  for (const std::string_view line : lines_of(head.bytes)) {
    if (!line.starts_with('%')) return false;
    const auto has = [line](std::string_view text) { return line.find(text) != line.npos; };
    if (has("RTKPOST") || has("RTKLIB") || has("RTKRCV") || has("rnx2rtkp") ||
        (has("latitude(deg)") && has("longitude(deg)")) || has("x-ecef(m)")) {
      return true;
    }
  }
  return false;
}

Trajectory refuse_rtklib(const std::string& path, const Progress& /*progress*/) {
  throw FileError(path, {},
                  "is a solution of RTKLIB: it holds positions, but neither roll nor pitch nor "
                  "heading, without which no beam has a direction; expected the trajectory of an "
                  "inertial navigation system, such as an SBET");
}

}  // namespace

const Format kRtklibFormat{"rtklib",      "",     "RTKLIB: refused, it has no attitudes", is_rtklib,
                           refuse_rtklib, nullptr};

}  // namespace risley::trajectories
