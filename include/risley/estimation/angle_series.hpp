// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "risley/recordings/observations.hpp"

namespace risley::estimation {

/// The directions of single shots in time order: what an estimator sees of a recording.
struct AngleSeries {
  std::vector<std::int64_t> time_ns;    ///< as recorded, strictly increasing
  std::vector<double> azimuth, zenith;  ///< rad
  /// Variance of the format's rounding, (step^2) / 12, rad^2.
  std::vector<double> azimuth_rounding_variance, zenith_rounding_variance;

  std::size_t size() const { return time_ns.size(); }
  /// Time since the first shot, s.
  double time(std::size_t i) const { return 1e-9 * static_cast<double>(time_ns[i] - time_ns[0]); }
  double duration() const { return size() == 0 ? 0.0 : time(size() - 1); }
};

/// How shots are chosen.
struct SelectionOptions {
  /// Take at most so many shots per second, evenly spread; empty takes all.
  std::optional<double> rate;
};

/// What was seen while choosing.
struct SelectionCounts {
  std::uint64_t rows = 0;             ///< observations offered
  std::uint64_t invalid = 0;          ///< without a direction
  std::uint64_t further_returns = 0;  ///< second and later returns of a shot
  std::uint64_t out_of_order = 0;     ///< not later than the shot before
};

/// Chooses shots from a recording that comes in pieces. Only the first return of a shot counts
/// (all returns share its direction). A row whose time runs backwards is left out and counted;
/// so of a recording whose clock jumps back only what lies after the highest time so far is used.
class ShotSelector {
 public:
  explicit ShotSelector(const SelectionOptions& options);

  void add(const recordings::Observations& observations);

  /// The chosen shots.
  const AngleSeries& series() const { return series_; }
  /// All shots of the first second, not thinned: the start of an estimation wants every one.
  const AngleSeries& head() const { return head_; }
  const SelectionCounts& counts() const { return counts_; }

 private:
  SelectionOptions options_;
  AngleSeries series_, head_;
  SelectionCounts counts_;
  std::int64_t last_time_ns_ = 0;
  std::int64_t next_tick_ = 0;
};

}  // namespace risley::estimation
