// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "filter_peer.hpp"

#include <cmath>

#include <Eigen/Core>
#include <Eigen/LU>
#include <ceres/jet.h>

#include "risley/optics/observation_model.hpp"

namespace risley::peers {
namespace {

// The start leaves little open, so wide priors do no harm: those of the library's own filter.
constexpr double kIndexSigma = 0.01;
constexpr double kTiltSigma = radians_from_degrees(1.0);
constexpr double kAngleSigma = radians_from_degrees(5.0);
constexpr double kSpeedSigma = radians_from_degrees(100.0);

/// Of the constants in the flat vector.
constexpr int kPlaces[PlainFilter::kConstants] = {
    place::refractive_index(0),      place::incident_beam_horizontal(),
    place::incident_beam_vertical(), place::bearing_tilt_horizontal(0),
    place::bearing_tilt_vertical(0), place::prism_tilt_vertical(0),
    place::prism_tilt_horizontal(1), place::prism_tilt_vertical(1)};

constexpr double square(double x) { return x * x; }
constexpr int angle_of(int rotor) { return PlainFilter::kConstants + 2 * rotor; }

}  // namespace

struct PlainFilter::State {
  using Jet = ceres::Jet<double, kStates>;
  using Vector = Eigen::Matrix<double, kStates, 1>;
  using Matrix = Eigen::Matrix<double, kStates, kStates>;

  void predict(std::int64_t time_ns) {
    const double dt = 1e-9 * static_cast<double>(time_ns - last_ns);
    last_ns = time_ns;
    Matrix f = Matrix::Identity(), q = Matrix::Zero();
    for (int rotor = 0; rotor < 2; ++rotor) {
      const int angle = angle_of(rotor), speed = angle + 1;
      f(angle, speed) = dt;
      q(angle, angle) = kAcceleration * kAcceleration * dt * dt * dt / 3.0;
      q(angle, speed) = q(speed, angle) = kAcceleration * kAcceleration * dt * dt / 2.0;
      q(speed, speed) = kAcceleration * kAcceleration * dt;
    }
    mean = f.lazyProduct(mean).eval();
    const Matrix turned = f.lazyProduct(covariance);
    covariance = turned.lazyProduct(f.transpose()) + q;
  }

  void update(double azimuth, double zenith) {
    const SphericalAngles<Jet> model = observe_with_derivatives();
    const Eigen::Vector2d innovation(azimuth - model.azimuth.a, zenith - model.zenith.a);
    Eigen::Matrix<double, 2, kStates> h;
    h.row(0) = model.azimuth.v.transpose();
    h.row(1) = model.zenith.v.transpose();
    const Eigen::Matrix2d noise = square(angle_noise) * Eigen::Matrix2d::Identity();
    const Eigen::Matrix<double, kStates, 2> cross = covariance.lazyProduct(h.transpose());
    const Eigen::Matrix2d scatter = h.lazyProduct(cross) + noise;
    const Eigen::Matrix<double, kStates, 2> gain = cross.lazyProduct(scatter.inverse());
    mean += gain.lazyProduct(innovation);
    const Matrix rest = Matrix::Identity() - gain.lazyProduct(h);
    const Matrix kept = rest.lazyProduct(covariance);
    const Eigen::Matrix<double, kStates, 2> noisy = gain.lazyProduct(noise);
    covariance =
        kept.lazyProduct(rest.transpose()) + noisy.lazyProduct(gain.transpose());  // Joseph
  }

  SphericalAngles<Jet> observe_with_derivatives() const {
    std::array<Jet, parameter_count(2)> parameters;
    for (std::size_t i = 0; i < parameters.size(); ++i) parameters[i] = Jet(fixed[i]);
    const auto set = [&](int at, int state) {
      parameters[static_cast<std::size_t>(at)] = Jet(mean[state], state);
    };
    set(place::refractive_index(1), 0);
    for (int i = 0; i < kConstants; ++i) set(kPlaces[i], i);
    const auto train = prepare<Jet, 2>(parameters, face_order);
    const std::array<Jet, 2> angles{Jet(mean[angle_of(0)], angle_of(0)),
                                    Jet(mean[angle_of(1)], angle_of(1))};
    return angles_from_direction(trace(train, angles).direction);
  }

  std::array<double, parameter_count(2)> fixed;
  std::array<FaceOrder, 2> face_order;
  std::int64_t last_ns;
  double angle_noise;
  Vector mean = Vector::Zero();
  Matrix covariance = Matrix::Zero();
};

PlainFilter::PlainFilter(const PrismTrain& train, const std::array<double, 2>& rotation_angle,
                         const std::array<double, 2>& speed, std::int64_t time_ns,
                         double angle_noise)
    : state_(new State{parameter_array<2>(train), face_order_array<2>(train), time_ns, angle_noise,
                       State::Vector::Zero(), State::Matrix::Zero()}) {
  State& s = *state_;
  for (int i = 0; i < kConstants; ++i) {
    s.mean[i] = train[kPlaces[i]];
    s.covariance(i, i) = square(i == 0 ? kIndexSigma : kTiltSigma);
  }
  for (int rotor = 0; rotor < 2; ++rotor) {
    const auto k = static_cast<std::size_t>(rotor);
    const int angle = angle_of(rotor);
    s.mean[angle] = rotation_angle[k];
    s.mean[angle + 1] = speed[k];
    s.covariance(angle, angle) = square(kAngleSigma);
    s.covariance(angle + 1, angle + 1) = square(kSpeedSigma);
  }
}

PlainFilter::~PlainFilter() = default;
PlainFilter::PlainFilter(PlainFilter&&) noexcept = default;
PlainFilter& PlainFilter::operator=(PlainFilter&&) noexcept = default;

void PlainFilter::predict(std::int64_t time_ns) { state_->predict(time_ns); }
void PlainFilter::update(double azimuth, double zenith) { state_->update(azimuth, zenith); }

std::array<double, PlainFilter::kStates> PlainFilter::mean() const {
  std::array<double, kStates> values;
  for (int i = 0; i < kStates; ++i) values[static_cast<std::size_t>(i)] = state_->mean[i];
  return values;
}

std::array<double, PlainFilter::kStates> PlainFilter::sigma() const {
  std::array<double, kStates> values;
  for (int i = 0; i < kStates; ++i) {
    values[static_cast<std::size_t>(i)] = std::sqrt(state_->covariance(i, i));
  }
  return values;
}

}  // namespace risley::peers
