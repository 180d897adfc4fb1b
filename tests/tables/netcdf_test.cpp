// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/tables/netcdf.hpp"

#include <atomic>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <thread>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hdf5.h>
#include <netcdf.h>

#include "risley/core/error.hpp"

#include "io/test_folder.hpp"
#include "refusal.hpp"
#include "source_tree.hpp"

namespace risley::tables::netcdf_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

template <class Call>
std::string refusal(const Call& call) {
  try {
    call();
  } catch (const FileError& error) {
    return error.what();
  }
  return "accepted";
}

/// Numbers that no other file has.
std::vector<double> numbers(std::size_t file, std::size_t count) {
  std::vector<double> values(count);
  for (std::size_t i = 0; i < count; ++i) values[i] = static_cast<double>(1000 * i + file) / 7.0;
  return values;
}

void write_file(const std::string& path, const std::vector<double>& values, std::size_t pieces) {
  NetcdfOutput file(path);
  file.put_number("version", std::uint32_t{7});
  file.put_text("title", "numbers");
  file.put_text_group("details", {{"first", "one"}, {"second", ""}});
  const auto row = file.define_growing_dimension("row");
  const auto axis = file.define_dimension("axis", 3);
  const auto names = file.define_dimension("name", 2);
  const auto time = file.define<double>("time", {&row}, {1000, true, true});
  const auto place = file.define<float>("place", {&row, &axis}, {1000, true, false});
  const auto flag = file.define<std::uint8_t>("flag", {&names}, {});
  file.define_texts("label", names, "labels", {"a", "a longer one"});
  file.put_text(time, "units", "s");
  file.end_definitions();
  const std::size_t length = values.size() / pieces;
  for (std::size_t first = 0; first < values.size(); first += length) {
    const auto part = std::span(values).subspan(first, std::min(length, values.size() - first));
    file.put(time, first, part);
    std::vector<float> places;
    for (const double value : part) {
      for (int k = 0; k < 3; ++k)
        places.push_back(static_cast<float>(value) + static_cast<float>(k));
    }
    file.put(place, first, places);
  }
  file.put(flag, 0, std::vector<std::uint8_t>{1, 255});
  file.close();
}

/// Whether a file is what write_file was given.
void expect_file(const std::string& path, const std::vector<double>& values) {
  const NetcdfInput file(path);
  EXPECT_EQ(file.number("version"), 7U);
  EXPECT_EQ(file.text("title"), "numbers");
  EXPECT_EQ(file.text_group("details"),
            (std::vector<std::pair<std::string, std::string>>{{"first", "one"}, {"second", ""}}));
  const auto row = file.dimension("row");
  ASSERT_EQ(row.length, values.size());
  const auto axis = file.dimension("axis", 3);
  const auto time = file.variable<double>("time", {&row}, 1000);
  const auto place = file.variable<float>("place", {&row, &axis}, 1000);
  std::vector<double> found, all;
  std::vector<float> places;
  for (std::size_t first = 0; first < row.length; first += 700) {
    const std::size_t count = std::min<std::size_t>(700, row.length - first);
    file.get(time, first, count, found);
    all.insert(all.end(), found.begin(), found.end());
    file.get(place, first, count, places);
    ASSERT_EQ(places.size(), 3 * count);
    EXPECT_EQ(places[2], static_cast<float>(values[first]) + 2.0F);
  }
  EXPECT_TRUE(all == values);
}

TEST(Netcdf, ReadsWhatItWrote) {
  const io::TestFolder folder;
  const auto values = numbers(1, 5000);
  write_file(folder.file("a.nc"), values, 3);
  expect_file(folder.file("a.nc"), values);
}

TEST(Netcdf, FilesOfSeveralThreadsDoNotDisturbEachOther) {
  const io::TestFolder folder;
  // Whatever the files are called: their content makes them NetCDF.
  const std::vector<std::string> endings{".nc", ".NC", ".dat", ""};
  ::testing::internal::CaptureStderr();  // HDF5 likes to print its errors, once per thread
  std::atomic<int> waiting{static_cast<int>(endings.size())};
  std::vector<std::thread> threads;
  for (std::size_t k = 0; k < endings.size(); ++k) {
    threads.emplace_back([&, k] {
      --waiting;
      while (waiting > 0) std::this_thread::yield();
      for (std::size_t round = 0; round < 12; ++round) {
        const std::string path = folder.file(fmt::format("{}{}", k, endings[k]));
        const auto values = numbers(k, 3000 + 100 * round);
        write_file(path, values, 5);
        expect_file(path, values);
        EXPECT_THROW(NetcdfInput(folder.file("missing")), FileError);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

TEST(Netcdf, AFileNotClosedLeavesNothing) {
  const io::TestFolder folder;
  {
    NetcdfOutput file(folder.file("a.nc"));
    const auto row = file.define_growing_dimension("row");
    const auto time = file.define<double>("time", {&row}, {10, false, false});
    file.end_definitions();
    file.put(time, 0, std::vector<double>{1, 2, 3});
    EXPECT_EQ(folder.names().size(), 1U);
  }
  {
    NetcdfOutput undefined(folder.file("b.nc"));
    undefined.define_growing_dimension("row");
  }
  EXPECT_THAT(folder.names(), IsEmpty());
}

TEST(Netcdf, WrongCallsAreRefused) {
  const io::TestFolder folder;
  NetcdfOutput file(folder.file("a.nc"));
  EXPECT_THROW(file.define_dimension("none", 0), InvalidArgument);
  const auto row = file.define_growing_dimension("row");
  const auto axis = file.define_dimension("axis", 3);
  const auto place = file.define<float>("place", {&row, &axis}, {10, false, false});
  EXPECT_THROW(file.define_texts("label", axis, "", {"one"}), InvalidArgument);
  const auto time = file.define<double>("time", {&row}, {10, false, false});
  EXPECT_THROW(file.set_fill(time, 0.0F), InvalidArgument);
  EXPECT_THAT(refusal([&] { file.define<double>("time", {&row}, {}); }), NamesField("time"));
  file.end_definitions();
  EXPECT_THROW(file.put(place, 0, std::vector<float>(4)), InvalidArgument);
  EXPECT_THROW(file.put(place, 0, std::vector<double>(3)), InvalidArgument);
}

/// A file that another program made, with the C library itself.
class Foreign {
 public:
  explicit Foreign(std::string path) : path_(std::move(path)) {
    EXPECT_EQ(nc_create(path_.c_str(), NC_NETCDF4 | NC_CLOBBER, &id_), NC_NOERR);
  }
  int dimension(const char* name, std::size_t length) {
    int dimension = 0;
    EXPECT_EQ(nc_def_dim(id_, name, length, &dimension), NC_NOERR);
    return dimension;
  }
  int variable(const char* name, nc_type type, std::vector<int> dimensions,
               std::vector<std::size_t> blocks = {}) {
    int variable = 0;
    EXPECT_EQ(nc_def_var(id_, name, type, static_cast<int>(dimensions.size()), dimensions.data(),
                         &variable),
              NC_NOERR);
    if (!blocks.empty()) {
      EXPECT_EQ(nc_def_var_chunking(id_, variable, NC_CHUNKED, blocks.data()), NC_NOERR);
    }
    return variable;
  }
  int id() const { return id_; }
  /// Completes the file and opens it.
  std::unique_ptr<NetcdfInput> read() {
    EXPECT_EQ(nc_close(id_), NC_NOERR);
    return std::make_unique<NetcdfInput>(path_);
  }

 private:
  std::string path_;
  int id_ = 0;
};

TEST(HostileNetcdf, MissingThingsAndOthersOfTheirName) {
  const io::TestFolder folder;
  Foreign foreign(folder.file("a.nc"));
  const int row = foreign.dimension("row", 4), other = foreign.dimension("other", 4);
  foreign.variable("bytes", NC_UBYTE, {row});
  foreign.variable("scalar", NC_DOUBLE, {});
  foreign.variable("along", NC_DOUBLE, {other});
  foreign.variable("cube", NC_DOUBLE, {row, other, row});
  foreign.variable("texts", NC_STRING, {row});
  const double half = 0.5, pair[] = {1, 2}, negative = -1;
  ASSERT_EQ(nc_put_att_double(foreign.id(), NC_GLOBAL, "half", NC_DOUBLE, 1, &half), NC_NOERR);
  ASSERT_EQ(nc_put_att_double(foreign.id(), NC_GLOBAL, "pair", NC_DOUBLE, 2, pair), NC_NOERR);
  ASSERT_EQ(nc_put_att_double(foreign.id(), NC_GLOBAL, "negative", NC_DOUBLE, 1, &negative),
            NC_NOERR);
  const char* words[] = {"of varying length"};
  ASSERT_EQ(nc_put_att_string(foreign.id(), NC_GLOBAL, "words", 1, words), NC_NOERR);
  const auto file = foreign.read();
  const auto rows = file->dimension("row"), others = file->dimension("other");
  const auto of = [&](const char* name) {
    return refusal([&] { file->variable<double>(name, {&rows}); });
  };
  EXPECT_THAT(of("missing"), AllOf(NamesField("variable missing"), NamesField("row")));
  EXPECT_THAT(of("bytes"), AllOf(NamesField("variable bytes"), NamesField("ubyte")));
  EXPECT_THAT(of("texts"), AllOf(NamesField("variable texts"), NamesField("string")));
  EXPECT_THAT(of("scalar"), AllOf(NamesField("variable scalar"), NamesField("0 dimensions")));
  EXPECT_THAT(of("cube"), AllOf(NamesField("variable cube"), NamesField("3 dimensions")));
  EXPECT_THAT(of("along"), AllOf(NamesField("variable along"), NamesField("other")));
  EXPECT_THAT(refusal([&] { file->dimension("missing"); }), NamesField("dimension missing"));
  EXPECT_THAT(refusal([&] { file->dimension("row", 3); }),
              AllOf(NamesField("row"), NamesField("expected 3")));
  for (const char* name : {"pair", "negative", "missing", "words"}) {
    EXPECT_THAT(refusal([&] { file->number(name); }), NamesField(name));
    EXPECT_THAT(refusal([&] { file->text(name); }), NamesField(name));
  }
  EXPECT_THAT(refusal([&] { file->text_group("missing"); }), NamesField("group missing"));
  EXPECT_FALSE(file->has_variable("missing"));
  EXPECT_FALSE(file->has_attribute("missing"));
  const auto along = file->variable<double>("along", {&others});
  std::vector<double> values;
  EXPECT_THAT(refusal([&] { file->get(along, 3, 2, values); }), NamesField("variable along"));
  std::vector<float> wrong;
  EXPECT_THROW(file->get(along, 0, 1, wrong), InvalidArgument);
}

TEST(HostileNetcdf, NothingIsLargerThanItsFile) {
  // Kilobytes that claim exabytes: nothing of it was ever written.
  const io::TestFolder folder;
  constexpr std::size_t kHuge = std::size_t{1} << 40;
  Foreign foreign(folder.file("a.nc"));
  const int huge = foreign.dimension("huge", kHuge), few = foreign.dimension("few", 2);
  foreign.variable("chunked", NC_DOUBLE, {huge}, {1024});
  foreign.variable("wide", NC_DOUBLE, {few, huge}, {1, 1024});
  foreign.variable("product", NC_DOUBLE, {huge, huge}, {1, 1024});
  foreign.variable("blocks", NC_DOUBLE, {few, few}, {2, 2});
  const int grown = foreign.dimension("grown", NC_UNLIMITED);
  const int variable = foreign.variable("in_one_block", NC_DOUBLE, {grown}, {std::size_t{1} << 27});
  ASSERT_EQ(nc_def_var_deflate(foreign.id(), variable, 1, 1, 1), NC_NOERR);
  const auto file = foreign.read();
  const auto along = file->dimension("huge"), pair = file->dimension("few");
  const auto nothing = file->dimension("grown");
  EXPECT_THAT(refusal([&] { file->variable<double>("chunked", {&along}); }),
              AllOf(NamesField("variable chunked"), NamesField("huge")));
  EXPECT_THAT(refusal([&] {
                file->variable<double>("wide", {&pair, &along});
              }),
              AllOf(NamesField("variable wide"), NamesField("huge")));
  EXPECT_THAT(refusal([&] {
                file->variable<double>("product", {&along, &along});
              }),
              NamesField("variable product"));
  EXPECT_THAT(refusal([&] { file->variable<double>("in_one_block", {&nothing}); }),
              AllOf(NamesField("variable in_one_block"), NamesField("1073741824 bytes")));
  EXPECT_NO_THROW(file->variable<double>("blocks", {&pair, &pair}));
}

TEST(HostileNetcdf, EmptyDimensionsGiveNothing) {
  const io::TestFolder folder;
  Foreign foreign(folder.file("a.nc"));
  const int row = foreign.dimension("row", NC_UNLIMITED), axis = foreign.dimension("axis", 3);
  foreign.variable("place", NC_FLOAT, {row, axis});
  foreign.variable("turned", NC_FLOAT, {axis, row});
  const auto file = foreign.read();
  const auto rows = file->dimension("row"), axes = file->dimension("axis");
  EXPECT_EQ(rows.length, 0U);
  std::vector<float> values{1, 2};
  const auto place = file->variable<float>("place", {&rows, &axes});
  file->get(place, 0, 0, values);
  EXPECT_THAT(values, IsEmpty());
  EXPECT_THAT(refusal([&] { file->get(place, 0, 1, values); }), NamesField("variable place"));
  const auto turned = file->variable<float>("turned", {&axes, &rows});
  file->get(turned, 0, 3, values);
  EXPECT_THAT(values, IsEmpty());
}

TEST(HostileNetcdf, OtherFiles) {
  const io::TestFolder folder;
  EXPECT_THAT(refusal([&] { NetcdfInput{folder.file("missing")}; }), NamesField("missing"));
  EXPECT_THAT(refusal([&] { NetcdfInput{folder.path().string()}; }),
              NamesField(folder.path().string()));
  std::ofstream(folder.file("text")) << "no NetCDF at all";
  EXPECT_THAT(refusal([&] { NetcdfInput{folder.file("text")}; }), NamesField("text"));
  std::ofstream(folder.file("head")) << "\x89HDF\r\n\x1a\n and nothing else";
  EXPECT_THAT(refusal([&] { NetcdfInput{folder.file("head")}; }), NamesField("head"));
  EXPECT_THAT(refusal([&] { NetcdfInput{std::string("/dev/null")}; }), NamesField("/dev/null"));
}

/// What reading all of a file's named variables comes to; a crash or an endless loop of the
/// library would end or hold this process.
std::string reading(const std::string& name) {
  return refusal([&] {
    const NetcdfInput file(in_source_tree("tests/golden/hostile/") + name);
    for (const char* dimension : {"row", "knot", "shot"}) {
      try {
        file.dimension(dimension);
      } catch (const FileError&) {  // of another kind
        continue;
      }
      const auto rows = file.dimension(dimension);
      std::vector<std::int64_t> times;
      file.get(file.variable<std::int64_t>("time", {&rows}), 0, rows.length, times);
    }
  });
}

TEST(HostileNetcdf, ACrashOfTheLibraryIsAFileError) {
  ::setenv("MALLOC_PERTURB_", "190", 1);
  EXPECT_THAT(reading("hdf5-link-table.nc"), NamesField("hdf5-link-table.nc"));
  ::unsetenv("MALLOC_PERTURB_");
}

TEST(HostileNetcdf, AnEndlessLoopOfTheLibraryIsAFileError) {
  EXPECT_THAT(reading("truth-hang.nc"), HasSubstr("processor time"));
}

TEST(HostileNetcdf, NothingIsReadFromOtherFiles) {
  const io::TestFolder folder;
  write_file(folder.file("secret.nc"), numbers(1, 10), 1);
  const hid_t linked = H5Fcreate(folder.file("linked.nc").c_str(), H5F_ACC_TRUNC, 0, 0);
  EXPECT_GE(H5Lcreate_external("secret.nc", "/time", linked, "time", 0, 0), 0);
  H5Fclose(linked);
  EXPECT_THAT(refusal([&] { NetcdfInput{folder.file("linked.nc")}; }), NamesField("time"));
  const hid_t stored = H5Fcreate(folder.file("stored.nc").c_str(), H5F_ACC_TRUNC, 0, 0);
  const hid_t properties = H5Pcreate(H5P_DATASET_CREATE);
  H5Pset_external(properties, "/etc/hostname", 0, 4);
  const hsize_t length = 4;
  const hid_t space = H5Screate_simple(1, &length, nullptr);
  const hid_t data = H5Dcreate2(stored, "flag", H5T_NATIVE_UINT8, space, 0, properties, 0);
  EXPECT_GE(data, 0);
  H5Dclose(data);
  H5Sclose(space);
  H5Pclose(properties);
  H5Fclose(stored);
  EXPECT_THAT(refusal([&] { NetcdfInput{folder.file("stored.nc")}; }), NamesField("flag"));
}

TEST(Netcdf, DevicesSurvive) {
  const auto values = numbers(1, 100);
  write_file("/dev/null", values, 1);
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
  EXPECT_THAT(refusal([&] { write_file("/dev/full", values, 1); }), HasSubstr("No space left"));
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/full"));
}

}  // namespace risley::tables::netcdf_test
