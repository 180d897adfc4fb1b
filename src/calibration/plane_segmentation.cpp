// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/plane_segmentation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include <Eigen/Dense>
#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/random.hpp"

namespace risley::calibration {
namespace {

/// What each stream of random numbers is for.
constexpr std::uint64_t kOrderStream = 1, kSampleStream = 2;

constexpr std::size_t kScored = 2000;  ///< points that candidates are scored on
constexpr int kFewestTrials = 60, kMostTrials = 1000;
constexpr int kMostPolished = 40;           ///< candidates that are refitted before they are judged
constexpr double kMissed = 1e-3;            ///< probability that no trial hit the largest plane
constexpr int kMostRejected = 4;            ///< candidates set aside for filling no area
constexpr int kMostLabelRounds = 10;        ///< of labels and fits
constexpr double kLeastShare = 0.1;         ///< of the points around: a plane is there
constexpr std::size_t kLeastNear = 3;       ///< points around: a plane is there
constexpr double kLeastFill = 0.5;          ///< of the points in a plane's own cells
constexpr double kNearlyParallel = 0.0087;  ///< rad, half a degree
constexpr double kCrossing = 0.087;         ///< rad, 5 degrees: planes that have an edge
constexpr double kTail = 0.05;              ///< of the points beyond the extent on each side
/// Grid of the directions: so many points per cell, within these widths, rad (1 to 3 degrees).
constexpr double kPointsPerCell = 20, kLeastCell = 0.0175, kMostCell = 0.0524;

/// A point as the sensor sees it.
struct Beam {
  Vector3<double> direction;  ///< unit vector
  double range = 0;           ///< m
};

/// Noise of a point and how many sigmas still belong to a plane.
struct Noise {
  double range_variance, pointing_variance, gate_square;

  Noise(const SegmentationOptions& options, double gate_factor)
      : range_variance(options.range_noise * options.range_noise),
        pointing_variance(options.pointing_noise * options.pointing_noise),
        gate_square(gate_factor * gate_factor * options.gate * options.gate) {}

  /// Square of the point's distance from the plane over its variance, times gate^2.
  double distance_square(const Plane& plane, const Beam& beam) const {
    const double cosine = dot(plane.normal, beam.direction);
    const double distance = cosine * beam.range - plane.distance;
    return distance * distance / variance(cosine, beam.range);
  }
  /// 1 sigma^2 of the distance.
  double variance(double cosine, double range) const {
    const double square = cosine * cosine;
    return square * range_variance +
           std::max(0.0, 1.0 - square) * pointing_variance * range * range +
           std::numeric_limits<double>::min();
  }
};

/// Two unit vectors that make a right-handed orthogonal triad with a unit vector.
std::array<Vector3<double>, 2> triad_of(const Vector3<double>& forward) {
  const Vector3<double> up =
      std::abs(forward.z) < 0.9 ? Vector3<double>{0, 0, 1} : Vector3<double>{1, 0, 0};
  const Vector3<double> first = normalized(cross(up, forward));
  return {first, cross(forward, first)};
}

/// Directions as two angles from the middle of all, rad: the same distance from it in every
/// direction. And a grid of cells over them.
class FieldOfView {
 public:
  explicit FieldOfView(const std::vector<Beam>& beams) : angles_(beams.size()) {
    Vector3<double> sum;
    for (const Beam& beam : beams) sum += beam.direction;
    const double length = norm(sum);
    const Vector3<double> forward =
        length > 0 ? (1.0 / length) * sum : Vector3<double>{1.0, 0.0, 0.0};
    const auto [first, second] = triad_of(forward);
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    std::array<double, 2> least{kInfinity, kInfinity}, most{-kInfinity, -kInfinity};
    for (std::size_t i = 0; i < beams.size(); ++i) {
      const double x = dot(first, beams[i].direction), y = dot(second, beams[i].direction);
      const double sine = std::hypot(x, y);
      const double stretch =
          sine > 0 ? std::atan2(sine, dot(forward, beams[i].direction)) / sine : 1.0;
      angles_[i] = {stretch * x, stretch * y};
      for (std::size_t axis : {0, 1}) {
        least[axis] = std::min(least[axis], angles_[i][axis]);
        most[axis] = std::max(most[axis], angles_[i][axis]);
      }
    }
    const double area = (most[0] - least[0]) * (most[1] - least[1]);
    width_ = std::clamp(std::sqrt(kPointsPerCell * area / static_cast<double>(beams.size())),
                        kLeastCell, kMostCell);
    // An empty margin all around, so that every cell that holds points has eight neighbours.
    for (std::size_t axis : {0, 1}) {
      size_[axis] = 3 + static_cast<int>((most[axis] - least[axis]) / width_);
    }
    cell_.resize(beams.size());
    begin_.assign(cells() + 1, 0);
    for (std::size_t i = 0; i < beams.size(); ++i) {
      const int column = 1 + static_cast<int>((angles_[i][0] - least[0]) / width_);
      const int row = 1 + static_cast<int>((angles_[i][1] - least[1]) / width_);
      cell_[i] = row * size_[0] + column;
      ++begin_[static_cast<std::size_t>(cell_[i]) + 1];
    }
    for (std::size_t c = 0; c < cells(); ++c) begin_[c + 1] += begin_[c];
    order_.resize(beams.size());
    std::vector<std::size_t> next(begin_.begin(), begin_.end() - 1);
    for (std::size_t i = 0; i < beams.size(); ++i) {
      order_[next[static_cast<std::size_t>(cell_[i])]++] = i;
    }
  }

  double width() const { return width_; }
  std::size_t cells() const { return static_cast<std::size_t>(size_[0] * size_[1]); }
  std::size_t cell(std::size_t beam) const { return static_cast<std::size_t>(cell_[beam]); }
  std::span<const std::size_t> beams_in(std::size_t cell) const {
    return {order_.data() + begin_[cell], begin_[cell + 1] - begin_[cell]};
  }
  /// The cell so many columns and rows away, or none outside the field of view.
  std::optional<std::size_t> shifted(std::size_t cell, int columns, int rows) const {
    const int column = static_cast<int>(cell) % size_[0] + columns;
    const int row = static_cast<int>(cell) / size_[0] + rows;
    if (column < 0 || row < 0 || column >= size_[0] || row >= size_[1]) return std::nullopt;
    return static_cast<std::size_t>(row * size_[0] + column);
  }
  /// Counts of cells summed over each cell and its eight neighbours.
  std::vector<std::uint32_t> block_sums(const std::vector<std::uint32_t>& counts) const {
    std::vector<std::uint32_t> sums(counts.size(), 0);
    for (int row = 1; row + 1 < size_[1]; ++row) {
      for (int column = 1; column + 1 < size_[0]; ++column) {
        for (int r = row - 1; r <= row + 1; ++r) {
          for (int c = column - 1; c <= column + 1; ++c) {
            sums[static_cast<std::size_t>(row * size_[0] + column)] +=
                counts[static_cast<std::size_t>(r * size_[0] + c)];
          }
        }
      }
    }
    return sums;
  }

  /// Width of the field that beams fill in its shorter principal direction, rad. The outer tails
  /// are cut and the rest extrapolated, so that single strays do not widen a row of points.
  double shorter_extent(const std::vector<std::size_t>& beams) const {
    if (beams.size() < 3) return 0.0;
    const double count = static_cast<double>(beams.size());
    double x = 0, y = 0, xx = 0, xy = 0, yy = 0;
    for (std::size_t i : beams) {
      x += angles_[i][0] / count;
      y += angles_[i][1] / count;
    }
    for (std::size_t i : beams) {
      const double dx = angles_[i][0] - x, dy = angles_[i][1] - y;
      xx += dx * dx;
      xy += dx * dy;
      yy += dy * dy;
    }
    const double longer = 0.5 * std::atan2(2.0 * xy, xx - yy);
    std::vector<double> across(beams.size());
    for (std::size_t k = 0; k < beams.size(); ++k) {
      across[k] = std::cos(longer) * angles_[beams[k]][1] - std::sin(longer) * angles_[beams[k]][0];
    }
    const auto tail = static_cast<std::ptrdiff_t>(kTail * count);
    const auto low = across.begin() + tail, high = across.end() - 1 - tail;
    std::nth_element(across.begin(), low, across.end());
    const double lowest = *low;
    std::nth_element(across.begin(), high, across.end());
    return (*high - lowest) / (1.0 - 2.0 * kTail);
  }

 private:
  std::vector<std::array<double, 2>> angles_;
  double width_ = 0;
  std::array<int, 2> size_{};
  std::vector<int> cell_;
  std::vector<std::size_t> begin_, order_;  ///< beams sorted by cell
};

/// Plane through three points, or none when they are nearly on one line or in line with the origin.
std::optional<Plane> plane_through(const Beam& a, const Beam& b, const Beam& c) {
  const Vector3<double> corner = a.range * a.direction;
  const Vector3<double> to_b = b.range * b.direction - corner;
  const Vector3<double> to_c = c.range * c.direction - corner;
  const Vector3<double> normal = cross(to_b, to_c);
  const double length = norm(normal);
  if (!(length > 1e-3 * norm(to_b) * norm(to_c))) return std::nullopt;
  Plane plane{(1.0 / length) * normal, 0.0};
  plane.distance = dot(plane.normal, corner);
  if (plane.distance < 0) plane = {-plane.normal, -plane.distance};
  if (!(plane.distance > 1e-3 * a.range)) return std::nullopt;
  return plane;
}

/// Sums of a fit of ranges: a plane m . p = 1 is seen along u at the range 1 / (m . u). Ranges are
/// compared, and not distances from the plane, because their noise is then in the residual alone
/// and does not bias the normal.
class RangeFit {
 public:
  RangeFit(const Plane& plane, const Noise& noise) : plane_(plane), noise_(noise) {}

  /// @param factor  on the weight of the beam
  void add(const Beam& beam, double factor = 1.0) {
    const double cosine = dot(plane_.normal, beam.direction);
    if (!(cosine > 1e-4)) return;
    const double predicted = plane_.distance / cosine;
    // Derivative of the range by m is -predicted^2 u; its variance that of the distance / cosine^2.
    const double weight = factor * cosine * cosine / noise_.variance(cosine, beam.range);
    const double slope = predicted * predicted;
    const Eigen::Vector3d u(beam.direction.x, beam.direction.y, beam.direction.z);
    normal_equations_ += (weight * slope * slope) * u * u.transpose();
    right_side_ -= (weight * slope * (beam.range - predicted)) * u;
    ++count_;
  }

  /// The plane one Gauss-Newton step on, or none when the points do not determine one.
  std::optional<Plane> step() const {
    if (count_ < 3) return std::nullopt;
    const Eigen::LDLT<Eigen::Matrix3d> solver(normal_equations_);
    if (!(solver.rcond() > 1e-13)) return std::nullopt;
    const Eigen::Vector3d change = solver.solve(right_side_);
    const Vector3<double> m = (1.0 / plane_.distance) * plane_.normal +
                              Vector3<double>{change.x(), change.y(), change.z()};
    const double length = norm(m);
    if (!std::isfinite(length) || !(length > 0)) return std::nullopt;
    return Plane{(1.0 / length) * m, 1.0 / length};
  }

 private:
  Plane plane_;
  const Noise& noise_;
  Eigen::Matrix3d normal_equations_ = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right_side_ = Eigen::Vector3d::Zero();
  std::size_t count_ = 0;
};

/// Support of a candidate among the points it was scored on.
struct Score {
  double value = 0;  ///< sum of 1 - (sigmas / gate)^2 over the points within the gate
  std::size_t count = 0;
};

struct Candidate {
  Plane plane;
  Score score;
};

class Segmenter {
 public:
  Segmenter(std::vector<Beam> beams, const SegmentationOptions& options)
      : options_(options),
        noise_(options, 1.0),
        wide_(options, 2.0),
        beams_(std::move(beams)),
        view_(beams_),
        samples_(options.seed, kSampleStream),
        needed_(std::max({std::size_t{3}, options.least_points,
                          static_cast<std::size_t>(std::ceil(
                              options.least_fraction * static_cast<double>(beams_.size())))})),
        label_(beams_.size(), -1),
        at_edge_(beams_.size(), 0) {}

  void run() {
    std::vector<std::size_t> all(beams_.size());
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = i;
    on_one_line_ = view_.shorter_extent(all) < options_.least_extent;
    if (on_one_line_) return;
    find_planes();
    do settle();
    while (drop_one() || merge_one());
    if (!planes_.empty()) on_one_line_ = false;
    if (!options_.leave_out_edges) return;
    for (std::size_t i = 0; i < beams_.size(); ++i) {
      if (at_edge_[i]) label_[i] = -1;
    }
  }

  const std::vector<Plane>& planes() const { return planes_; }
  const std::vector<int>& label() const { return label_; }
  bool on_one_line() const { return on_one_line_; }

 private:
  /// Candidates for planes, one after the other among the points that no earlier one explains.
  void find_planes() {
    std::vector<std::size_t> rest = shuffled();
    free_.assign(beams_.size(), 1);
    int rejected = 0;
    while (planes_.size() < options_.most_planes && rest.size() >= needed_) {
      const std::optional<Candidate> best = largest_plane(rest);
      if (!best) return;
      const Plane plane = polished(best->plane, rest);
      std::vector<std::size_t> on, off;
      for (std::size_t i : rest) {
        (noise_.distance_square(plane, beams_[i]) <= noise_.gate_square ? on : off).push_back(i);
      }
      if (on.size() < needed_) return;
      if (view_.shorter_extent(on) < options_.least_extent) {
        on_one_line_ = true;  // unless a plane is found
        if (++rejected == kMostRejected) return;
      } else {
        planes_.push_back(plane);
      }
      for (std::size_t i : on) free_[i] = 0;
      rest = std::move(off);
    }
  }

  /// All beams in random order, so that the first ones are a fair choice.
  std::vector<std::size_t> shuffled() const {
    const RandomStream random(options_.seed, kOrderStream);
    std::vector<std::size_t> order(beams_.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
      const auto at = static_cast<std::size_t>(random.uniform(i) * static_cast<double>(i + 1));
      order[i] = order[at];
      order[at] = i;
    }
    return order;
  }

  std::size_t random_below(std::size_t size) {
    const double at = samples_.uniform(samples_taken_++) * static_cast<double>(size);
    return std::min(static_cast<std::size_t>(at), size - 1);
  }

  /// A beam that is still free within so many cells of another one, or any when none is found.
  std::size_t neighbour(std::size_t beam, int reach, const std::vector<std::size_t>& rest) {
    const auto side = static_cast<std::size_t>(2 * reach + 1);
    for (int attempt = 0; attempt < 8; ++attempt) {
      const std::size_t at = random_below(side * side);
      const auto cell = view_.shifted(view_.cell(beam), static_cast<int>(at % side) - reach,
                                      static_cast<int>(at / side) - reach);
      if (!cell) continue;
      const auto inside = view_.beams_in(*cell);
      if (inside.empty()) continue;
      const std::size_t found = inside[random_below(inside.size())];
      if (free_[found] && found != beam) return found;
    }
    return rest[random_below(rest.size())];
  }

  /// RANSAC. Triples are drawn from everywhere, from about six and from about two degrees in turn:
  /// the near ones find small planes, whose points far ones hardly ever hit thrice.
  std::optional<Candidate> largest_plane(const std::vector<std::size_t>& rest) {
    const std::vector<std::size_t> scored(
        rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(std::min(kScored, rest.size())));
    const std::array<int, 3> reach{0, cells_in(0.105), cells_in(0.035)};
    std::optional<Candidate> best;
    int trials = kMostTrials, polished_ones = 0;
    for (int trial = 0; trial < trials; ++trial) {
      const int near = reach[static_cast<std::size_t>(trial % 3)];
      const std::size_t a = rest[random_below(rest.size())];
      const std::size_t b = near > 0 ? neighbour(a, near, rest) : rest[random_below(rest.size())];
      const std::size_t c = near > 0 ? neighbour(a, near, rest) : rest[random_below(rest.size())];
      if (a == b || b == c || a == c) continue;
      const auto through = plane_through(beams_[a], beams_[b], beams_[c]);
      if (!through) continue;
      Candidate candidate{*through, score(*through, scored)};
      // Noise tilts a plane through near points: it deserves a fit before it is judged.
      const double bar = best ? (near > 0 && polished_ones < kMostPolished ? 0.4 : 1.0) : 0.0;
      if (best && candidate.score.value <= bar * best->score.value) continue;
      ++polished_ones;
      candidate.plane = polished(candidate.plane, scored);
      candidate.score = score(candidate.plane, scored);
      if (best && candidate.score.value <= best->score.value) continue;
      best = candidate;
      const double part =
          static_cast<double>(best->score.count) / static_cast<double>(scored.size());
      const double enough = std::log(kMissed) / std::log1p(-std::min(0.999, part * part * part));
      trials = static_cast<int>(std::clamp<double>(enough, kFewestTrials, kMostTrials));
    }
    return best;
  }

  int cells_in(double angle) const {
    return std::max(1, static_cast<int>(std::lround(angle / view_.width())));
  }

  Score score(const Plane& plane, const std::vector<std::size_t>& rows) const {
    Score result;
    for (std::size_t i : rows) {
      const double square = noise_.distance_square(plane, beams_[i]);
      const bool inside = square <= noise_.gate_square;
      result.value += inside ? 1.0 - square / noise_.gate_square : 0.0;
      result.count += inside;
    }
    return result;
  }

  /// Fits a plane to the points near it, first within twice the gate. The weights fall to nothing
  /// towards the gate (Tukey), so that a step on the wall does not tilt the plane.
  Plane polished(Plane plane, const std::vector<std::size_t>& rows) const {
    for (const Noise* noise : {&wide_, &noise_, &noise_, &noise_}) {
      RangeFit fit(plane, noise_);
      for (std::size_t i : rows) {
        const double rest = 1.0 - noise->distance_square(plane, beams_[i]) / noise->gate_square;
        if (rest > 0) fit.add(beams_[i], rest * rest);
      }
      const auto next = fit.step();
      if (!next) break;
      plane = *next;
    }
    return plane;
  }

  /// Labels and fits in turn until no label changes. Points at edges take no part in the fits.
  void settle() {
    for (int round = 0; round < kMostLabelRounds && !planes_.empty(); ++round) {
      std::vector<int> labels = nearest_labels();
      const bool settled = round > 0 && labels == label_;
      label_ = std::move(labels);
      if (settled) return;
      refit();
    }
    label_ = nearest_labels();
  }

  /// Every point goes to the plane it is nearest to, in sigmas, among those that are there: a plane
  /// is where it holds a share of the points around. Elsewhere it would take the tails of another
  /// plane's noise, all on one side.
  std::vector<int> nearest_labels() {
    const std::size_t planes = planes_.size();
    std::vector<double> square(planes * beams_.size());
    std::vector<std::vector<std::uint32_t>> near(planes,
                                                 std::vector<std::uint32_t>(view_.cells(), 0));
    std::vector<std::uint32_t> any(view_.cells(), 0);
    for (std::size_t i = 0; i < beams_.size(); ++i) {
      std::size_t best = planes;
      double least = noise_.gate_square;
      for (std::size_t k = 0; k < planes; ++k) {
        const double s = square[i * planes + k] = noise_.distance_square(planes_[k], beams_[i]);
        if (s <= least) {
          least = s;
          best = k;
        }
      }
      if (best == planes) continue;
      ++near[best][view_.cell(i)];
      ++any[view_.cell(i)];
    }
    any = view_.block_sums(any);
    for (auto& counts : near) counts = view_.block_sums(counts);
    const auto there = [&](std::size_t plane, std::size_t cell) {
      return near[plane][cell] >= kLeastNear && near[plane][cell] >= kLeastShare * any[cell];
    };
    std::vector<int> labels(beams_.size(), -1);
    at_edge_.assign(beams_.size(), 0);
    for (std::size_t i = 0; i < beams_.size(); ++i) {
      const std::size_t cell = view_.cell(i);
      double least = noise_.gate_square;
      for (std::size_t k = 0; k < planes; ++k) {
        if (!(square[i * planes + k] <= least) || !there(k, cell)) continue;
        least = square[i * planes + k];
        labels[i] = static_cast<int>(k);
      }
      for (std::size_t k = 0; k < planes && labels[i] >= 0; ++k) {
        const Plane& own = planes_[static_cast<std::size_t>(labels[i])];
        at_edge_[i] |= there(k, cell) && doubtful(own, planes_[k], beams_[i]);
      }
    }
    return labels;
  }

  /// Whether a beam passes an edge of two planes so closely that noise decides which of them its
  /// point is nearer to. The point's own noise plays no part in the answer: leaving such points out
  /// cuts no tail.
  bool doubtful(const Plane& a, const Plane& b, const Beam& beam) const {
    if (std::abs(dot(a.normal, b.normal)) > std::cos(kCrossing)) return false;
    const double cosine_a = dot(a.normal, beam.direction);
    const double cosine_b = dot(b.normal, beam.direction);
    if (!(cosine_a > 0) || !(cosine_b > 0)) return false;
    const double range_a = a.distance / cosine_a, range_b = b.distance / cosine_b;
    const double sigmas = std::sqrt(noise_.variance(cosine_a, range_a)) / cosine_a +
                          std::sqrt(noise_.variance(cosine_b, range_b)) / cosine_b;
    return std::abs(range_a - range_b) < options_.gate * sigmas;
  }

  void refit() {
    for (int step = 0; step < 2; ++step) {
      std::vector<RangeFit> fits;
      for (const Plane& plane : planes_) fits.emplace_back(plane, noise_);
      for (std::size_t i = 0; i < beams_.size(); ++i) {
        if (label_[i] < 0 || at_edge_[i]) continue;
        fits[static_cast<std::size_t>(label_[i])].add(beams_[i]);
      }
      for (std::size_t k = 0; k < planes_.size(); ++k) {
        planes_[k] = fits[k].step().value_or(planes_[k]);
      }
    }
  }

  std::vector<std::vector<std::size_t>> members() const {
    std::vector<std::vector<std::size_t>> rows(planes_.size());
    for (std::size_t i = 0; i < beams_.size(); ++i) {
      if (label_[i] >= 0) rows[static_cast<std::size_t>(label_[i])].push_back(i);
    }
    return rows;
  }

  void remove(std::size_t plane) {
    planes_.erase(planes_.begin() + static_cast<std::ptrdiff_t>(plane));
  }

  /// Removes the smallest plane that is none after all. @return whether there was one
  bool drop_one() {
    const auto rows = members();
    std::optional<std::size_t> worst;
    for (std::size_t k = 0; k < planes_.size(); ++k) {
      const bool narrow = view_.shorter_extent(rows[k]) < options_.least_extent;
      if (rows[k].size() >= needed_ && !narrow && fill(rows[k]) >= kLeastFill) continue;
      if (!worst || rows[k].size() < rows[*worst].size()) worst = k;
      if (narrow && rows[k].size() >= needed_) on_one_line_ = true;
    }
    if (worst) remove(*worst);
    return worst.has_value();
  }

  /// Part of all points, in the cells where a plane holds a quarter of them, that belong to it. A
  /// slice of a body holds less than half.
  double fill(const std::vector<std::size_t>& rows) const {
    std::vector<std::size_t> counts(view_.cells(), 0);
    for (std::size_t i : rows) ++counts[view_.cell(i)];
    double own = 0, all = 0;
    for (std::size_t c = 0; c < counts.size(); ++c) {
      const std::size_t inside = view_.beams_in(c).size();
      if (counts[c] == 0 || 4 * counts[c] < inside) continue;
      own += static_cast<double>(counts[c]);
      all += static_cast<double>(inside);
    }
    return all > 0 ? own / all : 0.0;
  }

  /// Removes the smaller one of two planes that are the same surface. @return whether there were
  bool merge_one() {
    const auto rows = members();
    for (std::size_t smaller = 0; smaller < planes_.size(); ++smaller) {
      for (std::size_t larger = 0; larger < planes_.size(); ++larger) {
        if (smaller == larger || rows[smaller].size() > rows[larger].size()) continue;
        std::size_t both = 0;
        for (std::size_t i : rows[smaller]) {
          both += noise_.distance_square(planes_[larger], beams_[i]) <= noise_.gate_square;
        }
        const double angle = angle_between(planes_[smaller].normal, planes_[larger].normal);
        const double needed = angle < kNearlyParallel ? 0.5 : 0.9;
        if (static_cast<double>(both) < needed * static_cast<double>(rows[smaller].size())) {
          continue;
        }
        remove(smaller);
        return true;
      }
    }
    return false;
  }

  const SegmentationOptions& options_;
  Noise noise_, wide_;  ///< with the gate, and with twice the gate
  std::vector<Beam> beams_;
  FieldOfView view_;
  RandomStream samples_;
  std::uint64_t samples_taken_ = 0;
  std::size_t needed_;  ///< points of a plane
  std::vector<unsigned char> free_;
  std::vector<Plane> planes_;
  std::vector<int> label_;
  std::vector<unsigned char> at_edge_;
  bool on_one_line_ = false;
};

void check(const SegmentationOptions& options) {
  const auto require = [](bool good, const char* name, double value, const char* allowed) {
    if (!good) throw InvalidArgument(fmt::format("{} = {}, allowed {}", name, value, allowed));
  };
  require(options.range_noise > 0 && std::isfinite(options.range_noise), "range_noise, m,",
          options.range_noise, "above 0");
  require(options.pointing_noise >= 0 && std::isfinite(options.pointing_noise),
          "pointing_noise, rad,", options.pointing_noise, "0 and above");
  require(options.gate > 0 && std::isfinite(options.gate), "gate", options.gate, "above 0");
  require(options.least_fraction >= 0 && options.least_fraction <= 1, "least_fraction",
          options.least_fraction, "0 to 1");
  require(options.least_extent >= 0, "least_extent, rad,", options.least_extent, "0 and above");
}

}  // namespace

double distance_sigma(const Plane& plane, const Vector3<double>& point,
                      const SegmentationOptions& options) {
  const double range = norm(point);
  return std::sqrt(Noise(options, 1.0).variance(dot(plane.normal, point) / range, range));
}

Segmentation segment_planes(std::span<const Vector3<double>> points,
                            const SegmentationOptions& options) {
  check(options);
  std::vector<Beam> beams;
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double range = norm(points[i]);
    if (!std::isfinite(range) || !(range > 0)) continue;
    beams.push_back({(1.0 / range) * points[i], range});
    rows.push_back(i);
  }
  Segmentation result;
  result.label.assign(points.size(), -1);
  if (beams.size() < std::max<std::size_t>(3, options.least_points)) return result;

  Segmenter segmenter(std::move(beams), options);
  segmenter.run();
  result.on_one_line = segmenter.on_one_line();
  const std::size_t planes = segmenter.planes().size();
  std::vector<std::size_t> counts(planes, 0), order(planes);
  for (int label : segmenter.label()) {
    if (label >= 0) ++counts[static_cast<std::size_t>(label)];
  }
  for (std::size_t k = 0; k < planes; ++k) order[k] = k;
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return counts[a] > counts[b]; });
  std::vector<int> place(planes);
  for (std::size_t k = 0; k < planes; ++k) {
    place[order[k]] = static_cast<int>(k);
    result.planes.push_back(segmenter.planes()[order[k]]);
    result.points.push_back(counts[order[k]]);
  }
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const int label = segmenter.label()[i];
    if (label >= 0) result.label[rows[i]] = place[static_cast<std::size_t>(label)];
  }
  return result;
}

Plane fitted_plane(std::span<const Vector3<double>> points, std::span<const std::size_t> use) {
  if (use.size() < 3) {
    throw EstimationError(fmt::format("a plane of {} points, needed 3", use.size()));
  }
  Vector3<double> middle;
  for (std::size_t i : use) middle += (1.0 / static_cast<double>(use.size())) * points[i];
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  for (std::size_t i : use) {
    const Vector3<double> p = points[i] - middle;
    const Eigen::Vector3d from_middle(p.x, p.y, p.z);
    moments += from_middle * from_middle.transpose();
  }
  if (!moments.allFinite()) throw EstimationError("a plane of points that are not finite");
  // Squares of the singular values, smallest first.
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(moments);
  if (!(axes.eigenvalues()[1] > 1e-10 * axes.eigenvalues()[2])) {
    throw EstimationError("a plane of points that lie on one line");
  }
  const Eigen::Vector3d normal = axes.eigenvectors().col(0).normalized();
  Plane plane{{normal.x(), normal.y(), normal.z()}, 0.0};
  plane.distance = dot(plane.normal, middle);
  if (plane.distance < 0) plane = {-plane.normal, -plane.distance};
  return plane;
}

}  // namespace risley::calibration
