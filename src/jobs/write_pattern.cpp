// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/write_pattern.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <ostream>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/io/little_endian.hpp"
#include "risley/io/npy_head.hpp"
#include "risley/io/output_file.hpp"
#include "risley/sensors/preset.hpp"

namespace risley::jobs {
namespace {

constexpr std::uint64_t kPieceRows = 65536;

/// A number as the maker's scan sequences print it: ten digits, nine of them after the point at
/// most, no zeros at the end.
void append_number(std::string& text, double value) {
  const double whole = std::floor(std::log10(std::max(std::abs(value), 1.0)));
  const int decimals = 9 - static_cast<int>(std::min(whole, 9.0));
  fmt::format_to(std::back_inserter(text), "{:.{}f}", value, decimals);
  if (decimals == 0 || !std::isfinite(value)) return;
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
}

std::string csv_rows(const sensors::ScanPattern& pattern) {
  std::string text;
  for (std::size_t i = 0; i < pattern.size(); ++i) {
    append_number(text, pattern.time[i]);
    text += ',';
    append_number(text, degrees_from_radians(pattern.azimuth[i]));
    text += ',';
    append_number(text, degrees_from_radians(pattern.zenith[i]));
    text += '\n';
  }
  return text;
}

std::string npy_head(std::uint64_t rows) {
  return io::npy_head(
      fmt::format("{{'descr': '<f4', 'fortran_order': False, 'shape': ({}, 2), }}", rows));
}

std::string npy_rows(const sensors::ScanPattern& pattern) {
  std::vector<std::uint8_t> bytes(8 * pattern.size());
  for (std::size_t i = 0; i < pattern.size(); ++i) {
    io::store<float>(&bytes[8 * i], static_cast<float>(pattern.azimuth[i]));
    io::store<float>(&bytes[8 * i + 4], static_cast<float>(0.5 * kPi - pattern.zenith[i]));
  }
  return {bytes.begin(), bytes.end()};
}

std::string csv_head(std::uint64_t) { return "Time,Azimuth,Zenith\n"; }

struct Format {
  PatternFormat shown;
  std::string (*head)(std::uint64_t rows);
  std::string (*rows)(const sensors::ScanPattern& pattern);
};

const std::vector<Format>& formats() {
  static const std::vector<Format> all = {
      {{"livox-csv", "time (s), azimuth and zenith (degrees), as the maker's scan sequences"},
       csv_head,
       csv_rows},
      {{"npy",
        "float32 pairs of azimuth and elevation (radians), for MuJoCo-LiDAR, OmniPerception"},
       npy_head,
       npy_rows}};
  return all;
}

const Format& format_of(const std::string& name) {
  std::vector<std::string> known;
  for (const Format& format : formats()) {
    if (format.shown.name == name) return format;
    known.push_back(format.shown.name);
  }
  throw InvalidArgument(
      fmt::format("format \"{}\" of a scan pattern, allowed {}", name, fmt::join(known, ", ")));
}

}  // namespace

const std::vector<PatternFormat>& pattern_formats() {
  static const std::vector<PatternFormat> all = [] {
    std::vector<PatternFormat> shown;
    for (const Format& format : formats()) shown.push_back(format.shown);
    return shown;
  }();
  return all;
}

WrittenPattern write_pattern(const WritePatternOptions& options, std::ostream& stream,
                             const Progress& progress) {
  const Format& format = format_of(options.format);
  const sensors::Sensor sensor = sensors::load_sensor(options.sensor);
  const double rate = options.scan.shot_rate.value_or(sensor.shot_rate);
  require_between("duration", options.duration, 0, 1e7, "s");
  require_between("shot_rate", rate, 1e-3, 1e9, "Hz");
  require_between("every", static_cast<double>(options.scan.every), 1, 1e9);
  const auto shots = static_cast<std::uint64_t>(std::llround(options.duration * rate));
  WrittenPattern result;
  result.sensor = sensor.name;
  result.rows = shots / options.scan.every;
  require_at_least("rows of the pattern", static_cast<long long>(result.rows), 1);
  result.firing = to_string(options.scan.firing.value_or(
      sensor.sequence ? sensor.sequence->firing : sensors::Firing::in_turn));
  std::string text = format.head(result.rows);
  for (std::uint64_t row = 0; row < result.rows; row += kPieceRows) {
    const auto count =
        static_cast<std::size_t>(std::min<std::uint64_t>(kPieceRows, result.rows - row));
    const sensors::ScanPattern pattern = sensors::scan_pattern(sensor, row, count, options.scan);
    result.blocked += static_cast<std::uint64_t>(std::count_if(
        pattern.azimuth.begin(), pattern.azimuth.end(), [](double a) { return std::isnan(a); }));
    text += format.rows(pattern);
    stream.write(text.data(), static_cast<std::streamsize>(text.size()));
    if (!stream) throw FileError(options.output, {}, "cannot be written");
    text.clear();
    progress.report(static_cast<double>(row + count) / static_cast<double>(result.rows));
  }
  return result;
}

WrittenPattern write_pattern(const WritePatternOptions& options, const Progress& progress) {
  io::OutputFile file(options.output);
  std::ofstream stream(file.temporary_path(), std::ios::binary);
  WrittenPattern result = write_pattern(options, stream, progress);
  stream.close();
  if (!stream) throw FileError(options.output, {}, "cannot be written");
  file.commit();
  return result;
}

}  // namespace risley::jobs
