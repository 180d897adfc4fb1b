// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/median.hpp"
#include "risley/core/require.hpp"
#include "risley/io/block_file.hpp"
#include "risley/io/little_endian.hpp"
#include "risley/io/seconds.hpp"

#include "trajectories/formats/format.hpp"
#include "trajectories/formats/pose_rows.hpp"
#include "trajectories/row_order.hpp"

/// SMRMSG, the accuracies of an SBET: records of 10 numbers of 8 bytes and nothing else.
namespace risley::trajectories {
namespace {

constexpr std::size_t kSmrmsgRecord = 80;
using SmrmsgNumbers = std::array<double, 10>;

constexpr double kRadiansPerArcMinute = kRadiansPerDegree / 60;
/// Largest standard deviations of a record: m, m/s, arc-minutes.
constexpr double kWorstSmrmsgPosition = 1e5, kWorstSmrmsgVelocity = 1e4, kWorstSmrmsgAngle = 21600;

/// The defect of a record; empty when there is none.
std::string smrmsg_fault(const SmrmsgNumbers& n) {
  constexpr std::array kNames{"time",          "north",         "east", "down",  "north velocity",
                              "east velocity", "down velocity", "roll", "pitch", "heading"};
  const auto fault = [&](std::size_t i, double most, const char* unit) {
    const bool sound = n[i] >= 0 && n[i] <= most;
    return sound ? std::string()
                 : fmt::format("{} = {:.10g} {}, allowed 0 to {:g}", kNames[i], n[i], unit, most);
  };
  for (std::size_t i = 0; i < n.size(); ++i) {
    std::string found = i == 0  ? fault(i, 20 * 604800.0, "s")
                        : i < 4 ? fault(i, kWorstSmrmsgPosition, "m")
                        : i < 7 ? fault(i, kWorstSmrmsgVelocity, "m/s")
                                : fault(i, kWorstSmrmsgAngle, "arc-minutes");
    if (!found.empty()) return found;
  }
  return {};
}

}  // namespace

bool is_smrmsg(const FileHead& head) {
  if (head.has_ending(".smrmsg")) return true;
  const std::size_t records = std::min<std::size_t>(head.bytes.size() / kSmrmsgRecord, 20);
  if (records < 2 || head.size % kSmrmsgRecord != 0) return false;
  const auto* const bytes = reinterpret_cast<const std::uint8_t*>(head.bytes.data());
  double before = 0;
  for (std::size_t i = 0; i < records; ++i) {
    const SmrmsgNumbers n = numbers_of<10>(bytes + i * kSmrmsgRecord);
    const auto is_normal = [](double value) { return value > 1e-9; };
    if (!smrmsg_fault(n).empty() || !std::ranges::all_of(n, is_normal)) return false;
    if (i > 0 && std::abs(n[0] - before) > 604800) return false;
    before = n[0];
  }
  return true;
}

AccuracyRecords load_accuracies(const std::string& path, const Progress& progress) {
  io::BlockInput file(path);
  if (file.size() == 0 || file.size() % kSmrmsgRecord != 0) {
    throw FileError(path, {},
                    fmt::format("has {} bytes, not a multiple of the 80 bytes of a record: the "
                                "file was cut off or is not an SMRMSG",
                                file.size()));
  }
  AccuracyRecords records;
  for (std::uint64_t offset = 0; offset < file.size(); offset += kSmrmsgRecord) {
    const SmrmsgNumbers n = numbers_of<10>(file.at(offset, kSmrmsgRecord));
    if (const std::string fault = smrmsg_fault(n); !fault.empty()) {
      throw FileError(path, {offset, {}}, fault);
    }
    records.time_ns.push_back(io::nanoseconds_from_seconds(n[0]).value_or(0));
    PoseAccuracy accuracy;
    accuracy.position = {n[1], n[2], n[3]};
    accuracy.roll = kRadiansPerArcMinute * n[7];
    accuracy.pitch = kRadiansPerArcMinute * n[8];
    accuracy.heading = kRadiansPerArcMinute * n[9];
    records.accuracy.push_back(accuracy);
    records.velocity.emplace_back(n[4], n[5], n[6]);
    constexpr std::size_t kOften = 4096;
    if (records.time_ns.size() % kOften == 0) {
      progress.report(static_cast<double>(offset) / static_cast<double>(file.size()));
    }
  }
  // Records need not be ordered, so a week that ends among them is recognised by its two halves.
  const std::int64_t week = *period_ns(TimeScale::gps_second_of_week);
  const auto [least, greatest] =
      std::minmax_element(records.time_ns.begin(), records.time_ns.end());
  if (*greatest - *least > week / 2 && *greatest <= week) {
    for (std::int64_t& time : records.time_ns) {
      if (time < week / 2) time += week;
    }
    warn(records.warnings, kWarning.clock_wrapped,
         "the GPS week (604800 s) ends within the accuracies: times were continued beyond it");
  }
  const RowOrder order = row_order(records.time_ns);
  const auto place_of = [](std::size_t row) {
    return FilePlace{static_cast<std::uint64_t>(row) * kSmrmsgRecord, {}};
  };
  append(records.warnings, order_warnings(order.times, records.time_ns.size(), place_of));
  if (!order.rows.empty()) {
    reorder(records.accuracy, order.rows);
    reorder(records.velocity, order.rows);
    reorder(records.time_ns, order.rows);
  }
  return records;
}

void add_accuracies(Trajectory& trajectory, const AccuracyRecords& accuracies,
                    const std::string& path) {
  require_trajectory(trajectory);
  const std::vector<std::int64_t>& times = accuracies.time_ns;
  require_at_least("accuracies", times.size(), 1);
  require_length("accuracy", accuracies.accuracy.size(), times.size());
  if (!std::ranges::is_sorted(times)) {
    throw InvalidArgument("time_ns of the accuracies does not ascend");
  }
  if (accuracies.time_scale != trajectory.time_scale) {
    throw FileError(
        path, {},
        fmt::format("its times are of the scale {}, the trajectory's of {}",
                    to_string(accuracies.time_scale), to_string(trajectory.time_scale)));
  }
  // Either file may continue beyond the end of a week.
  std::int64_t shift = 0;
  if (const auto period = period_ns(trajectory.time_scale)) {
    const auto middle_of = [](const std::vector<std::int64_t>& ordered) {
      return 0.5 * (static_cast<double>(ordered.front()) + static_cast<double>(ordered.back()));
    };
    const double apart = middle_of(trajectory.time_ns) - middle_of(times);
    shift = std::llround(apart / static_cast<double>(*period)) * *period;
  }
  std::vector<std::int64_t> steps;
  for (std::size_t i = 1; i < times.size(); ++i) steps.push_back(times[i] - times[i - 1]);
  std::int64_t margin = 0;
  if (!steps.empty()) {
    margin = 2 * upper_median(steps);
  }
  const std::int64_t first = trajectory.time_ns.front() - shift;
  const std::int64_t last = trajectory.time_ns.back() - shift;
  if (first < times.front() - margin || last > times.back() + margin) {
    throw FileError(
        path, {},
        fmt::format("covers {:.3f} to {:.3f} s, the trajectory {:.3f} to {:.3f} s; expected the "
                    "accuracies of this trajectory",
                    1e-9 * static_cast<double>(times.front()),
                    1e-9 * static_cast<double>(times.back()), 1e-9 * static_cast<double>(first),
                    1e-9 * static_cast<double>(last)));
  }
  trajectory.accuracy.clear();
  trajectory.accuracy.reserve(trajectory.size());
  std::size_t next = 0;
  for (const std::int64_t own : trajectory.time_ns) {
    const std::int64_t time = own - shift;
    while (next < times.size() && times[next] < time) ++next;
    const std::size_t after = std::min(next, times.size() - 1);
    const std::size_t before = next == 0 ? 0 : next - 1;
    const PoseAccuracy& a = accuracies.accuracy[before];
    const PoseAccuracy& b = accuracies.accuracy[after];
    const double share = after == before || time <= times[before]
                             ? 0
                             : std::min(1.0, static_cast<double>(time - times[before]) /
                                                 static_cast<double>(times[after] - times[before]));
    const auto between = [share](double from, double to) { return from + share * (to - from); };
    PoseAccuracy accuracy;
    accuracy.position = a.position + share * (b.position - a.position);
    accuracy.roll = between(a.roll, b.roll);
    accuracy.pitch = between(a.pitch, b.pitch);
    accuracy.heading = between(a.heading, b.heading);
    trajectory.accuracy.push_back(accuracy);
  }
}

}  // namespace risley::trajectories
