// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "risley/core/error.hpp"
#include "risley/io/block_file.hpp"
#include "risley/wire/address.hpp"

struct pcap;

namespace risley::recordings {

/// Whether a file with this beginning is a capture: pcap in any byte order, or pcapng.
bool is_capture(std::string_view head);

/// A captured UDP datagram.
struct CapturedDatagram {
  wire::Endpoint from;
  std::span<const std::uint8_t> bytes;  ///< its data, until the next call
  std::size_t length = 0;               ///< of the data as sent; if larger than bytes, they are
                                        ///< truncated
  std::int64_t time_ns = 0;             ///< when it was captured, ns since 1970
  std::uint64_t offset = 0;             ///< in the file, of its record
};

/// Reads the UDP datagrams of a capture, from libpcap's records. Everything else is stepped over.
class CaptureFile {
 public:
  /// @throws FileError when it is not a capture, truncated in its header, or of a link type that is
  /// not Ethernet, Linux cooked (SLL, SLL2), raw IP or loopback
  explicit CaptureFile(const io::InputFile& file);

  const std::string& path() const { return path_; }  ///< as it was given
  /// @return the next datagram; empty at the end of a complete file
  /// @throws FileError at a record that is truncated or damaged, with its place; then nothing
  /// follows
  std::optional<CapturedDatagram> next();

  /// Fragments of UDP datagrams split by IP, which are ignored.
  std::uint64_t fragments() const { return fragments_; }
  std::uint32_t snap_length() const { return snap_length_; }  ///< most bytes kept of a packet
  double fraction_read() const;                               ///< of the file, [0, 1]

 private:
  struct Close {
    void operator()(pcap* capture) const;
  };

  std::string path_;
  std::unique_ptr<pcap, Close> capture_;
  int link_type_ = 0;
  std::uint64_t size_ = 0, position_ = 0, fragments_ = 0;
  std::uint32_t snap_length_ = 0;
};

}  // namespace risley::recordings
