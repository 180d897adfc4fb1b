// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace risley {

/// A value and its sigma for people, with significant digits only.
struct NumberText {
  std::string value, sigma;
};

/// "-0.00" as "0.00", any other number unchanged.
std::string without_minus_zero(std::string number);

/// A number with this many significant digits and never as a power of ten: "0.0000857".
std::string plain_text(double value, int digits);

/// Whether a sigma is finite and above zero.
bool is_sigma(double sigma);

/// Two significant digits of the sigma, and the value to the same place. Without a sigma (0 or not
/// finite) the value has seven significant digits and the sigma's text is empty.
NumberText number_text(double value, double sigma);

/// A value to the place of the second significant digit of a sigma, for a column beside
/// number_text.
std::string text_to_place_of(double value, double sigma);

/// Distance at which messages state the shift due to a small angle, m.
inline constexpr double kStatedDistance = 30;

/// Displacement of a point at a distance, m, due to an angle error of its direction, rad: distance
/// * tan(|angle|), m.
/// @param angle  below a right angle
double offset_at(double angle, double distance = kStatedDistance);

/// The same for people, with two significant digits: "2.6 mm at 30 m", from 10 cm on "21 cm at 30
/// m", from 1 m on "1.6 m at 30 m"; "–" if angle or distance is not finite.
std::string offset_text(double angle, double distance = kStatedDistance);

}  // namespace risley
