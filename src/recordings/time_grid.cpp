// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "recordings/time_grid.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <string>

#include <fmt/format.h>

#include "risley/core/median.hpp"
#include "risley/core/saturating.hpp"
#include "risley/core/setting.hpp"

#include "recordings/time_order.hpp"

namespace risley::recordings {
namespace {

constexpr std::size_t kFewestShots = 40;      // fewer show no grid
constexpr std::size_t kFewestOfPart = 256;    // shots put on a grid together
constexpr std::size_t kMostOfPart = 1 << 16;  // over which a clock keeps its rate
constexpr double kExact_ns = 2.0;             // what whole nanoseconds leave
constexpr double kDouble_ns = 50.0;           // rounding of seconds since 1970 as doubles
constexpr double kRounded_ns = 10.0;          // smaller common divisors of times are coincidences
constexpr double kSlack = 1.02;               // of half a rounding step
constexpr double kLargestOff = 0.3;           // of a step, if the rounding is not known
constexpr std::int64_t kLongestPause_ns = 500'000'000;

/// Calls part(begin, end) for stretches without a pause or a step back.
template <class Part>
void for_each_stretch(const std::vector<std::int64_t>& time_ns, Part&& part) {
  std::size_t begin = 0;
  for (std::size_t i = 1; i <= time_ns.size(); ++i) {
    if (i < time_ns.size()) {
      const std::int64_t step = saturating_difference(time_ns[i], time_ns[i - 1]);
      if (step >= 0 && step <= kLongestPause_ns) continue;
    }
    part(begin, i);
    begin = i;
  }
}

std::string duration_text(double ns) {
  if (ns >= 1e6) return fmt::format("{:.4g} ms", 1e-6 * ns);
  return ns >= 1e3 ? fmt::format("{:.4g} us", 1e-3 * ns) : fmt::format("{:.3g} ns", ns);
}

}  // namespace

TimeGrid::TimeGrid(const Observations& rows, std::span<const std::size_t> of_device) {
  Shots shots = shots_of(rows, of_device);
  std::size_t equal = 0, returns = 0;
  for (std::size_t i = 1; i < shots.size(); ++i) {
    if (shots.time_ns[i] != shots.time_ns[i - 1]) continue;
    ++equal;
    const std::size_t row = of_device[shots.begin[i]];
    returns += row > 0 && is_further_return(rows, row) ? 1 : 0;
  }
  if (2 * returns > equal) {
    equal_times_are_returns_ = true;
    shots = shots_of(rows, of_device);
    equal = 0;
  }
  shots_ = shots.size();
  equal_times_ = equal;
  if (shots.size() < kFewestShots) return;
  std::int64_t divisor = 0, least = 0;
  for (std::size_t i = 1; i < shots.size(); ++i) {
    const std::int64_t step = saturating_difference(shots.time_ns[i], shots.time_ns[i - 1]);
    if (step == 0) continue;
    divisor = std::gcd(divisor, step);
    if (step > 0 && (least == 0 || step < least)) least = step;
  }
  if (equal == 0 && divisor == least) return;  // whole steps from shot to shot
  rounding_ns_ = static_cast<double>(divisor);
  // Floating-point numbers are not multiples of a decimal step.
  if (rounding_ns_ < kRounded_ns) rounding_ns_ = equal > 0 ? static_cast<double>(least) : 0.0;
  learn_emitters(shots);
  try_kinds(shots);
}

TimeGrid::Shots TimeGrid::shots_of(const Observations& rows,
                                   std::span<const std::size_t> of_device) const {
  Shots shots;
  for (std::size_t i = 0; i < of_device.size(); ++i) {
    const std::size_t row = of_device[i];
    const bool equal = shots.size() > 0 && rows.time_ns[row] == shots.time_ns.back();
    if (equal && (equal_times_are_returns_ || rows.return_number[row] > 1)) continue;
    shots.begin.push_back(i);
    shots.time_ns.push_back(rows.time_ns[row]);
    shots.beam.push_back(rows.beam[row]);
  }
  shots.begin.push_back(of_device.size());
  return shots;
}

/// The order in which emitters fire, from the first shots of each in turn.
void TimeGrid::learn_emitters(const Shots& shots) {
  std::set<std::uint8_t> seen(shots.beam.begin(), shots.beam.end());
  emitters_ = static_cast<int>(seen.size());
  const std::size_t count = seen.size();
  for (std::size_t i = 0; i + count <= shots.size(); ++i) {
    const auto first = shots.beam.begin() + static_cast<std::ptrdiff_t>(i);
    const std::set<std::uint8_t> round(first, first + static_cast<std::ptrdiff_t>(count));
    if (round.size() != count || shots.time_ns[i] != shots.time_ns[i + count - 1]) continue;
    for (std::size_t place = 0; place < count; ++place) {
      place_of_beam_[shots.beam[i + place]] = static_cast<std::uint8_t>(place);
    }
    return;
  }
  std::uint8_t place = 0;
  for (const std::uint8_t beam : seen) place_of_beam_[beam] = place++;
}

void TimeGrid::try_kinds(const Shots& shots) {
  // The longest stretch decides.
  std::size_t begin = 0, end = 0;
  for_each_stretch(shots.time_ns, [&](std::size_t from, std::size_t to) {
    if (to - from > end - begin) {
      begin = from;
      end = to;
    }
  });
  end = std::min(end, begin + kMostOfPart);
  if (end - begin < kFewestShots || shots.time_ns[begin] == shots.time_ns[end - 1]) return;
  std::vector<std::int64_t> steps;
  for (std::size_t i = begin + 1; i < end; ++i) {
    const std::int64_t step = shots.time_ns[i] - shots.time_ns[i - 1];
    if (step > 0) steps.push_back(step);
  }
  const auto usual = static_cast<double>(upper_median(steps));
  const auto mean = static_cast<double>(shots.time_ns[end - 1] - shots.time_ns[begin]) /
                    static_cast<double>(end - begin - 1);
  const auto is_it = [&](Kind kind, double step_ns) {
    if (kind == Kind::finer && 2 * rounding_ns_ > std::max(step_ns, usual)) return false;
    kind_ = kind;
    const Fit found = fit(shots, begin, end, kind, step_ns);
    step_ns_ = found.step_ns;
    if (agrees(found)) return true;
    kind_ = Kind::none;
    return false;
  };
  bool found = false;
  if (equal_times_ == 0) {
    found = is_it(Kind::finer, usual);
    for (const double known : kKnownSteps_ns) found = found || is_it(Kind::finer, known);
  }
  if (!found && rounding_ns_ > 0) found = is_it(Kind::counted, mean);
  if (!found && rounding_ns_ > 0 && emitters_ > 1) {
    for (const double known : kKnownSteps_ns) {
      found = found ||
              (emitters_ * known >= kSlack * rounding_ns_ * 0.95 && is_it(Kind::emitters, known));
    }
  }
  unexplained_ = !found && (equal_times_ > 0 || rounding_ns_ > 100);
  if (!found) return;
  const Fit whole = fit(shots, begin, end, kind_, step_ns_);
  if (whole.largest_ns <= (rounding_ns_ > 0 ? kExact_ns : kDouble_ns)) {
    kind_ = Kind::none;
    return;
  }
  if (rounding_ns_ > 0) return;
  // Times of packets that are not quite even are not rounded: steps between shots are exact.
  std::size_t exact = 0;
  for (std::size_t i = begin + 1; i < end; ++i) {
    const auto step = static_cast<double>(shots.time_ns[i] - shots.time_ns[i - 1]);
    const double off = step - std::round(step / whole.step_ns) * whole.step_ns;
    exact += std::abs(off) <= kExact_ns ? 1 : 0;
  }
  if (2 * exact > end - begin) kind_ = Kind::none;
}

void TimeGrid::number_shots(const Shots& shots, std::size_t begin, std::size_t end, Kind kind,
                            Fit& fit) const {
  fit.number.assign(end - begin, 0);
  for (std::size_t i = begin; i < end; ++i) {
    std::int64_t& number = fit.number[i - begin];
    const std::int64_t before = i > begin ? fit.number[i - begin - 1] : -1;
    if (kind == Kind::counted) {
      number = before + 1;
    } else if (kind == Kind::finer) {
      if (i == begin) continue;
      const auto step = static_cast<double>(shots.time_ns[i] - shots.time_ns[i - 1]);
      number = before + std::max<std::int64_t>(1, std::llround(step / fit.step_ns));
    } else {
      // The number nearest to the time among those of the emitter.
      const double since = static_cast<double>(shots.time_ns[i] - fit.origin_ns) - fit.offset_ns;
      const int place = place_of_beam_[shots.beam[i]];
      const double rounds = (since / fit.step_ns - place) / emitters_;
      number = std::llround(rounds) * emitters_ + place;
      fit.ascending = fit.ascending && (i == begin || number > before);
    }
  }
}

TimeGrid::Fit TimeGrid::fit(const Shots& shots, std::size_t begin, std::size_t end, Kind kind,
                            double step_ns) const {
  if (kind != Kind::emitters) return line(shots, begin, end, kind, {.step_ns = step_ns});
  // The first time may have been rounded up or down.
  const double place = place_of_beam_[shots.beam[begin]];
  Fit found;
  constexpr int kGuesses = 12;
  for (int guess = 0; guess <= kGuesses; ++guess) {
    const double share = static_cast<double>(guess) / kGuesses - 0.5;
    found = line(shots, begin, end, kind,
                 {.offset_ns = share * rounding_ns_ - place * step_ns, .step_ns = step_ns});
    if (agrees(found)) break;
  }
  return found;
}

TimeGrid::Fit TimeGrid::line(const Shots& shots, std::size_t begin, std::size_t end, Kind kind,
                             Fit fit) const {
  constexpr int kRounds = 4;
  fit.origin_ns = shots.time_ns[begin];
  const auto count = static_cast<double>(end - begin);
  for (int round = 0; round < kRounds; ++round) {
    fit.ascending = true;
    number_shots(shots, begin, end, kind, fit);
    double mean_number = 0, mean_time = 0, square = 0, product = 0;
    for (std::size_t i = begin; i < end; ++i) {
      mean_number += static_cast<double>(fit.number[i - begin]) / count;
      mean_time += static_cast<double>(shots.time_ns[i] - fit.origin_ns) / count;
    }
    for (std::size_t i = begin; i < end; ++i) {
      const double number = static_cast<double>(fit.number[i - begin]) - mean_number;
      square += number * number;
      product += number * (static_cast<double>(shots.time_ns[i] - fit.origin_ns) - mean_time);
    }
    if (!(square > 0) || !(product > 0)) {
      fit.ascending = false;
      return fit;
    }
    fit.step_ns = product / square;
    fit.offset_ns = mean_time - fit.step_ns * mean_number;
  }
  double low = 0, high = 0;
  for (std::size_t i = begin; i < end; ++i) {
    const double off = static_cast<double>(shots.time_ns[i] - fit.origin_ns) - fit.offset_ns -
                       fit.step_ns * static_cast<double>(fit.number[i - begin]);
    low = i == begin ? off : std::min(low, off);
    high = i == begin ? off : std::max(high, off);
  }
  fit.largest_ns = 0.5 * (high - low);
  return fit;
}

bool TimeGrid::agrees(const Fit& fit) const {
  if (!fit.ascending) return false;
  const double allowed =
      rounding_ns_ > 0 ? 0.5 * kSlack * rounding_ns_ + kExact_ns : kLargestOff * fit.step_ns;
  return fit.largest_ns <= allowed;
}

std::size_t TimeGrid::apply(Observations& rows, std::span<const std::size_t> of_device) const {
  if (!is_needed()) return 0;
  const Shots shots = shots_of(rows, of_device);
  std::size_t left = 0;
  for_each_stretch(shots.time_ns, [&](std::size_t begin, std::size_t end) {
    const std::size_t parts = (end - begin + kMostOfPart - 1) / kMostOfPart;
    for (std::size_t part = 0; part < parts; ++part) {
      left += snap(rows, of_device, shots, begin + (end - begin) * part / parts,
                   begin + (end - begin) * (part + 1) / parts);
    }
  });
  return left;
}

/// A stretch, or its halves if a clock changed its rate or shots are missing.
std::size_t TimeGrid::snap(Observations& rows, std::span<const std::size_t> of_device,
                           const Shots& shots, std::size_t begin, std::size_t end) const {
  if (end - begin >= kFewestShots) {
    const Fit found = fit(shots, begin, end, kind_, step_ns_);
    if (agrees(found)) {
      for (std::size_t i = begin; i < end; ++i) {
        const double since =
            found.offset_ns + found.step_ns * static_cast<double>(found.number[i - begin]);
        const std::int64_t time_ns = found.origin_ns + std::llround(since);
        for (std::size_t place = shots.begin[i]; place < shots.begin[i + 1]; ++place) {
          rows.time_ns[of_device[place]] = time_ns;
        }
      }
      return 0;
    }
  }
  if (end - begin < 2 * kFewestOfPart) return end - begin;
  const std::size_t middle = begin + (end - begin) / 2;
  return snap(rows, of_device, shots, begin, middle) + snap(rows, of_device, shots, middle, end);
}

std::optional<Warning> TimeGrid::warning() const {
  const std::string rounded =
      rounding_ns_ > 0 ? fmt::format("times are rounded to {}", duration_text(rounding_ns_))
                       : std::string("times are rounded");
  const WarningCode code = kind_ == Kind::none ? kWarning.times_coarse : kWarning.times_corrected;
  if (kind_ == Kind::finer) {
    return Warning{
        code,
        fmt::format("{}: they were snapped to their common even grid of {:.8g} shots per second",
                    rounded, 1e9 / step_ns_)};
  }
  if (kind_ != Kind::none) {
    return Warning{
        code,
        fmt::format(
            "{}, and {} of {} shots share that of the shot before: they were spread in the "
            "order of the file over an even grid of {:.8g} shots per second, which explains all "
            "times",
            rounded, equal_times_, shots_, 1e9 / step_ns_)};
  }
  if (!unexplained_) return std::nullopt;
  if (equal_times_ == 0) {
    return Warning{
        code,
        fmt::format("{} and show no even grid of shots: the rounding is not counted in any sigma",
                    rounded)};
  }
  return Warning{
      code, fmt::format("{}, and {} of {} shots share that of the shot before, which an estimation "
                        "cannot use: no even grid of shots explains the times, as where shots are "
                        "missing. {} counts shots, where none is missing",
                        rounded, equal_times_, shots_, name_of(kSetting.shot_rate))};
}

}  // namespace risley::recordings
