// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <H5Fpublic.h>
#include <fmt/format.h>
#include <netcdf.h>

#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/io/output_file.hpp"
#include "risley/tables/netcdf.hpp"

#include "tables/netcdf_library.hpp"

namespace risley::tables {

namespace {

/// One more handle of a file that NetCDF has open, below 0 without one. NetCDF crashes the process
/// if the system fails to close a file, so another handle must be closed last.
hid_t another_handle(const std::string& path) {
  std::vector<hid_t> files(
      static_cast<std::size_t>(std::max<ssize_t>(0, H5Fget_obj_count(H5F_OBJ_ALL, H5F_OBJ_FILE))));
  if (H5Fget_obj_ids(H5F_OBJ_ALL, H5F_OBJ_FILE, files.size(), files.data()) < 0) return -1;
  for (const hid_t file : files) {
    std::string name(path.size() + 2, '\0');
    const ssize_t length = H5Fget_name(file, name.data(), name.size());
    if (length >= 0 && name.c_str() == path) return H5Freopen(file);
  }
  return -1;
}

}  // namespace

/// The open file. Its members expect the lock to be held, except close().
class NetcdfOutput::File {
 public:
  explicit File(const std::string& path) : own_(path), output_(*own_) { create(); }
  explicit File(const io::OutputFile& output) : output_(output) { create(); }
  ~File() {
    if (!id_) return;
    const NetcdfLock lock;
    // After a failed close, HDF5 crashes the process at its exit. The partial file will be removed,
    // so on a full disk its room serves to close it.
    std::error_code ignored;
    if (nc_sync(*id_) != NC_NOERR) {
      std::filesystem::resize_file(output_.temporary_path(), 0, ignored);
    }
    close_library();
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  int id() const { return *id_; }
  const std::string& path() const { return output_.path(); }

  /// @param affected  part of the file, empty for the whole
  void check(int status, const std::string& part) const {
    if (status == NC_NOERR) return;
    throw FileError(path(), {},
                    fmt::format("cannot be written: {}{}{}", part, part.empty() ? "" : ": ",
                                netcdf_reason(status)));
  }

  void put_text(int group, int variable, const std::string& name, std::string_view text) const {
    check(nc_put_att_text(group, variable, name.c_str(), text.size(), text.data()),
          fmt::format("attribute {}", name));
  }

  void define_texts(int variable, std::vector<std::string> texts) {
    texts_.emplace_back(variable, std::move(texts));
  }

  void end_definitions() {
    check(nc_enddef(id()), "");
    for (const auto& [variable, texts] : texts_) {
      std::vector<const char*> values;
      for (const std::string& text : texts) values.push_back(text.c_str());
      check(nc_put_var_string(id(), variable, values.data()), "names");
    }
    texts_.clear();
  }

  void close() {
    {
      const NetcdfLock lock;
      // A full disk fails now, while the destructor can still help.
      check(nc_sync(id()), "");
      check(close_library(), "");
    }
    if (own_) own_->commit();
  }

 private:
  /// @return the library's status
  int close_library() {
    const hid_t last = another_handle(output_.temporary_path());
    const int status = nc_close(id());
    id_.reset();
    const bool closed = last < 0 || H5Fclose(last) >= 0;
    return status == NC_NOERR && !closed ? NC_EHDFERR : status;
  }
  void create() {
    const NetcdfLock lock;
    int id = 0;
    check(nc_create(output_.temporary_path().c_str(), NC_NETCDF4 | NC_CLOBBER, &id), "");
    id_ = id;
  }

  std::optional<io::OutputFile> own_;
  const io::OutputFile& output_;
  std::optional<int> id_;
  std::vector<std::pair<int, std::vector<std::string>>> texts_;  ///< not written yet
};

NetcdfOutput::NetcdfOutput(const std::string& path) : file_(std::make_unique<File>(path)) {}
NetcdfOutput::NetcdfOutput(const io::OutputFile& output) : file_(std::make_unique<File>(output)) {}
NetcdfOutput::~NetcdfOutput() = default;

const std::string& NetcdfOutput::path() const { return file_->path(); }

NetcdfDimension NetcdfOutput::define_dimension(const std::string& name, std::size_t length) {
  require_at_least(fmt::format("length of dimension {}", name), static_cast<long long>(length), 1);
  const NetcdfLock lock;
  NetcdfDimension dimension{name, length, 0};
  file_->check(nc_def_dim(file_->id(), name.c_str(), length, &dimension.id),
               fmt::format("dimension {}", name));
  return dimension;
}

NetcdfDimension NetcdfOutput::define_growing_dimension(const std::string& name) {
  const NetcdfLock lock;
  NetcdfDimension dimension{name, 0, 0};
  file_->check(nc_def_dim(file_->id(), name.c_str(), NC_UNLIMITED, &dimension.id),
               fmt::format("dimension {}", name));
  return dimension;
}

NetcdfVariable NetcdfOutput::define(const std::string& name, NetcdfType type,
                                    std::span<const NetcdfDimension* const> dimensions,
                                    const NetcdfStorage& storage) {
  require_dimensions(name, dimensions);
  for (const NetcdfDimension* inner : dimensions.subspan(1)) {
    require_at_least(fmt::format("length of the inner dimension {}", inner->name),
                     static_cast<long long>(inner->length), 1);
  }
  const NetcdfLock lock;
  const std::string part = fmt::format("variable {}", name);
  NetcdfVariable variable{name, type, 1, 0};
  std::vector<int> ids;
  std::vector<std::size_t> block;
  for (const NetcdfDimension* dimension : dimensions) {
    ids.push_back(dimension->id);
    block.push_back(block.empty() ? storage.block : dimension->length);
    if (block.size() > 1) variable.width *= dimension->length;
  }
  const int file = file_->id();
  file_->check(nc_def_var(file, name.c_str(), nc_type_of(type), static_cast<int>(ids.size()),
                          ids.data(), &variable.id),
               part);
  if (storage.block == 0) return variable;
  file_->check(nc_def_var_chunking(file, variable.id, NC_CHUNKED, block.data()), part);
  if (storage.compressed) {
    file_->check(nc_def_var_deflate(file, variable.id, NC_SHUFFLE, 1, 1), part);
  }
  if (storage.checksum) {
    file_->check(nc_def_var_fletcher32(file, variable.id, NC_FLETCHER32), part);
  }
  // Entries come in order: more than one block would only cost memory.
  file_->check(nc_set_var_chunk_cache(file, variable.id,
                                      storage.block * variable.width * bytes_of(type), 3, 1.0F),
               part);
  return variable;
}

void NetcdfOutput::define_texts(const std::string& name, const NetcdfDimension& along,
                                std::string_view long_name, std::vector<std::string> texts) {
  require_length(fmt::format("variable {}", name), texts.size(), along.length);
  const NetcdfLock lock;
  int variable = 0;
  file_->check(nc_def_var(file_->id(), name.c_str(), NC_STRING, 1, &along.id, &variable),
               fmt::format("variable {}", name));
  file_->put_text(file_->id(), variable, "long_name", long_name);
  file_->define_texts(variable, std::move(texts));
}

void NetcdfOutput::set_fill(const NetcdfVariable& variable, float value) {
  if (variable.type != NetcdfType::float32) {
    throw InvalidArgument(fmt::format("variable {} has the type {}, its fill value has float",
                                      variable.name, name_of(variable.type)));
  }
  const NetcdfLock lock;
  file_->check(nc_def_var_fill(file_->id(), variable.id, NC_FILL, &value),
               fmt::format("variable {}", variable.name));
}

void NetcdfOutput::put_text(const std::string& name, std::string_view text) {
  const NetcdfLock lock;
  file_->put_text(file_->id(), NC_GLOBAL, name, text);
}

void NetcdfOutput::put_text(const NetcdfVariable& variable, const std::string& name,
                            std::string_view text) {
  const NetcdfLock lock;
  file_->put_text(file_->id(), variable.id, name, text);
}

void NetcdfOutput::put_number(const std::string& name, std::uint32_t value) {
  const NetcdfLock lock;
  file_->check(nc_put_att_uint(file_->id(), NC_GLOBAL, name.c_str(), NC_UINT, 1, &value),
               fmt::format("attribute {}", name));
}

void NetcdfOutput::put_number(const std::string& name, std::int32_t value) {
  const NetcdfLock lock;
  file_->check(nc_put_att_int(file_->id(), NC_GLOBAL, name.c_str(), NC_INT, 1, &value),
               fmt::format("attribute {}", name));
}

void NetcdfOutput::put_numbers(const NetcdfVariable& variable, const std::string& name,
                               std::span<const std::uint8_t> values) {
  const NetcdfLock lock;
  file_->check(nc_put_att_uchar(file_->id(), variable.id, name.c_str(), NC_UBYTE, values.size(),
                                values.data()),
               fmt::format("attribute {}", name));
}

void NetcdfOutput::put_text_group(
    const std::string& group, const std::vector<std::pair<std::string, std::string>>& attributes) {
  const NetcdfLock lock;
  int id = 0;
  file_->check(nc_def_grp(file_->id(), group.c_str(), &id), fmt::format("group {}", group));
  for (const auto& [name, text] : attributes) file_->put_text(id, NC_GLOBAL, name, text);
}

void NetcdfOutput::end_definitions() {
  const NetcdfLock lock;
  file_->end_definitions();
}

void NetcdfOutput::put(const NetcdfVariable& variable, NetcdfType type, std::size_t first,
                       const void* values, std::size_t count) {
  if (type != variable.type || count % variable.width != 0) {
    throw InvalidArgument(
        fmt::format("variable {}: {} values of type {}, expected {} in groups "
                    "of {}",
                    variable.name, count, name_of(type), name_of(variable.type), variable.width));
  }
  if (count == 0) return;
  const NetcdfLock lock;
  // All variables have one or two dimensions, the second of which is written whole.
  const std::array<std::size_t, 2> start{first, 0}, counts{count / variable.width, variable.width};
  file_->check(nc_put_vara(file_->id(), variable.id, start.data(), counts.data(), values),
               fmt::format("variable {}", variable.name));
}

void NetcdfOutput::close() { file_->close(); }

}  // namespace risley::tables
