// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <utility>
#include <vector>

/// LAS files made byte by byte, from the ASPRS specifications and not from the reader or writer.
namespace risley::recordings::las_bytes {

template <class T>
void put(std::string& bytes, std::size_t at, std::type_identity_t<T> value) {
  if (bytes.size() < at + sizeof(T)) bytes.resize(at + sizeof(T));
  std::memcpy(bytes.data() + at, &value, sizeof(T));
}

/// @param bytes  long enough for it
inline void put_text(std::string& bytes, std::size_t at, const std::string& text) {
  std::copy(text.begin(), text.end(), bytes.begin() + static_cast<std::ptrdiff_t>(at));
}

struct LasPoint {
  std::array<std::int32_t, 3> xyz{};
  double gps_time = 0;
  std::uint16_t intensity = 0;
  unsigned return_number = 1, returns = 1, channel = 0;
  std::string extra = {};
};

/// A variable length record, or an extended one.
struct Record {
  std::string user;
  std::uint16_t number = 0;
  std::string data;
};

/// One description of extra bytes.
inline std::string descriptor(const std::string& name, std::uint8_t type,
                              std::uint8_t options = 0) {
  std::string bytes(192, '\0');
  bytes[2] = static_cast<char>(type);
  bytes[3] = static_cast<char>(options);
  put_text(bytes, 4, name);
  return bytes;
}

struct LasFile {
  int minor = 2, format = 1;
  unsigned encoding = 0;
  std::string system = "OTHER", software = "las_bytes";
  std::array<double, 3> scale{1e-3, 1e-3, 1e-3}, offset{};
  std::size_t extra_bytes = 0;
  std::vector<Record> records, extended;
  std::vector<LasPoint> points;
  std::size_t gap = 0;                     ///< bytes between the records and the points
  std::size_t longer_header = 0;           ///< bytes of the program's own
  std::optional<std::uint64_t> count;      ///< instead of the true one
  std::optional<std::uint32_t> old_count;  ///< of LAS 1.4; the true one up to point format 5

  static std::size_t base_bytes(int format) {
    constexpr std::size_t kBytes[] = {20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};
    return kBytes[format];
  }
  std::size_t record_bytes() const { return base_bytes(format) + extra_bytes; }
  std::size_t header_bytes() const {
    return (minor == 4 ? 375U : minor == 3 ? 235U : 227U) + longer_header;
  }
  std::size_t points_at() const {
    std::size_t at = header_bytes() + gap;
    for (const Record& record : records) at += 54 + record.data.size();
    return at;
  }

  std::string bytes() const {
    std::string out(header_bytes(), '\0');
    put_text(out, 0, "LASF");
    put<std::uint16_t>(out, 6, static_cast<std::uint16_t>(encoding));
    put<std::uint8_t>(out, 24, 1);
    put<std::uint8_t>(out, 25, static_cast<std::uint8_t>(minor));
    put_text(out, 26, system);
    put_text(out, 58, software);
    put<std::uint16_t>(out, 94, static_cast<std::uint16_t>(header_bytes()));
    put<std::uint32_t>(out, 96, static_cast<std::uint32_t>(points_at()));
    put<std::uint32_t>(out, 100, static_cast<std::uint32_t>(records.size()));
    put<std::uint8_t>(out, 104, static_cast<std::uint8_t>(format));
    put<std::uint16_t>(out, 105, static_cast<std::uint16_t>(record_bytes()));
    const std::uint64_t number = count.value_or(points.size());
    const auto small = static_cast<std::uint32_t>(number);
    put<std::uint32_t>(out, 107, old_count.value_or(format < 6 ? small : 0));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      put<double>(out, 131 + 8 * axis, scale[axis]);
      put<double>(out, 155 + 8 * axis, offset[axis]);
    }
    for (const Record& record : records) {
      std::string head(54, '\0');
      put_text(head, 2, record.user);
      put<std::uint16_t>(head, 18, record.number);
      put<std::uint16_t>(head, 20, static_cast<std::uint16_t>(record.data.size()));
      out += head + record.data;
    }
    out.append(gap, '\xDD');
    for (const LasPoint& point : points) out += record_of(point);
    if (minor == 4) {
      put<std::uint64_t>(out, 235, extended.empty() ? 0 : out.size());
      put<std::uint32_t>(out, 243, static_cast<std::uint32_t>(extended.size()));
      put<std::uint64_t>(out, 247, number);
    }
    for (const Record& record : extended) {
      std::string head(60, '\0');
      put_text(head, 2, record.user);
      put<std::uint16_t>(head, 18, record.number);
      put<std::uint64_t>(head, 20, record.data.size());
      out += head + record.data;
    }
    return out;
  }

  std::string record_of(const LasPoint& point) const {
    std::string out(record_bytes(), '\xAA');  // what is not read must not matter
    for (std::size_t axis = 0; axis < 3; ++axis) put<std::int32_t>(out, 4 * axis, point.xyz[axis]);
    put<std::uint16_t>(out, 12, point.intensity);
    if (format >= 6) {
      put<std::uint8_t>(out, 14,
                        static_cast<std::uint8_t>(point.return_number | point.returns << 4));
      put<std::uint8_t>(out, 15, static_cast<std::uint8_t>(0xC5 | point.channel << 4));
      put<double>(out, 22, point.gps_time);
    } else {
      put<std::uint8_t>(out, 14,
                        static_cast<std::uint8_t>(0xC0 | point.return_number | point.returns << 3));
      if (format != 0 && format != 2) put<double>(out, 20, point.gps_time);
    }
    put_text(out, base_bytes(format), point.extra);
    return out;
  }
};

}  // namespace risley::recordings::las_bytes
