// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "risley/core/columns.hpp"
#include "risley/recordings/observations.hpp"

namespace risley::cloud {

/// Places of the upper triangle of a symmetric 3 x 3 matrix in Points::covariance.
enum CovarianceTerm : std::size_t { kXX, kXY, kXZ, kYY, kYZ, kZZ, kCovarianceTerms };

/// Points with their uncertainty, as columns of one length (or empty where CloudHeader says that
/// they are not there), in the frame that CloudHeader names. kPointColumns lists them.
struct Points {
  std::vector<std::int64_t> time_ns;  ///< as recorded
  std::vector<double> x, y, z;        ///< m
  /// Covariance of each point, all its sources together, m^2.
  std::array<std::vector<double>, kCovarianceTerms> covariance;
  /// The point's own part of the covariance, m^2.
  std::array<std::vector<double>, kCovarianceTerms> own_covariance;
  std::vector<double> range;  ///< from where the beam leaves the sensor, range offset taken off, m
  std::vector<double> incidence;  ///< between beam and surface normal, rad; NaN where not known
  std::vector<std::vector<double>> rotation_angle;  ///< [prisms], rad, [0, 2 pi)
  /// Reported direction minus that of the smoothed rotation angles, rad.
  std::vector<double> azimuth_residual, zenith_residual;
  std::vector<std::uint8_t> intensity;          ///< as the sensor reports it, 0-255
  std::vector<std::uint8_t> return_number;      ///< from 1
  std::vector<std::uint8_t> number_of_returns;  ///< of the point's shot
  std::vector<std::uint8_t> tag, beam;          ///< as in recordings::Observations
  std::vector<std::uint16_t> point_source;      ///< strip of a flight or station from 1; 0: of none
  std::vector<std::int64_t> row;                ///< of the recording's observations, from 0
  /// Displacement of the point by one standard deviation of each common factor, m [factors][3]. The
  /// covariance of two different points is the sum of the outer products of their loadings.
  std::vector<std::array<std::vector<double>, 3>> loading;

  std::size_t size() const { return time_ns.size(); }
  /// Keeps only these rows. @param rows  ascending @throws InvalidArgument
  void keep(std::span<const std::size_t> rows);
};

/// Frame of a cloud's coordinates.
struct PointFrame {
  std::string name = "sensor";  ///< frame of the sensor, a trajectory or stations
  std::string text = "of the sensor: X forward, Y left, Z up";  ///< origin as in [B21 Fig. 5]
  std::array<std::string, 3> axes{"forward", "left", "up"};
  std::string wkt;  ///< OGC WKT 1 of a map; empty for other frames
  /// Offset of the coordinates in formats that store multiples of a step, m.
  std::array<double, 3> offset{};
};

/// Effect of a trajectory's errors on points: point i at x_i, taken at time t_i from r_i, moves by
/// L_i e(t_i), L_i = [I, -[x_i - r_i]x]; the six of e are shifts to north, east and up, m, and
/// rotations about north, east and down, rad. docs/theory/cloud.md
struct TrajectoryErrors {
  /// Each of the six decays with time: the covariance of two times is their sigmas times exp(-|t_i
  /// - t_j| / correlation_time), s.
  std::array<double, 6> correlation_time{};
  /// White parts in addition, equal within a sample of the trajectory and independent from sample
  /// to sample, m and rad; and the length of a sample, s.
  std::array<double, 6> white{};
  double sample_interval = 0;
  std::int64_t first_sample_ns = 0;  ///< begin of sample 0
  /// North, east and down as columns, axes of the points, in the middle of the flight.
  std::array<std::array<double, 3>, 3> axes_from_ned{{{0, 1, 0}, {1, 0, 0}, {0, 0, -1}}};
  /// Where the sensor was, about once a second: time as the points have it and place, axes of the
  /// points. Linear interpolation between them is off by millimetres, which does not matter here.
  std::vector<std::int64_t> time_ns;
  std::vector<std::array<double, 3>> position;  ///< m
  std::vector<std::array<double, 6>> sigma;     ///< of the fading parts, m and rad
};

struct PointColumn;

/// Properties of a cloud known before its first point.
struct CloudHeader {
  std::string sensor;  ///< manufacturer and model, e.g. "Livox Mid-40"
  std::string serial;  ///< empty when unknown
  recordings::TimeReference time_reference = recordings::TimeReference::relative;
  int prisms = 2;
  PointFrame frame;
  bool has_covariance = true;
  bool has_own_covariance = false;  ///< only together with has_covariance
  bool has_point_source = false;    ///< points have the number of their strip or station
  bool has_row = false;             ///< points have the number of their observation
  /// Rotation angles and residuals are known.
  bool has_rotation_angles = true;
  /// Names of the common factors whose loadings the points carry; empty without loadings.
  std::vector<std::string> factors;
  /// Number of the last factors that are common only to the points of one point source: they
  /// belong to a station.
  std::size_t factors_of_source = 0;
  /// Common errors of the points of a moving sensor, due to the trajectory.
  std::optional<TrajectoryErrors> trajectory;
  /// How the cloud was made: name and value pairs such as command, version, input_sha256.
  std::vector<std::pair<std::string, std::string>> provenance;

  /// Whether points have a column.
  bool announces(const PointColumn& column) const;
  /// Gives every column in this header this many rows, and empties the others.
  /// @throws InvalidArgument for an unsupported number of prisms
  void resize(Points& points, std::size_t rows) const;
};

/// The unit of a column in files; in memory, angles are in rad and times in ns.
enum class PointUnit : std::uint8_t { one, metres, square_metres, degrees, seconds, nanoseconds };

/// The type of a column's numbers in files. Records have no int32 and int64.
enum class PointType : std::uint8_t { uint8, float32, float64, int32, int64 };

/// A column of points, or several alike: one for each term of a covariance, each prism, or each
/// axis of each common factor. {} in names and words is replaced by the distinguishing part.
struct PointColumn {
  using Numbers = std::vector<double>;  ///< of most columns
  ColumnPlace<Points, std::vector<std::int64_t>, Numbers, std::vector<std::uint8_t>,
              std::vector<std::uint16_t>, std::array<Numbers, kCovarianceTerms>,
              std::vector<Numbers>, std::vector<std::array<Numbers, 3>>>
      place;
  std::string_view field;     ///< name in records, PDAL's where it has one; empty: not in records
  std::string_view variable;  ///< name in NetCDF
  PointType type;
  PointUnit unit;
  std::string_view note;                   ///< on the field; LAS has room for 31 characters
  std::string_view meaning;                ///< of the variable
  bool CloudHeader::*announced = nullptr;  ///< says whether points have it; nullptr: always
  std::uint8_t traits = 0;
  char axis = 0;  ///< of a coordinate, in the words of the header: T, X, Y or Z

  /// The traits.
  static constexpr std::uint8_t kDerived = 1,  ///< the numbers of another column in another form
      kInLasRecord = 2,                        ///< in LAS's point record, not in the extra bytes
      kHasUnknown = 4;                         ///< NaN where nothing is known
  /// Whether it has one of the traits.
  constexpr bool is(std::uint8_t trait) const { return (traits & trait) != 0; }
};

/// All columns of points and of clouds, in NetCDF's order. Memory is given, rows are taken and
/// every format is written by this list.
inline constexpr auto kPointColumns = [] {
  using enum PointType;
  using enum PointUnit;
  using Is = PointColumn;
  constexpr bool CloudHeader::*kAlways = nullptr;
  constexpr auto kCovariance = &CloudHeader::has_covariance;
  constexpr auto kOwnCovariance = &CloudHeader::has_own_covariance;
  constexpr auto kStrips = &CloudHeader::has_point_source;
  constexpr auto kRows = &CloudHeader::has_row;
  constexpr auto kRotors = &CloudHeader::has_rotation_angles;
  return std::to_array<PointColumn>({
      {&Points::time_ns, "Time", "time", float64, seconds, "of the shot, recording's clock",
       "time of the shot, as in the recording", kAlways, Is::kDerived | Is::kInLasRecord, 'T'},
      {&Points::x, "X", "x_m", float64, metres, "{}", "{}", kAlways, Is::kInLasRecord, 'X'},
      {&Points::y, "Y", "y_m", float64, metres, "{}", "{}", kAlways, Is::kInLasRecord, 'Y'},
      {&Points::z, "Z", "z_m", float64, metres, "{}", "{}", kAlways, Is::kInLasRecord, 'Z'},
      {&Points::time_ns, "", "time_ns", int64, nanoseconds, "", "time without rounding"},
      {&Points::intensity, "Intensity", "intensity", uint8, one, "as reported, 0-255",
       "intensity as the sensor reports it", kAlways, Is::kInLasRecord},
      {&Points::return_number, "ReturnNumber", "return_number", uint8, one, "from 1",
       "number of the return within its shot, from 1", kAlways, Is::kInLasRecord},
      {&Points::number_of_returns, "NumberOfReturns", "number_of_returns", uint8, one,
       "of the shot", "returns of the shot", kAlways, Is::kInLasRecord},
      {&Points::tag, "Tag", "tag", uint8, one, "of the sensor's record", "tag byte of the sensor"},
      {&Points::beam, "Beam", "beam", uint8, one, "firing beam, from 0", "firing beam, from 0"},
      {&Points::point_source, "", "strip", int32, one, "",
       "strip of the flight or station, from 1; 0: of none", kStrips},
      {&Points::row, "", "row", int64, one, "",
       "number of the observation in its recording, from 0", kRows},
      {&Points::covariance, "Std{}", "std_{}_m", float32, metres, "1 sigma of {} (m)",
       "standard deviation of {}", kCovariance, Is::kDerived},
      {&Points::covariance, "{}", "covariance_{}_m2", float32, square_metres, "{} (m2)",
       "covariance of {}", kCovariance},
      {&Points::own_covariance, "Own{}", "own_covariance_{}_m2", float32, square_metres,
       "not shared with others (m2)", "part of covariance_{1}_m2 that is the point's own",
       kOwnCovariance},
      {&Points::range, "LidarRange", "range_m", float32, metres, "range from the last prism (m)",
       "range from where the beam leaves the sensor"},
      {&Points::incidence, "IncidenceAngle", "incidence_angle_deg", float32, degrees,
       "beam to surface normal (deg)", "angle between beam and surface normal", kAlways,
       Is::kHasUnknown},
      {&Points::rotation_angle, "PrismAngle{}", "rotation_angle_{}_deg", float32, degrees,
       "rotation angle (deg)", "rotation angle of prism {}", kRotors},
      {&Points::azimuth_residual, "ResidualAzimuth", "azimuth_residual_deg", float32, degrees,
       "reported - smoothed (deg)", "reported minus smoothed azimuth", kRotors},
      {&Points::zenith_residual, "ResidualZenith", "zenith_residual_deg", float32, degrees,
       "reported - smoothed (deg)", "reported minus smoothed zenith angle", kRotors},
      {&Points::loading, "Loading{}", "loading_{}_m", float32, metres,
       "per sigma of a common factor", "change of {} by one standard deviation of a common factor"},
  });
}();

/// Calls visit(entry, column) for every column of numbers of points, once for each.
template <class AnyPoints, class Visit>
void for_each_point_column(AnyPoints& points, const Visit& visit) {
  for_each_entry<kPointColumns>(
      [&visit](const PointColumn& entry, auto& column) {
        if (!entry.is(PointColumn::kDerived)) visit(entry, column);
      },
      points);
}

}  // namespace risley::cloud
