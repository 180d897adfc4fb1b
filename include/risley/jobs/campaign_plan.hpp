// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "risley/jobs/calibrate_recordings.hpp"
#include "risley/jobs/estimate_recording.hpp"
#include "risley/simulation/scanner.hpp"

namespace risley::jobs {

/// Settings at one point of a campaign's grid, by name and as written there.
using GridPoint = std::vector<std::pair<std::string, std::string>>;

/// "simulate.noise_angle_deg 0.01, estimate.method ekf"; empty without a grid.
std::string grid_words(const GridPoint& grid);

/// One point of a campaign's grid: the simulation and its processing.
struct CampaignSetting {
  GridPoint grid;
  /// One per recording: one, or one at each station. The seed is a cell's.
  std::vector<simulation::SimulationSettings> simulations;
  std::string format;  ///< ending of the recordings, which determines their format
  /// Without recordings and truths, which are a cell's.
  std::variant<EstimateRecordingOptions, CalibrateRecordingsOptions> job;
};

/// A simulation and its processing, for one setting and one seed.
struct CampaignCell {
  std::uint64_t number = 0;  ///< from 0
  std::size_t setting = 0;   ///< place in CampaignPlan::settings
  std::uint64_t seed = 0;
};

/// A grid of settings times seeds.
struct CampaignPlan {
  std::string path;
  std::vector<std::string> files;         ///< that it names, each once
  std::vector<CampaignSetting> settings;  ///< the last name of the grid varies first
  std::uint64_t first_seed = 0, seeds = 0;
  /// SHA-256 of everything but the program that determines the cells' results: the contents of the
  /// plan, regardless of order and comments, and the bytes of the files that it names.
  std::string work;

  /// Number of all cells.
  std::uint64_t cells() const { return settings.size() * seeds; }
  /// A message with the plan and a setting before it.
  std::string about(const CampaignSetting& setting, const std::string& message) const;
  /// Cells run through all settings of one seed, then the next seed, so that every chunk covers
  /// every setting.
  CampaignCell cell(std::uint64_t number) const;
};

/// Reads a plan: the maps `simulate`, and `estimate` or `calibrate`, each with options under the
/// names of the command's verb (noise_angle_deg); `grid`, with a list of values for each name such
/// as simulate.noise_angle_deg; and `seeds`: {first, count}. See docs/files.md. Files that it names
/// are relative to it.
/// @throws FileError with the line for an invalid plan, and for files that it names;
/// InvalidArgument naming the setting for values that a simulation or an estimate rejects
/// @param path  for messages, and to find the files
/// @param seed  added to the seeds of the plan, for other draws; at most 2^62
CampaignPlan parse_campaign_plan(const std::string& text, const std::string& path,
                                 std::uint64_t seed = 0);

/// parse_campaign_plan() of a file. @throws FileError
CampaignPlan load_campaign_plan(const std::string& path, std::uint64_t seed = 0);

}  // namespace risley::jobs
