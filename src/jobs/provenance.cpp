// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/provenance.hpp"

#include <fmt/format.h>

#include "risley/io/sha256.hpp"
#include "risley/recordings/reader.hpp"

namespace risley::jobs {

Provenance with_inputs(Provenance provenance, const std::vector<std::string>& inputs,
                       const Progress& progress) {
  std::size_t count = 0;
  for (const std::string& input : inputs) {
    for (const std::string& file : recordings::recording_files(input)) {
      const std::string name = count == 0 ? "input" : fmt::format("input_{}", count + 1);
      provenance.emplace_back(name, file);
      provenance.emplace_back(name + "_sha256", io::sha256_of_file(file, progress));
      ++count;
    }
  }
  return provenance;
}

}  // namespace risley::jobs
