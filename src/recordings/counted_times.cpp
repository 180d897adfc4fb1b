// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "risley/core/require.hpp"

#include "recordings/reader_decorators.hpp"

namespace risley::recordings {
namespace {

constexpr auto kUnknownGap_ns = static_cast<std::int64_t>(kUnknownGap * 1e9);

/// Gives every row the time from counting its shot.
class CountingReader final : public DecoratingReader {
 public:
  CountingReader(std::unique_ptr<Reader> inner, std::string path, const ReadOptions& options)
      : DecoratingReader(std::move(inner)),
        path_(std::move(path)),
        shot_rate_(*options.shot_rate),
        firing_order_(options.firing_order),
        slips_(options.slips) {
    for (int beam = 0; options.firing_order.empty() && beam < options.emitters; ++beam) {
      firing_order_.push_back(static_cast<std::uint8_t>(beam));
    }
    take_over();
  }

 private:
  void describe() override {
    header_.has_times = true;
    header_.counted_rate = shot_rate_;
    header_.slips = slips_;
    header_.time_reference = TimeReference::relative;
    clock_wraps_ = 0;
    if (lost_samples_ == 0) return;
    warnings_.push_back({kWarning.content_left_out,
                         "inertial samples were dropped: their times cannot be compared with those "
                         "of counted shots",
                         {},
                         lost_samples_});
  }

  std::optional<FileError> change(Chunk& chunk) override {
    lost_samples_ += chunk.imu.size();
    chunk.packets.clear();
    chunk.imu.clear();
    Observations& rows = chunk.observations;
    file_has_beams_ = file_has_beams_ || std::any_of(rows.beam.begin(), rows.beam.end(),
                                                     [](std::uint8_t beam) { return beam != 0; });
    const auto emitters = static_cast<std::int64_t>(firing_order_.size());
    const bool in_turn = emitters > 1 && !file_has_beams_;
    for (std::size_t row = 0; row < rows.size(); ++row, ++rows_read_) {
      for (; next_slip_ < slips_.size() && slips_[next_slip_].row <= rows_read_; ++next_slip_) {
        missing_ += slips_[next_slip_].shots;
        if (!slips_[next_slip_].counted) pause_ns_ += kUnknownGap_ns;
      }
      const std::int64_t shot = shot_number(rows, row) + missing_;
      const std::optional<std::int64_t> time_ns = time_of(shot);
      if (!time_ns) {
        FileError error(
            path_, FilePlace{},
            fmt::format("shot number {} at {} Hz would be later than 9.2e9 s, the latest possible "
                        "time; expected smaller numbers or a higher shot rate",
                        shot, shot_rate_));
        rows.resize(row);
        return error;
      }
      rows.time_ns[row] = *time_ns;
      if (in_turn) {
        rows.beam[row] =
            firing_order_[static_cast<std::size_t>((shot % emitters + emitters) % emitters)];
      }
    }
    return std::nullopt;
  }

  std::int64_t shot_number(const Observations& rows, std::size_t row) {
    if (!inner().header().has_times) return rows.time_ns[row];
    std::int64_t& next = next_shot_[rows.device[row]];
    if (rows.return_number[row] <= 1 || next == 0) ++next;
    return next - 1;
  }

  std::optional<std::int64_t> time_of(std::int64_t shot) const {
    constexpr long double kLatest = 9.2e18L;
    const long double time_ns = static_cast<long double>(shot) * 1e9L / shot_rate_;
    if (!(std::abs(time_ns) < kLatest)) return std::nullopt;
    return std::llround(time_ns) + pause_ns_;
  }

  std::string path_;
  double shot_rate_;
  std::vector<std::uint8_t> firing_order_;
  std::vector<ShotSlip> slips_;
  std::size_t next_slip_ = 0;
  std::uint64_t rows_read_ = 0;
  std::int64_t missing_ = 0, pause_ns_ = 0;  ///< before the present row
  bool file_has_beams_ = false;
  std::array<std::int64_t, 256> next_shot_{};  ///< by device
  std::uint64_t lost_samples_ = 0;
};

}  // namespace

std::unique_ptr<Reader> with_counted_times(std::unique_ptr<Reader> reader, const std::string& path,
                                           const ReadOptions& options) {
  require_above("ReadOptions::shot_rate", *options.shot_rate, 0, "Hz");
  require_between("ReadOptions::emitters", options.emitters, 0, 255);
  if (!options.firing_order.empty()) {
    require_length("ReadOptions::firing_order", options.firing_order.size(),
                   static_cast<std::size_t>(options.emitters));
  }
  for (std::size_t i = 1; i < options.slips.size(); ++i) {
    require_at_least("ReadOptions::slips, row", static_cast<long long>(options.slips[i].row),
                     static_cast<long long>(options.slips[i - 1].row) + 1);
  }
  if (!options.slips.empty() && reader->header().devices.size() > 1) {
    throw InvalidArgument(
        fmt::format("ReadOptions::slips is given for a recording of {} sensors, allowed for one",
                    reader->header().devices.size()));
  }
  return std::make_unique<CountingReader>(std::move(reader), path, options);
}

}  // namespace risley::recordings
