// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/estimation/packet_places.hpp"
#include "risley/jobs/prepared_recording.hpp"
#include "risley/recordings/reader.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::jobs {

/// Firing times of the rows of a recording, as far as known.
struct PlacedRows {
  recordings::PacketPlaces places;
  std::vector<Warning> warnings;  ///< treatment of missing points
  double time_uncertainty = 0;    ///< possible error of guessed times, s; 0: there are none
};

/// A recording of one sensor with one time for each packet, some of which lack points: all of its
/// shots, and its rows.
class PacketRecording {
 public:
  /// Empty for any other recording. One may end within a packet.
  static std::optional<PacketRecording> open(const PreparedRecording& recording,
                                             const Progress& progress);

  /// Puts every shot in the middle of its possible places, to within a few degrees of the rotors:
  /// good enough for a first look at the recording.
  recordings::PacketPlaces middle_places() const;

  /// Follows the rotors to find when each shot was fired.
  /// @param shot_rate  within packets, Hz, if it was given
  /// @throws EstimationError when hardly any shots remain after dropping those without a time
  PlacedRows place_rows(const sensors::Sensor& sensor, std::optional<double> shot_rate,
                        UntoldShots untold, const Progress& progress) const;

 private:
  bool lacks_points() const;
  std::size_t whole_packets() const;
  recordings::PacketPlaces places_of_rows(const std::vector<std::uint8_t>& place, double shot_rate,
                                          std::vector<std::uint8_t> firing_order) const;

  estimation::PacketShots shots_;
  std::vector<std::size_t> first_row_;  // of each packet
  std::vector<std::uint8_t> index_;     // of each row's shot among those of its packet in the file
  std::uint8_t last_beam_ = 0;          // as the kind of packets says
};

}  // namespace risley::jobs
