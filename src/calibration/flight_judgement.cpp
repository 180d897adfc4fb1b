// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/flight_judgement.hpp"

#include "risley/core/angle.hpp"

namespace risley::calibration {

double in_file_unit(const FlightUnknown& unknown, double value, TrainShape shape) {
  if (unknown.name.starts_with("boresight")) return degrees_from_radians(value);
  const bool plain = unknown.name.starts_with("lever_arm") || unknown.name == "range_offset_m" ||
                     unknown.name == "clock_offset_s";
  return plain ? value : risley::in_file_unit(unknown.name, value, shape);
}

std::string file_unit(const FlightUnknown& unknown, TrainShape shape) {
  if (unknown.name.starts_with("boresight")) return "deg";
  if (unknown.name == "clock_offset_s") return "s";
  if (unknown.name.starts_with("lever_arm") || unknown.name == "range_offset_m") return "m";
  return find_parameter(unknown.name, shape).unit;
}

}  // namespace risley::calibration
