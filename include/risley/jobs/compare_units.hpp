// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/jobs/compare_results.hpp"
#include "risley/jobs/fleet.hpp"

namespace risley::jobs {

/// The results to compare, and the false-alarm probability.
struct CompareUnitsOptions {
  /// As load_result(), in order of time; also tables of results (tables::is_table()), in which each
  /// row without a failure represents the result in its `output`.
  std::vector<GivenSensor> results;
  /// Probability that at least one pair of unchanged results is called changed, and that at least
  /// one unit is called an outlier if there is none, each.
  double false_alarm = 0.01;
  /// Whether results listed in a table are opened anywhere, or only in its own folder and below.
  bool anywhere = false;
  /// Whether a calibration, which holds true beam directions, is compared with an estimate of the
  /// sensor's own parameters: they differ even in a unit that never changed.
  bool unlike = false;
};

/// Two results, of one unit or of two units of a kind.
struct ComparedPair {
  std::size_t a = 0, b = 0;  ///< places in ComparedUnits::results
  ResultComparison comparison;
  bool changed = false;
};

/// "changed", "no change seen", or "no sigmas to test with".
std::string answer_words(const ComparedPair& pair);

/// A unit with its results.
struct ComparedUnit {
  std::string serial;                ///< empty if it is not known
  std::string sensor;                ///< name of the preset
  std::vector<std::size_t> results;  ///< places in ComparedUnits::results, in order of time
  bool changed = false;              ///< any of its pairs did
};

/// Units of one kind against each other, each by its latest result.
struct ComparedFleet {
  std::vector<std::size_t> units;  ///< places in ComparedUnits::units, as in fleet.units
  Fleet fleet;
};

/// A row of a table, or a result that could be of any unit, without a result of the comparison.
struct LeftOut {
  std::string name;     ///< its input, or its path
  std::string reason;   ///< to follow the name
  bool failed = false;  ///< it should have been a result
};

/// Units over time, and units against each other.
struct ComparedUnits {
  std::vector<std::string> results;  ///< their paths
  /// When their files were written, UTC since 1970, ms; empty unless that is known for all.
  std::vector<std::int64_t> written_ms;
  std::vector<ComparedUnit> units;  ///< in order of appearance
  std::vector<ComparedPair> pairs;
  bool is_one_series = false;  ///< the pairs are of all results in their order
  std::vector<ComparedFleet> fleets;
  std::vector<LeftOut> left_out;
  double false_alarm = 0;
  double least_p_value = 0;  ///< false_alarm over the number of pairs: pairs below it are changed
};

/// Named results form one series, whatever their serial numbers are: each is compared with the one
/// before it and, from the third on, with the first. With a table, serial numbers distinguish
/// units, each of which is a separate series, and up to four units of a kind are compared in pairs,
/// each by its last result; results without a serial number belong to the only unit, and are
/// skipped if several are known. From kFewestUnitsOfFleet on, units of a kind are compared as a
/// fleet.
/// @throws InvalidArgument for fewer than two results, a false alarm outside of 0 to 1, and as
/// compare_results(); FileError for named files that are not results, and for a table without any;
/// Cancelled
ComparedUnits compare_units(const CompareUnitsOptions& options, const Progress& progress = {});

}  // namespace risley::jobs
