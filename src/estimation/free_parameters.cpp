// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/free_parameters.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"

namespace risley::estimation {

std::vector<std::string> default_free_names(int prisms) {
  require_between("number of prisms", prisms, 1, kMaxPrisms);
  std::vector<std::string> names{"refractive_index", "incident_beam_horizontal_deg",
                                 "incident_beam_vertical_deg"};
  for (int i = 0; i + 1 < prisms; ++i) {
    names.push_back(fmt::format("bearing_tilt_{}_horizontal_deg", prism_letter(i)));
    names.push_back(fmt::format("bearing_tilt_{}_vertical_deg", prism_letter(i)));
  }
  for (int i = 0; i + 1 < prisms; ++i) {
    names.push_back(fmt::format("prism_tilt_{}_vertical_deg", prism_letter(i)));
  }
  names.push_back(fmt::format("prism_tilt_{}_horizontal_deg", prism_letter(prisms - 1)));
  names.push_back(fmt::format("prism_tilt_{}_vertical_deg", prism_letter(prisms - 1)));
  return names;
}

std::vector<FreeParameter> free_parameters(const std::vector<std::string>& names, int prisms) {
  constexpr double kIndexSigma = 0.01;
  constexpr double kAngleSigma = radians_from_degrees(1.0);
  std::vector<FreeParameter> free;
  std::vector<int> taken;
  for (const std::string& name : names) {
    const ParameterInfo& info = find_parameter(name, prisms);
    if (info.kind != ParameterKind::train) {
      throw InvalidArgument(fmt::format(
          "{} is always estimated and cannot be chosen, choose among the prisms' parameters",
          name));
    }
    for (const int at : info.places) {
      if (std::find(taken.begin(), taken.end(), at) != taken.end()) {
        throw InvalidArgument(fmt::format("{} is already free under another name", name));
      }
      taken.push_back(at);
    }
    free.push_back({name, info.places, info.unit == "1" ? kIndexSigma : kAngleSigma});
  }
  return free;
}

}  // namespace risley::estimation
