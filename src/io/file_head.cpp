// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/io/file_head.hpp"

#include <algorithm>
#include <array>
#include <filesystem>

#include <fmt/format.h>

#include "risley/core/text.hpp"
#include "risley/io/text_dialect.hpp"

namespace risley::io {
namespace {

using namespace std::string_view_literals;

/// A compression program, recognised by the beginning of its files.
struct Packing {
  std::string_view signature, name, command;
};
/// These pack one file, whose name gets an ending.
constexpr std::array kPackings{
    Packing{"\x1F\x8B"sv, "gzip", "gunzip -c"},
    Packing{"\x28\xB5\x2F\xFD"sv, "Zstandard", "unzstd -c"},
    Packing{"BZh"sv, "bzip2", "bunzip2 -c"},
    Packing{"\xFD"
            "7zXZ\0"sv,
            "xz", "unxz -c"},
    Packing{"\x04\x22\x4D\x18"sv, "LZ4", "unlz4 -c"},
};
constexpr std::array kPackingEndings{".gz", ".zst", ".zstd", ".bz2", ".xz", ".lz4"};
/// These may hold many.
constexpr std::array kArchives{
    Packing{"PK\x03\x04"sv, "zip", "unzip"},
    Packing{"7z\xBC\xAF\x27\x1C"sv, "7-Zip", "7z x"},
    Packing{"Rar!\x1A\x07"sv, "RAR", "unrar x"},
};

std::string unpacked_name(const std::string& name) {
  for (const std::string_view ending : kPackingEndings) {
    if (lower_case(name).ends_with(ending)) return name.substr(0, name.size() - ending.size());
  }
  return name + ".unpacked";
}

/// A text in the dialect used for reading tables.
std::string in_plain_dialect(std::string_view text) {
  const TextDialect dialect = dialect_of(text);
  if (dialect.is_plain()) return std::string(text);
  std::string result, room;
  while (!text.empty()) {
    const auto end = text.find('\n');
    result += dialect.plain(text.substr(0, end), room);
    if (end == text.npos) break;
    result += '\n';
    text.remove_prefix(end + 1);
  }
  return result;
}

}  // namespace

std::string read_file_head(const InputFile& file, std::size_t bytes) {
  constexpr std::size_t kBytesPerUnit = 2;
  std::string raw(kBytesPerUnit * std::max(bytes, kDialectBytes), '\0');
  raw.resize(file.read(0, raw.data(), raw.size()));
  std::string text;
  TextDecoder(encoding_of(raw)).append(raw, text);
  text.resize(std::min(text.size(), std::max(bytes, kDialectBytes)));
  text = in_plain_dialect(text);
  text.resize(std::min(text.size(), bytes));
  return text;
}

std::optional<std::string> stands_for_another(const std::string& path, std::string_view head) {
  const std::string name = std::filesystem::path(path).filename().string();
  if (head.starts_with("version https://git-lfs.github.com/spec/")) {
    return "is a pointer of Git LFS, not the file itself: fetch it by `git lfs pull`";
  }
  if (head.find("/annex/objects/") < 64 || head.starts_with("../.git/annex/")) {
    return fmt::format(
        "is a pointer of git-annex, not the file itself: fetch it by `git annex "
        "get {}`",
        name);
  }
  const std::string begin = lower_case(std::string(head.substr(0, 64)));
  if (begin.starts_with("<!doctype html") || begin.starts_with("<html")) {
    return "is a web page (HTML), not the file itself: the download failed or required a login";
  }
  for (const Packing& packing : kPackings) {
    if (!head.starts_with(packing.signature)) continue;
    return fmt::format("is compressed as a whole ({}): unpack it by `{} {} > {}`", packing.name,
                       packing.command, name, unpacked_name(name));
  }
  for (const Packing& archive : kArchives) {
    if (!head.starts_with(archive.signature)) continue;
    return fmt::format("is an archive ({}): unpack it by `{} {}`", archive.name, archive.command,
                       name);
  }
  constexpr std::size_t kTarMark = 257;
  if (head.size() > kTarMark && head.substr(kTarMark).starts_with("ustar")) {
    return fmt::format("is an archive (tar): unpack it by `tar xf {}`", name);
  }
  return std::nullopt;
}

}  // namespace risley::io
