// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "risley/core/require.hpp"
#include "risley/recordings/cut_coordinates.hpp"

#include "recordings/reader_decorators.hpp"

namespace risley::recordings {
namespace {

/// Gives every row the time of its place in its packet.
class PlacingReader final : public DecoratingReader {
 public:
  PlacingReader(std::unique_ptr<Reader> inner, PacketPlaces places)
      : DecoratingReader(std::move(inner)), places_(std::move(places)) {
    take_over();
  }

 private:
  void describe() override {
    std::erase_if(warnings_,
                  [](const Warning& one) { return one.code == kWarning.packets_incomplete; });
  }

  std::optional<FileError> change(Chunk& chunk) override {
    Observations& rows = chunk.observations;
    auto begin = chunk.packet_begins.begin();
    for (std::size_t row = 0; row < rows.size(); ++row, ++rows_read_) {
      if (begin != chunk.packet_begins.end() && *begin == row) {
        packet_time_ns_ = rows.time_ns[row];
        last_place_ = 0;
        ++begin;
      }
      const std::uint8_t place =
          rows_read_ < places_.of_row.size() ? places_.of_row[rows_read_] : kNoPlace;
      if (place == kNoPlace) {
        rows.valid[row] = 0;
        rows.azimuth[row] = rows.zenith[row] = std::numeric_limits<double>::quiet_NaN();
      } else {
        last_place_ = place;
        if (places_.cut_coordinates && rows.range[row] > 0) {
          rows.range[row] *= move_to_middle_of_cut(static_cast<double>(rows.zenith_resolution[row]),
                                                   rows.azimuth[row], rows.zenith[row]);
        }
      }
      rows.time_ns[row] = packet_time_ns_ + std::llround(last_place_ * 1e9 / places_.shot_rate);
      rows.beam[row] = places_.firing_order[last_place_ % places_.firing_order.size()];
    }
    return std::nullopt;
  }

  PacketPlaces places_;
  std::uint64_t rows_read_ = 0;
  std::int64_t packet_time_ns_ = 0;
  std::uint8_t last_place_ = 0;  // of the present packet
};

}  // namespace

std::unique_ptr<Reader> with_packet_places(std::unique_ptr<Reader> reader,
                                           const ReadOptions& options) {
  const RecordingHeader& header = reader->header();
  if (header.packet_shots == 0 || header.devices.size() != 1 || options.shot_rate) {
    throw InvalidArgument(fmt::format(
        "ReadOptions::packet_places is given for a recording of format {} and {} sensors{}, "
        "allowed for one sensor, with one time for each packet and without a shot rate",
        header.format, header.devices.size(), options.shot_rate ? " with a shot rate" : ""));
  }
  require_above("ReadOptions::packet_places, shot_rate", options.packet_places->shot_rate, 0, "Hz");
  require_at_least("ReadOptions::packet_places, emitters in the firing order",
                   static_cast<long long>(options.packet_places->firing_order.size()), 1);
  return std::make_unique<PlacingReader>(std::move(reader), *options.packet_places);
}

}  // namespace risley::recordings
