// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace risley::recordings {

/// True values of every shot that a sensor does not report. SI units. One row per shot; a recording
/// in a format of fixed rate can have more rows, so rows are matched by their time.
struct TruthColumns {
  std::vector<std::int64_t> time_ns;                  ///< as in the recording, ascending
  std::vector<std::vector<double>> rotation_angle;    ///< [prisms][rows], rad, not wrapped
  std::vector<std::vector<double>> angular_velocity;  ///< [prisms][rows], rad/s
  std::vector<double> azimuth, zenith;                ///< of the beam, rad
  std::vector<double> range;                          ///< m, NaN if the beam hits nothing

  std::size_t size() const { return time_ns.size(); }
  /// Number of columns of rotation angles.
  int prisms() const { return static_cast<int>(rotation_angle.size()); }
  /// @throws InvalidArgument for a negative number of prisms or more than 26
  void resize(int prisms, std::size_t rows);
  /// Appends all rows of others; columns without rows adopt their number of prisms.
  /// @throws InvalidArgument as require_columns()
  void append(const TruthColumns& others);
};

/// @throws InvalidArgument when the rows are of another number of prisms, or a column has another
///         length than time_ns
void require_columns(const TruthColumns& rows, int prisms);

/// Writes truth columns piece by piece as NetCDF-4: time (s), rotation_angle_a_deg,
/// angular_velocity_a_deg_per_s, ..., azimuth_deg, zenith_deg, range_m along the dimension "shot".
/// The file appears under its name only at close(); a writer destroyed before leaves nothing.
class TruthWriter {
 public:
  /// @throws InvalidArgument unless there are 1 to 26 prisms, FileError
  TruthWriter(const std::string& path, int prisms);
  ~TruthWriter();

  /// Appends rows. @throws InvalidArgument as require_columns(), FileError
  void write(const TruthColumns& rows);
  /// Completes the file. @throws FileError
  void close();

 private:
  class File;
  std::unique_ptr<File> file_;
};

/// Reads a whole truth file. @throws FileError
TruthColumns load_truth(const std::string& path);

/// Reads the rows of given times, as many as the file has; memory does not grow with the length of
/// the file. @param time_ns  ascending
/// @throws InvalidArgument for times that descend, FileError
TruthColumns load_truth(const std::string& path, std::span<const std::int64_t> time_ns);

}  // namespace risley::recordings
