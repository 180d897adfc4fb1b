// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "estimation/evident_places.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include <Eigen/Core>

#include "risley/algebra/symmetric.hpp"
#include "risley/core/direction.hpp"

namespace risley::estimation {
namespace {

using recordings::kNoPlace;

/// Shots of a run that are examined on either side of a border, and the fewest that are enough.
constexpr std::size_t kArm = 8, kFewestOfArm = 5;
/// A curve continues smoothly if it leaves less than this share of the step from shot to shot, and
/// no more than half of the residual of one missing shot.
constexpr double kSmooth = 0.25, kFarRougher = 2.0;
/// The next shot of a run lies within this share of a step of the curve's prediction.
constexpr double kNextShot = 0.4;
/// Packets are consecutive if their times are, to this share of a period.
constexpr double kNearPeriod = 0.02;

/// Powers 0 to `degree` of places along a run, one row each.
Eigen::MatrixXd powers_of(const std::vector<double>& places, Eigen::Index degree) {
  Eigen::MatrixXd powers(static_cast<Eigen::Index>(places.size()), degree + 1);
  for (Eigen::Index i = 0; i < powers.rows(); ++i) {
    double power = 1;
    for (Eigen::Index j = 0; j <= degree; ++j) {
      powers(i, j) = power;
      power *= places[static_cast<std::size_t>(i)];
    }
  }
  return powers;
}

/// Follows the runs of single shots through a recording.
class RunFinder {
 public:
  RunFinder(const PacketShots& shots, double shot_rate)
      : shots_(shots), period_ns_(1e9 * shots.places / shot_rate) {
    const AngleSeries& series = shots.series;
    direction_.resize(static_cast<Eigen::Index>(series.size()), 3);
    for (std::size_t i = 0; i < series.size(); ++i) {
      const auto v = direction_from_angles<double>({series.azimuth[i], series.zenith[i]});
      direction_.row(static_cast<Eigen::Index>(i)) << v.x, v.y, v.z;
    }
  }

  /// Assigns places to the shots of runs across borders.
  void find(std::vector<std::uint8_t>& place) const {
    const std::size_t count = shots_.series.size();
    for (std::size_t next = 1; next < count; ++next) {
      const std::size_t last = next - 1;
      if (shots_.packet[last] == shots_.packet[next] || !goes_on(last, next)) continue;
      const std::size_t begin = end_of_run(last, -1), end = end_of_run(next, 1);
      for (std::size_t i = begin; i <= end; ++i) {
        const int found =
            i <= last ? shots_.places - 1 - static_cast<int>(last - i) : static_cast<int>(i - next);
        place[i] = static_cast<std::uint8_t>(found);
      }
    }
  }

 private:
  /// Whether shot i and the one before it may be neighbours.
  bool in_file_order(std::size_t i) const {
    return i > 0 && shots_.packet[i] == shots_.packet[i - 1] &&
           shots_.precedent[i] == shots_.precedent[i - 1] + 1;
  }

  /// Consecutive shots in the file from a given one on, itself included, up to kArm.
  std::size_t arm(std::size_t shot, int direction) const {
    std::size_t size = 1;
    while (size < kArm) {
      const std::size_t inner = direction > 0 ? shot + size : shot - (size - 1);
      if (inner >= shots_.series.size() || !in_file_order(inner)) break;
      ++size;
    }
    return size;
  }

  double step(std::size_t shot, int direction, std::size_t arm) const {
    const auto at = static_cast<Eigen::Index>(shot);
    const auto far = at + direction * static_cast<Eigen::Index>(arm - 1);
    return (direction_.row(at) - direction_.row(far)).norm() / static_cast<double>(arm - 1);
  }

  /// Residual of a cubic through the shots about a border if some are missing there, rms per axis.
  double roughness(std::size_t last, std::size_t before, std::size_t after, int missing) const {
    std::vector<double> places;
    for (std::size_t i = 0; i < before + after; ++i) {
      const double place = static_cast<double>(i) - static_cast<double>(before);
      places.push_back((i < before ? place : place + missing) / static_cast<double>(kArm));
    }
    const Eigen::MatrixXd powers = powers_of(places, 3);
    const Eigen::MatrixXd shots = direction_.middleRows(
        static_cast<Eigen::Index>(last + 1 - before), static_cast<Eigen::Index>(before + after));
    const Eigen::MatrixXd curve = algebra::SymmetricSolver(powers.transpose() * powers)
                                      .solve_columns(powers.transpose() * shots);
    const double freedom = 2.0 * static_cast<double>(before + after - 4);
    return std::sqrt((shots - powers * curve).squaredNorm() / freedom);
  }

  /// Whether a shot that ends a packet is directly followed by the first of the next.
  bool goes_on(std::size_t last, std::size_t next) const {
    const PacketShots::OnePacket& one = shots_.packets[shots_.packet[last]];
    const PacketShots::OnePacket& other = shots_.packets[shots_.packet[next]];
    const auto apart = static_cast<double>(other.time_ns - one.time_ns);
    if (std::abs(apart / period_ns_ - 1.0) > kNearPeriod) return false;
    if (shots_.precedent[last] + 1 != one.shots || shots_.precedent[next] != 0) return false;
    const std::size_t before = arm(last, -1), after = arm(next, 1);
    if (before < kFewestOfArm || after < kFewestOfArm) return false;
    const double left = roughness(last, before, after, 0);
    const double usual = 0.5 * (step(last, -1, before) + step(next, 1, after));
    return left < kSmooth * usual && kFarRougher * left < roughness(last, before, after, 1);
  }

  /// The farthest shot on a curve without a gap, from one at a border inwards.
  std::size_t end_of_run(std::size_t shot, int direction) const {
    const std::size_t first = arm(shot, direction);
    std::size_t reached = shot + static_cast<std::size_t>(direction * static_cast<long>(first - 1));
    if (first < kArm) return reached;
    // The weights that predict the next value of a parabola from the last kArm.
    static const Eigen::RowVectorXd weights = [] {
      std::vector<double> places;
      for (std::size_t i = 0; i < kArm; ++i) places.push_back(static_cast<double>(i) / kArm);
      const Eigen::MatrixXd powers = powers_of(places, 2);
      return Eigen::RowVectorXd(
          powers_of({1.0}, 2) *
          algebra::SymmetricSolver(powers.transpose() * powers).solve_columns(powers.transpose()));
    }();
    const double usual = step(shot, direction, kArm);
    for (;;) {
      const std::size_t next = reached + static_cast<std::size_t>(direction);
      if (direction > 0 ? next >= shots_.series.size() || !in_file_order(next)
                        : !in_file_order(reached)) {
        return reached;
      }
      Eigen::RowVector3d expected = Eigen::RowVector3d::Zero();
      for (std::size_t i = 0; i < kArm; ++i) {
        const auto back = static_cast<Eigen::Index>(kArm - 1 - i);
        expected += weights[static_cast<Eigen::Index>(i)] *
                    direction_.row(static_cast<Eigen::Index>(reached) - direction * back);
      }
      const auto seen = direction_.row(static_cast<Eigen::Index>(next));
      if ((seen - expected).norm() > kNextShot * usual) return reached;
      reached = next;
    }
  }

  const PacketShots& shots_;
  double period_ns_;
  Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> direction_;  // of each shot
};

}  // namespace

std::vector<std::uint8_t> evident_places(const PacketShots& shots, double shot_rate, int emitters) {
  std::vector<std::uint8_t> place(shots.series.size(), kNoPlace);
  if (emitters == 1) RunFinder(shots, shot_rate).find(place);
  for (std::size_t i = 0; i < place.size(); ++i) {
    if (shots.is_whole(shots.packet[i])) place[i] = shots.precedent[i];
  }
  return place;
}

}  // namespace risley::estimation
