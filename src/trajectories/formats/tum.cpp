// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/median.hpp"
#include "risley/core/square.hpp"
#include "risley/core/text.hpp"
#include "risley/io/text_table.hpp"

#include "trajectories/formats/format.hpp"
#include "trajectories/formats/pose_table.hpp"

/// TUM: lines of "time x y z qx qy qz qw", in seconds and metres, as used in SLAM evaluations. A
/// line before the first row may name another order of the quaternion.
namespace risley::trajectories {
namespace {

/// Whether a line has eight numbers with the last four a rotation.
bool is_tum_row(std::string_view line) {
  const auto n = numbers_in<8>(line, io::kBlanks);
  if (!n) return false;
  double squares = 0;
  for (std::size_t i = 4; i < 8; ++i) squares += (*n)[i] * (*n)[i];
  return std::abs(squares - 1) < 0.03;
}

using Order = std::array<PoseField, 4>;
constexpr Order kUsualOrder{PoseField::qx, PoseField::qy, PoseField::qz, PoseField::qw};

/// The order of the quaternion named in a line; empty if there is none.
std::optional<Order> named_order(std::string_view line) {
  static constexpr std::array kNames{std::pair{"qx", PoseField::qx}, std::pair{"qy", PoseField::qy},
                                     std::pair{"qz", PoseField::qz},
                                     std::pair{"qw", PoseField::qw}};
  std::string text = lower_case(std::string(line));
  std::erase(text, '_');
  std::ranges::replace_if(
      text, [](char c) { return c == '#' || c == ','; }, ' ');
  std::vector<PoseField> fields;
  for (const std::string_view word : io::fields_of(text, io::kBlanks)) {
    for (const auto& [name, field] : kNames) {
      if (word == name) fields.push_back(field);
    }
  }
  Order order{};
  if (fields.size() != order.size()) return std::nullopt;
  std::ranges::copy(fields, order.begin());
  const bool all = std::is_permutation(order.begin(), order.end(), kUsualOrder.begin());
  return all ? std::optional(order) : std::nullopt;
}

bool is_tum(const FileHead& head) {
  const std::vector<std::string_view> lines = lines_of(head.bytes);
  int rows = 0;
  for (std::size_t i = 0; i < lines.size() && rows < 3; ++i) {
    const std::string_view line = io::trimmed(lines[i]);
    if (line.empty() || line.starts_with('#')) continue;
    if (i + 1 == lines.size() && rows > 0) break;  // it may be cut
    if (rows == 0 && named_order(line)) continue;
    if (!is_tum_row(line)) return false;
    ++rows;
  }
  return rows > 0;
}

/// Information in lines before the first row.
struct TumHeader {
  std::optional<Order> order;
  std::uint64_t first_row = 1;
};

TumHeader read_tum_header(const std::string& path) {
  TumHeader header;
  io::LineReader lines(path, io::LinesOf::table);
  for (std::string_view line; lines.next(line);) {
    const std::string_view text = io::trimmed(line);
    const auto order = named_order(text);
    if (!text.empty() && !text.starts_with('#') && !order) break;
    if (order) header.order = order;
    header.first_row = lines.line_number() + 1;
  }
  return header;
}

/// Whether bodies lie on their backs, but would be upright if the scalar were the first number of
/// the quaternion instead of the last.
void check_order(Trajectory& trajectory) {
  std::vector<double> up_as_read, up_otherwise;  // cosine of the tilt
  for (const Eigen::Quaterniond& attitude : trajectory.attitude) {
    const Eigen::Quaterniond q = left_up_from_right_down(attitude);
    up_as_read.push_back(1 - 2 * (square(q.x()) + square(q.y())));
    up_otherwise.push_back(1 - 2 * (square(q.y()) + square(q.z())));
  }
  const double as_read = median(up_as_read), otherwise = median(up_otherwise);
  constexpr double kUpright = 0.8;
  if (as_read > 0 || otherwise < kUpright) return;
  const auto tilt_deg = [](double cosine) {
    return degrees_from_radians(std::acos(std::clamp(cosine, -1.0, 1.0)));
  };
  warn(trajectory.warnings, kWarning.columns_guessed,
       "the quaternions were read as qx qy qz qw, which tilts the body by {:.0f} deg; as qw qx qy "
       "qz by {:.0f} deg: if that is their order, state it in a first line \"# time x y z qw qx qy "
       "qz\"",
       tilt_deg(as_read), tilt_deg(otherwise));
}

Trajectory read_tum(const std::string& path, const Progress& progress) {
  PoseTable table;
  table.delimiter = io::kBlanks;
  table.comment = '#';
  table.left_up = true;
  table.contents.format = "tum";
  table.contents.frame = Frame::local;
  table.columns = {
      {PoseField::time, "time"}, {PoseField::x, "x"}, {PoseField::y, "y"}, {PoseField::z, "z"}};
  const TumHeader header = read_tum_header(path);
  table.first_row = header.first_row;
  for (const PoseField field : header.order.value_or(kUsualOrder)) {
    const std::size_t letter =
        static_cast<std::size_t>(field) - static_cast<std::size_t>(PoseField::qx);
    table.columns.push_back({field, std::string("q") + "xyzw"[letter]});
  }
  Trajectory trajectory = read_pose_table(path, table, progress);
  trajectory.time_scale = scale_by_size(trajectory.time_ns);
  if (!header.order) check_order(trajectory);
  return trajectory;
}

}  // namespace

const Format kTumFormat{"tum", "", "TUM: time x y z qx qy qz qw", is_tum, read_tum, nullptr};

}  // namespace risley::trajectories
