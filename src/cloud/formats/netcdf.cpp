// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// NetCDF-4 after the CF conventions: one variable per field along the dimension "point", loadings
// along "point" and "factor". Equal points give equal bytes, in whatever pieces they are written:
// only whole blocks go to the file.
// The NetCDF library is not thread-safe: one NetCDF file of a process at a time.
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <type_traits>

#include <fmt/format.h>
#include <netcdf.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/io/output_file.hpp"
#include "risley/optics/parameters.hpp"

#include "cloud/formats/cloud_format.hpp"
#include "cloud/formats/record_file.hpp"

namespace risley::cloud {
namespace {

constexpr std::size_t kBlockRows = 32768;

template <class T>
constexpr nc_type nc_type_of() {
  if constexpr (std::is_same_v<T, double>) return NC_DOUBLE;
  if constexpr (std::is_same_v<T, float>) return NC_FLOAT;
  if constexpr (std::is_same_v<T, std::int64_t>) return NC_INT64;
  if constexpr (std::is_same_v<T, std::uint8_t>) return NC_UBYTE;
}

/// Names of the terms of Points::covariance.
constexpr std::array<const char*, kCovarianceTerms> kTermNames{"xx", "xy", "xz", "yy", "yz", "zz"};
constexpr std::array<char, 3> kAxes{'x', 'y', 'z'};
constexpr std::array<CovarianceTerm, 3> kVariances{kXX, kYY, kZZ};

/// A NetCDF file, closed whatever happens.
class NcHandle {
 public:
  NcHandle() = default;
  NcHandle(const NcHandle&) = delete;
  NcHandle& operator=(const NcHandle&) = delete;
  ~NcHandle() {
    if (!id_) return;
    // After a close that the disk refused, HDF5 ends the process with a fault at its exit. What is
    // left here is going to be removed, so on a full disk its room serves to close it.
    std::error_code ignored;
    if (nc_sync(*id_) != NC_NOERR) std::filesystem::resize_file(path_, 0, ignored);
    nc_close(*id_);
  }

  int operator*() const { return *id_; }
  /// Both return the library's status.
  int create(const std::string& path) {
    path_ = path;
    int id = 0;
    const int status = nc_create(path.c_str(), NC_NETCDF4 | NC_CLOBBER, &id);
    if (status == NC_NOERR) id_ = id;
    return status;
  }
  int close() {
    // What a full disk refuses is refused now, when the destructor can still help.
    if (const int status = nc_sync(*id_); status != NC_NOERR) return status;
    const int status = nc_close(*id_);
    id_.reset();
    return status;
  }

 private:
  std::string path_;
  std::optional<int> id_;
};

/// What a variable is called and what it means.
struct Description {
  std::string name, units, long_name;
};

class NetcdfWriter final : public CloudWriter {
 public:
  NetcdfWriter(const std::string& path, const CloudHeader& header) : output_(path) {
    check(id_.create(output_.temporary_path()));
    put_attributes(header);
    check(nc_def_dim(*id_, "point", NC_UNLIMITED, &point_));
    define_sensor_variables(header);
    if (header.has_covariance) define_covariance();
    define_geometry(header);
    const std::optional<int> names = define_loadings(header.factors.size());
    check(nc_enddef(*id_));
    if (names) {
      std::vector<const char*> texts;
      for (const std::string& factor : header.factors) texts.push_back(factor.c_str());
      check(nc_put_var_string(*id_, *names, texts.data()));
    }
  }

  void write(const Points& points) override {
    for (std::size_t first = 0; first < points.size();) {
      const std::size_t count = std::min(points.size() - first, kBlockRows - rows_);
      for (Variable& variable : variables_) variable.fill(points, first, count, rows_);
      rows_ += count;
      first += count;
      if (rows_ == kBlockRows) put_block();
    }
  }

  void close() override {
    if (rows_ > 0) put_block();
    check(id_.close());
    output_.commit();
  }

 private:
  /// One variable with its rows that are not in the file yet.
  struct Variable {
    int id;
    std::size_t width;
    /// Stores points [first, first + count) as rows from `row` of the block on.
    std::function<void(const Points& points, std::size_t first, std::size_t count, std::size_t row)>
        fill;
    std::function<const void*()> block;
  };

  void check(int status) const {
    if (status != NC_NOERR) {
      throw FileError(output_.path(), {},
                      fmt::format("cannot be written: {}", nc_strerror(status)));
    }
  }

  void put_text(int variable, const std::string& name, std::string_view text) {
    check(nc_put_att_text(*id_, variable, name.c_str(), text.size(), text.data()));
  }

  void put_attributes(const CloudHeader& header) {
    for (const auto& [name, value] : header.provenance) put_text(NC_GLOBAL, name, value);
    put_text(NC_GLOBAL, "Conventions", "CF-1.9");
    put_text(NC_GLOBAL, "featureType", "point");
    put_text(NC_GLOBAL, "title", "Points of a Risley-prism lidar with their uncertainty");
    put_text(NC_GLOBAL, "sensor", header.sensor);
    put_text(NC_GLOBAL, "serial", header.serial);
    put_text(NC_GLOBAL, "frame", kFrameText);
    put_text(NC_GLOBAL, "time_reference", recordings::to_string(header.time_reference));
  }

  /// @param value  of one entry: value(points, point, column), column in [0, width)
  template <class T, class Value>
  int define(const Description& what, Value value, std::optional<int> inner_dimension = {},
             std::size_t width = 1) {
    const std::array<int, 2> dimensions{point_, inner_dimension.value_or(0)};
    const std::array<std::size_t, 2> chunk{kBlockRows, width};
    int id = 0;
    check(nc_def_var(*id_, what.name.c_str(), nc_type_of<T>(), inner_dimension ? 2 : 1,
                     dimensions.data(), &id));
    check(nc_def_var_chunking(*id_, id, NC_CHUNKED, chunk.data()));
    check(nc_def_var_deflate(*id_, id, NC_SHUFFLE, 1, 1));
    // Whole blocks come in order: more of them would only cost memory.
    check(nc_set_var_chunk_cache(*id_, id, kBlockRows * width * sizeof(T), 3, 1.0F));
    put_text(id, "units", what.units);
    put_text(id, "long_name", what.long_name);
    auto block = std::make_shared<std::vector<T>>(kBlockRows * width);
    variables_.push_back({id, width,
                          [block, value, width](const Points& points, std::size_t first,
                                                std::size_t count, std::size_t row) {
                            T* to = block->data() + row * width;
                            for (std::size_t i = first; i < first + count; ++i) {
                              for (std::size_t k = 0; k < width; ++k)
                                *to++ = static_cast<T>(value(points, i, k));
                            }
                          },
                          [block]() -> const void* { return block->data(); }});
    return id;
  }

  /// As define, with the attribute that leads to the coordinates.
  template <class T, class Value>
  int define_data(const Description& what, Value value, std::optional<int> inner_dimension = {},
                  std::size_t width = 1) {
    const int id = define<T>(what, value, inner_dimension, width);
    put_text(id, "coordinates", "time x_m y_m z_m");
    return id;
  }

  void define_sensor_variables(const CloudHeader& header) {
    const bool utc = header.time_reference == recordings::TimeReference::utc;
    const auto time_ns = [](const Points& p, std::size_t i, std::size_t) { return p.time_ns[i]; };
    const int time = define<double>({"time", utc ? "seconds since 1970-01-01 00:00:00" : "s",
                                     "time of the shot, as in the recording"},
                                    [](const Points& p, std::size_t i, std::size_t) {
                                      return 1e-9 * static_cast<double>(p.time_ns[i]);
                                    });
    put_text(time, "axis", "T");
    if (utc) {
      put_text(time, "standard_name", "time");
      put_text(time, "calendar", "standard");
    }
    const auto coordinate = [this, &header](const char* name, const char* axis, const char* meaning,
                                            std::vector<double> Points::*column) {
      const int id = define<double>(
          {name, "m", meaning},
          [column](const Points& p, std::size_t i, std::size_t) { return (p.*column)[i]; });
      put_text(id, "axis", axis);
      if (header.has_covariance) put_text(id, "ancillary_variables", fmt::format("std_{}", name));
    };
    coordinate("x_m", "X", "forward", &Points::x);
    coordinate("y_m", "Y", "left", &Points::y);
    coordinate("z_m", "Z", "up", &Points::z);
    define_data<std::int64_t>({"time_ns", "ns", "time without rounding"}, time_ns);
    const auto byte = [this](const char* name, const char* meaning,
                             std::vector<std::uint8_t> Points::*column) {
      define_data<std::uint8_t>(
          {name, "1", meaning},
          [column](const Points& p, std::size_t i, std::size_t) { return (p.*column)[i]; });
    };
    byte("intensity", "intensity as the sensor reports it", &Points::intensity);
    byte("return_number", "number of the return within its shot, from 1", &Points::return_number);
    byte("number_of_returns", "returns of the shot", &Points::number_of_returns);
    byte("tag", "tag byte of the sensor", &Points::tag);
    byte("beam", "firing beam, from 0", &Points::beam);
  }

  void define_covariance() {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      define_data<float>({fmt::format("std_{}_m", kAxes[axis]), "m",
                          fmt::format("standard deviation of {}_m", kAxes[axis])},
                         [term = kVariances[axis]](const Points& p, std::size_t i, std::size_t) {
                           return std::sqrt(p.covariance[term][i]);
                         });
    }
    for (std::size_t term = 0; term < kCovarianceTerms; ++term) {
      const char* name = kTermNames[term];
      define_data<float>(
          {fmt::format("covariance_{}_m2", name), "m2",
           fmt::format("covariance of {}_m and {}_m", name[0], name[1])},
          [term](const Points& p, std::size_t i, std::size_t) { return p.covariance[term][i]; });
    }
  }

  void define_geometry(const CloudHeader& header) {
    define_data<float>({"range_m", "m", "range from where the beam leaves the sensor"},
                       [](const Points& p, std::size_t i, std::size_t) { return p.range[i]; });
    const int incidence = define_data<float>(
        {"incidence_angle_deg", "degree", "angle between beam and surface normal"},
        [](const Points& p, std::size_t i, std::size_t) {
          return degrees_from_radians(p.incidence[i]);
        });
    const float unknown = std::numeric_limits<float>::quiet_NaN();
    check(nc_def_var_fill(*id_, incidence, NC_FILL, &unknown));
    if (!header.has_rotation_angles) return;
    for (int k = 0; k < header.prisms; ++k) {
      define_data<float>(
          {fmt::format("rotation_angle_{}_deg", prism_letter(k)), "degree",
           fmt::format("rotation angle of prism {}", prism_letter(k))},
          [k](const Points& p, std::size_t i, std::size_t) {
            return degrees_from_radians(p.rotation_angle[static_cast<std::size_t>(k)][i]);
          });
    }
    define_data<float>({"azimuth_residual_deg", "degree", "reported minus smoothed azimuth"},
                       [](const Points& p, std::size_t i, std::size_t) {
                         return degrees_from_radians(p.azimuth_residual[i]);
                       });
    define_data<float>({"zenith_residual_deg", "degree", "reported minus smoothed zenith angle"},
                       [](const Points& p, std::size_t i, std::size_t) {
                         return degrees_from_radians(p.zenith_residual[i]);
                       });
  }

  /// The variable of the factors' names, if there are factors.
  std::optional<int> define_loadings(std::size_t factors) {
    if (factors == 0) return std::nullopt;
    int factor = 0, names = 0;
    check(nc_def_dim(*id_, "factor", factors, &factor));
    check(nc_def_var(*id_, "factor_name", NC_STRING, 1, &factor, &names));
    put_text(names, "long_name",
             "common factor, one standard deviation of which the loadings tell");
    for (std::size_t axis = 0; axis < 3; ++axis) {
      define_data<float>(
          {fmt::format("loading_{}_m", kAxes[axis]), "m",
           fmt::format("change of {}_m by one standard deviation of a common factor", kAxes[axis])},
          [axis](const Points& p, std::size_t i, std::size_t k) { return p.loading[k][axis][i]; },
          factor, factors);
    }
    return names;
  }

  void put_block() {
    for (const Variable& variable : variables_) {
      const std::array<std::size_t, 2> start{written_, 0}, count{rows_, variable.width};
      check(nc_put_vara(*id_, variable.id, start.data(), count.data(), variable.block()));
    }
    written_ += rows_;
    rows_ = 0;
  }

  io::OutputFile output_;
  NcHandle id_;    // after output_: closed before the temporary is removed
  int point_ = 0;  ///< the dimension
  std::vector<Variable> variables_;
  std::size_t rows_ = 0;     ///< in the block
  std::size_t written_ = 0;  ///< in the file
};

}  // namespace

const CloudWriterFormat kNetcdfFormat = {
    "netcdf", ".nc", "NetCDF-4 after the CF conventions, compressed",
    [](const std::string& path, const CloudHeader& header, const CloudWriterOptions&)
        -> std::unique_ptr<CloudWriter> { return std::make_unique<NetcdfWriter>(path, header); }};

}  // namespace risley::cloud
