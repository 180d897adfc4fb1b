// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/calibrate_flight.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "risley/calibration/flight_recordings.hpp"
#include "risley/cloud/map_projection.hpp"
#include "risley/core/error.hpp"
#include "risley/core/setting.hpp"
#include "risley/jobs/provenance.hpp"
#include "risley/jobs/result_folder.hpp"
#include "risley/scenes/control.hpp"
#include "risley/trajectories/clock.hpp"
#include "risley/trajectories/interpolation.hpp"
#include "risley/trajectories/trajectory_file.hpp"

#include "jobs/checks.hpp"
#include "jobs/ranged_input.hpp"
#include "jobs/stopwatch.hpp"

namespace risley::jobs {
namespace {

using calibration::CalibrationCode;
using calibration::RangedRecording;

/// Checks the options before reading anything.
void check_flight_options(const CalibrateFlightOptions& options) {
  check_ranged_input(options);
  if (options.range_noise) require_positive(kSetting.noise_range, *options.range_noise);
  if (options.prior_sigma) require_positive(kSetting.prior_sigma, *options.prior_sigma);
  require_not_negative(kSetting.range_offset_sigma, options.range_offset_sigma);
  if (options.tolerance) require_not_negative(kSetting.tolerance, *options.tolerance);
  require_positive(kSetting.knot_spacing, options.knot_spacing);
  require_positive(kSetting.cell_size, options.cell_size);
  if (!options.truths.empty()) check_truths(options.truths, options.recordings.size());
  if (!options.platform.crs.empty() || !options.platform.datum.empty()) {
    throw InvalidArgument(
        fmt::format("{} and {} choose a map, and a flight is calibrated without one",
                    name_of(kSetting.crs), name_of(kSetting.datum)));
  }
}

cloud::MovingPlatform platform_of(const CalibrateFlightOptions& options, const Progress& progress) {
  cloud::MovingPlatform platform = load_platform(options.platform, progress);
  if (!platform.errors) {
    throw InvalidArgument(
        fmt::format("{} states no accuracies: give {}, which states the size and duration of the "
                    "trajectory's errors. Without it, strips that do not fit may be the fault of "
                    "either the sensor or the trajectory",
                    options.platform.trajectory.name(), name_of(kSetting.trajectory_errors)));
  }
  return platform;
}

/// Known ground in the trajectory's frame.
std::vector<scenes::KnownGround> control_of(const std::string& path,
                                            const trajectories::Trajectory& trajectory) {
  if (path.empty()) return {};
  scenes::Control control = scenes::load_control(path);
  if (trajectory.frame == trajectories::Frame::local) {
    if (!control.crs.empty()) {
      throw InvalidArgument(
          fmt::format("{} gives known ground on the map {}, but the trajectory is in a local frame "
                      "without a place on a map: give the places in that frame, without crs",
                      path, control.crs));
    }
    return std::move(control.ground);
  }
  if (control.crs.empty()) {
    throw InvalidArgument(
        fmt::format("{} does not state the map of its places, and the trajectory is geocentric: "
                    "add crs, such as EPSG:25832",
                    path));
  }
  const cloud::MapProjection map(control.crs, control.datum.empty() ? "EPSG:4979" : control.datum);
  for (scenes::KnownGround& ground : control.ground) {
    const Eigen::Vector3d place = map.unproject({ground.place.x, ground.place.y, ground.place.z});
    ground.place = {place.x(), place.y(), place.z()};
    if (!ground.normal) continue;
    // Normals are gradients: of the height over a plane of the map.
    const Eigen::Vector3d normal =
        (map.tangent(place).jacobian().transpose() *
         Eigen::Vector3d(ground.normal->x, ground.normal->y, ground.normal->z))
            .normalized();
    ground.normal = Vector3<double>{normal.x(), normal.y(), normal.z()};
  }
  return std::move(control.ground);
}

/// Offset from the recordings' times to those of the trajectory, ns.
std::int64_t shift_of(const CalibratedFlight& result, const trajectories::Trajectory& trajectory,
                      std::int64_t first_ns, std::vector<Warning>& warnings) {
  const bool utc =
      std::all_of(result.recordings.begin(), result.recordings.end(), [](const auto& recording) {
        return recording.header.time_reference == recordings::TimeReference::utc;
      });
  const auto shift =
      utc ? trajectories::shift_from_utc_ns(trajectory, first_ns) : std::optional<std::int64_t>();
  if (!shift) {
    warn(warnings, kWarning.clock_unknown,
         "{}: its times are taken to be on the trajectory's clock, after adding the clock offset "
         "of the mount",
         utc ? "the trajectory does not state its time scale"
             : "the recordings do not state the time scale of their clock");
  }
  return shift.value_or(0);
}

calibration::FlightCalibrationOptions settings_of(const CalibrateFlightOptions& options,
                                                  const calibration::FlightRecordings& flight,
                                                  const cloud::MovingPlatform& platform) {
  calibration::FlightCalibrationOptions settings;
  settings.sensor = flight.sensor;
  settings.fixed = hold(options.fixed, settings.sensor);
  settings.additional = options.additional;
  settings.mount = platform.mount;
  settings.errors = *platform.errors;
  settings.range_noise = options.range_noise;
  settings.range_offset_sigma = options.range_offset_sigma;
  settings.tolerance = options.tolerance;
  if (options.prior_sigma) settings.angle_sigma = *options.prior_sigma;
  settings.rotation_angle_sigma = flight.rotation_angle_sigma;
  settings.knot_spacing = options.knot_spacing;
  settings.cell_size = options.cell_size;
  settings.seed = options.seed;
  return settings;
}

/// The recordings, then all others.
std::vector<recordings::Source> inputs_of(const CalibrateFlightOptions& options) {
  std::vector<recordings::Source> inputs = held_open(options.recordings);
  for (const std::string& path : paths_of(options.platform)) inputs.push_back(path);
  if (!options.control.empty()) inputs.emplace_back(options.control);
  return inputs;
}

void write_flight(const CalibrateFlightOptions& options, CalibratedFlight& result,
                  ResultFolder& folder, InputHashes& hashes, const Progress& progress) {
  result.provenance = hashes.with_inputs(options.files.provenance);
  const calibration::FlightCalibration& found = result.calibration;
  const CalibrationCode code = found.verdict.code;
  const bool sound = code != CalibrationCode::not_better && code != CalibrationCode::undecided;
  if (found.converged && (sound || options.force)) {
    result.calibration_written = true;
    sensors::Sensor calibrated = found.sensor;
    calibrated.provenance = result.provenance;
    folder.add_calibration(calibrated);
    folder.add_text({"mount.yaml", trajectories::mount_text(found.mount)});
    folder.add_text({"trajectory.csv", trajectories::trajectory_csv(found.trajectory)});
  }
  if (options.texts) {
    for (const NamedText& text : options.texts(result)) folder.add_text(text);
  }
  progress.check();
  append(result.warnings, folder.commit());
}

}  // namespace

CalibratedFlight calibrate_flight(const CalibrateFlightOptions& options, const Progress& progress) {
  const Stopwatch whole;
  check_flight_options(options);
  ResultFolder folder(options.files.folder);
  std::optional<InputHashes> hashes;
  std::vector<recordings::Source> inputs = inputs_of(options);
  if (folder) hashes.emplace(inputs, progress);
  CalibratedFlight result;
  cloud::MovingPlatform platform = platform_of(options, progress.stage("reading"));
  result.mount = platform.mount;
  result.errors = *platform.errors;
  for (const Warning& warning : platform.trajectory.warnings) {
    result.warnings.push_back(of_file(options.platform.trajectory.name(), warning));
  }
  std::vector<scenes::KnownGround> control = control_of(options.control, platform.trajectory);
  result.strips = trajectories::flown_strips(trajectories::Interpolation(platform.trajectory));
  std::vector<RangedRecording> recordings;
  for (std::size_t r = 0; r < options.recordings.size(); ++r) {
    recordings.push_back(read_ranged(std::move(inputs[r]), options, r, result, progress));
  }
  const auto first = std::min_element(recordings.begin(), recordings.end(),
                                      [](const RangedRecording& a, const RangedRecording& b) {
                                        return a.time_ns.front() < b.time_ns.front();
                                      });
  const auto last = std::max_element(recordings.begin(), recordings.end(),
                                     [](const RangedRecording& a, const RangedRecording& b) {
                                       return a.time_ns.back() < b.time_ns.back();
                                     });
  const std::int64_t shift_ns =
      shift_of(result, platform.trajectory, first->time_ns.front(), result.warnings);
  const Stopwatch watch;
  const Progress calibrating = progress.stage("calibrating");
  const auto offset_ns = static_cast<std::int64_t>(1e9 * result.mount.clock_offset.value);
  const std::int64_t begin_ns = first->time_ns.front() + shift_ns + offset_ns,
                     end_ns = last->time_ns.back() + shift_ns + offset_ns;
  if (end_ns < platform.trajectory.time_ns.front() ||
      begin_ns > platform.trajectory.time_ns.back()) {
    throw EstimationError(
        trajectories::no_overlap_words(platform.trajectory, begin_ns, end_ns,
                                       result.recordings.front().header.stamps_after_times_ns));
  }
  if (result.strips.size() < 2) {
    throw EstimationError(fmt::format(
        "{} has {} strips (straight flight for ten seconds or more); at least 2 that overlap are "
        "needed, and crossing ones are best",
        options.platform.trajectory.name(), result.strips.size()));
  }
  // By the recordings' clock: the real offset is still to be found.
  std::vector<trajectories::FlownStrip> strips = result.strips;
  for (trajectories::FlownStrip& strip : strips) {
    strip.begin_ns -= offset_ns;
    strip.end_ns -= offset_ns;
  }
  const calibration::FlightRecordings flight =
      calibration::flight_recordings(recordings, result.nominal, strips, shift_ns);
  if (options.truths.empty()) recordings.clear();  // they take as much memory as the shots
  result.strip_rows = flight.strip_rows;
  result.outside_strips = flight.outside_strips;
  calibration::FlightCalibrationOptions settings = settings_of(options, flight, platform);
  settings.control = std::move(control);
  result.calibration =
      calibration::calibrate_flight(flight.shots, platform.trajectory, settings, calibrating);
  result.solving_time = watch.seconds();
  if (!options.truths.empty()) {
    result.truth = compare_flight_beams(recordings, flight, result.mount, result.calibration,
                                        options.truths, calibrating.silent());
  }
  if (options.details) {
    result.details = flight_details(flight.shots, platform.trajectory, settings, result.calibration,
                                    {}, calibrating.silent());
  }
  if (folder) write_flight(options, result, folder, *hashes, progress.silent());
  result.total_time = whole.seconds();
  return result;
}

}  // namespace risley::jobs
