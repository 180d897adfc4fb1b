// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "io/test_folder.hpp"

// Builds LVX files byte by byte from the format's description, without the code under test.
namespace risley::recordings::lvx_bytes {

using io::TestFolder;

template <class T>
void put(std::string& bytes, T value) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  bytes.append(raw, sizeof(T));
}

template <class T>
void put_at(std::string& bytes, std::size_t at, T value) {
  std::memcpy(bytes.data() + at, &value, sizeof(T));
}

inline void put_text(std::string& bytes, std::string text, std::size_t width) {
  text.resize(width, '\0');
  bytes += text;
}

struct TestDevice {
  std::string serial;
  std::uint8_t index, type;
};

inline std::string file_header(std::uint8_t major, std::uint8_t minor) {
  std::string bytes;
  put_text(bytes, "livox_tech", 16);
  for (const std::uint8_t v : {major, minor, std::uint8_t{0}, std::uint8_t{0}}) put(bytes, v);
  bytes += "\x67\xA7\x0E\xAC";
  return bytes;
}

inline void put_device(std::string& bytes, const TestDevice& device, bool extrinsic_flag) {
  put_text(bytes, device.serial, 16);
  put_text(bytes, "", 16);
  put(bytes, device.index);
  put(bytes, device.type);
  if (extrinsic_flag) put(bytes, std::uint8_t{1});
  for (const float number : {1.5F, -2.25F, 90.0F, 0.1F, 0.2F, -0.3F}) put(bytes, number);
}

inline std::string header_lvx11(const std::vector<TestDevice>& devices,
                                std::uint32_t frame_duration_ms = 50) {
  std::string bytes = file_header(1, 1);
  put(bytes, frame_duration_ms);
  put(bytes, static_cast<std::uint8_t>(devices.size()));
  for (const TestDevice& device : devices) put_device(bytes, device, true);
  return bytes;
}

inline std::string header_lvx10(const std::vector<TestDevice>& devices) {
  std::string bytes = file_header(1, 0);
  put(bytes, static_cast<std::uint8_t>(devices.size()));
  for (const TestDevice& device : devices) put_device(bytes, device, false);
  return bytes;
}

struct TypeSize {
  std::size_t records, bytes_per_record, returns;
};

/// The table of the data types.
inline constexpr TypeSize kTypes[] = {{100, 13, 1}, {100, 9, 1}, {96, 14, 1},
                                      {96, 10, 1},  {48, 28, 2}, {48, 16, 2},
                                      {1, 24, 0},   {30, 42, 3}, {30, 22, 3}};

inline std::string package_header(std::uint8_t device, std::uint8_t timestamp_type,
                                  std::uint8_t data_type, std::uint64_t time) {
  std::string bytes;
  for (const int v : {int{device}, 5, 1, 1, 0}) put(bytes, static_cast<std::uint8_t>(v));
  put(bytes, std::uint32_t{0x8200});
  put(bytes, timestamp_type);
  put(bytes, data_type);
  put(bytes, time);
  return bytes;
}

/// One point of a spherical record: angles first where it has several returns.
inline std::string spherical_record(std::uint8_t data_type, std::uint16_t zenith,
                                    std::uint16_t azimuth, const std::vector<std::uint32_t>& depths,
                                    std::uint8_t intensity, std::uint8_t tag) {
  std::string bytes;
  const bool angles_first = data_type == 5 || data_type == 8;
  if (angles_first) {
    put(bytes, zenith);
    put(bytes, azimuth);
  }
  for (const std::uint32_t depth : depths) {
    put(bytes, depth);
    if (!angles_first) {
      put(bytes, zenith);
      put(bytes, azimuth);
    }
    put(bytes, intensity);
    if (data_type != 1) put(bytes, tag);
  }
  return bytes;
}

/// Records as a sensor might send them, every fifth return missing.
inline std::string records(std::uint8_t data_type, std::mt19937& random) {
  std::string bytes;
  const TypeSize& type = kTypes[data_type];
  if (data_type == 6) {
    for (int i = 0; i < 6; ++i) put(bytes, static_cast<float>(random() % 1000) / 256.0F);
    return bytes;
  }
  const bool cartesian = data_type % 2 == 0 ? data_type != 8 : data_type == 7;
  for (std::size_t record = 0; record < type.records; ++record) {
    const auto intensity = static_cast<std::uint8_t>(random());
    const auto tag = static_cast<std::uint8_t>(random());
    if (cartesian) {
      for (std::size_t number = 0; number < type.returns; ++number) {
        const bool missing = random() % 5 == 0;
        for (int axis = 0; axis < 3; ++axis) {
          put(bytes, missing ? 0 : static_cast<std::int32_t>(random() % 400'001) - 200'000);
        }
        put(bytes, intensity);
        if (data_type != 0) put(bytes, tag);
      }
    } else {
      std::vector<std::uint32_t> depths;
      for (std::size_t number = 0; number < type.returns; ++number) {
        depths.push_back(random() % 5 == 0 ? 0 : static_cast<std::uint32_t>(random() % 400'000));
      }
      bytes +=
          spherical_record(data_type, static_cast<std::uint16_t>(random() % 18'001),
                           static_cast<std::uint16_t>(random() % 36'000), depths, intensity, tag);
    }
  }
  return bytes;
}

inline std::string package(std::uint8_t device, std::uint8_t timestamp_type, std::uint8_t data_type,
                           std::uint64_t time, std::mt19937& random) {
  return package_header(device, timestamp_type, data_type, time) + records(data_type, random);
}

/// Appends a frame of these packages. @return position of its header
inline std::size_t put_frame(std::string& file, const std::vector<std::string>& packages,
                             std::uint64_t index, std::size_t header_bytes = 24) {
  const std::size_t at = file.size();
  std::string body;
  for (const std::string& one : packages) body += one;
  put(file, std::uint64_t{at});
  put(file, std::uint64_t{at + header_bytes + body.size()});
  put(file, index);
  if (header_bytes == 32) put(file, std::uint64_t{packages.size()});
  file += body;
  return at;
}

}  // namespace risley::recordings::lvx_bytes
