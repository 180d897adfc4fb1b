// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "jobs/pattern_formats.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <ostream>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/io/little_endian.hpp"
#include "risley/io/npy_head.hpp"

namespace risley::jobs {
namespace {

constexpr std::uint64_t kPieceRows = 65536;

/// A number as printed in the manufacturer's scan sequences: ten digits, at most nine of them after
/// the point, no zeros at the end.
void append_number(std::string& text, double value) {
  const double whole = std::floor(std::log10(std::max(std::abs(value), 1.0)));
  const int decimals = 9 - static_cast<int>(std::min(whole, 9.0));
  fmt::format_to(std::back_inserter(text), "{:.{}f}", value, decimals);
  if (decimals == 0 || !std::isfinite(value)) return;
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
}

/// @param all_around  azimuths from 0 to 360 degrees, as in the manufacturer's file of the Mid-360,
/// instead of -180 to 180
std::string csv_rows(const sensors::ScanPattern& pattern, bool all_around) {
  std::string text;
  for (std::size_t i = 0; i < pattern.size(); ++i) {
    append_number(text, pattern.time[i]);
    text += ',';
    const double azimuth = pattern.azimuth[i];
    append_number(text, degrees_from_radians(all_around ? wrap_to_two_pi(azimuth) : azimuth));
    text += ',';
    append_number(text, degrees_from_radians(pattern.zenith[i]));
    text += '\n';
  }
  return text;
}

std::string npy_rows(const sensors::ScanPattern& pattern) {
  std::vector<std::uint8_t> bytes(8 * pattern.size());
  for (std::size_t i = 0; i < pattern.size(); ++i) {
    io::store<float>(&bytes[8 * i], static_cast<float>(pattern.azimuth[i]));
    io::store<float>(&bytes[8 * i + 4], static_cast<float>(0.5 * kPi - pattern.zenith[i]));
  }
  return {bytes.begin(), bytes.end()};
}

}  // namespace

void PatternStream::put(const std::string& text) {
  stream_.write(text.data(), static_cast<std::streamsize>(text.size()));
  if (!stream_) throw FileError(options_.output, {}, "cannot be written");
}

void PatternStream::put_rows(const std::function<std::string(const sensors::ScanPattern&)>& text,
                             int pass, int passes) {
  for (std::uint64_t row = 0; row < result_.rows; row += kPieceRows) {
    const auto count =
        static_cast<std::size_t>(std::min<std::uint64_t>(kPieceRows, result_.rows - row));
    const sensors::ScanPattern pattern = sensors::scan_pattern(sensor_, row, count, options_.scan);
    if (pass == 0) {
      result_.blocked += static_cast<std::uint64_t>(std::count_if(
          pattern.azimuth.begin(), pattern.azimuth.end(), [](double a) { return std::isnan(a); }));
    }
    put(text(pattern));
    progress_.report((pass + static_cast<double>(row + count) / static_cast<double>(result_.rows)) /
                     passes);
  }
}

void put_livox_csv(PatternStream& out) {
  out.put("Time,Azimuth,Zenith\n");
  const bool all_around = out.sensor().train.layout().axis_up;
  out.put_rows([all_around](const auto& pattern) { return csv_rows(pattern, all_around); });
}

void put_npy(PatternStream& out) {
  out.put(io::npy_head(fmt::format("{{'descr': '<f4', 'fortran_order': False, 'shape': ({}, 2), }}",
                                   out.result().rows)));
  out.put_rows(npy_rows);
}

}  // namespace risley::jobs
