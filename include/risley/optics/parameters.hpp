// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "risley/optics/prism.hpp"

namespace risley {

/// Largest number of emitters behind one train (Livox builds one and six).
inline constexpr int kMaxEmitters = 8;

/// Which elements and how many emitters a train has: they determine its parameters.
struct TrainShape {
  TrainLayout prisms;
  int emitters = 1;

  friend bool operator==(const TrainShape& a, const TrainShape& b) {
    return same_layout(a.prisms, b.prisms) && a.emitters == b.emitters;
  }
};

/// @throws InvalidArgument unless there are 1 to kMaxPrisms elements and 1 to kMaxEmitters emitters
void check_shape(TrainShape shape);

/// Places in the flat parameter vector of a train: air, incident beam of the first emitter, then
/// six per prism in beam order, then two per further emitter. A shot depends on the part for a
/// train with one emitter, with its own emitter's beam. If the last prism's axis is the X axis of
/// the sensor, its two bearing-tilt places exist only to keep the stride and always hold zero.
namespace place {
constexpr int refractive_index_air() { return 0; }      ///< of the medium around the prisms
constexpr int incident_beam_horizontal() { return 1; }  ///< of the first emitter
constexpr int incident_beam_vertical() { return 2; }    ///< of the first emitter
/// Of an emitter, counted from 0.
constexpr int incident_beam_horizontal(int emitter, int prisms) {
  return emitter == 0 ? 1 : 1 + 6 * prisms + 2 * emitter;
}
/// Of an emitter, counted from 0.
constexpr int incident_beam_vertical(int emitter, int prisms) {
  return incident_beam_horizontal(emitter, prisms) + 1;
}
/// The emitter of a place, or -1.
constexpr int emitter(int at, int prisms) {
  if (at == incident_beam_horizontal() || at == incident_beam_vertical()) return 0;
  return at < 3 + 6 * prisms ? -1 : (at - 1 - 6 * prisms) / 2;
}
/// Of a prism's glass; prisms count from 0.
constexpr int refractive_index(int prism) { return 3 + 6 * prism; }
/// Between the two faces of a prism; of a wedge's second face; of a reflector's mirror. Faces' and
/// mirrors' angles are those of their normals from the axis.
constexpr int wedge_angle(int prism) { return 4 + 6 * prism; }
constexpr int prism_tilt_horizontal(int prism) { return 5 + 6 * prism; }  ///< against its bearing
/// Against its bearing; for a wedge only its first face.
constexpr int prism_tilt_vertical(int prism) { return 6 + 6 * prism; }
/// Of the axis about which a prism turns, against the frame's; zero unless has_bearing().
constexpr int bearing_tilt_horizontal(int prism) { return 7 + 6 * prism; }
/// Of the axis about which a prism turns, against the frame's; zero unless has_bearing().
constexpr int bearing_tilt_vertical(int prism) { return 8 + 6 * prism; }
/// If the turn of a recording's frame is free, the last prism's two bearing places hold the
/// derivatives with respect to a small turn of the whole emergent beam about Z (yaw) and about Y
/// (pitch) of the train's frame: turn_derivatives(). A bearing of the last prism is held then.
constexpr int frame_yaw(int prisms) { return bearing_tilt_horizontal(prisms - 1); }
/// As frame_yaw(), of the pitch.
constexpr int frame_pitch(int prisms) { return bearing_tilt_vertical(prisms - 1); }
}  // namespace place

/// Length of the flat parameter vector with one emitter: the parameters of one shot.
constexpr int parameter_count(int prisms) { return 3 + 6 * prisms; }
/// Length of the whole flat parameter vector.
constexpr int parameter_count(TrainShape shape) {
  return parameter_count(shape.prisms) + 2 * (shape.emitters - 1);
}
/// Of the largest train.
inline constexpr int kMaxParameters = parameter_count(TrainShape{kMaxPrisms, kMaxEmitters});

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

/// THE list of parameters of a train: those shared by all prisms first ("refractive_index"), then
/// the emitters' ("incident_beam_horizontal_deg" of the only one, otherwise numbered from 1,
/// "incident_beam_1_horizontal_deg"), then the prisms' own ("refractive_index_a"), then speeds and
/// angles.
/// @throws InvalidArgument as check_shape()
const std::vector<ParameterInfo>& parameter_list(TrainShape shape);

/// The entry of that name. @throws InvalidArgument that lists the known names
const ParameterInfo& find_parameter(std::string_view name, TrainShape shape);

/// The entry of that name in any train that has it, for use before the train is known: a name means
/// the same in each. Null if no train has it.
const ParameterInfo* find_parameter_of_any_train(std::string_view name);

/// An SI value in the unit that the name states. @throws InvalidArgument as find_parameter()
double in_file_unit(std::string_view name, double value, TrainShape shape);

/// @param value  SI units
/// @throws InvalidArgument naming the parameter, value, unit and range, also when it is not finite
void check_bounds(const ParameterInfo& parameter, double value);

/// The letter of a prism in names: 'a' for the first in beam order.
constexpr char prism_letter(int prism) { return static_cast<char>('a' + prism); }
/// The same in texts for people: 'A'.
constexpr char prism_capital(int prism) { return static_cast<char>('A' + prism); }

}  // namespace risley
