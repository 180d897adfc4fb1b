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
#include "risley/io/output_file.hpp"
#include "risley/optics/parameters.hpp"

namespace risley::report {
namespace {

constexpr std::size_t kBlockRows = 16384;

/// A NetCDF file, closed whatever happens.
class NcFile {
 public:
  explicit NcFile(const io::OutputFile& output) : path_(output.path()) {
    int id = 0;
    check(nc_create(output.temporary_path().c_str(), NC_NETCDF4 | NC_CLOBBER, &id));
    id_ = id;
  }
  ~NcFile() {
    if (id_) nc_close(*id_);
  }
  NcFile(const NcFile&) = delete;
  NcFile& operator=(const NcFile&) = delete;

  struct Dimension {
    int id = 0;
    std::size_t length = 0;
  };
  Dimension dimension(const std::string& name, std::size_t length) {
    Dimension result{0, length};
    check(nc_def_dim(*id_, name.c_str(), length, &result.id));
    return result;
  }

  void put_text(int variable, const std::string& name, const std::string& text) {
    check(nc_put_att_text(*id_, variable, name.c_str(), text.size(), text.data()));
  }

  int define(const Dimension& along, const std::string& name, nc_type type,
             const std::string& units, const std::string& long_name) {
    int variable = 0;
    check(nc_def_var(*id_, name.c_str(), type, 1, &along.id, &variable));
    if (along.length > 0) {
      const std::size_t chunk = std::min(along.length, kBlockRows);
      check(nc_def_var_chunking(*id_, variable, NC_CHUNKED, &chunk));
      check(nc_def_var_deflate(*id_, variable, 1, 1, 1));
      // Rows come in order: one chunk at a time is all that needs keeping, not megabytes each.
      check(nc_set_var_chunk_cache(*id_, variable, chunk * sizeof(double), 3, 1.0F));
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

  /// Writes rows from first on.
  void write(int variable, std::size_t first, const std::vector<double>& values) {
    const std::size_t count = values.size();
    check(nc_put_vara_double(*id_, variable, &first, &count, values.data()));
  }
  void write(int variable, std::size_t first, const std::vector<std::int64_t>& values) {
    static_assert(sizeof(long long) == sizeof(std::int64_t));
    const std::vector<long long> wide(values.begin(), values.end());
    const std::size_t count = wide.size();
    check(nc_put_vara_longlong(*id_, variable, &first, &count, wide.data()));
  }
  void write(int variable, std::size_t first, const std::vector<unsigned char>& values) {
    const std::size_t count = values.size();
    check(nc_put_vara_uchar(*id_, variable, &first, &count, values.data()));
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
  std::optional<int> id_;
};

/// One variable of doubles in file units.
struct StateColumn {
  std::string name, units, long_name;
  const std::vector<double>* values;
  double scale;
  bool root = false;  ///< the values are variances and the file holds sigmas
};

std::vector<StateColumn> columns_of(const estimation::RotorStates& states) {
  const auto prisms = states.rotation_angle.size();
  const double k = kDegreesPerRadian;
  std::vector<StateColumn> columns;
  std::size_t entry = 0;
  std::vector<StateColumn> covariances;
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

void write_states(const std::string& path, const StatesContent& content,
                  const std::vector<std::pair<std::string, std::string>>& attributes) {
  io::OutputFile output(path);
  NcFile file(output);
  file.put_text(NC_GLOBAL, "Conventions", "CF-1.9");
  file.put_text(NC_GLOBAL, "title", "Estimated rotor states of a Risley-prism lidar");
  for (const auto& [name, value] : attributes) file.put_text(NC_GLOBAL, name, value);
  const auto shots = file.dimension("time", content.rows);
  // No "since": the origin is the recording's, which need not be a date.
  const int time =
      file.define(shots, "time", NC_DOUBLE, "s", "time of the shot, as in the recording");
  const int time_ns = file.define(shots, "time_ns", NC_INT64, "ns", "the same without rounding");
  estimation::RotorStates block;
  block.resize(content.prisms, 0);
  std::vector<int> variables;
  for (const StateColumn& column : columns_of(block)) {
    variables.push_back(file.define(shots, column.name, NC_DOUBLE, column.units, column.long_name));
  }
  const int outlier = file.define(shots, "outlier", NC_UBYTE, "", "shot left out as an outlier");
  file.put_flags(outlier);

  struct Profile {
    int count, azimuth, zenith;
  };
  std::vector<Profile> profiles;
  const auto& residuals = content.residuals_over_angle;
  const std::size_t bins = residuals.empty() ? 0 : residuals.front().count.size();
  int middle = 0;
  if (bins > 0) {
    const auto angles = file.dimension("prism_angle", bins);
    middle = file.define(angles, "prism_angle", NC_DOUBLE, "degree",
                         "rotation angle of a prism, middle of the bin");
    for (std::size_t i = 0; i < residuals.size(); ++i) {
      const char letter = prism_letter(static_cast<int>(i));
      const auto define = [&](const std::string& name, const char* units, const std::string& what) {
        return file.define(angles, name, NC_DOUBLE, units,
                           fmt::format("{} by rotation angle of prism {}", what, letter));
      };
      profiles.push_back(
          {define(fmt::format("residual_shots_by_angle_{}", letter), "1", "shots used"),
           define(fmt::format("azimuth_residual_by_angle_{}_deg", letter), "degree",
                  "mean azimuth residual"),
           define(fmt::format("zenith_residual_by_angle_{}_deg", letter), "degree",
                  "mean zenith residual")});
    }
  }
  file.end_definitions();

  std::vector<double> values;
  for (std::size_t first = 0; first < content.rows; first += kBlockRows) {
    block = content.block({first, std::min(first + kBlockRows, content.rows)});
    values.resize(block.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = 1e-9 * static_cast<double>(block.time_ns[i]);
    }
    file.write(time, first, values);
    file.write(time_ns, first, block.time_ns);
    const std::vector<StateColumn> columns = columns_of(block);
    for (std::size_t c = 0; c < columns.size(); ++c) {
      for (std::size_t i = 0; i < values.size(); ++i) {
        const double value = (*columns[c].values)[i];
        values[i] = columns[c].scale * (columns[c].root ? std::sqrt(value) : value);
      }
      file.write(variables[c], first, values);
    }
    file.write(outlier, first, block.outlier);
  }
  values.resize(bins);
  const auto put = [&](int variable, const auto& value_of) {
    for (std::size_t i = 0; i < bins; ++i) values[i] = value_of(i);
    file.write(variable, 0, values);
  };
  if (bins > 0) {
    put(middle, [&](std::size_t i) {
      return 360.0 * (static_cast<double>(i) + 0.5) / static_cast<double>(bins);
    });
  }
  for (std::size_t k = 0; k < profiles.size(); ++k) {
    put(profiles[k].count,
        [&](std::size_t i) { return static_cast<double>(residuals[k].count[i]); });
    put(profiles[k].azimuth,
        [&](std::size_t i) { return degrees_from_radians(residuals[k].mean_azimuth[i]); });
    put(profiles[k].zenith,
        [&](std::size_t i) { return degrees_from_radians(residuals[k].mean_zenith[i]); });
  }
  file.close();
  output.commit();
}

}  // namespace risley::report
