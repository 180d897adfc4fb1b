// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "recordings/time_order.hpp"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <tuple>

#include "risley/core/median.hpp"
#include "risley/core/saturating.hpp"
#include "risley/recordings/reader.hpp"

namespace risley::recordings {
namespace {

/// Consecutive rows in ascending time, [begin, end) of those judged.
struct Run {
  std::size_t begin, end;
  std::int64_t first_ns, last_ns;

  std::size_t size() const { return end - begin; }
  std::int64_t span_ns() const { return last_ns - first_ns; }
};

/// A clock is not reset more often; disordered rows have shorter runs.
constexpr std::size_t kFewestBetweenResets = 1000;
/// No message is longer, ns.
constexpr std::int64_t kLongestMessage = 1'000'000'000;
/// Blocks that changed places are of one recording, ns.
constexpr std::int64_t kFarthestBlock = 10'000'000'000;
/// Steps up to this multiple of the usual one are not gaps.
constexpr double kLongestStep = 1.8;

class Judge {
 public:
  Judge(const Observations& rows, std::span<const std::size_t> which) : rows_(rows), which_(which) {
    std::int64_t latest = time(0);
    runs_.push_back({0, 1, latest, latest});
    std::vector<std::int64_t> steps;
    for (std::size_t i = 1; i < which.size(); ++i) {
      const std::int64_t step = saturating_difference(time(i), time(i - 1));
      if (step < 0) runs_.push_back({i, i, time(i), time(i)});
      runs_.back().end = i + 1;
      runs_.back().last_ns = time(i);
      if (step > 0) steps.push_back(step);
      depth_ = std::max(depth_, saturating_difference(latest, time(i)));
      latest = std::max(latest, time(i));
    }
    if (steps.empty()) return;
    usual_step_ = static_cast<double>(upper_median(steps));
  }

  OrderJudgement judgement(bool in_packets) const {
    OrderJudgement result{RowOrder::ascending, depth_, 0};
    if (runs_.size() == 1) {
      constexpr std::size_t kFewest = 40;
      const bool moves = runs_.front().first_ns != runs_.front().last_ns;
      if (!moves && which_.size() >= kFewest) result.order = RowOrder::constant;
      return result;
    }
    if (depth_ >= kLongestTimeSpan_ns) return result;  // damage, which other checks report
    const bool sorted =
        is_sorted_by([](const Observations& o, std::size_t i) { return o.beam[i]; }) ||
        is_sorted_by([](const Observations& o, std::size_t i) { return o.return_number[i]; });
    const bool short_runs = runs_.size() > 2 && which_.size() / runs_.size() < kFewestBetweenResets;
    if (!sorted && begins_anew()) {
      result.order = RowOrder::begins_anew;
      result.step_ns = mean_step();
    } else if (in_packets ? short_runs && fills_gaps(in_packets)
                          : short_runs || sorted || fills_gaps(in_packets) || interleave()) {
      result.order = RowOrder::mixed;
    } else if (!in_packets && overlaps()) {
      result.order = RowOrder::overlapping;
    }
    return result;
  }

 private:
  std::int64_t time(std::size_t i) const { return rows_.time_ns[which_[i]]; }

  /// Whether every run has one value of a column, and they have several.
  template <class Value>
  bool is_sorted_by(Value&& value) const {
    std::bitset<256> all;
    for (const Run& run : runs_) {
      const std::uint8_t first = value(rows_, which_[run.begin]);
      for (std::size_t i = run.begin; i < run.end; ++i) {
        if (value(rows_, which_[i]) != first) return false;
      }
      all.set(first);
    }
    return all.count() > 1;
  }

  bool begins_anew() const {
    if (runs_.size() < 3) return false;
    std::int64_t earliest = runs_.front().first_ns, latest = earliest, longest = 0;
    for (const Run& run : runs_) {
      earliest = std::min(earliest, run.first_ns);
      latest = std::max(latest, run.first_ns);
      longest = std::max(longest, run.span_ns());
    }
    constexpr double kSpread = 0.05;
    const auto spread = static_cast<double>(latest - earliest);
    return longest <= kLongestMessage && usual_step_ > 0 &&
           spread <= std::max(2 * usual_step_, kSpread * static_cast<double>(longest)) &&
           spread < 0.5 * static_cast<double>(longest) && begin_in_step();
  }

  /// Whether the runs begin whole steps apart: those of emitters that fire in turn do not.
  bool begin_in_step() const {
    constexpr double kOff = 0.13, kMost = 0.9;  // of a step, of the runs
    const double step = mean_step();
    const auto in_step = std::count_if(runs_.begin(), runs_.end(), [&](const Run& run) {
      const double steps = static_cast<double>(run.first_ns - runs_.front().first_ns) / step;
      return std::abs(steps - std::round(steps)) < kOff;
    });
    return static_cast<double>(in_step) >= kMost * static_cast<double>(runs_.size());
  }

  /// Whether sorting leaves fewer gaps, and no shots too close to each other: blocks of rows
  /// changed places.
  bool fills_gaps(bool in_packets) const {
    if (depth_ > kFarthestBlock || !(usual_step_ > 0)) return false;
    std::vector<std::int64_t> sorted;
    double before = 0, after = 0;
    std::size_t close = 0;
    const auto gap = [this](std::int64_t step) {
      const auto ns = static_cast<double>(step);
      return ns > kLongestStep * usual_step_ ? ns - usual_step_ : 0.0;
    };
    for (std::size_t i = 0; i < which_.size(); ++i) {
      if (rows_.return_number[which_[i]] <= 1) sorted.push_back(time(i));
      if (i > 0) before += gap(saturating_difference(time(i), time(i - 1)));
    }
    std::sort(sorted.begin(), sorted.end());
    for (std::size_t i = 1; i < sorted.size(); ++i) {
      const std::int64_t step = sorted[i] - sorted[i - 1];
      after += gap(step);
      const bool shares = step == 0 && !in_packets;  // rounded times do
      if (!shares && static_cast<double>(step) < 0.5 * usual_step_) ++close;
    }
    constexpr double kFewClose = 0.05;
    return after < before &&
           static_cast<double>(close) < kFewClose * static_cast<double>(sorted.size());
  }

  /// Whether the runs together are the even shots of emitters that fire in turn, whose lines are
  /// not in a column.
  bool interleave() const {
    constexpr double kStep_ns = 12'500.0 / 3.0, kSameRate = 0.01, kSameStep = 0.3, kMost = 0.9;
    std::vector<std::int64_t> sorted;
    for (std::size_t i = 0; i < which_.size(); ++i) sorted.push_back(time(i));
    std::sort(sorted.begin(), sorted.end());
    double even = 0;
    for (std::size_t i = 1; i < sorted.size(); ++i) {
      const auto step = static_cast<double>(sorted[i] - sorted[i - 1]);
      even += std::abs(step / kStep_ns - 1.0) < kSameStep ? 1 : 0;
    }
    const auto steps = static_cast<double>(sorted.size() - 1);
    const double mean = static_cast<double>(sorted.back() - sorted.front()) / steps;
    return std::abs(mean / kStep_ns - 1.0) < kSameRate && even > kMost * steps;
  }

  /// Whether most runs begin within the time of the run before.
  bool overlaps() const {
    constexpr double kShare = 0.3;  // of the shorter one; clocks that are set back repeat less
    std::size_t within = 0;
    for (std::size_t i = 1; i < runs_.size(); ++i) {
      const Run &before = runs_[i - 1], &run = runs_[i];
      const auto shared = static_cast<double>(before.last_ns - run.first_ns);
      const auto shorter = static_cast<double>(std::min(before.span_ns(), run.span_ns()));
      within += run.first_ns > before.first_ns && shared > kShare * shorter ? 1 : 0;
    }
    return within > 1 && 2 * within > runs_.size();
  }

  double mean_step() const {
    double sum = 0, steps = 0;
    for (const Run& run : runs_) {
      for (std::size_t i = run.begin + 1; i < run.end; ++i) {
        const auto step = static_cast<double>(time(i) - time(i - 1));
        if (step <= 0 || step > kLongestStep * usual_step_) continue;
        sum += step;
        ++steps;
      }
    }
    return known_step_or(steps > 0 ? sum / steps : usual_step_);
  }

  const Observations& rows_;
  std::span<const std::size_t> which_;
  std::vector<Run> runs_;
  std::int64_t depth_ = 0;
  double usual_step_ = 0;
};

}  // namespace

OrderJudgement judge_order(const Observations& rows, std::span<const std::size_t> of_device,
                           bool in_packets) {
  if (of_device.empty()) return {};
  return Judge(rows, of_device).judgement(in_packets);
}

void order_by_time(const Observations& rows, std::vector<std::size_t>& which) {
  const auto key = [&rows](std::size_t i) {
    return std::tuple(rows.time_ns[i], rows.beam[i], rows.return_number[i]);
  };
  std::stable_sort(which.begin(), which.end(),
                   [&](std::size_t a, std::size_t b) { return key(a) < key(b); });
}

double known_step_or(double step_ns) {
  constexpr double kNear = 1e-3;
  for (const double known : kKnownSteps_ns) {
    if (std::abs(step_ns / known - 1.0) < kNear) return known;
  }
  return step_ns;
}

}  // namespace risley::recordings
