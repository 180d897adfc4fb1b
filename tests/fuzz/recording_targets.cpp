// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Files of recordings: read, written in the same format, and read again.
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "risley/core/error.hpp"
#include "risley/recordings/reader.hpp"
#include "risley/recordings/writer.hpp"

#include "fuzz/invariants.hpp"
#include "fuzz/memory_file.hpp"
#include "fuzz/targets.hpp"
#include "io/temporary_folder.hpp"
#include "recordings/formats/format.hpp"

namespace risley::fuzz {
namespace {

using recordings::Chunk;
using recordings::Format;
using recordings::Reader;

/// All chunks of a recording, each sound. @return whether the file was sound to its end
bool read_all(Reader& reader, std::uint64_t most_rows, std::vector<Chunk>* chunks) {
  require_sound(reader.header());
  std::uint64_t rows = 0;
  Chunk chunk;
  try {
    while (reader.read(chunk)) {
      require_sound(chunk, reader.header());
      rows += chunk.observations.size();
      require(rows <= most_rows, "no more rows than the bytes can hold");
      const double read = reader.fraction_read();
      require(read >= 0 && read <= 1, "a part read of 0 to 1");
      if (chunks != nullptr) chunks->push_back(chunk);
    }
  } catch (const Error&) {
    return false;
  }
  return true;
}

/// Rows that a writer of the format was given are those that its file has.
void write_and_read(const Format& format, const recordings::RecordingHeader& header,
                    const std::vector<Chunk>& chunks) {
  static const io::TemporaryFolder folder;
  const std::string path = folder.file("again" + std::string(format.ending));
  std::uint64_t written = 0;
  try {
    const auto writer = format.create(path, header);
    for (const Chunk& chunk : chunks) {
      writer->write(chunk);
      written += chunk.observations.size();
    }
    writer->close();
    written -= writer->left_out();
  } catch (const Error&) {  // values that the format cannot hold
    return;
  }
  try {
    const auto reader = format.open(path);
    std::vector<Chunk> again;
    require(read_all(*reader, written + 64 * (written + 1), &again), "what is written can be read");
    std::uint64_t rows = 0;
    for (const Chunk& chunk : again) rows += chunk.observations.size();
    require(rows >= written || format.name != header.format, "nothing that was written is missing");
  } catch (const Error&) {
    require(written == 0, "what is written can be opened");
  }
}

void read_twice(const Format& format, std::uint64_t rows_per_byte,
                std::span<const std::uint8_t> bytes) {
  const MemoryFile file(bytes);
  const std::uint64_t most_rows = rows_per_byte * bytes.size();
  std::vector<Chunk> chunks;
  try {
    const auto reader = format.open(file.path());
    const bool sound = read_all(*reader, most_rows, &chunks);
    if (sound && format.create != nullptr) write_and_read(format, reader->header(), chunks);
  } catch (const Error&) {
    return;
  }
  if (!format.recognises({reinterpret_cast<const char*>(bytes.data()),
                          std::min(bytes.size(), recordings::kHeadBytes)})) {
    return;
  }
  // And as an estimation may ask for it.
  recordings::ReadOptions options;
  if (bytes.size() % 2 == 0) options.shot_rate = 240000.0;
  if (bytes.size() % 3 != 0) options.extrinsics = recordings::Extrinsics{0.3, -0.2, 0.1, {1, 2, 3}};
  try {
    const auto reader = recordings::open_recording(file.path(), options);
    read_all(*reader, most_rows, nullptr);
  } catch (const Error&) {  // refused, as it may be
  }
}

template <const Format& format, std::uint64_t rows_per_byte>
void run(std::span<const std::uint8_t> bytes) {
  read_twice(format, rows_per_byte, bytes);
}

}  // namespace

std::vector<Target> recording_targets() {
  using namespace recordings;
  return {
      {"lvx-1.1", run<kLvx11Format, kPlainRows>},
      {"lvx-1.0", run<kLvx10Format, kPlainRows>},
      {"scan-sequence-csv", run<kScanSequenceCsvFormat, kPlainRows>},
      {"openpylivox-csv", run<kOpenpylivoxCsvFormat, kPlainRows>},
      {"openpylivox-bin", run<kOpenpylivoxBinFormat, kPlainRows>},
      {"viewer-csv", run<kViewerCsvFormat, kPlainRows>},
      {"named-csv", run<kNamedCsvFormat, kPlainRows>},
      {"las", run<kLasFormat, kPlainRows>},
      {"pcd", run<kPcdFormat, kPackedRows>},
      {"ply", run<kPlyFormat, kPlainRows>},
      {"npy", run<kNpyFormat, kPlainRows>},
      {"npz", run<kNpzFormat, kPackedRows>},
      {"ros1-bag", run<kRos1BagFormat, kPackedRows>},
      {"ros2-bag", run<kRos2BagFormat, kPlainRows>},
  };
}

}  // namespace risley::fuzz
