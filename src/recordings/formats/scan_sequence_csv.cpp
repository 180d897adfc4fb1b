// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Livox point-cloud sequences: the directions of a sensor's shots, without ranges. A sequence has
// one row per shot, so only the first of several returns with a valid direction is written, ranges
// are dropped, and rows without a valid direction are skipped.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>

#include "recordings/formats/cartesian.hpp"
#include "recordings/formats/format.hpp"
#include "recordings/formats/text_table.hpp"

namespace risley::recordings {
namespace {

constexpr std::string_view kScanSequenceCsv = "scan-sequence-csv";
constexpr std::string_view kSequenceHeader = "Time/s,Azimuth/deg,Zenith/deg";
constexpr std::string_view kTimeColumn = "Time/s", kAzimuthColumn = "Azimuth/deg",
                           kZenithColumn = "Zenith/deg";
constexpr int kDefaultDecimals = 5;
constexpr int kMostDecimals = 17;
constexpr std::size_t kSequenceRowsLookedAt = 16384;

/// Details of the header: format of the numbers.
constexpr const char* kTimeDecimalsNote = "time_decimals";
constexpr const char* kAzimuthDecimals = "azimuth_decimals";
constexpr const char* kZenithDecimals = "zenith_decimals";
constexpr const char* kAzimuthSense = "azimuth_range";  ///< "0-360" or "-180-180"

float resolution_of(int decimals) {
  return static_cast<float>(radians_from_degrees(std::pow(10.0, -decimals)));
}

class ScanSequenceReader final : public TextTableReader {
 public:
  explicit ScanSequenceReader(const io::InputFile& file)
      : TextTableReader(file, std::string(kScanSequenceCsv)) {
    if (table_header() != kSequenceHeader) refuse_header(std::string(kSequenceHeader));
    set_column_count(3);
    header_.has_range = header_.has_intensity = false;
    header_.devices.front().type = kUnknownDeviceType;
    learn_number_style();
  }

 private:
  struct Row {
    Decimal time, azimuth, zenith;
  };

  static Row parse(Fields fields) {
    Row row{decimal_field(fields[0], kTimeColumn), decimal_field(fields[1], kAzimuthColumn),
            decimal_field(fields[2], kZenithColumn)};
    require_within(row.azimuth.value, -180.0, 360.0, kAzimuthColumn);
    require_within(row.zenith.value, 0.0, 180.0, kZenithColumn);
    return row;
  }

  static void require_within(double value, double low, double high, std::string_view column) {
    if (value >= low && value <= high) return;
    throw BadRow{fmt::format("expected {} in [{}, {}], found {}", column, low, high, value)};
  }

  void learn_number_style() {
    int time_decimals = -1, azimuth_decimals = -1, zenith_decimals = -1;
    bool beyond_180 = false, all_shot_numbers = true;
    std::int64_t rows = 0, first_time = 0;
    look_ahead(kSequenceRowsLookedAt, [&](Fields fields) {
      const Row row = parse(fields);
      if (rows == 0) first_time = row.time.digits;
      all_shot_numbers = all_shot_numbers && row.time.decimals == 0 &&
                         row.time.digits == first_time + rows &&
                         (first_time == 0 || first_time == 1);
      time_decimals = std::max(time_decimals, row.time.decimals);
      azimuth_decimals = std::max(azimuth_decimals, row.azimuth.decimals);
      zenith_decimals = std::max(zenith_decimals, row.zenith.decimals);
      beyond_180 = beyond_180 || row.azimuth.value > 180.0;
      ++rows;
      return true;
    });
    azimuth_decimals_ = azimuth_decimals;
    zenith_decimals_ = zenith_decimals;
    if (rows == 0) return;
    if (time_decimals >= 0 && !all_shot_numbers) {
      header_.set_detail(kTimeDecimalsNote, std::to_string(time_decimals));
    }
    if (azimuth_decimals >= 0) {
      header_.set_detail(kAzimuthDecimals, std::to_string(azimuth_decimals));
    }
    if (zenith_decimals >= 0) header_.set_detail(kZenithDecimals, std::to_string(zenith_decimals));
    if (beyond_180) header_.set_detail(kAzimuthSense, "0-360");
    if (all_shot_numbers) {
      header_.has_times = false;
      warn(kWarning.no_shot_times,
           "column Time/s holds shot numbers instead of seconds; the time between shots is unknown")
          .place.line = 2;
    }
  }

  void append_row(Fields fields, Chunk& chunk) override {
    const Row row = parse(fields);
    std::int64_t time_ns = row.time.digits;
    if (header_.has_times) {
      time_ns = nanoseconds_of(row.time, kTimeColumn);
    } else if (row.time.decimals != 0) {
      throw BadRow{
          fmt::format("expected a shot number in column {}, found \"{}\"", kTimeColumn, fields[0])};
    }
    azimuth_decimals_ = std::max(azimuth_decimals_, row.azimuth.decimals);
    zenith_decimals_ = std::max(zenith_decimals_, row.zenith.decimals);
    auto& rows = chunk.observations;
    const auto i = append_observation(rows, time_ns);
    rows.azimuth[i] = azimuth_from_degrees(row.azimuth.value);
    rows.zenith[i] = std::min(radians_from_degrees(row.zenith.value), kPi);
    rows.range[i] = std::numeric_limits<double>::quiet_NaN();
    rows.azimuth_resolution[i] = resolution(azimuth_decimals_, known_azimuth_);
    rows.zenith_resolution[i] = resolution(zenith_decimals_, known_zenith_);
    rows.valid[i] = 1;
  }

  /// Trailing zeros may be missing, so the longest number seen gives the step.
  struct Resolution {
    int decimals = -1;
    float value = 0.0F;
  };
  static float resolution(int decimals, Resolution& known) {
    if (known.decimals != decimals) known = {decimals, resolution_of(decimals)};
    return known.value;
  }

  int azimuth_decimals_ = -1, zenith_decimals_ = -1;
  Resolution known_azimuth_, known_zenith_;
};

class ScanSequenceWriter final : public Writer {
 public:
  ScanSequenceWriter(const std::string& path, const RecordingHeader& header)
      : shot_numbers_(!header.has_times),
        from_zero_(detail_of(header, kAzimuthSense) == "0-360"),
        azimuth_decimals_(decimals_detail(header, kAzimuthDecimals)),
        zenith_decimals_(decimals_detail(header, kZenithDecimals)),
        time_(decimals_detail(header, kTimeDecimalsNote)),
        output_(path) {
    output_.append(kSequenceHeader);
    output_.end_row();
  }

  void append(const Chunk& chunk) override {
    const auto& rows = chunk.observations;
    time_.look_at(rows.time_ns);
    for (std::size_t i = 0; i < rows.size(); ++i, ++rows_seen_) {
      if (rows.valid[i] == 0) {
        ++left_out_;
        continue;
      }
      if (!std::isfinite(rows.azimuth[i]) || !(rows.zenith[i] >= 0.0 && rows.zenith[i] <= kPi) ||
          std::abs(rows.azimuth[i]) > kPi) {
        throw InvalidArgument(fmt::format(
            "row {}: azimuth {} rad, zenith {} rad; a scan sequence holds azimuths in [-pi, pi] "
            "and zeniths in [0, pi]",
            rows_seen_, rows.azimuth[i], rows.zenith[i]));
      }
      require_one_device(rows.device[i]);
      if (rows.return_number[i] > 1 && last_time_ns_ == rows.time_ns[i]) {
        ++left_out_;
        continue;
      }
      last_time_ns_ = rows.time_ns[i];
      append_row(rows, i);
    }
  }

  void close() override { output_.close(); }

 private:
  static std::string detail_of(const RecordingHeader& header, const char* name) {
    return source_format(header) == kScanSequenceCsv ? header.detail(name) : std::string();
  }

  static int decimals_detail(const RecordingHeader& header, const char* name) {
    const std::string text = detail_of(header, name);
    int decimals = kDefaultDecimals;
    std::from_chars(text.data(), text.data() + text.size(), decimals);
    return std::clamp(decimals, 0, kMostDecimals);
  }

  void require_one_device(std::uint8_t device) {
    if (!device_) device_ = device;
    if (*device_ == device) return;
    throw InvalidArgument(
        fmt::format("row {}: device {} after device {}; a scan sequence holds one sensor",
                    rows_seen_, device, *device_));
  }

  void append_row(const Observations& rows, std::size_t i) {
    if (shot_numbers_) {
      output_.append_decimal(rows.time_ns[i], 0);
    } else {
      time_.append(output_, rows.time_ns[i]);
    }
    output_.buffer().push_back(',');
    output_.append_fixed(
        from_zero_ ? degrees_0_to_360(rows.azimuth[i]) : degrees_from_radians(rows.azimuth[i]),
        azimuth_decimals_);
    output_.buffer().push_back(',');
    output_.append_fixed(degrees_from_radians(rows.zenith[i]), zenith_decimals_);
    output_.end_row();
  }

  bool shot_numbers_, from_zero_;
  int azimuth_decimals_, zenith_decimals_;
  TimeColumn time_;
  TextOutput output_;
  std::uint64_t rows_seen_ = 0;
  std::optional<std::uint8_t> device_;
  std::optional<std::int64_t> last_time_ns_;
};

}  // namespace

const Format kScanSequenceCsvFormat = {
    kScanSequenceCsv,
    ".csv",
    "Livox scan sequence: time, azimuth and zenith as text, no ranges",
    [](std::string_view head) { return normalized_header(head) == kSequenceHeader; },
    open_with<ScanSequenceReader>,
    create_with<ScanSequenceWriter>,
    true,
};

}  // namespace risley::recordings
