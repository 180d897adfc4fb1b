// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/cloud_of_stations.hpp"

#include <algorithm>
#include <memory>
#include <utility>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/hashes/sha256.hpp"
#include "risley/trajectories/geodesy.hpp"

#include "jobs/cloud_inputs.hpp"

namespace risley::jobs {
namespace {

using cloud::CloudHeader;
using cloud::CloudWriter;
using cloud::MapProjection;
using cloud::Station;
using cloud::Stations;

/// A misfit of the targets that chance exceeds once in a thousand surveys gives a warning.
constexpr double kDoubtful = 1e-3;

/// One file for the points of several recordings, which differ only in their own errors.
class SharedFile {
 public:
  explicit SharedFile(const CloudOfStationsOptions& options) : options_(options) {}

  cloud::CloudSink sink(const std::string& recording) {
    return [this, recording](const CloudHeader& header) {
      begin(header, recording);
      return std::make_unique<Part>(*this, header.factors.size());
    };
  }
  void close() { writer_->close(); }
  const CloudHeader& header() const { return header_; }

 private:
  /// What one recording writes to.
  class Part final : public CloudWriter {
   public:
    Part(SharedFile& file, std::size_t factors) : file_(file), factors_(factors) {}

    void write(const cloud::Points& points) override {
      if (factors_ == file_.header_.factors.size()) {
        file_.writer_->write(points);
        return;
      }
      cloud::Points wide = points;
      wide.loading.resize(file_.header_.factors.size());
      for (std::size_t k = factors_; k < wide.loading.size(); ++k) {
        for (auto& column : wide.loading[k]) column.assign(points.size(), 0.0);
      }
      file_.writer_->write(wide);
    }
    void close() override {}

   private:
    SharedFile& file_;
    std::size_t factors_;
  };

  void begin(const CloudHeader& header, const std::string& recording) {
    if (!writer_) {
      header_ = header;
      writer_ = cloud::create_cloud(options_.output, header, options_.cloud.writer);
      return;
    }
    const auto shared = [](const CloudHeader& of) {
      return std::vector<std::string>(
          of.factors.begin(), of.factors.end() - static_cast<std::ptrdiff_t>(of.factors_of_source));
    };
    const bool alike = header.has_rotation_angles == header_.has_rotation_angles &&
                       header.prisms == header_.prisms && header.frame.wkt == header_.frame.wkt &&
                       header.factors_of_source <= header_.factors_of_source &&
                       shared(header) == shared(header_);
    if (alike) return;
    throw InvalidArgument(
        fmt::format("{}: the calibration means something else for this recording than for the "
                    "first one, so their points do not share its errors: make separate clouds",
                    recording));
  }

  const CloudOfStationsOptions& options_;
  CloudHeader header_;
  std::unique_ptr<CloudWriter> writer_;
};

/// The map of the places and that of the points.
struct Maps {
  std::optional<MapProjection> places;
  std::string crs, datum;  ///< of the points, as cloud::StandingSensor
};

bool on_map(const Station& station) { return !station.stated || !station.stated->geographic; }

Maps maps_of(const Stations& stations, const CloudOfStationsOptions& options) {
  const std::string& of_places = stations.crs.empty() ? options.crs : stations.crs;
  const auto map_count = std::ranges::count_if(stations.stations, on_map);
  const bool any = map_count > 0, all = map_count == std::ssize(stations.stations);
  Maps maps;
  maps.crs = options.crs.empty() ? stations.crs : options.crs;
  maps.datum = options.datum.empty() ? stations.datum : options.datum;
  // Places given and used on the same map need no other datum.
  const bool no_change = all && maps.crs == of_places;
  if (maps.datum.empty() && !no_change) maps.datum = "EPSG:4979";
  if (any && of_places.empty() && !all) {
    throw InvalidArgument(fmt::format(
        "{}: eastings and northings beside latitudes and longitudes: state their map with crs",
        options.stations));
  }
  if (any && !of_places.empty()) maps.places.emplace(of_places, maps.datum);
  if (maps.crs.empty()) return maps;
  try {
    const MapProjection known(maps.crs, maps.datum);  // before anything is read
  } catch (const cloud::GeographicSystem& system) {
    const auto placed = std::ranges::find_if_not(stations.stations, on_map);
    if (placed == stations.stations.end()) throw;
    throw system.at(placed->stated->place[0], placed->stated->place[1]);
  }
  return maps;
}

std::string zone_of(const cloud::StandingPose& pose) {
  const trajectories::Geodetic place = trajectories::geodetic_from_geocentric(pose.position);
  return cloud::utm_zone_of(place.latitude, place.longitude);
}

/// Pose of a station from its own points.
cloud::AdjustedStation adjust(const Station& station, const CloudOfRecordingOptions& options,
                              const MapProjection* map,
                              std::vector<cloud::MeasuredTarget>& measured,
                              const Progress& progress) {
  cloud::TargetPoints targets(station.targets);
  CloudOfRecordingOptions own = options;
  own.cloud.provenance = {};
  own.cloud.sample.reset();
  own.cloud.loadings = own.cloud.own_covariance = own.cloud.pointing.covariance = true;
  PointsOfRecording points(
      own, [&](const CloudHeader&) { return targets.sink(); }, progress);
  while (points.next()) {
  }
  try {
    measured = targets.measured();
    return cloud::adjust_station(station.targets, measured, map);
  } catch (const InvalidArgument& error) {
    throw InvalidArgument(fmt::format("station {}: {}", station.name, error.what()));
  }
}

}  // namespace

std::uint64_t CloudOfStations::points() const {
  std::uint64_t sum = 0;
  for (const StationCloud& one : stations) sum += one.cloud.summary.points;
  return sum;
}

CloudOfStations cloud_of_stations(const CloudOfStationsOptions& options, const Progress& progress) {
  CloudOfStations result;
  result.output = options.output;
  result.format = cloud::find_cloud_format(options.output, options.cloud.writer.format).name;
  const Stations stations = cloud::load_stations(options.stations);
  if (stations.stations.size() != options.recordings.size()) {
    throw InvalidArgument(
        fmt::format("{} has {} stations, and there are {} recordings: one each, in the same order",
                    options.stations, stations.stations.size(), options.recordings.size()));
  }
  const Maps maps = maps_of(stations, options);
  const MapProjection* places = maps.places ? &*maps.places : nullptr;
  if (options.cloud.sample && options.recordings.size() > 1) {
    throw InvalidArgument("a page shows the points of one station, and there are several");
  }
  std::vector<recordings::Source> recordings;
  for (const recordings::Source& one : options.recordings) recordings.push_back(one.held_open());
  std::vector<recordings::Source> inputs = recordings;
  inputs.emplace_back(options.stations);
  InputHashes hashes(inputs, progress);
  inputs.clear();

  std::vector<CloudOfRecordingOptions> parts;
  std::vector<std::optional<cloud::AdjustedStation>> adjusted;
  const auto share = [&](double done) {
    return done / static_cast<double>(2 * stations.stations.size());
  };
  double done = 0;
  for (std::size_t i = 0; i < stations.stations.size(); ++i, done += 1) {
    const Station& station = stations.stations[i];
    CloudOfRecordingOptions& one = parts.emplace_back();
    one.recording = recordings[i];
    one.reading = options.reading;
    one.calibration = options.calibration;
    one.output = options.output;
    one.cloud = options.cloud;
    StationCloud& made = result.stations.emplace_back();
    made.name = station.name;
    made.targets = station.targets;
    adjusted.emplace_back();
    if (station.targets.empty()) continue;
    adjusted.back() =
        adjust(station, one, places, made.measured, progress.part(share(done), share(done + 1)));
  }
  const std::string targets = cloud::share_targets(stations.stations, adjusted);

  SharedFile file(options);
  std::string crs = maps.crs;
  std::optional<MapProjection> map;  // of the points
  for (std::size_t i = 0; i < stations.stations.size(); ++i, done += 1) {
    const Station& station = stations.stations[i];
    StationCloud& made = result.stations[i];
    CloudOfRecordingOptions& one = parts[i];
    if (!one.cloud.writer.date) one.cloud.writer.date = day_of(options.recordings.front());
    one.cloud.provenance = [&] {
      Provenance all = provenance_of_cloud(hashes, options.provenance, options.calibration);
      if (!targets.empty()) all.emplace_back("targets_sha256", hashes::sha256(targets));
      return all;
    };
    made.adjusted = std::move(adjusted[i]);
    cloud::StandingSensor& standing = one.cloud.standing.emplace();
    standing.pose =
        made.adjusted ? made.adjusted->pose : cloud::standing_pose(*station.stated, places);
    // A stated pose is independent of target errors.
    if (!targets.empty() && !made.adjusted) standing.pose.of_survey = Eigen::MatrixXd::Zero(6, 6);
    standing.number = static_cast<std::uint16_t>(i + 1);
    standing.crs = i == 0 ? maps.crs : crs;  // the first one states it if it is assumed
    standing.datum = maps.datum;
    const Progress part = progress.part(share(done), share(done + 1));
    PointsOfRecording points(one, file.sink(options.recordings[i].name()), part);
    while (points.next()) {
    }
    made.cloud = points.result();
    std::vector<Warning>& warnings = made.cloud.summary.warnings;
    if (made.adjusted && made.adjusted->p_value < kDoubtful) {
      warn(warnings, kWarning.targets_doubtful,
           "the targets of station {} do not fit together: such residuals come by chance with a "
           "probability of {:.1g}; the largest in sigmas has {}",
           station.name, made.adjusted->p_value, station.targets[made.adjusted->worst].name);
    }
    if (!map && standing.pose.frame == trajectories::Frame::geocentric) {
      if (crs.empty()) crs = zone_of(standing.pose);
      map.emplace(crs, maps.datum);
    }
    made.pose = cloud::pose_on_map(standing.pose, map ? &*map : nullptr);
  }
  file.close();
  result.frame = file.header().frame.text;
  result.factors = file.header().factors;
  result.factors_of_source = file.header().factors_of_source;
  return result;
}

}  // namespace risley::jobs
