// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Files of recordings: read, audited, written in the same format, and read again.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>

#include "risley/core/error.hpp"
#include "risley/recordings/excerpt.hpp"
#include "risley/recordings/reader.hpp"
#include "risley/recordings/time_audit.hpp"
#include "risley/recordings/writer.hpp"

#include "fuzz/invariants.hpp"
#include "fuzz/memory_file.hpp"
#include "fuzz/targets.hpp"
#include "io/test_folder.hpp"
#include "recordings/formats/format.hpp"

namespace risley::fuzz {
namespace {

using recordings::Chunk;
using recordings::Format;
using recordings::Reader;

/// All chunks of a recording, each sound, and what they say of its times. @return whether the file
/// was sound to its end
bool read_all(Reader& reader, std::uint64_t most_rows, std::vector<Chunk>* chunks) {
  require_sound(reader.header());
  std::uint64_t rows = 0;
  Chunk chunk;
  recordings::TimeAudit audit;
  bool sound = true;
  try {
    while (reader.read(chunk)) {
      require_sound(chunk, reader.header());
      rows += chunk.observations.size();
      audit.add(chunk);
      require(rows <= most_rows, "no more rows than the bytes can hold");
      const double read = reader.fraction_read();
      require(read >= 0 && read <= 1, "a part read of 0 to 1");
      if (chunks != nullptr) chunks->push_back(chunk);
    }
  } catch (const Error&) {
    sound = false;
  }
  const recordings::TimeAuditResult times = audit.result();
  require(times.observations == rows && times.shots <= rows, "the audit counts rows");
  require(times.duration_s >= 0 && std::isfinite(times.rate_hz) && times.rate_hz >= 0,
          "a duration and a rate are not negative");
  return sound;
}

/// The anonymous part of a recording has no more rows than that.
void share(const std::string& path, std::uint64_t most_rows) {
  static const io::TestFolder folder;
  try {
    const auto excerpt = recordings::write_excerpt(path, folder.file("share.nc"));
    require(excerpt.observations <= most_rows, "an excerpt invents no rows");
  } catch (const Error&) {  // nothing to share
  }
}

/// Places for every row, so that a recording whose packets lack points can be read with them.
recordings::PacketPlaces some_places(std::span<const std::uint8_t> bytes) {
  recordings::PacketPlaces places;
  places.of_row.assign(bytes.begin(), bytes.end());
  places.shot_rate = 240000.0;
  places.firing_order = {0, 1, 2};
  places.cut_coordinates = bytes.size() % 2 == 0;
  return places;
}

/// Rows that a writer of the format was given are those that its file has.
void write_and_read(const Format& format, const recordings::RecordingHeader& header,
                    const std::vector<Chunk>& chunks) {
  static const io::TestFolder folder;
  const std::string path = folder.file("again" + std::string(format.ending));
  std::uint64_t written = 0;
  try {
    const auto writer = format.create(path, header, {});
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
    const bool is_folder = &format == &recordings::kRos2BagFormat;
    const auto reader = format.open(path + (is_folder ? "/again_0.db3" : ""), {});
    std::vector<Chunk> again;
    require(read_all(*reader, written + 64 * (written + 1), &again), "what is written can be read");
    std::uint64_t rows = 0;
    for (const Chunk& chunk : again) rows += chunk.observations.size();
    require(rows >= written || format.name != header.format, "nothing that was written is missing");
  } catch (const Error&) {
    require(written == 0, "what is written can be opened");
  }
}

/// As the command's convert: into a format that another ending names.
void convert(const recordings::RecordingHeader& header, const std::vector<Chunk>& chunks,
             std::size_t choice) {
  static const io::TestFolder folder;
  constexpr std::array kEndings = {".lvx",          ".lvx2", ".openpylivox.csv",
                                   ".sequence.csv", ".csv",  ".no-format"};
  const std::string path = folder.file(std::string("other") + kEndings[choice % kEndings.size()]);
  std::uint64_t written = 0;
  try {
    const auto writer = recordings::create_recording(path, header);
    for (const Chunk& chunk : chunks) {
      writer->write(chunk);
      written += chunk.observations.size();
    }
    writer->close();
  } catch (const Error&) {  // values that the format cannot hold
    return;
  }
  try {
    const auto recording = recordings::load_recording(path);
    require_sound(recording.header);
    require_sound(recording.data, recording.header);
    constexpr std::uint64_t kPacketRows = 128;  // a packet of LVX is filled up
    require(recording.data.observations.size() <= kPacketRows * (written + 1),
            "nothing is invented");
  } catch (const Error&) {
    require(written == 0, "what is converted can be read");
  }
}

void read_twice(const Format& format, std::uint64_t rows_per_byte,
                std::span<const std::uint8_t> bytes) {
  const MemoryFile file(bytes);
  const std::uint64_t most_rows = rows_per_byte * bytes.size();
  std::vector<Chunk> chunks;
  bool opened = false;
  try {
    const auto reader = format.open(file.path(), {});
    opened = true;
    const bool sound = read_all(*reader, most_rows, &chunks);
    if (sound && format.create != nullptr) write_and_read(format, reader->header(), chunks);
  } catch (const Error&) {  // refused
  }
  // And as the command opens it, which may find it to be of another kind, or of none.
  const bool recognised = format.recognises({reinterpret_cast<const char*>(bytes.data()),
                                             std::min(bytes.size(), recordings::kHeadBytes)});
  if (!opened && recognised) return;
  const std::uint64_t most_opened = recognised ? most_rows : kPackedRows * bytes.size();
  recordings::ReadOptions options;
  if (bytes.size() % 2 == 0) {
    options.shot_rate = 240000.0;
    options.emitters = static_cast<int>(bytes.size() % 7);
    options.slips = {{bytes.size() / 8, 1}, {bytes.size() / 4, -1}};
  } else if (bytes.size() % 4 == 1) {
    options.packet_places = some_places(bytes);
  }
  if (bytes.size() % 3 != 0) options.extrinsics = recordings::Extrinsics{0.3, -0.2, 0.1, {1, 2, 3}};
  try {
    const auto reader = recordings::open_recording(file.path(), options);
    chunks.clear();
    const bool sound = read_all(*reader, most_opened, &chunks);
    if (sound && bytes.size() % 4 == 3) convert(reader->header(), chunks, bytes.size() / 4);
  } catch (const Error&) {  // refused, as it may be
  }
  constexpr std::size_t kSeldom = 32;  // takes longer than all the rest
  if (bytes.size() % kSeldom == 0) share(file.path(), most_opened);
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
      {"lvx-2", run<kLvx2Format, kPlainRows>},
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
      {"mcap", run<kMcapFormat, kZstdRows>},
      {"pcap", run<kPcapFormat, kPlainRows>},
  };
}

}  // namespace risley::fuzz
