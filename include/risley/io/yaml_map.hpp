// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

/// @file
/// Strict reading of YAML: every mistake becomes a FileError with its line.
namespace risley::io {

/// A value of a YAML text with everything below it.
struct YamlNode {
  /// Type of a node; an empty value is nothing.
  enum class Kind { nothing, scalar, list, map };

  Kind kind = Kind::nothing;
  std::size_t line = 0;         ///< from 1, 0 when unknown
  std::string scalar;           ///< of a scalar, as written
  std::vector<YamlNode> items;  ///< of a list; of a map: each key before its value

  bool is_list() const { return kind == Kind::list; }  ///< whether it has items without keys
};

/// @throws FileError if the text is not YAML, holds more than one document, or has more than a
/// million values, including those repeated by aliases
YamlNode parse_yaml(const std::string& text, const std::string& path);

/// @throws FileError always
[[noreturn]] void fail_at(const std::string& path, std::size_t line, const std::string& problem);

/// The node's finite number. @param field  for the message
long double yaml_number(const YamlNode& node, const std::string& path, const std::string& field);

/// The node's plain text.
std::string yaml_text(const YamlNode& node, const std::string& path, const std::string& field);

/// A map with a fixed set of keys: unknown, repeated and missing keys are errors.
class YamlMap {
 public:
  /// A key with its value.
  struct Entry {
    std::string key;
    std::size_t line;
    YamlNode value;
  };

  /// @param field  name of this map in messages, e.g. "planes[2]"; empty for the whole file
  YamlMap(const YamlNode& node, std::string path, std::string field);

  /// @throws FileError for a key that is not among these
  void allow_only(const std::vector<std::string>& keys) const;

  /// All entries, in the order of the text.
  const std::vector<Entry>& entries() const { return entries_; }
  /// The entry of that key, or nullptr.
  const Entry* find(std::string_view key) const;
  /// The entry of that key. @throws FileError naming the key when it is missing
  const Entry& at(std::string_view key) const;

  /// The text of an entry. @throws FileError if it is missing or not a text
  std::string text(std::string_view key) const;
  /// @throws FileError with value, unit and range unless lower <= number <= upper
  long double number(std::string_view key, long double lower, long double upper,
                     std::string_view unit) const;
  /// The same as a double. @param absent  meaning of its absence, if it may be absent
  double real(std::string_view key, long double lower, long double upper, std::string_view unit,
              std::optional<double> absent = {}) const;
  /// A list of this many numbers, or of any number but none for 0, each within the limits.
  std::vector<double> reals(std::string_view key, std::size_t count, long double lower,
                            long double upper, std::string_view unit) const;
  /// As number(), for a whole number without unit.
  int integer(std::string_view key, int lower, int upper) const;

  /// A non-empty text, such as a source.
  std::string words(std::string_view key) const;
  /// The map below a key.
  YamlMap section(std::string_view key) const;
  /// The maps of a list, which may be absent.
  std::vector<YamlMap> maps(std::string_view key) const;

  /// Whether an entry is "yes"; the only other value is "no".
  /// @param absent  what its absence means
  bool yes(std::string_view key, bool absent = false) const;

  /// How messages call an entry, e.g. "noise.angle_noise_deg".
  std::string field(std::string_view key) const;
  const std::string& path() const { return path_; }  ///< of the file, for messages
  std::size_t line() const { return line_; }         ///< where the map begins, from 1

 private:
  std::string path_, field_;
  std::size_t line_ = 0;
  std::vector<Entry> entries_;
  std::map<std::string, std::size_t, std::less<>> places_;  ///< of the keys in entries_
};

}  // namespace risley::io
