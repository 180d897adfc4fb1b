// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The part before the first point: public header and variable length records.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/require.hpp"

#include "cloud/formats/las_bytes.hpp"
#include "cloud/formats/las_layout.hpp"

namespace risley::cloud::las {
namespace {

using recordings::las::kAdjustedGpsTime;
using recordings::las::kDescriptorBytes;
using recordings::las::kExtraBytesNumber;
using recordings::las::kRecordHeaderBytes;
using recordings::las::kSpecificationUser;

/// The 16 bits of a variable length record's length.
constexpr std::size_t kMaxRecordBytes = std::numeric_limits<std::uint16_t>::max();

/// Text in a field of fixed length, padded with zeros.
std::uint8_t* put_text(std::uint8_t* out, std::string_view text, std::size_t length) {
  std::memset(out, 0, length);
  std::memcpy(out, text.data(), std::min(text.size(), length));
  return out + length;
}

/// Allowed characters of header fields: printable ASCII.
std::string plain(std::string text) {
  std::ranges::replace_if(
      text, [](unsigned char c) { return c < 0x20 || c > 0x7e; }, '?');
  return text;
}

std::string system_identifier(const CloudHeader& header) {
  std::string text = header.sensor.empty() ? "OTHER" : header.sensor;
  if (!header.serial.empty()) text += " " + header.serial;
  return plain(text.substr(0, 32));
}

std::string generating_software(const CloudHeader& header) {
  std::string text = "risley";
  for (const auto& [name, value] : header.provenance) {
    if (name == "version") text += " " + value;
  }
  return plain(text.substr(0, 32));
}

void append_descriptor(std::string& data, const PointField& field) {
  std::array<std::uint8_t, kDescriptorBytes> bytes{};
  bytes[2] = names_of(field.type).las;
  put_text(bytes.data() + 4, field.name, 32);
  put_text(bytes.data() + 160, field.note, 32);
  data.append(bytes.begin(), bytes.end());
}

std::vector<PointField> extra_fields(const CloudHeader& header) {
  std::vector<PointField> fields = all_fields(header);
  std::erase_if(
      fields, [](const PointField& field) { return field.column->is(PointColumn::kInLasRecord); });
  std::stable_partition(fields.begin(), fields.end(),
                        [](const PointField& field) { return field.type == PointType::float32; });
  return fields;
}

/// The coordinate system of the points: a map, or the sensor's own or another frame in metres.
VariableLengthRecord coordinate_system(const CloudHeader& header) {
  std::string text = header.frame.wkt;
  if (text.empty() && header.frame.name != PointFrame{}.name) {
    text = fmt::format(
        "LOCAL_CS[\"frame of the {0}\",LOCAL_DATUM[\"{0} origin\",32767],"
        "UNIT[\"metre\",1],AXIS[\"X\",EAST],AXIS[\"Y\",NORTH],AXIS[\"Z\",UP]]",
        header.frame.name);
  } else if (text.empty()) {
    std::string name = plain(header.sensor.empty() ? "sensor" : header.sensor + " sensor");
    std::ranges::replace(name, '"', '\'');
    text = fmt::format(
        "LOCAL_CS[\"{} frame\",LOCAL_DATUM[\"sensor origin\",32767],UNIT[\"metre\",1],"
        "AXIS[\"X (forward)\",OTHER],AXIS[\"Y (left)\",OTHER],AXIS[\"Z (up)\",UP]]",
        name);
  }
  text.push_back('\0');
  return {"LASF_Projection", 2112, "OGC WKT coordinate system", std::move(text)};
}

/// Names of the loadings' factors, as text in record 99. docs/files/clouds.md
void append_factors(const CloudHeader& header, std::vector<VariableLengthRecord>& records) {
  std::string text =
      fmt::format("common_factors: 1\nof_one_source: {}\n", header.factors_of_source);
  for (const std::string& name : header.factors) text += fmt::format("factor: {}\n", name);
  text.push_back('\0');
  records.push_back({"risley", 99, "Common factors", std::move(text)});
}

/// The trajectory's errors: their description as text in record 100, the sensor's positions as
/// packed numbers in the records from 101 on. docs/files.md
void append_trajectory(const TrajectoryErrors& errors, std::vector<VariableLengthRecord>& records) {
  std::string text = "trajectory_errors: 1\n";
  const auto list = [&text](std::string_view name, std::span<const double> values) {
    text += fmt::format("{}: [{}]\n", name, fmt::join(values, ", "));
  };
  list("correlation_time_s", errors.correlation_time);
  list("white_m_and_rad", errors.white);
  text += fmt::format("sample_interval_s: {}\nfirst_sample_ns: {}\n", errors.sample_interval,
                      errors.first_sample_ns);
  list("north", errors.axes_from_ned[0]);
  list("east", errors.axes_from_ned[1]);
  list("down", errors.axes_from_ned[2]);
  text += fmt::format("positions: {}\n", errors.time_ns.size());
  text.push_back('\0');
  records.push_back({"risley", 100, "Errors of the trajectory", std::move(text)});
  constexpr std::size_t kRowBytes = 80, kRows = kMaxRecordBytes / kRowBytes;
  for (std::size_t first = 0; first < errors.time_ns.size(); first += kRows) {
    const std::size_t rows = std::min(kRows, errors.time_ns.size() - first);
    std::string data(rows * kRowBytes, '\0');
    auto* out = reinterpret_cast<std::uint8_t*>(data.data());
    for (std::size_t i = first; i < first + rows; ++i) {
      out = put<std::int64_t>(out, errors.time_ns[i]);
      for (const double value : errors.position[i]) out = put<double>(out, value);
      for (const double value : errors.sigma[i]) out = put<double>(out, value);
    }
    const std::size_t number = 101 + first / kRows;
    if (number > std::numeric_limits<std::uint16_t>::max()) {
      throw InvalidArgument(
          "positions of the trajectory do not fit into the records of a LAS file");
    }
    records.push_back({"risley", static_cast<std::uint16_t>(number), "Places of the trajectory",
                       std::move(data)});
  }
}

}  // namespace

Layout::Layout(const CloudHeader& header, const CloudWriterOptions& options)
    : scale_(options.las_scale),
      offset_(header.frame.offset),
      has_point_source_(header.has_point_source),
      utc_(header.time_reference == recordings::TimeReference::utc),
      gps_time_(utc_ && options.gps_time),
      date_(options.date),
      system_identifier_(las::system_identifier(header)),
      generating_software_(las::generating_software(header)),
      extra_(extra_fields(header)) {
  require_above("las_scale", scale_, 0, "m");
  std::string descriptors;
  for (const PointField& field : extra_.fields()) append_descriptor(descriptors, field);
  if (descriptors.size() > kMaxRecordBytes) {
    const std::size_t others = extra_.fields().size() - 3 * header.factors.size();
    throw InvalidArgument(fmt::format("factors = {}, allowed up to {} in a LAS file",
                                      header.factors.size(),
                                      (kMaxRecordBytes / kDescriptorBytes - others) / 3));
  }
  records_.push_back(
      {kSpecificationUser, kExtraBytesNumber, "Extra bytes", std::move(descriptors)});
  records_.push_back(coordinate_system(header));
  if (!header.factors.empty()) append_factors(header, records_);
  if (header.trajectory) append_trajectory(*header.trajectory, records_);
  std::string text;
  for (const auto& [name, value] : header.provenance) text += fmt::format("{} = {}\n", name, value);
  if (text.empty()) return;
  text.push_back('\0');
  if (text.size() > kMaxRecordBytes) {
    throw InvalidArgument(
        fmt::format("provenance = {} bytes of text, allowed up to {} in a LAS file",
                    text.size() - 1, kMaxRecordBytes - 1));
  }
  records_.push_back({kSpecificationUser, 3, "How the cloud was made", std::move(text)});
}

std::uint16_t Layout::global_encoding() const {
  constexpr unsigned kWkt = 1U << 4;
  return static_cast<std::uint16_t>(kWkt | (gps_time_ ? kAdjustedGpsTime : 0U));
}

HeaderNumbers Layout::numbers(const Summary& summary) const {
  HeaderNumbers numbers;
  if (summary.points == 0) return numbers;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    // A negative zero would be another byte pattern for the same box.
    numbers.low[axis] = std::nearbyint(summary.low[axis]) * scale_ + offset_[axis] + 0.0;
    numbers.high[axis] = std::nearbyint(summary.high[axis]) * scale_ + offset_[axis] + 0.0;
  }
  using namespace std::chrono;
  std::optional<sys_days> day = date_;
  if (utc_) day = floor<days>(sys_time<nanoseconds>{nanoseconds{summary.first_time_ns}});
  if (day) {
    const year_month_day date{*day};
    const sys_days new_year{date.year() / January / 1};
    numbers.creation_day = static_cast<std::uint16_t>((*day - new_year).count() + 1);
    numbers.creation_year = static_cast<std::uint16_t>(static_cast<int>(date.year()));
  }
  return numbers;
}

std::vector<std::uint8_t> Layout::head(const Summary& summary) const {
  std::size_t length = header_bytes();
  for (const VariableLengthRecord& record : records_)
    length += kRecordHeaderBytes + record.data.size();
  std::vector<std::uint8_t> bytes(length, 0);
  const HeaderNumbers numbers = this->numbers(summary);

  std::uint8_t* out = put_text(bytes.data(), "LASF", 4);
  out = put<std::uint16_t>(out, 1);  // file source
  out = put<std::uint16_t>(out, global_encoding());
  out += 16;  // project: none
  out = put<std::uint8_t>(out, 1);
  out = put<std::uint8_t>(out, 4);
  out = put_text(out, system_identifier_, 32);
  out = put_text(out, generating_software_, 32);
  out = put<std::uint16_t>(out, numbers.creation_day);
  out = put<std::uint16_t>(out, numbers.creation_year);
  out = put<std::uint16_t>(out, static_cast<std::uint16_t>(header_bytes()));
  out = put<std::uint32_t>(out, static_cast<std::uint32_t>(length));
  out = put<std::uint32_t>(out, static_cast<std::uint32_t>(records_.size()));
  out = put<std::uint8_t>(out, point_format());
  out = put<std::uint16_t>(out, static_cast<std::uint16_t>(record_bytes()));
  out += 6 * 4;  // the legacy counters, which point formats from 6 on leave 0
  for (int axis = 0; axis < 3; ++axis) out = put<double>(out, scale_);
  for (const double offset : offset_) out = put<double>(out, offset);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    out = put<double>(out, numbers.high[axis]);
    out = put<double>(out, numbers.low[axis]);
  }
  out += 8 + 8 + 4;  // no waveforms, no extended variable length records
  out = put<std::uint64_t>(out, summary.points);
  for (const std::uint64_t count : summary.points_by_return) out = put<std::uint64_t>(out, count);
  for (const VariableLengthRecord& record : records_) {
    out += 2;  // reserved
    out = put_text(out, record.user, 16);
    out = put<std::uint16_t>(out, record.number);
    out = put<std::uint16_t>(out, static_cast<std::uint16_t>(record.data.size()));
    out = put_text(out, record.description, 32);
    std::memcpy(out, record.data.data(), record.data.size());
    out += record.data.size();
  }
  return bytes;
}

}  // namespace risley::cloud::las
