// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/shot_slips.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/median.hpp"
#include "risley/core/require.hpp"
#include "risley/estimation/free_parameters.hpp"
#include "risley/estimation/initialisation.hpp"
#include "risley/optics/parameters.hpp"

#include "estimation/optics_fit.hpp"
#include "estimation/slip_follower.hpp"

namespace risley::estimation {
namespace {

/// Number of times the optics are refitted to the corrected shots.
constexpr int kMostRounds = 4;
/// Number of shots around the start for fitting them, and for rating an anchor.
constexpr std::size_t kFittedShots = 40000, kTriedShots = 12000;
/// Cost of a slip of repeated shots, in shots, when anchors are compared: optics that are off at
/// some rotation angles need one in every turn.
constexpr std::size_t kDoubledCost = 1000;
/// Which emitter fired which shot, from the steps between neighbouring shots: all are equal, except
/// for the one from the last emitter back to the first.
/// @param[out] order  emitter of shots 0, 1, ... @return whether there were enough shots
bool find_firing_order(const NumberedShots& shots, ShotRange range, const PrismTrain& train,
                       bool mirrored, std::vector<std::uint8_t>& order) {
  const auto emitters = static_cast<std::size_t>(train.emitters());
  std::vector<std::vector<double>> steps(emitters);
  for (std::size_t i = range.begin + 1; i < range.end; ++i) {
    if (shots.number[i] != shots.number[i - 1] + 1) continue;
    const double step = shots.series.zenith[i - 1] - shots.series.zenith[i];
    const auto count = static_cast<std::int64_t>(emitters);
    const auto phase = static_cast<std::size_t>((shots.number[i] % count + count) % count);
    steps[phase].push_back(mirrored ? -step : step);
  }
  std::vector<double> median;
  for (std::vector<double>& of_phase : steps) {
    if (of_phase.size() < 5) return false;
    median.push_back(upper_median(of_phase));
  }
  double mean = 0;
  for (const double one : median) mean += one / static_cast<double>(emitters);
  double least = std::numeric_limits<double>::infinity();
  for (const bool descending : {false, true}) {
    for (std::size_t offset = 0; offset < emitters; ++offset) {
      std::vector<std::uint8_t> trial;
      for (std::size_t i = 0; i < emitters; ++i) {
        const std::size_t place = (i + offset) % emitters;
        trial.push_back(static_cast<std::uint8_t>(descending ? emitters - 1 - place : place));
      }
      const auto elevation = [&](std::size_t i) {
        return train[place::incident_beam_vertical(trial[i % emitters], train.prisms())];
      };
      double sum = 0;
      for (std::size_t i = 0; i < emitters; ++i) {
        sum += std::pow(median[i] - mean - elevation(i) + elevation(i + emitters - 1), 2);
      }
      if (sum >= least) continue;
      least = sum;
      order = std::move(trial);
    }
  }
  return true;
}

/// Valid shots of a span of seconds since the first shot of a range.
ShotRange shots_within(const NumberedShots& shots, ShotRange range, double begin, double end) {
  const auto first = shots.number.begin() + static_cast<std::ptrdiff_t>(range.begin);
  const auto last = shots.number.begin() + static_cast<std::ptrdiff_t>(range.end);
  const auto at = [&](double seconds) {
    const std::int64_t number = *first + std::llround(seconds * shots.rate);
    return static_cast<std::size_t>(std::lower_bound(first, last, number) - shots.number.begin());
  };
  return {at(begin), at(end)};
}

/// Starts of windows of a given length, evenly spread over a span and overlapping by half, s.
std::vector<double> window_begins(double span, double window, std::size_t most) {
  std::vector<double> begins;
  if (span < window) return begins;
  const auto count = std::min(most, static_cast<std::size_t>(2.0 * (span - window) / window) + 1);
  for (std::size_t i = 0; i < count; ++i) {
    begins.push_back(count == 1 ? 0.0
                                : (span - window) * static_cast<double>(i) /
                                      static_cast<double>(count - 1));
  }
  return begins;
}

double length_of(const NumberedShots& shots, ShotRange range) {
  return static_cast<double>(shots.number[range.end - 1] - shots.number[range.begin]) / shots.rate;
}

/// Noise and rounding of shots together, rad.
double usual_noise(const NumberedShots& shots, ShotRange rows, const sensors::Sensor& sensor) {
  double rounding = 0;
  for (std::size_t i = rows.begin; i < rows.end; ++i) {
    rounding += 0.5 * static_cast<double>(shots.series.azimuth_rounding_variance[i] +
                                          shots.series.zenith_rounding_variance[i]);
  }
  return std::sqrt(sensor.angle_noise * sensor.angle_noise +
                   rounding / static_cast<double>(std::max<std::size_t>(1, rows.size())));
}

/// A start from windows long enough to separate all rotors. Slips within them bend it by degrees.
std::optional<Start> coarse_start(NumberedShots& shots, ShotRange range,
                                  const sensors::Sensor& sensor, bool in_turn,
                                  std::optional<bool> decided, const Progress& progress) {
  constexpr double kLongWindow = 0.1, kShortWindow = 0.055;  // s
  constexpr std::size_t kMostLong = 3, kMostShort = 12, kFewestShots = 200;
  const auto names = default_free_names(sensor.shape(), one_glass(sensor.train));
  StartOptions options{free_parameters(names, sensor.shape()), 0, decided, decided};
  const double length = std::min(1.0, length_of(shots, range));
  std::vector<ShotRange> windows;
  const double longest = std::min(kLongWindow, length);
  for (const double begin : window_begins(length, longest, kMostLong)) {
    windows.push_back(shots_within(shots, range, begin, begin + longest));
  }
  for (const double begin : window_begins(length, kShortWindow, kMostShort)) {
    windows.push_back(shots_within(shots, range, begin, begin + kShortWindow));
  }
  std::optional<Start> best;
  std::vector<std::uint8_t> best_order;
  for (const ShotRange& rows : windows) {
    progress.check();
    if (rows.size() < kFewestShots) continue;
    options.angle_noise = usual_noise(shots, rows, sensor);
    const auto start_as = [&](bool image) -> std::optional<Start> {
      if (in_turn && !find_firing_order(shots, rows, sensor.train, image, shots.firing_order)) {
        return std::nullopt;
      }
      AngleSeries head;
      for (std::size_t i = rows.begin; i < rows.end; ++i) shots.append_to(head, i, 0);
      try {
        return find_start(head, sensor, options);
      } catch (const EstimationError&) {
        return std::nullopt;
      }
    };
    options.mirrored = decided;
    std::optional<Start> start = start_as(decided.value_or(false));
    if (start && in_turn && !decided && start->mirrored) {
      options.mirrored = true;
      start = start_as(true);
    }
    if (!start || (best && start->residual_rms >= best->residual_rms)) continue;
    best = std::move(start);
    best_order = shots.firing_order;
    if (best->residual_rms < 1.5 * options.angle_noise) break;
  }
  shots.firing_order = best_order;
  return best;
}

/// Missing shots before each valid shot of a stretch, relative to its start.
class Lags {
 public:
  Lags(const std::vector<FoundSlip>& slips, std::size_t anchor) : slips_(slips) {
    for (const FoundSlip& slip : slips) {
      if (slip.after <= anchor) first_ -= slip.shots;
    }
  }
  std::int64_t of(std::size_t shot) const {
    std::int64_t lag = first_;
    for (const FoundSlip& slip : slips_) {
      if (slip.after <= shot) lag += slip.shots;
    }
    return lag;
  }
  std::int64_t first() const { return first_; }

 private:
  const std::vector<FoundSlip>& slips_;
  std::int64_t first_ = 0;
};

/// Refits the optics to the corrected shots about an anchor. @return whether that went well
bool refit(const NumberedShots& shots, Anchor& anchor, const Followed& followed,
           const sensors::Sensor& sensor, Priors priors) {
  const Lags lags(followed.slips, anchor.shot);
  const std::size_t begin =
      std::max(followed.begin, anchor.shot - std::min(anchor.shot, kFittedShots / 2));
  const std::size_t end = std::min(followed.end, anchor.shot + kFittedShots / 2);
  AngleSeries mended;
  for (std::size_t i = begin; i < end; ++i) shots.append_to(mended, i, lags.of(i));
  const std::optional<Start> fitted = fit_optics(mended, anchor.start, sensor, priors);
  if (!fitted || !(fitted->residual_rms < 3.0 * followed.residual_rms)) return false;
  anchor.start = *fitted;
  return true;
}

/// A short window that was fitted separately.
struct Window {
  bool has_gap = false;
  Anchor anchor;
  ShotRange rows;
};

bool is_better(const Window& a, const Window& b) {
  if (a.has_gap != b.has_gap) return b.has_gap;
  return a.anchor.start.residual_rms < b.anchor.start.residual_rms;
}

/// The best windows of a length about a start.
/// @param length  s
std::vector<Window> fitted_windows(NumberedShots& shots, ShotRange range, const Start& start,
                                   double length, const sensors::Sensor& sensor, bool in_turn,
                                   const Progress& progress) {
  constexpr double kAround = 0.08;  // s
  // A slip within a gap that long is only a change of speed.
  const double long_gap = 0.15 * length;
  constexpr std::size_t kMostWindows = 30, kMostFitted = 8, kFewestShots = 400;
  const double middle = 1e-9 * static_cast<double>(start.time_ns) -
                        static_cast<double>(shots.number[range.begin]) / shots.rate;
  const double first = std::max(0.0, middle - kAround);
  const double last = std::min(length_of(shots, range), middle + kAround);
  std::vector<Window> windows;
  for (const double begin : window_begins(last - first, length, kMostWindows)) {
    progress.check();
    Window window;
    window.rows = shots_within(shots, range, first + begin, first + begin + length);
    if (window.rows.size() < kFewestShots) continue;
    if (in_turn &&
        !find_firing_order(shots, window.rows, sensor.train, false, shots.firing_order)) {
      continue;
    }
    window.anchor.firing_order = shots.firing_order;
    for (std::size_t i = window.rows.begin + 1; i < window.rows.end; ++i) {
      const auto gap = static_cast<double>(shots.number[i] - shots.number[i - 1]) / shots.rate;
      window.has_gap = window.has_gap || gap > long_gap;
    }
    constexpr double kAngleSigma = radians_from_degrees(20.0), kSpeedShare = 0.005;
    RotorState state = loose_state(start, kAngleSigma, kSpeedShare);
    window.anchor.start = start;
    window.anchor.start.residual_rms =
        settle(shots, window.rows, start, 0, radians_from_degrees(3.0), state);
    set_rotors(window.anchor.start, state);
    window.anchor.shot =
        std::min(shots_within(shots, range, 0,
                              1e-9 * static_cast<double>(state.time_ns) -
                                  static_cast<double>(shots.number[range.begin]) / shots.rate)
                     .end,
                 range.end - 1);
    windows.push_back(std::move(window));
  }
  std::stable_sort(windows.begin(), windows.end(), is_better);
  if (windows.size() > kMostFitted) windows.resize(kMostFitted);
  std::erase_if(windows, [&](Window& window) {
    progress.check();
    shots.firing_order = window.anchor.firing_order;
    const Followed alone{window.rows.begin, window.rows.end, {}, window.anchor.start.residual_rms};
    return !refit(shots, window.anchor, alone, sensor, Priors::of_the_type);
  });
  return windows;
}

/// Fits of short windows about a start, best first. A slip within it spoils a window: shorter
/// windows are more often free of slips, but determine less.
std::vector<Anchor> find_anchors(NumberedShots& shots, ShotRange range, const Start& start,
                                 const sensors::Sensor& sensor, bool in_turn,
                                 const Progress& progress) {
  constexpr double kLengths[] = {0.02, 0.011};  // s
  std::vector<Window> windows;
  for (const double length : kLengths) {
    for (Window& window : fitted_windows(shots, range, start, length, sensor, in_turn, progress)) {
      windows.push_back(std::move(window));
    }
  }
  std::stable_sort(windows.begin(), windows.end(), is_better);
  std::vector<Anchor> anchors;
  anchors.reserve(windows.size());
  for (Window& window : windows) anchors.push_back(std::move(window.anchor));
  return anchors;
}

bool same_slips(const std::vector<FoundSlip>& a, const std::vector<FoundSlip>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const FoundSlip& one, const FoundSlip& other) {
                      return one.after == other.after && one.shots == other.shots;
                    });
}

/// A stretch that was followed, with the data needed to join it to others.
struct FollowedPiece {
  Followed followed;
  std::int64_t first_lag = 0;
  std::vector<std::uint8_t> firing_order;  // of shots without lag
};

/// Follows the rotors through a stretch.
/// @param prepared  whether prepare_shots() was called for the series
/// @return nothing if they are not found
std::optional<FollowedPiece> follow_piece(NumberedShots& shots, ShotRange range,
                                          const sensors::Sensor& sensor, bool in_turn,
                                          bool prepared, const Progress& progress) {
  const std::optional<bool> decided = prepared ? std::optional<bool>(false) : std::nullopt;
  std::optional<Start> start = coarse_start(shots, range, sensor, in_turn, decided, progress);
  if (!start) return std::nullopt;
  if (!prepared) {
    prepare_shots(shots.series, *start);
    start->mirrored = false;
    start->frame.reset();
  }
  // The quality of an anchor is that of following the rotors from it.
  std::optional<Anchor> best;
  constexpr int kMostSound = 4;
  int sound = 0;
  std::size_t least_cost = std::numeric_limits<std::size_t>::max();
  double least_missed = std::numeric_limits<double>::infinity();
  for (const Anchor& one : find_anchors(shots, range, *start, sensor, in_turn, progress)) {
    progress.check();
    shots.firing_order = one.firing_order;
    const ShotRange near{std::max(range.begin, one.shot - std::min(one.shot, kTriedShots / 2)),
                         std::min(range.end, one.shot + kTriedShots / 2)};
    const Followed trial = follow(shots, one, near);
    const auto doubled = std::count_if(trial.slips.begin(), trial.slips.end(),
                                       [](const FoundSlip& slip) { return slip.shots < 0; });
    const std::size_t cost =
        near.size() - trial.size() + kDoubledCost * static_cast<std::size_t>(doubled);
    if (cost < least_cost || (cost == least_cost && trial.residual_rms < least_missed)) {
      best = one;
      least_cost = cost;
      least_missed = trial.residual_rms;
    }
    const double fine = std::max(kLeastNoiseSteps * usual_step(one.start, shots.rate),
                                 1.5 * one.start.residual_rms);
    if (cost > 0) continue;
    if (trial.residual_rms < fine || ++sound == kMostSound) break;
  }
  if (!best) return std::nullopt;
  Anchor anchor = *std::move(best);
  shots.firing_order = anchor.firing_order;
  Followed followed = follow(shots, anchor, range);
  for (int round = 0; round < kMostRounds; ++round) {
    progress.check();
    if (followed.slips.empty() && followed.begin == range.begin && followed.end == range.end) break;
    if (!refit(shots, anchor, followed, sensor, Priors::wide)) break;
    Followed again = follow(shots, anchor, range);
    const bool settled = same_slips(again.slips, followed.slips);
    followed = std::move(again);
    if (settled) break;
  }
  const std::size_t begin = followed.begin, end = followed.end;
  constexpr std::size_t kFewestFollowed = 1000;
  if (end < begin + std::min(kFewestFollowed, range.size())) return std::nullopt;
  const Lags lags(followed.slips, anchor.shot);
  return FollowedPiece{std::move(followed), lags.first(), shots.firing_order};
}

/// Follows the rotors through all shots, and restarts where they are lost. @return pieces in time
/// order
std::vector<FollowedPiece> follow_all(NumberedShots& shots, const sensors::Sensor& sensor,
                                      bool in_turn, const Progress& progress) {
  std::vector<FollowedPiece> pieces;
  std::vector<ShotRange> waiting{{0, shots.size()}};  // the first of them last
  bool prepared = false;
  while (!waiting.empty()) {
    const ShotRange range = waiting.back();
    waiting.pop_back();
    if (range.size() == 0) continue;
    std::optional<FollowedPiece> piece =
        follow_piece(shots, range, sensor, in_turn, std::exchange(prepared, true), progress);
    if (!piece) continue;
    waiting.push_back({piece->followed.end, range.end});
    waiting.push_back({range.begin, piece->followed.begin});
    pieces.push_back(*std::move(piece));
  }
  std::sort(pieces.begin(), pieces.end(), [](const FollowedPiece& a, const FollowedPiece& b) {
    return a.followed.begin < b.followed.begin;
  });
  return pieces;
}

/// Number of shots by which the order of one piece is ahead of another's; 0 if they differ
/// otherwise.
std::int64_t order_shift(const std::vector<std::uint8_t>& of, const std::vector<std::uint8_t>& in) {
  for (std::size_t shift = 0; shift < of.size(); ++shift) {
    bool same = true;
    for (std::size_t i = 0; i < of.size(); ++i) same = same && in[(i + shift) % in.size()] == of[i];
    if (same) return static_cast<std::int64_t>(shift);
  }
  return 0;
}

}  // namespace

ShotCount find_slips(const CountedShots& counted, const sensors::Sensor& sensor,
                     const Progress& progress) {
  require_length("rows", counted.rows.size(), counted.series.size());
  require_above("shot rate", counted.shot_rate, 0, "Hz");
  constexpr double kOtherRate = 0.05;
  ShotCount result;
  // In a thinned recording, the value of a row is unknown.
  if (std::abs(counted.shot_rate / sensor.shot_rate - 1.0) > kOtherRate) return result;
  NumberedShots shots;
  shots.series = counted.series;
  shots.rate = counted.shot_rate;
  for (const std::int64_t time : counted.series.time_ns) {
    shots.number.push_back(std::llround(1e-9 * static_cast<double>(time) * shots.rate));
  }
  const bool in_turn = counted.in_turn && sensor.train.emitters() > 1;
  const std::vector<FollowedPiece> pieces = follow_all(shots, sensor, in_turn, progress);
  if (pieces.empty()) return result;
  result.followed = true;
  const auto emitters = static_cast<std::int64_t>(pieces.front().firing_order.size());
  const auto shifted = [&](const std::vector<std::uint8_t>& order, std::int64_t shift) {
    std::vector<std::uint8_t> moved;
    for (std::int64_t i = 0; i < emitters; ++i) {
      moved.push_back(
          order[static_cast<std::size_t>(((i + shift) % emitters + emitters) % emitters)]);
    }
    return moved;
  };
  const auto row_between = [&](std::size_t before, std::size_t after) {
    return static_cast<std::uint64_t>(counted.rows[before] + 1 +
                                      (counted.rows[after] - counted.rows[before] - 1) / 2);
  };
  // The count of the first piece's first shot is kept unchanged.
  const FollowedPiece& first = pieces.front();
  result.firing_order = shifted(first.firing_order, first.first_lag);
  std::int64_t lag = 0;
  for (const FollowedPiece& piece : pieces) {
    if (&piece != &first) {
      std::int64_t missing = 0;
      if (emitters > 0) {
        const std::int64_t ahead =
            order_shift(shifted(piece.firing_order, piece.first_lag), result.firing_order);
        missing = ((ahead - lag) % emitters + emitters) % emitters;
      }
      result.slips.push_back(
          {row_between(piece.followed.begin - 1, piece.followed.begin), missing, false});
      lag += missing;
    }
    for (const FoundSlip& slip : piece.followed.slips) {
      result.slips.push_back({row_between(slip.before, slip.after), slip.shots, true});
      lag += slip.shots;
    }
  }
  return result;
}

}  // namespace risley::estimation
