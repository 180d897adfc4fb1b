// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/jobs/campaign.hpp"

namespace risley::jobs {

/// Head of a file of cells.
struct ChunkHead {
  std::string work;     ///< CampaignPlan::work
  std::string program;  ///< CampaignOptions::program
  std::uint64_t first = 0, cells = 0;

  bool operator==(const ChunkHead&) const = default;
};

/// Where the chunks of a campaign are kept: FOLDER/chunks.
std::string chunk_folder(const std::string& folder);

/// Writes cells, in order, as lines of JSON: the head, one line per cell, and at the end the
/// SHA-256 of all lines before. @throws FileError
void save_chunk(const std::string& path, const ChunkHead& head,
                const std::vector<CellOutcome>& outcomes);

/// Reads such a file to its end and calls with every cell, once the head is known and before the
/// end is checked.
/// @throws FileError with the line for damage or another kind of file; Cancelled
ChunkHead read_chunk(const std::string& path, const Progress& progress,
                     const std::function<void(const ChunkHead&, CellOutcome&&)>& call = {});

}  // namespace risley::jobs
