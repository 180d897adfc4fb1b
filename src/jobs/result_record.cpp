// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/result_record.hpp"

#include <algorithm>
#include <filesystem>
#include <system_error>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "risley/core/error.hpp"
#include "risley/hashes/sha256.hpp"
#include "risley/io/folder.hpp"
#include "risley/io/json_text.hpp"
#include "risley/io/text_file.hpp"

namespace risley::jobs {
namespace {

namespace fs = std::filesystem;
using RecordJson = nlohmann::ordered_json;

constexpr const char* kRecordKind = "risley_record";
constexpr int kRecordVersion = 2;
constexpr const char* kSeal = "sha256";  // of all the rest: a record that was edited is none

std::string seal_of(const RecordJson& json) {
  return hashes::sha256(json.dump(-1, ' ', false, RecordJson::error_handler_t::replace));
}

}  // namespace

void save_record(const std::string& path, const ResultRecord& record) {
  const fs::path folder = fs::path(path).parent_path();
  if (!folder.empty()) io::make_folder(folder.string());
  RecordJson outputs = RecordJson::array();
  for (const auto& [file, hash] : record.outputs) {
    outputs.push_back({{"path", file}, {"sha256", hash}});
  }
  RecordJson json = {{kRecordKind, kRecordVersion},
                     {"work", record.work},
                     {"inputs_sha256", record.inputs},
                     {"outputs", outputs},
                     {"outcome", record.outcome}};
  json[kSeal] = seal_of(json);
  io::write_text_file(path, json.dump(1, ' ', false, RecordJson::error_handler_t::replace) + "\n");
}

std::optional<ResultRecord> load_record(const std::string& path) {
  std::error_code ignored;
  if (!fs::is_regular_file(path, ignored)) return std::nullopt;
  try {
    const std::string text = io::read_text_file(path);
    io::require_shallow_json(path, text);
    const RecordJson json = RecordJson::parse(text);
    if (json.at(kRecordKind) != kRecordVersion) return std::nullopt;
    RecordJson sealed = json;
    sealed.erase(kSeal);
    if (json.at(kSeal) != seal_of(sealed)) return std::nullopt;
    ResultRecord record;
    json.at("work").get_to(record.work);
    json.at("inputs_sha256").get_to(record.inputs);
    for (const RecordJson& output : json.at("outputs")) {
      record.outputs.emplace_back(output.at("path").get<std::string>(),
                                  output.at("sha256").get<std::string>());
    }
    json.at("outcome").get_to(record.outcome);
    return record;
  } catch (const RecordJson::exception&) {  // the result is made again
  } catch (const FileError&) {
  }
  return std::nullopt;
}

bool is_whole(const ResultRecord& record, const std::string& work,
              const std::vector<std::string>& inputs, const Progress& progress) {
  if (record.work != work || record.inputs != inputs) return false;
  try {
    return std::all_of(record.outputs.begin(), record.outputs.end(), [&](const auto& output) {
      return hashes::sha256_of_file(output.first, progress) == output.second;
    });
  } catch (const FileError&) {  // one is gone
    return false;
  }
}

std::vector<std::pair<std::string, std::string>> hashes_of(const std::vector<std::string>& files,
                                                           const Progress& progress) {
  std::vector<std::pair<std::string, std::string>> hashes;
  for (const std::string& file : files) {
    std::error_code ignored;
    if (fs::is_regular_file(file, ignored)) {
      hashes.emplace_back(file, hashes::sha256_of_file(file, progress));
    }
  }
  return hashes;
}

}  // namespace risley::jobs
