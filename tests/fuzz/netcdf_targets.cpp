// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// NetCDF files whose values, lengths and names were changed through the library: random bytes
// hardly ever make a file that it opens.
#include <algorithm>
#include <array>
#include <cstring>
#include <string>

#include <netcdf.h>

#include "risley/core/error.hpp"
#include "risley/recordings/reader.hpp"
#include "risley/recordings/truth.hpp"
#include "risley/recordings/writer.hpp"

#include "fuzz/invariants.hpp"
#include "fuzz/targets.hpp"
#include "io/test_folder.hpp"

namespace risley::fuzz {
namespace {

/// The bytes as numbers, zeros behind their end.
class Numbers {
 public:
  explicit Numbers(std::span<const std::uint8_t> bytes) : left_(bytes) {}
  bool empty() const { return left_.empty(); }
  template <class T>
  T next() {
    std::array<std::uint8_t, sizeof(T)> raw{};
    const std::size_t count = std::min(raw.size(), left_.size());
    std::copy_n(left_.begin(), count, raw.begin());
    left_ = left_.subspan(count);
    T value;
    std::memcpy(&value, raw.data(), sizeof value);
    return value;
  }
  int below(int count) { return count > 0 ? next<std::uint8_t>() % count : 0; }

 private:
  std::span<const std::uint8_t> left_;
};

constexpr std::size_t kRows = 8;

void write_recording(const std::string& path) {
  recordings::RecordingHeader header;
  header.devices.resize(2);
  header.devices[1].index = 1;
  header.returns_per_shot = 3;
  recordings::Chunk chunk;
  recordings::Observations& rows = chunk.observations;
  rows.resize(kRows);
  for (std::size_t i = 0; i < kRows; ++i) {
    rows.time_ns[i] = static_cast<std::int64_t>(10'000 * i);
    rows.azimuth[i] = 0.01 * static_cast<double>(i);
    rows.zenith[i] = 1.5;
    rows.range[i] = 10;
    rows.device[i] = i % 2;
    rows.return_number[i] = rows.valid[i] = 1;
  }
  chunk.packets.resize(3);
  chunk.packets[0].rows = chunk.packets[1].rows = kRows / 2;
  chunk.packets[2].data_type = 6;
  chunk.imu.resize(1);
  const auto writer = recordings::create_recording(path, header);
  writer->write(chunk);
  writer->close();
}

void write_truth(const std::string& path) {
  recordings::TruthColumns rows;
  rows.resize(2, kRows);
  for (std::size_t i = 0; i < kRows; ++i) rows.time_ns[i] = static_cast<std::int64_t>(i);
  recordings::TruthWriter writer(path, 2);
  writer.write(rows);
  writer.close();
}

/// Changes what the numbers name: values, attributes, names, new dimensions and variables.
void change(const std::string& path, Numbers& numbers) {
  int file = 0;
  if (nc_open(path.c_str(), NC_WRITE, &file) != NC_NOERR) return;
  for (int changes = 0; changes < 8 && !numbers.empty(); ++changes) {
    int dimensions = 0, variables = 0, attributes = 0;
    nc_inq(file, &dimensions, &variables, &attributes, nullptr);
    const int variable = numbers.below(variables);
    std::array<char, NC_MAX_NAME + 1> name{};
    switch (numbers.below(6)) {
      case 0: {
        const std::array<std::size_t, 4> at = {numbers.next<std::uint8_t>() % (2 * kRows), 0, 0, 0};
        const auto value = numbers.next<double>();
        nc_put_var1_double(file, variable, at.data(), &value);
        break;
      }
      case 1: {
        const std::array<std::size_t, 4> at = {numbers.next<std::uint8_t>() % (2 * kRows), 0, 0, 0};
        const auto value = numbers.next<std::int64_t>();
        const auto whole = static_cast<long long>(value);
        nc_put_var1_longlong(file, variable, at.data(), &whole);
        break;
      }
      case 2: {
        const auto value = numbers.next<std::int32_t>();
        if (nc_inq_attname(file, NC_GLOBAL, numbers.below(attributes), name.data()) == NC_NOERR) {
          nc_put_att_int(file, NC_GLOBAL, name.data(), NC_INT, 1, &value);
        }
        break;
      }
      case 3: {
        std::string text(numbers.next<std::uint8_t>(), static_cast<char>(numbers.next<char>()));
        if (nc_inq_attname(file, NC_GLOBAL, numbers.below(attributes), name.data()) == NC_NOERR) {
          nc_put_att_text(file, NC_GLOBAL, name.data(), text.size(), text.data());
        }
        break;
      }
      case 4:  // renames, so that something is missing or of another shape
        if (nc_inq_varname(file, variable, name.data()) == NC_NOERR) {
          nc_redef(file);
          nc_rename_var(file, variable, "other");
          const int dimension = numbers.below(dimensions);
          int id = 0;
          nc_def_var(file, name.data(), 1 + numbers.below(NC_STRING), 1, &dimension, &id);
          nc_enddef(file);
        }
        break;
      default:
        if (nc_inq_dimname(file, numbers.below(dimensions), name.data()) == NC_NOERR) {
          nc_redef(file);
          int id = 0;
          nc_inq_dimid(file, name.data(), &id);
          nc_rename_dim(file, id, ("old_" + std::string(name.data())).c_str());
          nc_def_dim(file, name.data(), numbers.next<std::uint64_t>() >> numbers.below(64), &id);
          nc_enddef(file);
        }
    }
  }
  nc_close(file);
}

/// A file that was written and then changed as the bytes say.
std::string changed_file(void (*write)(const std::string&), std::span<const std::uint8_t> bytes) {
  static const io::TestFolder folder;
  const std::string path = folder.file("changed.nc");
  write(path);
  Numbers numbers(bytes);
  change(path, numbers);
  return path;
}

void run_recording(std::span<const std::uint8_t> bytes) {
  const std::string path = changed_file(write_recording, bytes);
  std::uint64_t rows = 0;
  try {
    const auto reader = recordings::open_recording(path);
    require_sound(reader->header());
    recordings::Chunk chunk;
    while (reader->read(chunk)) {
      require_sound(chunk, reader->header());
      rows += chunk.observations.size();
      require(rows <= 1'000'000, "rows are those of the file");
    }
  } catch (const Error&) {  // refused
  }
}

void run_truth(std::span<const std::uint8_t> bytes) {
  const std::string path = changed_file(write_truth, bytes);
  try {
    const recordings::TruthColumns rows = recordings::load_truth(path);
    recordings::require_columns(rows, rows.prisms());
    require(rows.size() <= 1'000'000, "rows are those of the file");
    const auto chosen = recordings::load_truth(path, rows.time_ns);  // those of a recording
    require(chosen.size() <= rows.size(), "no more rows than there are");
    recordings::TruthColumns twice = rows;
    twice.append(rows);
    require(twice.size() == 2 * rows.size(), "rows can be put behind others");
  } catch (const Error&) {  // refused
  }
}

}  // namespace

std::vector<Target> netcdf_targets() { return {{"netcdf", run_recording}, {"truth", run_truth}}; }

}  // namespace risley::fuzz
