// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/identification/line_spectrum.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <Eigen/Core>
#include <unsupported/Eigen/FFT>

#include "risley/algebra/symmetric.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/direction.hpp"
#include "risley/optics/parameters.hpp"

namespace risley::identification {
namespace {

/// Shots are averaged over cells of whole turns of any number of emitters up to six, as long as
/// this many cells per second are left.
constexpr double kFewestCellsPerSecond = 1500;
/// Least power of a line over the mean power of the spectrum.
constexpr double kLinePower = 30;
/// A rotor that does not turn evenly has a wide line: no other is searched this near to a line, in
/// widths of a line.
constexpr double kLineWidths = 2.5;
/// Least significance of the means of places for a pattern of emitters.
constexpr double kPatternPower = 50;
/// A shorter period is chosen if it explains this share of the best.
constexpr double kPatternShare = 0.97;

/// Means of some neighbouring shots.
struct Cells {
  double length = 0;  ///< s
  std::vector<double> time;
  std::vector<double> weight;  ///< shots
  std::vector<std::size_t> place;
  std::vector<Complex> value;

  std::size_t size() const { return time.size(); }
};

Cells cells_of(const ShotGrid& grid, const std::vector<Complex>& value) {
  std::int64_t slots = 1;
  for (const std::int64_t count : {60, 30, 12, 6}) {
    if (1.0 / (grid.step * static_cast<double>(count)) >= kFewestCellsPerSecond) {
      slots = count;
      break;
    }
  }
  Cells cells;
  cells.length = grid.step * static_cast<double>(slots);
  const std::int64_t first = grid.slot.front() / slots;
  for (std::size_t i = 0; i < grid.size(); ++i) {
    const auto place = static_cast<std::size_t>(grid.slot[i] / slots - first);
    if (cells.place.empty() || cells.place.back() != place) {
      cells.place.push_back(place);
      cells.time.push_back(0);
      cells.weight.push_back(0);
      cells.value.emplace_back();
    }
    cells.weight.back() += 1;
    cells.time.back() += grid.time[i];
    cells.value.back() += value[i];
  }
  for (std::size_t c = 0; c < cells.size(); ++c) {
    cells.time[c] /= cells.weight[c];
    cells.value[c] /= cells.weight[c];
  }
  return cells;
}

/// Least squares of a constant and lines, whose speeds are refined in the given number of steps.
class JointFit {
 public:
  explicit JointFit(const Cells& cells) : cells_(cells), middle_(middle_of(cells)) {}

  void add(double angular_velocity) { speed_.push_back(angular_velocity); }
  void drop_last() { speed_.pop_back(); }
  const std::vector<double>& speeds() const { return speed_; }
  const std::vector<Complex>& amplitudes() const { return amplitude_; }  // constant first; at t = 0

  void solve(int rounds) {
    for (int round = 0; round < rounds; ++round) {
      fit_amplitudes();
      improve_speeds();
    }
    fit_amplitudes();
    for (std::size_t k = 0; k < speed_.size(); ++k) {
      amplitude_[k + 1] *= std::polar(1.0, -speed_[k] * middle_);
    }
  }

  /// @return mean square of the remainder; the rest itself by cell
  double rest(std::vector<Complex>& left) const {
    left.resize(cells_.size());
    double sum = 0, count = 0;
    for (std::size_t c = 0; c < cells_.size(); ++c) {
      Complex value = cells_.value[c] - amplitude_[0];
      for (std::size_t k = 0; k < speed_.size(); ++k) {
        value -= amplitude_[k + 1] * std::polar(1.0, speed_[k] * cells_.time[c]);
      }
      left[c] = value;
      sum += cells_.weight[c] * std::norm(value);
      count += cells_.weight[c];
    }
    return sum / count;
  }

 private:
  static double middle_of(const Cells& cells) {
    return 0.5 * (cells.time.front() + cells.time.back());
  }
  Complex turned(std::size_t k, std::size_t cell) const {
    return std::polar(1.0, speed_[k] * (cells_.time[cell] - middle_));
  }
  void fit_amplitudes() {
    const auto n = static_cast<Eigen::Index>(speed_.size() + 1);
    Eigen::MatrixXcd normal = Eigen::MatrixXcd::Zero(n, n);
    Eigen::VectorXcd right = Eigen::VectorXcd::Zero(n), row(n);
    for (std::size_t c = 0; c < cells_.size(); ++c) {
      row[0] = 1.0;
      for (std::size_t k = 0; k < speed_.size(); ++k) {
        row[static_cast<Eigen::Index>(k + 1)] = turned(k, c);
      }
      normal += cells_.weight[c] * row.conjugate() * row.transpose();
      right += cells_.weight[c] * cells_.value[c] * row.conjugate();
    }
    for (Eigen::Index k = 0; k < n; ++k) normal(k, k) *= 1 + 1e-9;
    const Eigen::VectorXcd solution = normal.llt().solve(right);
    amplitude_.assign(solution.data(), solution.data() + n);
  }
  /// One step of Gauss and Newton for all speeds, amplitudes free.
  void improve_speeds() {
    const auto lines = static_cast<Eigen::Index>(speed_.size());
    const Eigen::Index n = 2 + 3 * lines;  // constant, then amplitude (2) and speed of every line
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(n, n);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(n), real(n), imaginary(n);
    const double half = 0.5 * (cells_.time.back() - cells_.time.front());
    for (std::size_t c = 0; c < cells_.size(); ++c) {
      Complex left = cells_.value[c] - amplitude_[0];
      real.setZero();
      imaginary.setZero();
      real[0] = imaginary[1] = 1;
      for (Eigen::Index k = 0; k < lines; ++k) {
        const Complex turn = turned(static_cast<std::size_t>(k), c);
        const Complex value = amplitude_[static_cast<std::size_t>(k) + 1] * turn;
        left -= value;
        const Complex rate =
            Complex(0, 1) * value * ((cells_.time[c] - middle_) / half);  // by speed x half
        const Eigen::Index at = 2 + 3 * k;
        real[at] = turn.real();
        imaginary[at] = turn.imag();
        real[at + 1] = -turn.imag();
        imaginary[at + 1] = turn.real();
        real[at + 2] = rate.real();
        imaginary[at + 2] = rate.imag();
      }
      const double weight = cells_.weight[c];
      normal.selfadjointView<Eigen::Lower>().rankUpdate(real, weight);
      normal.selfadjointView<Eigen::Lower>().rankUpdate(imaginary, weight);
      right += weight * (left.real() * real + left.imag() * imaginary);
    }
    const Eigen::VectorXd step = algebra::SymmetricSolver(normal, 1e-9).solve(right);
    for (Eigen::Index k = 0; k < lines; ++k) {
      // No further than the width of a line.
      speed_[static_cast<std::size_t>(k)] += std::clamp(step[2 + 3 * k + 2], -1.0, 1.0) / half;
    }
  }

  const Cells& cells_;
  double middle_;
  std::vector<double> speed_;
  std::vector<Complex> amplitude_;
};

/// The strongest frequency of the remainder that is none of the speeds.
struct Peak {
  double angular_velocity = 0;
  double power = 0;  ///< over the mean of all powers expected from noise alone
};

Peak strongest(const Cells& cells, const std::vector<Complex>& left, double unexplained,
               const std::vector<double>& taken, double fastest) {
  const std::size_t span = cells.place.back() + 1;
  std::size_t bins = 1;
  while (bins < 4 * span) bins *= 2;
  std::vector<Complex> slots(bins), spectrum;
  double squares = 0;
  for (std::size_t c = 0; c < cells.size(); ++c) {
    slots[cells.place[c]] = cells.weight[c] * left[c];
    squares += cells.weight[c] * cells.weight[c];
  }
  Eigen::FFT<double> fft;
  fft.fwd(spectrum, slots);
  const double bin_speed = kTwoPi / (static_cast<double>(bins) * cells.length);
  const double width = kTwoPi / (static_cast<double>(span) * cells.length);
  const auto edge = std::min<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(fastest / bin_speed),
                                             static_cast<std::ptrdiff_t>(bins / 2) - 1);
  Peak best;
  double best_power = 0;
  for (std::ptrdiff_t bin = -edge; bin <= edge; ++bin) {
    const double speed = static_cast<double>(bin) * bin_speed;
    if (std::abs(speed) < 1.5 * width) continue;
    if (std::any_of(taken.begin(), taken.end(),
                    [&](double other) { return std::abs(other - speed) < kLineWidths * width; })) {
      continue;
    }
    const auto at = bin < 0 ? bin + static_cast<std::ptrdiff_t>(bins) : bin;
    const double power = std::norm(spectrum[static_cast<std::size_t>(at)]);
    if (power > best_power) {
      best_power = power;
      best.angular_velocity = speed;
    }
  }
  best.power = best_power / (unexplained * squares);
  return best;
}

}  // namespace

std::vector<Complex> transverse(const ShotGrid& grid) {
  std::vector<Complex> value;
  value.reserve(grid.size());
  for (std::size_t i = 0; i < grid.size(); ++i) {
    const auto v = direction_from_angles<double>({grid.azimuth[i], grid.zenith[i]});
    value.emplace_back(v.y, v.z);
  }
  return value;
}

int emitter_period(const ShotGrid& grid, const std::vector<Line>& lines) {
  std::vector<Complex> left = transverse(grid);
  Complex mean;
  for (std::size_t i = 0; i < grid.size(); ++i) {
    for (const Line& line : lines) {
      left[i] -= line.amplitude * std::polar(1.0, line.angular_velocity * grid.time[i]);
    }
    mean += left[i] / static_cast<double>(grid.size());
  }
  double power = 0;
  for (Complex& value : left) {
    value -= mean;
    power += std::norm(value);
  }
  std::vector<double> explained(kMaxEmitters + 1, 0.0);
  double most = 0;
  for (int period = 2; period <= kMaxEmitters; ++period) {
    std::vector<Complex> sum(static_cast<std::size_t>(period));
    std::vector<double> count(sum.size(), 0.0);
    for (std::size_t i = 0; i < grid.size(); ++i) {
      const auto place = static_cast<std::size_t>(grid.slot[i] % period);
      sum[place] += left[i];
      count[place] += 1;
    }
    double& all = explained[static_cast<std::size_t>(period)];
    for (std::size_t place = 0; place < sum.size(); ++place) {
      if (count[place] > 0) all += std::norm(sum[place]) / count[place];
    }
    const double chance = (power - all) / static_cast<double>(grid.size());
    if (all < kPatternPower * (period - 1) * chance) all = 0;
    most = std::max(most, all);
  }
  if (most == 0) return 1;
  for (int period = 2; period <= kMaxEmitters; ++period) {
    if (explained[static_cast<std::size_t>(period)] >= kPatternShare * most) return period;
  }
  return 1;
}

LineSpectrum line_spectrum(const ShotGrid& grid, const LineSpectrumOptions& options) {
  std::vector<Complex> value = transverse(grid);
  LineSpectrum result;
  result.constant.assign(static_cast<std::size_t>(grid.emitters), {});
  std::vector<Line> found;
  // The constants are means of the remainder without lines, and lines are fitted to that without
  // constants.
  for (int round = 0; round < 2; ++round) {
    std::vector<Complex> moved = value;
    if (round > 0) {
      for (std::size_t i = 0; i < grid.size(); ++i) moved[i] -= result.constant[grid.emitter[i]];
    }
    const Cells cells = cells_of(grid, moved);
    JointFit fit(cells);
    fit.solve(0);
    std::vector<Complex> left;
    double unexplained = fit.rest(left);
    for (const Line& line : found) fit.add(line.angular_velocity);
    if (!found.empty()) {
      fit.solve(2);
      unexplained = fit.rest(left);
    }
    while (fit.speeds().size() < options.most) {
      const Peak peak = strongest(cells, left, unexplained, fit.speeds(), options.fastest);
      if (peak.power < kLinePower) break;
      fit.add(peak.angular_velocity);
      fit.solve(3);
      unexplained = fit.rest(left);
    }
    found.clear();
    for (std::size_t k = 0; k < fit.speeds().size(); ++k) {
      // Attenuation of a turning line by averaging over a cell.
      const double half_turn = 0.5 * fit.speeds()[k] * cells.length;
      const double kept = half_turn == 0 ? 1.0 : std::sin(half_turn) / half_turn;
      found.push_back({fit.speeds()[k], fit.amplitudes()[k + 1] / kept});
    }
    std::vector<double> count(result.constant.size(), 0.0);
    std::vector<Complex> sum(result.constant.size());
    double squares = 0;
    for (std::size_t i = 0; i < grid.size(); ++i) {
      Complex rest = value[i];
      for (const Line& line : found) {
        rest -= line.amplitude * std::polar(1.0, line.angular_velocity * grid.time[i]);
      }
      sum[grid.emitter[i]] += rest;
      count[grid.emitter[i]] += 1;
      squares += std::norm(rest);
    }
    for (std::size_t j = 0; j < sum.size(); ++j) {
      result.constant[j] = count[j] > 0 ? sum[j] / count[j] : Complex{};
      squares -= count[j] * std::norm(result.constant[j]);
    }
    result.unexplained = squares / static_cast<double>(grid.size());
  }
  std::sort(found.begin(), found.end(), [](const Line& a, const Line& b) {
    return std::abs(a.amplitude) > std::abs(b.amplitude);
  });
  result.lines = std::move(found);
  return result;
}

}  // namespace risley::identification
