// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Text captures of openpylivox, as captured and as converted from its binary files. Values are the
// sensor's integers, printed in m and deg, whatever number of decimals they carry. Of the tag byte
// bits 0-1 are not in the file; the columns of the others are mislabelled there (ReturnType = bits
// 2-3, sConf = bits 6-7, iConf = bits 4-5) and are read by their actual contents.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "recordings/formats/cartesian.hpp"
#include "recordings/formats/format.hpp"
#include "recordings/formats/openpylivox.hpp"
#include "recordings/formats/text_table.hpp"

namespace risley::recordings {
namespace {

constexpr const char* kColumns = "columns";  ///< detail: the header line
constexpr int kTimeDecimals = 6, kMetreDecimals = 3, kDegreeDecimals = 2, kImuDecimals = 6;
constexpr std::size_t kRowsLookedAt = 4096;

/// One of the program's header lines.
struct Variant {
  std::string_view header;
  bool cartesian, return_number, tags, imu;
  std::size_t columns;
};

constexpr std::array<Variant, 7> kVariants = {{
    {"//X,Y,Z,Inten-sity,Time", true, false, false, false, 5},
    {"//Distance,Zenith,Azimuth,Inten-sity,Time", false, false, false, false, 5},
    {"//X,Y,Z,Inten-sity,Time,ReturnNum", true, true, false, false, 6},
    {"//Distance,Zenith,Azimuth,Inten-sity,Time,ReturnNum", false, true, false, false, 6},
    {"//X,Y,Z,Inten-sity,Time,ReturnNum,ReturnType,sConf,iConf", true, true, true, false, 9},
    {"//Distance,Zenith,Azimuth,Inten-sity,Time,ReturnNum,ReturnType,sConf,iConf", false, true,
     true, false, 9},
    {"//gyro_x,gyro_y,gyro_z,acc_x,acc_y,acc_z,time", false, false, false, true, 7},
}};

const Variant* find_variant(std::string_view header) {
  const auto found = std::find_if(kVariants.begin(), kVariants.end(),
                                  [&](const Variant& v) { return v.header == header; });
  return found != kVariants.end() ? &*found : nullptr;
}

class OpenpylivoxCsvReader final : public TextTableReader {
 public:
  explicit OpenpylivoxCsvReader(const io::InputFile& file)
      : TextTableReader(file, std::string(kOpenpylivoxCsvName)) {
    const Variant* const variant = find_variant(table_header());
    if (variant == nullptr) refuse_header("of an openpylivox table (//X,Y,Z,Inten-sity,Time, ...)");
    variant_ = *variant;
    set_column_count(variant_.columns);
    header_.set_detail(kColumns, std::string(variant_.header));
    describe_openpylivox(header_, layout());
  }

 private:
  OpenpylivoxLayout layout() const {
    std::int64_t returns = 1;
    if (variant_.return_number) {
      look_ahead(kRowsLookedAt, [&](Fields fields) {
        returns = std::max(returns, return_number(fields));
        return true;
      });
    }
    OpenpylivoxLayout layout;
    layout.imu = variant_.imu;
    layout.data_type = variant_.cartesian ? 0 : 1;
    if (variant_.tags) {
      layout.data_type += returns > 1 ? 4 : 2;
    } else {
      layout.firmware_type = static_cast<int>(returns);
    }
    return layout;
  }

  static std::int64_t return_number(Fields fields) {
    return integer_field(fields[5], "ReturnNum", 1, 3);
  }

  void append_row(Fields fields, Chunk& chunk) override {
    if (variant_.imu) {
      append_imu(fields, chunk);
    } else {
      append_point(fields, chunk.observations);
    }
  }

  static void append_imu(Fields fields, Chunk& chunk) {
    ImuSample sample;
    constexpr std::array<std::string_view, 6> kNames = {"gyro_x", "gyro_y", "gyro_z",
                                                        "acc_x",  "acc_y",  "acc_z"};
    for (std::size_t i = 0; i < kNames.size(); ++i) {
      auto& target = i < 3 ? sample.angular_velocity[i] : sample.acceleration_g[i - 3];
      target = static_cast<float>(decimal_field(fields[i], kNames[i]).value);
    }
    sample.time_ns = nanoseconds_field(fields[6], "time");
    chunk.imu.push_back(sample);
  }

  static double coordinate(std::string_view field, std::string_view column) {
    return value_within(field, column, -2147483.648, 2147483.647, "m");  // 32 bits of mm
  }

  static double value_within(std::string_view field, std::string_view column, double low,
                             double high, std::string_view unit) {
    const double value = decimal_field(field, column).value;
    if (value < low || value > high) {
      throw BadRow{
          fmt::format("expected {} in [{}, {}] {}, found {}", column, low, high, unit, value)};
    }
    return value;
  }

  void append_point(Fields fields, Observations& rows) const {
    Vector3<double> point;
    double range = 0.0, zenith_deg = 0.0, azimuth_deg = 0.0;
    if (variant_.cartesian) {
      point = {coordinate(fields[0], "X"), coordinate(fields[1], "Y"), coordinate(fields[2], "Z")};
    } else {
      range = value_within(fields[0], "Distance", 0.0, 4294967.295, "m");
      zenith_deg = value_within(fields[1], "Zenith", 0.0, 180.0, "deg");
      azimuth_deg = value_within(fields[2], "Azimuth", -180.0, 360.0, "deg");
    }
    const auto intensity = integer_field(fields[3], "Inten-sity", 0, 255);
    const auto time_ns = nanoseconds_field(fields[4], "Time");
    const auto number = variant_.return_number ? return_number(fields) : 1;
    std::int64_t tag = 0;
    if (variant_.tags) {
      tag = integer_field(fields[6], "ReturnType", 0, 3) << 2 |
            integer_field(fields[7], "sConf", 0, 3) << 6 |
            integer_field(fields[8], "iConf", 0, 3) << 4;
    }
    const auto i = append_observation(rows, time_ns);
    if (variant_.cartesian) {
      set_cartesian(rows, i, point, kMillimetre);
    } else {
      set_spherical(rows, i, azimuth_from_degrees(azimuth_deg),
                    std::min(radians_from_degrees(zenith_deg), kPi), range);
    }
    rows.intensity[i] = static_cast<std::uint8_t>(intensity);
    rows.return_number[i] = static_cast<std::uint8_t>(number);
    rows.tag[i] = static_cast<std::uint8_t>(tag);
  }

  Variant variant_{};
};

/// Writes times with 6 decimals as the program does, with 9 if needed.
class OpenpylivoxCsvWriter final : public Writer {
 public:
  OpenpylivoxCsvWriter(const std::string& path, const RecordingHeader& header)
      : variant_(variant_for(header)), output_(path) {
    output_.append(variant_.header);
    output_.end_row();
  }

  void append(const Chunk& chunk) override {
    if (variant_.imu) {
      write_imu(chunk.imu);
      return;
    }
    const auto& rows = chunk.observations;
    time_.look_at(rows.time_ns);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (!filter_.accepts(rows, i) || !write_point(rows, i)) ++left_out_;
    }
  }

  void close() override { output_.close(); }

 private:
  static Variant variant_for(const RecordingHeader& header) {
    const OpenpylivoxLayout layout = openpylivox_layout(header);
    const Variant* const own = source_format(header) == kOpenpylivoxCsvName
                                   ? find_variant(header.detail(kColumns))
                                   : nullptr;
    if (own != nullptr) return *own;
    // The program's own conversion of its binary files always includes the return number.
    const bool with_number = layout.tagged() || layout.firmware_type > 1 ||
                             (source_format(header) == kOpenpylivoxBinName && !layout.imu);
    return *std::find_if(kVariants.begin(), kVariants.end(), [&](const Variant& v) {
      return layout.imu ? v.imu
                        : !v.imu && v.cartesian == layout.cartesian() &&
                              v.tags == layout.tagged() && v.return_number == with_number;
    });
  }

  void comma() { output_.buffer().push_back(','); }

  void write_imu(const std::vector<ImuSample>& samples) {
    for (const auto& sample : samples) {
      time_.look_at({sample.time_ns});
      for (const auto& vector : {sample.angular_velocity, sample.acceleration_g}) {
        for (const float component : vector) {
          if (!std::isfinite(component)) {
            throw InvalidArgument(fmt::format(
                "IMU sample at {} ns: component {}; expected a number", sample.time_ns, component));
          }
          output_.append_fixed(component, kImuDecimals);
          comma();
        }
      }
      time_.append(output_, sample.time_ns);
      output_.end_row();
    }
  }

  /// @return false for a point closer than the format's step, which would appear as no return
  bool write_point(const Observations& rows, std::size_t i) {
    if (variant_.cartesian) {
      const auto point = cartesian_point(rows, i);
      const std::array<std::int64_t, 3> steps = {whole_steps(point.x, kMillimetre),
                                                 whole_steps(point.y, kMillimetre),
                                                 whole_steps(point.z, kMillimetre)};
      if (steps == std::array<std::int64_t, 3>{}) return false;
      for (const auto step : steps) {
        if (step < std::numeric_limits<std::int32_t>::min() ||
            step > std::numeric_limits<std::int32_t>::max()) {
          throw InvalidArgument(fmt::format(
              "row {}: range = {} m, allowed coordinates in [-2147483.648, 2147483.647] "
              "m",
              i, rows.range[i]));
        }
        output_.append_decimal(step, kMetreDecimals);
        comma();
      }
    } else {
      const auto depth = whole_steps(rows.range[i], kMillimetre);
      if (depth == 0) return false;
      if (depth > std::numeric_limits<std::uint32_t>::max()) {
        throw InvalidArgument(
            fmt::format("row {}: range = {} m, allowed up to 4294967.295 m", i, rows.range[i]));
      }
      output_.append_decimal(depth, kMetreDecimals);
      comma();
      output_.append_fixed(degrees_from_radians(rows.zenith[i]), kDegreeDecimals);
      comma();
      output_.append_fixed(degrees_0_to_360(rows.azimuth[i]), kDegreeDecimals);
      comma();
    }
    output_.append_decimal(rows.intensity[i], 0);
    comma();
    time_.append(output_, rows.time_ns[i]);
    if (variant_.return_number) {
      comma();
      output_.append_decimal(rows.return_number[i], 0);
    }
    if (variant_.tags) {
      const int tag = rows.tag[i];
      for (const int bits : {tag >> 2 & 3, tag >> 6 & 3, tag >> 4 & 3}) {
        comma();
        output_.append_decimal(bits, 0);
      }
    }
    output_.end_row();
    return true;
  }

  Variant variant_;
  TimeColumn time_{kTimeDecimals};
  OpenpylivoxRowFilter filter_;
  TextOutput output_;
};

}  // namespace

const Format kOpenpylivoxCsvFormat = {
    kOpenpylivoxCsvName,
    ".openpylivox.csv",
    "openpylivox text capture: points with intensity and time",
    [](std::string_view head) { return find_variant(normalized_header(head)) != nullptr; },
    open_with<OpenpylivoxCsvReader>,
    create_with<OpenpylivoxCsvWriter>,
};

}  // namespace risley::recordings
