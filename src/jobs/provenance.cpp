// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/provenance.hpp"

#include <fmt/format.h>

#include "risley/io/sha256.hpp"

namespace risley::jobs {

Provenance with_inputs(Provenance provenance, const std::vector<std::string>& inputs,
                       const Progress& progress) {
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    const std::string name = i == 0 ? "input" : fmt::format("input_{}", i + 1);
    provenance.emplace_back(name, inputs[i]);
    provenance.emplace_back(name + "_sha256", io::sha256_of_file(inputs[i], progress));
  }
  return provenance;
}

}  // namespace risley::jobs
