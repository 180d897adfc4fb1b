// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/flight_shots.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <string_view>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/require.hpp"

#include "calibration/shot_blocks.hpp"

namespace risley::calibration {
namespace {

constexpr double kLongestClockOffset = 86400;        // s
constexpr double kNanoseconds = 1e9;                 // of a second
constexpr std::int64_t kRateWindow_ns = 50'000'000;  // to each side
constexpr double kLatestTime_ns = 4.6e18;            // half of what 64 bits hold

std::int64_t nanoseconds(double seconds) {
  return static_cast<std::int64_t>(std::llround(seconds * kNanoseconds));
}

[[noreturn]] void refuse_row(std::string_view column, std::size_t row, std::string_view what) {
  throw InvalidArgument(fmt::format("{}[{}] {}", column, row, what));
}

/// Velocity and angular velocity at a record, local axes.
struct Rates {
  Eigen::Vector3d velocity{0, 0, 0}, angular_velocity{0, 0, 0};
};

/// Slopes of straight lines through the records around each. The clock's derivative must not
/// contain the noise of single records: it would correlate with the residuals due to the same
/// noise, which is a bias that more shots do not reduce. docs/theory/flight.md
std::vector<Rates> smooth_rates(const trajectories::Interpolation& local) {
  const trajectories::Trajectory& trajectory = local.trajectory();
  const auto& times = trajectory.time_ns;
  std::vector<std::uint8_t> gap_behind(times.size());
  for (const trajectories::TrajectoryGap& gap : local.gaps()) gap_behind[gap.row] = 1;
  std::vector<Rates> rates(times.size());
  for_each_block(times.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      // At least one neighbour on each side, if there is one.
      std::size_t first = i, last = i;
      while (first > 0 && gap_behind[first - 1] == 0 &&
             (first == i || times[i] - times[first - 1] <= kRateWindow_ns)) {
        --first;
      }
      while (last + 1 < times.size() && gap_behind[last] == 0 &&
             (last == i || times[last + 1] - times[i] <= kRateWindow_ns)) {
        ++last;
      }
      if (first == last) continue;
      const Eigen::Quaterniond back = trajectory.attitude[i].conjugate();
      double middle = 0, squares = 0;
      for (std::size_t j = first; j <= last; ++j) {
        middle += static_cast<double>(times[j] - times[i]) / kNanoseconds;
      }
      middle /= static_cast<double>(last - first + 1);
      Rates& own = rates[i];
      for (std::size_t j = first; j <= last; ++j) {
        const double time = static_cast<double>(times[j] - times[i]) / kNanoseconds - middle;
        const Eigen::Quaterniond turn = trajectory.attitude[j] * back;
        own.velocity += time * (trajectory.position[j] - trajectory.position[i]);
        own.angular_velocity += time * (turn.w() < 0 ? -2.0 : 2.0) * turn.vec();
        squares += time * time;
      }
      own.velocity /= squares;
      own.angular_velocity /= squares;
    }
  });
  return rates;
}

/// Columns of the rows returned by a function.
template <class Column>
void copy_rows(const Column& from, const std::vector<std::size_t>& rows, Column& to) {
  if (from.empty()) return;
  to.reserve(rows.size());
  for (const std::size_t row : rows) to.push_back(from[row]);
}

}  // namespace

void require_flight_shots(const FlightShots& shots) {
  const std::size_t n = shots.size();
  require_at_least("number of shots", n, 1);
  require_at_least("number of prisms", shots.prisms(), 1);
  for (const auto& column : shots.rotation_angle) {
    require_length("rotation_angle of a prism", column.size(), n);
  }
  require_length_or_none("beam", shots.beam.size(), n);
  require_length("time_ns", shots.time_ns.size(), n);
  require_length("strip", shots.strip.size(), n);
  for (std::size_t i = 0; i < n; ++i) {
    if (!(std::isfinite(shots.range[i]) && shots.range[i] > 0)) {
      refuse_row("range", i, fmt::format("= {} m, allowed above 0", shots.range[i]));
    }
    for (const auto& column : shots.rotation_angle) {
      if (!std::isfinite(column[i])) {
        refuse_row("rotation_angle", i, fmt::format("= {} rad, allowed finite", column[i]));
      }
    }
    if (std::abs(static_cast<double>(shots.time_ns[i])) > kLatestTime_ns) {
      refuse_row("time_ns", i,
                 fmt::format("= {}, allowed within 146 years of 0", shots.time_ns[i]));
    }
    if (i == 0) continue;
    if (shots.time_ns[i] < shots.time_ns[i - 1]) {
      refuse_row("time_ns", i,
                 fmt::format("= {}, allowed not before the shot before it, {}", shots.time_ns[i],
                             shots.time_ns[i - 1]));
    }
    if (shots.strip[i] < shots.strip[i - 1]) {
      refuse_row("strip", i,
                 fmt::format("= {}, allowed {} and more, as the shot before it", shots.strip[i],
                             shots.strip[i - 1]));
    }
  }
}

FlightShots rows_of(const FlightShots& shots, const std::vector<std::size_t>& rows) {
  for (std::size_t i = 0; i < rows.size(); ++i) {
    require_place("row", rows[i], shots.size());
    if (i > 0 && rows[i] <= rows[i - 1]) refuse_row("rows", i, "does not ascend");
  }
  FlightShots some;
  some.rotation_angle.resize(shots.rotation_angle.size());
  for (std::size_t k = 0; k < shots.rotation_angle.size(); ++k) {
    copy_rows(shots.rotation_angle[k], rows, some.rotation_angle[k]);
  }
  copy_rows(shots.beam, rows, some.beam);
  copy_rows(shots.range, rows, some.range);
  copy_rows(shots.time_ns, rows, some.time_ns);
  copy_rows(shots.strip, rows, some.strip);
  return some;
}

std::vector<std::size_t> rows_with_pose(const FlightShots& shots,
                                        const trajectories::Interpolation& local,
                                        double clock_offset, double margin) {
  require_flight_shots(shots);
  require_between("clock offset", clock_offset, -kLongestClockOffset, kLongestClockOffset, "s");
  require_between("margin", margin, 0, kLongestClockOffset, "s");
  const std::int64_t least = nanoseconds(clock_offset - margin),
                     most = nanoseconds(clock_offset + margin);
  std::vector<std::uint8_t> has_pose(shots.size());
  for_each_block(shots.size(), [&](std::size_t begin, std::size_t end) {
    auto cursor = local.cursor();
    for (std::size_t i = begin; i < end; ++i) {
      has_pose[i] = cursor.at(shots.time_ns[i] + least) && cursor.at(shots.time_ns[i] + most);
    }
  });
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < shots.size(); ++i) {
    if (has_pose[i] != 0) rows.push_back(i);
  }
  return rows;
}

ShotPoses poses_of(const FlightShots& shots, const trajectories::Interpolation& local,
                   double clock_offset) {
  require_between("clock offset", clock_offset, -kLongestClockOffset, kLongestClockOffset, "s");
  if (local.trajectory().frame != trajectories::Frame::local) {
    throw InvalidArgument(fmt::format("frame of the trajectory = {}, expected local",
                                      to_string(local.trajectory().frame)));
  }
  const std::int64_t shift = nanoseconds(clock_offset);
  ShotPoses poses;
  poses.clock_offset = clock_offset;
  poses.pose.resize(shots.size());
  const std::vector<Rates> rates = smooth_rates(local);
  const auto& times = local.trajectory().time_ns;
  std::atomic<std::size_t> missing = std::numeric_limits<std::size_t>::max();
  for_each_block(shots.size(), [&](std::size_t begin, std::size_t end) {
    auto cursor = local.cursor();
    const auto behind = std::ranges::upper_bound(times, shots.time_ns[begin] + shift);
    std::size_t record =
        static_cast<std::size_t>(std::max<std::ptrdiff_t>(behind - times.begin(), 1)) - 1;
    for (std::size_t i = begin; i < end; ++i) {
      const auto found = cursor.at(shots.time_ns[i] + shift);
      if (!found) {
        std::size_t before = missing.load();
        while (i < before && !missing.compare_exchange_weak(before, i)) {
        }
        continue;
      }
      ShotPose& pose = poses.pose[i];
      const Eigen::Quaterniond attitude = found->attitude.normalized();
      const double quaternion[4] = {attitude.w(), attitude.x(), attitude.y(), attitude.z()};
      std::copy(quaternion, quaternion + 4, pose.attitude);
      const auto time = shots.time_ns[i] + shift;
      while (record + 1 < times.size() && times[record + 1] <= time) ++record;
      const std::size_t next = std::min(record + 1, times.size() - 1);
      const double weight = next == record ? 0
                                           : static_cast<double>(time - times[record]) /
                                                 static_cast<double>(times[next] - times[record]);
      const Eigen::Vector3d velocity =
          (1 - weight) * rates[record].velocity + weight * rates[next].velocity;
      const Eigen::Vector3d angular_velocity =
          (1 - weight) * rates[record].angular_velocity + weight * rates[next].angular_velocity;
      for (Eigen::Index k = 0; k < 3; ++k) {
        pose.position[k] = found->position[k];
        pose.velocity[k] = static_cast<float>(velocity[k]);
        pose.angular_velocity[k] = static_cast<float>(angular_velocity[k]);
      }
    }
  });
  if (missing != std::numeric_limits<std::size_t>::max()) {
    throw InvalidArgument(
        fmt::format("shot {} has no pose: its time {} ns + {} ns is not within "
                    "the trajectory or lies in a gap of it",
                    missing.load(), shots.time_ns[missing], shift));
  }
  return poses;
}

}  // namespace risley::calibration
