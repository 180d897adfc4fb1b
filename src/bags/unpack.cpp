// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "bags/unpack.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <new>

#include <fmt/format.h>
#include <lz4frame.h>
#include <zstd.h>
#include <zstd_errors.h>

#include "risley/bags/bag.hpp"

namespace risley::bags {
namespace {

constexpr std::string_view kLz4 = "lz4", kZstd = "zstd";

struct FreeLz4 {
  void operator()(LZ4F_dctx* context) const { LZ4F_freeDecompressionContext(context); }
};
struct FreeZstd {
  void operator()(ZSTD_DCtx* context) const { ZSTD_freeDCtx(context); }
};

[[noreturn]] void fail_length(std::size_t expected, std::string_view found) {
  throw BadMessage{
      fmt::format("the packed block states {} bytes when unpacked, found {}", expected, found)};
}

}  // namespace

struct Unpacker::State {
  std::unique_ptr<LZ4F_dctx, FreeLz4> lz4;
  std::unique_ptr<ZSTD_DCtx, FreeZstd> zstd;

  /// Frames one after the other. @return number of bytes unpacked
  std::size_t unpack_lz4(std::span<const std::uint8_t> packed, std::span<std::uint8_t> room) {
    if (!lz4) {
      LZ4F_dctx* context = nullptr;
      if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION))) {
        throw std::bad_alloc();
      }
      lz4.reset(context);
    }
    LZ4F_resetDecompressionContext(lz4.get());
    std::size_t done = 0, more = 0;
    while (!packed.empty()) {
      std::size_t taken = packed.size(), made = room.size() - done;
      more = LZ4F_decompress(lz4.get(), room.data() + done, &made, packed.data(), &taken, nullptr);
      if (LZ4F_isError(more)) {
        throw BadMessage{
            fmt::format("the packed block cannot be unpacked by LZ4: {}", LZ4F_getErrorName(more))};
      }
      if (taken == 0 && made == 0) fail_length(room.size(), "more");
      packed = packed.subspan(taken);
      done += made;
    }
    // A frame that needs more may only have to return output that has no room.
    if (more != 0)
      fail_length(room.size(), done == room.size() ? "more" : "a frame without an end");
    return done;
  }

  std::size_t unpack_zstd(std::span<const std::uint8_t> packed, std::span<std::uint8_t> room) {
    if (!zstd) zstd.reset(ZSTD_createDCtx());
    if (!zstd) throw std::bad_alloc();
    const std::size_t made =
        ZSTD_decompressDCtx(zstd.get(), room.data(), room.size(), packed.data(), packed.size());
    if (!ZSTD_isError(made)) return made;
    if (ZSTD_getErrorCode(made) == ZSTD_error_dstSize_tooSmall) fail_length(room.size(), "more");
    throw BadMessage{fmt::format("the packed block cannot be unpacked by Zstandard: {}",
                                 ZSTD_getErrorName(made))};
  }
};

Unpacker::Unpacker() : state_(std::make_unique<State>()) {}
Unpacker::~Unpacker() = default;

std::uint64_t Unpacker::most_per_byte(std::string_view packing) {
  // A length of LZ4 grows by 255 with a byte; a block of Zstandard has 128 KiB at most and 4 bytes
  // at least.
  constexpr std::uint64_t kMostLz4 = 255, kMostZstd = 32'768;
  return packing == kLz4 ? kMostLz4 : packing == kZstd ? kMostZstd : 0;
}

void Unpacker::unpack(std::string_view packing, std::span<const std::uint8_t> packed,
                      std::span<std::uint8_t> room) {
  const std::size_t made =
      packing == kLz4 ? state_->unpack_lz4(packed, room) : state_->unpack_zstd(packed, room);
  if (made != room.size()) fail_length(room.size(), fmt::format("{}", made));
}

std::span<const std::uint8_t> Unpacker::message(std::span<const std::uint8_t> bytes) {
  constexpr std::array<std::uint8_t, 4> kZstdMark{0x28, 0xB5, 0x2F, 0xFD};
  constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 30;
  if (bytes.size() < kZstdMark.size() ||
      !std::equal(kZstdMark.begin(), kZstdMark.end(), bytes.begin())) {
    return bytes;
  }
  const unsigned long long size = ZSTD_getFrameContentSize(bytes.data(), bytes.size());
  if (size == ZSTD_CONTENTSIZE_UNKNOWN || size == ZSTD_CONTENTSIZE_ERROR || size > kMostBytes ||
      size > most_per_byte(kZstd) * bytes.size()) {
    throw BadMessage{
        fmt::format("is compressed (Zstandard): expected it to state its size, at most {} bytes",
                    std::min(kMostBytes, most_per_byte(kZstd) * bytes.size()))};
  }
  message_.resize(size);
  unpack(kZstd, bytes, message_);
  return message_;
}

}  // namespace risley::bags
