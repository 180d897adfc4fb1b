// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/recordings/observations.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"

namespace risley::recordings {

static_assert(lists_all_columns<Observations, kObservationColumns>());

void Observations::clear() {
  for_each_column<kObservationColumns>([](auto& column) { column.clear(); }, *this);
}

void Observations::resize(std::size_t rows) {
  for_each_column<kObservationColumns>([rows](auto& column) { column.resize(rows); }, *this);
}

void Observations::reserve(std::size_t rows) {
  for_each_column<kObservationColumns>([rows](auto& column) { column.reserve(rows); }, *this);
}

void Observations::append(const Observations& other) { append(other, 0, other.size()); }

void Observations::append(const Observations& other, std::size_t begin, std::size_t end) {
  require_columns(other);
  require_rows("rows", begin, end, other.size());
  for_each_column<kObservationColumns>(
      [begin, end](auto& column, const auto& more) {
        column.insert(column.end(), more.begin() + static_cast<std::ptrdiff_t>(begin),
                      more.begin() + static_cast<std::ptrdiff_t>(end));
      },
      *this, other);
}

void Observations::append(const Observations& other, std::span<const std::size_t> rows) {
  require_columns(other);
  for (const std::size_t row : rows) require_place("rows", row, other.size());
  for_each_column<kObservationColumns>(
      [rows](auto& column, const auto& more) {
        column.reserve(column.size() + rows.size());
        for (const std::size_t row : rows) column.push_back(more[row]);
      },
      *this, other);
}

void Observations::drop_front(std::size_t rows) {
  require_columns(*this);
  require_rows("rows", 0, rows, size());
  for_each_column<kObservationColumns>(
      [rows](auto& column) {
        column.erase(column.begin(), column.begin() + static_cast<std::ptrdiff_t>(rows));
      },
      *this);
}

void require_columns(const Observations& rows) {
  for_each_entry<kObservationColumns>(
      [&rows](const auto& entry, const auto& column) {
        require_length(entry.name, column.size(), rows.size());
      },
      rows);
}

void mark_valid(Observations& rows) {
  rows.valid.resize(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows.valid[i] =
        std::isfinite(rows.azimuth[i]) && std::isfinite(rows.zenith[i]) && !(rows.range[i] <= 0);
  }
}

void require_angles(const Observations& rows) {
  require_columns(rows);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (rows.valid[i] == 0) continue;
    const double azimuth = rows.azimuth[i], zenith = rows.zenith[i];
    if (!(std::abs(azimuth) <= kPi)) {
      throw InvalidArgument(
          fmt::format("azimuth = {} rad in row {}, allowed -pi to pi", azimuth, i));
    }
    if (!(zenith >= 0 && zenith <= kPi)) {
      throw InvalidArgument(fmt::format("zenith = {} rad in row {}, allowed 0 to pi", zenith, i));
    }
  }
}

bool is_further_return(const Observations& rows, std::size_t row) {
  const std::size_t before = row - 1;
  if (rows.time_ns[row] != rows.time_ns[before] || rows.device[row] != rows.device[before]) {
    return false;
  }
  if (rows.return_number[row] > 1) return true;
  if (rows.beam[row] != rows.beam[before] || rows.valid[row] == 0 || rows.valid[before] == 0) {
    return false;
  }
  const auto close = [row, before](const std::vector<double>& angle,
                                   const std::vector<float>& resolution) {
    constexpr double kLeast = 1e-7, kSteps = 0.75;  // rad, of each row's rounding
    const double step =
        static_cast<double>(resolution[row]) + static_cast<double>(resolution[before]);
    return std::abs(std::remainder(angle[row] - angle[before], kTwoPi)) <= kLeast + kSteps * step;
  };
  return close(rows.azimuth, rows.azimuth_resolution) && close(rows.zenith, rows.zenith_resolution);
}

void Chunk::clear() {
  observations.clear();
  packets.clear();
  imu.clear();
  packet_begins.clear();
}

void Chunk::append(Chunk&& next) {
  const std::size_t rows = observations.size();
  if (rows == 0 && packets.empty() && imu.empty()) {
    std::swap(*this, next);
    return;
  }
  for (const std::size_t row : next.packet_begins) packet_begins.push_back(rows + row);
  observations.append(next.observations);
  packets.insert(packets.end(), next.packets.begin(), next.packets.end());
  imu.insert(imu.end(), next.imu.begin(), next.imu.end());
}

const LivoxType* livox_type(std::uint8_t number) {
  const auto* const found =
      std::find_if(kLivoxTypes.begin(), kLivoxTypes.end(),
                   [number](const LivoxType& type) { return type.number == number; });
  return found == kLivoxTypes.end() ? nullptr : found;
}

std::string livox_types_text(bool first_generation) {
  std::string text;
  for (const LivoxType& type : kLivoxTypes) {
    if (type.first_generation != first_generation) continue;
    text += fmt::format("{}{} ({})", text.empty() ? "" : ", ", type.number, type.name);
  }
  return text;
}

bool is_second_generation(std::uint8_t type) {
  const LivoxType* known = livox_type(type);
  return known != nullptr && !known->first_generation;
}

std::string device_type_name(std::uint8_t type) {
  if (type == 0) return "Livox Hub";
  const LivoxType* known = livox_type(type);
  return known != nullptr ? fmt::format("Livox {}", known->name) : "unknown";
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

std::string RecordingHeader::device_detail(const Device& device, const std::string& name) const {
  return detail(fmt::format("device_{}_{}", device.index, name));
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
