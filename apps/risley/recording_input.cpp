// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "recording_input.hpp"

#include <spdlog/spdlog.h>

namespace risley::app {

void add_reading_options(CLI::App& verb, ReadingWishes& wishes) {
  verb.add_option("--shot-rate-hz", wishes.shot_rate_hz,
                  "Shots per second of a recording without times, or with bad ones: times are "
                  "counted, shots without return keep their places");
}

recordings::ReadOptions read_options(const ReadingWishes& wishes) {
  if (wishes.shot_rate_hz) check_positive(*wishes.shot_rate_hz, "--shot-rate-hz", "Hz");
  return {.shot_rate = wishes.shot_rate_hz};
}

std::unique_ptr<recordings::Reader> open_input(const std::string& path,
                                               const ReadingWishes& wishes) {
  auto reader = recordings::open_recording(path, read_options(wishes));
  spdlog::debug("{} is {}", path, reader->header().format);
  return reader;
}

}  // namespace risley::app
