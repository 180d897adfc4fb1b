// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "risley/core/instruction_set.hpp"
#include "risley/estimation/angle_series.hpp"
#include "risley/estimation/ekf.hpp"
#include "risley/estimation/initialisation.hpp"
#include "risley/estimation/rotor_process.hpp"
#include "risley/estimation/solution.hpp"

#include "estimation/filter_kernel.hpp"
#include "estimation/kernel_call.hpp"

namespace risley::estimation {

/// Mean and covariance at some time: free parameters, then angle and speed of each rotor.
struct FilterState {
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;
  std::int64_t time_ns = 0;
};

/// Linearisation point of the model other than the filter's own state: the smoothed result of the
/// previous pass. With it a forward-backward pass is one Gauss-Newton step of the whole trajectory.
struct FilterReference {
  explicit FilterReference(const Solution& solution);

  /// State at the first shot, with a given covariance.
  FilterState first_state(const Eigen::MatrixXd& covariance) const;
  /// Rotation angles at a shot [prisms].
  const double* angles(std::size_t shot) const {
    return angle.data() + shot * static_cast<std::size_t>(before.trajectory.prisms);
  }

  const Solution& before;
  std::vector<double> angle;  ///< [shots][prisms]
};

/// The paper's filter: prediction and update, shot by shot, docs/theory/ekf.md. All arguments must
/// stay at their addresses. [B21 section 2.4]
class Filter {
 public:
  Filter(const Filter&) = delete;
  Filter& operator=(const Filter&) = delete;
  /// @param train    with the parameters that are not free
  /// @param process  of every rotor
  Filter(const AngleSeries& series, const PrismTrain& train, const EkfOptions& options,
         const std::vector<RotorProcess>& process, const FilterReference* reference);

  Eigen::Index prisms() const { return prisms_; }
  Eigen::Index statics() const { return arguments_.free; }
  Eigen::Index size() const { return statics() + 2 * prisms_; }

  /// The covariance before any observation.
  Eigen::MatrixXd wide_covariance() const;

  /// Processes some shots with a state, each predicted first.
  /// @return as run_filter(): fewer than the run's if the filter diverged at the next one
  std::size_t run(FilterState& state, const FilterRun& run,
                  InstructionSet set = best_instruction_set()) const;

 private:
  const EkfOptions& options_;
  Eigen::Index prisms_;
  FreePlaces free_;
  FilterArguments arguments_;
};

/// State at the first shot of a series, from a start at some other time.
FilterState first_state(const Filter& filter, const AngleSeries& series, const Start& start,
                        const std::vector<FreeParameter>& free);

}  // namespace risley::estimation
