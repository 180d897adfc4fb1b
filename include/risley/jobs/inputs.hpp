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
  /// Place of its results below a common folder: its own place below the deepest common folder of
  /// all names, without its ending ("hall/scan"). With the ending if two inputs would have the same
  /// one. Unique among the inputs.
  std::string place;
};

/// Which inputs are meant.
struct InputNames {
  /// Files; folders, which stand for all recordings in them and in the folders below, or for one
  /// recording if they are of ROS 2 (with metadata.yaml); patterns with *, ? and [...], and ** for
  /// any number of folders. The name of an existing file is not a pattern.
  std::vector<std::string> names;
  /// File with further names, one per line; blank lines and those that begin with # are ignored.
  /// Empty: none.
  std::string list;
  /// Files and folders that are not searched, because they receive results.
  std::vector<std::string> excluded;
};

/// Whether names can match any number of inputs: several of them, a list, a pattern or a folder of
/// recordings.
bool are_many(const InputNames& wanted);

/// Endings of the files taken from a folder, lower case.
const std::vector<std::string>& recording_endings();

/// All inputs, those of a folder or pattern sorted by name, each of them once, whatever names and
/// links lead to it. A file that does not exist also counts as an input: reading it then fails.
/// Hidden files and files that risley writes beside recordings (states.nc, ....truth.nc) are not
/// found in folders.
/// @throws InvalidArgument for an empty pattern or folder, and for a file given twice; FileError
/// for a list that cannot be read; Cancelled
std::vector<Input> find_inputs(const InputNames& wanted, const Progress& progress = {});

/// All files read for the path of an option: the files of a recording or of a folder, and for a
/// truth the columns and the mount beside it. Only what there is.
std::vector<std::string> files_behind(const std::string& path);

/// Files and their SHA-256.
using FileHashes = std::vector<std::pair<std::string, std::string>>;

/// Of every file of a recording. @throws FileError, Cancelled
FileHashes input_hashes(const std::string& path, const Progress& progress = {});

}  // namespace risley::jobs
