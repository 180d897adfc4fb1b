// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "risley/cloud/cloud_file.hpp"
#include "risley/core/error.hpp"
#include "risley/core/gps_time.hpp"
#include "risley/core/require.hpp"
#include "risley/core/setting.hpp"
#include "risley/io/little_endian.hpp"
#include "risley/recordings/las_numbers.hpp"

namespace risley::cloud {
namespace {

namespace spec = recordings::las;
using io::load;

constexpr std::size_t kHeaderBytes = spec::header_bytes(4);
/// Points that are read together.
constexpr std::size_t kBlockPoints = 4096;

std::string text_of(const std::uint8_t* bytes, std::size_t most) {
  const std::string_view all(reinterpret_cast<const char*>(bytes), most);
  return std::string(all.substr(0, all.find('\0')));
}

/// The numbers of "[1, 2, 3]", or of "1".
std::vector<double> numbers_of(std::string_view text) {
  std::vector<double> numbers;
  std::string plain(text);
  std::ranges::replace_if(
      plain, [](char c) { return c == '[' || c == ']' || c == ','; }, ' ');
  std::istringstream words(plain);
  words.imbue(std::locale::classic());
  for (double number = 0; words >> number;) numbers.push_back(number);
  return numbers;
}

/// Names and values of lines "name: value" or "name = value".
std::vector<std::pair<std::string, std::string>> lines_of(const std::string& body,
                                                          std::string_view between) {
  std::vector<std::pair<std::string, std::string>> lines;
  std::istringstream text(body.substr(0, body.find('\0')));
  for (std::string line; std::getline(text, line);) {
    const std::size_t at = line.find(between);
    if (at == std::string::npos) continue;
    lines.emplace_back(line.substr(0, at), line.substr(at + between.size()));
  }
  return lines;
}

}  // namespace

bool is_las_file(const std::string& path) {
  const io::InputFile file(path);
  char head[4]{};
  return file.read(0, head, sizeof head) == sizeof head && std::string_view(head, 4) == "LASF";
}

CloudFile::CloudFile(const std::string& path) : file_(path, "a cloud") { read_header(); }

void CloudFile::fail(std::uint64_t offset, const std::string& problem) const {
  throw FileError(path(), {offset, {}}, problem);
}

void CloudFile::read_header() {
  std::array<std::uint8_t, kHeaderBytes> head{};
  if (file_.read(0, head.data(), head.size()) < head.size() ||
      std::string_view(reinterpret_cast<const char*>(head.data()), 4) != "LASF") {
    fail(0, "is not a LAS 1.4 file written by risley cloud");
  }
  const std::uint8_t format = head[spec::kPointFormatAt];
  if ((format & spec::kCompressionMark) != 0) {
    fail(spec::kPointFormatAt, "is compressed: unpack it with laszip or PDAL, or make a .las");
  }
  if (head[25] != 4 || format != 6) {
    fail(spec::kPointFormatAt,
         fmt::format(
             "is LAS 1.{} with point format {}, expected 1.4 with 6, as risley cloud writes it",
             head[25], format));
  }
  constexpr unsigned kTimeMark = spec::kAdjustedGpsTime;
  gps_time_ = (load<std::uint16_t>(head.data() + 6) & kTimeMark) != 0;
  std::uint64_t at = load<std::uint16_t>(head.data() + 94);
  first_point_ = load<std::uint32_t>(head.data() + 96);
  const auto records = load<std::uint32_t>(head.data() + 100);
  record_bytes_ = load<std::uint16_t>(head.data() + 105);
  base_bytes_ = spec::kRecordBytes[format];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    scale_[axis] = load<double>(head.data() + 131 + 8 * axis);
    offset_[axis] = load<double>(head.data() + 155 + 8 * axis);
    if (!(scale_[axis] > 0) || !std::isfinite(offset_[axis])) {
      fail(131, "scales and offsets of the coordinates are invalid");
    }
  }
  const auto count = load<std::uint64_t>(head.data() + 247);
  if (record_bytes_ < base_bytes_ || first_point_ > file_.size() ||
      count > (file_.size() - first_point_) / record_bytes_) {
    fail(247, fmt::format("ends before the last of its {} points", count));
  }
  points_ = count;
  for (std::uint32_t i = 0; i < records; ++i) {
    std::array<std::uint8_t, spec::kRecordHeaderBytes> record{};
    if (at + record.size() > first_point_ ||
        file_.read(at, record.data(), record.size()) < record.size()) {
      fail(at, "a variable length record overlaps the points");
    }
    const auto bytes = load<std::uint16_t>(record.data() + 20);
    at += record.size();
    std::string body(bytes, '\0');
    if (at + bytes > first_point_ || file_.read(at, body.data(), bytes) < bytes) {
      fail(at, "a variable length record overlaps the points");
    }
    take_record(text_of(record.data() + 2, 16), load<std::uint16_t>(record.data() + 18),
                std::move(body));
    at += bytes;
  }
  if (std::ranges::any_of(covariance_, [](const Field& term) { return !term.known; })) {
    fail(0, fmt::format("holds no covariances of its points: {} yes writes them",
                        name_of(kSetting.covariance)));
  }
  while (!loading_.empty() && !loading_.back()[0].known) loading_.pop_back();
  if (factors_.size() != loading_.size()) {
    fail(0, "names other common factors than the loadings of its points refer to");
  }
}

void CloudFile::take_record(const std::string& user, std::uint16_t number, std::string body) {
  constexpr std::uint16_t kText = 3, kWkt = 2112, kFactors = 99, kErrors = 100;
  if (user == spec::kSpecificationUser && number == spec::kExtraBytesNumber) take_descriptors(body);
  if (user == spec::kSpecificationUser && number == kText) {
    for (const auto& [name, value] : lines_of(body, " = ")) {
      if (name == "calibration_sha256") calibration_ = value;
      if (name == "targets_sha256") targets_ = value;
    }
  }
  if (user == "LASF_Projection" && number == kWkt) wkt_ = body.substr(0, body.find('\0'));
  if (user != "risley") return;
  if (number == kFactors) take_factors(body);
  if (number == kErrors) take_errors(body);
  if (number <= kErrors || !trajectory_) return;
  constexpr std::size_t kRowBytes = 80;
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(body.data());
  for (std::size_t row = 0; (row + 1) * kRowBytes <= body.size(); ++row) {
    const std::uint8_t* from = bytes + row * kRowBytes;
    trajectory_->time_ns.push_back(load<std::int64_t>(from));
    for (std::size_t k = 0; k < 3; ++k) {
      if (k == 0) trajectory_->position.emplace_back();
      trajectory_->position.back()[k] = load<double>(from + 8 + 8 * k);
    }
    trajectory_->sigma.emplace_back();
    for (std::size_t k = 0; k < 6; ++k) {
      trajectory_->sigma.back()[k] = load<double>(from + 32 + 8 * k);
    }
  }
}

void CloudFile::take_descriptors(const std::string& body) {
  constexpr std::array<std::uint8_t, 11> kBytes{0, 1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
  constexpr std::uint8_t kFloat = 9;
  constexpr std::array<std::pair<std::string_view, CovarianceTerm>, 6> kTerms{
      {{"VarianceX", kXX},
       {"VarianceY", kYY},
       {"VarianceZ", kZZ},
       {"CovarianceXY", kXY},
       {"CovarianceXZ", kXZ},
       {"CovarianceYZ", kYZ}}};
  std::size_t at = base_bytes_;
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(body.data());
  for (std::size_t i = 0; i + spec::kDescriptorBytes <= body.size(); i += spec::kDescriptorBytes) {
    const std::uint8_t type = bytes[i + 2];
    if (type == 0 || type >= kBytes.size()) fail(0, "has extra bytes of an unknown type");
    const std::string name = text_of(bytes + i + 4, 32);
    const Field field{at, true};
    at += kBytes[type];
    if (at > record_bytes_) fail(0, "describes more extra bytes than its points have");
    if (type != kFloat) continue;
    for (const auto& [term, place] : kTerms) {
      if (name == term) covariance_[place] = field;
      if (name == fmt::format("Own{}", term)) own_[place] = field;
    }
    unsigned number = 0;
    constexpr std::string_view kLoading = "Loading";
    if (!name.starts_with(kLoading)) continue;
    const auto [end, error] =
        std::from_chars(name.data() + kLoading.size(), name.data() + name.size(), number);
    const std::size_t axis = std::string_view("XYZ").find(*end);
    if (error != std::errc() || number == 0 || number > 1000 || axis > 2) continue;
    if (loading_.size() < number) loading_.resize(number);
    loading_[number - 1][axis] = field;
  }
}

void CloudFile::take_factors(const std::string& body) {
  for (const auto& [name, value] : lines_of(body, ": ")) {
    if (name == "factor") factors_.push_back(value);
    if (name != "of_one_source") continue;
    const std::vector<double> numbers = numbers_of(value);
    if (!numbers.empty() && numbers.front() >= 0) {
      factors_of_source_ = static_cast<std::size_t>(numbers.front());
    }
  }
  if (factors_of_source_ > factors_.size()) fail(0, "names fewer common factors than it counts");
}

void CloudFile::take_errors(const std::string& body) {
  TrajectoryErrors& errors = trajectory_.emplace();
  for (const auto& [name, value] : lines_of(body, ": ")) {
    const std::vector<double> numbers = numbers_of(value);
    const auto fill = [&](auto& to) {
      if (numbers.size() == to.size()) std::ranges::copy(numbers, to.begin());
    };
    if (name == "correlation_time_s") fill(errors.correlation_time);
    if (name == "white_m_and_rad") fill(errors.white);
    if (name == "north") fill(errors.axes_from_ned[0]);
    if (name == "east") fill(errors.axes_from_ned[1]);
    if (name == "down") fill(errors.axes_from_ned[2]);
    if (name == "sample_interval_s" && numbers.size() == 1) {
      errors.sample_interval = numbers.front();
    }
    if (name == "first_sample_ns") {
      std::from_chars(value.data(), value.data() + value.size(), errors.first_sample_ns);
    }
  }
}

std::vector<std::array<float, 3>> CloudFile::coordinates(const std::array<double, 3>& offset,
                                                         const Progress& progress) const {
  std::vector<std::array<float, 3>> places(points_);
  std::vector<std::uint8_t> block(kBlockPoints * record_bytes_);
  for (std::size_t first = 0; first < points_; first += kBlockPoints) {
    const std::size_t rows = std::min(kBlockPoints, points_ - first);
    const std::uint64_t at = first_point_ + first * record_bytes_;
    if (file_.read(at, block.data(), rows * record_bytes_) < rows * record_bytes_) {
      fail(at, "ends early");
    }
    for (std::size_t i = 0; i < rows; ++i) {
      const std::uint8_t* record = block.data() + i * record_bytes_;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double value = load<std::int32_t>(record + 4 * axis) * scale_[axis] + offset_[axis];
        places[first + i][axis] = static_cast<float>(value - offset[axis]);
      }
    }
    progress.report(static_cast<double>(first + rows) / static_cast<double>(points_));
  }
  return places;
}

Points CloudFile::points(std::span<const std::size_t> rows) const {
  Points points;
  const std::size_t n = rows.size();
  const bool has_own = own_[kXX].known;
  points.time_ns.resize(n);
  points.point_source.resize(n);
  for (auto* column : {&points.x, &points.y, &points.z}) column->resize(n);
  for (auto& column : points.covariance) column.resize(n);
  for (auto& column : points.own_covariance) column.resize(has_own ? n : 0);
  points.loading.resize(loading_.size());
  for (auto& factor : points.loading) {
    for (auto& column : factor) column.resize(n);
  }
  std::vector<std::uint8_t> record(record_bytes_);
  for (std::size_t i = 0; i < n; ++i) {
    require_place("row", rows[i], points_);
    const std::uint64_t at = first_point_ + rows[i] * record_bytes_;
    if (file_.read(at, record.data(), record_bytes_) < record_bytes_) fail(at, "ends early");
    const auto number = [&](const Field& field) {
      return static_cast<double>(load<float>(record.data() + field.at));
    };
    const auto place = [&](std::size_t axis) {
      return load<std::int32_t>(record.data() + 4 * axis) * scale_[axis] + offset_[axis];
    };
    points.x[i] = place(0);
    points.y[i] = place(1);
    points.z[i] = place(2);
    points.point_source[i] = load<std::uint16_t>(record.data() + 20);
    const double time = load<double>(record.data() + 22);
    points.time_ns[i] = std::llround(1e9 * time);
    if (gps_time_) {
      points.time_ns[i] += spec::kGpsOrigin * spec::kSecond;
      points.time_ns[i] -= leap_seconds(points.time_ns[i]) * spec::kSecond;
    }
    for (std::size_t k = 0; k < kCovarianceTerms; ++k) {
      points.covariance[k][i] = number(covariance_[k]);
      if (has_own) points.own_covariance[k][i] = number(own_[k]);
    }
    for (std::size_t k = 0; k < loading_.size(); ++k) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        points.loading[k][axis][i] = number(loading_[k][axis]);
      }
    }
  }
  return points;
}

}  // namespace risley::cloud
