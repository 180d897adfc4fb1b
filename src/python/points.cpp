// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>
#include <pybind11/stl.h>
#include <sys/mman.h>
#include <unistd.h>

#include "risley/jobs/cloud_of_recording.hpp"
#include "risley/json/results.hpp"

#include "python/arrays.hpp"
#include "python/call.hpp"
#include "python/json.hpp"
#include "python/names.hpp"
#include "python/options.hpp"

namespace risley::python {
namespace {

using cloud::CloudHeader;
using cloud::PointColumn;
using cloud::Points;

/// Memory that grows at its end: large blocks are remapped by the system without a copy. The system
/// would take longer to clear large pages than to hand out small ones cleared recently.
class GrowingMemory {
 public:
  std::byte* end_of(std::size_t more) {
    if (used_ + more > capacity_) {
      capacity_ = std::max(used_ + more, 2 * capacity_);
      void* grown = std::realloc(memory_.get(), capacity_);
      if (grown == nullptr) throw std::bad_alloc();
      static_cast<void>(memory_.release());
      memory_.reset(static_cast<std::byte*>(grown));
    }
    std::byte* end = memory_.get() + used_;
    used_ += more;
    if (capacity_ >= kMuch) ask_for_pages(end, more);
    return end;
  }
  /// Releases it, without the unused part.
  std::byte* release() {
    auto* memory = static_cast<std::byte*>(std::realloc(memory_.get(), std::max(used_, kLeast)));
    if (memory == nullptr) throw std::bad_alloc();
    static_cast<void>(memory_.release());
    used_ = capacity_ = 0;
    return memory;
  }

 private:
  static constexpr std::size_t kLeast = 1, kMuch = std::size_t{1} << 22;
  struct Free {
    void operator()(std::byte* memory) const { std::free(memory); }
  };

  /// All pages at once: faulting them in one by one takes the system half as long again. Older
  /// systems do not support the hint, which is optional.
  static void ask_for_pages(std::byte* begin, std::size_t bytes) {
#ifdef MADV_POPULATE_WRITE
    static const auto page = static_cast<std::uintptr_t>(::sysconf(_SC_PAGESIZE));
    const auto from = reinterpret_cast<std::uintptr_t>(begin) / page * page;
    const std::size_t length = reinterpret_cast<std::uintptr_t>(begin) + bytes - from;
    ::madvise(reinterpret_cast<void*>(from), length, MADV_POPULATE_WRITE);
#endif
  }
  std::unique_ptr<std::byte, Free> memory_;
  std::size_t used_ = 0, capacity_ = 0;
};

/// An array under construction: a fixed number of values per point.
struct PointArray {
  std::string name;
  py::ssize_t number_size = 0;
  char kind = 'f';
  std::vector<py::ssize_t> shape;  ///< of one point
  GrowingMemory memory;
};

/// "covariance" of "covariance_{}_m2", "incidence_angle" of "incidence_angle_deg".
std::string array_name(const PointColumn& entry) {
  if (entry.axis == 'X') return "xyz";
  if (entry.variable == "beam") return "emitter";
  std::string name(entry.variable.substr(0, entry.variable.find("_{}")));
  return name == "time_ns" ? name : si_name(name);
}

constexpr std::size_t kSquare[] = {cloud::kXX, cloud::kXY, cloud::kXZ, cloud::kXY, cloud::kYY,
                                   cloud::kYZ, cloud::kXZ, cloud::kYZ, cloud::kZZ};

/// Columns of points as arrays with a row for each point: x, y and z together, and covariances as
/// whole matrices.
class PointArrays {
 public:
  void append(const Points& points) {
    if (points.size() == 0) return;  // an empty block does not show which columns exist
    std::size_t place = 0;
    for_each_entry_of_points(points, [&](const PointColumn& entry, const auto& numbers,
                                         const std::vector<py::ssize_t>& shape) {
      using Number = std::remove_cvref_t<decltype(*numbers.front())>;
      if (place == arrays_.size()) {
        constexpr char kKind = std::is_floating_point_v<Number> ? 'f'
                               : std::is_signed_v<Number>       ? 'i'
                                                                : 'u';
        arrays_.push_back({array_name(entry), sizeof(Number), kKind, shape, {}});
      }
      add(numbers, points.size(), arrays_[place++].memory);
    });
    rows_ += points.size();
  }

  std::size_t rows() const { return rows_; }

  /// Hands them to Python and starts new ones.
  py::dict release() {
    py::dict result;
    for (PointArray& array : arrays_) {
      std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(rows_)};
      shape.insert(shape.end(), array.shape.begin(), array.shape.end());
      std::byte* memory = array.memory.release();
      const py::capsule owner(memory, [](void* held) { std::free(held); });
      const py::dtype type(std::string{array.kind} + std::to_string(array.number_size));
      result[py::str(array.name)] = py::array(type, shape, memory, owner);
    }
    arrays_.clear();
    rows_ = 0;
    return result;
  }

 private:
  /// Calls visit(entry, pointers to columns, shape of one point) for every existing array.
  template <class Visit>
  static void for_each_entry_of_points(const Points& points, const Visit& visit) {
    [&]<std::size_t... I>(std::index_sequence<I...>) { (visit_entry<I>(points, visit), ...); }
    (std::make_index_sequence<cloud::kPointColumns.size()>());
  }

  template <std::size_t I, class Visit>
  static void visit_entry(const Points& points, const Visit& visit) {
    constexpr PointColumn kEntry = cloud::kPointColumns[I];
    if constexpr (kEntry.is(PointColumn::kDerived) || kEntry.axis == 'Y' || kEntry.axis == 'Z') {
      return;
    } else {
      const auto& column = points.*std::get<kEntry.place.index()>(kEntry.place);
      using Column = std::remove_cvref_t<decltype(column)>;
      if constexpr (kEntry.axis == 'X') {
        visit(kEntry, std::vector{points.x.data(), points.y.data(), points.z.data()}, {3});
      } else if constexpr (std::is_same_v<
                               Column, std::array<PointColumn::Numbers, cloud::kCovarianceTerms>>) {
        if (column[0].size() != points.size()) return;
        std::vector<const double*> terms;
        terms.reserve(std::size(kSquare));
        for (const std::size_t term : kSquare) terms.push_back(column[term].data());
        visit(kEntry, terms, {3, 3});
      } else if constexpr (std::is_same_v<Column, std::vector<PointColumn::Numbers>>) {
        if (column.empty()) return;
        std::vector<const double*> numbers(column.size());
        std::ranges::transform(column, numbers.begin(), [](const auto& one) { return one.data(); });
        visit(kEntry, numbers, {static_cast<py::ssize_t>(column.size())});
      } else if constexpr (std::is_same_v<Column,
                                          std::vector<std::array<PointColumn::Numbers, 3>>>) {
        if (column.empty()) return;
        std::vector<const double*> numbers;
        for (const auto& one : column) {
          for (const auto& axis : one) numbers.push_back(axis.data());
        }
        visit(kEntry, numbers, {static_cast<py::ssize_t>(column.size()), 3});
      } else {
        if (column.size() != points.size()) return;
        visit(kEntry, std::vector{column.data()}, {});
      }
    }
  }

  template <class Number>
  static void add(const std::vector<const Number*>& columns, std::size_t rows,
                  GrowingMemory& memory) {
    const std::size_t width = columns.size();
    auto* to = reinterpret_cast<Number*>(memory.end_of(rows * width * sizeof(Number)));
    switch (width) {
      case 1:
        std::copy_n(columns.front(), rows, to);
        break;
      case 2:
        interleave<2>(columns, rows, to);
        break;
      case 3:
        interleave<3>(columns, rows, to);
        break;
      case 9:
        interleave<9>(columns, rows, to);
        break;
      default:
        interleave<0>(columns, rows, to);
    }
  }

  /// Memory is written once, from its beginning to its end. @tparam width 0: known only at run time
  template <std::size_t width, class Number>
  static void interleave(const std::vector<const Number*>& columns, std::size_t rows, Number* to) {
    const std::size_t count = width == 0 ? columns.size() : width;
    const Number* const* const from = columns.data();
    for (std::size_t row = 0; row < rows; ++row) {
      for (std::size_t i = 0; i < count; ++i) *to++ = from[i][row];
    }
  }

  std::vector<PointArray> arrays_;
  std::size_t rows_ = 0;
};

/// A sink that keeps points in memory, with the cloud's header.
class PointKeeper {
 public:
  cloud::CloudSink sink() {
    return [this](const CloudHeader& header) -> std::unique_ptr<cloud::CloudWriter> {
      header_ = header;
      return std::make_unique<Writer>(*this);
    };
  }
  std::size_t rows() const { return arrays_.rows(); }
  /// (arrays by name, frame, WKT of a map, names of axes)
  py::tuple release() {
    return py::make_tuple(arrays_.release(), header_.frame.text, header_.frame.wkt,
                          header_.frame.axes);
  }

 private:
  class Writer final : public cloud::CloudWriter {
   public:
    explicit Writer(PointKeeper& keeper) : keeper_(keeper) {}
    void write(const Points& points) override { keeper_.arrays_.append(points); }
    void close() override {}

   private:
    PointKeeper& keeper_;
  };

  PointArrays arrays_;
  CloudHeader header_;
};

/// A job's result for points without a file.
py::object told_of(const jobs::RecordingCloud& made) {
  json::Json summary = json::of(made);
  summary.erase("format");
  summary.erase("output");
  return dict_of(summary);
}

jobs::CloudOfRecordingOptions point_options(const Options& options) {
  jobs::CloudOfRecordingOptions job = cloud_options(options);
  job.cloud.own_covariance = job.cloud.pointing.covariance;
  return job;
}

/// @return arrays and header, and the job's result
py::tuple points(const py::dict& values, int threads, const py::object& on_progress) {
  const jobs::CloudOfRecordingOptions job = point_options(Options(values));
  PointKeeper keeper;
  jobs::RecordingCloud made;
  run_job(on_progress, threads, [&](const Progress& progress) {
    jobs::PointsOfRecording whole(job, keeper.sink(), progress);
    while (whole.next()) {
    }
    made = whole.result();
  });
  return py::make_tuple(keeper.release(), told_of(made));
}

/// Points of a recording, piece by piece.
class PointReader {
 public:
  PointReader(const py::dict& values, std::size_t rows, int threads)
      : rows_(rows), threads_(threads) {
    const jobs::CloudOfRecordingOptions job = point_options(Options(values));
    run([&](const Progress& progress) {
      progress_ = progress.silent();
      made_ = std::make_unique<jobs::PointsOfRecording>(job, keeper_.sink(), progress_);
    });
  }

  /// Arrays and header of the next piece of at least this many points, except for the last one.
  py::tuple next() {
    if (!made_) throw py::stop_iteration();
    try {
      run([&](const Progress&) {
        while (more_ && keeper_.rows() < rows_) more_ = made_->next();
      });
    } catch (...) {
      close();
      throw;
    }
    if (keeper_.rows() == 0) {
      result_ = told_of(made_->result());
      close();
      throw py::stop_iteration();
    }
    return keeper_.release();
  }

  /// The job's result; None before the last piece.
  py::object result() const { return result_; }

  void close() { made_.reset(); }

 private:
  template <class Job>
  void run(const Job& job) {
    if (busy_) throw py::value_error("another call is reading these points");
    busy_ = true;
    try {
      run_job(py::none(), threads_, job, &cancel_);
    } catch (...) {
      busy_ = false;
      throw;
    }
    busy_ = false;
  }

  std::size_t rows_;
  int threads_;
  bool busy_ = false, more_ = true;
  CancelFlag cancel_;
  Progress progress_;
  PointKeeper keeper_;
  std::unique_ptr<jobs::PointsOfRecording> made_;
  py::object result_ = py::none();
};

}  // namespace

void bind_points(py::module_& module) {
  py::class_<PointReader>(module, "PointReader",
                          "Iterator over the points of a recording; see `point_chunks`.")
      .def(py::init<const py::dict&, std::size_t, int>(), py::arg("options"), py::arg("rows"),
           py::arg("threads"))
      .def("__iter__", [](py::object self) { return self; })
      .def("__next__", &PointReader::next)
      .def("close", &PointReader::close,
           "close(self)\n--\n\nCloses the recording; there are no further points.")
      .def_property_readonly("result", &PointReader::result,
                             "Properties of all points, available after the last of them.");
  module.def("points", &points, py::arg("options"), py::arg("threads"), py::arg("on_progress"));
}

}  // namespace risley::python
