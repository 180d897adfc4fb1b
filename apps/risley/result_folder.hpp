// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "risley/estimation/estimate.hpp"
#include "risley/report/report_file.hpp"

#include "command.hpp"
#include "estimation_input.hpp"

namespace risley::app {

/// {"command", ...}, {"version", ...}, {"seed", ...}, and file and SHA-256 of every input.
report::Provenance provenance_of(const CommonOptions& common,
                                 const std::vector<std::string>& inputs);

/// Makes a folder for results, before an hour of computing. @throws FileError
void make_result_folder(const std::string& folder);

/// What failed is no calibration: takes an older one out of the folder; nothing for an empty name.
void remove_calibration(const std::string& folder);

/// Rotor states of an estimate as NetCDF, see report::write_states.
/// @param which  "all" shots, or "knots": one shot per knot (those used by the filter)
void write_states_of(const estimation::Estimate& estimate, const std::string& which,
                     const std::string& path, const report::Provenance& provenance);

/// A recording as reports tell of it.
report::ReportedRecording reported_recording(const std::string& path, const RecordingInput& input);

/// report.json and the page report.html in a folder for results.
void write_report_of(const report::Report& report, const std::string& folder);

}  // namespace risley::app
