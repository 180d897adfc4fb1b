// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "risley/cloud/station.hpp"
#include "risley/cloud/station_adjustment.hpp"
#include "risley/jobs/cloud_of_recording.hpp"

namespace risley::jobs {

/// Points to make from recordings on stations, all in one file.
struct CloudOfStationsOptions {
  std::vector<recordings::Source> recordings;  ///< one per station, in their order
  recordings::ReadOptions reading;             ///< as CloudOfRecordingOptions
  GivenSensor calibration;                     ///< as CloudOfRecordingOptions
  std::string stations;                        ///< path, see cloud::load_stations()
  /// The map of the points, as cloud::MapProjection; empty: that of the stations' places, or UTM if
  /// they are geographic. Places without a map in the file are on this one.
  std::string crs;
  std::string datum;          ///< of geographic places; empty: as in the file, or WGS 84
  std::string output;         ///< path; its ending chooses the format unless one is named
  cloud::CloudOptions cloud;  ///< without a platform, a pose and provenance
  Provenance provenance;      ///< goes into it, with the inputs' SHA-256
};

/// The points of one station.
struct StationCloud {
  std::string name;
  RecordingCloud cloud;
  cloud::StatedPose pose;  ///< on the map of the points, with all its uncertainty
  std::vector<cloud::StationTarget> targets;
  std::vector<cloud::MeasuredTarget> measured;     ///< of each target
  std::optional<cloud::AdjustedStation> adjusted;  ///< if targets determined the pose
};

/// The points of all stations.
struct CloudOfStations {
  std::string output;
  std::string format;                  ///< name of the cloud::CloudFormat
  std::string frame;                   ///< of the points, in words
  std::vector<std::string> factors;    ///< names of the loadings in the file
  std::size_t factors_of_source = 0;   ///< as cloud::CloudHeader
  std::vector<StationCloud> stations;  ///< in the order of Points::point_source, from 1

  std::uint64_t points() const;  ///< of all of them
};

/// Turns recordings on stations into the points of one map: the output appears when it is complete.
/// If targets determine a pose, its recording is read twice.
/// @throws EstimationError, InvalidArgument, FileError, Cancelled
CloudOfStations cloud_of_stations(const CloudOfStationsOptions& options,
                                  const Progress& progress = {});

}  // namespace risley::jobs
