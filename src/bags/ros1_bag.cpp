// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Bags of ROS 1, version 2.0, read through rosbag_storage. That library trusts the lengths and
// positions in a file, so the structure is checked first. For this, compressed chunks are unpacked
// once more than for reading.
#include <algorithm>
#include <cstring>
#include <fstream>
#include <memory>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <rosbag/bag.h>
#include <rosbag/chunked_file.h>
#include <rosbag/view.h>

#include "risley/bags/bag.hpp"
#include "risley/core/error.hpp"
#include "risley/io/little_endian.hpp"

#include "bags/bag_kinds.hpp"
#include "bags/rosbag_call.hpp"
#include "bags/untouched_bytes.hpp"

namespace risley::bags {
namespace {

using io::load;

constexpr std::string_view kMend = "; the command `rosbag reindex` repairs it";

/// Deletes an object of rosbag_storage.
struct DeleteInRosbag {
  template <class T>
  void operator()(T* object) const {
    const RosbagCall call;
    delete object;
  }
};

/// What distinguishes topics.
struct TopicKey {
  std::string name, md5, type;

  bool is_of(const TopicKey& other) const { return name == other.name && md5 == other.md5; }
};

bool operator<(const TopicKey& a, const TopicKey& b) {
  return std::tie(a.name, a.md5, a.type) < std::tie(b.name, b.md5, b.type);
}

/// Topics of connections; a topic has one for every sending node.
std::vector<Topic> topics_of(std::vector<TopicKey> keys, std::vector<TopicKey>* kept = nullptr) {
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end(),
                         [](const TopicKey& a, const TopicKey& b) { return a.is_of(b); }),
             keys.end());
  std::vector<Topic> topics;
  topics.reserve(keys.size());
  for (const TopicKey& key : keys) topics.push_back(ros1_topic(key.name, key.type, key.md5));
  if (kept != nullptr) *kept = std::move(keys);
  return topics;
}

/// Checks that every record of a bag lies where the file and its index say.
class BagStructure {
 public:
  /// @throws FileError
  static void check(const io::InputFile& file, const Progress& progress) {
    BagStructure(file).check_records(progress);
  }

  /// The topics by the connections of the index. @throws FileError
  static std::vector<Topic> topics(const io::InputFile& file) {
    return BagStructure(file).index_topics();
  }

 private:
  enum Op : std::uint8_t {
    kMessageData = 2,
    kFileHeader = 3,
    kIndexData = 4,
    kChunk = 5,
    kChunkInfo = 6,
    kConnection = 7,
  };
  struct Record {
    std::uint64_t offset = 0, data = 0, end = 0;
    std::string header;
    std::uint8_t op = 0;

    std::uint64_t data_bytes() const { return end - data; }
  };
  explicit BagStructure(const io::InputFile& file)
      : path_(file.path()), file_(file), size_(file.size()) {}

  [[noreturn]] void fail(std::uint64_t offset, const std::string& problem) const {
    if (unpacked_.empty()) throw FileError(path_, {offset, {}}, problem);
    throw FileError(path_, {chunks_.back(), {}},
                    fmt::format("{}, at byte {} of the unpacked chunk", problem, offset));
  }
  [[noreturn]] void fail_cut(std::uint64_t offset) const {
    fail(offset,
         fmt::format(
             "the bag is cut off within the record that begins here, the file ends at byte {}{}",
             size_, kMend));
  }

  /// Reads from the file, or from the chunk that was unpacked.
  void read(std::uint64_t offset, char* bytes, std::size_t count) {
    if (!unpacked_.empty()) {
      std::copy_n(unpacked_.data() + offset, count, bytes);
      return;
    }
    if (file_.read(offset, bytes, count) < count) fail(offset, "cannot be read");
  }
  std::uint32_t read_u32(std::uint64_t offset) {
    std::uint32_t value = 0;
    read(offset, reinterpret_cast<char*>(&value), sizeof value);
    return value;
  }

  /// The record at an offset, which must end before the limit: that of the file or of a chunk.
  Record record_at(std::uint64_t offset, std::uint64_t limit) {
    constexpr std::uint32_t kLongestHeader = 1U << 20U;
    const auto leave = [&] {
      if (unpacked_.empty() && limit == size_) fail_cut(offset);
      fail(offset,
           fmt::format("a record does not fit into its chunk, which ends at byte {}", limit));
    };
    Record record;
    record.offset = offset;
    if (limit - offset < 8) leave();
    const std::uint32_t header_bytes = read_u32(offset);
    if (header_bytes > limit - offset - 8) leave();
    if (header_bytes > kLongestHeader) {
      fail(offset, fmt::format("expected a record header of at most {} bytes, found {}",
                               kLongestHeader, header_bytes));
    }
    record.header.resize(header_bytes);
    read(offset + 4, record.header.data(), header_bytes);
    record.data = offset + 8 + header_bytes;
    const std::uint32_t data_bytes = read_u32(record.data - 4);
    if (data_bytes > limit - record.data) leave();
    record.end = record.data + data_bytes;
    record.op = number<std::uint8_t>(record, "op");
    return record;
  }

  /// Calls visit(name, value) for the fields of a header, each of which follows its length.
  template <class Visit>
  void for_each_field(std::uint64_t offset, std::string_view header, Visit&& visit) const {
    while (!header.empty()) {
      std::uint32_t length = 0;
      if (header.size() >= sizeof length) std::memcpy(&length, header.data(), sizeof length);
      header.remove_prefix(std::min(header.size(), sizeof length));
      const std::string_view text = header.substr(0, length);
      const std::size_t equals = text.find('=');
      if (length == 0 || length > header.size() || equals == text.npos) {
        fail(offset, "expected fields NAME=VALUE in the header of a record, found something else");
      }
      header.remove_prefix(length);
      visit(text.substr(0, equals), text.substr(equals + 1));
    }
  }

  std::optional<std::string_view> field(const Record& record, std::string_view name) const {
    std::optional<std::string_view> found;
    for_each_field(record.offset, record.header,
                   [&](std::string_view field_name, std::string_view value) {
                     if (field_name == name) found = value;
                   });
    return found;
  }

  template <class T>
  T number(const Record& record, std::string_view name) const {
    const auto value = field(record, name);
    if (!value || value->size() != sizeof(T)) {
      fail(record.offset,
           fmt::format("expected a record with the field {} of {} bytes", name, sizeof(T)));
    }
    return load<T>(reinterpret_cast<const std::uint8_t*>(value->data()));
  }

  /// Positions of the records after the file's header, and of its index.
  struct Beginning {
    std::uint64_t records = 0, index = 0;
  };
  Beginning check_file_header() {
    const std::uint64_t first = kRos1Signature.size() + 1;
    if (size_ < first) fail_cut(0);
    const Record header = record_at(first, size_);
    if (header.op != kFileHeader) {
      fail(first,
           fmt::format("expected the file header (op {}), found op {}", +kFileHeader, header.op));
    }
    if (const auto encryptor = field(header, "encryptor"); encryptor && !encryptor->empty()) {
      fail(first, fmt::format("the bag is encrypted ({}), expected one that is not", *encryptor));
    }
    const auto index = number<std::uint64_t>(header, "index_pos");
    if (index == 0) {
      fail(first, fmt::format("the bag was not closed and has no index{}", kMend));
    }
    if (index > size_) {
      fail(size_, fmt::format("the bag is cut off: its index begins at byte {}, the file ends at "
                              "byte {}{}",
                              index, size_, kMend));
    }
    return {header.end, index};
  }

  /// The index begins with the connections.
  std::vector<Topic> index_topics() {
    std::vector<TopicKey> keys;
    for (std::uint64_t offset = check_file_header().index; offset < size_;) {
      const Record record = record_at(offset, size_);
      if (record.op != kConnection) break;
      keys.push_back(connection_of(record));
      offset = record.end;
    }
    return topics_of(std::move(keys));
  }

  TopicKey connection_of(const Record& record) {
    TopicKey key;
    key.name = std::string(field(record, "topic").value_or(""));
    std::string data(record.data_bytes(), '\0');
    read(record.data, data.data(), data.size());
    for_each_field(record.data, data, [&key](std::string_view name, std::string_view value) {
      if (name == "type") key.type = std::string(value);
      if (name == "md5sum") key.md5 = std::string(value);
    });
    return key;
  }

  void check_records(const Progress& progress) {
    const auto [first_record, index] = check_file_header();
    bool index_found = index == size_;
    for (std::uint64_t offset = first_record; offset < size_;) {
      progress.check();
      const Record record = record_at(offset, size_);
      index_found = index_found || offset == index;
      check_record(record);
      offset = record.end;
    }
    if (!index_found)
      fail(kRos1Signature.size() + 1,
           fmt::format("expected the index at byte {}, found no record there", index));
  }

  void check_record(const Record& record) {
    switch (record.op) {
      case kChunk:
        check_chunk(record);
        break;
      case kIndexData:
        check_index(record);
        break;
      case kChunkInfo: {
        require_entries(record, 8);
        const auto position = number<std::uint64_t>(record, "chunk_pos");
        if (!std::ranges::binary_search(chunks_, position)) {
          fail(record.offset,
               fmt::format("expected a chunk at byte {}, as the index says, found none", position));
        }
        break;
      }
      case kConnection:
        check_connection(record);
        break;
      default:
        fail(record.offset, fmt::format("expected a record of op 4 to 7, found {}", record.op));
    }
  }

  /// The data of a connection is one more header.
  void check_connection(const Record& record) {
    std::string data(record.data_bytes(), '\0');
    read(record.data, data.data(), data.size());
    for_each_field(record.data, data, [](std::string_view, std::string_view) {});
  }

  void check_chunk(const Record& record) {
    chunks_.push_back(record.offset);
    messages_.clear();
    const auto bytes = number<std::uint32_t>(record, "size");
    const std::string_view compression = field(record, "compression").value_or("");
    if (compression == "none") {
      if (bytes != record.data_bytes()) {
        fail(record.offset,
             fmt::format("expected a chunk of {} bytes, found {}", bytes, record.data_bytes()));
      }
      check_messages(record.data, record.end);
      return;
    }
    unpack(record, compression, bytes);
    if (bytes > 0) check_messages(0, bytes);
    unpacked_ = {};
  }

  void unpack(const Record& record, std::string_view compression, std::uint32_t bytes) {
    constexpr std::uint32_t kLargestChunk = 1U << 30U;
    if (compression != "bz2" && compression != "lz4") {
      fail(record.offset,
           fmt::format("expected the compression none, bz2 or lz4, found \"{}\"", compression));
    }
    if (bytes > kLargestChunk) {
      fail(record.offset,
           fmt::format("expected a chunk of at most {} bytes when unpacked, found {}",
                       kLargestChunk, bytes));
    }
    std::vector<std::uint8_t> packed(record.data_bytes());
    read(record.data, reinterpret_cast<char*>(packed.data()), packed.size());
    // Bytes that the compressed data do not fill stay zero and are not a record.
    UntouchedBytes unpacked(bytes);
    try {
      const RosbagCall call;
      rosbag::ChunkedFile().decompress(
          compression == "bz2" ? rosbag::compression::BZ2 : rosbag::compression::LZ4,
          unpacked.data(), bytes, packed.data(), static_cast<unsigned>(packed.size()));
    } catch (const std::exception& error) {
      fail(record.offset, fmt::format("the chunk cannot be unpacked: {}", error.what()));
    }
    unpacked_ = std::move(unpacked);
  }

  /// Checks the records inside a chunk and notes where messages begin.
  void check_messages(std::uint64_t begin, std::uint64_t end) {
    for (std::uint64_t offset = begin; offset < end;) {
      const Record record = record_at(offset, end);
      if (record.op == kMessageData) {
        messages_.push_back(static_cast<std::uint32_t>(offset - begin));
      } else if (record.op == kConnection) {
        check_connection(record);
      } else {
        fail(offset, fmt::format("expected a message or a connection in the chunk, found op {}",
                                 record.op));
      }
      offset = record.end;
    }
  }

  void require_entries(const Record& record, std::uint64_t bytes_each) const {
    const auto count = number<std::uint32_t>(record, "count");
    if (count * bytes_each == record.data_bytes()) return;
    fail(record.offset, fmt::format("expected {} entries of {} bytes, found {} bytes", count,
                                    bytes_each, record.data_bytes()));
  }

  void check_index(const Record& record) {
    constexpr std::size_t kEntryBytes = 12, kOffsetAt = 8;
    require_entries(record, kEntryBytes);
    if (chunks_.empty()) fail(record.offset, "an index of messages comes before the first chunk");
    std::vector<std::uint8_t> entries(record.data_bytes());
    read(record.data, reinterpret_cast<char*>(entries.data()), entries.size());
    for (std::size_t at = 0; at < entries.size(); at += kEntryBytes) {
      const auto offset = load<std::uint32_t>(entries.data() + at + kOffsetAt);
      if (!std::ranges::binary_search(messages_, offset)) {
        fail(
            record.data + at,
            fmt::format("expected a message at byte {} of the chunk, as the index says, found none",
                        offset));
      }
    }
  }

  std::string path_;
  io::InputFile file_;
  std::uint64_t size_ = 0;
  std::vector<std::uint64_t> chunks_;
  std::vector<std::uint32_t> messages_;  ///< where those of the last chunk begin in it
  UntouchedBytes unpacked_;              ///< a compressed chunk during the check
};

class Ros1Bag final : public Bag {
 public:
  Ros1Bag(const io::InputFile& file, const Progress& progress)
      : Bag(BagKind::ros1, file.path(), progress), file_(file) {
    BagStructure::check(file, progress_);
    guarded("be opened", [&] {
      bag_.reset(new rosbag::Bag);
      bag_->open(file.name_for_libraries(), rosbag::bagmode::Read);
      find_topics();
    });
  }

  void rewind(const std::vector<bool>& wanted) override {
    require_topics(wanted);
    guarded("be read", [&] {
      view_.reset(new rosbag::View(*bag_, [this, wanted](const rosbag::ConnectionInfo* connection) {
        return wanted[topic_of(connection->topic, connection->md5sum)];
      }));
      message_count_ = view_->size();
      position_ = view_->begin();
    });
    messages_read_ = 0;
    topic_messages_.assign(topics_.size(), 0);
  }

  bool next(Message& message) override {
    progress_.check();
    if (messages_read_ == message_count_) return false;
    const std::string where =
        fmt::format("be read after message {} of {}", messages_read_, message_count_);
    guarded(where.c_str(), [&] {
      if (messages_read_ > 0) ++position_;
      const rosbag::MessageInstance& instance = *position_;
      message.topic = topic_of(instance.getTopic(), instance.getMD5Sum());
      message.number = ++topic_messages_[message.topic];
      message.time_ns = message.publish_time_ns = instance.getTime().toNSec();
      bytes_.resize(instance.size());
      ros::serialization::OStream stream(bytes_.data(), instance.size());
      instance.write(stream);
    });
    ++messages_read_;
    message.bytes = bytes_;
    return true;
  }

  double fraction_read() const override {
    return message_count_ == 0 ? 1.0 : static_cast<double>(messages_read_) / message_count_;
  }

 private:
  /// Calls a function of rosbag_storage, whose exceptions have many types.
  template <class Function>
  void guarded(const char* what, Function&& function) const {
    const RosbagCall call;
    try {
      function();
    } catch (const FileError&) {
      throw;
    } catch (const rosbag::BagUnindexedException&) {
      fail(fmt::format("the bag has no index{}", kMend));
    } catch (const std::exception& error) {
      fail(fmt::format("the bag cannot {}: {}", what, error.what()));
    }
  }

  void find_topics() {
    rosbag::View all(*bag_);
    std::vector<TopicKey> connections;
    for (const rosbag::ConnectionInfo* connection : all.getConnections()) {
      connections.push_back({connection->topic, connection->md5sum, connection->datatype});
    }
    topics_ = topics_of(std::move(connections), &known_);
    for (const rosbag::ConnectionInfo* connection : all.getConnections()) {
      StoredTopic& stored = topics_[topic_of(connection->topic, connection->md5sum)].stored;
      stored.type = connection->datatype;
      stored.md5 = connection->md5sum;
      stored.definition_format = "ros1msg";
      stored.definition = connection->msg_def;
      stored.details.clear();
      for (const auto& [name, value] : *connection->header) {
        if (name == "callerid" || name == "latching") stored.details.emplace_back(name, value);
      }
    }
  }

  std::size_t topic_of(const std::string& name, const std::string& md5) const {
    const auto found = std::lower_bound(known_.begin(), known_.end(), TopicKey{name, md5, {}});
    return static_cast<std::size_t>(found - known_.begin());
  }

  io::InputFile file_;  ///< open as long as the library reads it
  std::unique_ptr<rosbag::Bag, DeleteInRosbag> bag_;
  std::unique_ptr<rosbag::View, DeleteInRosbag> view_;
  rosbag::View::iterator position_;
  std::vector<TopicKey> known_;  ///< by topic, ascending
  std::uint32_t message_count_ = 0, messages_read_ = 0;
  std::vector<std::int64_t> topic_messages_;
  std::vector<std::uint8_t> bytes_;
};

}  // namespace

std::unique_ptr<Bag> open_ros1_bag(const io::InputFile& file, const Progress& progress) {
  return std::make_unique<Ros1Bag>(file, progress);
}

std::vector<Topic> list_ros1_topics(const io::InputFile& file) {
  return BagStructure::topics(file);
}

}  // namespace risley::bags
