// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "tables/netcdf_file.hpp"

#include <array>
#include <cerrno>
#include <filesystem>
#include <limits>

#include <fmt/format.h>
#include <hdf5.h>
#include <netcdf.h>

#include "risley/core/error.hpp"

#include "tables/netcdf_library.hpp"

namespace risley::tables {
namespace {

/// Deflate shrinks nothing by more than 1032 (zlib.net/zlib_tech.html), so a file can hold no more
/// than this many times its bytes.
constexpr std::uint64_t kMostCompression = 1040;
/// Of one block, which the library reads as a whole. Ours have 256 KiB.
constexpr std::uint64_t kMostBlockBytes = std::uint64_t{64} << 20;

/// a * b, or the largest number where the product is larger.
std::uint64_t product(std::uint64_t a, std::uint64_t b) {
  constexpr std::uint64_t kMost = std::numeric_limits<std::uint64_t>::max();
  return b != 0 && a > kMost / b ? kMost : a * b;
}

std::string shape_of(std::span<const NetcdfDimension> dimensions) {
  std::string text;
  for (const NetcdfDimension& dimension : dimensions) {
    text += fmt::format("{}{} = {}", text.empty() ? "" : ", ", dimension.name, dimension.length);
  }
  return text;
}

/// Whether values of a dataset are in other files.
bool lies_elsewhere(hid_t group, const char* name) {
  const hid_t object = H5Oopen(group, name, H5P_DEFAULT);
  if (object < 0) return false;  // reading it fails
  bool elsewhere = false;
  if (H5Iget_type(object) == H5I_DATASET) {
    const hid_t properties = H5Dget_create_plist(object);
    elsewhere = H5Pget_external_count(properties) > 0 || H5Pget_layout(properties) == H5D_VIRTUAL;
    H5Pclose(properties);
  }
  H5Oclose(object);
  return elsewhere;
}

/// Called for every link of a file. @param found  std::string*, receives a description of the first
/// that leads out of the file
/// @return not 0 to stop
herr_t find_link_outside(hid_t group, const char* name, const H5L_info_t* link, void* found) {
  const bool inside = link->type == H5L_TYPE_HARD || link->type == H5L_TYPE_SOFT;
  if (inside && !(link->type == H5L_TYPE_HARD && lies_elsewhere(group, name))) return 0;
  *static_cast<std::string*>(found) = fmt::format("{} refers to another file", name);
  return 1;
}

}  // namespace

NetcdfFile::NetcdfFile(const std::string& path) : path_(path) {
  std::error_code code;
  bytes_ = std::filesystem::file_size(path, code);
  if (code) fail(fmt::format("cannot be opened as NetCDF: {}", code.message()));
  refuse_links();
  check(nc_open(path.c_str(), NC_NOWRITE, &id_), "be opened as NetCDF");
}

NetcdfFile::~NetcdfFile() { nc_close(id_); }

void NetcdfFile::refuse_links() const {
  const htri_t is_hdf5 = H5Fis_hdf5(path_.c_str());
  if (is_hdf5 <= 0) return;  // an earlier NetCDF version contains all of its data
  const hid_t file = H5Fopen(path_.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  if (file < 0) return;  // NetCDF says why
  std::string found;
  const herr_t visited = H5Lvisit(file, H5_INDEX_NAME, H5_ITER_NATIVE, find_link_outside, &found);
  H5Fclose(file);
  if (!found.empty()) fail(found + ", and only files that contain all their data are read");
  if (visited < 0) fail("cannot be opened as NetCDF: its groups cannot be listed");
}

void NetcdfFile::check(int status, const std::string& action) const {
  if (status != NC_NOERR) fail(fmt::format("cannot {}: {}", action, netcdf_reason(status)));
}

void NetcdfFile::fail(const std::string& problem) const { throw FileError(path_, {}, problem); }

bool NetcdfFile::has_attribute(const std::string& name) const {
  int number = 0;
  return nc_inq_attid(id_, NC_GLOBAL, name.c_str(), &number) == NC_NOERR;
}

std::string NetcdfFile::text_of(int group, const std::string& name) const {
  nc_type type = NC_NAT;
  std::size_t length = 0;
  if (nc_inq_att(group, NC_GLOBAL, name.c_str(), &type, &length) != NC_NOERR || type != NC_CHAR) {
    fail(fmt::format("expected the text attribute {}, found none", name));
  }
  if (length > bytes_) {
    fail(fmt::format("attribute {}: {} characters do not fit in {} bytes", name, length, bytes_));
  }
  std::string text(length, '\0');
  check(nc_get_att_text(group, NC_GLOBAL, name.c_str(), text.data()),
        fmt::format("read attribute {}", name));
  return text;
}

std::string NetcdfFile::text(const std::string& name) const { return text_of(id_, name); }

std::uint32_t NetcdfFile::number(const std::string& name) const {
  nc_type type = NC_NAT;
  std::size_t length = 0;
  std::uint32_t value = 0;
  if (nc_inq_att(id_, NC_GLOBAL, name.c_str(), &type, &length) != NC_NOERR || length != 1 ||
      nc_get_att_uint(id_, NC_GLOBAL, name.c_str(), &value) != NC_NOERR) {
    fail(fmt::format("expected the number attribute {}, found none", name));
  }
  return value;
}

std::vector<std::pair<std::string, std::string>> NetcdfFile::text_group(
    const std::string& group) const {
  const std::string action = fmt::format("read the group {}", group);
  int id = 0, count = 0;
  check(nc_inq_grp_ncid(id_, group.c_str(), &id), action);
  check(nc_inq_natts(id, &count), action);
  std::vector<std::pair<std::string, std::string>> attributes;
  for (int i = 0; i < count; ++i) {
    std::array<char, NC_MAX_NAME + 1> name{};
    check(nc_inq_attname(id, NC_GLOBAL, i, name.data()), action);
    attributes.emplace_back(name.data(), text_of(id, name.data()));
  }
  return attributes;
}

NetcdfDimension NetcdfFile::dimension(const std::string& name) const {
  NetcdfDimension dimension{name, 0, 0};
  if (nc_inq_dimid(id_, name.c_str(), &dimension.id) != NC_NOERR ||
      nc_inq_dimlen(id_, dimension.id, &dimension.length) != NC_NOERR) {
    fail(fmt::format("expected the dimension {}, found none", name));
  }
  return dimension;
}

bool NetcdfFile::has_variable(const std::string& name) const {
  int number = 0;
  return nc_inq_varid(id_, name.c_str(), &number) == NC_NOERR;
}

std::vector<std::string> NetcdfFile::texts(const std::string& name,
                                           const NetcdfDimension& along) const {
  const std::string action = fmt::format("read the texts of variable {}", name);
  int number = 0, rank = 0, dimension = 0;
  nc_type type = NC_NAT;
  if (nc_inq_varid(id_, name.c_str(), &number) != NC_NOERR ||
      nc_inq_vartype(id_, number, &type) != NC_NOERR || type != NC_STRING ||
      nc_inq_varndims(id_, number, &rank) != NC_NOERR || rank != 1 ||
      nc_inq_vardimid(id_, number, &dimension) != NC_NOERR || dimension != along.id) {
    fail(fmt::format("expected texts in variable {} along {}", name, shape_of({&along, 1})));
  }
  // In the file, a text takes at least a byte, and its bytes are stored unchanged.
  std::uint64_t bytes = along.length;
  std::vector<std::string> texts;
  for (std::size_t i = 0; i < along.length; ++i) {
    if (bytes > bytes_) {
      fail(fmt::format("variable {}: its texts do not fit in a file of {} bytes", name, bytes_));
    }
    char* text = nullptr;
    check(nc_get_var1_string(id_, number, &i, &text), action);
    texts.emplace_back(text == nullptr ? "" : text);
    if (text != nullptr) nc_free_string(1, &text);
    bytes += texts.back().size();
  }
  return texts;
}

NetcdfVariable NetcdfFile::variable(const std::string& name, NetcdfType type,
                                    std::span<const NetcdfDimension> dimensions,
                                    std::size_t block) const {
  NetcdfVariable variable{name, type, 1, 0};
  if (nc_inq_varid(id_, name.c_str(), &variable.id) != NC_NOERR) {
    fail(fmt::format("expected variable {} along {}, found none", name, shape_of(dimensions)));
  }
  const std::string action = fmt::format("read what variable {} is", name);
  nc_type found_type = NC_NAT;
  int rank = 0;
  check(nc_inq_vartype(id_, variable.id, &found_type), action);
  check(nc_inq_varndims(id_, variable.id, &rank), action);
  if (found_type != nc_type_of(type)) {
    std::array<char, NC_MAX_NAME + 1> found{};
    check(nc_inq_type(id_, found_type, found.data(), nullptr), action);
    fail(fmt::format("variable {}: expected values of type {}, found {}", name, name_of(type),
                     found.data()));
  }
  if (rank != static_cast<int>(dimensions.size())) {
    fail(fmt::format("variable {}: expected the dimensions {}, found {} dimensions", name,
                     shape_of(dimensions), rank));
  }
  std::vector<int> ids(dimensions.size());
  check(nc_inq_vardimid(id_, variable.id, ids.data()), action);
  std::uint64_t bytes = bytes_of(type);
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const NetcdfDimension& expected = dimensions[i];
    if (ids[i] != expected.id) {
      std::array<char, NC_MAX_NAME + 1> found{};
      std::size_t length = 0;
      check(nc_inq_dim(id_, ids[i], found.data(), &length), action);
      fail(fmt::format("variable {}: expected dimension {} = {}, found {} = {}", name,
                       expected.name, expected.length, found.data(), length));
    }
    bytes = product(bytes, expected.length);
    if (i > 0) variable.width = product(variable.width, expected.length);
  }
  int storage = NC_CONTIGUOUS;
  std::vector<std::size_t> blocks(dimensions.size());
  check(nc_inq_var_chunking(id_, variable.id, &storage, blocks.data()), action);
  const bool in_blocks = storage == NC_CHUNKED;
  if (bytes > (in_blocks ? product(bytes_, kMostCompression) : bytes_)) {
    fail(fmt::format("variable {}: values along {} do not fit in a file of {} bytes", name,
                     shape_of(dimensions), bytes_));
  }
  if (in_blocks) {
    std::uint64_t block_bytes = bytes_of(type);
    for (const std::size_t length : blocks) block_bytes = product(block_bytes, length);
    if (block_bytes > kMostBlockBytes) {
      fail(fmt::format("variable {}: is stored in blocks of {} bytes, allowed up to {}", name,
                       block_bytes, kMostBlockBytes));
    }
  }
  if (block > 0) {
    check(nc_set_var_chunk_cache(id_, variable.id, 2 * block * variable.width * bytes_of(type), 7,
                                 1.0F),
          fmt::format("set the cache of variable {}", name));
  }
  return variable;
}

void NetcdfFile::get(const NetcdfVariable& variable, std::size_t first, std::size_t count,
                     void* values) const {
  // One or two dimensions, the second of which is read whole.
  const std::array<std::size_t, 2> start{first, 0}, counts{count, variable.width};
  check(
      nc_get_vara(id_, variable.id, start.data(), counts.data(), values),
      fmt::format("read entries {} to {} of variable {}", first, first + count - 1, variable.name));
}

}  // namespace risley::tables
