// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// NetCDF-4 after the CF conventions: one variable per field along the dimension "point", loadings
// along "point" and "factor". Equal points give equal bytes, however they are split into calls:
// only whole blocks go to the file.
#include "risley/tables/netcdf.hpp"

#include <algorithm>
#include <array>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>

#include <fmt/format.h>

#include "cloud/formats/cloud_format.hpp"
#include "cloud/formats/record_file.hpp"

namespace risley::cloud {
namespace {

constexpr std::size_t kChunkRows = 32768;

class NetcdfWriter final : public CloudWriter {
 public:
  NetcdfWriter(const std::string& path, const CloudHeader& header) : file_(path) {
    put_attributes(header);
    point_ = file_.define_growing_dimension("point");
    for (const PointColumn& column : kPointColumns) define(column, header);
    if (header.trajectory) define_trajectory(*header.trajectory);
    file_.end_definitions();
    if (header.trajectory) put_trajectory(*header.trajectory);
  }

  void write(const Points& points) override {
    for (std::size_t first = 0; first < points.size();) {
      const std::size_t count = std::min(points.size() - first, kChunkRows - rows_);
      for (const Variable& variable : variables_) {
        const std::size_t bytes = variable.packer.record_bytes();
        variable.packer.pack(points, first, count, variable.block + rows_ * bytes, bytes);
      }
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
  /// One variable with its rows not yet in the file.
  struct Variable {
    RecordPacker packer;  ///< of a record with one number per entry of the inner dimension
    std::uint8_t* block;  ///< [kChunkRows] records
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
    if (header.factors_of_source > 0) {
      file_.put_text("factors_of_one_source", std::to_string(header.factors_of_source));
    }
  }

  /// The variables of one column. Similar variables follow each other by their names; columns of
  /// one name, those of the common factors, make one variable of two dimensions.
  void define(const PointColumn& column, const CloudHeader& header) {
    std::map<std::string, std::vector<PointField>> variables;
    for (PointField& field : fields_of(column, header)) {
      variables[field.variable].push_back(std::move(field));
    }
    std::optional<tables::NetcdfDimension> factor;
    if (std::holds_alternative<decltype(&Points::loading)>(column.place) && !variables.empty()) {
      factor = file_.define_dimension("factor", header.factors.size());
      file_.define_texts("factor_name", *factor,
                         "common factor; loadings are per standard deviation of it",
                         header.factors);
    }
    for (auto& one : variables) {
      with_number_type(column.type, [&]<class T>() {
        std::vector<PointField>& fields = one.second;
        const tables::NetcdfStorage storage{kChunkRows, true, false};
        const auto variable = factor ? file_.define<T>(one.first, {&point_, &*factor}, storage)
                                     : file_.define<T>(one.first, {&point_}, storage);
        put_attributes(variable, fields.front(), header);
        const auto block = std::make_shared<std::vector<T>>(kChunkRows * fields.size());
        variables_.push_back(
            {RecordPacker(std::move(fields)), reinterpret_cast<std::uint8_t*>(block->data()),
             [this, block, variable](std::size_t first, std::size_t rows) {
               file_.put(variable, first, std::span<const T>(*block).first(rows * variable.width));
             }});
      });
    }
  }

  void put_attributes(const tables::NetcdfVariable& variable, const PointField& field,
                      const CloudHeader& header) {
    const char axis = field.column->axis;
    const bool dated = axis == 'T' && header.time_reference == recordings::TimeReference::utc;
    file_.put_text(
        variable, "units",
        dated ? "seconds since 1970-01-01 00:00:00" : names_of(field.column->unit).netcdf);
    file_.put_text(variable, "long_name", field.meaning);
    if (axis != 0) {
      file_.put_text(variable, "axis", std::string(1, axis));
    } else {
      file_.put_text(variable, "coordinates", "time x_m y_m z_m");
    }
    if (dated) {
      file_.put_text(variable, "standard_name", "time");
      file_.put_text(variable, "calendar", "standard");
    }
    if (axis != 0 && axis != 'T' && header.has_covariance) {
      file_.put_text(variable, "ancillary_variables", "std_" + field.variable);
    }
    if (field.column->is(PointColumn::kHasUnknown)) {  // all of them are float32
      file_.set_fill(variable, std::numeric_limits<float>::quiet_NaN());
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
    file_.put_text(trajectory_.back(), "long_name", "time of a pose of the trajectory");
    for (const char axis : {'x', 'y', 'z'}) {
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
