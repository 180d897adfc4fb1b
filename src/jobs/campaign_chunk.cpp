// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "jobs/campaign_chunk.hpp"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "risley/core/error.hpp"
#include "risley/hashes/sha256.hpp"
#include "risley/io/json_text.hpp"
#include "risley/io/text_file.hpp"

namespace risley::jobs {
namespace {

using ChunkJson = nlohmann::ordered_json;

constexpr const char* kChunkKind = "risley_campaign_chunk";
constexpr int kChunkVersion = 1;

/// NaN is null in JSON.
double number(const ChunkJson& json) {
  return json.is_null() ? std::numeric_limits<double>::quiet_NaN() : json.get<double>();
}

ChunkJson to_json(const CellOutcome& outcome) {
  ChunkJson parameters = ChunkJson::array(), errors = ChunkJson::array();
  for (const CellParameter& one : outcome.parameters) {
    parameters.push_back({one.name, one.truth, one.error, one.sigma, one.sigma_given_held});
  }
  for (const CellErrors& one : outcome.errors) errors.push_back({one.name, one.rms, one.sigma});
  return {{"cell", outcome.cell.number},
          {"setting", outcome.cell.setting},
          {"seed", outcome.cell.seed},
          {"answered", outcome.answered},
          {"verdict", outcome.verdict},
          {"message", outcome.message},
          {"nees", outcome.nees},
          {"degrees_of_freedom", outcome.degrees_of_freedom},
          {"nees_rotation_angles", outcome.nees_rotation_angles},
          {"parameters", parameters},
          {"errors", errors}};
}

CellOutcome outcome_from(const ChunkJson& json) {
  CellOutcome outcome;
  json.at("cell").get_to(outcome.cell.number);
  json.at("setting").get_to(outcome.cell.setting);
  json.at("seed").get_to(outcome.cell.seed);
  json.at("answered").get_to(outcome.answered);
  json.at("verdict").get_to(outcome.verdict);
  json.at("message").get_to(outcome.message);
  outcome.nees = number(json.at("nees"));
  json.at("degrees_of_freedom").get_to(outcome.degrees_of_freedom);
  outcome.nees_rotation_angles = number(json.at("nees_rotation_angles"));
  for (const ChunkJson& one : json.at("parameters")) {
    outcome.parameters.push_back({one.at(0).get<std::string>(), number(one.at(1)),
                                  number(one.at(2)), number(one.at(3)), number(one.at(4))});
  }
  for (const ChunkJson& one : json.at("errors")) {
    outcome.errors.push_back({one.at(0).get<std::string>(), number(one.at(1)), number(one.at(2))});
  }
  return outcome;
}

std::string line_of(const ChunkJson& json) {
  return json.dump(-1, ' ', false, ChunkJson::error_handler_t::replace) + "\n";
}

}  // namespace

std::string chunk_folder(const std::string& folder) {
  return (std::filesystem::path(folder) / "chunks").string();
}

void save_chunk(const std::string& path, const ChunkHead& head,
                const std::vector<CellOutcome>& outcomes) {
  std::string text = line_of({{kChunkKind, kChunkVersion},
                              {"work", head.work},
                              {"program", head.program},
                              {"first", head.first},
                              {"cells", head.cells}});
  for (const CellOutcome& outcome : outcomes) text += line_of(to_json(outcome));
  text += line_of({{"sha256", hashes::sha256(text)}});
  io::write_text_file(path, text);
}

ChunkHead read_chunk(const std::string& path, const Progress& progress,
                     const std::function<void(const ChunkHead&, CellOutcome&&)>& call) {
  // A chunk is small: its cells took minutes.
  const std::string text = io::read_text_file(path);
  std::size_t begin = 0, line = 0;
  const auto fail = [&](const std::string& problem) {
    FilePlace place;
    place.line = line;
    throw FileError(path, place, problem);
  };
  const auto next = [&] {
    ++line;
    const std::size_t end = text.find('\n', begin);
    if (end == std::string::npos) fail("the file ends here, cells are missing");
    io::require_shallow_json(path, std::string_view(text).substr(begin, end - begin));
    ChunkJson json = ChunkJson::parse(text.begin() + static_cast<std::ptrdiff_t>(begin),
                                      text.begin() + static_cast<std::ptrdiff_t>(end));
    begin = end + 1;
    return json;
  };
  try {
    ChunkHead head;
    const ChunkJson json = next();
    if (!json.is_object() || json.value(kChunkKind, 0) != kChunkVersion) {
      fail("this is not a chunk of a campaign, or it is from another version of risley");
    }
    json.at("work").get_to(head.work);
    json.at("program").get_to(head.program);
    json.at("first").get_to(head.first);
    json.at("cells").get_to(head.cells);
    for (std::uint64_t i = 0; i < head.cells; ++i) {
      progress.check();
      CellOutcome outcome = outcome_from(next());
      if (outcome.cell.number != head.first + i) {
        fail(fmt::format("cell {}, expected {}", outcome.cell.number, head.first + i));
      }
      if (call) call(head, std::move(outcome));
    }
    const std::size_t whole = begin;
    if (next().at("sha256") != hashes::sha256(std::string_view(text).substr(0, whole))) {
      fail("the SHA-256 is not that of the lines above: the file was changed");
    }
    if (begin != text.size()) fail("data follow after the end");
    return head;
  } catch (const ChunkJson::exception& error) {
    fail(fmt::format("cannot be read: {}", error.what()));
  }
  return {};
}

}  // namespace risley::jobs
