// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "jobs/packet_recording.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

#include "risley/core/error.hpp"

namespace risley::jobs {
namespace {

using recordings::kNoPlace;

/// Shots of fewer packets do not reveal the rotors.
constexpr std::size_t kFewestPackets = 10;

}  // namespace

std::optional<PacketRecording> PacketRecording::open(const PreparedRecording& recording,
                                                     const Progress& progress) {
  recordings::ReadOptions as_it_is;
  as_it_is.extrinsics = recording.reading.extrinsics;
  if (recording.reader->header().devices.size() != 1) return std::nullopt;
  const auto reader = recordings::open_recording(recording.source, as_it_is, progress);
  if (reader->header().packet_shots == 0) return std::nullopt;
  const auto variance = [](float step) { return step * step / 12.0F; };
  PacketRecording result;
  estimation::PacketShots& shots = result.shots_;
  shots.places = reader->header().packet_shots;
  shots.cartesian = reader->header().cartesian && !as_it_is.extrinsics;
  recordings::Chunk chunk;
  while (reader->read_sound(chunk)) {
    const recordings::Observations& rows = chunk.observations;
    auto begin = chunk.packet_begins.begin();
    for (std::size_t row = 0; row < rows.size(); ++row) {
      if (begin != chunk.packet_begins.end() && *begin == row) {
        result.first_row_.push_back(result.index_.size());
        shots.packets.push_back({rows.time_ns[row], 0});
        ++begin;
      }
      const bool is_new = rows.return_number[row] <= 1 || shots.packets.back().shots == 0;
      if (is_new) ++shots.packets.back().shots;
      result.index_.push_back(static_cast<std::uint8_t>(shots.packets.back().shots - 1));
      result.last_beam_ = std::max(result.last_beam_, rows.beam[row]);
      if (!is_new || rows.valid[row] == 0) continue;
      shots.series.append(rows.time_ns[row], rows.azimuth[row], rows.zenith[row], 0,
                          variance(rows.azimuth_resolution[row]),
                          variance(rows.zenith_resolution[row]));
      shots.packet.push_back(shots.packets.size() - 1);
      shots.precedent.push_back(result.index_.back());
    }
    progress.check();
  }
  if (!result.lacks_points()) return std::nullopt;
  return result;
}

bool PacketRecording::lacks_points() const {
  for (std::size_t packet = 0; packet + 1 < shots_.packets.size(); ++packet) {
    if (!shots_.is_whole(packet)) return true;
  }
  return false;
}

std::size_t PacketRecording::whole_packets() const {
  std::size_t count = 0;
  for (std::size_t packet = 0; packet < shots_.packets.size(); ++packet) {
    count += shots_.is_whole(packet) ? 1 : 0;
  }
  return count;
}

recordings::PacketPlaces PacketRecording::places_of_rows(
    const std::vector<std::uint8_t>& place, double shot_rate,
    std::vector<std::uint8_t> firing_order) const {
  recordings::PacketPlaces result{std::vector<std::uint8_t>(index_.size(), kNoPlace), shot_rate,
                                  std::move(firing_order), false};
  std::size_t shot = 0;
  for (std::size_t packet = 0; packet < shots_.packets.size(); ++packet) {
    std::array<std::uint8_t, kNoPlace> of_index{};
    of_index.fill(kNoPlace);
    for (std::uint8_t i = 0; shots_.is_whole(packet) && i < shots_.places; ++i) of_index[i] = i;
    for (; shot < place.size() && shots_.packet[shot] == packet; ++shot) {
      of_index[shots_.precedent[shot]] = place[shot];
    }
    const std::size_t end =
        packet + 1 < shots_.packets.size() ? first_row_[packet + 1] : index_.size();
    for (std::size_t row = first_row_[packet]; row < end; ++row) {
      result.of_row[row] = of_index[index_[row]];
    }
  }
  return result;
}

recordings::PacketPlaces PacketRecording::middle_places() const {
  const double usual_rate = last_beam_ > 0 ? 240e3 : 100e3;
  std::vector<std::uint8_t> in_turn;
  for (int beam = 0; beam <= last_beam_; ++beam) {
    in_turn.push_back(static_cast<std::uint8_t>(beam));
  }
  return places_of_rows(estimation::guess_places(shots_).place, usual_rate, std::move(in_turn));
}

PlacedRows PacketRecording::place_rows(const sensors::Sensor& sensor,
                                       std::optional<double> shot_rate, UntoldShots untold,
                                       const Progress& progress) const {
  const double rate = shot_rate ? *shot_rate : estimation::shot_rate_of(shots_, sensor);
  estimation::ShotPlaces found = estimation::find_places(shots_, rate, sensor, progress);
  const std::size_t packets = shots_.packets.size(), whole = whole_packets();
  const auto unknown =
      static_cast<std::size_t>(std::count(found.place.begin(), found.place.end(), kNoPlace));
  const std::size_t known = found.place.size() - unknown;
  const std::string lacking =
      fmt::format("points are missing in {} of {} packets, and the file does not say which",
                  packets - whole, packets);
  const std::string remedy =
      "export the recording again without cropping or filtering it, or use the recording that it "
      "was exported from";
  PlacedRows result;
  if (found.followed) {
    warn(result.warnings, kWarning.packets_incomplete,
         "{}: the rotors were followed, which shows when each of {} shots was fired; {} shots that "
         "fit two places in their packet are not used",
         lacking, known, unknown);
  } else if (untold == UntoldShots::guessed) {
    estimation::GuessedPlaces guess = estimation::guess_places(shots_, found.place);
    found.place = std::move(guess.place);
    result.time_uncertainty = guess.most_off / rate;
    warn(result.warnings, kWarning.times_guessed,
         "{}: they do not show how the rotors of the sensor {} turned. The times of {} of {} shots "
         "are guessed, in their order, and may be off by up to {:.2g} ms; {}",
         lacking, sensor.name, unknown, known + unknown, 1e3 * result.time_uncertainty, remedy);
  } else if (known < kFewestPackets * static_cast<std::size_t>(shots_.places)) {
    throw EstimationError(fmt::format(
        "{}: when the shots were fired is unknown, because they do not show how the rotors of the "
        "sensor {} turned. The places of {} shots are known without that, in {} whole packets and "
        "in runs that continue from packet to packet; at least {} are needed; {}",
        lacking, sensor.name, known, whole,
        kFewestPackets * static_cast<std::size_t>(shots_.places), remedy));
  } else {
    warn(result.warnings, kWarning.shots_unused,
         "{}: they do not show how the rotors of the sensor {} turned. Only {} of {} shots are "
         "used, whose places are known without that, in {} whole packets and in runs that continue "
         "from packet to packet; {}",
         lacking, sensor.name, known, known + unknown, whole, remedy);
  }
  if (shot_rate) {
    warn(result.warnings, kWarning.packets_incomplete,
         "shots cannot be counted where points are missing: the packets keep their times, and "
         "{:.6g} shots per second hold within a packet only",
         *shot_rate);
  }
  if (found.cut_coordinates) {
    warn(result.warnings, kWarning.coordinates_cut,
         "the coordinates of the points were evidently truncated towards zero, not rounded: half a "
         "step was added back");
  }
  result.places = places_of_rows(found.place, rate, std::move(found.firing_order));
  result.places.cut_coordinates = found.cut_coordinates;
  return result;
}

}  // namespace risley::jobs
