// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/sensors/preset.hpp"

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "risley/core/error.hpp"
#include "risley/io/text_file.hpp"

#include "command.hpp"
#include "table.hpp"

namespace risley::app {
namespace {

struct PresetOptions {
  std::string name, from, output;
  std::vector<std::string> files;
};

ExitStatus list_presets(const CommonOptions& common) {
  Json presets = Json::array();
  Table table({"preset", "model", "faces", "emitters"});
  for (const std::string& name : sensors::builtin_preset_names()) {
    const sensors::Sensor sensor = sensors::load_sensor(name);
    presets.push_back(json::of(sensor));
    table.add({name, sensor.model, to_string(sensor.train.face_order()),
               fmt::format("{}", sensor.train.emitters())});
  }
  if (common.json) {
    print_json(common, {{"presets", presets}});
  } else {
    table.print();
  }
  return kDone;
}

/// Prints a preset's text or writes it to a file.
ExitStatus hand_out(const std::string& text, const PresetOptions& options,
                    const CommonOptions& common) {
  require_apart(common, {options.output});
  if (!options.output.empty()) io::write_text_file(options.output, text);
  if (common.json) {
    Json json = json::of(sensors::parse_preset(text, options.name));
    json["text"] = text;
    if (!options.output.empty()) json["output"] = options.output;
    print_json(common, json);
  } else if (options.output.empty()) {
    say("{}", text);
  } else {
    say("{}\n", options.output);
  }
  return kDone;
}

ExitStatus check_presets(const PresetOptions& options, const CommonOptions& common) {
  ExitStatus status = kDone;
  Json results = Json::array();
  for (const std::string& file : options.files) {
    try {
      const sensors::Sensor sensor = sensors::parse_preset(io::read_text_file(file), file);
      Json json = json::of(sensor);
      json.update({{"input", file}, {"status", kDone}, {"message", ""}});
      results.push_back(json);
      if (!common.json) {
        say("{}: sound: {}, {} {}, faces {}, {} emitter{}\n", file, sensor.name,
            sensor.manufacturer, sensor.model, to_string(sensor.train.face_order()),
            sensor.train.emitters(), sensor.train.emitters() == 1 ? "" : "s");
      }
    } catch (const FileError& error) {
      status = kBadFile;
      results.push_back({{"input", file}, {"status", kBadFile}, {"message", error.what()}});
      spdlog::error(error.what());
    }
  }
  if (common.json) print_json(common, {{"results", results}});
  return status;
}

}  // namespace

Run declare_preset(CLI::App& verb) {
  const auto options = std::make_shared<PresetOptions>();
  PresetOptions& o = *options;
  const auto chosen = std::make_shared<Run>();  // separate from the options, which every run holds
  verb.require_subcommand(1);
  const auto action = [&](const char* name, const char* description, const Run& run) {
    CLI::App* sub = verb.add_subcommand(name, description);
    sub->fallthrough();  // --json and the like may come last
    sub->callback([chosen, run] { *chosen = run; });
    return sub;
  };
  const auto output = [&](CLI::App* sub) {
    sub->add_option("-o,--output", o.output, "File to write (default: standard output)");
  };
  action("list", "List the built-in presets",
         [](const CommonOptions& common) { return list_presets(common); });
  CLI::App* show =
      action("show", "Print a built-in preset, with the source of every value",
             [options](const CommonOptions& common) {
               return hand_out(sensors::builtin_preset_text(options->name), *options, common);
             });
  show->add_option("NAME", o.name, "Name of a built-in preset")->required();
  output(show);
  CLI::App* check =
      action("check", "Check preset files, and list their errors",
             [options](const CommonOptions& common) { return check_presets(*options, common); });
  check->add_option("FILE", o.files, "Preset or calibration files")->required();
  CLI::App* fresh = action(
      "new", "Copy a preset under a new name, to edit it", [options](const CommonOptions& common) {
        return hand_out(sensors::copied_preset_text(options->from, options->name), *options,
                        common);
      });
  fresh->add_option("NAME", o.name, "Name of the new preset")->required();
  fresh->add_option("--from", o.from, "Preset to copy: a name or a file")->required();
  output(fresh);
  return [chosen](const CommonOptions& common) { return (*chosen)(common); };
}

}  // namespace risley::app
