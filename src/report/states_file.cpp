// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/states_file.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>
#include <netcdf.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/output_file.hpp"
#include "risley/optics/parameters.hpp"

namespace risley::report {
namespace {

constexpr std::size_t kBlockRows = 16384;

/// A NetCDF file with one dimension, closed whatever happens.
class NcFile {
 public:
  NcFile(const OutputFile& output, std::size_t rows) : path_(output.path()), rows_(rows) {
    int id = 0;
    check(nc_create(output.temporary_path().c_str(), NC_NETCDF4 | NC_CLOBBER, &id));
    id_ = id;
    check(nc_def_dim(id, "time", rows, &dimension_));
  }
  ~NcFile() {
    if (id_) nc_close(*id_);
  }
  NcFile(const NcFile&) = delete;
  NcFile& operator=(const NcFile&) = delete;

  void put_text(int variable, const std::string& name, const std::string& text) {
    check(nc_put_att_text(*id_, variable, name.c_str(), text.size(), text.data()));
  }

  int define(const std::string& name, nc_type type, const std::string& units,
             const std::string& long_name) {
    int variable = 0;
    check(nc_def_var(*id_, name.c_str(), type, 1, &dimension_, &variable));
    if (rows_ > 0) {
      const std::size_t chunk = std::min(rows_, kBlockRows);
      check(nc_def_var_chunking(*id_, variable, NC_CHUNKED, &chunk));
      check(nc_def_var_deflate(*id_, variable, 1, 1, 1));
    }
    if (!units.empty()) put_text(variable, "units", units);
    put_text(variable, "long_name", long_name);
    return variable;
  }

  void put_flags(int variable) {
    const unsigned char values[] = {0, 1};
    check(nc_put_att_uchar(*id_, variable, "flag_values", NC_UBYTE, 2, values));
    put_text(variable, "flag_meanings", "used left_out");
  }

  void end_definitions() { check(nc_enddef(*id_)); }

  /// Fills a variable from a function of the row.
  template <class Function>
  void fill(int variable, Function&& value_of) {
    std::vector<double> block;
    for (std::size_t first = 0; first < rows_; first += kBlockRows) {
      block.resize(std::min(kBlockRows, rows_ - first));
      for (std::size_t i = 0; i < block.size(); ++i) block[i] = value_of(first + i);
      const std::size_t count = block.size();
      check(nc_put_vara_double(*id_, variable, &first, &count, block.data()));
    }
  }
  void fill_times(int variable, const std::vector<std::int64_t>& time_ns) {
    static_assert(sizeof(long long) == sizeof(std::int64_t));
    const std::vector<long long> values(time_ns.begin(), time_ns.end());
    check(nc_put_var_longlong(*id_, variable, values.data()));
  }
  void fill_flags(int variable, const std::vector<unsigned char>& values) {
    check(nc_put_var_uchar(*id_, variable, values.data()));
  }

  void close() {
    const int status = nc_close(*id_);
    id_.reset();
    check(status);
  }

 private:
  void check(int status) const {
    if (status != NC_NOERR) {
      throw FileError(path_, {}, fmt::format("cannot be written: {}", nc_strerror(status)));
    }
  }

  std::string path_;
  std::size_t rows_;
  std::optional<int> id_;
  int dimension_ = 0;
};

/// One variable of doubles in file units.
struct Column {
  std::string name, units, long_name;
  const std::vector<double>* values;
  double scale;
  bool root = false;  ///< the values are variances and the file holds sigmas
};

std::vector<Column> columns_of(const estimation::RotorStates& states) {
  const auto prisms = states.rotation_angle.size();
  const double k = kDegreesPerRadian;
  std::vector<Column> columns;
  std::size_t entry = 0;
  std::vector<Column> covariances;
  for (std::size_t i = 0; i < prisms; ++i) {
    const char a = prism_letter(static_cast<int>(i));
    columns.push_back({fmt::format("rotation_angle_{}_deg", a), "degree",
                       fmt::format("rotation angle of prism {}, not wrapped", a),
                       &states.rotation_angle[i], k});
    columns.push_back({fmt::format("rotation_angle_sigma_{}_deg", a), "degree",
                       fmt::format("standard deviation of the rotation angle of prism {}", a),
                       &states.rotation_angle_covariance[entry++], k, true});
    for (std::size_t j = i + 1; j < prisms; ++j) {
      const char b = prism_letter(static_cast<int>(j));
      covariances.push_back(
          {fmt::format("rotation_angle_covariance_{}{}_deg2", a, b), "degree2",
           fmt::format("covariance of the rotation angles of prisms {} and {}", a, b),
           &states.rotation_angle_covariance[entry++], k * k});
    }
    columns.push_back({fmt::format("angular_velocity_{}_deg_per_s", a), "degree s-1",
                       fmt::format("angular velocity of prism {}", a), &states.angular_velocity[i],
                       k});
    columns.push_back({fmt::format("angular_velocity_sigma_{}_deg_per_s", a), "degree s-1",
                       fmt::format("standard deviation of the angular velocity of prism {}", a),
                       &states.angular_velocity_sigma[i], k});
  }
  columns.insert(columns.end(), covariances.begin(), covariances.end());
  columns.push_back({"azimuth_residual_deg", "degree", "observed minus estimated azimuth",
                     &states.azimuth_residual, k});
  columns.push_back({"zenith_residual_deg", "degree", "observed minus estimated zenith angle",
                     &states.zenith_residual, k});
  return columns;
}

}  // namespace

void write_states(const std::string& path, const estimation::RotorStates& states,
                  const std::vector<std::pair<std::string, std::string>>& attributes) {
  OutputFile output(path);
  NcFile file(output, states.size());
  file.put_text(NC_GLOBAL, "Conventions", "CF-1.9");
  file.put_text(NC_GLOBAL, "title", "Estimated rotor states of a Risley-prism lidar");
  for (const auto& [name, value] : attributes) file.put_text(NC_GLOBAL, name, value);
  // No "since": the origin is the recording's, which need not be a date.
  const int time = file.define("time", NC_DOUBLE, "s", "time of the shot, as in the recording");
  const int time_ns = file.define("time_ns", NC_INT64, "ns", "the same without rounding");
  const std::vector<Column> columns = columns_of(states);
  std::vector<int> variables;
  variables.reserve(columns.size());
  for (const Column& column : columns) {
    variables.push_back(file.define(column.name, NC_DOUBLE, column.units, column.long_name));
  }
  const int outlier = file.define("outlier", NC_UBYTE, "", "shot left out as an outlier");
  file.put_flags(outlier);
  file.end_definitions();
  file.fill(time, [&](std::size_t i) { return 1e-9 * static_cast<double>(states.time_ns[i]); });
  file.fill_times(time_ns, states.time_ns);
  for (std::size_t c = 0; c < columns.size(); ++c) {
    const Column& column = columns[c];
    file.fill(variables[c], [&](std::size_t i) {
      const double value = (*column.values)[i];
      return column.scale * (column.root ? std::sqrt(value) : value);
    });
  }
  file.fill_flags(outlier, states.outlier);
  file.close();
  output.commit();
}

}  // namespace risley::report
