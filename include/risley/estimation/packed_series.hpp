// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "risley/estimation/angle_series.hpp"

namespace risley::estimation {

/// An AngleSeries in less memory and without any loss, for whole recordings: four bytes a shot
/// where angles are multiples of a step such as 0.01 degree and the time from shot to shot is
/// constant, some thirty for directions from coordinates. Rows are packed in blocks of kBlockRows,
/// each separately; those after the last complete block are kept unpacked.
class PackedSeries {
 public:
  static constexpr std::size_t kBlockRows = 4096;  ///< rows of a block

  PackedSeries() = default;
  /// @throws InvalidArgument if columns have other lengths
  PackedSeries(const AngleSeries& series) { append(series); }  // NOLINT(*-explicit-*)

  std::size_t size() const { return blocks_.size() * kBlockRows + tail_.size(); }
  bool has_ranges() const { return has_ranges_; }  ///< as AngleSeries::range
  /// Largest number of an emitter that fired.
  std::uint8_t largest_beam() const { return largest_beam_; }
  /// Time of a row, as recorded.
  std::int64_t time_ns(std::size_t row) const {
    const std::size_t block = row / kBlockRows, place = row % kBlockRows;
    return block < blocks_.size() ? blocks_[block].time.at(place) : tail_.time_ns[place];
  }
  /// Emitter of a row.
  std::uint8_t beam(std::size_t row) const {
    const std::size_t block = row / kBlockRows, place = row % kBlockRows;
    return block < blocks_.size() ? blocks_[block].beam.at(place) : tail_.beam[place];
  }
  /// Azimuth and zenith of a row, rad.
  std::pair<double, double> angles(std::size_t row) const;
  /// Time since the first shot, s.
  double time(std::size_t row) const {
    return 1e-9 * static_cast<double>(time_ns(row) - time_ns(0));
  }
  /// Of a series without resets, s.
  double duration() const { return size() == 0 ? 0.0 : time(size() - 1); }

  /// First row at or after a time in a range whose times ascend; the range's end if there is none.
  /// Rows near the beginning are found faster.
  std::size_t first_at(ShotRange range, std::int64_t time_ns) const;
  /// Number of shots of each emitter, [largest_beam() + 1].
  std::vector<std::size_t> shots_of_beams() const;

  /// Rows [begin, end).
  AngleSeries rows(ShotRange range) const;
  /// The same into a series whose memory is reused.
  void rows(ShotRange range, AngleSeries& out) const;
  /// All rows.
  AngleSeries rows() const { return rows({0, size()}); }
  /// Times of rows, as recorded, into reused memory.
  void times(ShotRange range, std::vector<std::int64_t>& out) const;

  /// Appends all rows of a series. @throws InvalidArgument if columns have other lengths
  void append(const AngleSeries& series);
  /// Appends some rows of another series.
  void append(const PackedSeries& other, std::span<const std::size_t> rows);
  /// Changes all rows, some at a time.
  void change(const std::function<void(AngleSeries& rows)>& change_rows);

 private:
  /// Times as steps of one length since the first.
  struct Times {
    std::int64_t base = 0, step = 0;
    std::vector<std::uint16_t> few_steps;  ///< this and the next empty: as many steps as rows
    std::vector<std::uint32_t> many_steps;
    std::vector<std::int64_t> time_ns;  ///< if there are no such steps

    Times() = default;
    /// @param all  two or more
    explicit Times(const std::vector<std::int64_t>& all);
    std::int64_t at(std::size_t i) const {
      if (!time_ns.empty()) return time_ns[i];
      return base + step * (!few_steps.empty()    ? std::int64_t{few_steps[i]}
                            : !many_steps.empty() ? std::int64_t{many_steps[i]}
                                                  : static_cast<std::int64_t>(i));
    }
    void put(std::size_t first, std::size_t rows, std::int64_t* to) const;
  };
  /// One value, or one per row.
  template <class T>
  struct Mostly {
    T all{};
    std::vector<T> each;

    T at(std::size_t i) const { return each.empty() ? all : each[i]; }
    void put(std::size_t first, std::size_t rows, T* to) const;
  };
  /// Meaning of the numbers of angles that are multiples of a step.
  struct Grid {
    float variance = 0;         ///< of rounding, which gives the step; 0: none occurred
    std::vector<double> value;  ///< [65536] by number; NaN if none occurred
  };
  /// Numbers of a grid, or the angles themselves.
  struct Angles {
    std::vector<std::uint16_t> number;
    std::vector<double> value;

    Angles() = default;
    Angles(const std::vector<double>& all, const Mostly<float>& variance, Grid& grid);
    double at(std::size_t i, const Grid& grid) const {
      return number.empty() ? value[i] : grid.value[number[i]];
    }
    void put(std::size_t first, std::size_t rows, const Grid& grid, double* to) const;
  };
  struct Block {
    Times time;
    Angles azimuth, zenith;
    Mostly<std::uint8_t> beam;
    Mostly<float> azimuth_variance, zenith_variance;
    std::vector<double> range;
    Mostly<std::uint8_t> intensity;  ///< only with ranges
  };

  void pack_tail();
  /// Calls see(block or null for the tail, its first row, rows, rows of the range before them).
  template <class See>
  void visit(ShotRange range, const See& see) const;
  /// A column of a range. @param put  (block, first row, rows, to), or a column that copies itself
  template <class T, class Put>
  void put_column(ShotRange range, const std::vector<T>& tail, const Put& put,
                  std::vector<T>& out) const;
  template <class T, class Column>
  void put_column(ShotRange range, const std::vector<T>& tail, Column Block::*column,
                  std::vector<T>& out) const;

  std::vector<Block> blocks_;
  Grid azimuth_grid_, zenith_grid_;
  AngleSeries tail_;
  bool has_ranges_ = false;
  std::uint8_t largest_beam_ = 0;
};

/// The stretches of a series: it is cut at clock resets and at gaps too long to count the turns of
/// a rotor (longer than longest_gap, s).
std::vector<ShotRange> stretches(const PackedSeries& series, double longest_gap = 5.0);

/// At most this many shots per second, evenly spread over time and beams, of every given stretch.
/// @param[in,out] ranges  rows of the series, on return those of the result
PackedSeries thinned(const PackedSeries& series, double rate, std::vector<ShotRange>& ranges);

}  // namespace risley::estimation
