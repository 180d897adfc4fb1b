// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/prepared_recording.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/setting.hpp"
#include "risley/estimation/shot_slips.hpp"
#include "risley/estimation/stored_pose.hpp"
#include "risley/recordings/plausibility.hpp"
#include "risley/trajectories/trajectory_file.hpp"

#include "jobs/packet_recording.hpp"

namespace risley::jobs {
namespace {

using estimation::StoredPoseUse;
using recordings::Extrinsics;

/// @throws FileError when the file is a trajectory: its own problem, or that it is not a recording
/// of a lidar
void refuse_trajectory(const recordings::Source& source, const Progress& progress) {
  if (source.recording()) return;
  const std::string& path = source.name();
  if (trajectories::trajectory_file_kind(path, progress) !=
      trajectories::TrajectoryFileKind::trajectory) {
    return;
  }
  const trajectories::Trajectory found = trajectories::load_trajectory(path, progress);
  throw FileError(path, {},
                  fmt::format("is a trajectory ({}, {} records), expected a recording of a lidar: "
                              "name it as the trajectory of one",
                              found.format, found.size()));
}

/// Opens a recording for the first time. @throws FileError for a trajectory, which is not a
/// recording
std::unique_ptr<recordings::Reader> open_lidar(const recordings::Source& source,
                                               const recordings::ReadOptions& reading,
                                               const Progress& progress) {
  std::unique_ptr<recordings::Reader> reader;
  try {
    reader = recordings::open_recording(source, reading, progress);
  } catch (const FileError&) {
    refuse_trajectory(source, progress);
    throw;
  } catch (const InvalidArgument& error) {
    if (!reading.extrinsics) throw;  // several sensors otherwise
    throw InvalidArgument(
        fmt::format("{}, {}: {}", name_of(kSetting.extrinsics), source.name(), error.what()));
  }
  // Columns named yaw and pitch may be either.
  if (reader->header().format == "named-csv") refuse_trajectory(source, progress);
  return reader;
}

/// The pose equivalent to a roll about the optical axis: recorded = pose unrolled.
Extrinsics roll_about_axis(double roll, const estimation::FrameTurn& frame) {
  const Eigen::Matrix3d axis_frame = estimation::recording_from_sensor(frame);
  const Eigen::Matrix3d turn =
      axis_frame * Eigen::AngleAxisd(roll, estimation::sensor_from_train(frame.axis_up).col(0)) *
      axis_frame.transpose();
  // Of Rz(yaw) Ry(pitch) Rx(roll).
  return {std::atan2(turn(1, 0), turn(0, 0)),
          std::atan2(-turn(2, 0), std::hypot(turn(0, 0), turn(1, 0))),
          std::atan2(turn(2, 1), turn(2, 2)),
          {}};
}

/// Whether times are evidently counted with a sensor's rate: the same time step from each shot to
/// the next, from the first row to the last.
class EvenTimes {
 public:
  explicit EvenTimes(double shot_rate) : usual_step_(1e9 / shot_rate) {}

  /// @return whether they still are
  bool add(const recordings::Chunk& chunk) {
    if (!chunk.packets.empty()) return false;
    const recordings::Observations& rows = chunk.observations;
    for (std::size_t row = 0; row < rows.size(); ++row) {
      if (shots_ > 0 && rows.return_number[row] > 1) continue;
      if (shots_ == 0) first_ = last_ = rows.time_ns[row];
      // Rounded to microseconds a step may be half a microsecond off.
      const double off = static_cast<double>(rows.time_ns[row] - last_) - usual_step_;
      if (shots_ > 0 && std::abs(off) > kOtherRate * usual_step_ + 1000.0) return false;
      last_ = rows.time_ns[row];
      if (step_ > 0 && std::abs(static_cast<double>(last_ - first_) -
                                step_ * static_cast<double>(shots_)) > kSameStep * usual_step_) {
        return false;
      }
      ++shots_;
    }
    if (shots_ > 1 && step_ == 0) step_ = mean_step();
    return true;
  }
  /// Shots per second, if their rate is the sensor's.
  std::optional<double> rate() const {
    if (shots_ < 2 || std::abs(step_ / usual_step_ - 1.0) > kOtherRate) return std::nullopt;
    return 1e9 / mean_step();
  }
  /// The times as counted with the rate, from 0.
  void count(std::vector<std::int64_t>& time_ns) const {
    const double step = mean_step();
    for (std::int64_t& time : time_ns) {
      time = std::llround(std::round(static_cast<double>(time - first_) / step) * step);
    }
  }

 private:
  static constexpr double kOtherRate = 0.05, kSameStep = 0.15;  // shares of a step
  double mean_step() const {
    return static_cast<double>(last_ - first_) / static_cast<double>(shots_ - 1);
  }
  double usual_step_, step_ = 0;
  std::int64_t first_ = 0, last_ = 0, shots_ = 0;
};

/// All valid shots of a recording with counted times, because a rate was given or because they
/// evidently are.
std::optional<estimation::CountedShots> counted_shots(const recordings::Source& source,
                                                      recordings::ReadOptions options,
                                                      const sensors::Sensor& sensor,
                                                      const Progress& progress) {
  options.emitters = 0;  // beams as in the file
  const auto reader = recordings::open_recording(source, options, progress);
  estimation::ShotSelector selector({.rate = std::nullopt, .ranges = false, .rows = true});
  EvenTimes even(sensor.shot_rate);
  recordings::Chunk chunk;
  bool named = false;
  while (reader->read_sound(chunk)) {
    if (!options.shot_rate && !even.add(chunk)) return std::nullopt;
    selector.add(chunk.observations);
    const auto& beam = chunk.observations.beam;
    named = named || std::any_of(beam.begin(), beam.end(), [](auto one) { return one != 0; });
    progress.check();
  }
  const std::optional<double> rate = options.shot_rate ? options.shot_rate : even.rate();
  if (!rate) return std::nullopt;
  estimation::CountedShots shots{selector.take_series(), selector.rows(), *rate,
                                 !named && sensor.train.emitters() > 1};
  if (!options.shot_rate) even.count(shots.series.time_ns);
  return shots;
}

/// Quality of the count of a recording's shots.
estimation::ShotCount count_of(const estimation::CountedShots& shots, const sensors::Sensor& sensor,
                               const Progress& progress) {
  for (const std::uint8_t beam : shots.series.beam) {
    if (beam >= sensor.train.emitters()) return {};  // the estimator refuses it
  }
  return estimation::find_slips(shots, sensor, progress);
}

/// Errors found in a count.
std::vector<Warning> warnings_of(const estimation::ShotCount& count, double rate, bool given) {
  std::vector<Warning> warnings;
  std::int64_t lost = 0;
  std::size_t mended = 0;
  for (const recordings::ShotSlip& slip : count.slips) {
    if (!slip.counted) {
      warn(warnings, kWarning.shots_lost,
           "shots are missing before row {}, and the rotors do not show how many: the recording "
           "was cut there",
           slip.row);
      continue;
    }
    ++mended;
    lost += slip.shots;
  }
  if (mended > 0) {
    warn(warnings, kWarning.shots_lost,
         "{} gap{} in the shot count {} found ({} shots lost), and the times behind {} corrected",
         mended, mended == 1 ? "" : "s", mended == 1 ? "was" : "were", lost,
         mended == 1 ? "it" : "them");
  }
  if (!warnings.empty() && !given) {
    warn(warnings, kWarning.times_corrected,
         "the times of the recording are evidently shot numbers: they were counted anew at {:.6g} "
         "shots per second",
         rate);
  }
  bool in_turn = true;
  std::string order;
  for (std::size_t i = 0; i < count.firing_order.size(); ++i) {
    in_turn = in_turn && count.firing_order[i] == i;
    order += fmt::format("{}{}", order.empty() ? "" : ", ", count.firing_order[i] + 1);
  }
  if (!in_turn) {
    warn(warnings, kWarning.firing_order,
         "the file names no emitters: from its first shot on, they fire in the order {}", order);
  }
  return warnings;
}

std::string share_text(double share) { return fmt::format("{:.1f} %", 100.0 * share); }

/// The sensor whose rate counts the shots of a recording with constant times, if it is known.
std::optional<sensors::Sensor> sensor_to_count_by(const recordings::RecordingHeader& header,
                                                  const recordings::ReadOptions& reading,
                                                  const std::optional<sensors::Sensor>& given) {
  if (!header.all_times_equal || reading.shot_rate || header.devices.size() != 1) {
    return std::nullopt;
  }
  const recordings::Device& device = header.devices.front();
  if (given || device.type == recordings::kUnknownDeviceType) return given;
  return preset_of_type(device.type);
}

/// The defect of a count of shots where those without a return were removed; empty if they were
/// not. @param emitters  of the sensor, which fire in turn
std::string words_of_removed(const estimation::CountedShots& shots, int emitters) {
  const double rows = estimation::rows_between_jumps(shots, emitters);
  // If a packet is missing occasionally, rotors can be followed from one to the next.
  constexpr double kFewest = 1000;
  if (rows >= kFewest) return {};
  return fmt::format(
      "shots without a return were removed from this file, which has no times: about every {:.0f} "
      "rows the beam jumps, and how many shots are missing there, so when each was fired, is lost. "
      "Directions and ranges are still valid: they can be viewed, converted, and made into a "
      "cloud. "
      "An estimation needs the recording with times of single shots, or with shots without a "
      "return kept as 0 0 0, or the original of the export (LVX, a capture, or a bag of CustomMsg)",
      rows);
}

/// Requirements of a recording without times: only their rate, or shots; defects of the shots
/// themselves come first.
/// @throws recordings::MissingTimes, FileError for data that are not a scan, EstimationError if
/// shots were removed
[[noreturn]] void refuse_without_times(const PreparedRecording& recording,
                                       const Progress& progress) {
  constexpr double kAnyRate = 1e5;  // Hz
  recordings::ReadOptions counted = recording.reading;
  counted.shot_rate = kAnyRate;
  const estimation::AngleSeries first = first_second(recording.source, counted, progress);
  const std::string& name = recording.source.name();
  if (const auto problem = recordings::not_a_scan(first.azimuth, first.zenith, first.range)) {
    throw FileError(name, {}, *problem);
  }
  const auto beyond =
      recordings::beyond_reach(first.range, recordings::kFarthestReach, "these sensors");
  const std::string words = recording.removed_shots_words(progress);
  if (!words.empty()) throw EstimationError(fmt::format("{}: {}", name, words));
  try {
    recordings::require_times(recording.reader->header());
  } catch (const recordings::MissingTimes& missing) {
    if (!beyond) throw;
    throw recordings::MissingTimes(fmt::format("{}. Besides, {}", *beyond, missing.what()));
  }
  throw EstimationError(fmt::format("{}: has no times", name));
}

/// @throws EstimationError if shots are missing all over a recording with counted shots
void require_all_shots(const estimation::CountedShots& shots, const sensors::Sensor& sensor,
                       const std::string& name) {
  const auto words = words_of_removed(shots, sensor.train.emitters());
  if (!words.empty()) throw EstimationError(fmt::format("{}: {}", name, words));
}

/// Counts shots with constant times, and rejects a recording without times.
void find_times(PreparedRecording& recording, const Preparation& wishes, const Progress& progress) {
  if (const auto sensor =
          sensor_to_count_by(recording.reader->header(), recording.reading, wishes.sensor)) {
    warn(recording.warnings, kWarning.times_corrected,
         "all times of the recording are the same: shots were counted at the {:.6g} shots per "
         "second of {}",
         sensor->shot_rate, sensor->name);
    recording.reading.shot_rate = sensor->shot_rate;
    recording.read_again(progress);
  }
  if (!recording.reader->header().has_times) {
    refuse_without_times(recording, progress);
  }
}

/// Turns the rows back by the pose stated in the recording, if its points were moved by it, or by
/// the roll that its emitters show.
void turn_back(PreparedRecording& recording, const Progress& progress) {
  const recordings::RecordingHeader& header = recording.reader->header();
  if (recording.reading.extrinsics || header.devices.size() != 1) return;
  const SensorChoice& choice = *recording.choice;
  const recordings::Device device = header.devices.front();
  const std::optional<Extrinsics> pose = recordings::stored_extrinsics(device);
  if (!pose) {
    if (choice.roll == 0) return;
    recording.reading.extrinsics = roll_about_axis(choice.roll, choice.frame);
    recording.read_again(progress);
    recording.turned_back = true;
    warn(recording.warnings, kWarning.turned_back,
         "the recording is rotated about the optical axis by {:.1f} deg, as the positions of the "
         "sensor's emitters show: the shots were turned back by that angle",
         degrees_from_radians(choice.roll));
    return;
  }
  recordings::ReadOptions turned_back = recording.reading;
  turned_back.extrinsics = pose;
  const estimation::StoredPoseVerdict verdict = estimation::judge_stored_pose(
      first_second(recording.source, recording.reading, progress),
      first_second(recording.source, turned_back, progress), choice.sensor.field_of_view);
  const std::string found = fmt::format(
      "the recording states a pose of its sensor ({}); of the shots, {} lie outside the sensor's "
      "field of view as recorded and {} after turning them back",
      pose_text(*pose), share_text(verdict.outside_as_recorded),
      share_text(verdict.outside_turned_back));
  const bool by_hub =
      !device.hub_serial.empty() && verdict.outside_turned_back <= verdict.outside_as_recorded;
  const bool decided = verdict.use != StoredPoseUse::undecided;
  recording.turned_back = decided ? verdict.use == StoredPoseUse::applied : by_hub;
  if (recording.turned_back) {
    recording.reading = std::move(turned_back);
    recording.read_again(progress);
  }
  if (decided && recording.turned_back) {
    warn(recording.warnings, kWarning.turned_back,
         "{}: the shots were turned back into the sensor's frame", found);
  } else if (!decided) {
    warn(recording.warnings, kWarning.pose_undecided,
         "{}: that does not show whether the pose was applied to them; {}. {} decides it: give the "
         "pose, or 0,0,0 for shots in the sensor's frame",
         found,
         recording.turned_back ? "they were turned back, because a hub recorded them"
                               : "they were left unchanged",
         name_of(kSetting.extrinsics));
  }
}

/// Follows the rotors if shots are counted, and corrects the count.
void mend_count(PreparedRecording& recording, const Progress& progress) {
  const SensorChoice& choice = *recording.choice;
  const sensors::Sensor& sensor = choice.sensor;
  recordings::ReadOptions& reading = recording.reading;
  const int emitters = sensor.train.emitters();
  const bool given = reading.shot_rate.has_value();
  if (recording.reader->header().devices.size() != 1) {  // it is unknown whose shots are missing
    if (!given || emitters == 1) return;
    reading.emitters = emitters;
    reading.firing_order = estimation::emitters_in_order(choice.order, emitters);
    return recording.read_again(progress);
  }
  const auto shots = counted_shots(recording.source, reading, sensor, progress);
  if (!shots) return;
  require_all_shots(*shots, sensor, recording.source.name());
  estimation::ShotCount count = count_of(*shots, sensor, progress);
  if (!given && count.slips.empty() && count.firing_order.empty()) return;
  append(recording.warnings, warnings_of(count, shots->shot_rate, given));
  reading.shot_rate = shots->shot_rate;
  reading.emitters = emitters;
  reading.slips = std::move(count.slips);
  reading.firing_order = count.firing_order.empty() && emitters > 1
                             ? estimation::emitters_in_order(choice.order, emitters)
                             : std::move(count.firing_order);
  recording.read_again(progress);
}

}  // namespace

void PreparedRecording::read_again(const Progress& progress) {
  reader = recordings::open_recording(source, reading, progress);
}

const SensorChoice& PreparedRecording::choose(const std::optional<sensors::Sensor>& given,
                                              const Progress& progress) {
  if (!choice) choice = choose_sensor(source, reading, reader->header(), given, progress, &first);
  return *choice;
}

std::string PreparedRecording::removed_shots_words(const Progress& progress) const {
  constexpr std::size_t kMost = 100'000;
  estimation::ShotSelector selector({.rate = std::nullopt, .ranges = false, .rows = true});
  const auto own = recordings::open_recording(source, reading, progress);
  recordings::Chunk chunk;
  while (selector.rows().size() < kMost && own->read_sound(chunk)) selector.add(chunk.observations);
  const estimation::CountedShots shots{selector.take_series(), selector.rows(), 0, false};
  return words_of_removed(shots, estimation::emitters_in_turn(shots));
}

PreparedRecording prepare_recording(const recordings::Source& source,
                                    const recordings::ReadOptions& options,
                                    const Preparation& wishes, const Progress& progress) {
  progress.check();
  PreparedRecording result;
  result.source = source.held_open();
  result.reading = options;
  result.turned_back = options.extrinsics.has_value();
  result.reader = open_lidar(result.source, options, progress);
  auto packets = PacketRecording::open(result, progress);
  if (packets) {  // shots cannot be counted, but packets have their times
    result.reading.shot_rate.reset();
    result.reading.packet_places = packets->middle_places();
    result.read_again(progress);
  }
  if (wishes.sensor_frame) {
    find_times(result, wishes, progress);
    const SensorChoice& choice = result.choose(wishes.sensor, progress);
    require_possible(choice, source.name());
    append(result.warnings, choice.warnings);
    if (choice.times_at_fault) {
      result.reading.shot_rate = choice.sensor.shot_rate;
      result.read_again(progress);
    }
    turn_back(result, progress);
    if (!packets) mend_count(result, progress);
  }
  if (!packets) return result;
  // A detected pose says more about the packets.
  if (result.reading.extrinsics && !options.extrinsics) {
    packets = PacketRecording::open(result, progress);
  }
  PlacedRows placed = packets->place_rows(result.choose(wishes.sensor, progress).sensor,
                                          options.shot_rate, wishes.untold, progress);
  append(result.warnings, placed.warnings);
  result.time_uncertainty = placed.time_uncertainty;
  result.cut_mended = placed.places.cut_coordinates;
  result.reading.packet_places = std::move(placed.places);
  result.read_again(progress);
  return result;
}

std::string pose_text(const Extrinsics& pose) {
  return fmt::format("yaw {:.6g} pitch {:.6g} roll {:.6g} deg, translation {:.6g} {:.6g} {:.6g} m",
                     degrees_from_radians(pose.yaw), degrees_from_radians(pose.pitch),
                     degrees_from_radians(pose.roll), pose.translation.x, pose.translation.y,
                     pose.translation.z);
}

}  // namespace risley::jobs
