// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/plane_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "risley/core/random.hpp"

#include "calibration/range_fit.hpp"

namespace risley::calibration {
namespace {

/// Purpose of each stream of random numbers.
constexpr std::uint64_t kOrderStream = 1, kSampleStream = 2;

/// Number of points on which candidates are scored: shares are then known to 1 %, sqrt(0.25 /
/// 2000).
constexpr std::size_t kScored = 2000;
/// Probability that no trial hit the largest plane three times. That takes log(kMissed) / log(1 -
/// share^3) trials: 52 for half of the points, 860 for a fifth; the bounds lie beyond. Smaller
/// planes are left to triples of near points.
constexpr double kMissed = 1e-3;
constexpr int kFewestTrials = 60, kMostTrials = 1000;
/// Distance of the near points of a triple, rad (six and two degrees): docs/theory/calibration.md
constexpr double kFartherTriple = 0.105, kNearTriple = 0.035;
/// Near triples with this part of the best score are refitted before the decision. Each costs four
/// fits, so their number is bounded.
constexpr double kWorthPolishing = 0.4;
constexpr int kMostPolished = 40;
/// Most candidates set aside for filling no area: each removes its points from the search, and the
/// rest of a scan after this many rows of points is not a wall either.
constexpr int kMostRejected = 4;

/// Support of a candidate among the points it was scored on.
struct Score {
  double value = 0;  ///< sum of 1 - (sigmas / gate)^2 over the points within the gate
  std::size_t count = 0;
};

struct Candidate {
  Plane plane;
  Score score;
};

class Search {
 public:
  explicit Search(const ScannedPoints& points)
      : points_(points), wide_(points.options, 2.0), samples_(points.options.seed, kSampleStream) {}

  FoundCandidates run() {
    FoundCandidates found;
    std::vector<std::size_t> rest = shuffled();
    free_.assign(points_.beams.size(), 1);
    int rejected = 0;
    while (found.planes.size() < points_.options.most_planes && rest.size() >= points_.needed) {
      const std::optional<Candidate> best = largest_plane(rest);
      if (!best) return found;
      const Plane plane = polished(best->plane, rest);
      std::vector<std::size_t> on, off;
      for (std::size_t i : rest) {
        (points_.noise.distance_square(plane, points_.beams[i]) <= points_.noise.gate_square ? on
                                                                                             : off)
            .push_back(i);
      }
      if (on.size() < points_.needed) return found;
      if (points_.too_narrow(on)) {
        found.narrow = true;
        if (++rejected == kMostRejected) return found;
      } else {
        found.planes.push_back(plane);
      }
      for (std::size_t i : on) free_[i] = 0;
      rest = std::move(off);
    }
    return found;
  }

 private:
  /// All beams in random order, so that the first ones are a fair sample.
  std::vector<std::size_t> shuffled() const {
    const RandomStream random(points_.options.seed, kOrderStream);
    std::vector<std::size_t> order(points_.beams.size());
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

  /// A beam that is still free within some cells of another one, or any if there is none.
  std::size_t neighbour(std::size_t beam, int reach, const std::vector<std::size_t>& rest) {
    const auto side = static_cast<std::size_t>(2 * reach + 1);
    for (int attempt = 0; attempt < 8; ++attempt) {
      const std::size_t at = random_below(side * side);
      const auto cell =
          points_.grid.shifted(points_.grid.cell(beam), static_cast<int>(at % side) - reach,
                               static_cast<int>(at / side) - reach);
      if (!cell) continue;
      const auto inside = points_.grid.beams_in(*cell);
      if (inside.empty()) continue;
      const std::size_t found = inside[random_below(inside.size())];
      if (free_[found] && found != beam) return found;
    }
    return rest[random_below(rest.size())];
  }

  /// RANSAC. Triples are drawn from everywhere, from about six and from about two degrees in turn:
  /// the near ones find small planes, which far ones hardly ever hit three times.
  std::optional<Candidate> largest_plane(const std::vector<std::size_t>& rest) {
    const std::vector<std::size_t> scored(rest.begin(),
                                          rest.begin() + (std::min(kScored, rest.size())));
    const std::array<int, 3> reach{0, cells_in(kFartherTriple), cells_in(kNearTriple)};
    std::optional<Candidate> best;
    int trials = kMostTrials, polished_ones = 0;
    for (int trial = 0; trial < trials; ++trial) {
      const int near = reach[trial % 3];
      const std::size_t a = rest[random_below(rest.size())];
      const std::size_t b = near > 0 ? neighbour(a, near, rest) : rest[random_below(rest.size())];
      const std::size_t c = near > 0 ? neighbour(a, near, rest) : rest[random_below(rest.size())];
      if (a == b || b == c || a == c) continue;
      const auto through = plane_through(points_.beams[a], points_.beams[b], points_.beams[c]);
      if (!through) continue;
      Candidate candidate{*through, score(*through, scored)};
      // Noise tilts a plane through near points: it is refitted before the decision.
      const double bar =
          best ? (near > 0 && polished_ones < kMostPolished ? kWorthPolishing : 1.0) : 0.0;
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
    return std::max(1, static_cast<int>(std::lround(angle / points_.grid.width())));
  }

  Score score(const Plane& plane, const std::vector<std::size_t>& rows) const {
    Score result;
    for (std::size_t i : rows) {
      const double square = points_.noise.distance_square(plane, points_.beams[i]);
      const bool inside = square <= points_.noise.gate_square;
      result.value += inside ? 1.0 - square / points_.noise.gate_square : 0.0;
      result.count += inside;
    }
    return result;
  }

  /// Fits a plane to the points near it, first within twice the gate. The weights fall to zero
  /// towards the gate (Tukey), so that a step on the wall does not tilt the plane.
  Plane polished(Plane plane, const std::vector<std::size_t>& rows) const {
    for (const PointNoise* noise : {&wide_, &points_.noise, &points_.noise, &points_.noise}) {
      RangeFit fit(plane, points_.noise);
      for (std::size_t i : rows) {
        const double rest =
            1.0 - noise->distance_square(plane, points_.beams[i]) / noise->gate_square;
        if (rest > 0) fit.add(points_.beams[i], rest * rest);
      }
      const auto next = fit.step();
      if (!next) break;
      plane = *next;
    }
    return plane;
  }

  const ScannedPoints& points_;
  PointNoise wide_;  ///< with twice the gate
  RandomStream samples_;
  std::uint64_t samples_taken_ = 0;
  std::vector<unsigned char> free_;  ///< points that no plane explains yet
};

}  // namespace

FoundCandidates search_planes(const ScannedPoints& points) { return Search(points).run(); }

}  // namespace risley::calibration
