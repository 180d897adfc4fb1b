// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The fields of one serialised message, taken from the front. Both kinds of serialisation use the
// same member names, so that a decoder can be written once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "risley/bags/bag.hpp"
#include "risley/io/little_endian.hpp"

namespace risley::bags {

/// Checks that a sequence fits into the rest of its message. @throws BadMessage
void require_room(std::string_view what, std::uint64_t count, std::size_t bytes_each,
                  std::size_t bytes_left);

/// A message as ROS 1 serialises it: little-endian, without padding.
class Ros1Fields {
 public:
  explicit Ros1Fields(std::span<const std::uint8_t> bytes) : left_(bytes) {}

  std::size_t left() const { return left_.size(); }  ///< bytes that have not been read yet

  /// @param what  describes the elements in these bytes, for the message  @throws BadMessage
  std::span<const std::uint8_t> take(std::size_t count, std::string_view what) {
    require_room(what, count, 1, left());
    const auto taken = left_.first(count);
    left_ = left_.subspan(count);
    return taken;
  }

  /// @throws BadMessage
  template <class T>
  T number(std::string_view what) {
    if (left() < sizeof(T)) {
      throw BadMessage{fmt::format("expected {} bytes of {}, found {}", sizeof(T), what, left())};
    }
    return io::load<T>(take(sizeof(T), what).data());
  }

  /// @throws BadMessage
  std::string text(std::string_view what) {
    const auto bytes = take(number<std::uint32_t>(what), what);
    return {bytes.begin(), bytes.end()};
  }

  /// Length of a sequence whose elements have at least this many bytes. @throws BadMessage
  std::uint32_t length(std::string_view what, std::size_t bytes_each) {
    const auto count = number<std::uint32_t>("the length of the " + std::string(what));
    require_room(what, count, bytes_each, left());
    return count;
  }

  /// Bytes from one element of a sequence to the next.
  static std::size_t step(std::size_t bytes, std::size_t) { return bytes; }
  bool big_endian() const { return false; }  ///< never

  /// @throws BadMessage
  void require_end() const {
    if (left() > 0) {
      throw BadMessage{fmt::format("expected the end of the message, found {} more bytes", left())};
    }
  }

 private:
  std::span<const std::uint8_t> left_;
};

/// A message as ROS 2 serialises it: plain CDR, of either order of bytes.
class CdrFields {
 public:
  /// @throws BadMessage without the marks of plain CDR
  explicit CdrFields(std::span<const std::uint8_t> bytes);
  ~CdrFields();
  CdrFields(const CdrFields&) = delete;
  CdrFields& operator=(const CdrFields&) = delete;

  std::size_t left() const;  ///< bytes that have not been read yet

  /// For integers of 8 to 64 bits, float and double. @throws BadMessage
  template <class T>
  T number(std::string_view what = {});

  /// @throws BadMessage
  std::string text(std::string_view what = {});

  /// Length of a sequence whose elements have at least this many bytes. @throws BadMessage
  std::uint32_t length(std::string_view what, std::size_t bytes_each);

  /// @param what  describes the elements in these bytes, for the message  @throws BadMessage
  std::span<const std::uint8_t> take(std::size_t count, std::string_view what);

  /// Bytes from one element of a sequence to the next; the first number determines the size.
  static std::size_t step(std::size_t bytes, std::size_t alignment) {
    return (bytes + alignment - 1) / alignment * alignment;
  }
  bool big_endian() const;  ///< as the message says

  /// Nothing: CDR may end with padding.
  void require_end() const {}

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// std_msgs Header: its stamp, not yet checked, and the name of the frame.
struct Header {
  std::int64_t seconds = 0;
  std::uint32_t nanoseconds = 0;
  std::string frame;
  std::uint32_t sequence = 0;  ///< of ROS 1
};

/// @throws BadMessage
Header take_header(Ros1Fields& fields);
/// @throws BadMessage
Header take_header(CdrFields& fields);

/// A time of a message, ns. @throws BadMessage when it is beyond the year 2200
std::int64_t message_time(std::uint64_t time_ns);
/// @throws BadMessage also when the time is negative
std::int64_t message_time(std::int64_t seconds, std::uint32_t nanoseconds);
/// The stamp of a header. @throws BadMessage as message_time
std::int64_t message_time(const Header& header);

}  // namespace risley::bags
