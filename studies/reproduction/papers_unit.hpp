// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>

namespace risley::reproduction {

/// One row of the paper's Table 3, as printed.
struct PapersParameter {
  const char* name;       ///< as in parameter_list()
  const char* known;      ///< simulated known value
  const char* estimated;  ///< by the paper's filter
  const char* sigma;      ///< its +-
};

/// Table 3's parameters of the prisms.
inline constexpr std::array kPapersUnit{
    PapersParameter{"refractive_index", "1.5090", "1.5090", "0.0001"},
    PapersParameter{"incident_beam_horizontal_deg", "0.071", "0.071", "0.002"},
    PapersParameter{"incident_beam_vertical_deg", "-0.385", "-0.385", "0.002"},
    PapersParameter{"bearing_tilt_a_horizontal_deg", "0.011", "0.013", "0.002"},
    PapersParameter{"bearing_tilt_a_vertical_deg", "0.008", "0.010", "0.002"},
    PapersParameter{"prism_tilt_a_vertical_deg", "0.090", "0.089", "0.002"},
    PapersParameter{"prism_tilt_b_horizontal_deg", "0.120", "0.117", "0.002"},
    PapersParameter{"prism_tilt_b_vertical_deg", "-0.383", "-0.384", "0.002"}};

/// Table 3's speeds; their +- is the swing of the speeds over 30 s.
inline constexpr std::array kPapersSpeeds{
    PapersParameter{"angular_velocity_a_deg_per_s", "-43,789.8", "-43,789.8", "2.2"},
    PapersParameter{"angular_velocity_b_deg_per_s", "27,997.8", "27,997.8", "2.2"}};

}  // namespace risley::reproduction
