// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Folders as rosbag2 writes them: metadata.yaml and the files that it names, into which a recording
// was split. They are read one after the other, as one bag.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <system_error>
#include <tuple>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "risley/bags/bag.hpp"
#include "risley/core/error.hpp"
#include "risley/core/text.hpp"
#include "risley/io/text_file.hpp"
#include "risley/io/yaml_map.hpp"

#include "bags/bag_kinds.hpp"

namespace risley::bags {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostNamed = 10;  // in a message

std::string some_names(std::vector<std::string> names) {
  const std::size_t more = names.size() - std::min(names.size(), kMostNamed);
  names.resize(names.size() - more);
  std::string words = fmt::format("{}", fmt::join(names, ", "));
  if (more > 0) words += fmt::format(" and {} more", more);
  return words;
}

/// A folder without metadata.yaml: is it one of a bag?
[[noreturn]] void fail_without_metadata(const std::string& folder) {
  std::vector<std::string> bags;
  std::error_code code;
  for (fs::directory_iterator file(folder, code), end; !code && file != end; file.increment(code)) {
    std::string name = file->path().filename().string();
    const std::string ending = lower_case(fs::path(name).extension().string());
    if (ending == ".db3" || ending == ".mcap" || ending == ".bag") bags.push_back(std::move(name));
  }
  if (bags.empty()) {
    throw FileError(folder, {},
                    "is a folder; expected a file, or a ROS 2 bag folder with its metadata.yaml "
                    "and the files that it names");
  }
  std::ranges::sort(bags);
  throw FileError(folder, {},
                  fmt::format("is a folder of bags ({}) without metadata.yaml, which states their "
                              "order: name one of the files, or let `ros2 bag reindex` write it",
                              some_names(std::move(bags))));
}

/// The names that a folder's metadata states, each with its line.
std::vector<std::pair<std::string, std::size_t>> stated_names(const std::string& path) {
  constexpr int kLatestVersion = 1'000'000, kLastWithFolder = 3;
  const io::YamlMap whole(io::parse_yaml(io::read_text_file(path), path), path, "");
  const io::YamlMap bag = whole.section("rosbag2_bagfile_information");
  const int version = bag.integer("version", 0, kLatestVersion);
  const auto& list = bag.at("relative_file_paths");
  const std::string field = bag.field("relative_file_paths");
  if (!list.value.is_list() || list.value.items.empty()) {
    io::fail_at(path, list.line, fmt::format("{}: expected a list of files", field));
  }
  std::vector<std::pair<std::string, std::size_t>> names;
  std::set<std::string> seen;
  for (const io::YamlNode& item : list.value.items) {
    fs::path stated = io::yaml_text(item, path, field);
    // Up to version 3 the name of the folder stands before.
    if (version <= kLastWithFolder && std::distance(stated.begin(), stated.end()) == 2 &&
        stated.is_relative()) {
      stated = stated.filename();
    }
    const std::string name = stated.filename().string();
    if (name.empty() || name == "." || name == ".." || stated.has_parent_path()) {
      io::fail_at(path, item.line,
                  fmt::format("{}: expected the name of a file in this folder, found {}", field,
                              stated.string()));
    }
    if (!seen.insert(name).second) {
      io::fail_at(path, item.line, fmt::format("{}: {} appears twice", field, name));
    }
    names.emplace_back(name, item.line);
  }
  return names;
}

/// A file that rosbag2 compressed as a whole, even if an unpacked copy exists beside it.
/// @return the readable file; empty if it has to be unpacked first
std::string unpacked(const std::string& file) {
  constexpr std::string_view kEnding = ".zstd";
  if (!file.ends_with(kEnding)) return file;
  std::error_code code;
  std::string plain = file.substr(0, file.size() - kEnding.size());
  return fs::is_regular_file(plain, code) ? plain : std::string();
}

auto key_of(const Topic& topic) {
  return std::tie(topic.name, topic.type, topic.kind, topic.serialisation);
}

/// Several bags as one. A topic is the same in all of them if its name and type are.
class BagFolder final : public Bag {
 public:
  BagFolder(const std::string& folder, std::vector<io::InputFile> files, BagKind kind,
            const Progress& progress)
      : Bag(kind, folder, progress), files_(std::move(files)) {
    for (const io::InputFile& file : files_) {
      progress_.check();
      try {
        const std::unique_ptr<Bag> bag = open_file(file);
        for (const Topic& topic : bag->topics()) {
          if (find(topic) == topics_.size()) topics_.push_back(topic);
        }
      } catch (const FileError&) {
        if (&file == &files_.front()) throw;
        break;  // reported once the undamaged files before it are read
      }
    }
    std::ranges::sort(topics_,
                      [](const Topic& a, const Topic& b) { return key_of(a) < key_of(b); });
  }

  void rewind(const std::vector<bool>& wanted) override {
    require_topics(wanted);
    wanted_ = wanted;
    part_.reset();
    read_ = 0;
    warnings_.clear();
  }

  bool next(Message& message) override {
    while (true) {
      if (!part_) {
        if (read_ == files_.size()) return false;
        open_part();
      }
      if (part_->next(part_message_)) {
        message = part_message_;
        message.topic = topic_of_[part_message_.topic];
        return true;
      }
      const std::string name = fs::path(part_->path()).filename().string();
      for (const Warning& warning : part_->warnings()) {
        warnings_.push_back(of_file(name, warning));
      }
      part_.reset();
      ++read_;
    }
  }

  double fraction_read() const override {
    const double part = part_ ? part_->fraction_read() : 0.0;
    return (static_cast<double>(read_) + part) / static_cast<double>(files_.size());
  }

  using Bag::fail;
  [[noreturn]] void fail(const Message& message, const std::string& problem) const override {
    if (part_) part_->fail(part_message_, problem);
    Bag::fail(message, problem);
  }

 private:
  std::unique_ptr<Bag> open_file(const io::InputFile& file) const {
    if (bag_kind_of(file) != kind()) {
      throw FileError(
          file.path(), {0, {}},
          fmt::format("expected a bag of the same kind as the first file of the folder, {}",
                      name_of(kind())));
    }
    return open_bag(file, kind(), progress_);
  }

  std::size_t find(const Topic& topic) const {
    const auto is_same = [&](const Topic& other) { return key_of(other) == key_of(topic); };
    return static_cast<std::size_t>(std::ranges::find_if(topics_, is_same) - topics_.begin());
  }

  void open_part() {
    std::unique_ptr<Bag> part = open_file(files_[read_]);
    topic_of_.clear();
    std::vector<bool> wanted;
    for (const Topic& topic : part->topics()) {
      topic_of_.push_back(find(topic));
      if (topic_of_.back() == topics_.size()) {
        part->fail(
            fmt::format("the topic {} appeared while the folder was being read", topic.name));
      }
      wanted.push_back(wanted_[topic_of_.back()]);
    }
    part->rewind(wanted);
    part_ = std::move(part);
  }

  std::vector<io::InputFile> files_;
  std::vector<bool> wanted_;
  std::unique_ptr<Bag> part_;          ///< the current file
  std::size_t read_ = 0;               ///< files before it
  std::vector<std::size_t> topic_of_;  ///< by topic of the file
  Message part_message_;               ///< the last one, with the file's topic
};

}  // namespace

bool is_bag_folder(const std::string& folder) {
  std::error_code code;
  if (fs::exists(fs::path(folder) / kMetadata, code)) return true;
  for (fs::directory_iterator file(folder, code), end; !code && file != end; file.increment(code)) {
    const std::string ending = file->path().extension().string();
    std::string name = file->path().stem().string();
    if ((ending != ".mcap" && ending != ".db3") || !name.ends_with("_0")) continue;
    name.back() = '1';
    if (fs::exists(file->path().parent_path() / (name + ending), code)) return true;
  }
  return false;
}

std::vector<std::string> files_of_bag_folder(const std::string& folder) {
  const std::string metadata = (fs::path(folder) / kMetadata).string();
  std::error_code code;
  if (!fs::is_regular_file(metadata, code)) fail_without_metadata(folder);
  std::vector<std::string> files, missing;
  std::size_t line = 0;
  for (const auto& [name, stated_in_line] : stated_names(metadata)) {
    const std::string stated = (fs::path(folder) / name).string();
    std::string file = unpacked(stated);
    if (file.empty() && fs::is_regular_file(stated, code)) {
      const std::string plain = stated.substr(0, stated.rfind('.'));
      io::fail_at(metadata, stated_in_line,
                  fmt::format("{} is compressed as a whole (Zstandard): unpack it by `unzstd {} -o "
                              "{}`, then the folder can be read",
                              name, stated, plain));
    }
    if (!fs::is_regular_file(file, code)) {
      if (missing.empty()) line = stated_in_line;
      missing.push_back(name);
    }
    files.push_back(std::move(file));
  }
  if (!missing.empty()) {
    io::fail_at(metadata, line,
                fmt::format("names files that are not in the folder: {}; copy them into it, or "
                            "delete their names here",
                            some_names(std::move(missing))));
  }
  return files;
}

std::unique_ptr<Bag> open_bag_folder(const std::string& folder, const Progress& progress) {
  const std::vector<std::string> names = files_of_bag_folder(folder);
  const std::vector<io::InputFile> files(names.begin(), names.end());
  const std::optional<BagKind> kind = bag_kind_of(files.front());
  if (!kind) throw FileError(files.front().path(), {0, {}}, "is not a ROS 2 bag");
  return std::make_unique<BagFolder>(folder, files, *kind, progress);
}

}  // namespace risley::bags
