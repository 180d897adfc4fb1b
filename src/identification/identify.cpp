// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/identification/identify.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include "risley/core/angle.hpp"
#include "risley/core/direction.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/estimation/packed_series.hpp"
#include "risley/optics/observation_model.hpp"
#include "risley/optics/parameters.hpp"
#include "risley/parallel/parallel.hpp"

#include "identification/whole_fit.hpp"

namespace risley::identification {
namespace {

/// Part of a scan in which lines are searched, s, or number of shots if that is longer; if no train
/// fits, rotors may turn nearly alike, and longer windows separate their lines.
constexpr double kLineWindow = 1.0;
constexpr double kLineShots = 4096;
constexpr double kLongerWindow = 4;
/// Window on which trains are tried, s, and its number of shots.
constexpr double kTrialWindow = 0.15;
constexpr std::size_t kTrialShots = 600;
/// Before that, all arrangements are tried roughly; numbers of those kept in two steps.
constexpr std::size_t kRoughShots = 150;
constexpr double kRoughTolerance = 1e-3, kHopelessSet = 4;
constexpr std::size_t kPromising = 96, kTriedInFull = 16;
/// Arrangements that leave this many times as much as the best one are dropped, except for a few.
constexpr double kHopeless = 10;
constexpr std::size_t kFewestRivals = 3;
/// A further prism must reduce the remainder to this share: one that moves the beam does.
constexpr double kFurtherPrism = 0.5;
/// Longest part of a recording used, s.
constexpr double kLongest = 10;
/// Shots of the whole stretch for comparing trains.
constexpr std::size_t kComparedShots = 12'000;
/// Shots for fitting the best and its close rivals.
constexpr std::size_t kMostShots = 1'500'000;
/// The strongest lines, some of which are the rotors' own.
constexpr std::size_t kOwnLines = 5;
/// Wedges and indices at the start of a fit: the deviation is that of the line.
constexpr std::array<double, 3> kStartIndex{1.45, 1.6, 1.85};
/// Angles tried between a wedge and a reflector, each with the speeds of any two of this many
/// lines.
constexpr int kReflectorPhases = 12;
constexpr std::size_t kReflectorLines = 4;
/// A scan reaches all around if each of these sectors about Z holds a tenth of its share.
constexpr std::size_t kSectors = 36;
constexpr double kFewestInSector = 0.1;
/// A frame turned by more than an emitter can lean counts as a turned frame.
constexpr double kTurnedFrame = 0.03;
constexpr double kOneGlassLead = 9;
/// A rival that leaves less than this share of the noise in a noise-free scan is equivalent.
constexpr double kEquivalentShare = 1e-3;
constexpr double kEquivalentRms = 1e-10;

/// Rotors in beam order, by the place of their lines, and the faces of their prisms.
struct Arrangement {
  std::vector<std::size_t> lines;
  std::vector<FaceOrder> faces;
};

struct Trial {
  Arrangement arrangement;
  TrainFit fit;
};

std::vector<std::vector<FaceOrder>> all_face_orders(std::size_t prisms) {
  std::vector<std::vector<FaceOrder>> all;
  for (unsigned bits = 0; bits < (1U << prisms); ++bits) {
    std::vector<FaceOrder> faces;
    for (std::size_t k = 0; k < prisms; ++k) {
      faces.push_back(((bits >> k) & 1U) != 0 ? FaceOrder::angled_perpendicular
                                              : FaceOrder::perpendicular_angled);
    }
    all.push_back(faces);
  }
  return all;
}

/// Every order of a set of lines with all faces.
std::vector<Arrangement> arrangements(std::vector<std::size_t> lines) {
  std::vector<Arrangement> all;
  std::sort(lines.begin(), lines.end());
  do {
    for (auto& faces : all_face_orders(lines.size())) all.push_back({lines, faces});
  } while (std::next_permutation(lines.begin(), lines.end()));
  return all;
}

/// Sets of a number of the first lines, those of the strongest lines first.
std::vector<std::vector<std::size_t>> line_sets(std::size_t lines, std::size_t size) {
  std::vector<std::vector<std::size_t>> sets;
  for (unsigned bits = 0; bits < (1U << lines); ++bits) {
    std::vector<std::size_t> set;
    for (std::size_t k = 0; k < lines; ++k) {
      if (((bits >> k) & 1U) != 0) set.push_back(k);
    }
    if (set.size() == size) sets.push_back(set);
  }
  std::sort(sets.begin(), sets.end(), [](const auto& a, const auto& b) {
    return std::accumulate(a.begin(), a.end(), std::size_t{0}) <
           std::accumulate(b.begin(), b.end(), std::size_t{0});
  });
  return sets;
}

/// About this many shots, in whole rounds of the emitters.
ShotGrid thinned(const ShotGrid& grid, std::size_t begin, std::size_t end, std::size_t most) {
  const std::size_t every = std::max<std::size_t>(1, (end - begin + most - 1) / most);
  const auto round = static_cast<std::size_t>(grid.emitters);
  std::vector<std::size_t> rows;
  for (std::size_t i = begin; i < end; ++i) {
    if ((i - begin) / round % every == 0) rows.push_back(i);
  }
  return rows_of(grid, rows);
}

class TrainSearch {
 public:
  /// @param spectrum    in the train's frame
  /// @param window  used for the lines, s
  /// @param all_around  for a wedge and a reflector that turn about Z; otherwise prisms about X
  TrainSearch(const ShotGrid& grid, LineSpectrum spectrum, double window, bool all_around,
              const IdentifyOptions& options, const Progress& progress)
      : grid_(grid),
        spectrum_(std::move(spectrum)),
        all_around_(all_around),
        window_(std::min(window, grid.duration())),
        options_(options),
        progress_(progress) {
    start_freedom_.glass = start_freedom_.one_glass = true;
    start_freedom_.emitters = start_freedom_.lags = grid.emitters > 1;
    Complex mean;
    for (const Complex& constant : spectrum_.constant) {
      mean += constant / static_cast<double>(spectrum_.constant.size());
    }
    // Beams all around are on average as long along the axis as their mean height.
    if (all_around) mean /= mean_height(grid);
    if (std::abs(mean) > kTurnedFrame && std::abs(mean) < 1) {
      start_freedom_.frame = true;
      const double forward = std::sqrt(1 - std::norm(mean));
      frame_ = {std::atan2(mean.real(), forward),
                std::atan2(-mean.imag(), std::hypot(forward, mean.real()))};
    }
    frame_.axis_up = all_around;
    // The motion is judged before anything else is freed.
    start_freedom_.frame = start_freedom_.frame || all_around;
    choose_trial_window();
    compared_ = thinned(grid, 0, grid.size(), kComparedShots);
  }

  Identification run() {
    if (all_around_) return compare(try_reflector());
    std::vector<Trial> trials;
    for (int prisms = 1; prisms <= options_.most_prisms; ++prisms) {
      if (static_cast<std::size_t>(prisms) > spectrum_.lines.size()) break;
      std::vector<Trial> more = try_all(static_cast<std::size_t>(prisms));
      progress_.report(0.15 * prisms);
      if (more.empty() || !std::isfinite(more.front().fit.rms)) continue;
      if (!trials.empty() && !explains_more(more.front().fit, trials.front().fit)) continue;
      trials = std::move(more);
      if (prisms > 1 && nothing_left(trials.front().fit)) break;
    }
    if (trials.empty()) {
      throw EstimationError(
          "no prism train reproduces the beams of this recording: in all arrangements tried, the "
          "beams do not pass through the prisms");
    }
    return compare(std::move(trials));
  }

 private:
  static double mean_height(const ShotGrid& grid) {
    double sum = 0;
    for (const double zenith : grid.zenith) sum += std::cos(zenith);
    return sum / static_cast<double>(grid.size());
  }

  void choose_trial_window() {
    double slowest = options_.fastest, closest = options_.fastest;
    for (std::size_t a = 0; a < std::min<std::size_t>(3, spectrum_.lines.size()); ++a) {
      const double speed = spectrum_.lines[a].angular_velocity;
      slowest = std::min(slowest, std::abs(speed));
      for (std::size_t b = 0; b < a; ++b) {
        closest = std::min(closest, std::abs(speed - spectrum_.lines[b].angular_velocity));
      }
    }
    // Several turns of a rotor, and one of two against each other.
    double length = std::max({kTrialWindow, 2.5 * kTwoPi / slowest, kTwoPi / closest});
    length = std::max(length, 300 * grid_.step);
    length = std::min(length, window_);
    const double begin = 0.5 * (window_ - length);
    const std::size_t first = row_at(grid_, begin);
    const std::size_t last = row_at(grid_, begin + length);
    trial_grid_ = thinned(grid_, first, last, kTrialShots);
    trial_begin_ = grid_.time[first];
    trial_end_ = grid_.time[last - 1];
  }

  TrainModel start(const Arrangement& arrangement, double index, double thinner = 1) const {
    TrainModel model;
    model.train = PrismTrain(arrangement.faces, grid_.emitters);
    model.frame = frame_;
    model.lag.assign(static_cast<std::size_t>(grid_.emitters), 0.0);
    const int prisms = model.train.prisms();
    // A quartic follows a hunting rotor over a window.
    RotorCurves line(prisms, trial_begin_, trial_end_, 1, 1, true);
    for (int k = 0; k < prisms; ++k) {
      const Line& own = spectrum_.lines[arrangement.lines[static_cast<std::size_t>(k)]];
      model.train.set_place(place::refractive_index(k), index);
      // Deviation of a beam at normal incidence on the perpendicular face.
      const double aside = std::asin(std::min(0.95, std::abs(own.amplitude)));
      model.train.set_place(place::wedge_angle(k),
                            thinner * std::atan2(std::sin(aside), index - std::cos(aside)));
      // A prism deflects the beam towards its thick end, down at rotation angle 0.
      const double zero = std::arg(own.amplitude) + 0.5 * kPi;
      line.coefficient(k, 0) = zero + own.angular_velocity * trial_begin_;
      line.coefficient(k, 1) = zero + own.angular_velocity * trial_end_;
    }
    model.rotors = resampled(line, RotorCurves(prisms, trial_begin_, trial_end_, 1, 4, false));
    set_emitters(model.train);
    return model;
  }

  /// The emitters according to their constants.
  void set_emitters(PrismTrain& train) const {
    if (grid_.emitters == 1) return;
    const int prisms = train.prisms();
    Complex off =
        start_freedom_.frame ? Complex(std::sin(frame_.yaw), -std::sin(frame_.pitch)) : Complex{};
    if (all_around_) off *= mean_height(grid_);
    // Behind a mirror most of an emitter's lean turns with the reflector.
    const double seen = all_around_ ? 0.35 : 1.0;
    for (int j = 0; j < grid_.emitters; ++j) {
      const Complex constant = (spectrum_.constant[static_cast<std::size_t>(j)] - off) / seen;
      train.set_place(place::incident_beam_horizontal(j, prisms), -constant.real());
      train.set_place(place::incident_beam_vertical(j, prisms), constant.imag());
    }
  }

  /// A wedge and a reflector that turn with two of the lines, from the optics of the Mid-360.
  /// @param between  angle of the wedge from the reflector in the middle of the window, rad
  TrainModel start_of_reflector(std::size_t wedge, std::size_t reflector, double between) const {
    TrainModel model;
    model.train = PrismTrain({FaceOrder::angled_angled, FaceOrder::perpendicular_mirror_upright},
                             grid_.emitters);
    model.frame = frame_;
    model.lag.assign(static_cast<std::size_t>(grid_.emitters), 0.0);
    set_emitters(model.train);
    const Line &a = spectrum_.lines[wedge], &b = spectrum_.lines[reflector];
    // At rotation angle 0 the beam leaves the reflector downwards.
    const double middle = 0.5 * (trial_begin_ + trial_end_);
    const double zero = std::arg(b.amplitude) + 0.5 * kPi + b.angular_velocity * middle;
    RotorCurves line(2, trial_begin_, trial_end_, 1, 1, true);
    for (const int end : {0, 1}) {
      const double since = (end == 0 ? trial_begin_ : trial_end_) - middle;
      line.coefficient(0, end) = zero + between + a.angular_velocity * since;
      line.coefficient(1, end) = zero + b.angular_velocity * since;
    }
    model.rotors = resampled(line, RotorCurves(2, trial_begin_, trial_end_, 1, 4, false));
    return model;
  }

  /// The best fit with every pair of lines as the speeds of wedge and reflector, best first.
  std::vector<Trial> try_reflector() const {
    std::vector<Trial> trials;
    const std::size_t own = std::min(kReflectorLines, spectrum_.lines.size());
    for (std::size_t a = 0; a < own; ++a) {
      for (std::size_t b = 0; b < own; ++b) {
        if (a == b) continue;
        trials.push_back(
            {{{a, b}, {FaceOrder::angled_angled, FaceOrder::perpendicular_mirror_upright}}, {}});
      }
    }
    if (trials.empty()) throw EstimationError("a scan all around with a single line");
    const ShotGrid rough = thinned(trial_grid_, 0, trial_grid_.size(), kRoughShots);
    TrainFreedom free_glass = start_freedom_;
    free_glass.one_glass = false;
    parallel::for_each(trials.size(), [&](std::size_t t) {
      TrainFit& best = trials[t].fit;
      best.rms = std::numeric_limits<double>::infinity();
      const auto take_better = [&](TrainFit fit) {
        if (fit.rms < best.rms) best = std::move(fit);
      };
      for (int phase = 0; phase < kReflectorPhases; ++phase) {
        const TrainModel start =
            start_of_reflector(trials[t].arrangement.lines[0], trials[t].arrangement.lines[1],
                               kTwoPi * phase / kReflectorPhases);
        take_better(fit_train(rough, start, {}, {.iterations = 12, .tolerance = kRoughTolerance},
                              progress_.silent()));
      }
      if (!std::isfinite(best.rms)) return;
      const TrainModel start = best.model;
      best.rms = std::numeric_limits<double>::infinity();
      take_better(
          fit_train(trial_grid_, start, start_freedom_, {.iterations = 20}, progress_.silent()));
      if (!std::isfinite(best.rms)) return;
      take_better(fit_train(trial_grid_, TrainModel(best.model), free_glass, {.iterations = 15},
                            progress_.silent()));
    });
    std::stable_sort(trials.begin(), trials.end(), better);
    if (!std::isfinite(trials.front().fit.rms)) {
      throw EstimationError("no wedge and reflector reproduce the beams of this recording");
    }
    return trials;
  }

  /// The best fits of arrangements of sets of lines, on the trial window: of all of them roughly,
  /// then of the nearest sets, then of the best arrangements in full.
  std::vector<Trial> try_all(std::size_t prisms) const {
    struct LineSet {
      std::vector<Trial> trials;
      double least = std::numeric_limits<double>::infinity();
    };
    std::vector<LineSet> sets;
    const std::size_t own = std::min(kOwnLines, spectrum_.lines.size());
    for (const auto& set : line_sets(own, prisms)) {
      sets.emplace_back();
      for (Arrangement& one : arrangements(set)) sets.back().trials.push_back({std::move(one), {}});
    }
    const ShotGrid rough = thinned(trial_grid_, 0, trial_grid_.size(), kRoughShots);
    parallel::for_each(sets.size(), [&](std::size_t s) {
      for (const Trial& trial : sets[s].trials) {
        const TrainFit fit = rough_fit(rough, trial.arrangement, 6);
        sets[s].least = std::min(sets[s].least, fit.rms);
      }
    });
    std::stable_sort(sets.begin(), sets.end(),
                     [](const LineSet& a, const LineSet& b) { return a.least < b.least; });
    std::vector<Trial> trials;
    for (LineSet& set : sets) {
      if (trials.size() > 0 && (trials.size() + set.trials.size() > kPromising ||
                                set.least > kHopelessSet * sets.front().least)) {
        break;
      }
      trials.insert(trials.end(), std::make_move_iterator(set.trials.begin()),
                    std::make_move_iterator(set.trials.end()));
    }
    TrainFreedom free_glass = start_freedom_;
    free_glass.one_glass = prisms == 1;
    const ShotGrid fewer = thinned(trial_grid_, 0, trial_grid_.size(), trial_grid_.size() / 2);
    parallel::for_each(trials.size(), [&](std::size_t t) {
      TrainFit fit = rough_fit(fewer, trials[t].arrangement, 12);
      if (std::isfinite(fit.rms)) {
        fit = fit_train(fewer, fit.model, free_glass,
                        {.iterations = 8, .tolerance = kRoughTolerance}, progress_.silent());
      }
      trials[t].fit = std::move(fit);
    });
    std::stable_sort(trials.begin(), trials.end(), better);
    if (trials.size() > kTriedInFull) trials.resize(kTriedInFull);
    parallel::for_each(trials.size(), [&](std::size_t t) {
      Trial& trial = trials[t];
      std::vector<TrainModel> starts{trial.fit.model};
      trial.fit = {};
      trial.fit.rms = std::numeric_limits<double>::infinity();
      for (const double index : kStartIndex) starts.push_back(start(trial.arrangement, index));
      for (std::size_t from = 0; from < starts.size(); ++from) {
        TrainFit fit = fit_train(trial_grid_, starts[from], from == 0 ? free_glass : start_freedom_,
                                 {.iterations = 20}, progress_.silent());
        if (fit.rms < trial.fit.rms) trial.fit = std::move(fit);
      }
      if (!std::isfinite(trial.fit.rms)) return;
      TrainFit fit = fit_train(trial_grid_, trial.fit.model, free_glass, {.iterations = 15},
                               progress_.silent());
      if (fit.rms < trial.fit.rms) trial.fit = std::move(fit);
    });
    std::stable_sort(trials.begin(), trials.end(), better);
    return trials;
  }
  /// From a middle index, or from higher ones and thinner wedges if beams do not get out.
  TrainFit rough_fit(const ShotGrid& grid, const Arrangement& arrangement, int iterations) const {
    TrainFit fit;
    for (const double thinner : {1.0, 0.92, 0.85}) {
      for (const double index : {1.6, 1.85}) {
        fit =
            fit_train(grid, start(arrangement, index, thinner), start_freedom_,
                      {.iterations = iterations, .tolerance = kRoughTolerance}, progress_.silent());
        if (std::isfinite(fit.rms)) return fit;
      }
    }
    return fit;
  }
  static bool better(const Trial& a, const Trial& b) { return a.fit.rms < b.fit.rms; }

  /// Whether the residuals of a fit no longer contain a line.
  bool nothing_left(const TrainFit& fit) const {
    double power = 0;
    const std::size_t n = trial_grid_.size();
    for (std::size_t i = 0; i < n; ++i) {
      power += fit.azimuth_residual[i] * fit.azimuth_residual[i] +
               fit.zenith_residual[i] * fit.zenith_residual[i];
    }
    double largest = 0;
    const double length = trial_end_ - trial_begin_;
    const auto edge = static_cast<int>(options_.fastest * length / kTwoPi * 2);
    for (int bin = -edge; bin <= edge; ++bin) {
      const double speed = 0.5 * kTwoPi * bin / length;
      Complex sum;
      for (std::size_t i = 0; i < n; ++i) {
        sum += Complex(fit.azimuth_residual[i], fit.zenith_residual[i]) *
               std::polar(1.0, -speed * trial_grid_.time[i]);
      }
      largest = std::max(largest, std::norm(sum));
    }
    return largest < 20 * power;
  }

  /// Frees quantities that improve the fit by more than chance would.
  TrainFreedom choose_freedom(const TrainModel& model, const Motion& motion, TrainFit& best) const {
    TrainFreedom freedom = start_freedom_;
    const auto first = fit_whole(compared_, model, freedom, motion, 25, progress_.silent());
    if (!first) return freedom;
    best = *first;
    const int prisms = model.train.prisms();
    for (;;) {
      std::vector<TrainFreedom> wider;
      const auto offer = [&](bool TrainFreedom::*what, bool value) {
        if (freedom.*what == value) return;
        wider.push_back(freedom);
        wider.back().*what = value;
      };
      if (prisms > 1) offer(&TrainFreedom::one_glass, false);
      offer(&TrainFreedom::frame, true);
      if (grid_.emitters == 1) offer(&TrainFreedom::emitters, true);
      offer(&TrainFreedom::tilts, true);
      const TrainFreedom* chosen = nullptr;
      TrainFit chosen_fit;
      double most = 0;
      for (const TrainFreedom& one : wider) {
        TrainFit fit = fit_train(compared_, best.model, one,
                                 {.iterations = 25, .without_outliers = true}, progress_.silent());
        if (!std::isfinite(fit.rms)) continue;
        const double gained =
            chi2_excess(best, fit) - 2.0 * static_cast<double>(fit.unknowns - best.unknowns);
        // A common glass is an assumption that is dropped easily, a turned frame or tilted prisms
        // are a finding.
        const double needed = one.one_glass == freedom.one_glass ? kFairLead : kOneGlassLead;
        if (gained > needed && gained > most) {
          most = gained;
          chosen = &one;
          chosen_fit = std::move(fit);
        }
      }
      if (chosen == nullptr) return freedom;
      freedom = *chosen;
      best = std::move(chosen_fit);
    }
  }

  /// Whether a further prism is worth its unknowns.
  static bool explains_more(const TrainFit& more, const TrainFit& fewer) {
    return more.rms < kFurtherPrism * fewer.rms &&
           chi2_excess(fewer, more) >
               kFairLead + 2.0 * static_cast<double>(more.unknowns - fewer.unknowns);
  }

  Identification compare(std::vector<Trial> trials) {
    Identification result;
    std::vector<Trial> chosen = one_of_each(std::move(trials));
    // Freedoms needed by the best one are granted to all; then another may be the best.
    TrainFreedom freedom;
    Motion motion;
    std::vector<TrainFit> fits;
    std::size_t leader = 0;
    for (int round = 0; round < 3; ++round) {
      const TrainModel& model = chosen[leader].fit.model;
      TrainFit best;
      best.rms = std::numeric_limits<double>::infinity();
      TrainFreedom wide = start_freedom_;
      wide.one_glass = chosen[leader].fit.model.train.prisms() < 2 || grid_.emitters == 1;
      motion = choose_motion(compared_, model, wide, progress_);
      freedom = choose_freedom(model, motion, best);
      fits.assign(chosen.size(), {});
      parallel::for_each(chosen.size(), [&](std::size_t c) {
        auto fit =
            fit_whole(compared_, chosen[c].fit.model, freedom, motion, 25, progress_.silent());
        fits[c].rms = std::numeric_limits<double>::infinity();
        if (fit) fits[c] = std::move(*fit);
        if (c == leader && best.rms < fits[c].rms) fits[c] = best;
      });
      const auto least = std::min_element(
          fits.begin(), fits.end(), [](const auto& a, const auto& b) { return a.rms < b.rms; });
      if (!std::isfinite(least->rms)) {
        throw EstimationError(
            "no train fits the whole recording: its rotors could not be followed beyond its "
            "middle");
      }
      const auto now = static_cast<std::size_t>(least - fits.begin());
      progress_.report(0.6 + 0.1 * round);
      if (now == leader) break;
      leader = now;
    }
    if (grid_.emitters > 1) freedom = settle_timing(fits[leader], freedom, result);
    result.freedom = freedom;
    result.motion = motion;
    rank(std::move(fits), leader, result);
    return result;
  }

  /// The best trial of every arrangement of its faces and rotors, best first.
  std::vector<Trial> one_of_each(std::vector<Trial> trials) const {
    std::vector<Trial> chosen;
    std::vector<std::size_t> lines = trials.front().arrangement.lines;
    std::sort(lines.begin(), lines.end());
    for (Trial& trial : trials) {
      if (!std::isfinite(trial.fit.rms)) continue;
      std::vector<std::size_t> own = trial.arrangement.lines;
      std::sort(own.begin(), own.end());
      if (own != lines) continue;
      if (chosen.size() > kFewestRivals && trial.fit.rms > kHopeless * chosen.front().fit.rms) {
        break;
      }
      chosen.push_back(std::move(trial));
    }
    return chosen;
  }

  /// Whether the emitters' lags are zero, those of shots that share a time, or others.
  TrainFreedom settle_timing(TrainFit& best, TrainFreedom freedom, Identification& result) const {
    TrainFreedom without = freedom;
    without.lags = false;
    TrainModel model = best.model;
    std::fill(model.lag.begin(), model.lag.end(), 0.0);
    const TrainFit even =
        fit_train(compared_, model, without, {.iterations = 25, .without_outliers = true},
                  progress_.silent());
    if (std::isfinite(even.rms) && chi2_excess(even, best) < kFairLead + 2.0 * grid_.emitters) {
      result.timing = EmitterTiming::in_turn;
      best = even;
      return without;
    }
    // Shots of a round that share a time lag by their places in it, in equal steps.
    std::vector<double> lag = best.model.lag;
    std::sort(lag.begin(), lag.end());
    const double each = (lag.back() - lag.front()) / static_cast<double>(lag.size() - 1);
    bool equal = true;
    for (std::size_t j = 0; j < lag.size(); ++j) {
      const double off = lag[j] - lag.front() - each * static_cast<double>(j);
      equal = equal && std::abs(off) < 0.1 * each;
    }
    result.timing = equal ? EmitterTiming::together : EmitterTiming::uneven;
    return freedom;
  }

  void rank(std::vector<TrainFit> fits, std::size_t leader, Identification& result) {
    result.spectrum = spectrum_;
    result.step = grid_.step;
    result.emitters = grid_.emitters;
    result.rows = grid_.size();
    const TrainFit few = fits[leader];
    for (std::size_t f = 0; f < fits.size(); ++f) {
      if (!std::isfinite(fits[f].rms)) continue;
      if (f != leader && !result.freedom.lags) {
        std::fill(fits[f].model.lag.begin(), fits[f].model.lag.end(), 0.0);
      }
      const double excess = f == leader ? 0.0 : std::max(0.0, chi2_excess(fits[f], few));
      result.hypotheses.push_back({std::move(fits[f]), excess, {}, {}});
    }
    std::stable_sort(result.hypotheses.begin(), result.hypotheses.end(), smaller_excess);
    find_equivalents(result);
    // All rows for the best one, and for rivals not excluded by the thinned ones.
    const ShotGrid all = thinned(grid_, 0, grid_.size(), kMostShots);
    const double share = static_cast<double>(all.size()) / static_cast<double>(compared_.size());
    const auto fit_all = [&](Hypothesis& one) {
      one.fit = fit_train(all, one.fit.model, result.freedom,
                          {.iterations = 12, .without_outliers = true, .covariance = true},
                          progress_.silent());
    };
    std::vector<std::size_t> in_full;
    for (std::size_t h = 0; h < result.hypotheses.size(); ++h) {
      Hypothesis& one = result.hypotheses[h];
      if (h == 0 || (one.excess <= 4 * kFairLead && !is_best_or_equivalent(result, h))) {
        fit_all(one);
        in_full.push_back(h);
        progress_.report(0.95);
      } else {
        one.excess *= share;
      }
    }
    std::size_t best = 0;
    for (const std::size_t h : in_full) {
      if (result.hypotheses[h].fit.rms < result.hypotheses[best].fit.rms) best = h;
    }
    const TrainFit reference = result.hypotheses[best].fit;
    for (const std::size_t h : in_full) {
      result.hypotheses[h].excess =
          h == best ? 0 : std::max(0.0, chi2_excess(result.hypotheses[h].fit, reference));
    }
    if (best != 0) {
      for (Hypothesis& one : result.hypotheses) one.equivalent_to.clear();
      std::swap(result.hypotheses[0], result.hypotheses[best]);
      std::stable_sort(result.hypotheses.begin() + 1, result.hypotheses.end(), smaller_excess);
      find_equivalents(result);
    }
    if (choose_representative(result)) fit_all(result.hypotheses.front());
    Hypothesis& front = result.hypotheses.front();
    front.total_covariance = with_glass_free(all, front.fit, result.freedom);
    result.grid = compared_;
    result.correlation_time_factor = correlation_factor(reference);
    result.decided = true;
    for (std::size_t h = 1; h < result.hypotheses.size(); ++h) {
      if (!is_best_or_equivalent(result, h) && result.hypotheses[h].excess < kFairLead) {
        result.decided = false;
      }
    }
    result.fits = reference.rms < radians_from_degrees(0.1) ||
                  (result.correlation_time_factor < 3 && reference.rms < radians_from_degrees(1));
  }

  static bool only_first_faces_differ(const Hypothesis& a, const Hypothesis& b) {
    const auto &one = a.train().face_order(), &other = b.train().face_order();
    if (one.size() != other.size() || !std::equal(one.begin() + 1, one.end(), other.begin() + 1)) {
      return false;
    }
    for (int k = 0; k < a.train().prisms(); ++k) {
      const double speed = a.fit.model.rotors.mean_angular_velocity(k);
      const double rival = b.fit.model.rotors.mean_angular_velocity(k);
      if (std::abs(speed - rival) > 0.01 * std::abs(speed)) return false;
    }
    return true;
  }
  static bool smaller_excess(const Hypothesis& a, const Hypothesis& b) {
    return a.excess != b.excess ? a.excess < b.excess : a.fit.rms < b.fit.rms;
  }
  static bool is_best_or_equivalent(const Identification& result, std::size_t h) {
    const auto& same = result.hypotheses[h].equivalent_to;
    return h == 0 || std::find(same.begin(), same.end(), std::size_t{0}) != same.end();
  }

  /// The covariance without the assumption of one glass. The first prism of a single emitter on the
  /// axis shows only its deviation: variances of its index and wedge are infinite then.
  Eigen::MatrixXd with_glass_free(const ShotGrid& grid, const TrainFit& fit,
                                  TrainFreedom freedom) const {
    freedom.one_glass = false;
    return fit_train(grid, fit.model, freedom,
                     {.iterations = 0, .without_outliers = true, .covariance = true},
                     progress_.silent())
        .covariance;
  }

  /// Rivals that repeat the best one's scan, free of noise.
  void find_equivalents(Identification& result) const {
    const TrainFit& reference = result.hypotheses.front().fit;
    const ShotGrid scan = predicted(compared_, reference.model);
    const double most = std::max(kEquivalentRms, kEquivalentShare * reference.rms);
    std::vector<std::size_t> same{0};
    for (std::size_t h = 1; h < result.hypotheses.size(); ++h) {
      const Hypothesis& rival = result.hypotheses[h];
      if (rival.excess > kFairLead) break;
      const TrainFit fit =
          fit_train(scan, rival.fit.model, result.freedom, {.iterations = 25}, progress_.silent());
      // Only tilts reveal the faces of a single emitter's first prism, and barely.
      if (fit.rms < most ||
          (grid_.emitters == 1 && only_first_faces_differ(rival, result.hypotheses.front()))) {
        same.push_back(h);
      }
    }
    for (const std::size_t a : same) {
      for (const std::size_t b : same) {
        if (a != b) result.hypotheses[a].equivalent_to.push_back(b);
      }
    }
  }

  /// Among equivalent trains, the most likely design: equal wedges, then round ones.
  /// @return whether that is another one
  static bool choose_representative(Identification& result) {
    const auto oddness = [](const Hypothesis& h) {
      const PrismTrain& train = h.train();
      double apart = 0, from_round = 0;
      for (int k = 0; k < train.prisms(); ++k) {
        const double wedge = train[place::wedge_angle(k)];
        apart = std::max(apart, std::abs(wedge - train[place::wedge_angle(0)]));
        const double tenths = 10 * degrees_from_radians(wedge);
        from_round += std::abs(tenths - std::round(tenths));
      }
      const bool alike = apart < radians_from_degrees(0.05);
      return std::pair(alike ? 0 : 1, from_round);
    };
    auto& all = result.hypotheses;
    std::size_t chosen = 0;
    for (const std::size_t h : all.front().equivalent_to) {
      if (oddness(all[h]) < oddness(all[chosen])) chosen = h;
    }
    if (chosen == 0) return false;
    std::swap(all[0], all[chosen]);
    std::swap(all[0].excess, all[chosen].excess);
    // Places changed: all of the class list each other anew.
    for (Hypothesis& one : all) {
      for (std::size_t& place : one.equivalent_to) {
        if (place == 0) {
          place = chosen;
        } else if (place == chosen) {
          place = 0;
        }
      }
    }
    return true;
  }

  const ShotGrid& grid_;
  LineSpectrum spectrum_;
  bool all_around_;
  double window_;
  IdentifyOptions options_;
  const Progress& progress_;
  TrainFreedom start_freedom_;
  estimation::FrameTurn frame_;
  ShotGrid trial_grid_, compared_;
  double trial_begin_ = 0, trial_end_ = 0;
};

}  // namespace

std::string to_string(EmitterTiming timing) {
  switch (timing) {
    case EmitterTiming::one_emitter:
      return "one_emitter";
    case EmitterTiming::in_turn:
      return "in_turn";
    case EmitterTiming::together:
      return "together";
    case EmitterTiming::uneven:
      return "uneven";
  }
  return {};
}

namespace {

/// Directions of a sensor that turns about Z in the frame of its train, whose X is the axis.
void to_train_frame(ShotGrid& grid) {
  for (std::size_t i = 0; i < grid.size(); ++i) {
    const auto v = direction_from_angles<double>({grid.azimuth[i], grid.zenith[i]});
    const auto angles = angles_from_direction(in_train_frame<kWedgeAndReflector>(v));
    grid.azimuth[i] = angles.azimuth;
    grid.zenith[i] = angles.zenith;
  }
}

/// Whether a scan reaches all around Z.
bool is_all_around(const ShotGrid& grid) {
  std::array<std::size_t, kSectors> shots{};
  for (const double azimuth : grid.azimuth) {
    const double share = wrap_to_two_pi(azimuth) / kTwoPi;
    ++shots[std::min(kSectors - 1, static_cast<std::size_t>(share * kSectors))];
  }
  const double fewest = kFewestInSector * static_cast<double>(grid.size()) / kSectors;
  return static_cast<double>(*std::min_element(shots.begin(), shots.end())) >= fewest;
}

/// The lines of the beginning of a scan, and its emitters if they are not named.
LineSpectrum lines_of(ShotGrid& grid, bool named, double window, bool all_around,
                      const IdentifyOptions& options) {
  ShotGrid head = rows_of(grid, 0, row_at(grid, window));
  if (all_around) to_train_frame(head);
  const LineSpectrumOptions lines{.fastest = options.fastest};
  LineSpectrum spectrum = line_spectrum(head, lines);
  const int period = named ? grid.emitters : emitter_period(head, spectrum.lines);
  if (!named && period > 1) {
    for (ShotGrid* one : {&grid, &head}) {
      one->emitters = period;
      for (std::size_t i = 0; i < one->size(); ++i) {
        one->emitter[i] = static_cast<std::uint8_t>(one->slot[i] % period);
      }
    }
    spectrum = line_spectrum(head, lines);
  }
  if (spectrum.lines.empty()) {
    throw EstimationError(
        "the directions of this recording show no steadily turning line: no prism can be found");
  }
  return spectrum;
}

}  // namespace

Identification identify(const estimation::AngleSeries& series, const IdentifyOptions& options,
                        const Progress& progress) {
  require_above("options.fastest", options.fastest, 0, "rad/s");
  require_between("options.most_prisms", options.most_prisms, 1, 3);
  const std::vector<estimation::ShotRange> stretches = estimation::stretches(series, 1.0);
  if (stretches.empty()) throw EstimationError("the recording holds no valid shots");
  const auto longest =
      std::max_element(stretches.begin(), stretches.end(),
                       [](const auto& a, const auto& b) { return a.size() < b.size(); });
  ShotGrid grid = shot_grid(series, *longest);
  if (grid.duration() > kLongest) grid = rows_of(grid, 0, row_at(grid, kLongest));
  const bool named = grid.emitters > 1;
  Identification result;
  if (is_all_around(grid)) {
    ShotGrid numbered = grid;
    const double window = std::max(kLineWindow, kLineShots * grid.step);
    try {
      LineSpectrum spectrum = lines_of(numbered, named, window, true, options);
      progress.report(0.1);
      result = TrainSearch(numbered, std::move(spectrum), window, true, options, progress).run();
      result.emitters_named = named;
      if (result.fits) return result;
    } catch (const EstimationError&) {  // prisms are still possible
    }
  }
  for (double window = std::max(kLineWindow, kLineShots * grid.step);; window *= kLongerWindow) {
    LineSpectrum spectrum = lines_of(grid, named, window, false, options);
    progress.report(0.1);
    result = TrainSearch(grid, std::move(spectrum), window, false, options, progress).run();
    if (result.fits || window >= grid.duration()) break;
  }
  result.emitters_named = named;
  return result;
}

}  // namespace risley::identification
