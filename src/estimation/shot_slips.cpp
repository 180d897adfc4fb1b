// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/shot_slips.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <optional>
#include <utility>

#include <Eigen/Core>

#include "risley/algebra/symmetric.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/median.hpp"
#include "risley/core/require.hpp"
#include "risley/estimation/diagnostics.hpp"
#include "risley/estimation/free_parameters.hpp"
#include "risley/estimation/initialisation.hpp"
#include "risley/estimation/normal_equations.hpp"
#include "risley/optics/parameters.hpp"

#include "estimation/block_fit.hpp"
#include "estimation/knot_model.hpp"
#include "estimation/optics_fit.hpp"

namespace risley::estimation {
namespace {

/// Shots that are predicted and tested together.
constexpr std::size_t kTestedShots = 96;
/// Blocks behind a suspicious one that may be needed to tell what happened there.
constexpr std::size_t kMostBlocksAhead = 8;
/// Time over which a prediction is held against shots, s: rotors hardly bend in it.
constexpr double kLongestTest = 0.012;
/// Numbers of shots that may be there twice, and of missing ones that are tried first, and where
/// none of those will do.
constexpr std::int64_t kDoubledShots = 96, kUsualSlip = 120, kNearSlip = 200, kFarSlip = 2000;
/// A slip, and its size, are believed from this difference of chi2 on.
constexpr double kSure = 30.0;
/// Residuals that hang together count for less; by so much at most.
constexpr double kMostCorrelation = 10.0;
/// Losses of single shots end at 1 / softening: mean losses near it say that nothing fits.
constexpr double kSoftening = softening_at(1.0);
constexpr double kLostLoss = 0.5 / kSoftening;
/// Residuals of so many steps from shot to shot, and no number of missing shots that mends them:
/// the rotors are lost.
constexpr double kLostSteps = 8.0;
/// A prediction that is less certain than this is no measure of single shots, in shots.
constexpr double kLooseShots = 0.15;
/// Noise is not taken below this share of the step from shot to shot: nobody needs it better.
constexpr double kLeastNoiseSteps = 0.2;
/// Of the start about the truth.
constexpr double kAnchorAngleSigma = radians_from_degrees(0.5), kAnchorSpeedShare = 1e-3;
/// How often the optics are fitted again to the mended shots.
constexpr int kMostRounds = 4;
/// Shots around the start that they are fitted to, and those that show what an anchor is worth.
constexpr std::size_t kFittedShots = 40000, kTriedShots = 12000;
/// Shots that a slip of shots that are there twice counts for where anchors are compared: optics
/// that are off at some rotation angles need one in every turn.
constexpr std::size_t kDoubledCost = 1000;
/// Packets of the formats hold so many shots. Recorders lose some at their borders: so many slips,
/// and such a share of them, tell where in the count the borders are.
constexpr std::int64_t kPacketShots[] = {96, 100};
constexpr std::size_t kFewestAtBorders = 5;
constexpr double kShareAtBorders = 0.7;

/// The valid shots of a recording by their numbers in the count.
struct NumberedShots {
  AngleSeries series;  // in the sensor's frame
  std::vector<std::int64_t> number;
  double rate = 0;
  std::vector<std::uint8_t> firing_order;  // empty: beams are those of the series

  std::size_t size() const { return number.size(); }
  std::int64_t time_ns(std::size_t i, std::int64_t lag) const {
    return std::llround(static_cast<double>(number[i] + lag) * 1e9 / rate);
  }
  std::uint8_t beam(std::size_t i, std::int64_t lag) const {
    if (firing_order.empty()) return series.beam[i];
    const auto emitters = static_cast<std::int64_t>(firing_order.size());
    return firing_order[static_cast<std::size_t>(((number[i] + lag) % emitters + emitters) %
                                                 emitters)];
  }
  /// Shot i as it is where so many shots are missing before it.
  void append_to(AngleSeries& to, std::size_t i, std::int64_t lag) const {
    to.append(time_ns(i, lag), series.azimuth[i], series.zenith[i], beam(i, lag),
              series.azimuth_rounding_variance[i], series.zenith_rounding_variance[i]);
  }
};

/// A change of the count somewhere behind valid shot `before` and not behind shot `after`.
struct FoundSlip {
  std::size_t before = 0, after = 0;
  std::int64_t shots = 0;
};

/// What following the rotors of a stretch came to.
struct Followed {
  std::size_t begin = 0, end = 0;  // valid shots that were reached
  std::vector<FoundSlip> slips;    // ascending
  double residual_rms = 0;         // of predictions, typical, rad
  std::size_t size() const { return end > begin ? end - begin : 0; }
};

/// Follows the rotors from a start in one direction. Places are steps from the start.
class Follower : private BlockFit {
 public:
  using BlockFit::loose_state;
  using State = RotorState;

  /// @param noise  of the shots about the fit of the start, rad
  /// @param step   from shot to shot, typically, rad
  Follower(const NumberedShots& shots, const PrismTrain& train, double noise, double step,
           std::ptrdiff_t direction, std::size_t first, std::size_t count)
      : BlockFit(train, kSoftening),
        shots_(shots),
        direction_(direction),
        first_(first),
        count_(count),
        step_(step) {
    weights_.angle_noise = equal_noise(std::max(noise, kLeastNoiseSteps * step));
  }

  /// Fits a state to all places, as if they were free of slips.
  /// @param from  noise with which that begins: by so much directions may be missed at first, rad
  /// @return scale of the residuals, rad
  double settle(State& state, double from) {
    load(0, count_, 0);
    predict(state, middle());
    const State loose = state;
    const double noise = weights_.angle_noise.azimuth;
    for (double level = from;; level = std::max(0.3 * level, noise)) {
      weights_.angle_noise = equal_noise(level);
      for (int round = 0; round < 3; ++round) improve(state, loose);
      if (level <= noise) break;
    }
    evaluate(state);
    return robust_scale(azimuth_, zenith_);
  }

  /// @return places that were reached; slips and noise are then known
  std::size_t run(State state) {
    Checkpoint last{0, state};
    std::size_t place = 0, quiet_until = 0;
    while (place < count_) {
      const std::size_t end = block_end(place);
      load(place, end, lag_);
      State predicted = state;
      predict(predicted, middle());
      const Test test = tested(predicted);
      if (place >= quiet_until && suspicious(test, predicted)) {
        const Checkpoint from =
            last.place < place && !is_loose(predicted) ? last : Checkpoint{place, state};
        const Verdict verdict = examine(from, end);
        if (verdict.kind == Verdict::lost) return place;
        if (verdict.kind == Verdict::slip) {
          state = from.state;
          for (place = from.place; place < verdict.place;) {
            const std::size_t stop = std::min(block_end(place), verdict.place);
            load(place, stop, lag_);
            take(state);
            place = stop;
          }
          slips_.push_back({place, verdict.change});
          lag_ += verdict.change;
          last = {place, state};
          last_slip_ = place;
          continue;
        }
        quiet_until = verdict.sure_until;
        // The optics are not that good here.
        weights_.angle_noise = equal_noise(
            std::max(weights_.angle_noise.azimuth, std::min(test.scale, kLostSteps * step_)));
        load(place, end, lag_);
      } else if (test.loss < kLostLoss) {
        learn(test);
      }
      missed_ += std::min(test.scale, kLostSteps * step_) * static_cast<double>(end - place);
      last = {place, state};
      state = predicted;
      const int rounds = is_loose(predicted) ? 3 : 1;
      for (int round = 0; round < rounds; ++round) improve(state, predicted);
      place = end;
    }
    return place;
  }

  struct Change {
    std::size_t place = 0;    // first with the new lag
    std::int64_t change = 0;  // of the lag
  };
  const std::vector<Change>& slips() const { return slips_; }
  /// By how much predictions missed, summed over all shots, rad.
  double missed() const { return missed_; }

  std::size_t shot_at(std::size_t place) const {
    return static_cast<std::size_t>(static_cast<std::ptrdiff_t>(first_) +
                                    direction_ * static_cast<std::ptrdiff_t>(place));
  }

 private:
  struct Checkpoint {
    std::size_t place = 0;
    State state;  // before the shots from there on were taken in
  };
  /// How shots agree with a prediction.
  struct Test {
    double loss = 0;                          // mean of the shots
    double scale = 0;                         // of the residuals, rad
    double delay = 0, delay_information = 0;  // s, s^-2: time by which all rotors are late
    double delay_chi2() const { return delay * delay * delay_information; }
  };
  struct Verdict {
    enum Kind { none, slip, lost } kind = none;
    std::size_t place = 0;
    std::int64_t change = 0;
    std::size_t sure_until = 0;
  };

  /// End of the block that begins at a place.
  std::size_t block_end(std::size_t place) const {
    const std::int64_t begin = shots_.number[shot_at(place)];
    std::size_t end = place + 1;
    while (end < count_ && end - place < kTestedShots &&
           std::abs(shots_.number[shot_at(end)] - begin) <
               static_cast<std::int64_t>(kTestedShots)) {
      ++end;
    }
    return end;
  }

  void load(std::size_t begin, std::size_t end, std::int64_t lag) {
    clear(block_);
    for (std::size_t place = begin; place < end; ++place) {
      shots_.append_to(block_, shot_at(place), lag);
    }
  }
  /// The loaded shots with another lag.
  void reload(std::size_t begin, std::int64_t lag) {
    for (std::size_t i = 0; i < block_.size(); ++i) {
      const std::size_t shot = shot_at(begin + i);
      block_.time_ns[i] = shots_.time_ns(shot, lag);
      block_.beam[i] = shots_.beam(shot, lag);
    }
  }
  std::int64_t middle() const {
    return block_.time_ns.front() + (block_.time_ns.back() - block_.time_ns.front()) / 2;
  }

  Test tested(const State& state) {
    evaluate(state);
    Test test;
    test.loss = equations_.cost / static_cast<double>(block_.size());
    test.scale = robust_scale(azimuth_, zenith_);
    const KnotSquare<Eigen::Dynamic> curvature = knot_curvature<Eigen::Dynamic>(equations_, 0);
    double slope = 0, information = 0;
    for (Eigen::Index k = 0; k < state.mean.size(); k += 3) {
      slope += state.mean[k + 1] * equations_.gradient[static_cast<std::size_t>(k)];
      for (Eigen::Index l = 0; l < state.mean.size(); l += 3) {
        information += state.mean[k + 1] * state.mean[l + 1] * curvature(k, l);
      }
    }
    test.delay_information = information;
    test.delay = information > 0 ? slope / information : 0.0;
    return test;
  }

  bool suspicious(const Test& test, const State& predicted) const {
    const auto shots = static_cast<double>(block_.size());
    if (test.loss > 1.6 * usual_loss_ + 0.4 + 8.0 / std::sqrt(shots)) return true;
    return !is_loose(predicted) && std::abs(test.delay) * shots_.rate > 0.3 &&
           test.delay_chi2() > penalty();
  }

  /// Whether shots may be missing without anybody noticing it.
  bool is_loose(const State& state) const {
    double least = std::numeric_limits<double>::infinity();
    for (Eigen::Index k = 0; k < state.mean.size(); k += 3) {
      if (state.mean[k + 1] == 0) continue;
      least = std::min(least, std::sqrt(state.covariance(k, k)) / std::abs(state.mean[k + 1]));
    }
    return least * shots_.rate > kLooseShots;
  }

  /// Keeps noise, usual losses and their correlation up to date.
  void learn(const Test& test) {
    constexpr double kShare = 0.03;
    const auto toward = [](double value, double next) { return value + kShare * (next - value); };
    usual_loss_ = std::clamp(toward(usual_loss_, test.loss), 1.0, 3.0);
    correlation_ = std::max(1.0, toward(correlation_, std::min(test.delay_chi2(), 200.0)));
    if (block_.size() < kTestedShots / 4) return;
    const double noise = weights_.angle_noise.azimuth;
    weights_.angle_noise = equal_noise(std::max(
        kLeastNoiseSteps * step_,
        std::sqrt(toward(noise * noise, std::min(test.scale * test.scale, 4.0 * noise * noise)))));
  }

  /// Squared distance of a state from a prediction, in sigmas of that.
  static double distance(const State& state, const State& predicted) {
    const Eigen::VectorXd off = state.mean - predicted.mean;
    return off.dot(algebra::SymmetricSolver(predicted.covariance).solve(off));
  }

  void take(State& state) {
    predict(state, middle());
    const State predicted = state;
    improve(state, predicted);
  }

  /// Scale of the residuals of the loaded shots with a lag, rad.
  double scale_of(std::size_t begin, std::int64_t lag, const State& state) {
    reload(begin, lag);
    evaluate(state);
    return robust_scale(azimuth_, zenith_);
  }

  /// Loss of every loaded shot under the evaluated state.
  void losses(std::vector<double>& loss) const {
    loss.resize(block_.size());
    const double variance = std::pow(weights_.angle_noise.azimuth, 2);
    for (std::size_t i = 0; i < block_.size(); ++i) {
      const double chi2 =
          azimuth_[i] * azimuth_[i] /
              (variance + static_cast<double>(block_.azimuth_rounding_variance[i])) +
          zenith_[i] * zenith_[i] /
              (variance + static_cast<double>(block_.zenith_rounding_variance[i]));
      const double one = chi2 / (1.0 + kSoftening * chi2);
      loss[i] = std::isfinite(one) ? one : 1.0 / kSoftening;
    }
  }

  /// Losses of the loaded shots for every change of the lag that is thought of.
  struct LossTable {
    std::vector<std::int64_t> change;       // the first is 0
    std::vector<std::vector<double>> loss;  // [changes][shots]
    std::vector<double> pull;               // squared distance from the prediction, in sigmas
    double total(std::size_t row) const {
      double sum = pull[row];
      for (const double one : loss[row]) sum += one;
      return sum;
    }
  };
  /// The likeliest course of the lag: a change at every place costs a penalty.
  struct Course {
    double loss = 0;  // of all shots, without penalties
    struct Stretch {
      std::size_t begin = 0, end = 0, row = 0;  // row of the table
    };
    std::vector<Stretch> stretches;  // the first one is without a change, maybe empty
  };

  /// @param from  first shot at which a change may be
  static Course likeliest_course(const LossTable& table, std::size_t from, double penalty) {
    const std::size_t rows = table.change.size(), shots = table.loss.front().size();
    std::vector<double> cost(rows, std::numeric_limits<double>::infinity());
    std::vector<std::uint8_t> switched(rows * shots, 0);
    std::vector<std::size_t> best_before(shots, 0);
    cost[0] = 0;
    for (std::size_t i = 0; i < shots; ++i) {
      const auto least = std::min_element(cost.begin(), cost.end());
      best_before[i] = static_cast<std::size_t>(least - cost.begin());
      const double entry = i < from ? std::numeric_limits<double>::infinity() : *least + penalty;
      for (std::size_t row = 0; row < rows; ++row) {
        if (entry < cost[row]) {
          cost[row] = entry;
          switched[row * shots + i] = 1;
        }
        cost[row] += table.loss[row][i];
      }
    }
    Course course;
    auto row = static_cast<std::size_t>(std::min_element(cost.begin(), cost.end()) - cost.begin());
    std::size_t end = shots;
    for (std::size_t i = shots; i-- > 0;) {
      course.loss += table.loss[row][i];
      if (switched[row * shots + i] == 0) continue;
      course.stretches.push_back({i, end, row});
      end = i;
      row = best_before[i];
    }
    course.stretches.push_back({0, end, 0});
    std::reverse(course.stretches.begin(), course.stretches.end());
    return course;
  }

  /// Changes of the lag by how usual they are: whole rounds of the emitters, such as a packet that
  /// was cut short; any about a packet; whole packets.
  enum class Tier { usual, near, far };

  std::vector<std::int64_t> changes_of(Tier tier) const {
    const auto round =
        static_cast<std::int64_t>(std::max<std::size_t>(1, shots_.firing_order.size()));
    std::vector<std::int64_t> changes;
    for (std::int64_t missing = -kDoubledShots; missing <= kFarSlip; ++missing) {
      const bool is_usual = missing <= kUsualSlip && missing % round == 0;
      const Tier its = is_usual ? Tier::usual : missing <= kNearSlip ? Tier::near : Tier::far;
      if (missing != 0 && its == tier) changes.push_back(direction_ > 0 ? missing : -missing);
    }
    return changes;
  }

  double penalty() const { return kSure * std::min(correlation_, kMostCorrelation); }

  /// What happened between a checkpoint and the end of a block that does not fit.
  Verdict examine(const Checkpoint& from, std::size_t end) {
    constexpr std::size_t kFewestBehind = 12;
    Verdict verdict;
    verdict.sure_until = end;
    std::size_t window = end, blocks = 0;
    for (bool last = false; !last; blocks = std::max<std::size_t>(1, 2 * blocks)) {
      for (std::size_t i = 0; i < blocks && window < count_; ++i) {
        const std::size_t next = block_end(window);
        const std::int64_t span =
            std::abs(shots_.number[shot_at(next - 1)] - shots_.number[shot_at(from.place)]);
        last = static_cast<double>(span) > kLongestTest * shots_.rate;
        if (last) break;
        window = next;
      }
      last = last || window >= count_ || blocks >= kMostBlocksAhead;
      load(from.place, window, lag_);
      State predicted = from.state;
      predict(predicted, middle());
      const bool loose = is_loose(predicted);
      const std::size_t shots = block_.size();
      const double fair = 2.0 * usual_loss_ + 0.5 + 8.0 / std::sqrt(static_cast<double>(shots));
      LossTable table;
      const auto try_change = [&](std::int64_t change) {
        reload(from.place, lag_ + change);
        State state = predicted;
        for (int round = 0; loose && round < 2; ++round) improve(state, predicted);
        evaluate(state);
        table.change.push_back(change);
        losses(table.loss.emplace_back());
        table.pull.push_back(loose ? distance(state, predicted) : 0.0);
        double mean = 0;
        for (const double one : table.loss.back()) mean += one / static_cast<double>(shots);
        return mean;
      };
      const bool none_fits = try_change(0) < fair;
      if (loose && none_fits) return verdict;
      Course course;
      for (const Tier tier : {Tier::usual, Tier::near, Tier::far}) {
        // Packets are looked for only where next to nothing fits.
        if (tier == Tier::far &&
            (blocks != 1 || loose || course.loss < 0.5 * kLostLoss * static_cast<double>(shots))) {
          break;
        }
        for (const std::int64_t change : changes_of(tier)) try_change(change);
        if (loose) {  // each change was fitted alone, and happened in the gap before these shots
          std::size_t best = 0, second = 1;
          for (std::size_t row = 1; row < table.change.size(); ++row) {
            if (table.total(row) < table.total(best)) {
              second = std::exchange(best, row);
            } else if (second == best || table.total(row) < table.total(second)) {
              second = row;
            }
          }
          course.loss = table.total(best) - table.pull[best];
          if (course.loss > fair * static_cast<double>(shots)) continue;
          if (best != 0 && from.place != last_slip_ &&
              table.total(second) - table.total(best) > kSure) {
            verdict.kind = Verdict::slip;
            verdict.place = from.place;
            verdict.change = table.change[best];
            return verdict;
          }
          if (last && best != 0) verdict.kind = Verdict::lost;
          break;
        }
        course = likeliest_course(table, from.place == last_slip_ ? 1 : 0, penalty());
        if (course.stretches.size() == 1) {
          if (!none_fits) continue;
          verdict.sure_until = window;
          return verdict;
        }
        const auto& behind = course.stretches[1];
        const auto loss_of = [&](std::size_t row) {
          double sum = 0;
          for (std::size_t i = behind.begin; i < behind.end; ++i) sum += table.loss[row][i];
          return sum;
        };
        const auto count = static_cast<double>(behind.end - behind.begin);
        const double fitted = loss_of(behind.row);
        double second = std::numeric_limits<double>::infinity();
        for (std::size_t row = 0; row < table.change.size(); ++row) {
          if (row != behind.row) second = std::min(second, loss_of(row));
        }
        const bool sized = second - fitted > penalty();
        const bool fits = fitted < (2.0 * usual_loss_ + 0.5) * count + 8.0 * std::sqrt(count);
        const bool enough = behind.end - behind.begin >= kFewestBehind || window >= count_;
        if (fits && sized && enough) {
          verdict.kind = Verdict::slip;
          verdict.place = from.place + behind.begin;
          verdict.change = table.change[behind.row];
          return verdict;
        }
        if (!fits) continue;
        if (last && enough && !none_fits) verdict.kind = Verdict::lost;  // of unknown size
        break;
      }
      if (last && course.loss > kLostLoss * static_cast<double>(shots) &&
          scale_of(from.place, lag_, predicted) > kLostSteps * step_) {
        verdict.kind = Verdict::lost;
      }
    }
    return verdict;
  }

  const NumberedShots& shots_;
  std::ptrdiff_t direction_;
  std::size_t first_, count_;
  double step_;  // rad
  std::int64_t lag_ = 0;
  std::size_t last_slip_ = std::numeric_limits<std::size_t>::max();  // place
  std::vector<Change> slips_;
  double missed_ = 0;
  double usual_loss_ = 1.7, correlation_ = 4.0;
};

/// A stretch whose rotors are known at one time.
struct Anchor {
  Start start;
  std::size_t shot = 0;  // valid shot next to it
  std::vector<std::uint8_t> firing_order;
};

/// Which emitter fired which shot, from the steps between neighbouring shots: all are equal, but
/// for the one from the last emitter back to the first.
/// @param[out] order  emitter of shots 0, 1, ... @return whether there were shots to tell it from
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

/// Begins of windows of a length, evenly spread over a span and overlapping by half, s.
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

/// A start from windows long enough to tell all rotors apart. Slips within them bend it by degrees.
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

/// Missing shots before each valid shot of a stretch, against the one of its start.
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

/// Fits the optics again to the mended shots about an anchor. @return whether that went well
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

/// A short window that was fitted alone.
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
    Follower::State state = Follower::loose_state(start, kAngleSigma, kSpeedShare);
    Follower follower(shots, start.train, 0, usual_step(start, shots.rate), 1, window.rows.begin,
                      window.rows.size());
    window.anchor.start = start;
    window.anchor.start.residual_rms = follower.settle(state, radians_from_degrees(3.0));
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

/// Fits of short windows about a start, best first. A slip within it spoils a window: the shorter
/// they are, the more of them are free of slips, and the less they determine.
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

/// Moves slips to the borders of packets where most are there: at some rotation angles rotors that
/// turn against each other do not tell by some dozens of shots where it was.
void move_to_borders(const NumberedShots& shots, ShotRange range, std::vector<FoundSlip>& slips) {
  if (slips.size() < kFewestAtBorders) return;
  const auto past = [](std::int64_t number, std::int64_t border, std::int64_t packet) {
    return ((number - border) % packet + packet) % packet;  // shots behind the last border
  };
  std::size_t most = 0;
  std::int64_t border = 0, packet = 0;
  for (const std::int64_t size : kPacketShots) {
    for (std::int64_t place = 0; place < size; ++place) {
      const auto at = std::count_if(slips.begin(), slips.end(), [&](const FoundSlip& slip) {
        const std::int64_t after = shots.number[slip.after];
        return past(after, place, size) < after - shots.number[slip.before];
      });
      if (static_cast<std::size_t>(at) <= most) continue;
      most = static_cast<std::size_t>(at);
      border = place;
      packet = size;
    }
  }
  if (static_cast<double>(most) < kShareAtBorders * static_cast<double>(slips.size())) return;
  for (FoundSlip& slip : slips) {
    const std::int64_t after = shots.number[slip.after], behind = past(after, border, packet);
    if (behind < after - shots.number[slip.before]) continue;
    const std::int64_t to = after - behind + (2 * behind > packet ? packet : 0);
    const auto first = shots.number.begin() + static_cast<std::ptrdiff_t>(range.begin);
    const auto last = shots.number.begin() + static_cast<std::ptrdiff_t>(range.end);
    const auto found = std::lower_bound(first, last, to);
    if (found == first || found == last) continue;
    slip.after = static_cast<std::size_t>(found - shots.number.begin());
    slip.before = slip.after - 1;
  }
}

/// Follows the rotors from an anchor to both ends of a stretch, or as far as they can be followed.
Followed follow(const NumberedShots& shots, const Anchor& anchor, ShotRange range) {
  constexpr std::size_t kSettled = 150;  // shots on either side
  const double step = usual_step(anchor.start, shots.rate);
  const auto follower = [&](std::ptrdiff_t direction, std::size_t first, std::size_t count) {
    return Follower(shots, anchor.start.train, anchor.start.residual_rms, step, direction, first,
                    count);
  };
  Follower::State state = Follower::loose_state(anchor.start, kAnchorAngleSigma, kAnchorSpeedShare);
  const std::size_t near = anchor.shot - std::min(kSettled, anchor.shot - range.begin);
  const std::size_t far = std::min(range.end, anchor.shot + kSettled);
  follower(1, near, far - near).settle(state, radians_from_degrees(0.1));
  state.covariance *= 4.0;
  Follower ahead = follower(1, anchor.shot, range.end - anchor.shot);
  Follower back = follower(-1, anchor.shot, anchor.shot - range.begin + 1);
  Followed result;
  result.end = anchor.shot + ahead.run(state);
  result.begin = anchor.shot + 1 - back.run(state);
  for (const Follower::Change& change : ahead.slips()) {
    const std::size_t after = ahead.shot_at(change.place);
    result.slips.push_back({after - 1, after, change.change});
  }
  for (const Follower::Change& change : back.slips()) {
    const std::size_t before = back.shot_at(change.place);
    result.slips.push_back({before, before + 1, -change.change});
  }
  std::sort(result.slips.begin(), result.slips.end(),
            [](const FoundSlip& a, const FoundSlip& b) { return a.after < b.after; });
  // A slip that was found in two steps.
  constexpr std::size_t kOnePlace = 6;
  for (std::size_t i = 1; i < result.slips.size();) {
    if (result.slips[i].after - result.slips[i - 1].after < kOnePlace) {
      result.slips[i - 1].shots += result.slips[i].shots;
      result.slips.erase(result.slips.begin() + static_cast<std::ptrdiff_t>(i));
    } else {
      ++i;
    }
  }
  std::erase_if(result.slips, [](const FoundSlip& slip) { return slip.shots == 0; });
  move_to_borders(shots, {result.begin, result.end}, result.slips);
  result.residual_rms = (ahead.missed() + back.missed()) /
                        static_cast<double>(std::max<std::size_t>(1, result.end - result.begin));
  return result;
}

bool same_slips(const std::vector<FoundSlip>& a, const std::vector<FoundSlip>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const FoundSlip& one, const FoundSlip& other) {
                      return one.after == other.after && one.shots == other.shots;
                    });
}

/// A stretch that was followed, with what is needed to join it to others.
struct FollowedPiece {
  Followed followed;
  std::int64_t first_lag = 0;
  std::vector<std::uint8_t> firing_order;  // of shots without lag
};

/// Follows the rotors through a stretch.
/// @param prepared  whether prepare_shots() was called for the series
/// @return nothing where they are not found
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
  // An anchor is as good as what comes of following the rotors from it.
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

/// Follows the rotors through all shots, and anew where they are lost. @return pieces in time order
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

/// By how many shots the order of one piece runs ahead of another's; 0 where they differ otherwise.
std::int64_t order_shift(const std::vector<std::uint8_t>& of, const std::vector<std::uint8_t>& in) {
  for (std::size_t shift = 0; shift < of.size(); ++shift) {
    bool same = true;
    for (std::size_t i = 0; i < of.size(); ++i) same = same && in[(i + shift) % in.size()] == of[i];
    if (same) return static_cast<std::int64_t>(shift);
  }
  return 0;
}

}  // namespace

namespace {

/// Angles between shots that stand so many rows apart, rad.
std::vector<double> steps_over(const CountedShots& shots, std::size_t rows) {
  constexpr std::size_t kMost = 100'000;
  std::vector<double> steps;
  for (std::size_t i = 0, next = 0; i < shots.rows.size() && steps.size() < kMost; ++i) {
    while (next < shots.rows.size() && shots.rows[next] < shots.rows[i] + rows) ++next;
    if (next == shots.rows.size() || shots.rows[next] != shots.rows[i] + rows) continue;
    const AngleSeries& s = shots.series;
    const double azimuth = std::remainder(s.azimuth[next] - s.azimuth[i], kTwoPi);
    steps.push_back(std::hypot(azimuth * std::sin(s.zenith[i]), s.zenith[next] - s.zenith[i]));
  }
  return steps;
}

}  // namespace

int emitters_in_turn(const CountedShots& shots) {
  constexpr double kSmoother = 1.5;
  std::vector<double> neighbours = steps_over(shots, 1);
  const double usual = median(neighbours);
  for (const int emitters : {4, 6}) {
    std::vector<double> steps = steps_over(shots, static_cast<std::size_t>(emitters));
    if (median(steps) < kSmoother * usual) return emitters;
  }
  return 1;
}

double rows_between_jumps(const CountedShots& shots, int emitters) {
  constexpr std::size_t kFewest = 500, kMost = 100'000;
  // Changes of the step from shot to shot: share of the usual step, and multiples of the usual
  // change and of what rounding leaves. Beams that turn smoothly change it by some per cent.
  constexpr double kChange = 0.5, kUsualChanges = 6.0, kRounding = 5.0;
  const auto turn = static_cast<std::size_t>(std::max(emitters, 1));
  const AngleSeries& s = shots.series;
  const auto step = [&s](std::size_t from, std::size_t to) {
    const double azimuth = std::remainder(s.azimuth[to] - s.azimuth[from], kTwoPi);
    return Eigen::Vector2d(azimuth * std::sin(s.zenith[from]), s.zenith[to] - s.zenith[from]);
  };
  std::vector<double> steps, changes, roundings;
  std::size_t next = 0, last = 0;
  const auto find = [&](std::size_t row, std::size_t& place) {
    while (place < shots.rows.size() && shots.rows[place] < row) ++place;
    return place < shots.rows.size() && shots.rows[place] == row;
  };
  for (std::size_t i = 0; i < shots.rows.size() && steps.size() < kMost; ++i) {
    if (!find(shots.rows[i] + turn, next) || !find(shots.rows[i] + 2 * turn, last)) continue;
    const Eigen::Vector2d one = step(i, next), other = step(next, last);
    steps.push_back(one.norm());
    changes.push_back((other - one).norm());
    roundings.push_back(std::sqrt(6.0 * static_cast<double>(s.zenith_rounding_variance[next])));
  }
  if (steps.size() < kFewest) return std::numeric_limits<double>::infinity();
  std::vector<double> sorted = changes;
  const double limit = std::max(kChange * median(steps), kUsualChanges * median(sorted));
  double jumps = 0;  // each is seen from both sides, by every emitter
  for (std::size_t i = 0; i < changes.size(); ++i) {
    jumps += changes[i] > std::max(limit, kRounding * roundings[i]) ? 0.5 : 0.0;
  }
  return static_cast<double>(changes.size() * turn) / jumps;
}

ShotCount find_slips(const CountedShots& counted, const sensors::Sensor& sensor,
                     const Progress& progress) {
  require_length("rows", counted.rows.size(), counted.series.size());
  require_above("shot rate", counted.shot_rate, 0, "Hz");
  constexpr double kOtherRate = 0.05;
  ShotCount result;
  // Of a recording that was thinned nobody knows what a row is worth.
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
  // The count of the first piece's first shot is kept as it is.
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
