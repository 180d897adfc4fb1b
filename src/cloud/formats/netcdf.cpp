// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// NetCDF-4 after the CF conventions: one variable per field along the dimension "point", loadings
// along "point" and "factor". Equal points give equal bytes, in whatever pieces they are written:
// only whole blocks go to the file.
#include "risley/tables/netcdf.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <span>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/optics/parameters.hpp"

#include "cloud/formats/cloud_format.hpp"
#include "cloud/formats/record_file.hpp"

namespace risley::cloud {
namespace {

constexpr std::size_t kChunkRows = 32768;

/// Names of the terms of Points::covariance.
constexpr std::array<const char*, kCovarianceTerms> kTermNames{"xx", "xy", "xz", "yy", "yz", "zz"};
constexpr std::array<char, 3> kAxes{'x', 'y', 'z'};
constexpr std::array<CovarianceTerm, 3> kVariances{kXX, kYY, kZZ};

/// What a variable is called and what it means.
struct Description {
  std::string name, units, long_name;
  bool coordinate = false;  ///< otherwise an attribute leads to the coordinates
};

class NetcdfWriter final : public CloudWriter {
 public:
  NetcdfWriter(const std::string& path, const CloudHeader& header) : file_(path) {
    put_attributes(header);
    point_ = file_.define_growing_dimension("point");
    define_sensor_variables(header);
    if (header.has_covariance) define_covariance(header);
    define_geometry(header);
    define_loadings(header.factors);
    if (header.trajectory) define_trajectory(*header.trajectory);
    file_.end_definitions();
    if (header.trajectory) put_trajectory(*header.trajectory);
  }

  void write(const Points& points) override {
    for (std::size_t first = 0; first < points.size();) {
      const std::size_t count = std::min(points.size() - first, kChunkRows - rows_);
      for (Variable& variable : variables_) variable.fill(points, first, count, rows_);
      rows_ += count;
      first += count;
      if (rows_ == kChunkRows) put_block();
    }
  }

  void close() override {
    if (rows_ > 0) put_block();
    file_.close();
  }

 private:
  /// One variable with its rows that are not in the file yet.
  struct Variable {
    /// Stores points [first, first + count) as rows from `row` of the block on.
    std::function<void(const Points& points, std::size_t first, std::size_t count, std::size_t row)>
        fill;
    /// Writes the block's first rows at row `first` of the file.
    std::function<void(std::size_t first, std::size_t rows)> put;
  };

  void put_attributes(const CloudHeader& header) {
    for (const auto& [name, value] : header.provenance) file_.put_text(name, value);
    file_.put_text("Conventions", "CF-1.9");
    file_.put_text("featureType", "point");
    file_.put_text("title", "Points of a Risley-prism lidar with their uncertainty");
    file_.put_text("sensor", header.sensor);
    file_.put_text("serial", header.serial);
    file_.put_text("frame", header.frame.text);
    if (!header.frame.wkt.empty()) file_.put_text("crs_wkt", header.frame.wkt);
    file_.put_text("time_reference", recordings::to_string(header.time_reference));
  }

  /// A variable with the numbers of a column, or of one for each entry of an inner dimension.
  /// @param column  column(points, k), k in [0, width)
  template <class T, class Column>
  tables::NetcdfVariable define(const Description& what, Column column, double scale = 1,
                                const tables::NetcdfDimension* inner = nullptr) {
    const auto value = [=](auto number) {
      if constexpr (std::is_floating_point_v<T>) {
        return static_cast<T>(scale * static_cast<double>(number));
      } else {
        return static_cast<T>(number);
      }
    };
    return define_values<T>(
        what,
        [=](const Points& points, std::size_t i, std::size_t k) {
          return value(column(points, k)[i]);
        },
        inner);
  }

  /// @param value  of one entry: value(points, point, k)
  template <class T, class Value>
  tables::NetcdfVariable define_values(const Description& what, Value value,
                                       const tables::NetcdfDimension* inner = nullptr) {
    const tables::NetcdfStorage storage{kChunkRows, true, false};
    auto variable = inner == nullptr ? file_.define<T>(what.name, {&point_}, storage)
                                     : file_.define<T>(what.name, {&point_, inner}, storage);
    file_.put_text(variable, "units", what.units);
    file_.put_text(variable, "long_name", what.long_name);
    if (!what.coordinate) file_.put_text(variable, "coordinates", "time x_m y_m z_m");
    const std::size_t width = variable.width;
    auto block = std::make_shared<std::vector<T>>(kChunkRows * width);
    variables_.push_back({[block, value, width](const Points& points, std::size_t first,
                                                std::size_t count, std::size_t row) {
                            T* to = block->data() + row * width;
                            for (std::size_t i = first; i < first + count; ++i) {
                              for (std::size_t k = 0; k < width; ++k) *to++ = value(points, i, k);
                            }
                          },
                          [this, block, variable](std::size_t first, std::size_t rows) {
                            file_.put(variable, first,
                                      std::span<const T>(*block).first(rows * variable.width));
                          }});
    return variable;
  }

  void define_sensor_variables(const CloudHeader& header) {
    const bool utc = header.time_reference == recordings::TimeReference::utc;
    const auto time_ns = [](const Points& p, auto) -> auto& { return p.time_ns; };
    const auto time = define<double>({"time", utc ? "seconds since 1970-01-01 00:00:00" : "s",
                                      "time of the shot, as in the recording", true},
                                     time_ns, 1e-9);
    file_.put_text(time, "axis", "T");
    if (utc) {
      file_.put_text(time, "standard_name", "time");
      file_.put_text(time, "calendar", "standard");
    }
    const std::vector<double> Points::*const places[] = {&Points::x, &Points::y, &Points::z};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::string name = fmt::format("{}_m", kAxes[k]);
      const auto variable = define<double>(
          {name, "m", header.frame.axes[k], true},
          [column = places[k]](const Points& p, auto) -> auto& { return p.*column; });
      file_.put_text(variable, "axis", std::string(1, "XYZ"[k]));
      if (header.has_covariance) {
        file_.put_text(variable, "ancillary_variables", "std_" + name);
      }
    }
    define<std::int64_t>({"time_ns", "ns", "time without rounding"}, time_ns);
    const auto byte = [this](const char* name, const char* meaning,
                             std::vector<std::uint8_t> Points::*column) {
      define<std::uint8_t>(
          {name, "1", meaning}, [column](const Points& p, auto) -> auto& { return p.*column; });
    };
    byte("intensity", "intensity as the sensor reports it", &Points::intensity);
    byte("return_number", "number of the return within its shot, from 1", &Points::return_number);
    byte("number_of_returns", "returns of the shot", &Points::number_of_returns);
    byte("tag", "tag byte of the sensor", &Points::tag);
    byte("beam", "firing beam, from 0", &Points::beam);
    if (!header.has_point_source) return;
    define<std::int32_t>(
        {"strip", "1", "strip of the flight, from 1; 0: of none"},
        [](const Points& p, auto) -> auto& { return p.point_source; });
  }

  void define_covariance(const CloudHeader& header) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      define_values<float>({fmt::format("std_{}_m", kAxes[axis]), "m",
                            fmt::format("standard deviation of {}_m", kAxes[axis])},
                           [term = kVariances[axis]](const Points& p, std::size_t i, auto) {
                             return static_cast<float>(std::sqrt(p.covariance[term][i]));
                           });
    }
    for (std::size_t term = 0; term < kCovarianceTerms; ++term) {
      const char* name = kTermNames[term];
      define<float>(
          {fmt::format("covariance_{}_m2", name), "m2",
           fmt::format("covariance of {}_m and {}_m", name[0], name[1])},
          [term](const Points& p, auto) -> auto& { return p.covariance[term]; });
    }
    if (!header.has_own_covariance) return;
    for (std::size_t term = 0; term < kCovarianceTerms; ++term) {
      const char* name = kTermNames[term];
      define<float>(
          {fmt::format("own_covariance_{}_m2", name), "m2",
           fmt::format("part of covariance_{}_m2 that the point shares with no other", name)},
          [term](const Points& p, auto) -> auto& { return p.own_covariance[term]; });
    }
  }

  /// The errors of a moving sensor's trajectory: docs/files.md
  void define_trajectory(const TrajectoryErrors& errors) {
    const auto list = [](std::span<const double> values) {
      return fmt::format("{}", fmt::join(values, " "));
    };
    file_.put_text_group("trajectory_errors",
                         {{"correlation_time_s", list(errors.correlation_time)},
                          {"white_m_and_rad", list(errors.white)},
                          {"sample_interval_s", fmt::format("{}", errors.sample_interval)},
                          {"first_sample_ns", fmt::format("{}", errors.first_sample_ns)},
                          {"north", list(errors.axes_from_ned[0])},
                          {"east", list(errors.axes_from_ned[1])},
                          {"down", list(errors.axes_from_ned[2])}});
    const auto record = file_.define_dimension("trajectory_record", errors.time_ns.size());
    const tables::NetcdfStorage storage{0, true, false};
    trajectory_.push_back(file_.define<std::int64_t>("trajectory_time_ns", {&record}, storage));
    file_.put_text(trajectory_.back(), "units", "ns");
    file_.put_text(trajectory_.back(), "long_name", "time of a place of the trajectory");
    for (const char axis : kAxes) {
      trajectory_.push_back(
          file_.define<double>(fmt::format("trajectory_{}_m", axis), {&record}, storage));
      file_.put_text(trajectory_.back(), "units", "m");
      file_.put_text(trajectory_.back(), "long_name",
                     fmt::format("{} of the sensor at that time", axis));
    }
    const auto error = file_.define_dimension("trajectory_error", 6);
    trajectory_.push_back(file_.define<double>("trajectory_sigma", {&record, &error}, storage));
    file_.put_text(trajectory_.back(), "units", "m m m rad rad rad");
    file_.put_text(trajectory_.back(), "long_name",
                   "standard deviation of shifts north, east, up and rotations about north, east, "
                   "down");
  }

  void put_trajectory(const TrajectoryErrors& errors) {
    file_.put(trajectory_[0], 0, errors.time_ns);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::vector<double> column;
      for (const auto& position : errors.position) column.push_back(position[axis]);
      file_.put(trajectory_[1 + axis], 0, column);
    }
    std::vector<double> sigmas;
    for (const auto& row : errors.sigma) sigmas.insert(sigmas.end(), row.begin(), row.end());
    file_.put(trajectory_[4], 0, sigmas);
  }

  void define_geometry(const CloudHeader& header) {
    define<float>(
        {"range_m", "m", "range from where the beam leaves the sensor"},
        [](const Points& p, auto) -> auto& { return p.range; });
    const auto incidence = define<float>(
        {"incidence_angle_deg", "degree", "angle between beam and surface normal"},
        [](const Points& p, auto) -> auto& { return p.incidence; }, kDegreesPerRadian);
    file_.set_fill(incidence, std::numeric_limits<float>::quiet_NaN());  // unknown
    if (!header.has_rotation_angles) return;
    for (int k = 0; k < header.prisms; ++k) {
      define<float>(
          {fmt::format("rotation_angle_{}_deg", prism_letter(k)), "degree",
           fmt::format("rotation angle of prism {}", prism_capital(k))},
          [k](const Points& p, auto) -> auto& { return p.rotation_angle[k]; }, kDegreesPerRadian);
    }
    define<float>(
        {"azimuth_residual_deg", "degree", "reported minus smoothed azimuth"},
        [](const Points& p, auto) -> auto& { return p.azimuth_residual; }, kDegreesPerRadian);
    define<float>(
        {"zenith_residual_deg", "degree", "reported minus smoothed zenith angle"},
        [](const Points& p, auto) -> auto& { return p.zenith_residual; }, kDegreesPerRadian);
  }

  void define_loadings(const std::vector<std::string>& factors) {
    if (factors.empty()) return;
    const auto factor = file_.define_dimension("factor", factors.size());
    file_.define_texts("factor_name", factor,
                       "common factor, one standard deviation of which the loadings tell", factors);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      define<float>(
          {fmt::format("loading_{}_m", kAxes[axis]), "m",
           fmt::format("change of {}_m by one standard deviation of a common factor", kAxes[axis])},
          [axis](const Points& p, std::size_t k) -> auto& { return p.loading[k][axis]; }, 1,
          &factor);
    }
  }

  void put_block() {
    for (const Variable& variable : variables_) variable.put(written_, rows_);
    written_ += rows_;
    rows_ = 0;
  }

  tables::NetcdfOutput file_;
  tables::NetcdfDimension point_;
  std::vector<Variable> variables_;
  std::vector<tables::NetcdfVariable> trajectory_;  ///< time, x, y, z, sigmas
  std::size_t rows_ = 0;                            ///< in the block
  std::size_t written_ = 0;                         ///< in the file
};

}  // namespace

const CloudWriterFormat kNetcdfFormat = {
    "netcdf", ".nc", "NetCDF-4 after the CF conventions, compressed",
    [](const std::string& path, const CloudHeader& header, const CloudWriterOptions&)
        -> std::unique_ptr<CloudWriter> { return std::make_unique<NetcdfWriter>(path, header); }};

}  // namespace risley::cloud
