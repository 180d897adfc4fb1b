// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "risley/core/error.hpp"
#include "risley/io/block_file.hpp"
#include "risley/recordings/livox/packet_decoder.hpp"
#include "risley/recordings/reader.hpp"

namespace risley::recordings {

/// The first 24 bytes of every LVX file: 16 bytes of name, 4 of version, 4 of magic code.
inline constexpr std::string_view kLvxName{"livox_tech\0\0\0\0\0\0", 16};
inline constexpr std::uint32_t kLvxMagicCode = 0xAC0EA767;
inline constexpr std::size_t kLvxPublicHeaderBytes = 24;

/// Before each package's records: the device index and the packet header.
inline constexpr std::size_t kLvxPackageHeaderBytes = 1 + livox::kPacketHeaderBytes;

/// Positions of the fields in a frame header: its own position, that of the next frame, and its
/// number.
inline constexpr std::size_t kLvxFrameNextAt = 8, kLvxFrameIndexAt = 16;

/// Differences between the versions of LVX.
struct LvxVersion {
  std::uint64_t first_frame = 0;  ///< byte offset
  std::size_t frame_header_bytes = 24;
  bool float_points = false;  ///< LVX 1.0: data type 0 holds floats in metres
};

/// Bytes of a file's header. @throws FileError that names the missing part when it is truncated
const std::uint8_t* lvx_header_bytes(io::BlockInput& file, std::uint64_t offset, std::size_t count,
                                     std::string_view part);

/// Text of a field padded with NUL.
std::string lvx_text(const std::uint8_t* bytes, std::size_t count);

/// Checks name and magic code, and returns the four version bytes. @throws FileError
std::array<std::uint8_t, 4> lvx_version(io::BlockInput& file);

/// Reads the device table. @throws FileError when it is empty, truncated or names a device twice
std::vector<Device> read_lvx_devices(io::BlockInput& file, std::uint64_t offset, std::size_t count,
                                     bool has_extrinsic_flag);

/// Reads the frames of any LVX file. The packages in them differ.
class LvxFrameReader : public Reader {
 public:
  bool read(Chunk& chunk, std::size_t max_rows) final;
  double fraction_read() const final;

 protected:
  /// @param first_frame  byte offset
  LvxFrameReader(io::BlockInput file, RecordingHeader header, std::uint64_t first_frame,
                 std::size_t frame_header_bytes);

  /// Back to the first frame, without warnings.
  void rewind_frames();
  /// Reads the package at position(), with this many bytes of its frame remaining, at least one.
  /// @return false if it must wait for the next chunk
  virtual bool read_package(Chunk& chunk, std::size_t max_rows, std::uint64_t left) = 0;
  /// The file has ended, or nothing more of it can be read: last warnings are given now.
  virtual void at_end() {}

  io::BlockInput& file() { return file_; }
  std::uint64_t position() const { return position_; }    ///< of the next package, or frame
  std::uint64_t frame_end() const { return frame_end_; }  ///< byte offset
  std::uint64_t frames() const { return frames_; }        ///< begun so far
  std::size_t rows() const { return rows_; }              ///< of the chunk that is being read
  /// Whether the current frame ends with the file.
  bool at_file_end() const { return frame_end_ == file_.size(); }
  /// Whether a package waits for the next chunk, because packages stay complete.
  bool has_to_wait(const Chunk& chunk, std::size_t max_rows, std::size_t more_rows) const {
    return !chunk.packets.empty() &&
           (rows_ + more_rows > max_rows || chunk.packets.size() >= max_rows);
  }
  /// A package of so many bytes was read, with so many rows.
  void pass_package(std::uint64_t bytes, std::size_t rows);
  /// The rest of the frame cannot be read.
  void skip_frame();
  /// The file was cut off within a package of this many records.
  void stop_at_cut(std::optional<std::size_t> records);
  /// Nothing after this damage can be read.
  void fail(std::uint64_t offset, std::string problem);

 private:
  void open_frame();
  bool next_package(Chunk& chunk, std::size_t max_rows);

  io::BlockInput file_;
  std::uint64_t first_frame_;
  std::size_t frame_header_bytes_;
  std::uint64_t position_ = 0;
  std::uint64_t frame_end_ = 0;
  std::uint64_t next_offset_ = 0;  // as stated in the frame header
  std::uint64_t frames_ = 0;
  std::size_t rows_ = 0;
  bool in_frame_ = false;
  bool open_ended_ = false;  // the frame header does not say where the frame ends
  bool ended_ = false, told_end_ = false;
  std::optional<FileError> failure_;
};

/// Reads the packages of LVX 1: packets of the first generation.
class LvxReader final : public LvxFrameReader {
 public:
  LvxReader(io::BlockInput file, RecordingHeader header, const LvxVersion& version);

 private:
  void describe();
  void rewind();
  bool read_package(Chunk& chunk, std::size_t max_rows, std::uint64_t left) override;
  void make_decoder(std::size_t device_row);
  void step_over(std::uint8_t data_type);

  bool float_points_;
  std::array<int, 256> device_rows_{};                 // by device index, -1 for none
  std::vector<std::optional<livox::ShotGrid>> grids_;  // by device row; empty: according to the
                                                       // types
  std::vector<livox::PacketDecoder> decoders_;         // by device row
  std::map<std::uint8_t, std::size_t> stepped_over_;   // data type -> its warning
  std::map<std::uint8_t, std::uint64_t> frames_stepped_over_;
};

}  // namespace risley::recordings
