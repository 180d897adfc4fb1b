// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/inputs.hpp"

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string_view>
#include <system_error>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <fnmatch.h>

#include "risley/core/error.hpp"
#include "risley/core/setting.hpp"
#include "risley/core/text.hpp"
#include "risley/hashes/sha256.hpp"
#include "risley/io/file_identity.hpp"
#include "risley/io/text_table.hpp"
#include "risley/recordings/reader.hpp"

#include "jobs/checks.hpp"

namespace risley::jobs {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kAnyFolders = "**";

bool has_wildcard(std::string_view name) {
  return name.find_first_of("*?[") != std::string_view::npos;
}

bool is_pattern(const std::string& name) {
  std::error_code ignored;
  return has_wildcard(name) && !fs::exists(name, ignored);
}

bool is_folder_of_recordings(const std::string& name) {
  std::error_code ignored;
  return fs::is_directory(name, ignored) && !recordings::is_recording_folder(name);
}

/// Files that risley itself writes beside recordings and into results.
bool is_own_output(const std::string& name) {
  return ::fnmatch("states*.nc", name.c_str(), 0) == 0 || name.ends_with(".truth.nc") ||
         name.ends_with(".trajectory.csv");
}

bool looks_like_recording(const fs::path& path) {
  const std::string name = lower_case(path.filename().string());
  if (is_own_output(name)) return false;
  const auto& endings = recording_endings();
  return std::any_of(endings.begin(), endings.end(),
                     [&name](const std::string& ending) { return name.ends_with(ending); });
}

/// Absolute, without "..", links unresolved, and without a trailing slash; the current folder for
/// an empty name.
fs::path whole_path(const fs::path& path) {
  const fs::path whole = (fs::current_path() / path).lexically_normal();
  return whole.has_filename() || whole == whole.root_path() ? whole : whole.parent_path();
}

/// Collects inputs from names.
class Finder {
 public:
  Finder(const std::vector<std::string>& excluded, const Progress& progress) : progress_(progress) {
    for (const std::string& path : excluded) {
      if (const auto identity = io::file_identity(path)) excluded_.insert(*identity);
    }
  }

  /// @param once  whether giving a file a second time is an error
  void add(const std::string& name, bool once) {
    progress_.check();
    found_.clear();
    if (is_pattern(name)) {
      const fs::path pattern(name);
      roots_.push_back(whole_path(fixed_part(pattern)));
      const fs::path below = pattern.relative_path();
      expand(pattern.root_path(), {below.begin(), below.end()}, 0);
      if (found_.empty()) throw InvalidArgument(fmt::format("{}: no file has such a name", name));
    } else if (is_folder_of_recordings(name)) {
      roots_.push_back(whole_path(name));
      walk(name);
      if (found_.empty()) {
        throw InvalidArgument(
            fmt::format("{}: no recording is in this folder: no file's name ends "
                        "in {}",
                        name, fmt::join(recording_endings(), ", ")));
      }
    } else {
      roots_.push_back(whole_path(name).parent_path());
      take(name, once);
      return;
    }
    std::sort(found_.begin(), found_.end());
    for (const std::string& path : found_) take(path, false);
  }

  std::vector<Input> inputs() && {
    fs::path common = roots_.empty() ? fs::path() : roots_.front();
    for (const fs::path& root : roots_) {
      const auto end = std::mismatch(common.begin(), common.end(), root.begin(), root.end()).first;
      fs::path shared;
      for (auto part = common.begin(); part != end; ++part) shared /= *part;
      common = shared;
    }
    std::map<std::string, int> uses;
    for (Input& input : inputs_) ++uses[input.place = place_of(input.path, common, false)];
    std::map<std::string, std::string> owners;
    for (Input& input : inputs_) {
      if (uses[input.place] > 1) input.place = place_of(input.path, common, true);
      const auto [owner, is_new] = owners.try_emplace(input.place, input.path);
      if (is_new) continue;
      throw InvalidArgument(
          fmt::format("the results of {} and {} would have the same name, {}: "
                      "read them one after the other",
                      owner->second, input.path, input.place));
    }
    return std::move(inputs_);
  }

 private:
  static fs::path fixed_part(const fs::path& pattern) {
    fs::path fixed = pattern.root_path();
    for (const fs::path& part : pattern.relative_path().parent_path()) {
      if (has_wildcard(part.string())) break;
      fixed /= part;
    }
    return fixed;
  }

  static std::string place_of(const std::string& path, const fs::path& common, bool with_ending) {
    const fs::path whole = whole_path(path);
    std::error_code ignored;
    fs::path place = whole.lexically_relative(common);
    if (!with_ending && !fs::is_directory(whole, ignored)) place.replace_extension();
    return place.string();
  }

  void take(const std::string& path, bool once) {
    // Missing files have only their names.
    const std::pair<std::optional<io::FileIdentity>, std::string> identity = {
        io::file_identity(path),
        io::file_identity(path) ? std::string() : whole_path(path).string()};
    if (once && !named_.insert(identity).second) {
      throw InvalidArgument(fmt::format("{} is given twice: once is enough", path));
    }
    if (taken_.insert(identity).second) inputs_.push_back({path, {}});
  }

  bool is_excluded(const fs::path& path) const {
    if (excluded_.empty()) return false;
    const auto identity = io::file_identity(path.string());
    return identity && excluded_.contains(*identity);
  }

  /// Contents of a folder, sorted; a folder that cannot be listed counts as an input, so that
  /// reading it reports the error.
  std::vector<fs::path> entries_of(const fs::path& folder) {
    progress_.check();
    std::vector<fs::path> entries;
    std::error_code code;
    for (fs::directory_iterator at(folder.empty() ? "." : folder, code), end; !code && at != end;
         at.increment(code)) {
      entries.push_back(folder.empty() ? at->path().filename() : at->path());
    }
    if (code) found_.push_back(folder.string());
    std::sort(entries.begin(), entries.end());
    return entries;
  }

  static bool is_hidden(const fs::path& path) { return path.filename().string().starts_with('.'); }
  static bool is_real_folder(const fs::path& path) {
    std::error_code ignored;
    return fs::is_directory(fs::symlink_status(path, ignored));  // links may lead in circles
  }

  /// A broken link counts as a file: reading it reports that the file is missing.
  static bool is_file_or_broken_link(const fs::path& path) {
    std::error_code ignored;
    return fs::is_regular_file(path, ignored) ||
           (fs::is_symlink(path, ignored) && !fs::exists(path, ignored));
  }

  /// Recordings of a folder and of those below.
  void walk(const fs::path& folder) {
    for (const fs::path& entry : entries_of(folder)) {
      if (is_hidden(entry) || is_excluded(entry)) continue;
      if (is_real_folder(entry)) {
        recordings::is_recording_folder(entry.string()) ? found_.push_back(entry.string())
                                                        : walk(entry);
        continue;
      }
      if (is_file_or_broken_link(entry) && looks_like_recording(entry)) {
        found_.push_back(entry.string());
      }
    }
  }

  /// Names that match a pattern, from one of its parts on.
  void expand(const fs::path& folder, const std::vector<fs::path>& parts, std::size_t part) {
    const std::string name = parts[part].string();
    const bool is_last = part + 1 == parts.size();
    if (name == kAnyFolders) {
      if (is_last) {  // all recordings, as in "hall/**"
        walk(folder);
        return;
      }
      expand(folder, parts, part + 1);
      for (const fs::path& entry : entries_of(folder)) {
        if (!is_hidden(entry) && is_real_folder(entry) && !is_excluded(entry)) {
          expand(entry, parts, part);
        }
      }
      return;
    }
    const auto go_on = [&](const fs::path& path) {
      std::error_code ignored;
      const bool is_folder = fs::is_directory(path, ignored);
      if (!is_last) {
        if (is_folder) expand(path, parts, part + 1);
      } else if (is_folder ? recordings::is_recording_folder(path.string())
                           : fs::exists(fs::symlink_status(path, ignored))) {
        if (!is_excluded(path)) found_.push_back(path.string());
      }
    };
    if (!has_wildcard(name)) {
      go_on(folder / parts[part]);
      return;
    }
    for (const fs::path& entry : entries_of(folder)) {
      if (::fnmatch(name.c_str(), entry.filename().c_str(), FNM_PERIOD) == 0) go_on(entry);
    }
  }

  const Progress& progress_;
  std::set<io::FileIdentity> excluded_;
  std::set<std::pair<std::optional<io::FileIdentity>, std::string>> taken_, named_;
  std::vector<fs::path> roots_;     ///< the deepest folders certain to contain the names
  std::vector<std::string> found_;  ///< of the name being added
  std::vector<Input> inputs_;
};

}  // namespace

bool are_many(const InputNames& wanted) {
  return wanted.names.size() > 1 || !wanted.list.empty() ||
         std::any_of(wanted.names.begin(), wanted.names.end(), [](const std::string& name) {
           return is_pattern(name) || is_folder_of_recordings(name);
         });
}

const std::vector<std::string>& recording_endings() {
  static const std::vector<std::string> endings = {".bag", ".bin",  ".csv",    ".db3", ".las",
                                                   ".laz", ".lvx",  ".mcap",   ".nc",  ".npy",
                                                   ".npz", ".pcap", ".pcapng", ".pcd", ".ply"};
  return endings;
}

std::vector<Input> find_inputs(const InputNames& wanted, const Progress& progress) {
  Finder finder(wanted.excluded, progress);
  for (const std::string& name : wanted.names) finder.add(name, true);
  if (!wanted.list.empty()) {
    io::LineReader lines(wanted.list);
    bool is_empty = true;
    for (std::string_view line; lines.next(line);) {
      if (io::trimmed(line).empty() || line.starts_with('#')) continue;
      is_empty = false;
      finder.add(std::string(line), false);
    }
    if (is_empty) {
      throw InvalidArgument(fmt::format("{}: {} names no recording, expected one per line",
                                        name_of(kSetting.list), wanted.list));
    }
  }
  return std::move(finder).inputs();
}

std::vector<std::string> files_behind(const std::string& path) {
  std::vector<std::string> files = recordings::recording_files(path);
  std::error_code code;
  if (fs::is_directory(path, code) && !recordings::is_recording_folder(path)) {
    for (fs::directory_iterator at(path, code), end; !code && at != end; at.increment(code)) {
      files.push_back(at->path().string());
    }
  }
  if (path.ends_with(".truth.yaml")) {
    files.push_back(truth_columns(path));
    files.push_back(truth_mount(path));
  }
  std::erase_if(files, [](const std::string& file) {
    std::error_code ignored;
    return !fs::is_regular_file(file, ignored);
  });
  std::sort(files.begin(), files.end());
  return files;
}

FileHashes input_hashes(const std::string& path, const Progress& progress) {
  FileHashes hashes;
  for (const std::string& file : recordings::recording_files(path)) {
    hashes.emplace_back(file, hashes::sha256_of_file(file, progress));
  }
  return hashes;
}

}  // namespace risley::jobs
