// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "recordings/formats/las_header.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/io/little_endian.hpp"
#include "risley/io/seconds.hpp"

namespace risley::recordings::las {
namespace {

using io::load;

constexpr double kFinestScale = 1e-9, kCoarsestScale = 1.0, kLargestOffset = 1e9;
/// Bytes of the public header.
constexpr std::uint64_t kEncodingAt = 6, kVersionAt = 24, kSystemAt = 26, kSoftwareAt = 58,
                        kHeaderSizeAt = 94, kPointsAt = 96, kRecordCountAt = 100,
                        kRecordLengthAt = 105, kCountAt = 107, kScaleAt = 131, kOffsetAt = 155,
                        kWaveformsAt = 227, kExtendedAt = 235, kExtendedCountAt = 243,
                        kLargeCountAt = 247;
constexpr unsigned kInternalWaveforms = 2;  // of the global encoding

std::string text_at(const std::uint8_t* bytes, std::size_t length) {
  const std::string_view field(reinterpret_cast<const char*>(bytes), length);
  std::string text(field.substr(0, std::min(field.find('\0'), length)));
  while (text.ends_with(' ')) text.pop_back();
  return text;
}

constexpr std::size_t kUnknownLength = std::size_t{1} << 32;  // longer than any record

/// Bytes of the extra bytes covered by one description.
std::size_t bytes_described(const std::uint8_t* descriptor) {
  constexpr std::array<std::uint8_t, 10> kScalar{1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
  const std::uint8_t type = descriptor[2];
  if (type == 0) return descriptor[3];  // undocumented: the options are their number
  if (type > 30) return kUnknownLength;
  // 11 to 30 were arrays of two and three in early LAS 1.4.
  return kScalar[(type - 1U) % 10U] * ((type - 1U) / 10U + 1U);
}

class HeaderReader {
 public:
  HeaderReader(io::BlockInput& input, std::vector<Warning>& warnings)
      : input_(input), warnings_(warnings) {}

  PublicHeader read() {
    require_bytes(header_bytes(0));
    const std::uint8_t* const bytes = input_.at(0, header_bytes(0));
    if (text_at(bytes, 4) != "LASF")
      fail(0, "expected the file to begin with LASF, found other bytes");
    const int major = bytes[kVersionAt];
    header_.minor_version = bytes[kVersionAt + 1];
    if (major != 1 || header_.minor_version > 4) {
      fail(kVersionAt,
           fmt::format("expected LAS 1.0 to 1.4, found LAS {}.{}; other programs can write it as "
                       "LAS 1.4",
                       major, header_.minor_version));
    }
    header_.global_encoding = load<std::uint16_t>(bytes + kEncodingAt);
    header_.system_identifier = text_at(bytes + kSystemAt, 32);
    header_.generating_software = text_at(bytes + kSoftwareAt, 32);
    require_bytes(header_bytes(header_.minor_version));
    read_layout();
    read_coordinates();
    read_count();
    step_over_records();
    step_over_extended_records();
    return std::move(header_);
  }

 private:
  [[noreturn]] void fail(std::uint64_t offset, const std::string& problem) const {
    throw FileError(input_.path(), {offset, {}}, problem);
  }

  template <class T>
  T number(std::uint64_t offset) {
    return load<T>(input_.at(offset, sizeof(T)));
  }

  void require_bytes(std::size_t bytes) const {
    if (input_.size() >= bytes) return;
    fail(input_.size(),
         fmt::format("expected a LAS 1.{} header of {} bytes, found the end of the file",
                     header_.minor_version, bytes));
  }

  void read_layout() {
    const std::size_t least = header_bytes(header_.minor_version);
    header_size_ = number<std::uint16_t>(kHeaderSizeAt);
    if (header_size_ < least) {
      fail(kHeaderSizeAt, fmt::format("expected a header size of at least {} bytes, found {}",
                                      least, header_size_));
    }
    header_.points_at = number<std::uint32_t>(kPointsAt);
    if (header_.points_at < header_size_ || header_.points_at > input_.size()) {
      fail(kPointsAt, fmt::format("expected the points to begin between byte {}, the end of the "
                                  "header, and byte {}, the end of the file, found byte {}",
                                  header_size_, input_.size(), header_.points_at));
    }
    header_.points_end = input_.size();
    const auto format = number<std::uint8_t>(kPointFormatAt);
    header_.compressed = (format & kCompressionMark) != 0;
    header_.point_format = format & ~kCompressionMark;
    if (static_cast<std::size_t>(header_.point_format) >= kRecordBytes.size()) {
      fail(kPointFormatAt, fmt::format("expected a point format in [0, {}], found {}",
                                       kRecordBytes.size() - 1, header_.point_format));
    }
    header_.record_bytes = number<std::uint16_t>(kRecordLengthAt);
    const std::size_t base = kRecordBytes[static_cast<std::size_t>(header_.point_format)];
    if (header_.record_bytes < base) {
      fail(kRecordLengthAt,
           fmt::format("expected records of at least {} bytes in point format {}, found {}", base,
                       header_.point_format, header_.record_bytes));
    }
  }

  void read_coordinates() {
    constexpr std::string_view kAxes = "xyz";
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::uint64_t scale_at = kScaleAt + 8 * axis, offset_at = kOffsetAt + 8 * axis;
      const auto scale = header_.scale[axis] = number<double>(scale_at);
      if (!(scale >= kFinestScale && scale <= kCoarsestScale)) {
        fail(scale_at, fmt::format("expected a scale of {} in [{:g}, {:g}] m, found {}",
                                   kAxes[axis], kFinestScale, kCoarsestScale, scale));
      }
      const auto offset = header_.offset[axis] = number<double>(offset_at);
      if (!(std::abs(offset) <= kLargestOffset)) {
        fail(offset_at, fmt::format("expected an offset of {} within +-{:g} m, found {}",
                                    kAxes[axis], kLargestOffset, offset));
      }
    }
  }

  void read_count() {
    const std::uint64_t old_count = number<std::uint32_t>(kCountAt);
    header_.points = old_count;
    if (header_.minor_version < 4) return;
    const auto count = number<std::uint64_t>(kLargeCountAt);
    if (count == 0 && !is_modern(header_.point_format)) return;  // some fill in only the old one
    header_.points = count;
    if (old_count == 0 || old_count == count) return;
    warn(warnings_, kWarning.header_contradicted,
         "the header says {} points in its old counter and {} in that of LAS 1.4; the latter is "
         "used",
         old_count, count)
        .place.byte_offset = kCountAt;
  }

  void step_over_records() {
    const auto count = number<std::uint32_t>(kRecordCountAt);
    std::uint64_t at = header_size_;
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::uint64_t left = header_.points_at - at;
      const std::uint64_t length = left < kRecordHeaderBytes ? 0 : number<std::uint16_t>(at + 20);
      if (left < kRecordHeaderBytes + length) {
        fail(at, fmt::format("expected variable length record {} of {} to end before byte {}, "
                             "where the points begin; it has {} bytes",
                             i + 1, count, header_.points_at, kRecordHeaderBytes + length));
      }
      if (describes_extra_bytes(at)) find_extra_bytes(at + kRecordHeaderBytes, length);
      at += kRecordHeaderBytes + length;
    }
  }

  /// Finds the end of the points and descriptions of extra bytes after them. Points do not need
  /// these records: their defects are warnings.
  void step_over_extended_records() {
    if (header_.minor_version >= 3 && (header_.global_encoding & kInternalWaveforms) != 0) {
      end_points_at(number<std::uint64_t>(kWaveformsAt));
    }
    if (header_.minor_version < 4) return;
    const auto count = number<std::uint32_t>(kExtendedCountAt);
    if (count == 0) return;
    auto at = number<std::uint64_t>(kExtendedAt);
    end_points_at(at);
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::uint64_t left =
          at >= header_.points_at && at < input_.size() ? input_.size() - at : 0;
      const std::uint64_t length =
          left < kExtendedRecordHeaderBytes ? 0 : number<std::uint64_t>(at + 20);
      if (left < kExtendedRecordHeaderBytes || left - kExtendedRecordHeaderBytes < length) {
        warn(warnings_, kWarning.content_left_out,
             "extended record {} of {}, at byte {}, does not lie between the points and the end of "
             "the file; it and those after it were ignored",
             i + 1, count, at)
            .place.byte_offset = kExtendedAt;
        return;
      }
      if (describes_extra_bytes(at)) find_extra_bytes(at + kExtendedRecordHeaderBytes, length);
      at += kExtendedRecordHeaderBytes + length;
    }
  }

  void end_points_at(std::uint64_t offset) {
    if (offset >= header_.points_at) header_.points_end = std::min(header_.points_end, offset);
  }

  bool describes_extra_bytes(std::uint64_t at) {
    const std::uint8_t* const bytes = input_.at(at, 20);
    return text_at(bytes + 2, 16) == kSpecificationUser &&
           load<std::uint16_t>(bytes + 18) == kExtraBytesNumber;
  }

  void find_extra_bytes(std::uint64_t at, std::uint64_t length) {
    std::size_t place = kRecordBytes[static_cast<std::size_t>(header_.point_format)];
    for (; length >= kDescriptorBytes && place < header_.record_bytes; length -= kDescriptorBytes) {
      const std::uint8_t* const descriptor = input_.at(at, kDescriptorBytes);
      const std::size_t bytes = bytes_described(descriptor);
      if (place + bytes > header_.record_bytes) {
        warn(warnings_, kWarning.columns_unused,
             "the extra bytes described from here on lie beyond the end of the point records, "
             "which have {} bytes; they were ignored",
             header_.record_bytes)
            .place.byte_offset = at;
        return;
      }
      constexpr std::uint8_t kUint8 = 1;
      const std::string name = text_at(descriptor + 4, 32);
      if (descriptor[2] == kUint8 && name == kTagField) header_.tag_at = place;
      if (descriptor[2] == kUint8 && name == kBeamField) header_.beam_at = place;
      place += bytes;
      at += kDescriptorBytes;
    }
  }

  io::BlockInput& input_;
  std::vector<Warning>& warnings_;
  PublicHeader header_;
  std::uint64_t header_size_ = 0;
};

}  // namespace

std::optional<std::int64_t> utc_of_adjusted_gps(double seconds) {
  constexpr double kFarthest = 7e9;  // with the origin's 1.3e9 s well within 64 bits of ns
  if (!(std::abs(seconds) < kFarthest)) return std::nullopt;
  const std::int64_t gps_ns = *io::nanoseconds_from_seconds(seconds) + kGpsOrigin * kSecond;
  // The leap seconds of a UTC that is late by them are one too many for at most a few seconds.
  std::int64_t utc_ns = gps_ns - leap_seconds(gps_ns) * kSecond;
  utc_ns = gps_ns - leap_seconds(utc_ns) * kSecond;
  return utc_ns;
}

PublicHeader read_header(io::BlockInput& input, std::vector<Warning>& warnings) {
  return HeaderReader(input, warnings).read();
}

}  // namespace risley::recordings::las
