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

/// Name and value pairs such as command, version, seed, input_sha256: how to make a result again.
using Provenance = std::vector<std::pair<std::string, std::string>>;

/// Names and SHA-256 of inputs. The hashes are found while their owner does something else: for a
/// recording they take a twentieth of the time of estimating from it.
class InputHashes {
 public:
  /// @param progress  its flag must outlive this; no progress is reported
  explicit InputHashes(const std::vector<recordings::Source>& inputs,
                       const Progress& progress = {});
  ~InputHashes();
  InputHashes(const InputHashes&) = delete;
  InputHashes& operator=(const InputHashes&) = delete;

  /// Appends those of every input: "input", "input_sha256", "input_2", ...; of a folder of ROS 2
  /// those of each of its files, of columns in memory, and of pipes, the name alone.
  /// @throws FileError, Cancelled
  Provenance with_inputs(Provenance provenance);
  /// The same of one alone, as the only input. @param input  its place, from 0
  Provenance with_input(Provenance provenance, std::size_t input);

 private:
  struct Input;
  std::vector<std::unique_ptr<Input>> inputs_;
};

/// As InputHashes::with_inputs(), at once.
Provenance with_inputs(Provenance provenance, const std::vector<recordings::Source>& inputs,
                       const Progress& progress = {});

}  // namespace risley::jobs
