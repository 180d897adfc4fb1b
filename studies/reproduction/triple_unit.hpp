// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>

namespace risley::reproduction {

/// One parameter of the simulated triple-prism unit, as printed.
struct TripleParameter {
  const char* name;   ///< as in parameter_list()
  const char* known;  ///< simulated known value
};

/// A Livox Horizon with errors of the size of the paper's Table 3: glass 3e-4 and emitters 0.1
/// degree off the type, prisms and bearings tilted by up to 0.4 degree.
inline constexpr std::array kTripleUnit{TripleParameter{"refractive_index_a", "1.6103"},
                                        TripleParameter{"refractive_index_b", "1.6109"},
                                        TripleParameter{"refractive_index_c", "1.5796"},
                                        TripleParameter{"incident_beam_1_horizontal_deg", "0.071"},
                                        TripleParameter{"incident_beam_1_vertical_deg", "-2.310"},
                                        TripleParameter{"incident_beam_2_horizontal_deg", "0.052"},
                                        TripleParameter{"incident_beam_2_vertical_deg", "-1.291"},
                                        TripleParameter{"incident_beam_3_horizontal_deg", "-0.024"},
                                        TripleParameter{"incident_beam_3_vertical_deg", "-0.502"},
                                        TripleParameter{"incident_beam_4_horizontal_deg", "0.093"},
                                        TripleParameter{"incident_beam_4_vertical_deg", "0.398"},
                                        TripleParameter{"incident_beam_5_horizontal_deg", "-0.067"},
                                        TripleParameter{"incident_beam_5_vertical_deg", "1.371"},
                                        TripleParameter{"incident_beam_6_horizontal_deg", "0.015"},
                                        TripleParameter{"incident_beam_6_vertical_deg", "2.190"},
                                        TripleParameter{"bearing_tilt_a_horizontal_deg", "0.110"},
                                        TripleParameter{"bearing_tilt_a_vertical_deg", "0.080"},
                                        TripleParameter{"bearing_tilt_b_horizontal_deg", "-0.150"},
                                        TripleParameter{"bearing_tilt_b_vertical_deg", "0.210"},
                                        TripleParameter{"prism_tilt_a_horizontal_deg", "0.200"},
                                        TripleParameter{"prism_tilt_a_vertical_deg", "0.090"},
                                        TripleParameter{"prism_tilt_b_horizontal_deg", "0.120"},
                                        TripleParameter{"prism_tilt_b_vertical_deg", "-0.383"},
                                        TripleParameter{"prism_tilt_c_horizontal_deg", "0.071"},
                                        TripleParameter{"prism_tilt_c_vertical_deg", "-0.250"}};

}  // namespace risley::reproduction
