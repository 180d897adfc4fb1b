// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/ground_cells.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "risley/calibration/rays.hpp"
#include "risley/core/error.hpp"
#include "risley/core/median.hpp"
#include "risley/core/require.hpp"
#include "risley/parallel/parallel.hpp"

#include "calibration/eigen_vectors.hpp"
#include "calibration/shot_blocks.hpp"
#include "calibration/sorted_rows.hpp"

namespace risley::calibration {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

constexpr double kFarthest = 1e6;  // m
constexpr double kCauchyMads = 1.5;
constexpr int kFits = 8;
/// Largest scatter of a plane, over the noise: a little unevenness, and the effect of chance on the
/// median of n distances, 1.2 / sqrt(n), two and a half times.
constexpr double kUnevenness = 1.1, kScatterSigmas = 3;
/// Most points of a cell for fitting its plane: the adjustment uses all.
constexpr std::size_t kFittedPoints = 512;
/// Sigma of an unknown that a pair of strips does not determine, m: far beyond any terrain.
constexpr double kShiftPrior = 1;
constexpr double kLeastSlope = 0.02;  // RMS over the cells

/// Numbers of cells by their column and row.
class CellNumbers {
 public:
  explicit CellNumbers(std::vector<std::uint64_t> keys) : keys_(std::move(keys)) {
    std::size_t size = 16;
    while (size < 2 * keys_.size()) size *= 2;
    table_.assign(size, kNone);
    for (std::size_t i = 0; i < keys_.size(); ++i) {
      std::size_t at = place(keys_[i]);
      while (table_[at] != kNone) at = (at + 1) & (table_.size() - 1);
      table_[at] = static_cast<std::uint32_t>(i);
    }
  }
  std::size_t size() const { return keys_.size(); }
  std::uint32_t at(std::uint64_t key) const {
    std::size_t at = place(key);
    while (keys_[table_[at]] != key) at = (at + 1) & (table_.size() - 1);
    return table_[at];
  }

 private:
  static constexpr std::uint32_t kNone = 0xffffffffU;
  std::size_t place(std::uint64_t key) const {
    return static_cast<std::size_t>((key * 0x9e3779b97f4a7c15U) >> 20) & (table_.size() - 1);
  }
  std::vector<std::uint64_t> keys_;
  std::vector<std::uint32_t> table_;
};

std::uint64_t key_of(const std::array<float, 3>& point, const GroundCellOptions& options) {
  const auto number = [&](double value, double shift) {
    return static_cast<std::uint32_t>(
        static_cast<std::int32_t>(std::floor(value / options.size + shift)));
  };
  return std::uint64_t{number(point[1], options.shift_north)} << 32 |
         number(point[0], options.shift_east);
}

/// z = z0 + slope.(x, y) about a centre.
struct FittedGround {
  GroundPlane plane;
  std::vector<double> distance;  ///< of the points along the normal, absolute, m
};

std::optional<FittedGround> fit(const ShotPoints& points, std::span<const std::uint32_t> rows) {
  const std::size_t count = std::min(rows.size(), kFittedPoints);
  Eigen::Matrix3Xd some(3, count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto& point = points[rows[i * rows.size() / count]];
    some.col(i) = Vector3d(point[0], point[1], point[2]);
  }
  const Vector3d centre = some.rowwise().mean();
  some.colwise() -= centre;
  const double extent = std::max(some.topRows<2>().cwiseAbs().maxCoeff(), 1e-3);
  Vector3d solution = Vector3d::Zero();
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(some.cols());
  FittedGround result;
  for (int iteration = 0; iteration < kFits; ++iteration) {
    Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
    Vector3d right = Vector3d::Zero();
    for (Index i = 0; i < some.cols(); ++i) {
      const Vector3d row(some(0, i) / extent, some(1, i) / extent, 1);
      hessian += weight[i] * row * row.transpose();
      right += weight[i] * some(2, i) * row;
    }
    // Points of a line do not determine the slope across it: a level plane then.
    hessian.diagonal().head<2>().array() += 1e-4 * hessian(2, 2);
    solution = Eigen::LDLT<Eigen::Matrix3d>(hessian).solve(right);
    const Vector3d normal(-solution[0] / extent, -solution[1] / extent, 1);
    const double steep = 1 / normal.norm();
    std::vector<double> distance(count);
    for (Index i = 0; i < some.cols(); ++i) {
      distance[i] = std::abs(normal.dot(some.col(i)) - solution[2]) * steep;
    }
    result.distance = distance;
    const double scale = kCauchyMads * median(distance);
    result.plane.normal = normal * steep;
    result.plane.centre = centre + Vector3d(0, 0, solution[2]);
    if (!(scale > 1e-9)) break;
    for (Index i = 0; i < some.cols(); ++i) {
      const double part = result.distance[i] / scale;
      weight[i] = 1 / (1 + part * part);
    }
  }
  if (!result.plane.normal.allFinite() || !result.plane.centre.allFinite()) return std::nullopt;
  return result;
}

/// The plane of some points, or the reason why there is none.
struct Outcome {
  std::optional<FittedGround> ground;
  bool rough = false;
};

Outcome plane_of(const ShotPoints& points, std::span<const std::uint32_t> rows,
                 const GroundCellOptions& options) {
  Outcome result;
  std::optional<FittedGround> ground = fit(points, rows);
  if (!ground || ground->plane.normal.z() < std::cos(options.steepest)) return result;
  std::vector<double> distance = ground->distance;
  const double points_fitted = static_cast<double>(distance.size());
  const double significant =
      options.noise > 0 ? options.noise * (kUnevenness + kScatterSigmas / std::sqrt(points_fitted))
                        : std::numeric_limits<double>::infinity();
  if (kSigmaOverMedianDistance * median(distance) > std::min(options.most_roughness, significant)) {
    result.rough = true;
    return result;
  }
  result.ground = std::move(ground);
  return result;
}

void require_cells(const GroundCellOptions& options) {
  require_between("size of a cell", options.size, 0.01, 1e4, "m");
  require_between("shift of the grid", options.shift_east, -1, 1);
  require_between("shift of the grid", options.shift_north, -1, 1);
  require_at_least("least shots of a cell", options.least_shots, 3);
  require_between("steepest", options.steepest, 0, 1.57, "rad");
  require_threshold("most roughness", options.most_roughness);
  require_not_below("noise of the cells", options.noise, 0, "m");
}

using RowsOfPlanes = SortedRows<std::uint32_t>;

RowsOfPlanes rows_of_planes(std::size_t planes, const std::vector<std::int32_t>& plane) {
  return {planes, plane.size(), [&](std::size_t i) { return plane[i]; }};
}

}  // namespace

ShotPoints georeferenced(const FlightShots& shots, const ShotPoses& poses,
                         const FlightModel& model) {
  require_length("poses", poses.pose.size(), shots.size());
  require_length("rotation_angle", shots.rotation_angle.size(), model.train.prisms());
  require_length("corrections", model.corrections.cols(), model.knots.size());
  ShotPoints points(shots.size());
  const double clock_step = model.clock_offset - poses.clock_offset;
  const Eigen::Matrix3d mount = model.nominal * model.boresight;
  const auto work = [&](const TrajectoryKnots::Interval& interval, std::size_t begin,
                        std::size_t end) {
    const Rays rays(model.train, model.geometry, shots.rotation_angle, shots.beam, {begin, end});
    const auto knot = static_cast<Index>(interval.knot);
    const Eigen::Matrix<double, 6, 1> before = model.corrections.col(knot),
                                      change = model.corrections.col(knot + 1) - before;
    const double per_ns = 1 / static_cast<double>(interval.end_ns - interval.begin_ns);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const std::size_t shot = begin + i;
      const ShotPose& pose = poses.pose[shot];
      const Eigen::Matrix<double, 6, 1> correction =
          before + static_cast<double>(shots.time_ns[shot] - interval.begin_ns) * per_ns * change;
      const Vector3d velocity(pose.velocity[0], pose.velocity[1], pose.velocity[2]);
      const Vector3d turn = correction.tail<3>() + clock_step * Vector3d(pose.angular_velocity[0],
                                                                         pose.angular_velocity[1],
                                                                         pose.angular_velocity[2]);
      const Eigen::Quaterniond attitude(pose.attitude[0], pose.attitude[1], pose.attitude[2],
                                        pose.attitude[3]);
      const Vector3d seen = eigen(rays.point(i, shots.range[shot] - model.range_offset));
      const Vector3d arm = attitude * (model.lever_arm + mount * seen);
      const Vector3d across = turn.cross(arm);
      const Vector3d point = Vector3d(pose.position[0], pose.position[1], pose.position[2]) +
                             correction.head<3>() + clock_step * velocity + arm + across +
                             0.5 * turn.cross(across);
      const bool sound = point.allFinite() && point.cwiseAbs().maxCoeff() < kFarthest;
      for (std::size_t k = 0; k < 3; ++k) {
        points[shot][k] =
            sound ? static_cast<float>(point[k]) : std::numeric_limits<float>::quiet_NaN();
      }
    }
  };
  const auto& intervals = model.knots.intervals;
  parallel::for_each(intervals.size(), [&](std::size_t i) {
    require_rows("shots of an interval", intervals[i].first_shot, intervals[i].end_shot,
                 shots.size());
    for (std::size_t begin = intervals[i].first_shot; begin < intervals[i].end_shot;
         begin += kBlockShots) {
      work(intervals[i], begin, std::min(begin + kBlockShots, intervals[i].end_shot));
    }
  });
  return points;
}

GroundCells ground_cells(const ShotPoints& points, const std::vector<std::uint16_t>& strip,
                         const GroundCellOptions& options) {
  require_length("strip", strip.size(), points.size());
  require_cells(options);
  const std::size_t blocks = (points.size() + kBlockShots - 1) / kBlockShots;
  std::vector<std::vector<std::uint64_t>> found(blocks);
  for_each_block(points.size(), [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint64_t>& own = found[begin / kBlockShots];
    for (std::size_t i = begin; i < end; ++i) {
      if (std::isfinite(points[i][0])) own.push_back(key_of(points[i], options));
    }
    std::ranges::sort(own);
    own.erase(std::unique(own.begin(), own.end()), own.end());
  });
  std::vector<std::uint64_t> keys;
  for (const auto& own : found) keys.insert(keys.end(), own.begin(), own.end());
  std::ranges::sort(keys);
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  const CellNumbers numbers(std::move(keys));
  GroundCells cells;
  cells.plane.assign(points.size(), kNoPlane);
  for_each_block(points.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (std::isfinite(points[i][0])) {
        cells.plane[i] = static_cast<std::int32_t>(numbers.at(key_of(points[i], options)));
      }
    }
  });
  const RowsOfPlanes rows = rows_of_planes(numbers.size(), cells.plane);
  std::vector<Outcome> outcome(numbers.size());
  parallel::for_each(numbers.size(), [&](std::size_t cell) {
    const auto own = rows.of(cell);
    if (own.size() < options.least_shots) return;
    std::size_t strips = 1;  // rows ascend, and so do their strips
    for (std::size_t i = 1; i < own.size(); ++i) strips += strip[own[i]] != strip[own[i - 1]];
    if (strips >= options.least_strips) outcome[cell] = plane_of(points, own, options);
  });
  std::vector<std::int32_t> number(numbers.size(), kNoPlane);
  std::vector<double> distances;
  for (std::size_t cell = 0; cell < numbers.size(); ++cell) {
    cells.rough += outcome[cell].rough;
    if (!outcome[cell].ground) continue;
    number[cell] = static_cast<std::int32_t>(cells.planes.size());
    cells.planes.push_back(outcome[cell].ground->plane);
    const auto& own = outcome[cell].ground->distance;
    distances.insert(distances.end(), own.begin(), own.end());
  }
  for_each_block(points.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (cells.plane[i] != kNoPlane) {
        cells.plane[i] = number[cells.plane[i]];
      }
    }
  });
  if (!distances.empty()) cells.scatter = kSigmaOverMedianDistance * median(distances);
  return cells;
}

std::vector<std::int32_t> add_circles(const ShotPoints& points,
                                      const std::vector<GroundCircle>& circles,
                                      const GroundCellOptions& options, GroundCells& cells) {
  require_cells(options);
  require_length("planes of the points", cells.plane.size(), points.size());
  for (const GroundCircle& circle : circles) {
    require_above("radius of a circle", circle.radius, 0, "m");
    for (Index i = 0; i < 3; ++i) require_finite("centre of a circle", circle.centre[i], "m");
  }
  std::vector<std::int32_t> circle_of(points.size(), kNoPlane);
  for_each_block(points.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      for (std::size_t c = 0; c < circles.size() && circle_of[i] == kNoPlane; ++c) {
        if (circles[c].holds(points[i])) circle_of[i] = static_cast<std::int32_t>(c);
      }
    }
  });
  const RowsOfPlanes rows = rows_of_planes(circles.size(), circle_of);
  std::vector<std::int32_t> planes(circles.size(), kNoPlane);
  for (std::size_t c = 0; c < circles.size(); ++c) {
    const auto own = rows.of(c);
    if (own.size() < options.least_shots) continue;
    const Outcome outcome = plane_of(points, own, options);
    if (!outcome.ground) continue;
    planes[c] = static_cast<std::int32_t>(cells.planes.size());
    cells.planes.push_back(outcome.ground->plane);
    for (const std::uint32_t row : own) cells.plane[row] = planes[c];
  }
  return planes;
}

std::vector<StripInCell> strips_in_cells(const ShotPoints& points,
                                         const std::vector<std::uint16_t>& strip,
                                         const PlaneOfShot& plane,
                                         const std::vector<GroundPlane>& planes, double gate,
                                         std::size_t least_shots) {
  require_length("strip", strip.size(), points.size());
  require_length("planes of the shots", plane.size(), points.size());
  require_threshold("gate", gate);
  const RowsOfPlanes rows = rows_of_planes(planes.size(), plane);
  std::vector<std::vector<StripInCell>> seen(planes.size());
  parallel::for_each(planes.size(), [&](std::size_t p) {
    const auto own = rows.of(p);
    for (std::size_t i = 0; i < own.size();) {
      StripInCell one{p, strip[own[i]], 0, 0};
      for (; i < own.size() && strip[own[i]] == one.strip; ++i) {
        const auto& point = points[own[i]];
        const double distance =
            planes[p].normal.dot(Vector3d(point[0], point[1], point[2]) - planes[p].centre);
        if (!(std::abs(distance) <= gate)) continue;
        one.mean += distance;
        ++one.shots;
      }
      if (one.shots < std::max<std::size_t>(least_shots, 1)) continue;
      one.mean /= static_cast<double>(one.shots);
      seen[p].push_back(one);
    }
  });
  std::vector<StripInCell> all;
  for (const auto& own : seen) all.insert(all.end(), own.begin(), own.end());
  return all;
}

std::vector<StripPair> strip_pairs(const ShotPoints& points,
                                   const std::vector<std::uint16_t>& strip,
                                   const PlaneOfShot& plane, const std::vector<GroundPlane>& planes,
                                   double gate, std::size_t least_shots) {
  const std::vector<StripInCell> seen =
      strips_in_cells(points, strip, plane, planes, gate, least_shots);
  struct Sums {
    StripPair pair;
    Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
    Vector3d right = Vector3d::Zero();
    double squares = 0;
  };
  std::vector<Sums> sums;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    for (std::size_t j = i + 1; j < seen.size() && seen[j].plane == seen[i].plane; ++j) {
      const auto first = seen[i].strip, second = seen[j].strip;
      auto at = std::ranges::find_if(sums, [&](const Sums& own) {
        return own.pair.first == first && own.pair.second == second;
      });
      if (at == sums.end()) {
        sums.push_back({});
        at = sums.end() - 1;
        at->pair.first = first;
        at->pair.second = second;
      }
      const Vector3d& normal = planes[seen[i].plane].normal;
      const double difference = seen[j].mean - seen[i].mean;
      ++at->pair.cells;
      at->pair.mean += difference;
      at->squares += difference * difference;
      at->hessian += normal * normal.transpose();
      at->right += difference * normal;
    }
  }
  std::vector<StripPair> pairs;
  for (Sums& own : sums) {
    const auto count = static_cast<double>(own.pair.cells);
    // Slopes within the noise of the normals do not determine a horizontal shift.
    for (Index axis = 0; axis < 2; ++axis) {
      if (own.hessian(axis, axis) > count * kLeastSlope * kLeastSlope) continue;
      own.hessian.row(axis).setZero();
      own.hessian.col(axis).setZero();
      own.right[axis] = 0;
    }
    own.pair.mean /= count;
    own.pair.rms = std::sqrt(own.squares / count);
    // The residuals after the shift are the noise of the cells; at first it is all of the
    // difference.
    double variance = std::max(own.squares / count, 1e-12);
    for (int iteration = 0; iteration < 3; ++iteration) {
      const Eigen::Matrix3d hessian =
          own.hessian / variance + Eigen::Matrix3d::Identity() / (kShiftPrior * kShiftPrior);
      const Eigen::Matrix3d covariance = hessian.inverse();
      own.pair.shift = covariance * own.right / variance;
      own.pair.sigma = covariance.diagonal().cwiseSqrt();
      const double left = own.squares - 2 * own.pair.shift.dot(own.right) +
                          own.pair.shift.dot(own.hessian * own.pair.shift);
      variance = std::max(left / std::max(1.0, count - 3), 1e-12);
    }
    pairs.push_back(own.pair);
  }
  std::ranges::sort(pairs, [](const StripPair& a, const StripPair& b) {
    return std::pair(a.first, a.second) < std::pair(b.first, b.second);
  });
  return pairs;
}

const StripPair* find_pair(const std::vector<StripPair>& pairs, const StripPair& like) {
  const auto at = std::ranges::find_if(pairs, [&](const StripPair& pair) {
    return pair.first == like.first && pair.second == like.second;
  });
  return at == pairs.end() ? nullptr : &*at;
}

}  // namespace risley::calibration
