// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/spectral_lines.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <unsupported/Eigen/FFT>

#include "risley/core/angle.hpp"
#include "risley/core/direction.hpp"
#include "risley/core/error.hpp"
#include "risley/core/golden_section.hpp"
#include "risley/core/require.hpp"
#include "risley/optics/prism_train.hpp"
#include "risley/parallel/parallel.hpp"

namespace risley::estimation {
namespace {

constexpr std::size_t kFewestLineShots = 40;
/// Number of shots with which lines are refined; more would only cost time.
constexpr std::size_t kEnoughLineShots = 1000;
/// Steps of the frequency grid per resolved frequency, 1 / duration.
constexpr double kOversampling = 8.0;
/// Regularisation of constant and lines for shots in a corner of the field, which hardly determine
/// them, as shares of the shots. Lines of higher order, which the fit omits, are a tenth of the
/// two.
constexpr double kConstantRidge = 1e-4, kLineRidge = 1e-5;

/// The stretch of about a window's length with the most shots; the earliest of similar ones.
ShotRange best_window(const AngleSeries& series, double window) {
  ShotRange best;
  for (double begin = 0;; begin += 0.25 * window) {
    ShotRange range;
    while (range.begin < series.size() && series.time(range.begin) < begin) ++range.begin;
    range.end = range.begin;
    while (range.end < series.size() && series.time(range.end) <= begin + window) ++range.end;
    if (static_cast<double>(range.size()) > 1.2 * static_cast<double>(best.size())) best = range;
    if (begin + window >= series.duration()) return best;
  }
}

Complex transverse(const AngleSeries& series, std::size_t i) {
  const auto v = direction_from_angles<double>({series.azimuth[i], series.zenith[i]});
  return {v.y, v.z};
}

/// Least squares of a constant for each emitter and some lines, the constants eliminated: they do
/// not overlap, so that takes one division each.
template <int Lines>
class LineFit {
 public:
  explicit LineFit(double count) {
    for (std::size_t a = 0; a < Lines; ++a) normal_[a][a] = count * kLineRidge;
  }

  /// @param overlap  sum of exp(i (w_b - w_a) t) over all shots
  /// Of b <= a.
  void set_overlap(std::size_t a, std::size_t b, Complex overlap) { normal_[a][b] += overlap; }
  /// @param sum  of the value times exp(-i w t) over all shots
  void set_value(std::size_t a, Complex sum) { right_[a] += sum; }
  /// @param sums  of exp(i w t) over the emitter's shots, of every line
  void eliminate(double count, Complex value, const std::array<Complex, Lines>& sums) {
    const double weight = 1.0 / (count * (1.0 + kConstantRidge));
    explained_ += weight * std::norm(value);
    for (std::size_t a = 0; a < Lines; ++a) {
      const Complex scaled = weight * std::conj(sums[a]);
      right_[a] -= scaled * value;
      for (std::size_t b = 0; b <= a; ++b) normal_[a][b] -= scaled * sums[b];
    }
  }
  /// By Cholesky's factors.
  void solve() {
    auto& l = normal_;
    amplitude_ = right_;
    for (std::size_t a = 0; a < Lines; ++a) {
      for (std::size_t b = 0; b <= a; ++b) {
        for (std::size_t c = 0; c < b; ++c) l[a][b] -= l[a][c] * std::conj(l[b][c]);
        l[a][b] = b < a ? l[a][b] / l[b][b].real() : std::sqrt(l[a][a].real());
      }
      for (std::size_t b = 0; b < a; ++b) amplitude_[a] -= l[a][b] * amplitude_[b];
      amplitude_[a] /= l[a][a].real();
      explained_ += std::norm(amplitude_[a]);
    }
    for (std::size_t a = Lines; a-- > 0;) {
      for (std::size_t b = a + 1; b < Lines; ++b)
        amplitude_[a] -= std::conj(l[b][a]) * amplitude_[b];
      amplitude_[a] /= l[a][a].real();
    }
  }

  Complex amplitude(std::size_t line) const { return amplitude_[line]; }
  /// Of the lines, after solve(): increase of the remainder with their amplitudes.
  Eigen::Matrix<Complex, Lines, Lines> normal() const {
    Eigen::Matrix<Complex, Lines, Lines> factor;
    for (std::size_t a = 0; a < Lines; ++a) {
      for (std::size_t b = 0; b < Lines; ++b) factor(a, b) = b <= a ? normal_[a][b] : 0.0;
    }
    return factor * factor.adjoint();
  }
  double explained() const { return explained_; }

 private:
  std::array<std::array<Complex, Lines>, Lines> normal_{};  ///< lower triangle
  std::array<Complex, Lines> right_{}, amplitude_{};
  double explained_ = 0;
};

Complex sum_at(const std::vector<Complex>& spectrum, std::ptrdiff_t bin) {
  const auto bins = static_cast<std::ptrdiff_t>(spectrum.size());
  return spectrum[static_cast<std::size_t>(((bin % bins) + bins) % bins)];
}

}  // namespace

LineSearch::LineSearch(const AngleSeries& series) {
  if (series.size() < kFewestLineShots || series.duration() < kShortestStart) {
    throw EstimationError(
        fmt::format("the recording holds {} valid shots over {:.4f} s, at least {} shots over {} s "
                    "are needed to separate the rotors",
                    series.size(), series.duration(), kFewestLineShots, kShortestStart));
  }
  // A short window keeps the drift of the speeds small; slow recordings need a longer one.
  const auto step_ns = median_step_ns(series.time_ns);
  const double step = 1e-9 * static_cast<double>(step_ns);
  shots_ = best_window(series, std::clamp(500 * step, 0.1, 0.512));
  const std::int64_t first = series.time_ns[shots_.begin];
  const std::int64_t last = series.time_ns[shots_.end - 1];
  duration_ = 1e-9 * static_cast<double>(last - first);
  if (shots_.size() < kFewestLineShots || duration_ < 0.999 * kShortestStart) {
    throw EstimationError(fmt::format(
        "the best {:.4f} s of the recording's start hold {} valid shots, at least {} over {} s are "
        "needed to separate the rotors",
        duration_, shots_.size(), kFewestLineShots, kShortestStart));
  }
  time_ns_ = first + (last - first) / 2;
  std::size_t bins = 1;
  while (static_cast<double>(bins) < kOversampling * duration_ / step) bins *= 2;
  bin_speed_ = kTwoPi / (static_cast<double>(bins) * step);
  std::vector<Complex> value_grid(bins);
  std::vector<std::vector<double>> shot_grids;
  std::array<std::size_t, 256> place_of_beam;
  place_of_beam.fill(shots_.size());
  const std::size_t stride = thinning_stride(series, shots_, kEnoughLineShots);
  for (std::size_t i = shots_.begin; i < shots_.end; ++i) {
    std::size_t& place = place_of_beam[series.beam[i]];
    if (place == shots_.size()) {
      place = emitters_.size();
      emitters_.emplace_back().beam = series.beam[i];
      shot_grids.emplace_back(bins);
    }
    const Complex value = transverse(series, i);
    const auto slot =
        static_cast<std::size_t>((series.time_ns[i] - first + step_ns / 2) / step_ns) % bins;
    shot_grids[place][slot] += 1.0;
    value_grid[slot] += value;
    emitters_[place].count += 1.0;
    emitters_[place].value += value;
    count_ += 1.0;
    power_ += std::norm(value);
    if ((i - shots_.begin) % stride != 0) continue;
    time_.push_back(1e-9 * static_cast<double>(series.time_ns[i] - time_ns_));
    emitter_.push_back(place);
    value_.push_back(value);
  }
  parallel::for_each(emitters_.size() + 1, [&](std::size_t j) {
    Eigen::FFT<double> fft;
    if (j < emitters_.size()) {
      fft.fwd(emitters_[j].spectrum, shot_grids[j]);
    } else {
      fft.fwd(value_spectrum_, value_grid);
    }
  });
}

/// Times count from the first shot here, which turns amplitudes but changes no sum of squares.
template <int Lines>
double LineSearch::unexplained(std::span<const std::ptrdiff_t> bins) const {
  LineFit<Lines> fit(count_);
  for (std::size_t a = 0; a < Lines; ++a) {
    const auto bin = bins[a];
    fit.set_value(a, sum_at(value_spectrum_, bin));
    fit.set_overlap(a, a, count_);
    for (std::size_t b = 0; b < a; ++b) {
      Complex overlap = 0;
      for (const Emitter& emitter : emitters_) {
        overlap += sum_at(emitter.spectrum, bins[b] - bin);
      }
      fit.set_overlap(a, b, std::conj(overlap));
    }
  }
  for (const Emitter& emitter : emitters_) {
    std::array<Complex, Lines> sums;
    for (std::size_t a = 0; a < Lines; ++a) sums[a] = std::conj(sum_at(emitter.spectrum, bins[a]));
    fit.eliminate(emitter.count, emitter.value, sums);
  }
  fit.solve();
  return (power_ - fit.explained()) / count_;
}

/// Data for fitting some lines to the thinned shots. The speed of one line can change without
/// recomputing the sums of the others, which halves the time of refining two lines.
template <int Lines>
class LineSearch::Sums {
 public:
  Sums(const LineSearch& search, const std::array<double, Lines>& speeds)
      : search_(search), shots_(search.time_.size()), emitters_(search.emitters_.size()) {
    for (std::size_t i = 0; i < shots_; ++i) {
      OfEmitter& emitter = emitters_[search.emitter_[i]];
      emitter.count += 1.0;
      emitter.value += search.value_[i];
      power_ += std::norm(search.value_[i]);
    }
    for (std::size_t a = 0; a < Lines; ++a) turns_[a].resize(shots_);
    for (std::size_t a = 0; a < Lines; ++a) set_speed(a, speeds[a]);
  }

  double speed(std::size_t line) const { return speeds_[line]; }

  void set_speed(std::size_t line, double speed) {
    speeds_[line] = speed;
    std::vector<Complex>& turns = turns_[line];
    for (OfEmitter& emitter : emitters_) emitter.lines[line] = 0;
    values_[line] = 0;
    for (std::size_t i = 0; i < shots_; ++i) {
      turns[i] = std::polar(1.0, speed * search_.time_[i]);
      emitters_[search_.emitter_[i]].lines[line] += turns[i];
      values_[line] += std::conj(turns[i]) * search_.value_[i];
    }
    for (std::size_t other = 0; other < Lines; ++other) {
      if (other == line) continue;
      const std::size_t a = std::max(line, other), b = std::min(line, other);
      Complex overlap;
      for (std::size_t i = 0; i < shots_; ++i) overlap += std::conj(turns_[a][i]) * turns_[b][i];
      overlaps_[a][b] = overlap;
    }
  }

  /// Mean square of the remainder with the best amplitudes.
  double unexplained() const { return (power_ - solved().explained()) / count(); }

  RotorLines lines() const {
    const LineFit<Lines> fit = solved();
    RotorLines result;
    for (std::size_t a = 0; a < Lines; ++a) {
      const Complex amplitude = fit.amplitude(a);
      result.lines.push_back({speeds_[a], std::abs(amplitude), std::arg(amplitude)});
    }
    // The mean without the lines belongs to the constants, by their shots.
    for (std::size_t j = 0; j < emitters_.size(); ++j) {
      const OfEmitter& emitter = emitters_[j];
      if (emitter.count == 0) continue;
      Complex left = emitter.value;
      for (std::size_t a = 0; a < Lines; ++a) left -= emitter.lines[a] * fit.amplitude(a);
      result.constant += left / count();
      result.emitters.push_back(
          {search_.emitters_[j].beam, emitter.count / count(), left / emitter.count});
    }
    result.unexplained = (power_ - fit.explained()) / count();
    result.normal = fit.normal() / count();
    return result;
  }

 private:
  struct OfEmitter {
    double count = 0;
    Complex value;
    std::array<Complex, Lines> lines{};
  };

  double count() const { return static_cast<double>(shots_); }

  LineFit<Lines> solved() const {
    LineFit<Lines> fit(count());
    for (std::size_t a = 0; a < Lines; ++a) {
      fit.set_value(a, values_[a]);
      fit.set_overlap(a, a, count());
      for (std::size_t b = 0; b < a; ++b) fit.set_overlap(a, b, overlaps_[a][b]);
    }
    for (const OfEmitter& emitter : emitters_) {
      if (emitter.count > 0) fit.eliminate(emitter.count, emitter.value, emitter.lines);
    }
    fit.solve();
    return fit;
  }

  const LineSearch& search_;
  std::size_t shots_;
  std::vector<OfEmitter> emitters_;
  double power_ = 0;
  std::array<double, Lines> speeds_{};
  std::array<std::vector<Complex>, Lines> turns_;  ///< exp(i w t) of each shot
  std::array<Complex, Lines> values_{};
  std::array<std::array<Complex, Lines>, Lines> overlaps_{};  ///< lower triangle
};

template <int Lines>
RotorLines LineSearch::refined(const Candidate& candidate) const {
  std::array<double, Lines> speeds;
  for (std::size_t a = 0; a < Lines; ++a) {
    speeds[a] = bin_speed_ * static_cast<double>(candidate.bin[a]);
  }
  Sums<Lines> sums(*this, speeds);
  double width = bin_speed_;
  for (int round = 0; round < 3; ++round, width *= 0.3) {
    for (std::size_t a = 0; a < Lines; ++a) {
      const double speed = sums.speed(a);
      sums.set_speed(a, golden_section_minimum(
                            [&](double trial) {
                              sums.set_speed(a, trial);
                              return sums.unexplained();
                            },
                            speed - width, speed + width, 0.02 * width));
    }
  }
  return sums.lines();
}

LineSearch::Bins LineSearch::bins_about(double speed, double share) const {
  const double low = std::min(speed * (1 - share), speed * (1 + share));
  const double high = std::max(speed * (1 - share), speed * (1 + share));
  return {static_cast<std::ptrdiff_t>(std::floor(low / bin_speed_)),
          static_cast<std::ptrdiff_t>(std::ceil(high / bin_speed_))};
}

std::vector<RotorLines> LineSearch::near(std::span<const double> speeds, double share,
                                         std::size_t most, bool with_image) const {
  std::vector<Bins> bins;
  for (const double speed : speeds) {
    if (speed != 0) bins.push_back(bins_about(speed, share));
  }
  if (with_image) {
    require_between("number of speeds with an image", static_cast<double>(bins.size()), 2, 2);
    bins.emplace_back();
  }
  std::vector<RotorLines> best = best_of(bins, false, most, with_image);
  for (RotorLines& found : best) {  // rotors at rest get their place back
    for (std::size_t k = 0; k < speeds.size(); ++k) {
      if (speeds[k] == 0)
        found.lines.insert(found.lines.begin() + static_cast<int>(k), SpectralLine{});
    }
  }
  return best;
}

std::vector<RotorLines> LineSearch::anywhere(double fastest, std::size_t most) const {
  const auto edge = static_cast<std::ptrdiff_t>(std::ceil(fastest / bin_speed_));
  const std::array<Bins, 2> bins{{{-edge, edge}, {-edge, edge}}};
  return best_of(bins, true, most);
}

std::vector<RotorLines> LineSearch::best_of(std::span<const Bins> bins, bool ordered,
                                            std::size_t most, bool with_image) const {
  constexpr std::ptrdiff_t kApart = 4;  // bins: lines nearer to each other or to 0 are one line
  if (bins.empty()) return {};
  return with_layout(static_cast<int>(bins.size()), [&]<int Lines>() {
    std::vector<Candidate> all;
    Candidate candidate;
    // Every choice of bins, in nested loops.
    const auto choose = [&](const auto& self, std::size_t line) -> void {
      if (line == Lines) {
        candidate.unexplained = unexplained<Lines>({candidate.bin.data(), Lines});
        all.push_back(candidate);
        return;
      }
      std::ptrdiff_t first =
          ordered && line > 0 ? candidate.bin[line - 1] + kApart : bins[line].first;
      std::ptrdiff_t last = bins[line].last;
      if (with_image && line == 2) first = last = 2 * candidate.bin[1] - candidate.bin[0];
      for (std::ptrdiff_t bin = first; bin <= last; ++bin) {
        bool apart = std::abs(bin) >= kApart;
        for (std::size_t other = 0; other < line; ++other) {
          apart = apart && std::abs(bin - candidate.bin[other]) >= kApart;
        }
        if (!apart) continue;
        candidate.bin[line] = bin;
        self(self, line + 1);
      }
    };
    choose(choose, 0);
    std::vector<Candidate> taken;
    while (taken.size() < most) {
      const Candidate* next = nullptr;
      for (const Candidate& one : all) {
        if (next != nullptr && one.unexplained >= next->unexplained) continue;
        const bool known = std::any_of(taken.begin(), taken.end(), [&](const Candidate& other) {
          for (std::size_t line = 0; line < Lines; ++line) {
            if (std::abs(one.bin[line] - other.bin[line]) > kApart) return false;
          }
          return true;
        });
        if (!known) next = &one;
      }
      if (next == nullptr) break;
      taken.push_back(*next);
    }
    std::vector<RotorLines> best(taken.size());
    parallel::for_each(taken.size(), [&](std::size_t i) { best[i] = refined<Lines>(taken[i]); });
    std::stable_sort(best.begin(), best.end(), [](const RotorLines& a, const RotorLines& b) {
      return a.unexplained < b.unexplained;
    });
    return best;
  });
}

double unexplained_with(const RotorLines& lines, std::span<const double> amplitude) {
  // Amplitudes with the phases found, then each phase in turn at its best.
  const Eigen::Index turning = lines.normal.rows();
  Eigen::VectorXcd found(turning), wanted(turning);
  Eigen::Index line = 0;
  for (std::size_t k = 0; k < lines.lines.size(); ++k) {
    if (lines.lines[k].angular_velocity == 0) continue;
    found[line] = std::polar(lines.lines[k].amplitude, lines.lines[k].phase);
    wanted[line] = std::polar(amplitude[k], lines.lines[k].phase);
    ++line;
  }
  constexpr int kRounds = 50;
  for (int round = 0; round < kRounds; ++round) {
    for (Eigen::Index k = 0; k < turning; ++k) {
      const Complex pull =
          (lines.normal.row(k) * (found - wanted)).value() + lines.normal(k, k) * wanted[k];
      if (std::abs(pull) > 0) wanted[k] = std::abs(wanted[k]) * pull / std::abs(pull);
    }
  }
  const Eigen::VectorXcd change = wanted - found;
  return lines.unexplained + change.dot(lines.normal * change).real();
}

}  // namespace risley::estimation
