// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/states_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/io/output_file.hpp"
#include "risley/optics/parameters.hpp"
#include "risley/tables/netcdf.hpp"

namespace risley::jobs {
namespace {

constexpr std::size_t kBlockRows = 16384;

/// A variable of one value per entry, in compressed blocks.
template <class T>
tables::NetcdfVariable define(tables::NetcdfOutput& file, const tables::NetcdfDimension& along,
                              const std::string& name, const std::string& units,
                              const std::string& long_name) {
  auto variable = file.define<T>(name, {&along}, {std::min(along.length, kBlockRows), true, false});
  if (!units.empty()) file.put_text(variable, "units", units);
  file.put_text(variable, "long_name", long_name);
  return variable;
}

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
    const char a = prism_letter(static_cast<int>(i)), prism = prism_capital(static_cast<int>(i));
    columns.push_back({fmt::format("rotation_angle_{}_deg", a), "degree",
                       fmt::format("rotation angle of prism {}, not wrapped", prism),
                       &states.rotation_angle[i], k});
    columns.push_back({fmt::format("rotation_angle_sigma_{}_deg", a), "degree",
                       fmt::format("standard deviation of the rotation angle of prism {}", prism),
                       &states.rotation_angle_covariance[entry++], k, true});
    for (std::size_t j = i + 1; j < prisms; ++j) {
      const char b = prism_letter(static_cast<int>(j));
      covariances.push_back({fmt::format("rotation_angle_covariance_{}{}_deg2", a, b), "degree2",
                             fmt::format("covariance of the rotation angles of prisms {} and {}",
                                         prism, prism_capital(static_cast<int>(j))),
                             &states.rotation_angle_covariance[entry++], k * k});
    }
    columns.push_back({fmt::format("angular_velocity_{}_deg_per_s", a), "degree s-1",
                       fmt::format("angular velocity of prism {}", prism),
                       &states.angular_velocity[i], k});
    columns.push_back({fmt::format("angular_velocity_sigma_{}_deg_per_s", a), "degree s-1",
                       fmt::format("standard deviation of the angular velocity of prism {}", prism),
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
  write_states(output, content, attributes);
  output.commit();
}

void write_states(const io::OutputFile& output, const StatesContent& content,
                  const std::vector<std::pair<std::string, std::string>>& attributes) {
  tables::NetcdfOutput file(output);
  file.put_text("Conventions", "CF-1.9");
  file.put_text("title", "Rotor states of a Risley-prism lidar, estimated by risley");
  for (const auto& [name, value] : attributes) file.put_text(name, value);
  const auto shots = content.rows > 0 ? file.define_dimension("time", content.rows)
                                      : file.define_growing_dimension("time");
  // No "since": the origin is the recording's, which need not be a date.
  const auto time =
      define<double>(file, shots, "time", "s", "time of the shot, as in the recording");
  const auto time_ns =
      define<std::int64_t>(file, shots, "time_ns", "ns", "the same without rounding");
  estimation::RotorStates block;
  block.resize(content.prisms, 0);
  std::vector<tables::NetcdfVariable> variables;
  for (const StateColumn& column : columns_of(block)) {
    variables.push_back(define<double>(file, shots, column.name, column.units, column.long_name));
  }
  const auto outlier =
      define<std::uint8_t>(file, shots, "outlier", "", "shot rejected as an outlier");
  file.put_numbers(outlier, "flag_values", std::array<std::uint8_t, 2>{0, 1});
  file.put_text(outlier, "flag_meanings", "used left_out");

  struct Profile {
    tables::NetcdfVariable count, azimuth, zenith;
  };
  std::vector<Profile> profiles;
  const auto& residuals = content.residuals_over_angle;
  const std::size_t bins = residuals.empty() ? 0 : residuals.front().count.size();
  tables::NetcdfVariable middle;
  if (bins > 0) {
    const auto angles = file.define_dimension("prism_angle", bins);
    middle = define<double>(file, angles, "prism_angle", "degree",
                            "rotation angle of a prism, middle of the bin");
    for (std::size_t i = 0; i < residuals.size(); ++i) {
      const char letter = prism_letter(static_cast<int>(i));
      const auto profile = [&](const std::string& name, const char* units,
                               const std::string& what) {
        return define<double>(file, angles, name, units,
                              fmt::format("{} by rotation angle of prism {}", what,
                                          prism_capital(static_cast<int>(i))));
      };
      profiles.push_back(
          {profile(fmt::format("residual_shots_by_angle_{}", letter), "1", "shots used"),
           profile(fmt::format("azimuth_residual_by_angle_{}_deg", letter), "degree",
                   "mean azimuth residual"),
           profile(fmt::format("zenith_residual_by_angle_{}_deg", letter), "degree",
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
    file.put(time, first, values);
    file.put(time_ns, first, block.time_ns);
    const std::vector<StateColumn> columns = columns_of(block);
    for (std::size_t c = 0; c < columns.size(); ++c) {
      for (std::size_t i = 0; i < values.size(); ++i) {
        const double value = (*columns[c].values)[i];
        values[i] = columns[c].scale * (columns[c].root ? std::sqrt(value) : value);
      }
      file.put(variables[c], first, values);
    }
    file.put(outlier, first, block.outlier);
  }
  values.resize(bins);
  const auto put = [&](const tables::NetcdfVariable& variable, const auto& value_of) {
    for (std::size_t i = 0; i < bins; ++i) values[i] = value_of(i);
    file.put(variable, 0, values);
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
}

}  // namespace risley::jobs
