// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/recordings/truth.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>
#include <netcdf.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/io/output_file.hpp"

namespace risley::recordings {
namespace {

constexpr const char* kMarker = "risley_truth";  ///< global attribute: version of this layout
constexpr int kLayoutVersion = 1;
constexpr const char* kDimension = "shot";
constexpr std::size_t kBlockRows = 16384;
constexpr int kMostPrisms = 26;  ///< one letter each

/// One variable of the file; si_per_unit turns its values into SI units.
struct Variable {
  std::string name, units, long_name;
  double si_per_unit = 1.0;
};

/// All variables of a file in order; the first is the time.
std::vector<Variable> variables(int prisms) {
  std::vector<Variable> list{{"time", "s", "time of the shot", 1.0}};
  for (int i = 0; i < prisms; ++i) {
    const char letter = static_cast<char>('a' + i);
    list.push_back({fmt::format("rotation_angle_{}_deg", letter), "degree",
                    fmt::format("true rotation angle of prism {}, not wrapped", letter),
                    kRadiansPerDegree});
  }
  for (int i = 0; i < prisms; ++i) {
    const char letter = static_cast<char>('a' + i);
    list.push_back({fmt::format("angular_velocity_{}_deg_per_s", letter), "degree s-1",
                    fmt::format("true angular velocity of prism {}", letter), kRadiansPerDegree});
  }
  list.push_back({"azimuth_deg", "degree", "true azimuth from X towards Y", kRadiansPerDegree});
  list.push_back({"zenith_deg", "degree", "true zenith angle from Z", kRadiansPerDegree});
  list.push_back({"range_m", "m", "true range, NaN where the beam hits nothing", 1.0});
  return list;
}

/// The columns beside the time in the order of variables().
template <class Truth>
auto columns_of(Truth& rows) {
  std::vector<decltype(&rows.range)> columns;
  for (auto& column : rows.rotation_angle) columns.push_back(&column);
  for (auto& column : rows.angular_velocity) columns.push_back(&column);
  for (auto* column : {&rows.azimuth, &rows.zenith, &rows.range}) columns.push_back(column);
  return columns;
}

/// A NetCDF handle that is closed whatever happens.
class Handle {
 public:
  explicit Handle(std::string path) : path_(std::move(path)) {}
  ~Handle() {
    if (id_) nc_close(*id_);
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;

  int id() const { return *id_; }
  void opened(int status, int id, const char* action) {
    check(status, action);
    id_ = id;
  }
  void close() {
    const int status = nc_close(*id_);
    id_.reset();
    check(status, "be completed");
  }
  void check(int status, std::string_view action) const {
    if (status != NC_NOERR) fail(fmt::format("cannot {}: {}", action, nc_strerror(status)));
  }
  [[noreturn]] void fail(const std::string& problem) const { throw FileError(path_, {}, problem); }

 private:
  std::string path_;
  std::optional<int> id_;
};

}  // namespace

void TruthColumns::resize(int prisms, std::size_t rows) {
  time_ns.resize(rows);
  rotation_angle.resize(static_cast<std::size_t>(prisms));
  angular_velocity.resize(static_cast<std::size_t>(prisms));
  for (auto* column : columns_of(*this)) column->resize(rows);
}

void TruthColumns::append(const TruthColumns& others) {
  if (size() == 0) resize(others.prisms(), 0);
  if (prisms() != others.prisms()) {
    throw InvalidArgument(
        fmt::format("truth columns of {} prisms, expected {}", others.prisms(), prisms()));
  }
  time_ns.insert(time_ns.end(), others.time_ns.begin(), others.time_ns.end());
  const auto from = columns_of(others);
  const auto to = columns_of(*this);
  for (std::size_t i = 0; i < to.size(); ++i) {
    to[i]->insert(to[i]->end(), from[i]->begin(), from[i]->end());
  }
}

class TruthWriter::File {
 public:
  File(const std::string& path, int prisms)
      : output_(path), handle_(path), variables_(variables(prisms)), prisms_(prisms) {
    int id = 0;
    const int status = nc_create(output_.temporary_path().c_str(), NC_NETCDF4 | NC_CLOBBER, &id);
    handle_.opened(status, id, "be created");
    int dimension = 0;
    handle_.check(nc_def_dim(id, kDimension, NC_UNLIMITED, &dimension), "define its dimension");
    handle_.check(nc_put_att_int(id, NC_GLOBAL, kMarker, NC_INT, 1, &kLayoutVersion), "be marked");
    for (const Variable& variable : variables_) {
      const std::string action = fmt::format("define variable {}", variable.name);
      int number = 0;
      handle_.check(nc_def_var(id, variable.name.c_str(), NC_DOUBLE, 1, &dimension, &number),
                    action);
      handle_.check(nc_def_var_chunking(id, number, NC_CHUNKED, &kBlockRows), action);
      handle_.check(
          nc_put_att_text(id, number, "units", variable.units.size(), variable.units.data()),
          action);
      handle_.check(nc_put_att_text(id, number, "long_name", variable.long_name.size(),
                                    variable.long_name.data()),
                    action);
      numbers_.push_back(number);
    }
    handle_.check(nc_enddef(id), "finish its definitions");
  }

  void write(const TruthColumns& rows) {
    const std::size_t count = rows.size();
    const auto columns = columns_of(rows);
    if (columns.size() + 1 != numbers_.size() || rows.prisms() != prisms_) {
      throw InvalidArgument(
          fmt::format("truth columns of {} prisms, expected {}", rows.prisms(), prisms_));
    }
    for (std::size_t i = 0; i < columns.size(); ++i) {
      if (columns[i]->size() != count) {
        throw InvalidArgument(fmt::format("truth column {} has {} rows, time has {}",
                                          variables_[i + 1].name, columns[i]->size(), count));
      }
    }
    if (count == 0) return;
    buffer_.resize(count);
    for (std::size_t row = 0; row < count; ++row) {
      buffer_[row] = static_cast<double>(rows.time_ns[row]) / 1e9;
    }
    put(0);
    for (std::size_t i = 0; i < columns.size(); ++i) {
      const double si_per_unit = variables_[i + 1].si_per_unit;
      for (std::size_t row = 0; row < count; ++row) buffer_[row] = (*columns[i])[row] / si_per_unit;
      put(i + 1);
    }
    written_ += count;
  }

  void close() {
    handle_.close();
    output_.commit();
  }

 private:
  void put(std::size_t variable) {
    const std::size_t count = buffer_.size();
    handle_.check(
        nc_put_vara_double(handle_.id(), numbers_[variable], &written_, &count, buffer_.data()),
        fmt::format("write variable {}", variables_[variable].name));
  }

  io::OutputFile output_;  ///< before the handle: a file is closed before it is removed
  Handle handle_;
  std::vector<Variable> variables_;
  int prisms_;
  std::vector<int> numbers_;
  std::vector<double> buffer_;
  std::size_t written_ = 0;
};

TruthWriter::TruthWriter(const std::string& path, int prisms) {
  if (prisms < 1 || prisms > kMostPrisms) {
    throw InvalidArgument(
        fmt::format("number of prisms = {}, allowed 1 to {}", prisms, kMostPrisms));
  }
  file_ = std::make_unique<File>(path, prisms);
}
TruthWriter::~TruthWriter() = default;
void TruthWriter::write(const TruthColumns& rows) { file_->write(rows); }
void TruthWriter::close() { file_->close(); }

namespace {

/// An open truth file whose columns are read in blocks.
class TruthFile {
 public:
  explicit TruthFile(const std::string& path) : handle_(path) {
    int id = 0;
    const int status = nc_open(path.c_str(), NC_NOWRITE, &id);
    handle_.opened(status, id, "be opened as NetCDF");
    int version = 0;
    if (nc_get_att_int(id, NC_GLOBAL, kMarker, &version) != NC_NOERR || version != kLayoutVersion) {
      handle_.fail(
          fmt::format("is no truth file: attribute {} = {} is missing", kMarker, kLayoutVersion));
    }
    handle_.check(nc_inq_dimid(id, kDimension, &dimension_), "find dimension shot");
    handle_.check(nc_inq_dimlen(id, dimension_, &count_), "read dimension shot");
    for (int number = 0;
         nc_inq_varid(id, variables(prisms_ + 1)[1 + prisms_].name.c_str(), &number) == NC_NOERR;) {
      ++prisms_;
    }
    if (prisms_ == 0) handle_.fail("expected variable rotation_angle_a_deg, found none");
  }

  int prisms() const { return prisms_; }
  std::size_t rows() const { return count_; }

  /// Calls take(row, value) for every value of a variable, SI units, in order.
  template <class Take>
  void for_each(const Variable& variable, const Take& take) {
    int number = 0;
    nc_type type = NC_NAT;
    int rank = 0, along = 0;
    const int id = handle_.id();
    handle_.check(nc_inq_varid(id, variable.name.c_str(), &number),
                  fmt::format("find variable {}", variable.name));
    if (nc_inq_var(id, number, nullptr, &type, &rank, nullptr, nullptr) != NC_NOERR ||
        type != NC_DOUBLE || rank != 1 || nc_inq_vardimid(id, number, &along) != NC_NOERR ||
        along != dimension_) {
      handle_.fail(fmt::format("variable {}: expected numbers along dimension {}", variable.name,
                               kDimension));
    }
    for (std::size_t first = 0; first < count_; first += kBlockRows) {
      block_.resize(std::min(kBlockRows, count_ - first));
      const std::size_t count = block_.size();
      handle_.check(nc_get_vara_double(id, number, &first, &count, block_.data()),
                    fmt::format("read variable {}", variable.name));
      for (std::size_t i = 0; i < count; ++i) take(first + i, block_[i] * variable.si_per_unit);
    }
  }

 private:
  Handle handle_;
  int dimension_ = 0, prisms_ = 0;
  std::size_t count_ = 0;
  std::vector<double> block_;
};

std::int64_t nanoseconds(double seconds) { return std::llround(seconds * 1e9); }

}  // namespace

TruthColumns load_truth(const std::string& path) {
  TruthFile file(path);
  TruthColumns rows;
  rows.resize(file.prisms(), file.rows());
  const auto list = variables(file.prisms());
  file.for_each(list.front(),
                [&](std::size_t row, double t) { rows.time_ns[row] = nanoseconds(t); });
  const auto columns = columns_of(rows);
  for (std::size_t i = 0; i < columns.size(); ++i) {
    file.for_each(list[i + 1], [&](std::size_t row, double value) { (*columns[i])[row] = value; });
  }
  return rows;
}

TruthColumns load_truth(const std::string& path, std::span<const std::int64_t> time_ns) {
  TruthFile file(path);
  TruthColumns rows;
  rows.resize(file.prisms(), 0);
  const auto list = variables(file.prisms());
  std::vector<std::size_t> places;  // of the wanted rows
  std::size_t wanted = 0;
  file.for_each(list.front(), [&](std::size_t row, double t) {
    const std::int64_t time = nanoseconds(t);
    while (wanted < time_ns.size() && time_ns[wanted] < time) ++wanted;
    if (wanted == time_ns.size() || time_ns[wanted] != time) return;
    places.push_back(row);
    rows.time_ns.push_back(time);
  });
  const auto columns = columns_of(rows);
  for (std::size_t i = 0; i < columns.size(); ++i) {
    std::size_t next = 0;
    file.for_each(list[i + 1], [&](std::size_t row, double value) {
      if (next == places.size() || places[next] != row) return;
      ++next;
      columns[i]->push_back(value);
    });
  }
  return rows;
}

}  // namespace risley::recordings
