// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/recordings/plausibility.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/direction.hpp"
#include "risley/core/median.hpp"
#include "risley/core/require.hpp"

#include "recordings/reader_decorators.hpp"

namespace risley::recordings {
namespace {

/// The narrowest field of view, that of a Tele-15, has seven times this radius; far points within
/// the second are those of a map.
constexpr double kNarrowest = radians_from_degrees(1.0), kNarrowestFar = radians_from_degrees(5.0);
/// Ranges of fewer shots are not judged.
constexpr double kFewFar = 0.01;
constexpr std::size_t kFewestRanges = 20;

std::vector<double> finite(std::span<const double> values) {
  std::vector<double> result;
  std::copy_if(values.begin(), values.end(), std::back_inserter(result),
               [](double value) { return std::isfinite(value) && value > 0; });
  return result;
}

/// The smallest arc that contains all azimuths: all but the widest gap between them.
void find_arc(std::vector<double> azimuth, DirectionSpread& spread) {
  std::sort(azimuth.begin(), azimuth.end());
  double widest = azimuth.front() + kTwoPi - azimuth.back();
  std::size_t behind = 0;
  for (std::size_t i = 1; i < azimuth.size(); ++i) {
    if (azimuth[i] - azimuth[i - 1] <= widest) continue;
    widest = azimuth[i] - azimuth[i - 1];
    behind = i;
  }
  spread.azimuth_from = azimuth[behind];
  spread.azimuth_to = behind == 0 ? azimuth.back() : azimuth[behind - 1] + kTwoPi;
}

struct LengthUnit {
  const char *name, *in_a_column;
  double per_m;
};
constexpr std::array kLengthUnits{LengthUnit{"millimetres", "x_mm", 1000.0},
                                  LengthUnit{"centimetres", "x_cm", 100.0}};

/// The units in which ranges would be within reach, beginning with the one in which they are most
/// like those of rooms and streets.
std::vector<LengthUnit> likely_units(double median, double high, double reach) {
  constexpr double kUsual = 10.0;  // m
  std::vector<LengthUnit> units;
  std::copy_if(kLengthUnits.begin(), kLengthUnits.end(), std::back_inserter(units),
               [&](const LengthUnit& unit) { return high / unit.per_m <= reach; });
  std::stable_sort(units.begin(), units.end(), [&](const LengthUnit& a, const LengthUnit& b) {
    const auto distance = [&](const LengthUnit& unit) {
      return std::abs(std::log(median / unit.per_m / kUsual));
    };
    return distance(a) < distance(b);
  });
  return units;
}

}  // namespace

double cone_radius(std::span<const double> azimuth, std::span<const double> zenith) {
  require_at_least("directions", static_cast<long long>(azimuth.size()), 1);
  require_length("zenith", zenith.size(), azimuth.size());
  Vector3<double> sum;
  std::vector<Vector3<double>> directions(azimuth.size());
  for (std::size_t i = 0; i < azimuth.size(); ++i) {
    directions[i] = direction_from_angles(SphericalAngles<double>{azimuth[i], zenith[i]});
    sum = sum + directions[i];
  }
  const double length = norm(sum);
  const Vector3<double> mean = length > 0 ? (1.0 / length) * sum : Vector3<double>{1, 0, 0};
  std::vector<double> off(azimuth.size());
  for (std::size_t i = 0; i < azimuth.size(); ++i) {
    const Vector3<double>& one = directions[i];
    const Vector3<double> apart{one.x - mean.x, one.y - mean.y, one.z - mean.z};
    off[i] = 2.0 * std::asin(std::min(1.0, 0.5 * norm(apart)));
  }
  return quantile(off, 0.99);
}

DirectionSpread direction_spread(std::span<const double> azimuth, std::span<const double> zenith) {
  DirectionSpread spread;
  spread.radius = cone_radius(azimuth, zenith);
  find_arc({azimuth.begin(), azimuth.end()}, spread);
  std::vector<double> sorted(zenith.begin(), zenith.end());
  spread.zenith_from = quantile(sorted, 0.005);
  spread.zenith_to = quantile(sorted, 0.995);
  return spread;
}

std::optional<std::string> not_a_scan(std::span<const double> azimuth,
                                      std::span<const double> zenith,
                                      std::span<const double> range) {
  if (azimuth.size() < kFewestRanges) return std::nullopt;
  return not_a_scan(cone_radius(azimuth, zenith), azimuth.size(), range);
}

std::optional<std::string> not_a_scan(double radius, std::size_t directions,
                                      std::span<const double> range) {
  std::vector<double> ranges = finite(range);
  const double median = ranges.empty() ? 0.0 : quantile(ranges, 0.5);
  const bool is_far = median > kFarthestReach;
  if (!is_far && directions < kFewestJudged) return std::nullopt;
  if (!(radius < (is_far ? kNarrowestFar : kNarrowest))) return std::nullopt;
  const double span_deg = 2.0 * degrees_from_radians(radius);
  if (is_far) {
    return fmt::format(
        "these are not coordinates of a sensor frame: the points are {:.0f} m from the origin and "
        "lie within {:.2g} deg of each other, as map coordinates do; export them without "
        "georeferencing, with the sensor at the origin",
        median, span_deg);
  }
  const double as_radians = kDegreesPerRadian * radius;
  constexpr double kLeast = radians_from_degrees(6.0), kMost = radians_from_degrees(60.0);
  return fmt::format(
      "these are not the directions of a scan: they lie within {:.2g} deg of each "
      "other, and the narrowest field of view is one of 14 deg{}",
      span_deg,
      as_radians > kLeast && as_radians < kMost
          ? "; they may be angles in radians labelled as degrees"
          : "; the coordinates may not be those of a sensor frame");
}

std::optional<std::string> beyond_reach(std::span<const double> range, double reach,
                                        const std::string& whose) {
  std::vector<double> ranges = finite(range);
  if (ranges.size() < kFewestRanges) return std::nullopt;
  const auto beyond = static_cast<double>(
      std::count_if(ranges.begin(), ranges.end(), [reach](double one) { return one > reach; }));
  const double share = beyond / static_cast<double>(ranges.size());
  if (share < kFewFar) return std::nullopt;
  const double low = quantile(ranges, 0.005), high = quantile(ranges, 0.995),
               median = quantile(ranges, 0.5);
  std::string text = fmt::format(
      "{:.3g} % of the ranges are beyond the reach of {:.0f} m of {}: they are {:.5g} to {:.5g} m",
      100.0 * share, reach, whose, low, high);
  const std::vector<LengthUnit> units = likely_units(median, high, reach);
  // A few far ones do not indicate another unit.
  constexpr double kMostAreFar = 0.1;
  if (units.empty() || share < kMostAreFar) return text;
  for (const LengthUnit& unit : units) {
    text += fmt::format("{} {} ({:.3g} to {:.3g} m)",
                        &unit == &units.front() ? "; they are likely" : ", or perhaps", unit.name,
                        low / unit.per_m, high / unit.per_m);
  }
  return text + fmt::format(": state the unit in the names of columns, as in {}, or convert to m",
                            units.front().in_a_column);
}

namespace {

/// Reports once the defects of the first shots.
class PlausibilityReader final : public DecoratingReader {
 public:
  explicit PlausibilityReader(std::unique_ptr<Reader> inner) : DecoratingReader(std::move(inner)) {
    take_over();
  }

 private:
  static constexpr std::size_t kMostJudged = 16384;

  void describe() override { warnings_.insert(warnings_.begin(), found_.begin(), found_.end()); }

  std::optional<FileError> change(Chunk& chunk) override {
    const Observations& rows = chunk.observations;
    if (judged_) return std::nullopt;
    has_packets_ = has_packets_ || !chunk.packets.empty();
    for (std::size_t row = 0; row < rows.size() && azimuth_.size() < kMostJudged; ++row) {
      if (rows.valid[row] == 0) continue;
      azimuth_.push_back(rows.azimuth[row]);
      zenith_.push_back(rows.zenith[row]);
      range_.push_back(rows.range[row]);
    }
    if (azimuth_.size() == kMostJudged || (rows.size() == 0 && chunk.imu.empty())) judge();
    return std::nullopt;
  }

  void judge() {
    judged_ = true;
    std::vector<double> ranges = finite(range_);
    const bool far = !ranges.empty() && quantile(ranges, 0.5) > kFarthestReach;
    // A sensor's own packets, and files that name it, are in its units; they may have been put on a
    // map.
    const bool own = has_packets_ || header_.devices.front().type != kUnknownDeviceType;
    const auto problem = own && !far ? std::nullopt : not_a_scan(azimuth_, zenith_, range_);
    if (problem) {
      found_.push_back({kWarning.implausible_values, *problem});
    } else if (const auto beyond = beyond_reach(range_, kFarthestReach, "these sensors")) {
      found_.push_back({kWarning.implausible_values, *beyond});
    }
    azimuth_ = zenith_ = range_ = {};
  }

  bool judged_ = false, has_packets_ = false;
  std::vector<double> azimuth_, zenith_, range_;
  std::vector<Warning> found_;
};

}  // namespace

std::unique_ptr<Reader> with_plausibility(std::unique_ptr<Reader> reader) {
  return std::make_unique<PlausibilityReader>(std::move(reader));
}

}  // namespace risley::recordings
