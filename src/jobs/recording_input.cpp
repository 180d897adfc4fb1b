// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/recording_input.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/setting.hpp"
#include "risley/estimation/shot_slips.hpp"
#include "risley/estimation/stored_pose.hpp"
#include "risley/jobs/sensor_choice.hpp"
#include "risley/parallel/parallel.hpp"
#include "risley/recordings/plausibility.hpp"

#include "jobs/open_input.hpp"
#include "jobs/packet_recording.hpp"
#include "jobs/stopwatch.hpp"

namespace risley::jobs {
namespace {

using estimation::StoredPoseUse;
using recordings::Extrinsics;

/// The pose that a roll about the optical axis amounts to: recorded = pose unrolled.
Extrinsics roll_about_axis(double roll, const estimation::FrameTurn& frame) {
  const Eigen::Matrix3d axis_frame = estimation::recording_from_sensor(frame);
  const Eigen::Matrix3d turn =
      axis_frame * Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX()) * axis_frame.transpose();
  // Of Rz(yaw) Ry(pitch) Rx(roll).
  return {std::atan2(turn(1, 0), turn(0, 0)),
          std::atan2(-turn(2, 0), std::hypot(turn(0, 0), turn(1, 0))),
          std::atan2(turn(2, 1), turn(2, 2)),
          {}};
}

/// Whether times are evidently counted with a sensor's rate: each shot follows the one before it by
/// the same time, from the first row to the last.
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
  /// The times as they are counted with the rate, from 0.
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

/// All valid shots of a recording whose times are counted, because a rate was asked for or because
/// they evidently are.
std::optional<estimation::CountedShots> counted_shots(const recordings::Source& source,
                                                      recordings::ReadOptions options,
                                                      const sensors::Sensor& sensor,
                                                      const Progress& progress) {
  options.emitters = 0;  // beams as the file has them
  const auto reader = recordings::open_recording(source, options, progress);
  estimation::ShotSelector selector({.rate = std::nullopt, .ranges = false, .rows = true});
  EvenTimes even(sensor.shot_rate);
  recordings::Chunk chunk;
  bool named = false;
  try {
    while (reader->read(chunk)) {
      if (!options.shot_rate && !even.add(chunk)) return std::nullopt;
      selector.add(chunk.observations);
      const auto& beam = chunk.observations.beam;
      named = named || std::any_of(beam.begin(), beam.end(), [](auto one) { return one != 0; });
      progress.check();
    }
  } catch (const FileError&) {  // who reads on is told of it
  }
  const std::optional<double> rate = options.shot_rate ? options.shot_rate : even.rate();
  if (!rate) return std::nullopt;
  estimation::CountedShots shots{selector.take_series(), selector.rows(), *rate,
                                 !named && sensor.train.emitters() > 1};
  if (!options.shot_rate) even.count(shots.series.time_ns);
  return shots;
}

/// What the count of a recording's shots is worth.
estimation::ShotCount count_of(const estimation::CountedShots& shots, const sensors::Sensor& sensor,
                               const Progress& progress) {
  for (const std::uint8_t beam : shots.series.beam) {
    if (beam >= sensor.train.emitters()) return {};  // who reads on is told of it
  }
  return estimation::find_slips(shots, sensor, progress);
}

/// What was found wrong with a count, in words.
std::vector<std::string> count_words(const estimation::ShotCount& count, double rate, bool given) {
  std::vector<std::string> words;
  std::int64_t lost = 0;
  std::size_t mended = 0;
  for (const recordings::ShotSlip& slip : count.slips) {
    if (!slip.counted) {
      words.push_back(
          fmt::format("shots are missing before row {}, and the rotors do not show how many: the "
                      "recording was cut there",
                      slip.row));
      continue;
    }
    ++mended;
    lost += slip.shots;
  }
  if (mended > 0) {
    words.push_back(fmt::format(
        "{} gap{} in the shot count {} found ({} shots lost), and the times behind {} corrected",
        mended, mended == 1 ? "" : "s", mended == 1 ? "was" : "were", lost,
        mended == 1 ? "it" : "them"));
  }
  if (!words.empty() && !given) {
    words.push_back(fmt::format(
        "the times of the recording are evidently shot numbers: they were counted anew at "
        "{:.6g} shots per second",
        rate));
  }
  bool in_turn = true;
  std::string order;
  for (std::size_t i = 0; i < count.firing_order.size(); ++i) {
    in_turn = in_turn && count.firing_order[i] == i;
    order += fmt::format("{}{}", order.empty() ? "" : ", ", count.firing_order[i] + 1);
  }
  if (!in_turn) {
    words.push_back(fmt::format(
        "the file names no emitters: from its first shot on, they fire in the order {}", order));
  }
  return words;
}

std::string share_text(double share) { return fmt::format("{:.1f} %", 100.0 * share); }

/// The sensor whose rate counts the shots of a recording whose times are all the same, where it is
/// known.
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

/// What a recording without times lacks: only their rate, or shots; what is wrong with the shots
/// themselves comes first.
/// @throws recordings::MissingTimes, FileError for what is no scan, EstimationError where shots
/// were removed
[[noreturn]] void refuse_without_times(const recordings::Source& source,
                                       const recordings::ReadOptions& reading,
                                       recordings::Reader& reader, const Progress& progress) {
  constexpr double kAnyRate = 1e5;  // Hz
  recordings::ReadOptions counted = reading;
  counted.shot_rate = kAnyRate;
  const estimation::AngleSeries first = first_second(source, counted, progress);
  if (const auto problem = recordings::not_a_scan(first.azimuth, first.zenith, first.range)) {
    throw FileError(source.name(), {}, *problem);
  }
  const auto beyond =
      recordings::beyond_reach(first.range, recordings::kFarthestReach, "these sensors");
  UntimedShots shots;
  recordings::Chunk chunk;
  try {
    while (!shots.enough() && reader.read(chunk)) shots.add(chunk.observations);
  } catch (const FileError&) {  // what is wrong here comes first
  }
  const std::string words = shots.removed_words();
  if (!words.empty()) throw EstimationError(fmt::format("{}: {}", source.name(), words));
  try {
    recordings::require_times(reader.header());
  } catch (const recordings::MissingTimes& missing) {
    if (!beyond) throw;
    throw recordings::MissingTimes(fmt::format("{}. Besides, {}", *beyond, missing.what()));
  }
  throw EstimationError(fmt::format("{}: has no times", source.name()));
}

/// @throws EstimationError where shots are missing all over a recording whose shots were counted
void require_all_shots(const estimation::CountedShots& shots, const sensors::Sensor& sensor,
                       const std::string& name) {
  const auto words = removed_shots_words(shots, sensor.train.emitters());
  if (!words.empty()) throw EstimationError(fmt::format("{}: {}", name, words));
}

/// Opens a recording, chooses its sensor, and turns it back by the pose that it states where its
/// points were moved by it.
/// @param[in,out] reading  as asked for; on return with the pose
SensorFrameRecording open_by_stated_pose(const recordings::Source& source,
                                         recordings::ReadOptions& reading,
                                         const std::optional<sensors::Sensor>& given,
                                         const Progress& progress) {
  progress.check();
  SensorFrameRecording result{
      open_input(source, reading, progress), {}, {}, reading.extrinsics.has_value()};
  if (const auto sensor = sensor_to_count_by(result.reader->header(), reading, given)) {
    result.warnings.push_back(fmt::format(
        "all times of the recording are the same: shots were counted at the {:.6g} shots "
        "per second of {}",
        sensor->shot_rate, sensor->name));
    reading.shot_rate = sensor->shot_rate;
    result.reader = open_input(source, reading, progress);
  }
  if (!result.reader->header().has_times) {
    refuse_without_times(source, reading, *result.reader, progress);
  }
  result.choice = choose_sensor(source, reading, result.reader->header(), given, progress);
  require_possible(result.choice, source.name());
  result.warnings.insert(result.warnings.end(), result.choice.warnings.begin(),
                         result.choice.warnings.end());
  if (result.choice.times_at_fault) {
    reading.shot_rate = result.choice.sensor.shot_rate;
    result.reader = open_input(source, reading, progress);
  }
  const recordings::RecordingHeader& header = result.reader->header();
  if (reading.extrinsics || header.devices.size() != 1) return result;
  const recordings::Device& device = header.devices.front();
  const std::optional<Extrinsics> pose = recordings::stored_extrinsics(device);
  recordings::ReadOptions turned_back = reading;
  if (!pose) {
    if (result.choice.roll == 0) return result;
    reading.extrinsics = roll_about_axis(result.choice.roll, result.choice.frame);
    result.reader = open_input(source, reading, progress);
    result.turned_back = true;
    result.warnings.push_back(fmt::format(
        "the recording is rotated about the optical axis by {:.1f} deg, as the positions of the "
        "sensor's emitters show: the shots were turned back by that angle",
        degrees_from_radians(result.choice.roll)));
    return result;
  }
  turned_back.extrinsics = pose;
  const estimation::StoredPoseVerdict verdict = estimation::judge_stored_pose(
      first_second(source, reading, progress), first_second(source, turned_back, progress),
      result.choice.sensor.field_of_view);
  const std::string found = fmt::format(
      "the recording states a pose of its sensor ({}); of the shots, {} lie outside the sensor's "
      "field of view as recorded and {} after turning them back",
      pose_text(*pose), share_text(verdict.outside_as_recorded),
      share_text(verdict.outside_turned_back));
  const bool by_hub =
      !device.hub_serial.empty() && verdict.outside_turned_back <= verdict.outside_as_recorded;
  const bool decided = verdict.use != StoredPoseUse::undecided;
  result.turned_back = decided ? verdict.use == StoredPoseUse::applied : by_hub;
  if (result.turned_back) {
    reading = turned_back;
    result.reader = open_input(source, reading, progress);
  }
  if (decided && result.turned_back) {
    result.warnings.push_back(found + ": the shots were turned back into the sensor's frame");
  } else if (!decided) {
    result.warnings.push_back(
        fmt::format("{}: that does not show whether the pose was applied to them; {}. Option "
                    "extrinsics decides it: "
                    "give the pose, or 0,0,0 for shots in the sensor's frame",
                    found,
                    result.turned_back ? "they were turned back, because a hub recorded them"
                                       : "they were taken as they are"));
  }
  return result;
}

/// Opens a recording whose packets lack points: shots cannot be counted in it, but packets have
/// their times.
SensorFrameRecording open_with_places(const recordings::Source& source,
                                      recordings::ReadOptions reading,
                                      const std::optional<sensors::Sensor>& given,
                                      PacketRecording packets, const Progress& progress) {
  const bool given_pose = reading.extrinsics.has_value();
  const std::optional<double> given_rate = std::exchange(reading.shot_rate, std::nullopt);
  reading.packet_places = packets.middle_places();
  SensorFrameRecording result = open_by_stated_pose(source, reading, given, progress);
  if (reading.extrinsics && !given_pose)
    packets = *PacketRecording::open(source, reading, progress);
  PlacedRows placed =
      packets.place_rows(result.choice.sensor, given_rate, UntoldShots::left_out, progress);
  result.warnings.insert(result.warnings.end(), placed.words.begin(), placed.words.end());
  result.cut_mended = placed.places.cut_coordinates;
  reading.packet_places = std::move(placed.places);
  result.reader = open_input(source, reading, progress);
  return result;
}

}  // namespace

SensorFrameRecording open_in_sensor_frame(const recordings::Source& source,
                                          const recordings::ReadOptions& options,
                                          const std::optional<sensors::Sensor>& asked_for,
                                          const Progress& progress) {
  recordings::ReadOptions reading = options;
  if (auto packets = PacketRecording::open(source, reading, progress)) {
    return open_with_places(source, reading, asked_for, *std::move(packets), progress);
  }
  SensorFrameRecording result = open_by_stated_pose(source, reading, asked_for, progress);
  const sensors::Sensor& sensor = result.choice.sensor;
  const bool given = reading.shot_rate.has_value();
  if (result.reader->header().devices.size() != 1) {  // nobody knows whose shots are missing
    if (given && sensor.train.emitters() > 1) {
      reading.emitters = sensor.train.emitters();
      reading.firing_order = estimation::emitters_in_order(result.choice.order, reading.emitters);
      result.reader = open_input(source, reading, progress);
    }
    return result;
  }
  const auto shots = counted_shots(source, reading, sensor, progress);
  if (!shots) return result;
  require_all_shots(*shots, sensor, source.name());
  reading.shot_rate = shots->shot_rate;
  reading.emitters = sensor.train.emitters();
  estimation::ShotCount count = count_of(*shots, sensor, progress);
  if (!given && count.slips.empty() && count.firing_order.empty()) return result;
  const auto words = count_words(count, *reading.shot_rate, given);
  result.warnings.insert(result.warnings.end(), words.begin(), words.end());
  reading.slips = std::move(count.slips);
  reading.firing_order =
      count.firing_order.empty() && sensor.train.emitters() > 1
          ? estimation::emitters_in_order(result.choice.order, sensor.train.emitters())
          : std::move(count.firing_order);
  result.reader = open_input(source, reading, progress);
  return result;
}

EstimationInput read_for_estimation(const EstimationInputOptions& options,
                                    const Progress& progress) {
  const Stopwatch watch;
  const recordings::Source& source = options.recording;
  SensorFrameRecording input =
      open_in_sensor_frame(source, options.reading, given_sensor(options.sensor), progress);
  recordings::Reader& reader = *input.reader;
  recordings::require_one_device(reader.header(), source.name());
  EstimationInput result;
  result.whole_steps = reader.header().cartesian && !input.turned_back && !input.cut_mended;
  estimation::SelectionOptions selection = options.selection;
  selection.ranges = options.selection.ranges || result.whole_steps;
  estimation::ShotSelector selector(selection);
  recordings::TimeAudit audit;
  // While some chunks are looked at, the next are read.
  std::array<recordings::Chunk, 4> chunks;
  const auto read_next = [&](std::size_t slot) {
    if (!reader.read(chunks[slot])) return false;
    progress.report(reader.fraction_read());
    return true;
  };
  using Order = parallel::Stage::Order;
  parallel::run_pipeline(chunks.size(), read_next,
                         {{Order::in_turn, [&](std::size_t slot) { audit.add(chunks[slot]); }},
                          {Order::in_turn, [&](std::size_t slot) {
                             selector.add(chunks[slot].observations);
                             result.series.append(selector.take_series());
                           }}});
  result.recording = {source.name(), reader.header(), audit.result()};
  for (const auto& warning : reader.warnings()) result.warnings.push_back(warning_text(warning));
  result.warnings.insert(result.warnings.end(), input.warnings.begin(), input.warnings.end());
  result.choice = std::move(input.choice);
  result.counts = selector.counts();
  add_left_out_words(result.counts, result.warnings);
  if (result.counts.clock_resets > 0) {
    result.warnings.push_back(
        fmt::format("the clock of the recording jumps back {} times: the pieces share their "
                    "parameters, and in each the rotors are found anew",
                    result.counts.clock_resets));
  }
  result.head = selector.head();
  result.reading_time = watch.seconds();
  return result;
}

std::string removed_shots_words(const estimation::CountedShots& shots, int emitters) {
  const double rows = estimation::rows_between_jumps(shots, emitters);
  // Where a packet is missing now and then, rotors can be followed from one to the next.
  constexpr double kFewest = 1000;
  if (rows >= kFewest) return {};
  return fmt::format(
      "shots without a return were removed from this file, which has no times: about every {:.0f} "
      "rows the beam jumps, and how many shots are missing there, so when each was fired, is lost. "
      "Directions and ranges hold all the same: they can be looked at, converted, and made a "
      "cloud. "
      "An estimation needs the recording with times of single shots, or with shots without a "
      "return "
      "kept as 0 0 0, or what it was exported from (LVX, a capture, or a bag of CustomMsg)",
      rows);
}

std::string UntimedShots::removed_words() {
  const estimation::CountedShots shots{selector_.take_series(), selector_.rows(), 0, false};
  return removed_shots_words(shots, estimation::emitters_in_turn(shots));
}

void add_left_out_words(const estimation::SelectionCounts& counts,
                        std::vector<std::string>& words) {
  if (counts.out_of_order > 0) {
    words.push_back(fmt::format(
        "{} of {} shots are a little earlier than the shot before and were left out: packets came "
        "late",
        counts.out_of_order, counts.rows));
  }
  if (counts.equal_times > 0) {
    words.push_back(
        fmt::format("{} of {} shots have the time of the shot before, so that nobody knows when "
                    "they were fired, and were left out: {} counts shots, where none is missing",
                    counts.equal_times, counts.rows, name_of(kSetting.shot_rate)));
  }
}

std::string warning_text(const recordings::ReadWarning& warning) {
  std::string text = warning.message;
  if (warning.place.byte_offset) text += fmt::format(" (at byte {})", *warning.place.byte_offset);
  if (warning.place.line) text += fmt::format(" (line {})", *warning.place.line);
  return text;
}

std::string pose_text(const Extrinsics& pose) {
  return fmt::format("yaw {:.6g} pitch {:.6g} roll {:.6g} deg, translation {:.6g} {:.6g} {:.6g} m",
                     degrees_from_radians(pose.yaw), degrees_from_radians(pose.pitch),
                     degrees_from_radians(pose.roll), pose.translation.x, pose.translation.y,
                     pose.translation.z);
}

}  // namespace risley::jobs
