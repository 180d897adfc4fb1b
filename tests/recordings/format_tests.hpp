// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <optional>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include "risley/core/error.hpp"

#include "io/test_folder.hpp"
#include "recordings/formats/format.hpp"
#include "warning_codes.hpp"

namespace risley::recordings::format_tests {

using io::TestFolder;

inline void put_bytes(const std::string& path, std::string_view bytes) {
  std::filesystem::remove(path);  // much faster on most disks than to overwrite
  std::ofstream stream(path, std::ios::binary);
  stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  ASSERT_TRUE(stream.good());
}

inline std::string get_bytes(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  EXPECT_TRUE(stream.good()) << path;
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// All that reading a file gave, up to its end or to its damage.
struct Outcome {
  Recording recording;
  std::optional<FileError> error;
  bool opened = false;

  const Observations& rows() const { return recording.data.observations; }
};

using Opened = std::function<std::unique_ptr<Reader>(const std::string& path)>;

inline Outcome read_all(const Opened& open, const std::string& path,
                        std::size_t chunk_rows = kDefaultChunkRows) {
  Outcome outcome;
  std::unique_ptr<Reader> reader;
  Chunk chunk;
  try {
    reader = open(path);
    outcome.opened = true;
    outcome.recording.header = reader->header();
    while (reader->read(chunk, chunk_rows)) {
      auto& all = outcome.recording.data;
      all.observations.append(chunk.observations);
      all.packets.insert(all.packets.end(), chunk.packets.begin(), chunk.packets.end());
      all.imu.insert(all.imu.end(), chunk.imu.begin(), chunk.imu.end());
      EXPECT_GE(reader->fraction_read(), 0.0);
      EXPECT_LE(reader->fraction_read(), 1.0);
    }
  } catch (const FileError& error) {
    outcome.error = error;
    EXPECT_EQ(error.path(), path);
    EXPECT_FALSE(error.problem().empty());
    if (reader) {
      EXPECT_THROW(reader->read(chunk, chunk_rows), FileError) << "forgot the damage";
    }
  }
  if (reader) outcome.recording.warnings = reader->warnings();
  return outcome;
}

inline Outcome read_all(const Format& format, const std::string& path,
                        std::size_t chunk_rows = kDefaultChunkRows) {
  return read_all([&](const std::string& file) { return format.open(file, {}); }, path, chunk_rows);
}

inline Outcome read_text(const Format& format, std::string_view bytes,
                         std::size_t chunk_rows = kDefaultChunkRows) {
  const TestFolder folder;
  const std::string path = folder.file("input");
  put_bytes(path, bytes);
  return read_all(format, path, chunk_rows);
}

/// A recording's warnings.
inline const std::vector<Warning>& warnings_of(const Outcome& outcome) {
  return outcome.recording.warnings;
}

/// Reading ended at damage that is described in these words, after these rows, at this byte or
/// line.
inline void expect_damage(const Outcome& outcome, const ::testing::Matcher<std::string>& problem,
                          std::optional<std::size_t> rows = {},
                          std::optional<std::uint64_t> place = {}) {
  ASSERT_TRUE(outcome.error);
  EXPECT_THAT(outcome.error->problem(), problem);
  if (rows) {
    EXPECT_EQ(outcome.rows().size(), *rows);
  }
  if (place) {
    const FilePlace& found = outcome.error->place();
    EXPECT_EQ(found.byte_offset ? found.byte_offset : found.line, place);
  }
}

/// Expects reading to take less than 200 MiB, whatever a file claims.
inline void expect_little_memory(const std::function<void()>& reading) {
  const auto peak_kib = [] {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss;
  };
  const auto before = peak_kib();
  reading();
#if !defined(__SANITIZE_THREAD__)  // it touches its own notes of every allocation
  EXPECT_LT(peak_kib() - before, 200 << 10);
#endif
}

inline void write_all(const Format& format, const std::string& path, const RecordingHeader& header,
                      const Chunk& chunk) {
  auto writer = format.create(path, header, {});
  writer->write(chunk);
  writer->close();
}

/// Reads a file in pieces of a few rows and writes it again piece by piece.
inline std::string copy_of(const Format& format, const std::string& path, std::size_t chunk_rows,
                           const Format* target = nullptr) {
  const TestFolder folder;
  const std::string copy = folder.file("copy");
  auto reader = format.open(path, {});
  auto writer = (target != nullptr ? *target : format).create(copy, reader->header(), {});
  Chunk chunk;
  while (reader->read(chunk, chunk_rows)) writer->write(chunk);
  writer->close();
  return get_bytes(copy);
}

inline std::string rewritten(const Format& format, std::string_view bytes,
                             std::size_t chunk_rows = 3, const Format* target = nullptr) {
  const TestFolder folder;
  const std::string path = folder.file("input");
  put_bytes(path, bytes);
  return copy_of(format, path, chunk_rows, target);
}

template <class T>
bool same_bits(const std::vector<T>& part, const std::vector<T>& whole) {
  return part.size() <= whole.size() &&
         (part.empty() || std::memcmp(part.data(), whole.data(), part.size() * sizeof(T)) == 0);
}

/// Whether the rows are the first rows of the whole, bit by bit.
inline bool is_prefix(const Observations& part, const Observations& whole) {
  return same_bits(part.time_ns, whole.time_ns) && same_bits(part.azimuth, whole.azimuth) &&
         same_bits(part.zenith, whole.zenith) && same_bits(part.range, whole.range) &&
         same_bits(part.azimuth_resolution, whole.azimuth_resolution) &&
         same_bits(part.zenith_resolution, whole.zenith_resolution) &&
         same_bits(part.range_resolution, whole.range_resolution) &&
         same_bits(part.intensity, whole.intensity) &&
         same_bits(part.return_number, whole.return_number) && same_bits(part.tag, whole.tag) &&
         same_bits(part.beam, whole.beam) && same_bits(part.device, whole.device) &&
         same_bits(part.valid, whole.valid);
}

inline bool is_same(const Observations& a, const Observations& b) {
  return a.size() == b.size() && is_prefix(a, b);
}

/// Cuts the file behind every `step`-th byte: reading must give the first rows of the whole, and
/// wherever `expected_rows` says that part of a record is left, a warning or an error.
/// @param expected_rows  complete rows in the first n bytes, and whether something else is left
inline void check_cuts(
    const Format& format, const std::string& bytes, std::size_t step,
    const std::function<std::pair<std::size_t, bool>(std::string_view)>& expected_rows) {
  const TestFolder folder;
  const std::string path = folder.file("cut");
  put_bytes(path, bytes);
  const Outcome whole = read_all(format, path);
  ASSERT_FALSE(whole.error) << whole.error->what();
  for (std::size_t length = 0; length < bytes.size(); length += step) {
    SCOPED_TRACE(fmt::format("cut behind byte {}", length));
    const auto head = std::string_view(bytes).substr(0, length);
    put_bytes(path, head);
    const Outcome cut = read_all(format, path, 2);
    ASSERT_TRUE(is_prefix(cut.rows(), whole.rows()));
    if (!cut.opened) {
      ASSERT_TRUE(cut.error);
      ASSERT_EQ(cut.rows().size(), 0U);
      continue;
    }
    const auto [rows, something_left] = expected_rows(head);
    ASSERT_EQ(cut.rows().size() + cut.recording.data.imu.size(), rows);
    ASSERT_EQ(!cut.recording.warnings.empty() || cut.error.has_value(), something_left);
  }
}

}  // namespace risley::recordings::format_tests
