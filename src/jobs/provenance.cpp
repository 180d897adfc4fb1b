// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/provenance.hpp"

#include <algorithm>
#include <filesystem>

#include <fmt/format.h>

#include "risley/core/require.hpp"
#include "risley/hashes/sha256.hpp"
#include "risley/parallel/parallel.hpp"

namespace risley::jobs {

namespace {

/// Pipes and similar files: reading them again waits forever, or finds nothing.
bool is_read_once(const std::string& path) {
  const auto type = std::filesystem::status(path).type();
  using Type = std::filesystem::file_type;
  return type == Type::fifo || type == Type::character || type == Type::socket;
}

}  // namespace

struct InputHashes::Input {
  std::string memory;  ///< name of columns in memory
  /// Files and their SHA-256, which is empty for files that can be read only once.
  std::vector<std::pair<std::string, std::string>> hashes{};
  parallel::TaskGroup task{};  ///< that finds them

  /// Appends them. @param count  inputs so far
  void add_to(Provenance& provenance, std::size_t& count) {
    const auto add = [&](const std::string& input) {
      ++count;
      std::string name = count == 1 ? "input" : fmt::format("input_{}", count);
      provenance.emplace_back(name, input);
      return name;
    };
    task.wait();
    if (!memory.empty()) add(memory);
    for (const auto& [file, hash] : hashes) {
      const std::string name = add(file);
      if (!hash.empty()) provenance.emplace_back(name + "_sha256", hash);
    }
  }
};

InputHashes::InputHashes(const std::vector<recordings::Source>& inputs, const Progress& progress) {
  for (const recordings::Source& source : inputs) {
    Input& input = *inputs_.emplace_back(new Input{source.recording() ? source.name() : ""});
    input.task.run(
        [&input, source = recordings::Source(source), own = progress.silent()]() mutable {
          std::vector<io::InputFile> files;
          for (const std::string& file : recordings::recording_files(source)) {
            input.hashes.emplace_back(file, "");
            if (!is_read_once(file)) files.push_back(source.open_file(file));
          }
          source = {};  // and the data read from it
          auto place = input.hashes.begin();
          for (const io::InputFile& file : files) {
            place = std::find_if(place, input.hashes.end(),
                                 [&](const auto& one) { return one.first == file.path(); });
            place->second = hashes::sha256_of_file(file, own);
          }
        });
  }
}

InputHashes::~InputHashes() = default;

Provenance InputHashes::with_inputs(Provenance provenance) {
  std::size_t count = 0;
  for (const auto& input : inputs_) input->add_to(provenance, count);
  return provenance;
}

Provenance InputHashes::with_input(Provenance provenance, std::size_t input) {
  require_place("input", input, inputs_.size());
  std::size_t count = 0;
  inputs_[input]->add_to(provenance, count);
  return provenance;
}

Provenance with_inputs(Provenance provenance, const std::vector<recordings::Source>& inputs,
                       const Progress& progress) {
  return InputHashes(inputs, progress).with_inputs(std::move(provenance));
}

}  // namespace risley::jobs
