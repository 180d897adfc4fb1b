// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace risley {

/// Places in the flat parameter vector of a train of N prisms: air, incident beam, then six per
/// prism in beam order. The last prism's axis is the X axis of the sensor, so its two
/// bearing-tilt places exist only to keep the stride and always hold zero.
namespace place {
constexpr int refractive_index_air() { return 0; }
constexpr int incident_beam_horizontal() { return 1; }
constexpr int incident_beam_vertical() { return 2; }
constexpr int refractive_index(int prism) { return 3 + 6 * prism; }
constexpr int wedge_angle(int prism) { return 4 + 6 * prism; }
constexpr int prism_tilt_horizontal(int prism) { return 5 + 6 * prism; }
constexpr int prism_tilt_vertical(int prism) { return 6 + 6 * prism; }
constexpr int bearing_tilt_horizontal(int prism) { return 7 + 6 * prism; }
constexpr int bearing_tilt_vertical(int prism) { return 8 + 6 * prism; }
/// Derivatives keep in the last prism's two bearing places, which are no parameters, what a small
/// turn of the whole emergent beam about Z (yaw) and about Y (pitch) does: turn_derivatives().
constexpr int frame_yaw(int prisms) { return bearing_tilt_horizontal(prisms - 1); }
constexpr int frame_pitch(int prisms) { return bearing_tilt_vertical(prisms - 1); }
}  // namespace place

/// Length of the flat parameter vector.
constexpr int parameter_count(int prisms) { return 3 + 6 * prisms; }

/// What a named quantity describes.
enum class ParameterKind {
  train,             ///< one or several places of the flat parameter vector
  angular_velocity,  ///< speed of one rotor
  rotation_angle,    ///< angle of one rotor at the first used observation
};

/// One quantity a user can name, in files and on the command line.
struct ParameterInfo {
  std::string name;       ///< with its unit, e.g. "wedge_angle_a_deg"
  std::string long_name;  ///< in words
  std::string symbol;     ///< as in the paper
  std::string unit;       ///< of the value in files: "1", "deg" or "deg/s"
  ParameterKind kind = ParameterKind::train;
  double si_per_unit = 1.0;     ///< multiply a file's value by this
  double lower = 0, upper = 0;  ///< allowed range in SI units, both ends included
  std::vector<int> places;      ///< of the flat vector, or the rotor's number
};

/// THE list of parameters for a train of so many prisms: those shared by all prisms first
/// ("refractive_index"), then the prisms' own ("refractive_index_a"), then speeds and angles.
/// @param prisms  1 to kMaxPrisms
const std::vector<ParameterInfo>& parameter_list(int prisms);

/// The entry of that name. @throws InvalidArgument that lists the known names
const ParameterInfo& find_parameter(std::string_view name, int prisms);

/// @param value  SI units
/// @throws InvalidArgument naming the parameter, value, unit and range, also when it is not finite
void check_bounds(const ParameterInfo& parameter, double value);

/// The letter of a prism in names: 'a' for the first in beam order.
constexpr char prism_letter(int prism) { return static_cast<char>('a' + prism); }

}  // namespace risley
