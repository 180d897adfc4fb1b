// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <cmath>
#include <fstream>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "risley/core/error.hpp"
#include "risley/recordings/reader.hpp"

#include "io/test_folder.hpp"

namespace risley::recordings::packet_places_test {

/// A Viewer table of an Avia: packets of two points, of 96, with one time each.
std::string viewer_table(const io::TestFolder& folder) {
  const std::string path = folder.file("viewer.csv");
  std::ofstream file(path);
  file << "Version,Slot ID,LiDAR Index,Rsvd,Error Code,Timestamp Type,Data Type,Timestamp,X,Y,Z,"
          "Reflectivity,Tag,Ori_x,Ori_y,Ori_z,Ori_radius,Ori_theta,Ori_phi\n";
  for (const int time_ns : {1'000'000, 1'400'000}) {
    for (int point = 0; point < 2; ++point) {
      file << fmt::format("5,1,1,0,0x00000000,0,2,{},2,0.1,-0.1,7,0,2000,100,-100,0,0,0\n",
                          time_ns);
    }
  }
  return path;
}

TEST(PacketPlaces, GiveRowsTheirTimesAndEmitters) {
  const io::TestFolder folder;
  const std::string path = viewer_table(folder);
  const Recording as_it_is = load_recording(path);
  EXPECT_EQ(as_it_is.header.packet_shots, 96);
  EXPECT_EQ(as_it_is.warnings.size(), 1u);  // of missing points
  ReadOptions options;
  options.packet_places = PacketPlaces{{3, kNoPlace, 0, 95}, 250e3, {1, 0}};
  const Recording placed = load_recording(path, {}, options);
  const Observations& rows = placed.data.observations;
  EXPECT_TRUE(placed.warnings.empty());
  EXPECT_EQ(rows.time_ns, (std::vector<std::int64_t>{1'012'000, 1'012'000, 1'400'000, 1'780'000}));
  EXPECT_EQ(rows.valid, (std::vector<std::uint8_t>{1, 0, 1, 1}));
  EXPECT_TRUE(std::isnan(rows.azimuth[1]));
  EXPECT_EQ(rows.beam[0], 0);
  EXPECT_EQ(rows.beam[2], 1);
  EXPECT_EQ(rows.range, as_it_is.data.observations.range);
}

TEST(PacketPlaces, PutBackWhatWasCutOffCoordinates) {
  ReadOptions options;
  options.packet_places = PacketPlaces{{0, 1, 0, 1}, 240e3, {0}, true};
  const io::TestFolder folder;
  const Observations rows = load_recording(viewer_table(folder), {}, options).data.observations;
  EXPECT_NEAR(std::tan(rows.azimuth[0]), 0.1005 / 2.0005, 1e-6);
  EXPECT_NEAR(rows.range[0] * std::cos(rows.zenith[0]), -0.1005, 1e-6);
  EXPECT_NEAR(rows.range[0], std::hypot(2.0005, 0.1005, 0.1005), 1e-6);
}

TEST(PacketPlaces, AreRefusedTogetherWithAShotRate) {
  const io::TestFolder folder;
  ReadOptions options;
  options.packet_places = PacketPlaces{{0, 1, 0, 1}, 240e3, {0}};
  options.shot_rate = 240e3;
  EXPECT_THROW(load_recording(viewer_table(folder), {}, options), InvalidArgument);
  options.shot_rate.reset();
  options.packet_places->firing_order.clear();
  EXPECT_THROW(load_recording(viewer_table(folder), {}, options), InvalidArgument);
}

}  // namespace risley::recordings::packet_places_test
