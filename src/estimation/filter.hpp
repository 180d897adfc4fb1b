// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "risley/core/angle.hpp"
#include "risley/estimation/angle_series.hpp"
#include "risley/estimation/ekf.hpp"
#include "risley/estimation/free_parameters.hpp"
#include "risley/estimation/initialisation.hpp"
#include "risley/estimation/rotor_process.hpp"
#include "risley/estimation/solution.hpp"

#include "estimation/residual_model.hpp"

namespace risley::estimation {

/// Mean and covariance: free parameters, then angle and speed of each rotor.
struct FilterState {
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;
};

/// Where the model is linearised when not at the filter's own state: the smoothed answer of the
/// pass before. With it a forward-backward pass is one Gauss-Newton step of the whole trajectory.
struct FilterReference {
  const Solution& before;

  const Eigen::VectorXd& parameters() const { return before.parameters; }
  double angle(std::size_t shot, std::size_t rotor) const {
    return before.trajectory.angle(shot, rotor, 0.0);
  }
};

/// The paper's filter, an observation at a time.                           [B21 section 2.4]
class Filter {
 public:
  Filter(const AngleSeries& series, const PrismTrain& train, const EkfOptions& options,
         const std::vector<RotorProcess>& process, const FilterReference* reference)
      : series_(series),
        options_(options),
        process_(process),
        reference_(reference),
        model_(train, options.free),
        prisms_(train.prisms()),
        statics_(static_cast<Eigen::Index>(options.free.size())),
        size_(statics_ + 2 * prisms_),
        angles_(static_cast<std::size_t>(prisms_)),
        jacobian_(Eigen::Matrix2Xd::Zero(2, size_)) {
    if (reference_) model_.set(reference_->parameters());
  }

  Eigen::Index prisms() const { return prisms_; }
  Eigen::Index statics() const { return statics_; }
  Eigen::Index size() const { return size_; }

  /// The covariance before any observation.
  Eigen::MatrixXd wide_covariance() const {
    Eigen::VectorXd sigma(size_);
    for (Eigen::Index i = 0; i < statics_; ++i) {
      sigma[i] = options_.free[static_cast<std::size_t>(i)].prior_sigma;
    }
    for (Eigen::Index k = 0; k < prisms_; ++k) {
      sigma[statics_ + 2 * k] = kAngleSigma;
      sigma[statics_ + 2 * k + 1] = kSpeedSigma;
    }
    return sigma.array().square().matrix().asDiagonal();
  }

  /// Moves a state by dt seconds, forwards or backwards.                     [B21 Eq. (27)]
  void predict(FilterState& state, double dt) const {
    if (size_ == kUsualStates) {
      predict_sized<kUsualStates>(state, dt);
    } else {
      predict_sized<Eigen::Dynamic>(state, dt);
    }
  }

  /// What one observation did.
  struct Update {
    bool accepted = false;
    double chi_square = 0;
    double log_likelihood = 0;
  };

  /// Takes the observation of a row into a state, unless it lies beyond the gate.
  Update update(FilterState& state, std::size_t row, double gate) {
    linearise(state, row);
    return size_ == kUsualStates ? update_sized<kUsualStates>(state, row, gate)
                                 : update_sized<Eigen::Dynamic>(state, row, gate);
  }

  /// Observed minus modelled at a state, rad; NaN when the beam does not get through.
  Eigen::Vector2d residual_at(const Eigen::VectorXd& mean, std::size_t row) {
    model_.set(mean.head(statics_));
    take_angles(mean);
    model_.linearise(angles_, series_.beam[row]);
    Eigen::Vector2d residual = model_.residual(series_.azimuth[row], series_.zenith[row]);
    if (reference_) model_.set(reference_->parameters());
    return residual;
  }

 private:
  /// How loose the rotors are before the first observation of either direction.
  static constexpr double kAngleSigma = radians_from_degrees(5.0);
  static constexpr double kSpeedSigma = radians_from_degrees(100.0);

  /// Eight constants and two rotors. A number that the compiler knows, U and w below, and constants
  /// of the model that are prepared in one function take 43 % off the time of a step (Zen 4).
  static constexpr int kUsualStates = 12;
  static constexpr int kMostStates = kMaxParameters + 2 * kMaxPrisms;

  template <int Size>
  using Column = Eigen::Matrix<double, Size, 1, 0, Size == Eigen::Dynamic ? kMostStates : Size, 1>;
  template <int Size>
  using Square = Eigen::Map<Eigen::Matrix<double, Size, Size>>;

  template <int Size>
  void predict_sized(FilterState& state, double dt) const {
    Square<Size> p(state.covariance.data(), size_, size_);
    for (Eigen::Index k = 0; k < prisms_; ++k) {
      const Eigen::Index angle = statics_ + 2 * k, speed = angle + 1;
      state.mean[angle] += dt * state.mean[speed];
      p.row(angle) += dt * p.row(speed);
      p.col(angle) += dt * p.col(speed);
      const auto q = step_covariance(process_[static_cast<std::size_t>(k)], dt);
      p(angle, angle) += q.angle_angle;
      p(angle, speed) += q.angle_speed;
      p(speed, angle) += q.angle_speed;
      p(speed, speed) += q.speed_speed;
    }
    if (options_.parameter_walk > 0) {
      p.diagonal().head(statics_).array() +=
          options_.parameter_walk * options_.parameter_walk * std::abs(dt);
    }
  }

  /// With S = L L^T the covariance of the innovation i, H the derivatives and
  ///   U = P H^T L^-T,  w = L^-1 i:  mean += U w,  P -= U U^T,  chi-square = w.w.
  /// This is P - K S K^T of the gain K = P H^T S^-1, and keeps P symmetric to the bit.
  template <int Size>
  Update update_sized(FilterState& state, std::size_t row, double gate) const {
    Square<Size> p(state.covariance.data(), size_, size_);
    Column<Size> first = Column<Size>::Zero(size_), second = first;  // P H^T, then U
    const auto take = [&](Eigen::Index j) {
      first += jacobian_(0, j) * p.col(j);
      second += jacobian_(1, j) * p.col(j);
    };
    for (Eigen::Index j = 0; j < statics_; ++j) take(j);
    for (Eigen::Index j = statics_; j < size_; j += 2) take(j);  // nothing depends on the speeds
    const double noise = options_.angle_noise * options_.angle_noise;
    double s00 = noise + static_cast<double>(series_.azimuth_rounding_variance[row]);
    double s11 = noise + static_cast<double>(series_.zenith_rounding_variance[row]);
    double s10 = 0;
    for (Eigen::Index j = 0; j < size_; ++j) {
      s00 += jacobian_(0, j) * first[j];
      s10 += jacobian_(1, j) * first[j];
      s11 += jacobian_(1, j) * second[j];
    }
    const double l00 = std::sqrt(s00), l10 = s10 / l00, l11 = std::sqrt(s11 - l10 * l10);
    const double w0 = innovation_[0] / l00, w1 = (innovation_[1] - l10 * w0) / l11;
    Update result;
    result.chi_square = w0 * w0 + w1 * w1;
    if (!(result.chi_square <= gate)) return result;
    result.accepted = true;
    result.log_likelihood = -0.5 * result.chi_square - std::log(l00 * l11);
    first *= 1.0 / l00;
    second = (second - l10 * first) * (1.0 / l11);
    Eigen::Map<Eigen::Matrix<double, Size, 1>>(state.mean.data(), size_) +=
        w0 * first + w1 * second;
    for (Eigen::Index j = 0; j < size_; ++j) p.col(j) -= first[j] * first + second[j] * second;
    return result;
  }

  void take_angles(const Eigen::VectorXd& mean) {
    for (Eigen::Index k = 0; k < prisms_; ++k) {
      angles_[static_cast<std::size_t>(k)] = mean[statics_ + 2 * k];
    }
  }

  /// Sets innovation_ and jacobian_.
  void linearise(const FilterState& state, std::size_t row) {
    if (reference_) {
      for (std::size_t k = 0; k < angles_.size(); ++k) {
        angles_[k] = reference_->angle(row, k);
      }
    } else {
      model_.set(state.mean.head(statics_));
      take_angles(state.mean);
    }
    // An invalid beam makes the innovation NaN, which no gate lets through.
    model_.linearise(angles_, series_.beam[row]);
    innovation_ = model_.residual(series_.azimuth[row], series_.zenith[row]);
    jacobian_.leftCols(statics_) = model_.d_parameters();
    for (Eigen::Index k = 0; k < prisms_; ++k) {
      jacobian_.col(statics_ + 2 * k) = model_.d_angles().col(k);
    }
    if (reference_) {
      innovation_ -= model_.d_parameters() * (state.mean.head(statics_) - reference_->parameters());
      for (Eigen::Index k = 0; k < prisms_; ++k) {
        innovation_ -= model_.d_angles().col(k) *
                       (state.mean[statics_ + 2 * k] - angles_[static_cast<std::size_t>(k)]);
      }
    }
  }

  const AngleSeries& series_;
  const EkfOptions& options_;
  const std::vector<RotorProcess>& process_;
  const FilterReference* reference_;
  ResidualModel model_;
  Eigen::Index prisms_, statics_, size_;
  std::vector<double> angles_;  ///< of the shot at hand
  Eigen::Vector2d innovation_;
  Eigen::Matrix2Xd jacobian_;  ///< by the states, of which the speeds stay zero
};

/// State at the first shot of a series, from a start at some other time.
inline FilterState first_state(const Filter& filter, const AngleSeries& series, const Start& start,
                               const std::vector<FreeParameter>& free) {
  FilterState state;
  state.mean.resize(filter.size());
  state.mean.head(filter.statics()) = free_values(start.train, free);
  const double ahead = 1e-9 * static_cast<double>(series.time_ns[0] - start.time_ns);
  for (Eigen::Index k = 0; k < filter.prisms(); ++k) {
    const double speed = start.angular_velocity[static_cast<std::size_t>(k)];
    const double angle = start.rotation_angle[static_cast<std::size_t>(k)] + ahead * speed;
    state.mean[filter.statics() + 2 * k] = wrap_to_pi(angle);
    state.mean[filter.statics() + 2 * k + 1] = speed;
  }
  state.covariance = filter.wide_covariance();
  return state;
}

}  // namespace risley::estimation
