// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/io/block_file.hpp"
#include "risley/io/output_file.hpp"

/// @file
/// NetCDF-4 files. The library behind them, HDF5 included, is not thread-safe: writing holds one
/// lock of the whole process, and every file that is read has a separate process, so that any
/// number of threads may each have files open. A single file belongs to one thread at a time.
namespace risley::tables {

/// Types of values in files; text is an array of characters.
enum class NetcdfType { text, uint8, int32, uint32, int64, uint64, float32, float64 };

/// The type in the file for a C++ type; char represents text.
template <class T>
constexpr NetcdfType netcdf_type_of() {
  if constexpr (std::is_same_v<T, char>) return NetcdfType::text;
  if constexpr (std::is_same_v<T, std::uint8_t>) return NetcdfType::uint8;
  if constexpr (std::is_same_v<T, std::int32_t>) return NetcdfType::int32;
  if constexpr (std::is_same_v<T, std::uint32_t>) return NetcdfType::uint32;
  if constexpr (std::is_same_v<T, std::int64_t>) return NetcdfType::int64;
  if constexpr (std::is_same_v<T, std::uint64_t>) return NetcdfType::uint64;
  if constexpr (std::is_same_v<T, float>) return NetcdfType::float32;
  if constexpr (std::is_same_v<T, double>) return NetcdfType::float64;
}

/// A dimension of an open file.
struct NetcdfDimension {
  std::string name;
  std::size_t length = 0;  ///< entries; 0 in an output: it grows
  int id = 0;
};

/// A variable of an open file.
struct NetcdfVariable {
  std::string name;
  NetcdfType type = NetcdfType::float64;
  std::size_t width = 1;  ///< values per entry of the first dimension
  int id = 0;
};

/// Layout of a variable's values in a file.
struct NetcdfStorage {
  std::size_t block = 0;    ///< entries of the first dimension per block; 0: the library's choice
  bool compressed = false;  ///< blocks are shuffled and deflated
  bool checksum = false;    ///< damage of a block is detected on reading
};

/// A NetCDF-4 file that is written. It appears under its name, complete, at close(); otherwise
/// nothing remains. First everything is defined, then end_definitions(), then values. Everything
/// throws FileError if writing or the library fails, and InvalidArgument for dimensions, values and
/// texts that do not match each other.
class NetcdfOutput {
 public:
  explicit NetcdfOutput(const std::string& path);
  /// Writes to an output that the caller commits. @param output  must outlive this
  explicit NetcdfOutput(const io::OutputFile& output);
  ~NetcdfOutput();
  NetcdfOutput(const NetcdfOutput&) = delete;
  NetcdfOutput& operator=(const NetcdfOutput&) = delete;

  const std::string& path() const;  ///< final name after close()

  /// @param length  at least 1
  NetcdfDimension define_dimension(const std::string& name, std::size_t length);
  /// A dimension that grows with the written data.
  NetcdfDimension define_growing_dimension(const std::string& name);

  /// @param dimensions  one or two; only the first may grow
  template <class T>
  NetcdfVariable define(const std::string& name,
                        std::initializer_list<const NetcdfDimension*> dimensions,
                        const NetcdfStorage& storage) {
    return define(name, netcdf_type_of<T>(), dimensions, storage);
  }
  /// A variable of texts along one dimension, with its values.
  void define_texts(const std::string& name, const NetcdfDimension& along,
                    std::string_view long_name, std::vector<std::string> texts);
  /// Value of unwritten entries, which readers may treat as "missing".
  void set_fill(const NetcdfVariable& variable, float value);

  /// A text attribute of the file.
  void put_text(const std::string& name, std::string_view text);
  /// A text attribute of a variable.
  void put_text(const NetcdfVariable& variable, const std::string& name, std::string_view text);
  /// A number as an attribute of the file, uint32.
  void put_number(const std::string& name, std::uint32_t value);
  /// As above, int32.
  void put_number(const std::string& name, std::int32_t value);
  /// Bytes as an attribute of a variable.
  void put_numbers(const NetcdfVariable& variable, const std::string& name,
                   std::span<const std::uint8_t> values);
  /// Creates a group with only text attributes, name and value each.
  void put_text_group(const std::string& group,
                      const std::vector<std::pair<std::string, std::string>>& attributes);

  /// Afterwards only values are written.
  void end_definitions();

  /// Writes entries [first, first + values.size() / width) of a variable.
  template <class T>
  void put(const NetcdfVariable& variable, std::size_t first, std::span<const T> values) {
    put(variable, netcdf_type_of<T>(), first, values.data(), values.size());
  }
  /// As above, for a whole vector.
  template <class T>
  void put(const NetcdfVariable& variable, std::size_t first, const std::vector<T>& values) {
    put(variable, first, std::span<const T>(values));
  }

  /// Completes the file and renames it, unless the caller does.
  void close();

 private:
  class File;

  NetcdfVariable define(const std::string& name, NetcdfType type,
                        std::span<const NetcdfDimension* const> dimensions,
                        const NetcdfStorage& storage);
  void put(const NetcdfVariable& variable, NetcdfType type, std::size_t first, const void* values,
           std::size_t count);

  std::unique_ptr<File> file_;
};

/// A NetCDF file that is read. Its statements are believed only as far as its bytes allow:
/// everything throws FileError, naming variable, dimension or attribute, if something is missing,
/// of another kind, larger than the file can hold, or in another file. The library runs in a child
/// process: a file on which it crashes, never finishes or needs too much memory is a FileError,
/// too. Calls with no or more than two dimensions, or with values of another type than their
/// variable's, throw InvalidArgument. docs/decisions/0008-netcdf-in-a-child-process.md
class NetcdfInput {
 public:
  /// @param progress  stops waiting for the library; its flag must outlive the file
  explicit NetcdfInput(io::InputFile file, const Progress& progress = {});
  ~NetcdfInput();
  NetcdfInput(const NetcdfInput&) = delete;
  NetcdfInput& operator=(const NetcdfInput&) = delete;

  const std::string& path() const { return file_.path(); }  ///< as it was given

  /// Whether the file has an attribute of that name.
  bool has_attribute(const std::string& name) const;
  /// A text attribute of the file. @throws FileError if it is missing or not a text
  std::string text(const std::string& name) const;
  /// Any whole number that fits.
  std::uint32_t number(const std::string& name) const;
  /// All attributes of a group, which must be texts.
  std::vector<std::pair<std::string, std::string>> text_group(const std::string& group) const;

  /// A dimension by its name. @throws FileError where it is missing
  NetcdfDimension dimension(const std::string& name) const;
  /// As above. @throws FileError for another length, too
  NetcdfDimension dimension(const std::string& name, std::size_t length) const;
  /// Whether the file has a variable of that name, whatever its type.
  bool has_variable(const std::string& name) const;

  /// All values of a variable of texts along one dimension, as NetcdfOutput::define_texts() writes
  /// it. @throws FileError for another one, too
  std::vector<std::string> texts(const std::string& name, const NetcdfDimension& along) const;

  /// A variable of values of type T along exactly these dimensions.
  /// @param block  entries of the first dimension to be read together, for the cache; 0: the
  /// library's choice
  template <class T>
  NetcdfVariable variable(const std::string& name,
                          std::initializer_list<const NetcdfDimension*> dimensions,
                          std::size_t block = 0) const {
    return variable(name, netcdf_type_of<T>(), dimensions, block);
  }

  /// Reads entries [first, first + count) of a variable; `values` gets count * width of them.
  template <class T>
  void get(const NetcdfVariable& variable, std::size_t first, std::size_t count,
           std::vector<T>& values) const {
    values.resize(count * variable.width);
    get(variable, netcdf_type_of<T>(), first, count, values.data());
  }

  /// @throws FileError with this file's path
  [[noreturn]] void fail(const std::string& problem) const;

 private:
  NetcdfVariable variable(const std::string& name, NetcdfType type,
                          std::span<const NetcdfDimension* const> dimensions,
                          std::size_t block) const;
  void get(const NetcdfVariable& variable, NetcdfType type, std::size_t first, std::size_t count,
           void* values) const;

  io::InputFile file_;
  class Process;
  std::unique_ptr<Process> process_;
};

}  // namespace risley::tables
