// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "risley/jobs/many_inputs.hpp"
#include "risley/json/many_results.hpp"

#include "command.hpp"

namespace risley::app {

/// Declares INPUT, --list, --table and --resume.
/// @param an  input's description, in words
CLI::Option* add_many_options(CLI::App& verb, jobs::ManyInputsOptions& wishes,
                              const std::string& what);

/// Whether the results of several inputs go to a folder for all.
bool are_several(const jobs::ManyInputsOptions& wishes);
/// The same for a verb that makes one file per input, whose output may be an existing folder.
bool output_is_folder(const jobs::ManyInputsOptions& wishes);

/// Replaces patterns, folders and a list by the matching recordings; files stay as typed, in their
/// order.
/// @return the common options with these
CommonOptions with_recordings_found(jobs::ManyInputsOptions& wishes, CommonOptions common);

/// Logs a message about an input while others are still being read.
/// @param is_wrong  an error; otherwise a warning
void log_words(const std::string& words, bool is_wrong);

/// Runs all jobs and prints their results. A single input behaves as if there were no others: its
/// JSON is the object, its errors leave by throwing. For several, the JSON has an entry per input
/// under "results".
/// @param verb  its options are part of the key under which results count as the same
/// @throws Cancelled after the table of what was finished was written
ExitStatus run_inputs(const jobs::InputPlan& plan, const jobs::InputWork& work,
                      const jobs::ManyInputsOptions& wishes, const CLI::App& verb,
                      const CommonOptions& common);

}  // namespace risley::app
