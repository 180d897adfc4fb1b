// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "risley/core/saturating.hpp"

#include "recordings/reader_decorators.hpp"

namespace risley::recordings {
namespace {

/// Drops the data after this many rows and inertial samples; packets stay complete.
void keep_front(Chunk& chunk, std::size_t rows, std::size_t samples) {
  if (!chunk.packets.empty()) {
    std::size_t row = 0, sample = 0, whole = 0;
    for (const Packet& packet : chunk.packets) {
      const std::size_t own = packet.is_imu() ? 1 : 0;
      if (row + packet.rows > rows || sample + own > samples) break;
      row += packet.rows;
      sample += own;
      ++whole;
    }
    chunk.packets.resize(whole);
    rows = row;
    samples = sample;
  }
  chunk.observations.resize(rows);
  chunk.imu.resize(samples);
}

class TimeSpanReader final : public DecoratingReader {
 public:
  TimeSpanReader(std::unique_ptr<Reader> inner, std::string path)
      : DecoratingReader(std::move(inner)), path_(std::move(path)) {
    take_over();
  }

 private:
  void describe() override {}

  std::optional<FileError> change(Chunk& chunk) override {
    const auto& times = chunk.observations.time_ns;
    if (!first_ns_ && !times.empty()) first_ns_ = times.front();
    if (!first_ns_ && !chunk.imu.empty()) first_ns_ = chunk.imu.front().time_ns;
    if (!first_ns_) return std::nullopt;
    const std::int64_t low = saturating_difference(*first_ns_, kLongestTimeSpan_ns),
                       high = saturating_sum(*first_ns_, kLongestTimeSpan_ns);
    const auto from_low = [low](std::int64_t time_ns) {
      return static_cast<std::uint64_t>(time_ns) - static_cast<std::uint64_t>(low);
    };
    const auto is_far = [from_low, most = from_low(high)](std::int64_t time_ns) {
      return from_low(time_ns) > most;  // in one step
    };
    // All at once: checking row by row took 5 % of the time of reading LVX.
    bool any_far = false;
    for (const std::int64_t time_ns : times) any_far |= is_far(time_ns);
    const auto row = any_far ? std::find_if(times.begin(), times.end(), is_far) : times.end();
    const auto sample = std::find_if(chunk.imu.begin(), chunk.imu.end(),
                                     [&](const ImuSample& imu) { return is_far(imu.time_ns); });
    if (row == times.end() && sample == chunk.imu.end()) {
      rows_ += times.size();
      return std::nullopt;
    }
    const bool is_row = row != times.end();
    FileError error(
        path_, {},
        fmt::format("the time of {} is {} ns, that of the first {} ns; allowed within 146 years of "
                    "the first",
                    is_row ? fmt::format("observation {} (from 0)", rows_ + (row - times.begin()))
                           : std::string("an inertial sample"),
                    is_row ? *row : sample->time_ns, *first_ns_));
    keep_front(chunk, static_cast<std::size_t>(row - times.begin()),
               static_cast<std::size_t>(sample - chunk.imu.begin()));
    return error;
  }

  std::string path_;
  std::optional<std::int64_t> first_ns_;
  std::uint64_t rows_ = 0;
};

}  // namespace

std::unique_ptr<Reader> within_time_span(std::unique_ptr<Reader> reader, const std::string& path) {
  return std::make_unique<TimeSpanReader>(std::move(reader), path);
}

}  // namespace risley::recordings
