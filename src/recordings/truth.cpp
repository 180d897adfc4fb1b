// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/recordings/truth.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/columns.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/tables/netcdf.hpp"

namespace risley::recordings {
namespace {

constexpr const char* kMarker = "risley_truth";  ///< global attribute: version of this layout
constexpr int kLayoutVersion = 1;
constexpr const char* kDimension = "shot";
constexpr std::size_t kBlockRows = 16384;
constexpr int kMostPrisms = 26;  ///< one letter each

/// A column, or one for each prism, whose letter replaces {} in names and words.
struct TruthColumn {
  ColumnPlace<TruthColumns, std::vector<double>, std::vector<std::vector<double>>> place;
  std::string_view name, units, long_name;
  double si_per_unit = 1.0;  ///< turns the file's values into SI units
};

/// Those other than the time, in the file's order.
constexpr TruthColumn kTruthColumns[] = {
    {&TruthColumns::rotation_angle, "rotation_angle_{}_deg", "degree",
     "true rotation angle of prism {}, not wrapped", kRadiansPerDegree},
    {&TruthColumns::angular_velocity, "angular_velocity_{}_deg_per_s", "degree s-1",
     "true angular velocity of prism {}", kRadiansPerDegree},
    {&TruthColumns::azimuth, "azimuth_deg", "degree", "true azimuth from X towards Y",
     kRadiansPerDegree},
    {&TruthColumns::zenith, "zenith_deg", "degree", "true zenith angle from Z", kRadiansPerDegree},
    {&TruthColumns::range, "range_m", "m", "true range, NaN where the beam hits nothing"}};

/// One variable of the file.
struct Variable {
  std::string name, units, long_name;
  double si_per_unit = 1.0;
};

/// All variables of a file in order; the first is the time.
std::vector<Variable> variables(int prisms) {
  std::vector<Variable> list{{"time", "s", "time of the shot", 1.0}};
  for (const TruthColumn& column : kTruthColumns) {
    const bool of_prisms = column.place.index() == 1;
    for (int i = 0; i < (of_prisms ? prisms : 1); ++i) {
      const auto text = [letter = static_cast<char>('a' + i)](std::string_view pattern) {
        return fmt::format(fmt::runtime(pattern), letter);
      };
      list.push_back({text(column.name), std::string(column.units), text(column.long_name),
                      column.si_per_unit});
    }
  }
  return list;
}

void require_prisms(int prisms, int least) {
  require_between("number of prisms", prisms, least, kMostPrisms);
}

/// The columns other than the time in the order of variables().
template <class Truth>
auto columns_of(Truth& rows) {
  std::vector<decltype(&rows.range)> columns;
  for_each_column<kTruthColumns>([&columns](auto& column) { columns.push_back(&column); }, rows);
  return columns;
}

}  // namespace

void TruthColumns::resize(int prisms, std::size_t rows) {
  require_prisms(prisms, 0);
  time_ns.resize(rows);
  rotation_angle.resize(static_cast<std::size_t>(prisms));
  angular_velocity.resize(static_cast<std::size_t>(prisms));
  for (auto* column : columns_of(*this)) column->resize(rows);
}

void TruthColumns::append(const TruthColumns& others) {
  if (size() == 0) resize(others.prisms(), 0);
  require_columns(others, prisms());
  time_ns.insert(time_ns.end(), others.time_ns.begin(), others.time_ns.end());
  const auto from = columns_of(others);
  const auto to = columns_of(*this);
  for (std::size_t i = 0; i < to.size(); ++i) {
    to[i]->insert(to[i]->end(), from[i]->begin(), from[i]->end());
  }
}

void require_columns(const TruthColumns& rows, int prisms) {
  const auto count = static_cast<std::size_t>(prisms);
  require_length("rotation_angle", rows.rotation_angle.size(), count);
  require_length("angular_velocity", rows.angular_velocity.size(), count);
  const auto columns = columns_of(rows);
  const auto list = variables(prisms);
  for (std::size_t i = 0; i < columns.size(); ++i) {
    require_length(list[i + 1].name, columns[i]->size(), rows.size());
  }
}

class TruthWriter::File {
 public:
  File(const std::string& path, int prisms)
      : file_(path), variables_(variables(prisms)), prisms_(prisms) {
    const auto shot = file_.define_growing_dimension(kDimension);
    file_.put_number(kMarker, kLayoutVersion);
    for (const Variable& variable : variables_) {
      const auto column = file_.define<double>(variable.name, {&shot}, {kBlockRows, false, false});
      file_.put_text(column, "units", variable.units);
      file_.put_text(column, "long_name", variable.long_name);
      columns_.push_back(column);
    }
    file_.end_definitions();
  }

  void write(const TruthColumns& rows) {
    const std::size_t count = rows.size();
    require_columns(rows, prisms_);
    const auto columns = columns_of(rows);
    if (count == 0) return;
    buffer_.resize(count);
    for (std::size_t row = 0; row < count; ++row) {
      buffer_[row] = static_cast<double>(rows.time_ns[row]) / 1e9;
    }
    file_.put(columns_.front(), written_, buffer_);
    for (std::size_t i = 0; i < columns.size(); ++i) {
      const double si_per_unit = variables_[i + 1].si_per_unit;
      for (std::size_t row = 0; row < count; ++row) buffer_[row] = (*columns[i])[row] / si_per_unit;
      file_.put(columns_[i + 1], written_, buffer_);
    }
    written_ += count;
  }

  void close() { file_.close(); }

 private:
  tables::NetcdfOutput file_;
  std::vector<Variable> variables_;
  int prisms_;
  std::vector<tables::NetcdfVariable> columns_;
  std::vector<double> buffer_;
  std::size_t written_ = 0;
};

TruthWriter::TruthWriter(const std::string& path, int prisms) {
  require_prisms(prisms, 1);
  file_ = std::make_unique<File>(path, prisms);
}
TruthWriter::~TruthWriter() = default;
void TruthWriter::write(const TruthColumns& rows) { file_->write(rows); }
void TruthWriter::close() { file_->close(); }

namespace {

/// An open truth file whose columns are read in blocks.
class TruthFile {
 public:
  explicit TruthFile(const std::string& path) : file_(path) {
    if (!file_.has_attribute(kMarker) || file_.number(kMarker) != kLayoutVersion) {
      file_.fail(fmt::format("is not a truth file: attribute {} = {} is missing", kMarker,
                             kLayoutVersion));
    }
    shot_ = file_.dimension(kDimension);
    while (prisms_ < kMostPrisms &&
           file_.has_variable(variables(prisms_ + 1)[1 + static_cast<std::size_t>(prisms_)].name)) {
      ++prisms_;
    }
    if (prisms_ == 0) file_.fail("expected variable rotation_angle_a_deg, found none");
  }

  int prisms() const { return prisms_; }
  /// @throws FileError if the file cannot hold as many as it states
  std::size_t rows() const {
    file_.variable<double>(variables(prisms_).front().name, {&shot_});
    return shot_.length;
  }

  /// Calls take(row, value) for every value of a variable, SI units, in order.
  template <class Take>
  void for_each(const Variable& variable, const Take& take) {
    const auto column = file_.variable<double>(variable.name, {&shot_}, kBlockRows);
    for (std::size_t first = 0; first < shot_.length; first += kBlockRows) {
      file_.get(column, first, std::min(kBlockRows, shot_.length - first), block_);
      for (std::size_t i = 0; i < block_.size(); ++i) {
        take(first + i, block_[i] * variable.si_per_unit);
      }
    }
  }

 private:
  tables::NetcdfInput file_;
  tables::NetcdfDimension shot_;
  int prisms_ = 0;
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
  const auto late = std::is_sorted_until(time_ns.begin(), time_ns.end());
  if (late != time_ns.end()) {
    throw InvalidArgument(fmt::format("time_ns[{}] = {} ns, allowed ascending from {}",
                                      late - time_ns.begin(), *late, *(late - 1)));
  }
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
