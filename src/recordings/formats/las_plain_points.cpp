// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The points of LAS files that are not compressed.
#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/io/little_endian.hpp"

#include "recordings/formats/las_points.hpp"

namespace risley::recordings::las {
namespace {

using io::load;

class PlainPoints final : public PointSource {
 public:
  PlainPoints(io::BlockInput input, const PublicHeader& header, std::vector<Warning>& warnings)
      : input_(std::move(input)), header_(header) {
    const std::uint64_t room = (header_.points_end - header_.points_at) / header_.record_bytes;
    points_ = std::min(header_.points, room);
    if (header_.points == 0 && room > 0) {
      // A program that fills in its counter last was interrupted.
      points_ = header_.points = room;
      warnings.push_back(
          {kWarning.header_contradicted,
           fmt::format("the header says that there are 0 points; the {} that follow it were read",
                       room),
           {header_.points_at, {}}});
    }
    if (header_.points < room) {
      warnings.push_back(
          {kWarning.content_left_out,
           fmt::format("the header says that there are {} points; those after them were ignored",
                       header_.points),
           {place_of(header_.points), {}},
           room - header_.points});
    }
  }

  std::size_t read(std::span<Point> points) override {
    if (next_ == points_ && points_ < header_.points) {
      throw FileError(input_.path(), {place_of(points_), {}},
                      fmt::format("expected {} points of {} bytes, as the header says, found room "
                                  "for {} up to byte {}, where {}",
                                  header_.points, header_.record_bytes, points_, header_.points_end,
                                  header_.points_end < input_.size() ? "other records begin"
                                                                     : "the file ends"));
    }
    std::size_t done = 0;
    for (; done < points.size() && next_ < points_; ++done, ++next_) {
      const std::uint8_t* record = nullptr;
      try {
        record = input_.at(place_of(next_), header_.record_bytes);
      } catch (const FileError&) {
        if (done == 0) throw;
        break;  // the next call encounters it again
      }
      points[done] = decode(record);
    }
    return done;
  }

  FilePlace gps_time_place(std::uint64_t point) const override {
    return {place_of(point) + gps_time_at(header_.point_format).value_or(0), {}};
  }

  double fraction_read() const override {
    return points_ == 0 ? 1.0 : static_cast<double>(next_) / static_cast<double>(points_);
  }

 private:
  std::uint64_t place_of(std::uint64_t point) const {
    return header_.points_at + point * header_.record_bytes;
  }

  Point decode(const std::uint8_t* record) const {
    Point point;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      point.steps[axis] = load<std::int32_t>(record + 4 * axis);
    }
    point.intensity = load<std::uint16_t>(record + 12);
    const std::uint8_t returns = record[14];
    if (is_modern(header_.point_format)) {
      point.return_number = returns & 15U;
      point.number_of_returns = returns >> 4U;
      point.beam = (record[15] >> 4U) & 3U;
    } else {
      point.return_number = returns & 7U;
      point.number_of_returns = (returns >> 3U) & 7U;
    }
    if (const auto at = gps_time_at(header_.point_format)) {
      point.gps_time = load<double>(record + *at);
    }
    if (header_.tag_at) point.tag = record[*header_.tag_at];
    if (header_.beam_at) point.beam = record[*header_.beam_at];
    return point;
  }

  io::BlockInput input_;
  PublicHeader header_;
  std::uint64_t points_ = 0;  ///< that the file holds
  std::uint64_t next_ = 0;
};

}  // namespace

std::unique_ptr<PointSource> open_points(io::BlockInput input, const PublicHeader& header,
                                         std::vector<Warning>& warnings) {
  return std::make_unique<PlainPoints>(std::move(input), header, warnings);
}

}  // namespace risley::recordings::las
