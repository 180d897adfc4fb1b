// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/flight_details.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include <Eigen/Core>

#include "risley/calibration/ground_cells.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/median.hpp"
#include "risley/core/random.hpp"
#include "risley/core/require.hpp"
#include "risley/trajectories/interpolation.hpp"

namespace risley::jobs {
namespace {

using calibration::FlightCalibration;
using calibration::FlightCalibrationOptions;
using calibration::FlightModel;
using calibration::FlightShots;
using calibration::GroundCells;
using calibration::ShotPoints;
using calibration::ShotPoses;
using calibration::StripInCell;
using calibration::TrajectoryKnots;

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kMostStrips = 100, kMostDrawnPairs = 6;
constexpr std::size_t kMostPlaces = 3000, kMostStripPlaces = 200, kFewestStripPlaces = 2;
constexpr double kShotsPerPlane = 48;         // required mean number left by the sample
constexpr double kAreaSquare = 10;            // for measuring the flown area, m
constexpr std::size_t kAreaPoints = 200'000;  // that it is measured with
constexpr double kLargestPlane = 20;          // m
constexpr std::size_t kFewestStripShots = 5;  // that determine the offset of a strip in a cell
constexpr double kGate = 3;                   // range sigmas beyond which a point is rejected
constexpr double kClockMargin = 1e-3;         // s
constexpr std::uint64_t kSampleStream = 1701;

/// Column and row of a square.
using Place = std::pair<long, long>;

Place place_of(double east, double north, double size) {
  return {std::lround(std::floor(east / size)), std::lround(std::floor(north / size))};
}

/// A random sample of the shots; every n-th one would beat with the rotors.
FlightShots sample_of(const FlightShots& shots, std::size_t most, std::uint64_t seed) {
  if (shots.size() <= most) return shots;
  const RandomStream stream(seed, kSampleStream);
  const double share = static_cast<double>(most) / static_cast<double>(shots.size());
  std::vector<std::size_t> rows;
  for (std::size_t row = 0; row < shots.size(); ++row) {
    if (stream.uniform(row) < share) rows.push_back(row);
  }
  return calibration::rows_of(shots, rows);
}

/// The same knots for a subset of their shots.
TrajectoryKnots knots_for(TrajectoryKnots knots, const FlightShots& shots) {
  const auto row_at = [&](std::uint16_t strip, std::int64_t time_ns) {
    std::size_t first = 0, last = shots.size();
    while (first < last) {
      const std::size_t middle = first + (last - first) / 2;
      if (std::pair(shots.strip[middle], shots.time_ns[middle]) < std::pair(strip, time_ns)) {
        first = middle + 1;
      } else {
        last = middle;
      }
    }
    return first;
  };
  for (TrajectoryKnots::Interval& interval : knots.intervals) {
    const std::uint16_t strip = knots.strip[interval.knot];
    const bool last = interval.knot + 2 >= knots.size() || knots.strip[interval.knot + 2] != strip;
    interval.first_shot = row_at(strip, interval.begin_ns);
    interval.end_shot = row_at(strip, interval.end_ns + (last ? 1 : 0));
  }
  return knots;
}

/// With what was given.
FlightModel start_model(const FlightCalibrationOptions& options, const FlightCalibration& found,
                        const TrajectoryKnots& knots) {
  FlightModel model;
  model.train = options.sensor.train;
  model.geometry = options.sensor.geometry;
  model.nominal = options.mount.nominal;
  model.boresight = model.nominal.transpose() * trajectories::body_from_sensor(options.mount);
  model.lever_arm = trajectories::lever_arm(options.mount);
  model.range_offset = options.sensor.range_offset;
  model.clock_offset = options.mount.clock_offset.value;
  model.knots = knots;
  model.corrections =
      Eigen::MatrixXd::Zero(found.model.corrections.rows(), found.model.corrections.cols());
  return model;
}

/// Side of cells that the sample fills well enough.
double plane_size_of(const ShotPoints& points, double wished) {
  std::set<Place> squares;
  std::size_t count = 0;
  const std::size_t step = points.size() / kAreaPoints + 1;
  for (std::size_t i = 0; i < points.size(); i += step) {
    if (!std::isfinite(points[i][0])) continue;
    squares.insert(place_of(points[i][0], points[i][1], kAreaSquare));
    count += step;
  }
  if (count == 0) return wished;
  const double area = static_cast<double>(squares.size()) * kAreaSquare * kAreaSquare;
  const double size = std::sqrt(kShotsPerPlane * area / static_cast<double>(count));
  return std::max(wished, std::min(std::ceil(size), kLargestPlane));
}

/// Offsets of the strips in the cells for one state of the calibration.
struct LaidStrips {
  GroundCells cells;
  std::vector<StripInCell> strips;
};

LaidStrips lay_strips(const ShotPoints& points, const std::vector<std::uint16_t>& strip,
                      double size, double gate) {
  LaidStrips laid;
  calibration::GroundCellOptions options;
  options.size = size;
  laid.cells = calibration::ground_cells(points, strip, options);
  laid.strips = calibration::strips_in_cells(points, strip, laid.cells.plane, laid.cells.planes,
                                             gate, kFewestStripShots);
  return laid;
}

/// Scatter of the points about every plane, 1 sigma, m.
std::vector<double> roughness_of(const ShotPoints& points, const GroundCells& cells) {
  std::vector<std::vector<double>> distances(cells.planes.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (cells.plane[i] == calibration::kNoPlane) continue;
    const auto plane = static_cast<std::size_t>(cells.plane[i]);
    const Eigen::Vector3d point(points[i][0], points[i][1], points[i][2]);
    distances[plane].push_back(
        std::abs(cells.planes[plane].normal.dot(point - cells.planes[plane].centre)));
  }
  std::vector<double> roughness;
  roughness.reserve(distances.size());
  for (auto& own : distances) roughness.push_back(kSigmaOverMedianDistance * median(own));
  return roughness;
}

/// A running mean, or mean of squares.
struct Sum {
  double sum = 0;
  std::size_t count = 0;
  void add(double value) {
    sum += value;
    ++count;
  }
  double mean() const { return count == 0 ? kNothing : sum / static_cast<double>(count); }
};

struct BeforeAfter {
  Sum before, after;
};

/// Sums over the cells of a picture's square.
struct SquareOfGround {
  BeforeAfter squares;
  Sum roughness, slope;
  std::size_t strips = 0;
};

using PairOfStrips = std::pair<std::uint16_t, std::uint16_t>;

class FlightPictures {
 public:
  FlightPictures(const LaidStrips& before, const LaidStrips& after,
                 std::vector<double> roughness_after, double most_roughness)
      : before_(before), after_(after), roughness_(std::move(roughness_after)) {
    for (const double own : roughness_) sound_.push_back(own <= most_roughness);
  }

  void fill(FlightDetails& details, std::size_t most_squares) {
    details.square_size = square_size(details.plane_size, static_cast<double>(most_squares));
    size_ = details.square_size;
    std::map<PairOfStrips, std::size_t> common;
    for_each_difference(before_, [&](const PairOfStrips& pair, std::size_t, double) {
      common.try_emplace(pair, 0);
    });
    for_each_difference(after_, [&](const PairOfStrips& pair, std::size_t plane, double) {
      if (sound_[plane]) ++common[pair];
    });
    details.pair_count = common.size();
    std::vector<std::pair<PairOfStrips, std::size_t>> order(common.begin(), common.end());
    std::stable_sort(order.begin(), order.end(),
                     [](const auto& a, const auto& b) { return a.second > b.second; });
    order.resize(std::min(order.size(), kMostDrawnPairs));
    std::sort(order.begin(), order.end());
    for (const auto& [pair, count] : order) details.pairs.push_back(differences_of(pair));
    fill_ground(details.ground);
  }

 private:
  /// Calls a function with every two strips of a cell, the cell's plane and the difference.
  template <class Function>
  static void for_each_difference(const LaidStrips& laid, Function function) {
    for (std::size_t i = 0; i < laid.strips.size(); ++i) {
      for (std::size_t j = i + 1;
           j < laid.strips.size() && laid.strips[j].plane == laid.strips[i].plane; ++j) {
        function(PairOfStrips{laid.strips[i].strip, laid.strips[j].strip}, laid.strips[i].plane,
                 laid.strips[j].mean - laid.strips[i].mean);
      }
    }
  }

  /// A multiple of the cells' side, with few enough squares.
  double square_size(double plane_size, double most_squares) const {
    for (double multiple = 1;;) {
      const double size = multiple * plane_size;
      std::set<Place> places;
      for (const LaidStrips* laid : {&before_, &after_}) {
        for (const auto& plane : laid->cells.planes) {
          places.insert(place_of(plane.centre.x(), plane.centre.y(), size));
        }
      }
      const double excess = static_cast<double>(places.size()) / most_squares;
      if (excess <= 1) return size;
      multiple = std::max(multiple + 1, std::floor(multiple * std::sqrt(excess)));
    }
  }

  Place place(const LaidStrips& laid, std::size_t plane) const {
    const Eigen::Vector3d& centre = laid.cells.planes[plane].centre;
    return place_of(centre.x(), centre.y(), size_);
  }
  double middle(long number) const { return (static_cast<double>(number) + 0.5) * size_; }

  StripDifferences differences_of(const PairOfStrips& wanted) const {
    std::map<Place, BeforeAfter> squares;
    for_each_difference(before_, [&](const PairOfStrips& pair, std::size_t plane, double own) {
      if (pair == wanted) squares[place(before_, plane)].before.add(own);
    });
    for_each_difference(after_, [&](const PairOfStrips& pair, std::size_t plane, double own) {
      if (pair == wanted && sound_[plane]) squares[place(after_, plane)].after.add(own);
    });
    StripDifferences result;
    result.first = wanted.first;
    result.second = wanted.second;
    for (const auto& [where, own] : squares) {
      result.east.push_back(middle(where.first));
      result.north.push_back(middle(where.second));
      result.before.push_back(own.before.mean());
      result.after.push_back(own.after.mean());
    }
    return result;
  }

  void fill_ground(FlightGround& ground) const {
    std::map<Place, SquareOfGround> squares;
    for_each_difference(before_, [&](const PairOfStrips&, std::size_t plane, double own) {
      squares[place(before_, plane)].squares.before.add(own * own);
    });
    for_each_difference(after_, [&](const PairOfStrips&, std::size_t plane, double own) {
      if (sound_[plane]) squares[place(after_, plane)].squares.after.add(own * own);
    });
    for (std::size_t p = 0; p < after_.cells.planes.size(); ++p) {
      SquareOfGround& own = squares[place(after_, p)];
      own.roughness.add(roughness_[p]);
      own.slope.add(std::acos(std::clamp(after_.cells.planes[p].normal.z(), -1.0, 1.0)));
    }
    for (std::size_t i = 0; i < after_.strips.size();) {
      std::size_t end = i;
      while (end < after_.strips.size() && after_.strips[end].plane == after_.strips[i].plane) {
        ++end;
      }
      SquareOfGround& own = squares[place(after_, after_.strips[i].plane)];
      own.strips = std::max(own.strips, end - i);
      i = end;
    }
    for (const auto& [where, own] : squares) {
      ground.east.push_back(middle(where.first));
      ground.north.push_back(middle(where.second));
      ground.before.push_back(std::sqrt(own.squares.before.mean()));
      ground.after.push_back(std::sqrt(own.squares.after.mean()));
      ground.roughness.push_back(own.roughness.mean());
      ground.slope.push_back(own.slope.mean());
      ground.strips.push_back(own.strips < 2 ? kNothing : static_cast<double>(own.strips));
    }
  }

  const LaidStrips& before_;
  const LaidStrips& after_;
  std::vector<double> roughness_;
  std::vector<bool> sound_;
  double size_ = 0;
};

FlightStrip flown_strip(const FlightShots& shots, const ShotPoses& poses, std::size_t begin,
                        std::size_t end, std::int64_t start_ns, std::size_t places) {
  FlightStrip strip;
  strip.strip = shots.strip[begin];
  strip.shots = end - begin;
  const auto seconds = [&](std::size_t row) {
    return 1e-9 * static_cast<double>(shots.time_ns[row] - start_ns);
  };
  strip.begin = seconds(begin);
  strip.duration = seconds(end - 1) - strip.begin;
  const auto& first = poses.pose[begin].position;
  const auto& last = poses.pose[end - 1].position;
  const double east = last[0] - first[0], north = last[1] - first[1];
  strip.course = wrap_to_two_pi(std::atan2(east, north));
  strip.speed = strip.duration > 0 ? std::hypot(east, north) / strip.duration : 0;
  std::vector<double> ranges(shots.range.begin() + static_cast<std::ptrdiff_t>(begin),
                             shots.range.begin() + static_cast<std::ptrdiff_t>(end));
  strip.range = median(ranges);
  std::vector<double> roll, pitch;
  for (std::size_t k = 0; k < places; ++k) {
    const std::size_t row = begin + k * (end - 1 - begin) / std::max<std::size_t>(places - 1, 1);
    const auto& pose = poses.pose[row];
    const Eigen::Vector3d position(pose.position[0], pose.position[1], pose.position[2]);
    strip.east.push_back(position.x());
    strip.north.push_back(position.y());
    const auto angles = trajectories::roll_pitch_heading(
        trajectories::Frame::local, position,
        Eigen::Quaterniond(pose.attitude[0], pose.attitude[1], pose.attitude[2], pose.attitude[3])
            .normalized());
    roll.push_back(angles.roll);
    pitch.push_back(angles.pitch);
  }
  const auto variance = [](const std::vector<double>& values) {
    Sum mean, squares;
    for (const double value : values) mean.add(value);
    for (const double value : values) squares.add(std::pow(value - mean.mean(), 2));
    return squares.mean();
  };
  strip.sway = std::sqrt(variance(roll) + variance(pitch));
  return strip;
}

void fill_strips(const FlightShots& shots, const ShotPoses& poses, FlightDetails& details) {
  std::vector<std::size_t> begins;
  for (std::size_t i = 0; i < shots.size(); ++i) {
    if (i == 0 || shots.strip[i] != shots.strip[i - 1]) begins.push_back(i);
  }
  details.strip_count = begins.size();
  const std::size_t strips = std::min(begins.size(), kMostStrips);
  const std::size_t places = std::clamp(kMostPlaces / strips, kFewestStripPlaces, kMostStripPlaces);
  for (std::size_t k = 0; k < strips; ++k) {
    const std::size_t end = k + 1 < begins.size() ? begins[k + 1] : shots.size();
    details.strips.push_back(
        flown_strip(shots, poses, begins[k], end, shots.time_ns.front(), places));
  }
}

}  // namespace

FlightDetails flight_details(const FlightShots& shots, const trajectories::Trajectory& trajectory,
                             const FlightCalibrationOptions& options,
                             const FlightCalibration& found, const FlightDetailsOptions& bounds,
                             const Progress& progress) {
  calibration::require_flight_shots(shots);
  require_at_least("most shots", static_cast<long long>(bounds.most_shots), 1000);
  require_at_least("most squares", static_cast<long long>(bounds.most_squares), 1);
  require_at_least("knots", static_cast<long long>(found.model.knots.size()), 2);
  require_length("corrections", static_cast<std::size_t>(found.model.corrections.cols()),
                 found.model.knots.size());
  const trajectories::Trajectory local = trajectories::in_tangent_frame(trajectory, found.tangent);
  const trajectories::Interpolation interpolation(local);
  const double start_clock = options.mount.clock_offset.value;
  const double margin = std::abs(found.model.clock_offset - start_clock) + kClockMargin;
  FlightShots sample = sample_of(shots, bounds.most_shots, options.seed);
  const std::vector<std::size_t> rows =
      calibration::rows_with_pose(sample, interpolation, start_clock, margin);
  if (rows.size() < sample.size()) sample = calibration::rows_of(sample, rows);
  require_at_least("shots with a pose", static_cast<long long>(sample.size()), 1);
  FlightDetails details;
  details.shots = sample.size();
  FlightModel after_model = found.model;
  after_model.knots = knots_for(found.model.knots, sample);
  ShotPoses poses = calibration::poses_of(sample, interpolation, found.model.clock_offset);
  const ShotPoints after = calibration::georeferenced(sample, poses, after_model);
  progress.report(0.3);
  details.plane_size = plane_size_of(after, options.cell_size);
  const LaidStrips laid_after =
      lay_strips(after, sample.strip, details.plane_size, kGate * found.range_sigma);
  progress.report(0.5);
  poses = calibration::poses_of(sample, interpolation, start_clock);
  fill_strips(sample, poses, details);
  const LaidStrips laid_before = lay_strips(
      calibration::georeferenced(sample, poses, start_model(options, found, after_model.knots)),
      sample.strip, details.plane_size, std::numeric_limits<double>::infinity());
  progress.report(0.8);
  FlightPictures(laid_before, laid_after, roughness_of(after, laid_after.cells),
                 options.most_roughness)
      .fill(details, bounds.most_squares);
  progress.report(1);
  return details;
}

}  // namespace risley::jobs
