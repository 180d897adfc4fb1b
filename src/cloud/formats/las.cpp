// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <string_view>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>
#include <xsimd/xsimd.hpp>

#include "risley/core/error.hpp"
#include "risley/io/little_endian.hpp"
#include "risley/io/output_file.hpp"

#include "cloud/formats/cloud_format.hpp"
#include "cloud/formats/las_layout.hpp"

namespace risley::cloud::las {
namespace {

using recordings::las::kAdjustedGpsTime;
using recordings::las::kBeamField;
using recordings::las::kDescriptorBytes;
using recordings::las::kExtraBytesNumber;
using recordings::las::kGpsOrigin;
using recordings::las::kIntensityFactor;
using recordings::las::kRecordHeaderBytes;
using recordings::las::kSecond;
using recordings::las::kSpecificationUser;
using recordings::las::kTagField;
using recordings::las::leap_seconds;

/// Greatest X, Y or Z in steps of the scale.
constexpr double kMaxSteps = std::numeric_limits<std::int32_t>::max();
/// Added to a number of steps, it rounds it to the nearest integer, whose 32 bits are then the
/// low half of the sum.
constexpr double kRoundingShift = 0x1.8p52;
constexpr std::size_t kMaxRecordBytes = std::numeric_limits<std::uint16_t>::max();

template <class T>
std::uint8_t* put(std::uint8_t* out, std::type_identity_t<T> value) {
  io::store<T>(out, value);
  return out + sizeof(T);
}

/// Text in a field of fixed length, filled up with zeros.
std::uint8_t* put_text(std::uint8_t* out, std::string_view text, std::size_t length) {
  std::memset(out, 0, length);
  std::memcpy(out, text.data(), std::min(text.size(), length));
  return out + length;
}

/// What header fields may hold: printable ASCII.
std::string plain(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c > 0x7e; }, '?');
  return text;
}

std::string system_identifier(const CloudHeader& header) {
  std::string text = header.sensor.empty() ? "OTHER" : header.sensor;
  for (const std::string_view model : {"mid-40", "mid-70", "avia", "horizon", "tele-15"}) {
    if (!text.starts_with(model)) continue;
    text[0] = static_cast<char>(text[0] - 'a' + 'A');
    text.insert(0, "Livox ");
    break;
  }
  if (!header.serial.empty()) text += " " + header.serial;
  return plain(text.substr(0, 32));
}

std::string generating_software(const CloudHeader& header) {
  std::string text = "risley";
  for (const auto& [name, value] : header.provenance) {
    if (name == "version") text += " " + value;
  }
  return plain(text.substr(0, 32));
}

void append_descriptor(std::string& data, const PointField& field) {
  std::array<std::uint8_t, kDescriptorBytes> bytes{};
  bytes[2] = field.type == FieldType::uint8 ? 1 : 9;
  put_text(bytes.data() + 4, field.name, 32);
  put_text(bytes.data() + 160, field.description, 32);
  data.append(bytes.begin(), bytes.end());
}

/// The coordinate system of the points: the sensor's own, and metres.
VariableLengthRecord coordinate_system(Version version, const CloudHeader& header) {
  if (version == Version::las_1_4) {
    std::string name = plain(header.sensor.empty() ? "sensor" : header.sensor + " sensor");
    std::replace(name.begin(), name.end(), '"', '\'');
    std::string text = fmt::format(
        "LOCAL_CS[\"{} frame\",LOCAL_DATUM[\"sensor origin\",32767],UNIT[\"metre\",1],"
        "AXIS[\"X (forward)\",OTHER],AXIS[\"Y (left)\",OTHER],AXIS[\"Z (up)\",UP]]",
        name);
    text.push_back('\0');
    return {"LASF_Projection", 2112, "OGC WKT coordinate system", std::move(text)};
  }
  // GeoTIFF: version 1.1.0 with two keys, a user-defined model and linear units of metres.
  constexpr std::uint16_t kKeys[] = {1, 1, 0, 2, 1024, 0, 1, 32767, 3076, 0, 1, 9001};
  std::string data(sizeof kKeys, '\0');
  std::memcpy(data.data(), kKeys, sizeof kKeys);
  return {"LASF_Projection", 34735, "GeoTIFF GeoKeyDirectoryTag", std::move(data)};
}

double seconds(std::int64_t time_ns, std::int64_t shift) {
  const std::int64_t whole = time_ns / kSecond;
  return static_cast<double>(whole + shift) + static_cast<double>(time_ns - whole * kSecond) / 1e9;
}

}  // namespace

Layout::Layout(Version version, const CloudHeader& header, const CloudWriterOptions& options)
    : version_(version),
      scale_(options.las_scale),
      utc_(header.time_reference == recordings::TimeReference::utc),
      gps_time_(utc_ && options.gps_time),
      header_(header),
      system_identifier_(las::system_identifier(header)),
      generating_software_(las::generating_software(header)),
      floats_(uncertainty_fields(header)) {
  if (!(std::isfinite(scale_) && scale_ > 0)) {
    throw InvalidArgument(fmt::format("las_scale = {} m, allowed greater than 0 m", scale_));
  }
  const std::vector<PointField> loadings = loading_fields(header);
  floats_.insert(floats_.end(), loadings.begin(), loadings.end());
  record_bytes_ = base_record_bytes() + 4 * floats_.size() + 2;
  values_.resize(floats_.size() * kBlock);

  std::string descriptors;
  for (const PointField& field : floats_) append_descriptor(descriptors, field);
  for (const PointField& field : sensor_fields()) {
    if (field.name == kTagField || field.name == kBeamField) append_descriptor(descriptors, field);
  }
  if (descriptors.size() > kMaxRecordBytes) {
    const std::size_t others = floats_.size() + 2 - loadings.size();
    throw InvalidArgument(fmt::format("factors = {}, allowed up to {} in a LAS file",
                                      header.factors.size(),
                                      (kMaxRecordBytes / kDescriptorBytes - others) / 3));
  }
  records_.push_back(
      {kSpecificationUser, kExtraBytesNumber, "Extra bytes", std::move(descriptors)});
  records_.push_back(coordinate_system(version_, header));
  std::string text;
  for (const auto& [name, value] : header.provenance) text += fmt::format("{} = {}\n", name, value);
  if (text.empty()) return;
  text.push_back('\0');
  if (text.size() > kMaxRecordBytes) {
    throw InvalidArgument(
        fmt::format("provenance = {} bytes of text, allowed up to {} in a LAS file",
                    text.size() - 1, kMaxRecordBytes - 1));
  }
  records_.push_back({kSpecificationUser, 3, "How the cloud was made", std::move(text)});
}

std::uint16_t Layout::global_encoding() const {
  const unsigned wkt = version_ == Version::las_1_4 ? 1U << 4 : 0U;
  return static_cast<std::uint16_t>(wkt | (gps_time_ ? kAdjustedGpsTime : 0U));
}

HeaderNumbers Layout::numbers(const Summary& summary) const {
  HeaderNumbers numbers;
  if (summary.points == 0) return numbers;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    // A negative zero would be another byte pattern for the same box.
    numbers.low[axis] = std::nearbyint(summary.low[axis]) * scale_ + 0.0;
    numbers.high[axis] = std::nearbyint(summary.high[axis]) * scale_ + 0.0;
  }
  if (utc_) {
    using namespace std::chrono;
    const auto day = floor<days>(sys_time<nanoseconds>{nanoseconds{summary.first_time_ns}});
    const year_month_day date{day};
    const sys_days new_year{date.year() / January / 1};
    numbers.creation_day = static_cast<std::uint16_t>((day - new_year).count() + 1);
    numbers.creation_year = static_cast<std::uint16_t>(static_cast<int>(date.year()));
  }
  return numbers;
}

std::vector<std::uint8_t> Layout::head(const Summary& summary) const {
  std::size_t length = header_bytes();
  for (const VariableLengthRecord& record : records_)
    length += kRecordHeaderBytes + record.data.size();
  std::vector<std::uint8_t> bytes(length, 0);
  const HeaderNumbers numbers = this->numbers(summary);
  const bool modern = version_ == Version::las_1_4;

  std::uint8_t* out = put_text(bytes.data(), "LASF", 4);
  out = put<std::uint16_t>(out, 1);  // file source
  out = put<std::uint16_t>(out, global_encoding());
  out += 16;  // project: none
  out = put<std::uint8_t>(out, 1);
  out = put<std::uint8_t>(out, modern ? 4 : 2);
  out = put_text(out, system_identifier_, 32);
  out = put_text(out, generating_software_, 32);
  out = put<std::uint16_t>(out, numbers.creation_day);
  out = put<std::uint16_t>(out, numbers.creation_year);
  out = put<std::uint16_t>(out, static_cast<std::uint16_t>(header_bytes()));
  out = put<std::uint32_t>(out, static_cast<std::uint32_t>(length));
  out = put<std::uint32_t>(out, static_cast<std::uint32_t>(records_.size()));
  out = put<std::uint8_t>(out, point_format());
  out = put<std::uint16_t>(out, static_cast<std::uint16_t>(record_bytes_));
  // The counters of old; point formats from 6 on leave them 0.
  out = put<std::uint32_t>(out, modern ? 0 : static_cast<std::uint32_t>(summary.points));
  for (std::size_t k = 0; k < 5; ++k) {
    const std::uint64_t count = modern ? 0 : summary.points_by_return[k];
    out = put<std::uint32_t>(out, static_cast<std::uint32_t>(count));
  }
  for (int axis = 0; axis < 3; ++axis) out = put<double>(out, scale_);
  for (int axis = 0; axis < 3; ++axis) out = put<double>(out, 0.0);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    out = put<double>(out, numbers.high[axis]);
    out = put<double>(out, numbers.low[axis]);
  }
  if (modern) {
    out += 8 + 8 + 4;  // no waveforms, no extended variable length records
    out = put<std::uint64_t>(out, summary.points);
    for (const std::uint64_t count : summary.points_by_return) {
      out = put<std::uint64_t>(out, count);
    }
  }
  for (const VariableLengthRecord& record : records_) {
    out += 2;  // reserved
    out = put_text(out, record.user, 16);
    out = put<std::uint16_t>(out, record.number);
    out = put<std::uint16_t>(out, static_cast<std::uint16_t>(record.data.size()));
    out = put_text(out, record.description, 32);
    std::memcpy(out, record.data.data(), record.data.size());
    out += record.data.size();
  }
  return bytes;
}

void Layout::check_columns(const Points& points) const {
  const std::size_t rows = points.size();
  const auto check = [rows](const char* name, const auto& column) {
    if (column.size() == rows) return;
    throw InvalidArgument(
        fmt::format("{} has {} rows, time_ns has {}; columns of points have one length", name,
                    column.size(), rows));
  };
  const auto check_count = [](const char* name, std::size_t count, std::size_t announced) {
    if (count == announced) return;
    throw InvalidArgument(
        fmt::format("{} has {} columns, the cloud's header announces {}", name, count, announced));
  };
  check("x", points.x);
  check("y", points.y);
  check("z", points.z);
  check("range", points.range);
  check("incidence", points.incidence);
  check("intensity", points.intensity);
  check("return_number", points.return_number);
  check("number_of_returns", points.number_of_returns);
  check("tag", points.tag);
  check("beam", points.beam);
  if (header_.has_covariance) {
    for (const auto& column : points.covariance) check("covariance", column);
  }
  if (header_.has_rotation_angles) {
    check_count("rotation_angle", points.rotation_angle.size(),
                static_cast<std::size_t>(header_.prisms));
    for (const auto& column : points.rotation_angle) check("rotation_angle", column);
    check("azimuth_residual", points.azimuth_residual);
    check("zenith_residual", points.zenith_residual);
  }
  check_count("loading", points.loading.size(), header_.factors.size());
  for (const auto& factor : points.loading) {
    for (const auto& column : factor) check("loading", column);
  }
}

void Layout::pack_coordinates(const Points& points, std::size_t first, std::size_t rows,
                              Summary& summary) {
  using Batch = xsimd::batch<double>;
  const std::size_t whole = rows - rows % Batch::size;
  const std::vector<double>* const columns[] = {&points.x, &points.y, &points.z};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double* from = columns[axis]->data() + first;
    double* to = coordinates_[axis].data();
    Batch low(summary.low[axis]), high(summary.high[axis]);
    auto inside = Batch(0.0) == Batch(0.0);
    for (std::size_t i = 0; i < whole; i += Batch::size) {
      const Batch steps = Batch::load_unaligned(from + i) / Batch(scale_);
      inside = inside & (xsimd::abs(steps) <= Batch(kMaxSteps));
      low = xsimd::min(low, steps);
      high = xsimd::max(high, steps);
      (steps + Batch(kRoundingShift)).store_unaligned(to + i);
    }
    bool all_inside = xsimd::all(inside);
    std::array<double, Batch::size> lows, highs;
    low.store_unaligned(lows.data());
    high.store_unaligned(highs.data());
    double least = *std::min_element(lows.begin(), lows.end());
    double greatest = *std::max_element(highs.begin(), highs.end());
    for (std::size_t i = whole; i < rows; ++i) {
      const double steps = from[i] / scale_;
      all_inside = all_inside && std::fabs(steps) <= kMaxSteps;
      least = std::min(least, steps);
      greatest = std::max(greatest, steps);
      to[i] = steps + kRoundingShift;
    }
    if (!all_inside) {
      const double* wrong = std::find_if(from, from + rows, [this](double value) {
        return !(std::fabs(value / scale_) <= kMaxSteps);
      });
      throw InvalidArgument(
          fmt::format("point {}: {} = {} m, allowed {} to {} m (las_scale = {} m)",
                      summary.points + static_cast<std::uint64_t>(wrong - from) + 1, "XYZ"[axis],
                      *wrong, -kMaxSteps * scale_, kMaxSteps * scale_, scale_));
    }
    summary.low[axis] = least;
    summary.high[axis] = greatest;
  }
}

void Layout::pack_returns(const Points& points, std::size_t first, std::size_t rows,
                          Summary& summary) {
  const bool modern = version_ == Version::las_1_4;
  const unsigned most = modern ? 15 : 5;
  const std::uint8_t* number = points.return_number.data() + first;
  const std::uint8_t* total = points.number_of_returns.data() + first;
  const auto possible = [=](std::size_t i) {
    return static_cast<unsigned>(number[i] >= 1) & static_cast<unsigned>(number[i] <= total[i]) &
           static_cast<unsigned>(total[i] <= most);
  };
  unsigned all_possible = 1;
  for (std::size_t i = 0; i < rows; ++i) all_possible &= possible(i);
  if (all_possible == 0) {
    std::size_t i = 0;
    while (possible(i) != 0) ++i;
    const std::uint64_t point = summary.points + i + 1;
    if (total[i] < 1 || total[i] > most) {
      throw InvalidArgument(
          fmt::format("point {}: number_of_returns = {}, allowed 1 to {}", point, total[i], most));
    }
    throw InvalidArgument(
        fmt::format("point {}: return_number = {}, allowed 1 to {}", point, number[i], total[i]));
  }
  const std::uint8_t* intensity = points.intensity.data() + first;
  const int shift = modern ? 4 : 3;
  for (std::size_t i = 0; i < rows; ++i) {
    const std::uint32_t bits = std::uint32_t{number[i]} | (std::uint32_t{total[i]} << shift);
    returns_[i] = (std::uint32_t{intensity[i]} * kIntensityFactor) | (bits << 16);
  }
  // Two tables, because a count must not wait for the one just before it.
  std::array<std::array<std::uint32_t, 16>, 2> counts{};
  for (std::size_t i = 0; i < rows; ++i) ++counts[i % 2][number[i]];
  for (std::size_t k = 0; k < 15; ++k) {
    summary.points_by_return[k] += counts[0][k + 1] + counts[1][k + 1];
  }
}

void Layout::pack_times(const Points& points, std::size_t first, std::size_t rows) {
  const std::int64_t* time = points.time_ns.data() + first;
  if (gps_time_) {
    for (std::size_t i = 0; i < rows; ++i) {
      times_[i] = seconds(time[i], leap_seconds(time[i]) - kGpsOrigin);
    }
  } else {
    for (std::size_t i = 0; i < rows; ++i) times_[i] = seconds(time[i], 0);
  }
}

void Layout::pack(const Points& points, std::size_t first, std::size_t rows, std::uint8_t* out,
                  Summary& summary) {
  if (rows == 0) return;
  constexpr std::uint64_t kMaxPoints = std::numeric_limits<std::uint32_t>::max();
  if (version_ == Version::las_1_2 && summary.points + rows > kMaxPoints) {
    throw InvalidArgument(
        fmt::format("point {}: allowed up to {} points in LAS 1.2, which LAS 1.4 "
                    "has no limit for",
                    kMaxPoints + 1, kMaxPoints));
  }
  pack_coordinates(points, first, rows, summary);
  pack_returns(points, first, rows, summary);
  pack_times(points, first, rows);
  for (std::size_t k = 0; k < floats_.size(); ++k) {
    floats_[k].floats(points, first, {values_.data() + k * kBlock, rows});
  }

  // Classification, flags, scan angle and user data are 0, the point source is 1.
  constexpr std::uint8_t kModern[] = {0, 0, 0, 0, 1, 0}, kOld[] = {0, 0, 1, 0};
  const std::uint8_t* tag = points.tag.data() + first;
  const std::uint8_t* beam = points.beam.data() + first;
  const auto assemble = [&](const auto& constant) {
    const std::size_t floats = floats_.size();
    std::uint8_t* to = out;
    for (std::size_t i = 0; i < rows; ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        std::memcpy(to + 4 * axis, &coordinates_[axis][i], 4);
      }
      std::memcpy(to + 12, &returns_[i], 4);
      std::memcpy(to + 16, constant, sizeof constant);
      to += 16 + sizeof constant;
      to = put<double>(to, times_[i]);
      const float* value = values_.data() + i;
      for (std::size_t k = 0; k < floats; ++k, value += kBlock) to = put<float>(to, *value);
      *to++ = tag[i];
      *to++ = beam[i];
    }
  };
  if (version_ == Version::las_1_4) {
    assemble(kModern);
  } else {
    assemble(kOld);
  }
  if (summary.points == 0) summary.first_time_ns = points.time_ns[first];
  summary.points += rows;
}

}  // namespace risley::cloud::las

namespace risley::cloud {
namespace {

/// A LAS file without compression.
class LasWriter final : public CloudWriter {
 public:
  LasWriter(const std::string& path, las::Layout layout)
      : layout_(std::move(layout)),
        output_(path),
        file_(::open(output_.temporary_path().c_str(), O_WRONLY | O_CLOEXEC)) {
    if (file_ < 0) fail(0);
    const std::vector<std::uint8_t> head = layout_.head({});
    buffer_.resize(kBufferBytes + las::Layout::kBlock * layout_.record_bytes());
    std::copy(head.begin(), head.end(), buffer_.begin());
    used_ = head.size();
  }
  ~LasWriter() override {
    if (file_ >= 0) ::close(file_);
  }
  LasWriter(const LasWriter&) = delete;
  LasWriter& operator=(const LasWriter&) = delete;

  void write(const Points& points) override {
    check_sound();
    sound_ = false;  // unless all goes well
    layout_.check_columns(points);
    for (std::size_t first = 0; first < points.size();) {
      const std::size_t rows = std::min(las::Layout::kBlock, points.size() - first);
      layout_.pack(points, first, rows, buffer_.data() + used_, summary_);
      used_ += rows * layout_.record_bytes();
      first += rows;
      if (used_ >= kBufferBytes) flush(kBufferBytes);
    }
    sound_ = true;
  }

  void close() override {
    if (file_ < 0) return;
    check_sound();
    sound_ = false;
    flush(used_);
    const std::vector<std::uint8_t> head = layout_.head(summary_);
    write_at(head.data(), head.size(), 0);
    if (::close(std::exchange(file_, -1)) != 0) fail(written_);
    output_.commit();
  }

 private:
  static constexpr std::size_t kBufferBytes = std::size_t{1} << 20;

  [[noreturn]] void fail(std::uint64_t offset) const {
    throw FileError(output_.path(), {offset, {}},
                    fmt::format("cannot be written: {}", std::strerror(errno)));
  }

  void check_sound() const {
    if (sound_) return;
    throw FileError(output_.path(), {}, "is incomplete: points given before could not be written");
  }

  /// Writes the first bytes of the buffer and moves the others to its beginning.
  void flush(std::size_t count) {
    write_at(buffer_.data(), count, written_);
    written_ += count;
    std::copy(buffer_.data() + count, buffer_.data() + used_, buffer_.data());
    used_ -= count;
  }

  void write_at(const std::uint8_t* bytes, std::size_t count, std::uint64_t offset) const {
    while (count > 0) {
      const ssize_t done = ::pwrite(file_, bytes, count, static_cast<off_t>(offset));
      if (done < 0 && errno == EINTR) continue;
      if (done <= 0) fail(offset);
      bytes += done;
      count -= static_cast<std::size_t>(done);
      offset += static_cast<std::uint64_t>(done);
    }
  }

  las::Layout layout_;
  las::Summary summary_;
  io::OutputFile output_;
  int file_;
  bool sound_ = true;
  std::vector<std::uint8_t> buffer_;
  std::size_t used_ = 0;
  std::uint64_t written_ = 0;
};

template <las::Version kVersion>
std::unique_ptr<CloudWriter> create(const std::string& path, const CloudHeader& header,
                                    const CloudWriterOptions& options) {
  return std::make_unique<LasWriter>(path, las::Layout(kVersion, header, options));
}

}  // namespace

const CloudWriterFormat kLas14Format{"las-1.4", ".las",
                                     "LAS 1.4, point format 6, uncertainty as extra bytes",
                                     create<las::Version::las_1_4>};
const CloudWriterFormat kLas12Format{"las-1.2", ".las",
                                     "LAS 1.2, point format 1, uncertainty as extra bytes",
                                     create<las::Version::las_1_2>};

}  // namespace risley::cloud
