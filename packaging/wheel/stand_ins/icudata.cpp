// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// In place of ICU's libicudata, 31 MB of tables of languages and encodings: as ICU's own "stubdata", a table of contents
// without entries. ICU is here because libxml2 is, which NetCDF needs for files on servers; nothing here opens those.
#include <cstdint>

extern "C" {
extern const struct {
  std::uint16_t header_bytes = 32;
  std::uint8_t magic[2] = {0xda, 0x27};
  std::uint16_t info_bytes = 20, reserved = 0;
  std::uint8_t big_endian = 0, charset = 0, char_bytes = 2, no_use = 0;
  char format[4] = {'T', 'o', 'C', 'P'};
  std::uint8_t format_version[4] = {1, 0, 0, 0}, data_version[4] = {0, 0, 0, 0};
  std::uint8_t padding[8] = {};
  std::uint32_t entries = 0, end = 0;
} ICU_DATA;
const decltype(ICU_DATA) ICU_DATA{};
}
