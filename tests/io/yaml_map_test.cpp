// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/io/yaml_map.hpp"

#include <chrono>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/error.hpp"
#include "risley/io/text_file.hpp"

#include "refusal.hpp"
#include "source_tree.hpp"

namespace risley::io::yaml_map_test {

using ::testing::HasSubstr;

std::string refusal(const std::string& text) {
  try {
    const YamlMap map(parse_yaml(text, "a.yaml"), "a.yaml", "");
    map.allow_only({"number", "list", "map"});
    if (map.find("number") != nullptr) map.number("number", 0.0L, 10.0L, "m");
  } catch (const FileError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(Yaml, ValuesKeepTheirLines) {
  const YamlMap map(parse_yaml("number: 2.5\nlist:\n  - 1\n  - [2, 3]\nmap: {a: b}\n", "a.yaml"),
                    "a.yaml", "");
  EXPECT_EQ(map.number("number", 0.0L, 10.0L, "m"), 2.5L);
  const YamlNode& list = map.at("list").value;
  ASSERT_TRUE(list.is_list());
  ASSERT_EQ(list.items.size(), 2U);
  EXPECT_EQ(list.items[0].scalar, "1");
  EXPECT_EQ(list.items[0].line, 3U);
  EXPECT_EQ(list.items[1].line, 4U);
  EXPECT_EQ(yaml_number(list.items[1].items.at(1), "a.yaml", "list"), 3.0L);
  EXPECT_EQ(YamlMap(map.at("map").value, "a.yaml", "map").text("a"), "b");
}

TEST(Yaml, MistakesAreFoundWithTheirLine) {
  EXPECT_THAT(refusal("number: [1\n"), HasSubstr("is not valid YAML"));
  EXPECT_THAT(refusal("- 1\n"), NamesField("list"));
  EXPECT_THAT(refusal(""), HasSubstr("found nothing"));
  EXPECT_THAT(refusal("number: 1\nlist: 2\nnumber: 1\n"), NamesField("number", 3));
  EXPECT_THAT(refusal("number: 1\nother: 2\n"), NamesField("field other", 2));
  EXPECT_THAT(refusal("numbr: 1\n"), NamesField("numbr"));
  EXPECT_THAT(refusal("number: 11\n"), NamesField("0 to 10"));
  EXPECT_THAT(refusal("number: .nan\n"), NamesField("finite number"));
  EXPECT_EQ(refusal("number: 1\n"), "accepted");
}

TEST(Yaml, ASecondDocumentIsRefused) {
  EXPECT_THAT(refusal("number: 1\n---\nnumber: 2\n"), NamesField("document", 2));
  EXPECT_THAT(refusal("number: 1\n...\n---\n{}\n"), NamesField("document"));
  EXPECT_EQ(refusal("---\nnumber: 1\n...\n"), "accepted");
}

TEST(Yaml, ATextThatTheLibraryReadsForEverIsRefused) {
  const std::string text = read_text_file(in_source_tree("tests/golden/hostile/yaml-endless.yaml"));
  EXPECT_THAT(refusal(text), HasSubstr("line "));
}

TEST(Yaml, AliasesRepeatTheirNode) {
  const YamlNode tree = parse_yaml("a: &one [1, {b: &two 2}]\nc: *one\nd: *two\n", "alias.yaml");
  ASSERT_EQ(tree.items.size(), 6U);
  ASSERT_EQ(tree.items[3].items.size(), 2U);
  EXPECT_EQ(tree.items[3].items[1].items[1].scalar, "2");
  EXPECT_EQ(tree.items[5].scalar, "2");
  EXPECT_THAT(refusal("a: &one [1, *one]\n"), NamesField("alias", 1));
}

TEST(Yaml, AnchorsWithinAnchorsAreBounded) {
  std::string text;
  for (int depth = 0; depth < 100; ++depth) text += fmt::format("&a{} [", depth);
  for (int i = 0; i < 20'000; ++i) text += "1,";
  text += std::string(100, ']');
  EXPECT_THAT(refusal(text), NamesField("values"));
}

TEST(Yaml, ManyKeysTakeTimeInProportion) {
  std::string text;
  for (int i = 0; i < 100'000; ++i) text += fmt::format("key{}: 1\n", i);
  const auto start = std::chrono::steady_clock::now();
  const YamlMap map(parse_yaml(text, "a.yaml"), "a.yaml", "");
  EXPECT_EQ(map.integer("key99999", 0, 1), 1);
  EXPECT_EQ(map.find("key100000"), nullptr);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(15));  // it was 30
}

TEST(Yaml, AliasesThatRepeatAliasesAreBounded) {
  // Nine levels of nine aliases each would be 387 million values.
  std::string text = "a: &a [x, x, x, x, x, x, x, x, x]\n";
  for (char name = 'b'; name <= 'i'; ++name) {
    text += std::string(1, name) + ": &" + name + " [";
    for (int i = 0; i < 9; ++i) text += std::string(i > 0 ? ", *" : "*") + char(name - 1);
    text += "]\n";
  }
  EXPECT_THAT(refusal(text), NamesField("1000000"));
}

}  // namespace risley::io::yaml_map_test
