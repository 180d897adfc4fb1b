// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "recordings/formats/capture_file.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <utility>

#include <fmt/format.h>
#include <pcap/pcap.h>

#include "risley/io/little_endian.hpp"

namespace risley::recordings {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::array kKnownLinks = {DLT_EN10MB, DLT_LINUX_SLL, DLT_LINUX_SLL2, DLT_RAW,
                                    DLT_IPV4,   DLT_NULL,      DLT_LOOP};
constexpr std::uint16_t kEtherIpv4 = 0x0800;
constexpr std::array<std::uint16_t, 3> kVlanTags = {0x8100, 0x88A8, 0x9100};
constexpr std::size_t kUdpHeaderBytes = 8;
constexpr std::uint8_t kUdp = 17;

/// A number in network byte order.
std::uint16_t network16(Bytes bytes, std::size_t at) {
  return static_cast<std::uint16_t>(bytes[at] << 8U | bytes[at + 1]);
}

/// The data after a protocol number, and after the tags of virtual networks; empty unless it is
/// IPv4.
Bytes behind_tags(Bytes bytes, std::size_t protocol_at, std::size_t header_bytes) {
  if (bytes.size() < header_bytes) return {};
  std::uint16_t protocol = network16(bytes, protocol_at);
  bytes = bytes.subspan(header_bytes);
  while (std::find(kVlanTags.begin(), kVlanTags.end(), protocol) != kVlanTags.end()) {
    constexpr std::size_t kTagBytes = 4;
    if (bytes.size() < kTagBytes) return {};
    protocol = network16(bytes, 2);
    bytes = bytes.subspan(kTagBytes);
  }
  return protocol == kEtherIpv4 ? bytes : Bytes{};
}

/// The IPv4 packet of a record; empty for anything else.
Bytes ip_of(int link_type, Bytes record) {
  constexpr std::size_t kFamilyBytes = 4;
  switch (link_type) {
    case DLT_EN10MB:
      return behind_tags(record, 12, 14);
    case DLT_LINUX_SLL:
      return behind_tags(record, 14, 16);
    case DLT_LINUX_SLL2:
      return behind_tags(record, 0, 20);
    case DLT_NULL:
    case DLT_LOOP: {
      if (record.size() < kFamilyBytes) return {};
      // In the byte order of the capturing machine, which may differ from this one's.
      constexpr std::uint32_t kInet = 2, kInetSwapped = 0x02000000;
      const auto family = io::load<std::uint32_t>(record.data());
      return family == kInet || family == kInetSwapped ? record.subspan(kFamilyBytes) : Bytes{};
    }
    default:
      return record;
  }
}

wire::Address address_at(Bytes bytes, std::size_t at) {
  return {{bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]}};
}

}  // namespace

bool is_capture(std::string_view head) {
  if (head.size() < 12) return false;
  std::array<std::uint32_t, 3> words{};
  std::memcpy(words.data(), head.data(), sizeof words);
  constexpr std::uint32_t kSectionHeader = 0x0A0D0D0A, kByteOrder = 0x1A2B3C4D,
                          kByteOrderSwapped = 0x4D3C2B1A;
  if (words[0] == kSectionHeader) return words[2] == kByteOrder || words[2] == kByteOrderSwapped;
  // Microseconds, nanoseconds, and records with other fields, each in both byte orders.
  constexpr std::array<std::uint32_t, 6> kMagics = {0xA1B2C3D4, 0xD4C3B2A1, 0xA1B23C4D,
                                                    0x4D3CB2A1, 0xA1B2CD34, 0x34CDB2A1};
  return std::find(kMagics.begin(), kMagics.end(), words[0]) != kMagics.end();
}

void CaptureFile::Close::operator()(pcap* capture) const { ::pcap_close(capture); }

CaptureFile::CaptureFile(const io::InputFile& input) : path_(input.path()), size_(input.size()) {
  std::array<char, PCAP_ERRBUF_SIZE> words{};
  std::FILE* file = std::fopen(input.name_for_libraries().c_str(), "rbe");
  if (file == nullptr) {
    throw FileError(path_, {}, fmt::format("cannot be read: {}", std::strerror(errno)));
  }
  capture_.reset(
      ::pcap_fopen_offline_with_tstamp_precision(file, PCAP_TSTAMP_PRECISION_NANO, words.data()));
  if (!capture_) {
    std::fclose(file);
    throw FileError(path_, {0, {}}, fmt::format("is no whole capture: {}", words.data()));
  }
  position_ = static_cast<std::uint64_t>(::ftello(file));
  snap_length_ = static_cast<std::uint32_t>(::pcap_snapshot(capture_.get()));
  link_type_ = ::pcap_datalink(capture_.get());
  if (std::find(kKnownLinks.begin(), kKnownLinks.end(), link_type_) == kKnownLinks.end()) {
    const char* name = ::pcap_datalink_val_to_name(link_type_);
    throw FileError(path_, {0, {}},
                    fmt::format("was captured at a link of the type {} ({}), allowed Ethernet, "
                                "Linux cooked, raw IP and loopback",
                                link_type_, name == nullptr ? "unknown" : name));
  }
}

std::optional<CapturedDatagram> CaptureFile::next() {
  for (;;) {
    CapturedDatagram datagram;
    datagram.offset = position_;
    pcap_pkthdr* record = nullptr;
    const u_char* data = nullptr;
    const int result = ::pcap_next_ex(capture_.get(), &record, &data);
    if (result == PCAP_ERROR_BREAK) {
      position_ = size_;
      return std::nullopt;
    }
    if (result != 1) {
      const std::string_view reason = ::pcap_geterr(capture_.get());
      // libpcap reads captures of several interfaces if all have one type of link.
      const bool mixed = reason.find("different from") != reason.npos;
      throw FileError(
          path_, {datagram.offset, {}},
          fmt::format("{}: {}{}",
                      mixed ? "the capture holds interfaces that cannot be read together"
                            : "the capture is cut off or damaged in the record that begins here",
                      reason,
                      mixed ? "; extract those of the sensor to a separate file, for example with "
                              "`tshark -r IN -Y \"frame.interface_id == 0\" -w OUT`"
                            : ""));
    }
    position_ = static_cast<std::uint64_t>(::ftello(::pcap_file(capture_.get())));
    constexpr std::int64_t kSecond = 1'000'000'000;
    // Damaged times stay within 64 bits.
    const std::int64_t seconds = std::clamp<std::int64_t>(record->ts.tv_sec, 0, 4 * kSecond);
    datagram.time_ns = seconds * kSecond + std::clamp<std::int64_t>(record->ts.tv_usec, 0, kSecond);

    const Bytes ip = ip_of(link_type_, {data, record->caplen});
    constexpr std::size_t kLeastIpBytes = 20, kLengthAt = 2, kFragmentAt = 6, kProtocolAt = 9,
                          kFromAt = 12;
    if (ip.size() < kLeastIpBytes || ip[0] >> 4U != 4 || ip[kProtocolAt] != kUdp) continue;
    const std::size_t ip_header_bytes = std::size_t{4} * (ip[0] & 0x0FU);
    constexpr unsigned kMoreOrOffset = 0x3FFF;
    if ((network16(ip, kFragmentAt) & kMoreOrOffset) != 0) {
      ++fragments_;
      continue;
    }
    if (ip_header_bytes < kLeastIpBytes || ip.size() < ip_header_bytes + kUdpHeaderBytes) continue;
    // A length of 0 is left for the network card to fill in.
    constexpr std::size_t kAnyLength = 0xFFFF;
    const std::size_t stated =
        network16(ip, kLengthAt) == 0 ? kAnyLength : std::size_t{network16(ip, kLengthAt)};
    if (stated < ip_header_bytes + kUdpHeaderBytes) continue;
    const Bytes udp = ip.first(std::min(ip.size(), stated)).subspan(ip_header_bytes);
    const std::size_t udp_bytes = network16(udp, 4);
    if (udp_bytes < kUdpHeaderBytes || ip_header_bytes + udp_bytes > stated) continue;
    datagram.from = {address_at(ip, kFromAt), network16(udp, 0)};
    datagram.length = udp_bytes - kUdpHeaderBytes;
    datagram.bytes = udp.first(std::min(udp.size(), udp_bytes)).subspan(kUdpHeaderBytes);
    return datagram;
  }
}

double CaptureFile::fraction_read() const {
  return size_ == 0 ? 1.0
                    : static_cast<double>(std::min(position_, size_)) / static_cast<double>(size_);
}

}  // namespace risley::recordings
