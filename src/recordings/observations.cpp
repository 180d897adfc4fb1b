// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/recordings/observations.hpp"

#include <tuple>

namespace risley::recordings {
namespace {

/// Applies a function to every column; the one place that lists them all.
template <class Function, class... Columns>
void for_each_column(Function&& function, Columns&... o) {
  function(o.time_ns...);
  function(o.azimuth...);
  function(o.zenith...);
  function(o.range...);
  function(o.azimuth_resolution...);
  function(o.zenith_resolution...);
  function(o.range_resolution...);
  function(o.intensity...);
  function(o.return_number...);
  function(o.tag...);
  function(o.beam...);
  function(o.device...);
  function(o.valid...);
}

}  // namespace

void Observations::clear() {
  for_each_column([](auto& column) { column.clear(); }, *this);
}

void Observations::resize(std::size_t rows) {
  for_each_column([rows](auto& column) { column.resize(rows); }, *this);
}

void Observations::append(const Observations& other) {
  for_each_column(
      [](auto& column, const auto& more) { column.insert(column.end(), more.begin(), more.end()); },
      *this, other);
}

void Observations::drop_front(std::size_t rows) {
  for_each_column(
      [rows](auto& column) {
        column.erase(column.begin(), column.begin() + static_cast<std::ptrdiff_t>(rows));
      },
      *this);
}

void Chunk::clear() {
  observations.clear();
  packets.clear();
  imu.clear();
}

std::string device_type_name(std::uint8_t type) {
  switch (type) {
    case 0:
      return "Livox Hub";
    case 1:
      return "Livox Mid-40";
    case 2:
      return "Livox Tele-15";
    case 3:
      return "Livox Horizon";
    case 6:
      return "Livox Mid-70";
    case 7:
      return "Livox Avia";
    default:
      return "unknown";
  }
}

std::string to_string(TimeReference reference) {
  switch (reference) {
    case TimeReference::relative:
      return "relative";
    case TimeReference::power_on:
      return "power-on";
    case TimeReference::ptp:
      return "PTP";
    case TimeReference::utc:
      return "UTC";
    case TimeReference::pps:
      return "PPS";
  }
  return "relative";
}

std::string RecordingHeader::detail(const std::string& name, const std::string& fallback) const {
  for (const auto& [key, value] : details) {
    if (key == name) return value;
  }
  return fallback;
}

void RecordingHeader::set_detail(const std::string& name, const std::string& value) {
  for (auto& [key, old] : details) {
    if (key == name) {
      old = value;
      return;
    }
  }
  details.emplace_back(name, value);
}

}  // namespace risley::recordings
