// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/recordings/source.hpp"

namespace risley::jobs {

/// Name and value pairs such as command, version, seed, input_sha256, for reproducing a result.
using Provenance = std::vector<std::pair<std::string, std::string>>;

/// Names and SHA-256 of inputs. The hashes are computed in the background: for a recording they
/// take a twentieth of the time of estimating from it.
class InputHashes {
 public:
  /// @param progress  its flag must outlive this; no progress is reported
  explicit InputHashes(const std::vector<recordings::Source>& inputs,
                       const Progress& progress = {});
  ~InputHashes();
  InputHashes(const InputHashes&) = delete;
  InputHashes& operator=(const InputHashes&) = delete;

  /// Appends those of every input: "input", "input_sha256", "input_2", ...; for a folder of ROS 2
  /// those of each of its files, for columns in memory, and for pipes, only the name.
  /// @throws FileError, Cancelled
  Provenance with_inputs(Provenance provenance);
  /// The same for a single one, as the only input. @param input  its place, from 0
  Provenance with_input(Provenance provenance, std::size_t input);

 private:
  struct Input;
  std::vector<std::unique_ptr<Input>> inputs_;
};

/// As InputHashes::with_inputs(), at once.
Provenance with_inputs(Provenance provenance, const std::vector<recordings::Source>& inputs,
                       const Progress& progress = {});

}  // namespace risley::jobs
