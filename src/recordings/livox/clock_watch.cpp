// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/recordings/livox/clock_watch.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "risley/core/saturating.hpp"

namespace risley::recordings::livox {
namespace {

constexpr std::int64_t kWatchedSecond = 1'000'000'000;  // ns

/// A field of a status: its place, and the meaning of its values; empty for normal ones.
struct StatusField {
  unsigned at, mask;
  std::array<const char*, 5> words;
};
constexpr const char* kUnknownValue = "unknown value";
constexpr StatusField kStatusFields[] = {
    {0, 3, {"", "temperature: high or low", "temperature: extreme", kUnknownValue, ""}},
    {2, 3, {"", "voltage: high", "voltage: extreme", kUnknownValue, ""}},
    {4, 3, {"", "motor: warning", "motor: error", kUnknownValue, ""}},
    {6, 3, {"", "window: dirty or blocked", kUnknownValue, kUnknownValue, ""}},
    {8, 1, {"", "firmware: error", "", "", ""}},
    {9, 1, {"", "PPS signal", "", "", ""}},
    {10, 1, {"", "end of life: warning", "", "", ""}},
    {11, 1, {"", "fan: warning", "", "", ""}},
    {12, 1, {"", "self-heating", "", "", ""}},
    {13, 1, {"", "PTP signal", "", "", ""}},
    {14,
     7,
     {"", "synchronised by PTP", "synchronised by GPS", "synchronised by PPS",
      "synchronisation: abnormal"}},
    {30, 3, {"", "system: warning", "system: error", kUnknownValue, ""}},
};

}  // namespace

std::vector<std::string> status_words(std::uint32_t status) {
  std::vector<std::string> said;
  for (const StatusField& field : kStatusFields) {
    const unsigned value = status >> field.at & field.mask;
    const std::string words = value < field.words.size() ? field.words[value] : kUnknownValue;
    if (!words.empty()) said.push_back(words);
  }
  return said;
}

void ClockWatch::Line::add(std::int64_t host_ns, std::int64_t offset_ns) {
  if (points == 0) {
    begin_host_ns = host_ns;
    begin_offset_ns = offset_ns;
  }
  const double x = 1e-9 * static_cast<double>(host_ns - begin_host_ns);
  const auto y = static_cast<double>(offset_ns - begin_offset_ns);
  ++points;
  const double before_x = x - mean_x, before_y = y - mean_y;
  mean_x += before_x / points;
  mean_y += before_y / points;
  xx += before_x * (x - mean_x);
  xy += before_x * (y - mean_y);
  yy += before_y * (y - mean_y);
}

std::optional<ClockDrift> ClockWatch::Line::drift() const {
  constexpr double kFewest = 5, kPpm = 1e-3;  // ns a second
  if (points < kFewest || !(xx > 0)) return std::nullopt;
  const double slope = xy / xx;
  const double rest = std::max(yy - slope * xy, 0.0);
  return ClockDrift{kPpm * slope, kPpm * std::sqrt(rest / (points - 2) / xx)};
}

void ClockWatch::add(std::uint8_t timestamp_type, std::uint32_t status, std::int64_t time_ns,
                     std::int64_t host_ns) {
  if (status_ != status) {
    status_ = status;
    if (changes_.size() < kMostChanges) changes_.push_back({host_ns, status});
  }
  if (stretches_.size() > kMostStretches) return;
  const std::int64_t offset = saturating_difference(time_ns, host_ns);
  if (jumped_ || stretches_.back().timestamp_type != timestamp_type) {
    end_second();
    jumped_ = false;
    line_ = {};
    stretches_.push_back({timestamp_type, host_ns, host_ns, offset, offset, {}});
    best_ = {saturating_sum(host_ns, kWatchedSecond), host_ns, offset};
  }
  if (host_ns >= best_.second_ends_ns) {
    end_second();
    best_ = {saturating_sum(host_ns, kWatchedSecond), host_ns, offset};
  }
  stretches_.back().host_to_ns = host_ns;
  if (offset > best_.offset_ns) {
    best_.host_ns = host_ns;
    best_.offset_ns = offset;
  }
}

/// The best packet of the second is used.
void ClockWatch::end_second() {
  if (stretches_.empty()) return;
  ClockStretch& stretch = stretches_.back();
  if (line_.points == 0) stretch.least_offset_ns = stretch.greatest_offset_ns = best_.offset_ns;
  stretch.least_offset_ns = std::min(stretch.least_offset_ns, best_.offset_ns);
  stretch.greatest_offset_ns = std::max(stretch.greatest_offset_ns, best_.offset_ns);
  line_.add(best_.host_ns, best_.offset_ns);
  stretch.drift = line_.drift();
}

std::vector<ClockStretch> ClockWatch::stretches() const {
  ClockWatch ended = *this;
  ended.end_second();
  ended.stretches_.resize(std::min(ended.stretches_.size(), kMostStretches));
  return ended.stretches_;
}

}  // namespace risley::recordings::livox
