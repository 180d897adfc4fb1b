// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "risley/core/angle.hpp"
#include "risley/core/progress.hpp"
#include "risley/estimation/angle_series.hpp"
#include "risley/identification/line_spectrum.hpp"
#include "risley/identification/shot_grid.hpp"
#include "risley/identification/train_fit.hpp"

namespace risley::identification {

/// What is looked for.
struct IdentifyOptions {
  double fastest = kTwoPi * 400;  ///< no rotor turns faster, rad/s
  int most_prisms = 3;            ///< 1 to 3
};

/// A candidate train for a scan.
struct Hypothesis {
  TrainFit fit;
  /// Excess over the best one: chi squared of 2 N independent angles.
  double excess = 0;
  /// Places in Identification::hypotheses of trains whose scans no recording of this kind could
  /// distinguish from this one's.
  std::vector<std::size_t> equivalent_to;

  /// Covariance of the same names as the fit's with the glass of every prism free, if the fit
  /// assumed a single one: it includes that assumption; infinite if nothing determines it. Empty
  /// unless the best.
  Eigen::MatrixXd total_covariance;

  /// The prisms of the fit.
  const PrismTrain& train() const { return fit.model.train; }
};

/// The times at which the emitters see the rotors.
enum class EmitterTiming {
  one_emitter,
  in_turn,   ///< every shot sees the rotors at its own time
  together,  ///< the shots of a round see them at one common time
  uneven,    ///< neither
};

/// The name of the enumerator: "one_emitter", "in_turn", "together" or "uneven".
std::string to_string(EmitterTiming timing);

/// How the rotors move.
struct Motion {
  double length = 0;   ///< of the segments of their curves, s; 0: constant speed throughout
  bool smooth = true;  ///< no jumps between segments
};

/// Result of identifying the train behind a scan.
struct Identification {
  std::vector<Hypothesis> hypotheses;  ///< best first; never empty
  TrainFreedom freedom;                ///< settings of the fit chosen by the data
  LineSpectrum spectrum;               ///< of the stretch searched for lines
  ShotGrid grid;                       ///< the shots of the fit: thinned if there are many
  std::size_t rows = 0;                ///< of the stretch used
  double step = 0;                     ///< between shots, s
  int emitters = 1;
  bool emitters_named = false;  ///< by the recording; otherwise from their pattern
  EmitterTiming timing = EmitterTiming::one_emitter;
  Motion motion;                       ///< the model of the rotors' motion
  double correlation_time_factor = 1;  ///< effective number of independent shots, given correlated
                                       ///< residuals
  bool decided = false;                ///< every rival that is not equivalent is far worse
  bool fits = false;                   ///< the best one describes the scan

  /// The first hypothesis. There must be one.
  const Hypothesis& best() const { return hypotheses.front(); }
};

/// A decision requires that the best rival's chi squared is larger by this.
inline constexpr double kFairLead = 25;

/// Finds number, order, faces, wedges, glass and rotors of the prisms, and the emitters, from
/// times and directions alone. docs/theory/identify.md
/// @throws EstimationError when there is no line or too few shots; Cancelled
Identification identify(const estimation::AngleSeries& series, const IdentifyOptions& options = {},
                        const Progress& progress = {});

}  // namespace risley::identification
