// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "risley/estimation/angle_series.hpp"
#include "risley/estimation/free_parameters.hpp"
#include "risley/optics/prism_train.hpp"

#include "estimation/kernel_arguments.hpp"

namespace risley::estimation {

/// Places of the free parameters one after the other, for kernels.
struct FreePlaces {
  std::vector<int> begin{0}, places;

  explicit FreePlaces(const std::vector<FreeParameter>& free) {
    for (const FreeParameter& parameter : free) {
      places.insert(places.end(), parameter.places.begin(), parameter.places.end());
      begin.push_back(static_cast<int>(places.size()));
    }
  }
};

/// Points into both, which must stay at their addresses.
inline TrainArguments arguments_of(const PrismTrain& train, const FreePlaces& free) {
  return {train.parameters().data(),
          train.face_order().data(),
          train.layout(),
          train.emitters(),
          static_cast<int>(free.begin.size()) - 1,
          free.begin.data(),
          free.places.data()};
}

/// Points into the series. @param rows  with columns of one length
inline ShotArguments arguments_of(const AngleSeries& rows) {
  return {rows.time_ns.data(),
          rows.beam.empty() ? nullptr : rows.beam.data(),
          rows.azimuth.data(),
          rows.zenith.data(),
          rows.azimuth_rounding_variance.data(),
          rows.zenith_rounding_variance.data()};
}

}  // namespace risley::estimation
