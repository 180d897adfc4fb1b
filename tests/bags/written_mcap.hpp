// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Files of MCAP for tests, written record by record.
#pragma once

#include <cstdint>
#include <fstream>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <lz4frame.h>
#include <zlib.h>
#include <zstd.h>

#include "bags/written_bags.hpp"

namespace risley::bags::written {

inline const std::string kMcapMagicBytes("\x89MCAP0\r\n", 8);

inline std::string mcap_record(std::uint8_t op, const std::string& content) {
  std::string bytes(1, static_cast<char>(op));
  put<std::uint64_t>(bytes, content.size());
  return bytes + content;
}

inline std::uint32_t mcap_checksum(const std::string& bytes) {
  return static_cast<std::uint32_t>(crc32(crc32(0, nullptr, 0),
                                          reinterpret_cast<const Bytef*>(bytes.data()),
                                          static_cast<uInt>(bytes.size())));
}

/// Bytes packed by "lz4" or "zstd", or as they are.
inline std::string mcap_packed(const std::string& bytes, const std::string& packing) {
  if (packing.empty()) return bytes;
  const bool lz4 = packing == "lz4";
  std::string packed(
      lz4 ? LZ4F_compressFrameBound(bytes.size(), nullptr) : ZSTD_compressBound(bytes.size()),
      '\0');
  const std::size_t size =
      lz4 ? LZ4F_compressFrame(packed.data(), packed.size(), bytes.data(), bytes.size(), nullptr)
          : ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), 1);
  EXPECT_LE(size, packed.size());
  packed.resize(size);
  return packed;
}

/// A chunk of these records.
inline std::string mcap_chunk(const std::string& records, const std::string& packing,
                              std::uint32_t checksum) {
  std::string content;
  put<std::uint64_t>(content, 0);
  put<std::uint64_t>(content, 0);
  put<std::uint64_t>(content, records.size());
  put<std::uint32_t>(content, checksum);
  put_text(content, packing);
  const std::string packed = mcap_packed(records, packing);
  put<std::uint64_t>(content, packed.size());
  return mcap_record(6, content + packed);
}

/// A file of these messages, one each 10 ms.
struct McapFile {
  struct Topic {
    std::string name, type, encoding = "cdr";
  };
  std::vector<Topic> topics;
  std::vector<std::pair<std::size_t, std::string>> messages;

  bool chunked = true;
  std::string packing;  ///< "", "lz4" or "zstd"
  std::size_t messages_per_chunk = 4;
  bool checksums = true;       ///< of chunks and of the summary
  bool data_checksum = false;  ///< of the whole data
  bool summary = true, statistics = true;
  bool strange_records = false;  ///< that readers step over, between the others

  McapFile() = default;
  /// The same topics and messages in another kind of bag.
  explicit McapFile(const Ros2BagFile& bag) : messages(bag.messages) {
    for (const Ros2BagFile::Topic& topic : bag.topics) {
      topics.push_back({topic.name, topic.type, topic.format});
    }
  }

  std::string schema(std::size_t topic) const {
    std::string content;
    put<std::uint16_t>(content, static_cast<std::uint16_t>(topic + 1));
    put_text(content, topics[topic].type);
    put_text(content, topics[topic].encoding == "ros1" ? "ros1msg" : "ros2msg");
    put_text(content, "its definition");
    return mcap_record(3, content);
  }
  std::string channel(std::size_t topic) const {
    std::string content, metadata;
    put<std::uint16_t>(content, static_cast<std::uint16_t>(topic + 10));
    put<std::uint16_t>(content, static_cast<std::uint16_t>(topic + 1));
    put_text(content, topics[topic].name);
    put_text(content, topics[topic].encoding);
    put_text(metadata, "offered_qos_profiles");
    put_text(metadata, "");
    put_text(content, metadata);
    return mcap_record(4, content);
  }
  std::string message(std::size_t number) const {
    std::string content;
    put<std::uint16_t>(content, static_cast<std::uint16_t>(messages[number].first + 10));
    put<std::uint32_t>(content, static_cast<std::uint32_t>(number));
    put<std::uint64_t>(content, kFirstStamp + number * 10'000'000);
    put<std::uint64_t>(content, kFirstStamp + number * 10'000'000);
    return mcap_record(5, content + messages[number].second);
  }

  /// As recorders write it: a topic is described in front of its first message.
  std::string bytes() const {
    std::string file = kMcapMagicBytes, content;
    put_text(content, "ros2");
    put_text(content, "a test");
    file += mcap_record(1, content);
    std::set<std::size_t> described;
    const std::size_t per_chunk = chunked ? messages_per_chunk : 1;
    std::uint32_t chunks = 0;
    for (std::size_t first = 0; first < messages.size(); first += per_chunk) {
      std::string records;
      for (std::size_t i = first; i < std::min(first + per_chunk, messages.size()); ++i) {
        if (described.insert(messages[i].first).second) {
          records += schema(messages[i].first) + channel(messages[i].first);
        }
        records += message(i);
        if (strange_records) records += mcap_record(0x93, "somebody's own");
      }
      if (chunked) {
        records = mcap_chunk(records, packing, checksums ? mcap_checksum(records) : 0);
        records += mcap_record(7, std::string("\x0A\0\0\0\0\0", 6));
        ++chunks;
      }
      file += records;
      if (strange_records) file += mcap_record(9, "an attachment") + mcap_record(0x40, "");
    }
    std::string end;
    put<std::uint32_t>(end, data_checksum ? mcap_checksum(file) : 0);
    file += mcap_record(15, end);
    std::string index;
    if (summary) {
      for (const std::size_t topic : described) index += schema(topic);
      for (const std::size_t topic : described) index += channel(topic);
    }
    if (summary && statistics) {
      content.clear();
      put<std::uint64_t>(content, messages.size());
      put<std::uint16_t>(content, static_cast<std::uint16_t>(described.size()));
      put<std::uint32_t>(content, static_cast<std::uint32_t>(described.size()));
      put<std::uint32_t>(content, 0);
      put<std::uint32_t>(content, 0);
      put<std::uint32_t>(content, chunks);
      put<std::uint64_t>(content, 0);
      put<std::uint64_t>(content, 0);
      put<std::uint32_t>(content, 0);
      index += mcap_record(11, content);
    }
    std::string footer;
    put<std::uint64_t>(footer, index.empty() ? 0 : file.size());
    put<std::uint64_t>(footer, 0);
    std::string covered = index + mcap_record(2, footer + "crc!");
    covered.resize(covered.size() - 4);
    put<std::uint32_t>(footer, checksums && !index.empty() ? mcap_checksum(covered) : 0);
    return file + index + mcap_record(2, footer) + kMcapMagicBytes;
  }

  void write(const std::string& path) const {
    const std::string all = bytes();
    std::ofstream stream(path, std::ios::binary | std::ios::trunc);
    stream.write(all.data(), static_cast<std::streamsize>(all.size()));
    EXPECT_TRUE(stream.good());
  }
};

}  // namespace risley::bags::written
