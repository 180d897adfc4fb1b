// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <memory>
#include <mutex>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <pybind11/stl.h>

#include "risley/core/direction.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/json/results.hpp"
#include "risley/recordings/observations.hpp"
#include "risley/recordings/reader.hpp"
#include "risley/recordings/writer.hpp"

#include "python/arrays.hpp"
#include "python/bind.hpp"
#include "python/call.hpp"
#include "python/json.hpp"
#include "python/reading.hpp"

namespace risley::python {
namespace {

using recordings::Observations;
using recordings::Recording;
using recordings::RecordingHeader;
using SharedRecording = std::shared_ptr<Recording>;

/// As results have them.
py::object warnings_of(const std::vector<Warning>& warnings) {
  return py::module_::import("risley._results").attr("warnings_of")(python_of(json::of(warnings)));
}

/// Pieces no longer in use, kept to be filled again: touching fresh memory costs more than
/// reading.
class SparePieces : public std::enable_shared_from_this<SparePieces> {
 public:
  /// A piece of any content that is returned when its last owner releases it.
  SharedRecording take() {
    std::unique_ptr<Recording> piece;
    {
      const std::lock_guard lock(mutex_);
      if (!spare_.empty()) {
        piece = std::move(spare_.back());
        spare_.pop_back();
      }
    }
    if (!piece) piece = std::make_unique<Recording>();
    return {piece.release(), [home = weak_from_this()](Recording* done) {
              std::unique_ptr<Recording> owned(done);
              const auto pieces = home.lock();
              if (!pieces) return;
              const std::lock_guard lock(pieces->mutex_);
              if (pieces->spare_.size() < kMost) pieces->spare_.push_back(std::move(owned));
            }};
  }

 private:
  static constexpr std::size_t kMost = 2;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Recording>> spare_;
};

/// Continues reading after the last piece.
class ChunkReader {
 public:
  ChunkReader(const std::string& path, std::size_t rows, const recordings::ReadOptions& options)
      : rows_(rows) {
    require_at_least("rows", static_cast<long long>(rows), 1);
    run_job(
        py::none(), 0,
        [&](const Progress& progress) {
          reader_ = recordings::open_recording(path, options, progress.silent());
        },
        &cancel_);
    const std::string& format = reader_->header().format;
    may_wait_ =
        rows > kQuickRows || format == "netcdf" || format == "mcap" || format.ends_with("-bag");
  }

  SharedRecording next() {
    const Turn turn(busy_);
    if (!reader_) throw py::stop_iteration();
    SharedRecording piece = spare_->take();
    bool more = false;
    const auto read = [&] { more = reader_->read(piece->data, rows_); };
    if (may_wait_) {
      run_job(
          py::none(), 0, [&](const Progress&) { read(); }, &cancel_);
    } else {  // switching to another thread and back takes half as long as reading
      unlocked(read);
    }
    if (!more) throw py::stop_iteration();
    piece->header = reader_->header();
    return piece;
  }

  void close() {
    const Turn turn(busy_);
    if (!reader_) return;
    header_ = reader_->header();
    warnings_ = reader_->warnings();
    fraction_ = reader_->fraction_read();
    reader_.reset();
    spare_ = std::make_shared<SparePieces>();
  }

  RecordingHeader header() {
    const Turn turn(busy_);
    return reader_ ? reader_->header() : header_;
  }
  std::vector<Warning> warnings() {
    const Turn turn(busy_);
    return reader_ ? reader_->warnings() : warnings_;
  }
  double fraction_read() {
    const Turn turn(busy_);
    return reader_ ? reader_->fraction_read() : fraction_;
  }

 private:
  /// While a piece is read, without the lock, neither another thread nor a signal handler may
  /// interfere.
  class Turn {
   public:
    explicit Turn(bool& busy) : busy_(busy) {
      if (busy) throw py::value_error("another call is reading this recording");
      busy = true;
    }
    ~Turn() { busy_ = false; }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;

   private:
    bool& busy_;
  };

  std::size_t rows_;
  static constexpr std::size_t kQuickRows = 1'000'000;  // read in a fraction of a second
  bool may_wait_ = false;  ///< if only the flag stops a wait, for a library or for the next row
  bool busy_ = false;
  std::shared_ptr<SparePieces> spare_ = std::make_shared<SparePieces>();
  CancelFlag cancel_;
  std::unique_ptr<recordings::Reader> reader_;
  // Of a reader that was closed.
  RecordingHeader header_;
  std::vector<Warning> warnings_;
  double fraction_ = 0;
};

/// Fills a column from an array of one value per row, or one for all.
template <class T, class Array>
void take_column(std::vector<T>& column, const Array& array, std::string_view name,
                 std::size_t rows) {
  if (array.ndim() > 1) {
    throw InvalidArgument(
        fmt::format("{} has the shape {}, expected ({},)", name, shape_text(array), rows));
  }
  if (array.ndim() == 0) {
    column.assign(rows, static_cast<T>(array.data()[0]));
    return;
  }
  require_length(name, static_cast<std::size_t>(array.size()), rows);
  column.assign(array.data(), array.data() + array.size());
}

SharedRecording recording_from_arrays(const py::object& time_ns, const py::object& azimuth,
                                      const py::object& zenith, const py::object& range,
                                      const py::dict& others, const std::string& serial,
                                      std::uint8_t device_type) {
  const RunningCall call;
  auto recording = std::make_shared<Recording>();
  Observations& rows = recording->data.observations;
  RecordingHeader& header = recording->header;
  header.format = "arrays";
  header.devices.emplace_back();
  header.devices.front().serial = serial;
  header.devices.front().type = device_type;
  header.has_times = !time_ns.is_none();
  header.has_range = !range.is_none();
  header.has_intensity = others.contains("intensity");

  const Numbers azimuths = numbers_from(azimuth, "azimuth");
  if (azimuths.ndim() != 1) {
    throw InvalidArgument(
        fmt::format("azimuth has the shape {}, expected one value per row", shape_text(azimuths)));
  }
  const auto count = static_cast<std::size_t>(azimuths.size());
  take_column(rows.azimuth, azimuths, "azimuth", count);
  take_column(rows.zenith, numbers_from(zenith, "zenith"), "zenith", count);
  if (header.has_range) {
    take_column(rows.range, numbers_from(range, "range"), "range", count);
  } else {
    rows.range.assign(count, std::numeric_limits<double>::quiet_NaN());
  }
  if (header.has_times) {
    take_column(rows.time_ns, times_from(time_ns, "time_ns"), "time_ns", count);
  } else {
    rows.time_ns.resize(count);
    std::iota(rows.time_ns.begin(), rows.time_ns.end(), 0);
  }
  const auto take_numbers = [&](std::vector<float>& column, const char* name) {
    const py::object given = others.attr("pop")(name, 0.0);
    take_column(column, numbers_from(given, name), name, count);
  };
  take_numbers(rows.azimuth_resolution, "azimuth_resolution");
  take_numbers(rows.zenith_resolution, "zenith_resolution");
  take_numbers(rows.range_resolution, "range_resolution");
  const auto take_bytes = [&](std::vector<std::uint8_t>& column, const char* name, int usual) {
    const py::object given = others.attr("pop")(name, usual);
    take_column(column, bytes_from(given, name), name, count);
  };
  take_bytes(rows.intensity, "intensity", 0);
  take_bytes(rows.return_number, "return_number", 1);
  take_bytes(rows.tag, "tag", 0);
  take_bytes(rows.beam, "beam", 0);
  rows.device.assign(count, 0);
  if (others.contains("valid")) {
    take_bytes(rows.valid, "valid", 1);
  } else {
    recordings::mark_valid(rows);
  }
  for (const auto& [name, values] : others) {
    throw py::type_error(fmt::format("unknown column {}", name.cast<std::string>()));
  }
  header.returns_per_shot =
      count == 0 ? 1 : *std::max_element(rows.return_number.begin(), rows.return_number.end());
  recordings::require_angles(rows);
  return recording;
}

/// Some rows as a separate recording. @param key  as numpy accepts it for an array of all rows
SharedRecording some_rows(const SharedRecording& recording, const py::object& key) {
  const Observations& all = recording->data.observations;
  const py::module_ numpy = py::module_::import("numpy");
  const py::object chosen = numpy.attr("arange")(all.size()).attr("__getitem__")(key);
  const Times rows = times_from(numpy.attr("atleast_1d")(chosen), "rows");
  if (rows.ndim() != 1) throw py::index_error("rows of a recording have one index");
  return unlocked([&] {
    auto part = std::make_shared<Recording>();
    part->header = recording->header;
    part->header.packet_shots = 0;  // packets were not cut
    part->header.slips.clear();
    part->warnings = recording->warnings;
    const std::vector<std::size_t> places(rows.data(), rows.data() + rows.size());
    part->data.observations.append(all, places);
    return part;
  });
}

/// Points in the sensor's frame [rows, 3], m; NaN where there is no return.
py::array_t<double> xyz_of(const Recording& recording) {
  const Observations& rows = recording.data.observations;
  py::array_t<double> xyz({static_cast<py::ssize_t>(rows.size()), py::ssize_t{3}});
  double* to = xyz.mutable_data();
  unlocked([&] {
    for (std::size_t i = 0; i < rows.size(); ++i, to += 3) {
      const bool found = rows.valid[i] != 0 && rows.range[i] > 0;
      const double range = found ? rows.range[i] : std::numeric_limits<double>::quiet_NaN();
      const Vector3<double> direction =
          direction_from_angles<double>({rows.azimuth[i], rows.zenith[i]});
      to[0] = range * direction.x;
      to[1] = range * direction.y;
      to[2] = range * direction.z;
    }
  });
  return xyz;
}

/// A property with the column of that name.
void bind_column(py::class_<Recording, SharedRecording>& type,
                 const recordings::ObservationColumn& entry) {
  std::visit(
      [&]<class T>(std::vector<T> Observations::*column) {
        constexpr const char* kNumbers = std::is_same_v<T, std::int64_t> ? "int64"
                                         : std::is_same_v<T, double>     ? "float64"
                                         : std::is_same_v<T, float>      ? "float32"
                                                                         : "uint8";
        std::string doc = fmt::format("{} ({}). {}.", entry.meaning, entry.unit, kNumbers);
        doc.front() = static_cast<char>(std::toupper(doc.front()));
        type.def_property_readonly(
            entry.name,
            [column](const SharedRecording& recording) {
              return view_of<T, Recording>(recording->data.observations.*column, recording);
            },
            doc.c_str());
      },
      entry.place);
}

void bind_header(py::module_& module) {
  using recordings::Device;
  py::class_<Device>(module, "Device", "One sensor of a recording.")
      .def_readonly("serial", &Device::serial, "Broadcast code; empty when it is not known.")
      .def_readonly("topic", &Device::topic,
                    "Topic of its messages in a bag; empty in other formats.")
      .def_readonly("hub_serial", &Device::hub_serial,
                    "Serial number of the hub; empty without one.")
      .def_readonly("address", &Device::address,
                    "IPv4 address, of the second generation; empty when it is not known.")
      .def_readonly("type", &Device::type, "Number of the Livox type; 255 when it is not known.")
      .def_property_readonly(
          "type_name",
          [](const Device& device) { return recordings::device_type_name(device.type); },
          "Commercial name of the type.")
      .def("__repr__", [](const Device& device) {
        return fmt::format("<risley.Device {} {}>", recordings::device_type_name(device.type),
                           device.serial);
      });
  py::class_<RecordingHeader>(module, "RecordingHeader",
                              "Properties of a recording known before its first row.")
      .def_readonly("format", &RecordingHeader::format, "Short name of the format.")
      .def_readonly("devices", &RecordingHeader::devices, "Its sensors, at least one.")
      .def_property_readonly(
          "time_reference",
          [](const RecordingHeader& header) { return to_string(header.time_reference); },
          "The origin of the times, in words.")
      .def_readonly("has_times", &RecordingHeader::has_times,
                    "False where ``time_ns`` holds the numbers of shots.")
      .def_readonly("has_range", &RecordingHeader::has_range, "Whether there are ranges.")
      .def_readonly("has_intensity", &RecordingHeader::has_intensity,
                    "Whether there are intensities.")
      .def_readonly("cartesian", &RecordingHeader::cartesian,
                    "Whether the file holds coordinates and not angles.")
      .def_readonly("returns_per_shot", &RecordingHeader::returns_per_shot,
                    "Rows that a shot may have.")
      .def("__repr__", [](const RecordingHeader& header) {
        return fmt::format("<risley.RecordingHeader {}>", header.format);
      });
}

}  // namespace

void bind_recordings(py::module_& module) {
  bind_header(module);
  py::class_<Recording, SharedRecording> type(
      module, "Recording",
      "Observations of a recording as columns, one row per return.\n\n"
      "Every column is a numpy array of shape (rows,) that shares the recording's memory: it\n"
      "cannot be written to, and stays valid after the recording is deleted. Where the header has "
      "no\ntimes, ``time_ns`` holds the numbers of shots; where it has no ranges, ``range`` is "
      "NaN.\n"
      "`read` and `read_chunks` make recordings from files, `from_arrays` from numbers.");
  type.def("__len__", [](const Recording& recording) { return recording.data.observations.size(); })
      .def("__getitem__", &some_rows, py::arg("key"))
      .def_property_readonly("xyz", &xyz_of,
                             "Points in the sensor's frame, m, NaN where there is no return; shape "
                             "(rows, 3). A new array of float64.")
      .def(
          "to_xarray",
          [](const py::object& self) {
            return py::module_::import("risley._recordings").attr("to_xarray")(self);
          },
          "to_xarray(self)\n--\n\nAll columns as an `xarray.Dataset` over ``row``.")
      .def(
          "to_pandas",
          [](const py::object& self) {
            return py::module_::import("risley._recordings").attr("to_pandas")(self);
          },
          "to_pandas(self)\n--\n\nAll columns as a `pandas.DataFrame`.")
      .def("__reduce__",
           [](const py::object& self) {
             return py::module_::import("risley._recordings").attr("reduced")(self);
           })
      .def_readonly("header", &Recording::header, "Properties of the whole recording.")
      .def_property_readonly(
          "warnings", [](const Recording& recording) { return warnings_of(recording.warnings); },
          "Problems that leave the recording usable.")
      .def("__repr__", [](const Recording& recording) {
        return fmt::format("<risley.Recording {}, {} rows>", recording.header.format,
                           recording.data.observations.size());
      });
  for (const auto& entry : recordings::kObservationColumns) bind_column(type, entry);
  type.attr("emitter") = type.attr("beam");

  py::class_<ChunkReader>(module, "ChunkReader",
                          "Iterator over the pieces of a recording; see `read_chunks`.")
      .def(py::init([](const std::string& path, std::size_t rows, std::optional<double> shot_rate,
                       const YawPitchRoll& extrinsics, std::string device) {
             return std::make_unique<ChunkReader>(
                 path, rows, read_options(shot_rate, extrinsics, std::move(device)));
           }),
           py::arg("path"), py::arg("rows"), py::arg("shot_rate"), py::arg("extrinsics"),
           py::arg("device"))
      .def("__iter__", [](py::object self) { return self; })
      .def("__next__", &ChunkReader::next)
      .def("__enter__", [](py::object self) { return self; })
      .def("__exit__", [](ChunkReader& self, const py::args&) { self.close(); })
      .def("close", &ChunkReader::close,
           "close(self)\n--\n\nCloses the file; there are no further pieces.")
      .def_property_readonly("header", &ChunkReader::header, "Properties of the whole recording.")
      .def_property_readonly(
          "warnings", [](ChunkReader& reader) { return warnings_of(reader.warnings()); },
          "Problems found so far that leave the recording usable.")
      .def_property_readonly("fraction_read", &ChunkReader::fraction_read,
                             "Part of the file that was read, 0 to 1.");

  module.def(
      "read",
      [](const std::string& path, std::optional<double> shot_rate, const YawPitchRoll& extrinsics,
         std::string device, const py::object& on_progress) {
        const recordings::ReadOptions options =
            read_options(shot_rate, extrinsics, std::move(device));
        auto recording = std::make_shared<Recording>();
        run_job(on_progress, 0, [&](const Progress& progress) {
          *recording = recordings::load_recording(path, progress.stage("reading"), options);
        });
        return recording;
      },
      py::arg("path"), py::arg("shot_rate"), py::arg("extrinsics"), py::arg("device"),
      py::arg("on_progress"));
  module.def("recording_from_arrays", &recording_from_arrays, py::arg("time_ns"),
             py::arg("azimuth"), py::arg("zenith"), py::arg("range"), py::arg("others"),
             py::arg("serial"), py::arg("device_type"));
  module.def(
      "write_recording",
      [](const SharedRecording& recording, const std::string& path, const std::string& format) {
        run_job(py::none(), 0, [&](const Progress&) {
          const auto writer = recordings::create_recording(path, recording->header, format);
          writer->write(recording->data);
          writer->close();
        });
      },
      py::arg("recording"), py::arg("path"), py::arg("format"));
}

}  // namespace risley::python
