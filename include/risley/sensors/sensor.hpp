// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "risley/optics/beam_origin.hpp"
#include "risley/optics/prism_train.hpp"
#include "risley/sensors/range_errors.hpp"

namespace risley::sensors {

/// Uncertainty and source of one named value.
struct Knowledge {
  std::string name;    ///< as in parameter_list(), or a preset's field such as "range_noise_m"
  double sigma = 0;    ///< one standard deviation, SI units; 0 when taken as exact
  std::string source;  ///< data sheet page, paper table, or the calibration that found it
  /// Uncertainty including possible errors of held parameters, which sigma and covariance exclude;
  /// 0 if there are none.
  double total_sigma = 0;
};

/// One way in which the rotors of a sensor can run.
struct SpeedCombination {
  std::vector<double> angular_velocity;  ///< nominal [prisms], rad/s
  std::vector<FaceOrder> face_order;     ///< of the train in this combination; empty: always the
                                         ///< same

  friend bool operator==(const SpeedCombination&, const SpeedCombination&) = default;
};

/// Firing scheme of a train's emitters.
enum class Firing {
  in_turn,   ///< one after another, at equal intervals, as real sensors do
  together,  ///< all at once, as in the scan sequences of the manufacturer
};

/// "in_turn" or "together".
std::string to_string(Firing firing);

/// The scan of a sensor of this type from its start. Shot i, counted from 0, is of emitter i modulo
/// their number and has the time (first_shot + i) / shot_rate; its rotors are where they are then,
/// or, where E emitters fire together, at (first_shot + floor(i / E)) E / shot_rate. The speed of a
/// rotor may swing: by swing cos(2 pi f t), where f is swings_per_beat times the turns per second
/// of the second rotor against the first. The manufacturer adds speeds up group by group of shots,
/// so the angle at time t is start + w t + swing h (1 + ... + cos(2 pi f t)), h being the interval
/// of groups.
struct ScanSequence {
  std::vector<double> rotation_angle;  ///< [prisms] at time 0, without the swing, rad
  std::vector<double> swing;           ///< [prisms], rad/s; empty: none
  int swings_per_beat = 0;
  int first_shot = 0;  ///< 0 or 1
  Firing firing = Firing::in_turn;
};

/// Reference of a calibration of a sensor's parameters.
enum class CalibrationReference {
  none,        ///< a type or an assumption, no calibration
  directions,  ///< the reported directions: the sensor's own calibration is taken as true
  planes,      ///< plane walls: the true directions
};

/// "none", "directions" or "planes".
std::string to_string(CalibrationReference reference);

/// A named instrument: its optics, its rotors, its noise and its limits. SI units.
struct Sensor {
  std::string name;                      ///< "mid-40"
  std::string manufacturer;              ///< "Livox"
  std::string model;                     ///< "Mid-40"
  std::string serial;                    ///< empty for a type rather than a unit
  PrismTrain train;                      ///< without prisms until it is set
  std::vector<double> angular_velocity;  ///< [prisms], rad/s
  /// Number of this speed combination, from 1, for sensors that have several.
  std::optional<int> combination;
  /// All of them. Empty with a combination: the two of a sensor with two prisms, where the second
  /// has the fast rotor first and both directions kept, (wA, wB) becomes (-wB, -wA).
  /// [B21 section 2.4]
  std::vector<SpeedCombination> combinations;
  /// Empty if the rotors' start angles are unknown.
  std::optional<ScanSequence> sequence;
  std::vector<Knowledge> knowledge;  ///< of parameters, speeds and the numbers below, any order

  CalibrationReference reference = CalibrationReference::none;
  /// Joint covariance of named values, SI units; empty for presets that are not calibrations. The
  /// names are those of parameter_list(), range_offset_m and sizes of prisms, shared or own.
  std::vector<std::string> covariance_names;
  Eigen::MatrixXd covariance;  ///< [names, names]

  double angle_noise = 0;              ///< 1 sigma of azimuth and zenith before rounding, rad
  double range_noise = 0;              ///< 1 sigma, m; see range_variance() for further parts
  double range_noise_per_range = 0;    ///< part that grows with the range, m per m
  double range_noise_incidence = 0;    ///< part that grows with tan(angle of incidence), m
  double range_noise_weak_return = 0;  ///< part at intensity 1; falls with the root of it, m
  double range_offset = 0;             ///< added to a true range, m
  RangeErrors range_errors;            ///< what it adds beside that
  double angle_resolution = 0;         ///< rounding step of reported angles, rad
  double range_resolution = 0;         ///< rounding step of reported ranges, m
  double range_minimum = 0;            ///< no return below, m
  double range_maximum = 0;            ///< no return beyond, m
  double field_of_view = 0;            ///< full cone, rad
  /// Root mean square error of a unit's directions allowed by its manufacturer, rad; 0: not stated.
  double pointing_tolerance = 0;
  double shot_rate = 0;  ///< shots per second
  int device_type = 1;   ///< Livox device type of recordings
  double beam_divergence_horizontal = 0, beam_divergence_vertical = 0;  ///< full angle, rad
  PrismGeometry geometry;  ///< sizes of the prisms                       [B21 App. A]

  /// Origin of computed numbers: name and value pairs such as command, version, seed, input_sha256.
  std::vector<std::pair<std::string, std::string>> provenance;

  int prisms() const { return train.prisms(); }       ///< how many
  TrainShape shape() const { return train.shape(); }  ///< numbers of prisms and emitters
  /// Variance of one range by its parts, which are independent of each other; rounding not
  /// included.
  /// @param range          m
  /// @param tan_incidence  of the angle between beam and surface normal; 0 if it is not known
  /// @param intensity  as reported by the sensor; 0 counts as 1
  double range_variance(double range, double tan_incidence, double intensity) const;

  /// Value of a train parameter or angular velocity, SI units. @throws InvalidArgument
  double get(std::string_view parameter) const;
  /// Sets a train parameter or an angular velocity, SI units, within bounds. Knowledge of all
  /// prisms together becomes knowledge of each when one of them is set alone.
  /// @throws InvalidArgument naming the parameter, value, unit and range
  void set(std::string_view parameter, double value);
  /// Sets the prisms' sizes, as exact, and discards previous knowledge of them.
  /// @throws InvalidArgument as face_positions()
  void set_prism_geometry(const PrismGeometry& geometry);
  /// Knowledge of a parameter, or nullptr when nothing is recorded.
  const Knowledge* find_knowledge(std::string_view parameter) const;
  /// Replaces or adds the knowledge of a parameter.
  void set_knowledge(Knowledge entry);
};

/// The same sensor in that speed combination. If its speeds are those of the current one, except
/// for order and sign, they keep their exact values, together with their uncertainties.
/// @param combination  from 1
/// @throws InvalidArgument when the sensor has no such combination, does not state its current one,
/// or has speeds, face orders or a covariance of another length
Sensor with_combination(const Sensor& sensor, int combination);

/// The sensor in each of its speed combinations, its own first; itself when it has only one.
/// @throws InvalidArgument as with_combination()
std::vector<Sensor> in_all_combinations(const Sensor& sensor);

}  // namespace risley::sensors
