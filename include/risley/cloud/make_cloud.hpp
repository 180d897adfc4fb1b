// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "risley/cloud/cloud_writer.hpp"
#include "risley/cloud/georeference.hpp"
#include "risley/cloud/point_distribution.hpp"
#include "risley/cloud/point_sample.hpp"
#include "risley/cloud/pointing.hpp"
#include "risley/cloud/rotor_tracking.hpp"
#include "risley/core/error.hpp"
#include "risley/core/progress.hpp"
#include "risley/core/warning.hpp"
#include "risley/recordings/reader.hpp"

namespace risley::cloud {

/// Default number of directions per second for finding rotation angles: the angles are then known
/// to about 0.0015 degree, the beam to 0.0003.
inline constexpr double kTrackingRate = 5000.0;

/// What the user asks for.
struct CloudOptions {
  PointingOptions pointing;
  std::optional<double> rate = kTrackingRate;  ///< of RotorTracker; empty: all directions
  std::optional<double> angle_noise;           ///< rad; empty: the calibration's
  bool loadings = false;                       ///< points carry the loadings of the common factors
  bool own_covariance = false;                 ///< points carry it; those with a pose always do
  bool rows = false;                           ///< points carry the numbers of their observations
  /// The sensor is running: its properties come from the first second, every chunk of the reader
  /// becomes points immediately, from the rotors' motion up to then, and a separate message.
  bool live = false;
  std::optional<MovingPlatform> platform;  ///< of a sensor that moves
  std::optional<StandingSensor> standing;  ///< of one that stands on a map; not beside a platform
  /// Count the distribution on the ground of a moving sensor's first returns.
  std::optional<PointDistributionOptions> distribution;
  /// Draw a sample with at most this number of points.
  std::optional<std::size_t> sample;
  CloudWriterOptions writer;
  /// CloudHeader::provenance: asked once, when the file is begun.
  std::function<std::vector<std::pair<std::string, std::string>>()> provenance;
};

/// What came of it. Every observation is in exactly one of the counts.
struct CloudSummary {
  std::uint64_t observations = 0;
  std::uint64_t points = 0;
  std::uint64_t no_return = 0;
  /// The reported direction contradicts the rotors' motion: a damaged record.
  std::uint64_t outliers = 0;
  /// In periods without a solution for the rotors' motion, or not through the prisms.
  std::uint64_t without_rotation_angle = 0;
  /// Returns at times outside the trajectory of a moving sensor.
  std::uint64_t without_pose = 0;
  std::string format;                            ///< name of the CloudFormat of a file
  std::vector<std::string> factors;              ///< names of the common factors
  std::string frame;                             ///< of the points, in words
  std::vector<trajectories::FlownStrip> strips;  ///< of a flight, in the trajectory's time
  /// If requested; a warning gives the reason if it is missing.
  std::optional<PointDistributionSummary> distribution;
  std::optional<PointSample> sample;  ///< where it was asked for
  bool mirrored = false;
  double azimuth_residual_rms = 0, zenith_residual_rms = 0;  ///< rad, of the points
  /// Displacement of points from their reported positions, rms over some beams, rad.
  double repointing_rms = 0;
  std::vector<recordings::ShotSlip> slips;  ///< of the recording's count, mended
  std::vector<Warning> warnings;            ///< beside those of the reader
  /// Damage in the recording's body; the part before it is in the cloud.
  std::optional<FileError> damage;
};

/// Receives the points of a recording, once their properties are known: a file, as create_cloud()
/// makes one, or memory.
using CloudSink = std::function<std::unique_ptr<CloudWriter>(const CloudHeader& header)>;

/// Turns a recording into points, piece by piece: memory does not grow with the recording, and
/// points do not depend on the number of threads.
class CloudMaker {
 public:
  /// Reader, calibration, options and the flag of progress must outlive this.
  /// @throws InvalidArgument for a recording of several sensors or a calibration of another one,
  /// and
  ///         for a rate or angle noise that is not above 0
  CloudMaker(recordings::Reader& reader, const sensors::Sensor& calibration, CloudSink sink,
             const CloudOptions& options, const Progress& progress);
  ~CloudMaker();
  CloudMaker(const CloudMaker&) = delete;
  CloudMaker& operator=(const CloudMaker&) = delete;

  /// Gives the points of the next piece, some 260 000 observations, or a chunk of a sensor that
  /// runs, to the sink.
  /// @return false if there was none; the sink is closed then
  /// @throws EstimationError for a recording that is not in its sensor's frame, if rotation angles
  /// are needed, and when the rotors' motion cannot be found; FileError; exceptions of the sink
  bool next();

  /// The result; complete once next() has returned false.
  const CloudSummary& summary() const;

 private:
  class Work;
  std::unique_ptr<Work> work_;
};

/// All points of a recording into a file. Nothing appears at `path` unless everything succeeds.
/// @throws as CloudMaker and create_cloud()
CloudSummary make_cloud(recordings::Reader& reader, const sensors::Sensor& calibration,
                        const std::string& path, const CloudOptions& options,
                        const Progress& progress = {});

}  // namespace risley::cloud
