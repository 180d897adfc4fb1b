// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "recordings/formats/zip_archive.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>

#include <fmt/format.h>
#include <zlib.h>

#include "risley/core/error.hpp"
#include "risley/io/little_endian.hpp"

#include "recordings/formats/text_table.hpp"

namespace risley::recordings {
namespace {

using io::load;

constexpr std::uint32_t kEndSignature = 0x06054b50, kEnd64LocatorSignature = 0x07064b50,
                        kEnd64Signature = 0x06064b50, kEntrySignature = 0x02014b50,
                        kLocalSignature = 0x04034b50;
constexpr std::size_t kEndBytes = 22, kEnd64LocatorBytes = 20, kEnd64Bytes = 56, kEntryBytes = 46,
                      kLocalBytes = 30;
constexpr std::size_t kLongestComment = 65535;
constexpr std::uint64_t kMostMembers = 1000;
constexpr std::uint16_t kStored = 0, kDeflated = 8, kEncryptedFlag = 1, kZip64Field = 1;
/// Deflate expands by a factor of at most 1032.
constexpr std::uint64_t kMostExpansion = 1040;

class ZipDirectory {
 public:
  explicit ZipDirectory(const io::InputFile& file) : file_(file) {}

  std::vector<ZipMember> members() {
    const std::uint64_t end = find_end();
    const std::uint8_t* const record = file_.at(end, kEndBytes);
    std::uint64_t count = load<std::uint16_t>(record + 10),
                  offset = load<std::uint32_t>(record + 16);
    if (count == UINT16_MAX || offset == UINT32_MAX ||
        load<std::uint32_t>(record + 12) == UINT32_MAX) {
      read_end64(end, count, offset);
    }
    if (count > kMostMembers) {
      fail(end, fmt::format("expected at most {} members, found {}", kMostMembers, count));
    }
    std::vector<ZipMember> members;
    for (std::uint64_t i = 0; i < count; ++i) {
      if (auto member = read_entry(offset)) members.push_back(std::move(*member));
    }
    return members;
  }

 private:
  [[noreturn]] void fail(std::uint64_t offset, const std::string& problem) const {
    throw FileError(file_.path(), {offset, {}}, problem);
  }

  const std::uint8_t* bytes_at(std::uint64_t offset, std::size_t count, const char* what) {
    if (offset <= file_.size() && count <= file_.size() - offset) return file_.at(offset, count);
    fail(std::min(offset, file_.size()),
         fmt::format("expected {} bytes of {} at byte {}, found the end of the file", count, what,
                     offset));
  }

  std::uint64_t find_end() {
    const std::uint64_t size = file_.size();
    const auto tail =
        static_cast<std::size_t>(std::min<std::uint64_t>(size, kEndBytes + kLongestComment));
    const std::uint8_t* const bytes = file_.at(size - tail, tail);
    for (std::size_t back = kEndBytes; back <= tail; ++back) {
      const std::uint8_t* const record = bytes + (tail - back);
      if (load<std::uint32_t>(record) == kEndSignature &&
          load<std::uint16_t>(record + 20) + kEndBytes <= back) {
        return size - back;
      }
    }
    fail(size, "expected the directory of a zip file, found the end of the file: it was cut off");
  }

  void read_end64(std::uint64_t end, std::uint64_t& count, std::uint64_t& offset) {
    if (end < kEnd64LocatorBytes) return;
    const std::uint8_t* const locator = file_.at(end - kEnd64LocatorBytes, kEnd64LocatorBytes);
    if (load<std::uint32_t>(locator) != kEnd64LocatorSignature) return;
    const auto place = load<std::uint64_t>(locator + 8);
    const std::uint8_t* const record = bytes_at(place, kEnd64Bytes, "the zip64 directory");
    if (load<std::uint32_t>(record) != kEnd64Signature) {
      fail(place, "expected the end of a zip64 directory, found something else");
    }
    count = load<std::uint64_t>(record + 32);
    offset = load<std::uint64_t>(record + 48);
  }

  /// Reads one entry and moves to the next; folders are skipped.
  std::optional<ZipMember> read_entry(std::uint64_t& offset) {
    const std::uint64_t place = offset;
    const std::uint8_t* entry = bytes_at(place, kEntryBytes, "the zip directory");
    if (load<std::uint32_t>(entry) != kEntrySignature) {
      fail(place, "expected an entry of the zip directory, found something else");
    }
    const auto flags = load<std::uint16_t>(entry + 8);
    ZipMember member;
    member.method = load<std::uint16_t>(entry + 10);
    member.crc = load<std::uint32_t>(entry + 16);
    member.packed_bytes = load<std::uint32_t>(entry + 20);
    member.bytes = load<std::uint32_t>(entry + 24);
    const std::size_t name_bytes = load<std::uint16_t>(entry + 28),
                      extra_bytes = load<std::uint16_t>(entry + 30),
                      comment_bytes = load<std::uint16_t>(entry + 32);
    std::uint64_t local = load<std::uint32_t>(entry + 42);
    offset += kEntryBytes + name_bytes + extra_bytes + comment_bytes;
    entry = bytes_at(place, kEntryBytes + name_bytes + extra_bytes, "the zip directory");
    member.name.assign(reinterpret_cast<const char*>(entry + kEntryBytes), name_bytes);
    read_zip64({entry + kEntryBytes + name_bytes, extra_bytes}, member, local);
    if (member.name.ends_with('/')) return std::nullopt;
    const std::string name = printable(member.name);
    if ((flags & kEncryptedFlag) != 0) {
      fail(place, fmt::format("member {} is encrypted, expected one that is not", name));
    }
    if (member.method != kStored && member.method != kDeflated) {
      fail(place,
           fmt::format("member {} is compressed by method {}, expected 0 (stored) or 8 (deflated)",
                       name, member.method));
    }
    const std::uint8_t* const header = bytes_at(local, kLocalBytes, "a member's header");
    if (load<std::uint32_t>(header) != kLocalSignature) {
      fail(local, fmt::format("expected the header of member {}, found something else", name));
    }
    member.begin =
        local + kLocalBytes + load<std::uint16_t>(header + 26) + load<std::uint16_t>(header + 28);
    if (member.begin > file_.size() || member.packed_bytes > file_.size() - member.begin) {
      fail(local,
           fmt::format("expected {} compressed bytes of member {}, found the end of the file",
                       member.packed_bytes, name));
    }
    const bool stored = member.method == kStored;
    if (stored ? member.bytes != member.packed_bytes
               : member.bytes / kMostExpansion > member.packed_bytes) {
      fail(place,
           fmt::format("member {} claims to have {} bytes, more than {} compressed bytes can hold",
                       name, member.bytes, member.packed_bytes));
    }
    return member;
  }

  /// Sizes and offsets beyond 32 bits are in an extra field, as far as needed.
  static void read_zip64(std::span<const std::uint8_t> extra, ZipMember& member,
                         std::uint64_t& local) {
    constexpr std::size_t kFieldHeader = 4;
    while (extra.size() >= kFieldHeader) {
      const auto id = load<std::uint16_t>(extra.data());
      const std::size_t length = load<std::uint16_t>(extra.data() + 2);
      extra = extra.subspan(kFieldHeader);
      if (length > extra.size()) return;
      auto field = extra.first(length);
      extra = extra.subspan(length);
      if (id != kZip64Field) continue;
      for (std::uint64_t* const number : {&member.bytes, &member.packed_bytes, &local}) {
        if (*number != UINT32_MAX || field.size() < sizeof *number) continue;
        *number = load<std::uint64_t>(field.data());
        field = field.subspan(sizeof *number);
      }
    }
  }

  io::BlockInput file_;
};

/// The bytes of a member, and at their end the check of the checksum.
class MemberSource final : public ByteSource {
 public:
  MemberSource(const io::InputFile& file, const ZipMember& member)
      : member_(member),
        packed_(file, member.begin, member.begin + member.packed_bytes),
        block_(member.method == kDeflated ? kBlockBytes : 0) {
    if (member.method == kDeflated && inflateInit2(&stream_, -MAX_WBITS) != Z_OK) {
      throw FileError(file.path(), {member.begin, {}},
                      "there is not enough memory to unpack a member");
    }
  }
  ~MemberSource() override {
    if (member_.method == kDeflated) inflateEnd(&stream_);
  }
  MemberSource(const MemberSource&) = delete;
  MemberSource& operator=(const MemberSource&) = delete;

  std::size_t read(std::uint8_t* bytes, std::size_t count) override {
    count = static_cast<std::size_t>(std::min<std::uint64_t>(count, member_.bytes - produced_));
    const std::size_t got =
        member_.method == kDeflated ? inflate_to(bytes, count) : packed_.read(bytes, count);
    if (got > 0) crc_ = static_cast<std::uint32_t>(crc32_z(crc_, bytes, got));
    produced_ += got;
    if (got < count && problem_.empty()) {
      problem_ = fmt::format("member {} ends after {} of {} bytes", printable(member_.name),
                             produced_, member_.bytes);
    }
    if (produced_ == member_.bytes && crc_ != member_.crc && problem_.empty()) {
      problem_ = fmt::format("the bytes of member {} have the checksum {:08x}, expected {:08x}",
                             printable(member_.name), crc_, member_.crc);
    }
    return got;
  }

  std::uint64_t file_offset() const override { return packed_.file_offset() - stream_.avail_in; }

 private:
  static constexpr std::size_t kBlockBytes = 16384;

  std::size_t inflate_to(std::uint8_t* bytes, std::size_t count) {
    std::size_t done = 0;
    while (done < count && problem_.empty()) {
      if (stream_.avail_in == 0) {
        stream_.next_in = block_.data();
        stream_.avail_in = static_cast<uInt>(packed_.read(block_.data(), block_.size()));
        if (stream_.avail_in == 0) break;
      }
      const std::size_t piece = std::min<std::size_t>(count - done, kBlockBytes);
      stream_.next_out = bytes + done;
      stream_.avail_out = static_cast<uInt>(piece);
      const int status = inflate(&stream_, Z_NO_FLUSH);
      done += piece - stream_.avail_out;
      if (status == Z_STREAM_END) break;
      if (status != Z_OK && status != Z_BUF_ERROR) {
        problem_ = fmt::format("member {} cannot be unpacked: {}", printable(member_.name),
                               stream_.msg != nullptr ? stream_.msg : "it is damaged");
      }
    }
    return done;
  }

  ZipMember member_;
  FileSource packed_;
  std::vector<std::uint8_t> block_;
  z_stream stream_{};
  std::uint64_t produced_ = 0;
  std::uint32_t crc_ = 0;
};

}  // namespace

std::vector<ZipMember> zip_members(const io::InputFile& file) {
  return ZipDirectory(file).members();
}

std::unique_ptr<ByteSource> open_member(const io::InputFile& file, const ZipMember& member,
                                        std::uint64_t offset) {
  auto source = std::make_unique<MemberSource>(file, member);
  source->skip(offset);
  return source;
}

}  // namespace risley::recordings
