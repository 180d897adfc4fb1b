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

/// Some prisms in beam order, the emitters in front of them, and all their parameters: the optical
/// model of a sensor.
class PrismTrain {
 public:
  /// No prisms at all, as a placeholder: any use of it as a train throws.
  PrismTrain() = default;
  /// Ideal train: every error zero, air 1.0, glass 1.51, wedges 18 deg.           [B21 Eq. (30)]
  /// A wedge and a reflector have the glass (1.9682) and the angles (10, 29 and 50 deg) that repeat
  /// the maker's sequence of the Mid-360. The beams of all emitters run along the axis.
  /// @throws InvalidArgument as check_shape() and layout_of()
  explicit PrismTrain(std::vector<FaceOrder> face_order, int emitters = 1);

  int prisms() const { return layout_; }                     ///< how many
  int emitters() const { return emitters_; }                 ///< how many
  TrainLayout layout() const { return layout_; }             ///< which elements
  TrainShape shape() const { return {layout_, emitters_}; }  ///< elements and number of emitters
  /// First face in beam order, of every prism [prisms].
  const std::vector<FaceOrder>& face_order() const { return face_order_; }

  /// The flat vector, SI units, length parameter_count(shape()); see namespace place.
  const std::vector<double>& parameters() const { return parameters_; }

  /// Value at one place of the flat vector, SI units.
  /// @throws InvalidArgument for a place beyond it
  double operator[](int place) const { return parameters_[index(place)]; }

  /// Value of a named train parameter, SI units. A name shared by all prisms reads the first's.
  /// @throws InvalidArgument (unknown name)
  double get(std::string_view name) const;

  /// Sets a named train parameter, SI units. @throws InvalidArgument (unknown name, bounds)
  void set(std::string_view name, double value);

  /// Sets one place to any value, for solvers that step through the parameter space.
  /// @throws InvalidArgument for a place beyond the flat vector
  void set_place(int place, double value) { parameters_[index(place)] = value; }

  /// The same glass and wedges with every error parameter zero. The directions of several emitters
  /// are no errors and stay. @throws InvalidArgument as check_shape()
  PrismTrain without_errors() const;

 private:
  std::size_t index(int place) const {
    if (place < 0 || place >= static_cast<int>(parameters_.size())) refuse_place(place);
    return static_cast<std::size_t>(place);
  }
  [[noreturn]] void refuse_place(int place) const;

  std::vector<FaceOrder> face_order_;
  TrainLayout layout_;
  int emitters_ = 1;
  std::vector<double> parameters_;
};

/// @param beam  number of the emitter, counted from 0, as in recordings
/// @throws InvalidArgument naming the number and the allowed range
void check_beam(const PrismTrain& train, int beam);

/// The parameters of a train that one emitter's shot depends on, as a fixed-size array, for the
/// templates of the observation model.
/// @param beam  valid by check_beam(), which the caller has called
template <TrainLayout N>
std::array<double, parameter_count(N)> parameter_array(const PrismTrain& train, int beam = 0) {
  std::array<double, parameter_count(N)> values{};
  for (int i = 0; i < parameter_count(N); ++i) values[static_cast<std::size_t>(i)] = train[i];
  values[place::incident_beam_horizontal()] = train[place::incident_beam_horizontal(beam, N)];
  values[place::incident_beam_vertical()] = train[place::incident_beam_vertical(beam, N)];
  return values;
}

/// The order of the faces of a train, which must have layout N.
template <TrainLayout N>
std::array<FaceOrder, N> face_order_array(const PrismTrain& train) {
  std::array<FaceOrder, N> values{};
  for (std::size_t i = 0; i < N; ++i) values[i] = train.face_order()[i];
  return values;
}

}  // namespace risley
