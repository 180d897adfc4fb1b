// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/recordings/reader.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>

#include <fmt/format.h>

#include "recordings/formats/format.hpp"

namespace risley::recordings {
namespace {

constexpr std::size_t kHeadBytes = 4096;

std::string known_formats() {
  std::string names;
  for (const Format* format : all_formats()) {
    names += fmt::format("{}{}", names.empty() ? "" : ", ", format->name);
  }
  return names;
}

/// The first bytes of an unknown file, as text where they are text.
std::string shown(std::string_view head) {
  constexpr std::size_t kShown = 16;
  head = head.substr(0, kShown);
  const bool is_text = std::all_of(head.begin(), head.end(), [](char c) {
    return std::isprint(static_cast<unsigned char>(c)) != 0;
  });
  if (is_text) return fmt::format("'{}'", head);
  std::string bytes;
  for (const char c : head) {
    bytes += fmt::format("{}{:02X}", bytes.empty() ? "" : " ", static_cast<unsigned char>(c));
  }
  return bytes;
}

std::string read_head(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code code;
  const fs::file_status status = fs::status(path, code);
  if (status.type() == fs::file_type::not_found) throw FileError(path, {}, "no such file");
  if (status.type() == fs::file_type::directory) {
    throw FileError(path, {}, "is a folder, expected a recording");
  }
  if (status.type() != fs::file_type::regular) {
    throw FileError(path, {}, "is not a regular file, expected a recording");
  }
  std::ifstream stream(path, std::ios::binary);
  if (!stream) throw FileError(path, {}, fmt::format("cannot be read: {}", std::strerror(errno)));
  std::string head(kHeadBytes, '\0');
  stream.read(head.data(), static_cast<std::streamsize>(head.size()));
  if (stream.bad()) throw FileError(path, {}, "cannot be read");
  head.resize(static_cast<std::size_t>(stream.gcount()));
  if (head.empty()) {
    throw FileError(path, {0, {}},
                    fmt::format("is empty, expected a recording ({})", known_formats()));
  }
  return head;
}

std::unique_ptr<Reader> open_as_it_is(const std::string& path) {
  const std::string head = read_head(path);
  for (const Format* format : all_formats()) {
    if (format->recognises(head)) return format->open(path);
  }
  throw FileError(path, {0, {}},
                  fmt::format("is of no known kind: expected {}; it begins with {}",
                              known_formats(), shown(head)));
}

/// Gives every row the time that counting its shot gives.
class CountingReader final : public Reader {
 public:
  CountingReader(std::unique_ptr<Reader> inner, std::string path, double shot_rate)
      : inner_(std::move(inner)), path_(std::move(path)), shot_rate_(shot_rate) {
    take_over();
  }

  bool read(Chunk& chunk, std::size_t max_rows) override {
    if (failure_) throw FileError(*failure_);
    bool more = false;
    try {
      more = inner_->read(chunk, max_rows);
    } catch (const FileError&) {
      take_over();
      throw;
    }
    lost_samples_ += chunk.imu.size();
    take_over();
    chunk.packets.clear();
    chunk.imu.clear();
    Observations& rows = chunk.observations;
    for (std::size_t row = 0; row < rows.size(); ++row) {
      const std::optional<std::int64_t> time_ns = time_of(shot_number(rows, row));
      if (!time_ns) {
        failure_.emplace(path_, FilePlace{},
                         fmt::format("shot number {} at {} Hz is beyond 9.2e9 s, the latest time; "
                                     "expected smaller numbers or a higher shot rate",
                                     rows.time_ns[row], shot_rate_));
        rows.resize(row);
        if (row == 0) throw FileError(*failure_);
        break;
      }
      rows.time_ns[row] = *time_ns;
    }
    return more;
  }

  double fraction_read() const override { return inner_->fraction_read(); }

 private:
  /// What the inner reader knows by now.
  void take_over() {
    header_ = inner_->header();
    header_.has_times = true;
    header_.time_reference = TimeReference::relative;
    warnings_ = inner_->warnings();
    if (lost_samples_ == 0) return;
    warnings_.push_back({{},
                         "inertial samples were left out: their times are not those of counted "
                         "shots",
                         lost_samples_});
  }

  std::int64_t shot_number(const Observations& rows, std::size_t row) {
    if (!inner_->header().has_times) return rows.time_ns[row];
    std::int64_t& next = next_shot_[rows.device[row]];
    if (rows.return_number[row] <= 1 || next == 0) ++next;
    return next - 1;
  }

  std::optional<std::int64_t> time_of(std::int64_t shot) const {
    constexpr long double kLatest = 9.2e18L;
    const long double time_ns = static_cast<long double>(shot) * 1e9L / shot_rate_;
    if (!(std::abs(time_ns) < kLatest)) return std::nullopt;
    return std::llround(time_ns);
  }

  std::unique_ptr<Reader> inner_;
  std::string path_;
  double shot_rate_;
  std::array<std::int64_t, 256> next_shot_{};  ///< by device
  std::uint64_t lost_samples_ = 0;
  std::optional<FileError> failure_;
};

}  // namespace

std::unique_ptr<Reader> open_recording(const std::string& path, const ReadOptions& options) {
  if (!options.shot_rate) return open_as_it_is(path);
  const double rate = *options.shot_rate;
  if (!(rate > 0.0) || !std::isfinite(rate)) {
    throw InvalidArgument(
        fmt::format("ReadOptions::shot_rate = {} Hz, expected a finite number above 0", rate));
  }
  return std::make_unique<CountingReader>(open_as_it_is(path), path, rate);
}

void require_times(const RecordingHeader& header) {
  if (header.has_times) return;
  throw MissingTimes(fmt::format(
      "a recording of format {} that holds no times of single shots, which are needed here; "
      "expected a shot rate to count them by",
      header.format));
}

Recording load_recording(const std::string& path, const Progress& progress,
                         const ReadOptions& options) {
  const std::unique_ptr<Reader> reader = open_recording(path, options);
  Recording recording;
  Chunk chunk;
  while (reader->read(chunk)) {
    recording.data.observations.append(chunk.observations);
    recording.data.packets.insert(recording.data.packets.end(), chunk.packets.begin(),
                                  chunk.packets.end());
    recording.data.imu.insert(recording.data.imu.end(), chunk.imu.begin(), chunk.imu.end());
    report_progress(progress, reader->fraction_read());
  }
  recording.header = reader->header();
  recording.warnings = reader->warnings();
  return recording;
}

}  // namespace risley::recordings
