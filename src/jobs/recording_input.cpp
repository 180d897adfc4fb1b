// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/recording_input.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/estimation/packet_places.hpp"
#include "risley/estimation/shot_slips.hpp"
#include "risley/estimation/stored_pose.hpp"
#include "risley/jobs/sensor_choice.hpp"

#include "jobs/open_input.hpp"
#include "jobs/stopwatch.hpp"

namespace risley::jobs {
namespace {

using estimation::StoredPoseUse;
using recordings::Extrinsics;

/// Fewer tell nothing of rotors.
constexpr std::size_t kFewestWholePackets = 10;

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
std::optional<estimation::CountedShots> counted_shots(const std::string& path,
                                                      recordings::ReadOptions options,
                                                      const sensors::Sensor& sensor,
                                                      const Progress& progress) {
  options.emitters = 0;  // beams as the file has them
  const auto reader = recordings::open_recording(path, options, progress);
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
      words.push_back(fmt::format(
          "shots are missing before row {}, and the rotors do not tell how many: the recording was "
          "cut there",
          slip.row));
      continue;
    }
    ++mended;
    lost += slip.shots;
  }
  if (mended > 0) {
    words.push_back(fmt::format(
        "{} slip{} of the shot count {} found ({} shots lost) and the times behind {} mended",
        mended, mended == 1 ? "" : "s", mended == 1 ? "was" : "were", lost,
        mended == 1 ? "it" : "them"));
  }
  if (!words.empty() && !given) {
    words.push_back(
        fmt::format("the times of the recording are evidently counted: they were counted anew, "
                    "{:.6g} shots per "
                    "second",
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
        "the file names no emitters: from its first shot on they fire in the order {}", order));
  }
  return words;
}

/// All shots of a recording with one time for each packet, and its rows.
struct PacketRecording {
  estimation::PacketShots shots;
  std::vector<std::size_t> first_row;  ///< of each packet
  std::vector<std::uint8_t> index;     ///< of each row's shot among those of its packet in the file
  std::uint8_t last_beam = 0;          ///< as the kind of packets says

  /// A recording may end within a packet.
  bool lacks_points() const {
    for (std::size_t packet = 0; packet + 1 < shots.packets.size(); ++packet) {
      if (!shots.is_whole(packet)) return true;
    }
    return false;
  }
  std::size_t whole_packets() const {
    std::size_t count = 0;
    for (std::size_t packet = 0; packet < shots.packets.size(); ++packet) {
      count += shots.is_whole(packet) ? 1 : 0;
    }
    return count;
  }
};

/// Empty for other recordings and those of several sensors.
std::optional<PacketRecording> packet_recording(const std::string& path,
                                                const recordings::ReadOptions& options,
                                                const Progress& progress) {
  recordings::ReadOptions as_it_is;
  as_it_is.extrinsics = options.extrinsics;
  const auto reader = recordings::open_recording(path, as_it_is, progress);
  if (reader->header().packet_shots == 0 || reader->header().devices.size() != 1) {
    return std::nullopt;
  }
  const auto variance = [](float step) { return step * step / 12.0F; };
  PacketRecording result;
  estimation::PacketShots& shots = result.shots;
  shots.places = reader->header().packet_shots;
  shots.cartesian = reader->header().cartesian && !options.extrinsics;
  recordings::Chunk chunk;
  try {
    while (reader->read(chunk)) {
      const recordings::Observations& rows = chunk.observations;
      auto begin = chunk.packet_begins.begin();
      for (std::size_t row = 0; row < rows.size(); ++row) {
        if (begin != chunk.packet_begins.end() && *begin == row) {
          result.first_row.push_back(result.index.size());
          shots.packets.push_back({rows.time_ns[row], 0});
          ++begin;
        }
        const bool is_new = rows.return_number[row] <= 1 || shots.packets.back().shots == 0;
        if (is_new) ++shots.packets.back().shots;
        result.index.push_back(static_cast<std::uint8_t>(shots.packets.back().shots - 1));
        result.last_beam = std::max(result.last_beam, rows.beam[row]);
        if (!is_new || rows.valid[row] == 0) continue;
        shots.series.append(rows.time_ns[row], rows.azimuth[row], rows.zenith[row], 0,
                            variance(rows.azimuth_resolution[row]),
                            variance(rows.zenith_resolution[row]));
        shots.packet.push_back(shots.packets.size() - 1);
        shots.precedent.push_back(result.index.back());
      }
      progress.check();
    }
  } catch (const FileError&) {  // who reads on is told of it
  }
  return result;
}

/// Places of all rows from those of shots.
recordings::PacketPlaces places_of_rows(const PacketRecording& recording,
                                        const std::vector<std::uint8_t>& place, double shot_rate,
                                        std::vector<std::uint8_t> firing_order) {
  const estimation::PacketShots& shots = recording.shots;
  recordings::PacketPlaces result{
      std::vector<std::uint8_t>(recording.index.size(), recordings::kNoPlace), shot_rate,
      std::move(firing_order), false};
  std::size_t shot = 0;
  for (std::size_t packet = 0; packet < shots.packets.size(); ++packet) {
    std::array<std::uint8_t, recordings::kNoPlace> of_index{};
    of_index.fill(recordings::kNoPlace);
    for (std::uint8_t i = 0; shots.is_whole(packet) && i < shots.places; ++i) of_index[i] = i;
    for (; shot < place.size() && shots.packet[shot] == packet; ++shot) {
      of_index[shots.precedent[shot]] = place[shot];
    }
    const std::size_t end = packet + 1 < shots.packets.size() ? recording.first_row[packet + 1]
                                                              : recording.index.size();
    for (std::size_t row = recording.first_row[packet]; row < end; ++row) {
      result.of_row[row] = of_index[recording.index[row]];
    }
  }
  return result;
}

/// What was done about packets that lack points, in words.
/// @throws EstimationError when nothing is left
std::string places_words(const PacketRecording& recording, const estimation::ShotPlaces& found,
                         const std::string& sensor) {
  const std::size_t packets = recording.shots.packets.size(), whole = recording.whole_packets();
  const auto left_out = static_cast<std::size_t>(
      std::count(found.place.begin(), found.place.end(), recordings::kNoPlace));
  const std::string lacking =
      fmt::format("points are missing in {} of {} packets, and the file does not say which",
                  packets - whole, packets);
  if (found.followed) {
    return fmt::format(
        "{}: the rotors were followed and tell when each of {} shots was fired; {} that fit two "
        "places in their packet are left out",
        lacking, found.place.size() - left_out, left_out);
  }
  const std::string remedy =
      "export the recording again without cropping or filtering it, or use the recording that it "
      "was exported from";
  if (whole < kFewestWholePackets) {
    throw EstimationError(fmt::format(
        "{}: when the shots were fired is unknown, because they do not tell the rotors of the "
        "sensor {}, and {} whole packets are too few; {}, or say with option sensor which sensor "
        "it was",
        lacking, sensor, whole, remedy));
  }
  return fmt::format(
      "{}: they do not tell the rotors of the sensor {}, and only the {} shots of the {} whole "
      "packets are "
      "used; {}",
      lacking, sensor, found.place.size() - left_out, whole, remedy);
}

std::string share_text(double share) { return fmt::format("{:.1f} %", 100.0 * share); }

/// Opens a recording, chooses its sensor, and turns it back by the pose that it states where its
/// points were moved by it.
/// @param[in,out] reading  as asked for; on return with the pose
SensorFrameRecording open_by_stated_pose(const std::string& path, recordings::ReadOptions& reading,
                                         const std::optional<sensors::Sensor>& given,
                                         const Progress& progress) {
  progress.check();
  SensorFrameRecording result{
      open_input(path, reading, progress), {}, {}, reading.extrinsics.has_value()};
  recordings::require_times(result.reader->header());
  result.choice = choose_sensor(path, reading, result.reader->header(), given, progress);
  result.warnings = result.choice.warnings;
  const recordings::RecordingHeader& header = result.reader->header();
  if (reading.extrinsics || header.devices.size() != 1) return result;
  const recordings::Device& device = header.devices.front();
  const std::optional<Extrinsics> pose = recordings::stored_extrinsics(device);
  recordings::ReadOptions turned_back = reading;
  if (!pose) {
    if (result.choice.roll == 0) return result;
    reading.extrinsics = roll_about_axis(result.choice.roll, result.choice.frame);
    result.reader = open_input(path, reading, progress);
    result.turned_back = true;
    result.warnings.push_back(fmt::format(
        "the recording is rolled about the optical axis by {:.1f} deg, as the sensor's emitters "
        "show: the shots were turned back by that",
        degrees_from_radians(result.choice.roll)));
    return result;
  }
  turned_back.extrinsics = pose;
  const estimation::StoredPoseVerdict verdict = estimation::judge_stored_pose(
      first_second(path, reading, progress), first_second(path, turned_back, progress),
      result.choice.sensor.field_of_view);
  const std::string found = fmt::format(
      "the recording states a pose of its sensor ({}); outside the sensor's field of "
      "view lie {} of the shots as recorded and {} after turning back",
      pose_text(*pose), share_text(verdict.outside_as_recorded),
      share_text(verdict.outside_turned_back));
  const bool by_hub =
      !device.hub_serial.empty() && verdict.outside_turned_back <= verdict.outside_as_recorded;
  const bool decided = verdict.use != StoredPoseUse::undecided;
  result.turned_back = decided ? verdict.use == StoredPoseUse::applied : by_hub;
  if (result.turned_back) {
    reading = turned_back;
    result.reader = open_input(path, reading, progress);
  }
  if (decided && result.turned_back) {
    result.warnings.push_back(found + ": the shots were turned back into the sensor's frame");
  } else if (!decided) {
    result.warnings.push_back(fmt::format(
        "{}: that does not tell whether they were moved by it; {}. Option extrinsics says it: the "
        "pose, or 0,0,0 for shots in the sensor's frame",
        found,
        result.turned_back ? "they were turned back, because a hub recorded them"
                           : "they were taken as they are"));
  }
  return result;
}

/// Opens a recording whose packets lack points: shots cannot be counted in it, but packets have
/// their times.
SensorFrameRecording open_with_places(const std::string& path, recordings::ReadOptions reading,
                                      const std::optional<sensors::Sensor>& given,
                                      PacketRecording packets, const Progress& progress) {
  const std::optional<double> given_rate = std::exchange(reading.shot_rate, std::nullopt);
  const bool given_pose = reading.extrinsics.has_value();
  // The middle of the places that a shot may have is no worse than a few degrees of the rotors.
  const double usual_rate = packets.last_beam > 0 ? 240e3 : 100e3;
  std::vector<std::uint8_t> in_turn;
  for (int beam = 0; beam <= packets.last_beam; ++beam) {
    in_turn.push_back(static_cast<std::uint8_t>(beam));
  }
  reading.packet_places = places_of_rows(packets, estimation::middle_places(packets.shots),
                                         usual_rate, std::move(in_turn));
  SensorFrameRecording result = open_by_stated_pose(path, reading, given, progress);
  const sensors::Sensor& sensor = result.choice.sensor;
  if (reading.extrinsics && !given_pose) packets = *packet_recording(path, reading, progress);
  const double rate = given_rate ? *given_rate : estimation::shot_rate_of(packets.shots, sensor);
  estimation::ShotPlaces found = estimation::find_places(packets.shots, rate, sensor, progress);
  result.warnings.push_back(places_words(packets, found, sensor.name));
  if (given_rate) {
    result.warnings.push_back(
        fmt::format("shots cannot be counted where points are missing: the packets keep their "
                    "times, and {:.6g} "
                    "shots per second are those within a packet",
                    rate));
  }
  if (found.cut_coordinates) {
    result.warnings.push_back(
        "the shots fit better as points whose coordinates were cut off towards zero than as "
        "rounded "
        "ones: half a step was put back");
  }
  reading.packet_places = places_of_rows(packets, found.place, rate, std::move(found.firing_order));
  reading.packet_places->cut_coordinates = result.cut_mended = found.cut_coordinates;
  result.reader = open_input(path, reading, progress);
  return result;
}

}  // namespace

SensorFrameRecording open_in_sensor_frame(const std::string& path,
                                          const recordings::ReadOptions& options,
                                          const std::optional<sensors::Sensor>& asked_for,
                                          const Progress& progress) {
  recordings::ReadOptions reading = options;
  auto packets = packet_recording(path, reading, progress);
  if (packets && packets->lacks_points()) {
    return open_with_places(path, reading, asked_for, *std::move(packets), progress);
  }
  packets.reset();
  SensorFrameRecording result = open_by_stated_pose(path, reading, asked_for, progress);
  const sensors::Sensor& sensor = result.choice.sensor;
  const bool given = reading.shot_rate.has_value();
  if (result.reader->header().devices.size() != 1) {  // nobody knows whose shots are missing
    if (given && sensor.train.emitters() > 1) {
      reading.emitters = sensor.train.emitters();
      reading.firing_order = estimation::emitters_in_order(result.choice.order, reading.emitters);
      result.reader = open_input(path, reading, progress);
    }
    return result;
  }
  const auto shots = counted_shots(path, reading, sensor, progress);
  if (!shots) return result;
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
  result.reader = open_input(path, reading, progress);
  return result;
}

EstimationInput read_for_estimation(const EstimationInputOptions& options,
                                    const Progress& progress) {
  const Stopwatch watch;
  const std::string& path = options.recording;
  SensorFrameRecording input =
      open_in_sensor_frame(path, options.reading, given_sensor(options.sensor), progress);
  recordings::Reader& reader = *input.reader;
  if (reader.header().devices.size() > 1) {
    throw InvalidArgument(
        fmt::format("{} holds {} sensors, an estimation takes the recording of one", path,
                    reader.header().devices.size()));
  }
  EstimationInput result;
  result.whole_steps = reader.header().cartesian && !input.turned_back && !input.cut_mended;
  estimation::ShotSelector selector(options.selection);
  recordings::TimeAudit audit;
  recordings::Chunk chunk;
  while (reader.read(chunk)) {
    audit.add(chunk);
    selector.add(chunk.observations);
    progress.report(reader.fraction_read());
  }
  result.recording = {path, reader.header(), audit.result()};
  for (const auto& warning : reader.warnings()) result.warnings.push_back(warning_text(warning));
  result.warnings.insert(result.warnings.end(), input.warnings.begin(), input.warnings.end());
  result.choice = std::move(input.choice);
  result.counts = selector.counts();
  if (result.counts.clock_resets > 0) {
    result.warnings.push_back(
        fmt::format("the clock of the recording jumps back {} times: the "
                    "pieces share the parameters, and their rotors are found "
                    "anew",
                    result.counts.clock_resets));
  }
  result.head = selector.head();
  result.series = selector.take_series();
  result.reading_time = watch.seconds();
  return result;
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
