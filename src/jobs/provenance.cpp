// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/provenance.hpp"

#include <fmt/format.h>

#include "risley/io/sha256.hpp"

namespace risley::jobs {

Provenance with_inputs(Provenance provenance, const std::vector<recordings::Source>& inputs,
                       const Progress& progress) {
  std::size_t count = 0;
  const auto add = [&](const std::string& input) {
    ++count;
    std::string name = count == 1 ? "input" : fmt::format("input_{}", count);
    provenance.emplace_back(name, input);
    return name;
  };
  for (const recordings::Source& input : inputs) {
    if (input.recording()) add(input.name());
    for (const std::string& file : recordings::recording_files(input)) {
      provenance.emplace_back(add(file) + "_sha256", io::sha256_of_file(file, progress));
    }
  }
  return provenance;
}

}  // namespace risley::jobs
