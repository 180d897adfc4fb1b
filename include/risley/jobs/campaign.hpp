// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/core/warning.hpp"
#include "risley/jobs/campaign_plan.hpp"
#include "risley/optics/parameters.hpp"

namespace risley::jobs {

/// A parameter in one cell. SI units.
struct CellParameter {
  std::string name;
  double truth = 0;
  double error = 0;             ///< found minus true
  double sigma = 0;             ///< what was held included
  double sigma_given_held = 0;  ///< if that were exact
};

/// Errors of one kind over all shots of a cell. SI units.
struct CellErrors {
  std::string name;  ///< "rotation_angle_a", "angular_velocity_a", "directions", "shape", ...
  double rms = 0;    ///< root mean square
  double sigma = 0;  ///< what was stated of it
};

/// Name of errors of a kind with the unit in which they are given: "rotation_angle_a_deg", degrees
/// in place of radians.
std::string name_with_unit(const std::string& errors);

/// What came of one cell.
struct CellOutcome {
  CampaignCell cell;
  bool answered = false;  ///< the estimate or the calibration converged
  std::string verdict;    ///< its code; empty without one
  std::string message;    ///< why there is no answer
  std::vector<CellParameter> parameters;
  /// Squared errors of the prisms' parameters together, weighted by their covariance given the held
  /// values, per degree of freedom; NaN without a result.
  double nees = 0;
  std::size_t degrees_of_freedom = 0;
  double nees_rotation_angles = 0;  ///< mean over the shots of an estimate; NaN otherwise
  std::vector<CellErrors> errors;
};

/// Simulates a cell, then estimates or calibrates from the simulated recordings. Cells are
/// independent of each other: the outcome depends only on plan, number and program. A failure is an
/// outcome, too.
/// @throws FileError, InvalidArgument, Cancelled
CellOutcome run_cell(const CampaignPlan& plan, std::uint64_t number, const Progress& progress = {});

/// Folder for results of a campaign, and the processes that compute them.
struct CampaignOptions {
  std::string folder;   ///< chunks go to chunks/ in it
  std::string program;  ///< name and version of the program, part of the identity of results
};

/// Chunk `number` of `count`, from 1. It has the cells from floor((number - 1) cells / count) on.
struct ChunkNumber {
  std::uint64_t number = 1, count = 1;
};

/// A chunk that is done.
struct CampaignChunk {
  std::string file;
  std::uint64_t first = 0, cells = 0;
  bool made_before = false;
};

/// Runs the cells of a chunk, several at a time, and writes the results to one file
/// (chunk-I-of-N.jsonl), which appears when it is complete. If it exists already, complete and made
/// from the same plan by the same program, nothing is done. The bytes do not depend on threads or
/// on when and where the chunk ran.
/// @throws InvalidArgument for a chunk that does not exist; FileError, Cancelled
CampaignChunk run_chunk(const CampaignPlan& plan, const ChunkNumber& which,
                        const CampaignOptions& options, const Progress& progress = {});

/// A figure over the cells of a setting, and the range for 95 of 100 campaigns if covariances are
/// correct.
struct BandedFigure {
  double value = 0, low = 0, high = 0;

  /// Whether the value lies in the band.
  bool inside() const { return low <= value && value <= high; }
};

/// A parameter over the cells of a setting. SI units.
struct ParameterSummary {
  std::string name;
  bool of_prisms = false;  ///< a parameter of the train; otherwise of the rotors
  std::uint64_t cells = 0;
  double bias = 0;   ///< mean error
  double rmse = 0;   ///< root mean square error
  double bound = 0;  ///< root mean square of the sigmas given the held values
  double sigma = 0;  ///< the same of the sigmas that include their errors
  BandedFigure error_over_bound;
  /// Share of the errors below two sigmas given the held values: 0.9545 if the sigmas are correct.
  BandedFigure within_two_sigma;
};

/// Errors of one kind over the cells of a setting.
struct ErrorSummary {
  std::string name;
  std::uint64_t cells = 0;
  double rms = 0, sigma = 0;  ///< root mean squares over the cells
};

/// All cells of a setting together.
struct SettingSummary {
  GridPoint grid;
  TrainShape shape;  ///< of the sensor
  std::uint64_t cells = 0, answered = 0;
  std::vector<ParameterSummary> parameters;
  double error_over_bound = 0;  ///< root mean square over the parameters of the prisms
  BandedFigure nees;            ///< mean over the cells
  double nees_rotation_angles = 0;
  std::vector<ErrorSummary> errors;
};

/// A campaign, as far as it has been computed.
struct CampaignResult {
  std::string table;                     ///< that was written
  std::uint64_t cells = 0, done = 0;     ///< of the plan; of them those with a result
  std::vector<SettingSummary> settings;  ///< in the order of the plan
  /// Cells without a result, as ranges, the last included; the first ones if they are many.
  std::vector<std::pair<std::uint64_t, std::uint64_t>> missing;
  std::vector<Warning> warnings;  ///< about ignored files
};

/// Reads the finished chunks, for any division of the campaign, and writes one table with a row for
/// each cell, each once and in order. A file that is damaged or was made from another plan or by
/// another program is ignored, with a warning. Memory does not grow with the number of cells.
/// @param table  its ending chooses the format, see tables::TableFile
/// @throws InvalidArgument for another ending; FileError, also if there is no chunk; Cancelled
CampaignResult merge_chunks(const CampaignPlan& plan, const std::string& table,
                            const CampaignOptions& options, const Progress& progress = {});

/// A whole campaign on one machine: chunk after chunk, about 100 cells each, then all of them
/// merged. When it is stopped, complete chunks stay, and the next run continues after them.
/// @throws as run_chunk(), merge_chunks()
CampaignResult run_campaign(const CampaignPlan& plan, const std::string& table,
                            const CampaignOptions& options, const Progress& progress = {});

}  // namespace risley::jobs
