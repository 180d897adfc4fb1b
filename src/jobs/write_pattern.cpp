// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/write_pattern.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <ostream>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/io/output_file.hpp"
#include "risley/jobs/compare_results.hpp"
#include "risley/parallel/parallel.hpp"
#include "risley/sensors/preset.hpp"

#include "jobs/pattern_formats.hpp"

namespace risley::jobs {
namespace {

struct Format {
  PatternFormat shown;
  void (*put)(PatternStream& out);
};

const std::vector<Format>& formats() {
  static const std::vector<Format> all = {
      {{"livox-csv",
        "time (s), azimuth and zenith (degrees), as in the manufacturer's scan sequences"},
       put_livox_csv},
      {{"npy",
        "float32 pairs of azimuth and elevation (radians), for MuJoCo-LiDAR, OmniPerception"},
       put_npy},
      {{"helios-xml", "the prisms for HELIOS++, and the parts of them that it cannot represent"},
       put_helios_xml},
      {{"json", "a lidar profile of Isaac Sim up to 4.5, one emitter per shot"}, put_isaac_json},
      {{"usda", "an OmniLidar in USD for Isaac Sim 5 and later, one emitter per shot"},
       put_isaac_usda}};
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

PatternRows pattern_rows(const sensors::Sensor& sensor, double start, double duration,
                         const sensors::ScanPatternOptions& scan) {
  const double rate = scan.shot_rate.value_or(sensor.shot_rate);
  require_between("start", start, 0, 1e7, "s");
  require_between("duration", duration, 0, 1e7, "s");
  require_between("shot_rate", rate, 1e-3, 1e9, "Hz");
  require_between("every", static_cast<double>(scan.every), 1, 1e9);
  const auto rows_until = [&](double time) {
    const auto shots = static_cast<std::uint64_t>(std::llround(time * rate));
    const auto group = scan.whole_groups ? static_cast<std::uint64_t>(sensor.train.emitters()) : 1;
    return scan.every == 1 ? shots : shots / group / scan.every * group;
  };
  const std::uint64_t first = rows_until(start);
  const std::uint64_t count = rows_until(start + duration) - first;
  require_at_least("rows of the pattern", static_cast<long long>(count), 1);
  return {first, static_cast<std::size_t>(count)};
}

template <class Number>
void pattern_directions(const sensors::Sensor& sensor, std::uint64_t first_row,
                        std::span<Number> out, const sensors::ScanPatternOptions& scan,
                        const Progress& progress) {
  constexpr std::size_t kRows = std::size_t{1} << 16;
  const std::size_t rows = out.size() / 3;
  parallel::for_each_job((rows + kRows - 1) / kRows,
                         [&](std::size_t i) {
                           const std::size_t begin = i * kRows,
                                             count = std::min(kRows, rows - begin);
                           sensors::scan_directions(sensor, first_row + begin,
                                                    out.subspan(3 * begin, 3 * count), scan);
                         },
                         progress);
}
template void pattern_directions(const sensors::Sensor&, std::uint64_t, std::span<float>,
                                 const sensors::ScanPatternOptions&, const Progress&);
template void pattern_directions(const sensors::Sensor&, std::uint64_t, std::span<double>,
                                 const sensors::ScanPatternOptions&, const Progress&);

WrittenPattern write_pattern(const WritePatternOptions& options, std::ostream& stream,
                             const Progress& progress) {
  const Format& format = format_of(options.format);
  const sensors::Sensor sensor = load_result(options.sensor);
  WrittenPattern result;
  result.rows = pattern_rows(sensor, 0, options.duration, options.scan).count;
  result.sensor = sensor.name;
  result.format = format.shown.name;
  result.output = options.output;
  result.firing = to_string(options.scan.firing.value_or(
      sensor.sequence ? sensor.sequence->firing : sensors::Firing::in_turn));
  PatternStream out(sensor, options, stream, progress, result);
  format.put(out);
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
