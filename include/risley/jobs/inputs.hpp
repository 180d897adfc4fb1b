// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "risley/core/progress.hpp"

namespace risley::jobs {

/// One recording among many.
struct Input {
  std::string path;
  /// Where its results belong below a common folder: its own place below the deepest folder that
  /// all names share, without its ending ("hall/scan"). With the ending where two inputs would have
  /// the same one. Unlike that of any other input.
  std::string place;
};

/// Which inputs are meant.
struct InputNames {
  /// Files; folders, which stand for all recordings in them and in the folders below, or for one
  /// recording if they are of ROS 2 (with metadata.yaml); patterns with *, ? and [...], and ** for
  /// any number of folders. A name that exists is no pattern.
  std::vector<std::string> names;
  /// File with further such names, one a line; blank lines and those that begin with # do not
  /// count. Empty: none.
  std::string list;
  /// Files and folders in which nothing is looked for, because results go there.
  std::vector<std::string> excluded;
};

/// Whether names stand for any number of inputs: several of them, a list, a pattern or a folder of
/// recordings.
bool are_many(const InputNames& wanted);

/// Endings of the files that are taken from a folder, lower case.
const std::vector<std::string>& recording_endings();

/// All inputs, those of a folder or pattern sorted by name, each of them once by whatever names and
/// links. A file that does not exist is an input, too: reading it then fails. Hidden files and what
/// risley writes beside recordings (states.nc, ....truth.nc) are not found in folders.
/// @throws InvalidArgument for a pattern or folder in which there is nothing, and for a file that
///         is named twice; FileError for a list that cannot be read; Cancelled
std::vector<Input> find_inputs(const InputNames& wanted, const Progress& progress = {});

/// Everything that is read where an option names a path: the files of a recording or of a folder,
/// and of a truth the columns and the mount beside it. Only what there is.
std::vector<std::string> files_behind(const std::string& path);

/// Files and their SHA-256.
using FileHashes = std::vector<std::pair<std::string, std::string>>;

/// Of every file of a recording. @throws FileError, Cancelled
FileHashes input_hashes(const std::string& path, const Progress& progress = {});

}  // namespace risley::jobs
