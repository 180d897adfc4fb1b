// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/estimation/angle_series.hpp"
#include "risley/recordings/reader.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::estimation {

/// The shots of a recording that has one time for each packet and keeps the order of the shots, but
/// not the places of missing ones.
struct PacketShots {
  /// Time and number of shots of one packet.
  struct OnePacket {
    std::int64_t time_ns = 0;  ///< of its first place
    std::uint8_t shots = 0;    ///< of it in the file
  };
  int places = 0;                       ///< of a whole packet, up to 254
  bool cartesian = false;               ///< directions come from coordinates in whole steps
  std::vector<OnePacket> packets;       ///< in the order of the recording
  AngleSeries series;                   ///< valid shots; their times and beams are ignored
  std::vector<std::size_t> packet;      ///< of each
  std::vector<std::uint8_t> precedent;  ///< shots of its packet in the file before each

  /// Whether a packet is complete.
  bool is_whole(std::size_t one) const { return packets[one].shots == places; }
};

/// Result of the search for the places of shots.
struct ShotPlaces {
  /// The rotors could be followed; otherwise only evident places are known.
  bool followed = false;
  std::vector<std::uint8_t> place;         ///< of each shot, or recordings::kNoPlace
  std::vector<std::uint8_t> firing_order;  ///< emitter of places 0, 1, ...; one entry per emitter
  /// The shots fit better as points with truncated coordinates than as rounded ones.
  bool cut_coordinates = false;
};

/// Shots per second within packets, Hz: places of a packet over the time from one packet to the
/// next, if enough follow each other; the sensor's otherwise.
double shot_rate_of(const PacketShots& shots, const sensors::Sensor& sensor);

/// Places of all shots, some of them guesses.
struct GuessedPlaces {
  std::vector<std::uint8_t> place;  ///< of each shot, ascending within a packet
  double most_off = 0;              ///< possible error of a guess, places
};

/// The known places, and for every other shot the middle of those that its order allows: good
/// enough for a first look at a recording.
/// @param known  of each shot, or recordings::kNoPlace; none: no place is known
/// @throws InvalidArgument as find_places(), and for known places that contradict the order
GuessedPlaces guess_places(const PacketShots& shots, const std::vector<std::uint8_t>& known = {});

/// Finds the places of the shots. Those of complete packets are evident, and those of a single
/// emitter's runs of shots that continue smoothly from packet to packet; if there are enough they
/// determine optics and rotors. Otherwise packets of several emitters that lack few shots
/// determine, each separately, the angles of the rotors, the order of the emitters and their shots'
/// places, because neighbouring shots are far apart. From there the rotors are followed from packet
/// to packet in both directions, and each packet gets its likeliest places in ascending order; a
/// shot that fits another place nearly as well gets none. docs/theory/slips.md
/// @param shot_rate  within packets, Hz
/// @throws InvalidArgument for columns of different lengths, more shots than places, a rate not
/// above 0
ShotPlaces find_places(const PacketShots& shots, double shot_rate, const sensors::Sensor& sensor,
                       const Progress& progress = {});

}  // namespace risley::estimation
