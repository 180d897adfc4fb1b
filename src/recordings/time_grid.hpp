// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "risley/core/warning.hpp"
#include "risley/recordings/observations.hpp"

// Reconstructs a sensor's even firing grid from rounded times: a rounding in step with the shots is
// not noise, and moves parameters by many of their sigmas.
namespace risley::recordings {

/// Rounding of the times of one device's shots, and their evidence on its clock.
class TimeGrid {
 public:
  /// @param of_device  rows of one device in the order of firing
  TimeGrid(const Observations& rows, std::span<const std::size_t> of_device);

  /// Whether there are times to correct.
  bool is_needed() const { return kind_ != Kind::none; }

  /// Gives rows, in firing order, the times of the grid if they agree with it.
  /// @return shots that do not, whose times stay unchanged
  std::size_t apply(Observations& rows, std::span<const std::size_t> of_device) const;

  /// The defect of the times, and its correction; nothing if there is none.
  std::optional<Warning> warning() const;

 private:
  enum class Kind : std::uint8_t {
    none,     ///< exact, or nothing can be done
    finer,    ///< the rounding is finer than the step of shots
    counted,  ///< coarser, and no shot is missing
    emitters  ///< coarser, and the emitters give the place of each shot
  };
  /// Shots of a device: their first rows, times and emitters.
  struct Shots {
    std::vector<std::size_t> begin;  ///< places in of_device, and the end
    std::vector<std::int64_t> time_ns;
    std::vector<std::uint8_t> beam;
    std::size_t size() const { return time_ns.size(); }
  };
  /// A line through times by the numbers of shots.
  struct Fit {
    std::int64_t origin_ns = 0;
    double offset_ns = 0, step_ns = 0;   ///< of shot 0 after the origin, and between shots
    double largest_ns = 0;               ///< by which a time is off
    std::vector<std::int64_t> number{};  ///< of each shot
    bool ascending = true;               ///< numbers
  };

  Shots shots_of(const Observations& rows, std::span<const std::size_t> of_device) const;
  Fit fit(const Shots& shots, std::size_t begin, std::size_t end, Kind kind, double step_ns) const;
  /// @param start  offset and step to begin with
  Fit line(const Shots& shots, std::size_t begin, std::size_t end, Kind kind, Fit start) const;
  void number_shots(const Shots& shots, std::size_t begin, std::size_t end, Kind kind,
                    Fit& fit) const;
  bool agrees(const Fit& fit) const;
  void learn_emitters(const Shots& shots);
  void try_kinds(const Shots& shots);
  std::size_t snap(Observations& rows, std::span<const std::size_t> of_device, const Shots& shots,
                   std::size_t begin, std::size_t end) const;

  Kind kind_ = Kind::none;
  double rounding_ns_ = 0, step_ns_ = 0;
  bool equal_times_are_returns_ = false;
  std::size_t shots_ = 0, equal_times_ = 0;
  bool unexplained_ = false;
  std::array<std::uint8_t, 256> place_of_beam_{};
  int emitters_ = 1;
};

}  // namespace risley::recordings
