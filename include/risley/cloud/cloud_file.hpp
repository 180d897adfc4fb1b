// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "risley/cloud/points.hpp"
#include "risley/core/progress.hpp"
#include "risley/io/block_file.hpp"

namespace risley::cloud {

/// Whether a file is a LAS file, by its first bytes. @throws FileError when it cannot be read
bool is_las_file(const std::string& path);

/// Points with their covariance in a LAS file written by a CloudWriter, which is read in parts as
/// needed. May be used by several threads.
class CloudFile {
 public:
  /// @throws FileError for a file that is damaged, compressed, or without the covariances of its
  /// points, with the remedy
  explicit CloudFile(const std::string& path);

  const std::string& path() const { return file_.path(); }  ///< as it was given
  std::size_t size() const { return points_; }              ///< points
  const std::string& frame() const { return wkt_; }         ///< of the coordinates, WKT
  /// SHA-256 of the file of its calibration; empty if not stated.
  const std::string& calibration() const { return calibration_; }
  /// SHA-256 of the targets that determined its stations; empty if there were none.
  const std::string& targets() const { return targets_; }
  /// Names of the common factors of the points' loadings; the last ones belong to one source.
  const std::vector<std::string>& factors() const { return factors_; }
  std::size_t factors_of_source() const { return factors_of_source_; }  ///< as CloudHeader
  /// Common errors due to the trajectory, of a flight.
  const std::optional<TrajectoryErrors>& trajectory() const { return trajectory_; }

  /// Coordinates of all points, m, less the offset, which keeps the numbers short.
  /// @throws FileError, Cancelled
  std::vector<std::array<float, 3>> coordinates(const std::array<double, 3>& offset,
                                                const Progress& progress = {}) const;

  /// Some points with time, source, coordinates, covariance, own covariance (empty columns if they
  /// have none) and loadings.
  /// @throws FileError, InvalidArgument for rows beyond the points
  Points points(std::span<const std::size_t> rows) const;

 private:
  struct Field {
    std::size_t at = 0;  ///< byte of the record
    bool known = false;
  };
  using Terms = std::array<Field, kCovarianceTerms>;

  void read_header();
  void take_record(const std::string& user, std::uint16_t number, std::string body);
  void take_descriptors(const std::string& body);
  void take_factors(const std::string& body);
  void take_errors(const std::string& body);
  [[noreturn]] void fail(std::uint64_t offset, const std::string& problem) const;

  io::InputFile file_;
  std::uint64_t first_point_ = 0;
  std::size_t points_ = 0, record_bytes_ = 0, base_bytes_ = 0;
  std::array<double, 3> scale_{}, offset_{};
  bool gps_time_ = false;
  std::string wkt_, calibration_, targets_;
  std::vector<std::string> factors_;
  std::size_t factors_of_source_ = 0;
  std::optional<TrajectoryErrors> trajectory_;
  Terms covariance_, own_;
  std::vector<std::array<Field, 3>> loading_;
};

}  // namespace risley::cloud
