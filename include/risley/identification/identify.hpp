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

/// One train that may have made a scan.
struct Hypothesis {
  TrainFit fit;
  /// By how much it is worse than the best one: chi squared of 2 N independent angles.
  double excess = 0;
  /// Places in Identification::hypotheses of trains whose scans no recording of this kind could
  /// distinguish from this one's.
  std::vector<std::size_t> equivalent_to;

  /// Covariance of the same names as the fit's with the glass of every prism free, where the fit
  /// took it as one: what is assumed counts; infinite if nothing determines it. Empty unless the
  /// best.
  Eigen::MatrixXd total_covariance;

  /// The prisms of the fit.
  const PrismTrain& train() const { return fit.model.train; }
};

/// When the emitters see the rotors.
enum class EmitterTiming {
  one_emitter,
  in_turn,   ///< every shot sees the rotors where they are at its own time
  together,  ///< the shots of a round see them where they are at one time
  uneven,    ///< neither
};

/// The name of the enumerator: "one_emitter", "in_turn", "together" or "uneven".
std::string to_string(EmitterTiming timing);

/// How the rotors move.
struct Motion {
  double length = 0;   ///< of the segments of their curves, s; 0: constant speed throughout
  bool smooth = true;  ///< no jumps between segments
};

/// What a scan reveals about the train that made it.
struct Identification {
  std::vector<Hypothesis> hypotheses;  ///< best first; never empty
  TrainFreedom freedom;                ///< what the data asked to be fitted
  LineSpectrum spectrum;               ///< of the stretch that the lines were looked for in
  ShotGrid grid;                       ///< what was fitted to: thinned where there is much of it
  std::size_t rows = 0;                ///< of the stretch that was used
  double step = 0;                     ///< between shots, s
  int emitters = 1;
  bool emitters_named = false;  ///< by the recording; otherwise found from their pattern
  EmitterTiming timing = EmitterTiming::one_emitter;
  Motion motion;                       ///< how the rotors' motion had to be described
  double correlation_time_factor = 1;  ///< shots that count as one because residuals hang together
  bool decided = false;                ///< every rival that is not equivalent is far worse
  bool fits = false;                   ///< the best one describes the scan

  /// The first hypothesis. There must be one.
  const Hypothesis& best() const { return hypotheses.front(); }
};

/// A decision is fair when the best rival's chi squared is larger by so much.
inline constexpr double kFairLead = 25;

/// Finds number, order, faces, wedges, glass and rotors of the prisms, and the emitters, from
/// times and directions alone. docs/theory/identify.md
/// @throws EstimationError when there is no line or too few shots; Cancelled
Identification identify(const estimation::AngleSeries& series, const IdentifyOptions& options = {},
                        const Progress& progress = {});

}  // namespace risley::identification
