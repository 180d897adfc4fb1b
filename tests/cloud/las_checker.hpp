// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>

/// A strict reader of LAS 1.4 (point format 6), from the ASPRS specification and not from the
/// writer: every rule that a file can be held to is checked.
namespace risley::cloud::las_checker {

struct Record {
  std::string user, description, data;
  int number = 0;
};

struct ExtraField {
  std::string name, description;
  int type = 0;            ///< of the specification's table: 1 is uint8, 9 is float
  std::size_t offset = 0;  ///< in the point record
};

struct Point {
  std::array<std::int32_t, 3> xyz{};
  std::uint16_t intensity = 0;
  int return_number = 0, number_of_returns = 0, classification = 0, user_data = 0;
  int scan_angle = 0, point_source = 0, scanner_channel = 0;
  double gps_time = 0;
  std::vector<std::uint8_t> bytes;  ///< the whole record
};

struct File {
  bool gps_time = false, wkt = false;
  std::string system_identifier, generating_software;
  int creation_day = 0, creation_year = 0;
  std::array<double, 3> scale{}, offset{}, low{}, high{};
  std::vector<std::uint64_t> points_by_return;
  std::vector<Record> records;
  std::vector<ExtraField> extra;
  std::vector<Point> points;

  const Record* record(const std::string& user, int number) const {
    for (const Record& record : records) {
      if (record.user == user && record.number == number) return &record;
    }
    return nullptr;
  }

  const ExtraField& field(const std::string& name) const {
    for (const ExtraField& field : extra) {
      if (field.name == name) return field;
    }
    throw std::runtime_error("no extra bytes named " + name);
  }

  float real(std::size_t point, const ExtraField& field) const {
    if (field.type != 9) throw std::runtime_error(field.name + " is no float");
    float value;
    std::memcpy(&value, &points[point].bytes[field.offset], sizeof value);
    return value;
  }

  int byte(std::size_t point, const ExtraField& field) const {
    if (field.type != 1) throw std::runtime_error(field.name + " is no uint8");
    return points[point].bytes[field.offset];
  }
};

/// Reads a file from its beginning and complains of what the specification forbids.
class Checker {
 public:
  explicit Checker(const std::string& path) {
    std::ifstream stream(path, std::ios::binary);
    require(stream.good(), "the file cannot be opened");
    bytes_.assign(std::istreambuf_iterator<char>(stream), {});
  }

  File check() {
    read_header();
    read_records();
    read_extra_bytes();
    read_points();
    check_summary();
    return std::move(file_);
  }

 private:
  static void require(bool fine, const std::string& problem) {
    if (!fine) throw std::runtime_error("LAS: " + problem);
  }

  template <class T>
  T number(std::size_t at) const {
    require(at + sizeof(T) <= bytes_.size(), fmt::format("the file ends before byte {}", at));
    T value;
    std::memcpy(&value, bytes_.data() + at, sizeof value);
    return value;
  }

  void require_zero(std::size_t from, std::size_t count, const char* what) const {
    for (std::size_t k = 0; k < count; ++k) {
      require(number<std::uint8_t>(from + k) == 0, fmt::format("{} is not zero", what));
    }
  }

  /// Printable ASCII, filled up with zeros.
  std::string text(std::size_t at, std::size_t length) const {
    require(at + length <= bytes_.size(), "the file ends in a text");
    std::string value(reinterpret_cast<const char*>(bytes_.data()) + at, length);
    const std::size_t end = std::min(value.find('\0'), length);
    for (std::size_t k = 0; k < length; ++k) {
      if (k < end) require(value[k] >= 0x20 && value[k] <= 0x7e, "a text is not printable");
      if (k >= end) require(value[k] == '\0', "a text is not filled up with zeros");
    }
    return value.substr(0, end);
  }

  void read_header() {
    require(bytes_.size() >= kHeaderBytes, "shorter than a header");
    require(std::memcmp(bytes_.data(), "LASF", 4) == 0, "wrong signature");
    require(number<std::uint8_t>(24) == 1, "major version");
    require(number<std::uint8_t>(25) == 4, "minor version");

    const int encoding = number<std::uint16_t>(6);
    file_.gps_time = (encoding & 1) != 0;
    file_.wkt = (encoding & 16) != 0;
    require((encoding & ~0x1f) == 0, "reserved bits of the global encoding");
    require((encoding & 0x0e) == 0, "waveforms or synthetic returns announced");
    require_zero(8, 16, "project ID");
    file_.system_identifier = text(26, 32);
    file_.generating_software = text(58, 32);
    require(!file_.system_identifier.empty(), "system identifier is empty");
    require(!file_.generating_software.empty(), "generating software is empty");

    file_.creation_day = number<std::uint16_t>(90);
    file_.creation_year = number<std::uint16_t>(92);
    const int year = file_.creation_year;
    const bool leap = (year % 4 == 0 && year % 100 != 0) || year % 400 == 0;
    require((file_.creation_day == 0) == (year == 0), "a creation day without year");
    require(file_.creation_day <= (leap ? 366 : 365), "creation day");

    require(number<std::uint16_t>(94) == kHeaderBytes, "header size");
    points_at_ = number<std::uint32_t>(96);
    record_count_ = number<std::uint32_t>(100);
    require(number<std::uint8_t>(104) == 6, "point format");
    record_bytes_ = number<std::uint16_t>(105);
    require(record_bytes_ >= kBaseBytes, "point record length");

    require_zero(107, 24, "legacy counts with point format 6");
    require_zero(227, 8, "start of waveforms");
    require_zero(235, 12, "extended variable length records");
    count_ = number<std::uint64_t>(247);
    for (std::size_t k = 0; k < 15; ++k) {
      file_.points_by_return.push_back(number<std::uint64_t>(255 + 8 * k));
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      file_.scale[axis] = number<double>(131 + 8 * axis);
      file_.offset[axis] = number<double>(155 + 8 * axis);
      file_.high[axis] = number<double>(179 + 16 * axis);
      file_.low[axis] = number<double>(187 + 16 * axis);
      require(std::isfinite(file_.scale[axis]) && file_.scale[axis] > 0, "scale");
      require(std::isfinite(file_.offset[axis]), "offset");
      require(std::isfinite(file_.low[axis]) && std::isfinite(file_.high[axis]), "bounding box");
      require(file_.low[axis] <= file_.high[axis], "bounding box is inside out");
    }
    require(points_at_ + count_ * record_bytes_ == bytes_.size(),
            "the points do not end where the file ends");
  }

  void read_records() {
    std::size_t at = kHeaderBytes;
    std::set<std::pair<std::string, int>> seen;
    for (std::uint32_t k = 0; k < record_count_; ++k) {
      require(at + 54 <= points_at_, "a record reaches into the points");
      Record record;
      require_zero(at, 2, "reserved of a record");
      record.user = text(at + 2, 16);
      record.number = number<std::uint16_t>(at + 18);
      const std::size_t length = number<std::uint16_t>(at + 20);
      record.description = text(at + 22, 32);
      at += 54;
      require(at + length <= points_at_, "a record reaches into the points");
      record.data.assign(reinterpret_cast<const char*>(bytes_.data()) + at, length);
      at += length;
      require(seen.insert({record.user, record.number}).second, "a record stands twice");
      file_.records.push_back(std::move(record));
    }
    require(at == points_at_, "bytes between the last record and the points");

    const Record* wkt = file_.record("LASF_Projection", 2112);
    require(file_.wkt && wkt != nullptr, "point format 6 needs WKT");
    require(wkt->data.size() > 1 && wkt->data.find('\0') == wkt->data.size() - 1,
            "WKT does not end with its only zero");
    check_brackets(wkt->data);
  }

  static void check_brackets(const std::string& wkt) {
    int depth = 0;
    bool quoted = false;
    for (const char c : wkt) {
      if (c == '"') quoted = !quoted;
      if (quoted) continue;
      if (c == '[') ++depth;
      if (c == ']') --depth;
      require(depth >= 0, "WKT closes more than it opens");
    }
    require(depth == 0 && !quoted, "WKT does not close what it opens");
  }

  void read_extra_bytes() {
    const Record* record = file_.record("LASF_Spec", 4);
    std::size_t offset = kBaseBytes;
    if (record != nullptr) {
      require(record->data.size() % 192 == 0 && !record->data.empty(), "length of extra bytes");
      // The record was copied from there; text() and number() look into the file.
      const auto found = std::search(
          bytes_.begin() + kHeaderBytes, bytes_.end(), record->data.begin(), record->data.end(),
          [](std::uint8_t a, char b) { return a == static_cast<std::uint8_t>(b); });
      auto at = static_cast<std::size_t>(found - bytes_.begin());
      std::set<std::string> names;
      for (std::size_t k = 0; k < record->data.size() / 192; ++k, at += 192) {
        constexpr std::size_t kBytes[] = {0, 1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
        ExtraField field;
        require_zero(at, 2, "reserved of extra bytes");
        field.type = number<std::uint8_t>(at + 2);
        require(field.type >= 1 && field.type <= 10, "data type of extra bytes");
        require_zero(at + 3, 1, "options of extra bytes");
        field.name = text(at + 4, 32);
        require(!field.name.empty() && names.insert(field.name).second, "name of extra bytes");
        require_zero(at + 36, 4, "unused of extra bytes");
        require_zero(at + 40, 120, "numbers that no option of extra bytes announces");
        field.description = text(at + 160, 32);
        field.offset = offset;
        offset += kBytes[field.type];
        file_.extra.push_back(std::move(field));
      }
    }
    require(offset == record_bytes_, "record length is not that of its fields");
  }

  void read_points() {
    for (std::uint64_t k = 0; k < count_; ++k) {
      const std::size_t at = points_at_ + k * record_bytes_;
      Point point;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        point.xyz[axis] = number<std::int32_t>(at + 4 * axis);
      }
      point.intensity = number<std::uint16_t>(at + 12);
      const int bits = number<std::uint8_t>(at + 14);
      point.return_number = bits & 15;
      point.number_of_returns = bits >> 4;
      const int flags = number<std::uint8_t>(at + 15);
      require((flags & 0x0f) == 0, "classification flags");
      point.scanner_channel = (flags >> 4) & 3;
      require((flags & 0xc0) == 0, "scan direction or edge of flight line");
      point.classification = number<std::uint8_t>(at + 16);
      point.user_data = number<std::uint8_t>(at + 17);
      point.scan_angle = number<std::int16_t>(at + 18);
      require(std::abs(point.scan_angle) <= 30000, "scan angle");
      point.point_source = number<std::uint16_t>(at + 20);
      point.gps_time = number<double>(at + 22);
      require(std::isfinite(point.gps_time), "GPS time");
      require(point.number_of_returns >= 1, "number of returns");
      require(point.return_number >= 1 && point.return_number <= point.number_of_returns,
              "return number");
      point.bytes.assign(bytes_.begin() + at, bytes_.begin() + (at + record_bytes_));
      file_.points.push_back(std::move(point));
    }
  }

  void check_summary() const {
    std::vector<std::uint64_t> by_return(file_.points_by_return.size());
    std::array<std::int32_t, 3> low{}, high{};
    if (!file_.points.empty()) low = high = file_.points[0].xyz;
    for (const Point& point : file_.points) {
      ++by_return[static_cast<std::size_t>(point.return_number) - 1];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        low[axis] = std::min(low[axis], point.xyz[axis]);
        high[axis] = std::max(high[axis], point.xyz[axis]);
      }
    }
    require(by_return == file_.points_by_return, "number of points by return");
    for (std::size_t axis = 0; axis < 3; ++axis) {
      require(file_.low[axis] == low[axis] * file_.scale[axis] + file_.offset[axis] &&
                  file_.high[axis] == high[axis] * file_.scale[axis] + file_.offset[axis],
              "the bounding box is not that of the points");
      require(!std::signbit(file_.low[axis]) || file_.low[axis] < 0, "negative zero");
    }
  }

  std::vector<std::uint8_t> bytes_;
  File file_;
  static constexpr std::size_t kHeaderBytes = 375, kBaseBytes = 30;
  std::size_t points_at_ = 0, record_bytes_ = 0;
  std::uint32_t record_count_ = 0;
  std::uint64_t count_ = 0;
};

/// @throws std::runtime_error that names the rule which the file breaks
inline File read(const std::string& path) { return Checker(path).check(); }

}  // namespace risley::cloud::las_checker
