// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "risley/core/error.hpp"
#include "risley/optics/parameters.hpp"
#include "risley/optics/prism.hpp"

namespace risley {

/// Some prisms in beam order with all their parameters: what the optics know of a sensor.
class PrismTrain {
 public:
  /// Ideal train: every error zero, air 1.0, glass 1.51, wedges 18 deg.           [B21 Eq. (30)]
  /// @throws InvalidArgument unless there are 1 to kMaxPrisms prisms
  explicit PrismTrain(std::vector<FaceOrder> face_order);

  int prisms() const { return static_cast<int>(face_order_.size()); }
  const std::vector<FaceOrder>& face_order() const { return face_order_; }

  /// The flat vector, SI units, length parameter_count(prisms()); see namespace place.
  const std::vector<double>& parameters() const { return parameters_; }

  /// Value at one place of the flat vector, SI units.
  double operator[](int place) const { return parameters_[static_cast<std::size_t>(place)]; }

  /// Value of a named train parameter, SI units. A name shared by all prisms reads the first's.
  double get(std::string_view name) const;

  /// Sets a named train parameter, SI units. @throws InvalidArgument (unknown name, bounds)
  void set(std::string_view name, double value);

  /// Sets one place without a bounds check, for solvers that step through the parameter space.
  void set_place(int place, double value) { parameters_[static_cast<std::size_t>(place)] = value; }

  /// The same glass and wedges with every error parameter zero.
  PrismTrain without_errors() const;

 private:
  std::vector<FaceOrder> face_order_;
  std::vector<double> parameters_;
};

/// The parameters of a train as a fixed-size array, for the templates of the observation model.
template <int N>
std::array<double, parameter_count(N)> parameter_array(const PrismTrain& train) {
  std::array<double, parameter_count(N)> values{};
  for (int i = 0; i < parameter_count(N); ++i) values[static_cast<std::size_t>(i)] = train[i];
  return values;
}

template <int N>
std::array<FaceOrder, N> face_order_array(const PrismTrain& train) {
  std::array<FaceOrder, N> values{};
  for (std::size_t i = 0; i < N; ++i) values[i] = train.face_order()[i];
  return values;
}

/// Calls function.template operator()<N>() for the run-time number of prisms: the one place where
/// run-time and compile-time sizes meet. @throws InvalidArgument unless 1 <= prisms <= kMaxPrisms
template <class Function>
decltype(auto) with_prism_count(int prisms, Function&& function) {
  switch (prisms) {
    case 1:
      return function.template operator()<1>();
    case 2:
      return function.template operator()<2>();
    case 3:
      return function.template operator()<3>();
    case 4:
      return function.template operator()<4>();
    default:
      throw InvalidArgument("number of prisms = " + std::to_string(prisms) + ", allowed 1 to 4");
  }
}

}  // namespace risley
