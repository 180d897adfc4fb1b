// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Binary captures of openpylivox: the records of the sensor's packets, each followed by its time
// as a double in seconds. Times are rounded to the nearest nanosecond, far above the rounding noise
// of the program's summation.
#include <span>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/io/block_file.hpp"
#include "risley/io/little_endian.hpp"
#include "risley/io/seconds.hpp"
#include "risley/recordings/livox/packet_decoder.hpp"

#include "recordings/formats/format.hpp"
#include "recordings/formats/openpylivox.hpp"

namespace risley::recordings {

using namespace livox;

namespace {

using io::load;

constexpr std::string_view kBinSignature = "OPENPYLIVOX";
constexpr std::string_view kImuSignature = "OPENPYLIVOX_IMU";
constexpr std::uint64_t kHeaderBytes = 15;  // of both kinds
constexpr std::size_t kTimeBytes = 8;

/// Positions of the parts of a record.
struct RecordParts {
  RecordLayout points{};  ///< of one record
  std::size_t time_at = 0;
  bool return_digit = false;

  std::size_t bytes() const { return time_at + kTimeBytes + (return_digit ? 1 : 0); }
};

RecordParts parts_of(const OpenpylivoxLayout& layout) {
  RecordParts parts;
  parts.points =
      *record_layout(layout.imu ? kImuDataType : static_cast<std::uint8_t>(layout.data_type));
  parts.points.records = 1;
  parts.time_at = parts.points.bytes_per_record;
  parts.return_digit = !layout.imu && layout.firmware_type > 1;
  return parts;
}

class OpenpylivoxBinReader final : public Reader {
 public:
  explicit OpenpylivoxBinReader(const io::InputFile& file) : input_(file) {
    header_.format = kOpenpylivoxBinName;
    layout_ = read_layout();
    parts_ = parts_of(layout_);
    describe_openpylivox(header_, layout_);
  }

  bool read(Chunk& chunk, std::size_t max_rows) override {
    chunk.clear();
    for (std::size_t rows = 0; rows < max_rows; rows += layout_.paired() ? 2 : 1) {
      if (offset_ + parts_.bytes() > input_.size()) {
        report_tail();
        break;
      }
      try {
        append_record(input_.at(offset_, parts_.bytes()), chunk);
      } catch (const FileError&) {
        if (rows == 0) throw;
        break;  // the next call encounters it again
      }
      offset_ += parts_.bytes();
    }
    return chunk.observations.size() > 0 || !chunk.imu.empty();
  }

  double fraction_read() const override {
    return static_cast<double>(offset_) / static_cast<double>(input_.size());
  }

 private:
  [[noreturn]] void fail(std::uint64_t offset, const std::string& problem) const {
    throw FileError(input_.path(), {offset, {}}, problem);
  }

  OpenpylivoxLayout read_layout() {
    if (input_.size() < kHeaderBytes) {
      fail(input_.size(),
           fmt::format("expected a header of {} bytes, found the end of the file", kHeaderBytes));
    }
    const std::uint8_t* const bytes = input_.at(0, kHeaderBytes);
    const std::string_view head(reinterpret_cast<const char*>(bytes), kHeaderBytes);
    if (!head.starts_with(kBinSignature)) fail(0, fmt::format("expected {}", kBinSignature));
    OpenpylivoxLayout layout;
    layout.imu = head == kImuSignature;
    if (layout.imu) return layout;
    layout.firmware_type = load<std::int16_t>(bytes + 11);
    layout.data_type = load<std::int16_t>(bytes + 13);
    if (layout.firmware_type < 1 || layout.firmware_type > 3) {
      fail(11, fmt::format("expected a firmware type in [1, 3], found {}", layout.firmware_type));
    }
    const int most = layout.firmware_type == 1 ? 5 : 1;
    if (layout.data_type < 0 || layout.data_type > most) {
      fail(13, fmt::format("expected a data type in [0, {}] with firmware type {}, found {}", most,
                           layout.firmware_type, layout.data_type));
    }
    return layout;
  }

  void append_record(const std::uint8_t* bytes, Chunk& chunk) const {
    try {
      decode_record(bytes, chunk);
    } catch (const BadPacket& bad) {
      fail(offset_ + bad.byte_offset(), bad.problem());
    }
  }

  void decode_record(const std::uint8_t* bytes, Chunk& chunk) const {
    const std::span record(bytes, parts_.points.bytes_per_record);
    const double seconds = load<double>(bytes + parts_.time_at);
    const auto time_ns = io::nanoseconds_from_seconds(seconds);
    if (!time_ns) {
      fail(offset_ + parts_.time_at,
           fmt::format("expected a time within +-9.2e9 s, found {}", seconds));
    }
    if (layout_.imu) {
      chunk.imu.push_back(decode_imu(record));
      chunk.imu.back().time_ns = *time_ns;
      return;
    }
    const int return_number = parts_.return_digit ? bytes[parts_.bytes() - 1] - '0' : 1;
    if (return_number < 1 || return_number > layout_.returns_per_shot()) {
      fail(offset_ + parts_.bytes() - 1,
           fmt::format("expected a return number in '1' to '{}', found byte 0x{:02x}",
                       layout_.returns_per_shot(), bytes[parts_.bytes() - 1]));
    }
    auto& rows = chunk.observations;
    decode_records(parts_.points, record, *time_ns, kGrid100kHz, 0, rows);
    if (parts_.return_digit) {
      rows.return_number.back() = static_cast<std::uint8_t>(return_number);
    }
  }

  void report_tail() {
    if (offset_ == input_.size() || tail_reported_) return;
    tail_reported_ = true;
    warnings_.push_back(
        {kWarning.cut_off,
         fmt::format("the last record is cut off: expected {} bytes, found {}; it was ignored",
                     parts_.bytes(), input_.size() - offset_),
         {offset_, {}},
         1});
  }

  io::BlockInput input_;
  OpenpylivoxLayout layout_;
  RecordParts parts_;
  std::uint64_t offset_ = kHeaderBytes;
  bool tail_reported_ = false;
};

}  // namespace

const Format kOpenpylivoxBinFormat = {
    kOpenpylivoxBinName,
    ".bin",
    "openpylivox binary capture: points with intensity and time",
    [](std::string_view head) { return head.starts_with(kBinSignature); },
    open_with<OpenpylivoxBinReader>,
};

}  // namespace risley::recordings
