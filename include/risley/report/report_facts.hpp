// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <limits>
#include <optional>
#include <string>

#include "risley/jobs/provenance.hpp"
#include "risley/jobs/recording_input.hpp"
#include "risley/recordings/time_audit.hpp"

namespace risley::report {

// What reports of every kind hold. SI units.

using jobs::Provenance;

/// A quantity that is not known, such as the truth of a real sensor.
inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// One parameter beside all that it can be compared with; what is not known is NaN.
struct ReportedParameter {
  std::string name;
  double value = kUnknown, sigma = kUnknown;
  /// If held parameters were exactly as held, where the method tells.
  std::optional<double> sigma_given_held = {};
  double nominal = kUnknown;   ///< of the preset
  double believed = kUnknown;  ///< what the sensor computed its directions with
  double truth = kUnknown, error = kUnknown, error_over_sigma = kUnknown;
};

/// What a result comes to, as EstimateVerdict and CalibrationVerdict have it.
struct ReportedVerdict {
  std::string code, words, to_do;
};

/// As reports tell of it.
template <class ResultVerdict>
ReportedVerdict reported_verdict(const ResultVerdict& verdict) {
  return {to_string(verdict.code), verdict.words, verdict.to_do};
}

/// One recording and the audit of its times.
struct ReportedRecording {
  std::string name;    ///< of the file
  std::string format;  ///< as Reader's header says
  std::string time_from;
  recordings::TimeAuditResult audit;
};

/// As reports tell of it.
ReportedRecording reported(const jobs::ReadRecording& recording);

}  // namespace risley::report
