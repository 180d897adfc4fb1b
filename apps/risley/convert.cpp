// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <memory>
#include <optional>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "risley/recordings/reader.hpp"
#include "risley/recordings/writer.hpp"

#include "command.hpp"
#include "recording_text.hpp"

namespace risley::app {
namespace {

struct ConvertOptions {
  std::string input, output, format;
};

std::string known_endings() {
  std::string text;
  for (const recordings::WritableFormat& format : recordings::writable_formats()) {
    text += fmt::format("\n  {:<18} {} ({})", format.ending, format.description, format.name);
  }
  return text;
}

std::set<std::string> format_names() {
  std::set<std::string> names;
  for (const auto& format : recordings::writable_formats()) names.insert(format.name);
  return names;
}

}  // namespace

Run declare_convert(CLI::App& verb) {
  const auto options = std::make_shared<ConvertOptions>();
  verb.add_option("INPUT", options->input, "Recording, of any known format")->required();
  verb.add_option("-o,--output", options->output,
                  "Recording to write; its ending chooses the format:" + known_endings())
      ->required();
  verb.add_option("--format", options->format, "Format to write, whatever the ending")
      ->check(CLI::IsMember(format_names()));
  return [options](const CommonOptions& common) {
    const auto reader = recordings::open_recording(options->input);
    const auto writer =
        recordings::create_recording(options->output, reader->header(), options->format);
    spdlog::debug("{} is {}", options->input, reader->header().format);
    std::uint64_t observations = 0;
    std::optional<FileError> damage;
    {
      ProgressBar bar("converting", common);
      recordings::Chunk chunk;
      const auto read_next = [&] {
        try {
          return reader->read(chunk);
        } catch (const FileError& error) {
          damage = error;  // the sound part is worth keeping
          return false;
        }
      };
      while (read_next()) {
        writer->write(chunk);
        observations += chunk.observations.size();
        bar.show(reader->fraction_read());
      }
    }
    writer->close();
    log_warnings(reader->warnings());
    const std::uint64_t written = observations - writer->left_out();
    if (writer->left_out() > 0) {
      spdlog::warn("{} of {} observations have no place in this format and were left out",
                   writer->left_out(), observations);
    }
    if (damage) {
      spdlog::error("{}; the {} observations before it are saved in {}", damage->what(), written,
                    options->output);
    }
    if (common.json) {
      Json object = {{"observations", written},
                     {"left_out", writer->left_out()},
                     {"input_format", reader->header().format},
                     {"output", options->output},
                     {"warnings", warnings_json(reader->warnings())}};
      if (damage) object.update(damage_json(*damage));
      print_json(object);
    } else {
      fmt::print("{}: {} observations\n", options->output, grouped(written));
    }
    return damage ? kBadFile : kDone;
  };
}

}  // namespace risley::app
