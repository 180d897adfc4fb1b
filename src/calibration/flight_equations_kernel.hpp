// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>

#include "risley/core/instruction_set.hpp"
#include "risley/optics/prism.hpp"

namespace risley::calibration {

struct ShotPose;

/// A piece of ground for the kernel, local frame.
struct FlightPlane {
  double normal[3], tangent[2][3], centre[3];
};

/// Shots of one plane: [begin, end) of FlightArguments::order.
struct FlightRun {
  std::size_t begin = 0, end = 0;
  const FlightPlane* plane = nullptr;
};

/// Columns other than the parameters of the train: boresight 3, lever arm 3, range offset, clock.
inline constexpr int kMountColumns = 8;
inline constexpr int kPlaneColumns = 3;

/// Plain arguments of one call, for shots between two knots. Columns are those of all shots.
struct FlightArguments {
  const double* parameters = nullptr;     ///< whole flat vector
  const FaceOrder* face_order = nullptr;  ///< [prisms]
  TrainLayout prisms;
  int emitters = 1;
  const double* face_position = nullptr;  ///< [2 prisms]
  /// Free parameter j is in places[place_begin[j]] ... places[place_begin[j + 1] - 1].
  const int* places = nullptr;
  const int* place_begin = nullptr;
  int free_count = 0;
  bool drift = false;               ///< one more column after those: the drift of the clock
  bool delay = false;               ///< and one after it: a delay of the attitudes
  double since = 0;                 ///< begin_ns after the time about which the clock drifts, s
  double body_from_sensor[9] = {};  ///< column by column
  double lever_arm[3] = {};
  double range_offset = 0;
  double clock_step = 0;               ///< from the poses' time to the shots', s
  double corrections[2][6] = {};       ///< at the previous and the next knot
  std::int64_t begin_ns = 0;           ///< of the knot before
  double per_ns = 0;                   ///< 1 / time between the knots
  double range_variance = 0;           ///< m^2
  double rotation_angle_variance = 0;  ///< of each, rad^2
  double white_variance[6] = {};  ///< of the pose, as if it were each shot's own, m^2 and rad^2
  double cauchy_scale = 0;        ///< m; 0: none
  double gate = 0;                ///< largest residual in its sigmas; 0: none

  const double* const* rotation_angle = nullptr;  ///< [prisms][shots]
  const double* range = nullptr;                  ///< [shots]
  const std::uint8_t* beam = nullptr;             ///< [shots] or nullptr
  const std::int64_t* time_ns = nullptr;          ///< [shots]
  const ShotPose* pose = nullptr;                 ///< [shots]
  const std::uint32_t* order = nullptr;           ///< rows of the shots, run by run
  const FlightRun* runs = nullptr;
  std::size_t run_count = 0;

  /// Columns of the unknowns common to the whole flight.
  int global_count() const {
    return kMountColumns + free_count + (drift ? 1 : 0) + (delay ? 1 : 0);
  }

  /// Products of the columns [mount, train, drift, delay, first knot 6, second knot 6, residual]:
  /// upper triangle.
  double* products = nullptr;
  /// [runs][3][columns of products + 3]: of the plane's columns with those and with its own.
  double* plane_products = nullptr;
  /// [shots of the runs][mount, train, drift, delay, knot 6, plane 3, residual, variance,
  /// weight], not weighted, or nullptr. The variance is the shot's own, without that of the
  /// attitude.
  double* rows = nullptr;
};

struct FlightCounts {
  std::size_t lost = 0;      ///< do not meet their plane
  std::size_t outliers = 0;  ///< beyond the gate
};

RISLEY_DECLARE_KERNEL(FlightCounts accumulate_flight(const FlightArguments& arguments))

}  // namespace risley::calibration
