// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "risley/estimation/angle_series.hpp"
#include "risley/estimation/estimate.hpp"
#include "risley/estimation/evaluation.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::report {

/// All that the page of one estimation shows. References must live until the page is made.
struct EstimatePageInput {
  const estimation::Estimate& estimate;
  const sensors::Sensor& nominal;                           ///< what the estimation started from
  const std::optional<estimation::Evaluation>& evaluation;  ///< when the truth is known
  const estimation::AngleSeries& head;                      ///< every shot of the beginning
  std::string recording;                                    ///< file name of the input
  std::string recording_format;
  std::uint64_t observations = 0;  ///< rows of the recording
  double duration = 0;             ///< of the recording, s
  /// How to make it again: name and value pairs such as command, version, seed, input_sha256.
  std::vector<std::pair<std::string, std::string>> provenance;
  std::vector<std::string> warnings;  ///< beside those of the estimate
};

/// One self-contained HTML page (Chart.js included, no network): the verdict first, then
/// parameters, speeds, residuals, scan pattern, correlations and provenance. It computes nothing
/// but thinning and bins, and the page says where it thinned.
std::string estimate_page(const EstimatePageInput& input);

}  // namespace risley::report
