// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "risley/core/angle.hpp"
#include "risley/core/progress.hpp"
#include "risley/estimation/angle_series.hpp"
#include "risley/sensors/sensor.hpp"

#include "reproduction/figure.hpp"
#include "reproduction/paper_table.hpp"

/// Brazeal, Wilkinson & Hochmair 2021 [B21] again: every table and figure that holds numbers, ours
/// beside the paper's. The one place outside the tests where simulation and estimation meet.
namespace risley::reproduction {

/// How many random draws.
struct Effort {
  std::size_t tilt_draws = 10;             ///< of section 2.3's filter, 30 s at 1 kHz
  std::size_t table3_seeds = 8;            ///< at 1 kHz
  std::size_t filter_seeds = 4;            ///< of the paper's filter
  std::size_t table3_full_rate_seeds = 0;  ///< at 100 kHz; 0 leaves the table out
  std::size_t wall_seeds = 80;             ///< of section 3.3, at 1 kHz
  std::size_t wall_full_rate_seeds = 4;    ///< of section 3.3, at 100 kHz
  std::size_t triple_seeds = 3;            ///< of the triple-prism sensor, at 240 kHz
};
inline constexpr Effort kFastEffort{};
inline constexpr Effort kFullEffort{40, 20, 20, 6, 200, 20, 12};

/// A recording of a real unit for section 3.1.
struct RealRecording {
  std::string name;                      ///< of the file
  sensors::Sensor sensor;                ///< the type to start from
  estimation::AngleSeries series, head;  ///< as estimate() takes them
};

struct ReproduceOptions {
  /// Nominal type and the unit of Table 3, as the presets have them.
  sensors::Sensor type, unit;
  /// The same of a sensor with three prisms and several emitters: the Horizon, kTripleUnit.
  sensors::Sensor triple_type, triple_unit;
  double angle_noise = radians_from_degrees(0.01);  ///< of simulated directions, 1 sigma, rad
  double range_noise = 0.02;                        ///< of simulated ranges, 1 sigma, m
  Effort effort = kFastEffort;
  std::uint64_t seed = 0;  ///< same seed, same numbers, whatever the number of threads
  std::optional<RealRecording> recording;

  ReproduceOptions();
};

struct Reproduction {
  std::vector<Table> tables;
  std::vector<Figure> figures;
};

std::size_t row_count(const Reproduction& reproduction);
std::size_t passed_count(const Reproduction& reproduction);

/// Everything, in the order of the paper, and the part of its future work that is done. @throws
/// EstimationError when an estimation cannot start
Reproduction reproduce(const ReproduceOptions& options, const Progress& progress = {});

// One piece each, as reproduce() calls them.
Reproduction specifications(const ReproduceOptions& options);      ///< Tables 1, 2
Reproduction scan_pattern(const ReproduceOptions& options);        ///< Fig. 2
Reproduction zero_position(const ReproduceOptions& options);       ///< section 2.4
Reproduction beam_origin_errors(const ReproduceOptions& options);  ///< App. A
/// Section 2.3.
Reproduction observability(const ReproduceOptions& options, const Progress& progress = {});
/// Section 3.1 of a simulated unit, and of the recording where there is one.
Reproduction stationary_unit(const ReproduceOptions& options, const Progress& progress = {});
/// Section 3.2.
Reproduction simulated_unit(const ReproduceOptions& options, const Progress& progress = {});
/// Section 3.3.
Reproduction incorrect_calibration(const ReproduceOptions& options, const Progress& progress = {});
/// Future work (2): a sensor with three prisms.
Reproduction triple_prism(const ReproduceOptions& options, const Progress& progress = {});

}  // namespace risley::reproduction
