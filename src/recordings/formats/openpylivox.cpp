// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "recordings/formats/openpylivox.hpp"

#include <charconv>
#include <cmath>
#include <string>

#include <fmt/format.h>

#include "risley/core/error.hpp"

#include "recordings/formats/format.hpp"

namespace risley::recordings {
namespace {

constexpr const char* kContent = "content";  ///< "imu" for inertial samples
constexpr const char* kFirmwareType = "firmware_type";
constexpr const char* kDataType = "data_type";

std::optional<int> whole_number(const std::string& text, int low, int high) {
  int value = 0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  if (result.ec != std::errc() || value < low || value > high) return std::nullopt;
  return value;
}

}  // namespace

OpenpylivoxLayout openpylivox_layout(const RecordingHeader& header) {
  OpenpylivoxLayout layout;
  const std::string source = source_format(header);
  const bool own = source == kOpenpylivoxCsvName || source == kOpenpylivoxBinName;
  layout.imu = own && header.detail(kContent) == "imu";
  if (layout.imu) return layout;
  if (!header.has_range) {
    throw InvalidArgument(
        fmt::format("a {} recording has no ranges; openpylivox files hold points, which need them",
                    header.format));
  }
  if (own) {
    const auto firmware_type = whole_number(header.detail(kFirmwareType), 1, 3);
    const auto data_type = whole_number(header.detail(kDataType), 0, 5);
    if (firmware_type && data_type && (*firmware_type == 1 || *data_type <= 1)) {
      layout.firmware_type = *firmware_type;
      layout.data_type = *data_type;
      return layout;
    }
  }
  const int first = header.cartesian ? 0 : 1;
  const bool tags = !header.devices.empty() && header.devices.front().type != kMid40;
  const int most_returns = tags ? 2 : 3;
  if (header.returns_per_shot < 1 || header.returns_per_shot > most_returns) {
    throw InvalidArgument(
        fmt::format("returns_per_shot = {}, an openpylivox file of a {} holds 1 "
                    "to {}",
                    header.returns_per_shot, tags ? "tagged sensor" : "Mid-40", most_returns));
  }
  if (tags) {
    layout.data_type = first + 2 * header.returns_per_shot;
  } else {
    layout.data_type = first;
    layout.firmware_type = header.returns_per_shot;
  }
  return layout;
}

void describe_openpylivox(RecordingHeader& header, const OpenpylivoxLayout& layout) {
  header.devices.resize(1);
  if (layout.imu) {
    header.has_range = header.has_intensity = false;
    header.devices.front().type = kUnknownDeviceType;
    header.set_detail(kContent, "imu");
    return;
  }
  header.cartesian = layout.cartesian();
  header.returns_per_shot = layout.returns_per_shot();
  header.devices.front().type = layout.tagged() ? kUnknownDeviceType : kMid40;
  header.set_detail(kFirmwareType, std::to_string(layout.firmware_type));
  header.set_detail(kDataType, std::to_string(layout.data_type));
}

bool OpenpylivoxRowFilter::accepts(const Observations& rows, std::size_t row) {
  const std::uint64_t number = rows_seen_++;
  if (rows.valid[row] == 0) return false;
  const double range = rows.range[row];
  if (!std::isfinite(range) || range < 0.0) {
    throw InvalidArgument(
        fmt::format("row {}: range {} m; openpylivox files need a range >= 0", number, range));
  }
  if (range == 0.0) return false;
  if (!std::isfinite(rows.azimuth[row]) || !std::isfinite(rows.zenith[row])) {
    throw InvalidArgument(fmt::format("row {}: azimuth {} rad, zenith {} rad; expected numbers",
                                      number, rows.azimuth[row], rows.zenith[row]));
  }
  if (!device_) device_ = rows.device[row];
  if (*device_ != rows.device[row]) {
    throw InvalidArgument(
        fmt::format("row {}: device {} after device {}; an openpylivox file "
                    "holds one sensor",
                    number, rows.device[row], *device_));
  }
  return true;
}

}  // namespace risley::recordings
