// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <bitset>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "risley/recordings/observations.hpp"

namespace risley::estimation {

/// The directions of single shots in the order of the recording: the input of an estimator.
struct AngleSeries {
  /// As recorded, increasing; a step back means that the sensor's clock was reset.
  std::vector<std::int64_t> time_ns;
  std::vector<double> azimuth, zenith;  ///< rad
  std::vector<std::uint8_t> beam;       ///< emitter that fired, from 0
  /// Variance of the format's rounding, (step^2) / 12, rad^2.
  std::vector<float> azimuth_rounding_variance, zenith_rounding_variance;
  /// Ranges of the shots, m, NaN without a return; empty unless requested. Estimators ignore them:
  /// later steps need them.
  std::vector<double> range;
  /// Intensities as reported, which travel along with the ranges; 0 where they are not known, empty
  /// where none is.
  std::vector<std::uint8_t> intensity;

  std::size_t size() const { return time_ns.size(); }
  /// Time since the first shot, s.
  double time(std::size_t i) const { return 1e-9 * static_cast<double>(time_ns[i] - time_ns[0]); }
  /// Of a series without resets, s.
  double duration() const { return size() == 0 ? 0.0 : time(size() - 1); }
  /// Appends a shot without a range.
  void append(std::int64_t time_ns, double azimuth, double zenith, std::uint8_t beam = 0,
              float azimuth_rounding_variance = 0, float zenith_rounding_variance = 0);
  /// Leaves no shot.
  void clear();
  /// Appends one row of another series.
  void append(const AngleSeries& other, std::size_t row);
};

/// A column of an AngleSeries.
struct SeriesColumn {
  ColumnPlace<AngleSeries, std::vector<std::int64_t>, std::vector<double>,
              std::vector<std::uint8_t>, std::vector<float>>
      place;
  const char* name;
  bool optional = false;  ///< may be empty
};
/// All of them.
inline constexpr SeriesColumn kSeriesColumns[] = {
    {&AngleSeries::time_ns, "time_ns"},
    {&AngleSeries::azimuth, "azimuth"},
    {&AngleSeries::zenith, "zenith"},
    {&AngleSeries::beam, "beam", true},
    {&AngleSeries::azimuth_rounding_variance, "azimuth_rounding_variance"},
    {&AngleSeries::zenith_rounding_variance, "zenith_rounding_variance"},
    {&AngleSeries::range, "range", true},
    {&AngleSeries::intensity, "intensity", true}};

/// Rows [begin, end) of a series.
AngleSeries rows_of(const AngleSeries& series, std::size_t begin, std::size_t end);

/// Time spans up to this fit into 64 bits of nanoseconds, s.
inline constexpr double kMostSeconds = 9.2e9;

/// Rows [begin, end) of a series.
struct ShotRange {
  std::size_t begin = 0, end = 0;
  std::size_t size() const { return end - begin; }
};

/// Step through rows that leaves about this many of them and meets every beam in turn, if shot i is
/// of beam i mod beams.
std::size_t thinning_stride(const AngleSeries& series, ShotRange rows, std::size_t most);

/// Number of times used to find the typical one between shots.
inline constexpr std::size_t kMedianSteps = 20000;

/// Typical time between shots, ns: the median of the first ones, which is robust against gaps.
/// @param time_ns  of at least two shots
std::int64_t median_step_ns(std::span<const std::int64_t> time_ns);

/// The mirror image of the shots: elevations change their sign, or azimuths if the axis of rotation
/// is the sensor's Z.
void mirror(AngleSeries& series, bool axis_up);
/// As above. @param azimuth,zenith  rad
void mirror(std::span<double> azimuth, std::span<double> zenith, bool axis_up);

/// Picks shots on a fixed grid of ticks, so that gaps and jitter do not move them: at each tick the
/// next shot of a beam that has not been picked in this round, so that rates and the order of the
/// beams never fall into step.
class TickSampler {
 public:
  /// @param rate  Hz, > 0
  explicit TickSampler(double rate);

  /// Begins a new grid of ticks at a time, and a new round.
  void restart(std::int64_t time_ns) {
    origin_ns_ = next_ns_ = time_ns;
    had_turn_.reset();
    waited_ = 0;
  }
  /// Announces a beam, so that it is picked in its turn. Other beams are known after their first
  /// shot.
  void expect(std::uint8_t beam) { seen_[beam] = true; }
  /// No earlier shot is taken, ns.
  std::int64_t next_ns() const { return next_ns_; }
  /// Whether to take the next shot. @param beam  that fired it
  bool take(std::int64_t time_ns, std::uint8_t beam) {
    seen_[beam] = true;
    return time_ns >= next_ns_ && take_at_tick(time_ns, beam);
  }

 private:
  bool take_at_tick(std::int64_t time_ns, std::uint8_t beam);

  double rate_;  // Hz
  std::int64_t origin_ns_ = 0, next_ns_ = 0;
  std::bitset<256> seen_, had_turn_;  // beams, ever and in this round
  std::size_t waited_ = 0;            // shots since the tick of beams already picked
};

/// How shots are chosen.
struct SelectionOptions {
  /// Take at most this many shots per second, evenly spread; empty takes all.
  std::optional<double> rate;
  bool ranges = false;  ///< keep the ranges too
  bool rows = false;    ///< keep each shot's observation number
};

/// What was seen while choosing.
struct SelectionCounts {
  std::uint64_t rows = 0;             ///< observations offered
  std::uint64_t invalid = 0;          ///< without a direction
  std::uint64_t further_returns = 0;  ///< second and later returns of a shot
  std::uint64_t equal_times = 0;      ///< other shots with the time of the one before
  std::uint64_t out_of_order = 0;     ///< a little earlier than the shot before
  std::uint64_t clock_resets = 0;     ///< steps back by more than kClockReset
};

/// Steps back in time up to this are shots out of order, longer ones a clock that was reset, s.
inline constexpr double kClockReset = 0.01;

/// Chooses shots from a recording that comes in pieces. Only the first return of a shot is used
/// (all returns share its direction). Another shot with the same time is skipped and counted. A row
/// slightly earlier than the one before is skipped and counted; after a reset of the clock the
/// series continues with the new times.
class ShotSelector {
 public:
  explicit ShotSelector(const SelectionOptions& options);

  /// Takes the next rows of the recording. Those with an invalid direction are only counted.
  void add(const recordings::Observations& observations);

  /// The chosen shots.
  const AngleSeries& series() const { return series_; }
  /// The same by move: a long recording is not kept twice.
  AngleSeries take_series() { return std::move(series_); }
  /// All shots of the first second, not thinned, as the start of an estimation needs them.
  const AngleSeries& head() const { return head_; }
  /// Number of rows so far, and of those skipped by reason.
  const SelectionCounts& counts() const { return counts_; }
  /// Number of each chosen shot's observation, counted over all rows offered; empty unless
  /// requested.
  const std::vector<std::size_t>& rows() const { return rows_; }

 private:
  SelectionOptions options_;
  AngleSeries series_, head_;
  SelectionCounts counts_;
  std::vector<std::size_t> rows_;
  std::int64_t last_time_ns_ = 0;
  TickSampler ticks_;
};

}  // namespace risley::estimation
