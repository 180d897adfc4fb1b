// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// libFuzzer's program: RISLEY_FUZZ_TARGET says which target.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <random>
#include <string>
#include <utility>

#include <nlohmann/json.hpp>

#include "fuzz/targets.hpp"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* bytes, std::size_t size, std::size_t most);

namespace {

using nlohmann::json;
using risley::fuzz::Target;

const Target& target() {
  static const Target& chosen = []() -> const Target& {
    const char* name = std::getenv("RISLEY_FUZZ_TARGET");
    try {
      return risley::fuzz::target_of(name == nullptr ? "" : name);
    } catch (const std::exception& error) {
      std::fprintf(stderr, "RISLEY_FUZZ_TARGET: %s\n", error.what());
      std::exit(2);
    }
  }();
  return chosen;
}

/// A value somewhere in a document.
json& any_value(json& document, std::mt19937& random) {
  json* at = &document;
  while (!at->empty() && at->is_structured() && random() % 8 != 0) {
    auto next = at->begin();
    std::advance(next, static_cast<std::ptrdiff_t>(random() % at->size()));
    at = &*next;
  }
  return *at;
}

json odd_value(std::mt19937& random) {
  switch (random() % 9) {
    case 0:
      return nullptr;
    case 1:
      return -1;
    case 2:
      return 1e308;
    case 3:
      return "";
    case 4:
      return std::string(300, 'x');
    case 5:
      return json::array();
    case 6:
      return json::object();
    case 7:
      return true;
    default:
      return static_cast<double>(static_cast<std::int32_t>(random())) / 7.0;
  }
}

/// A document with a list of another length, a value of another kind, or a field less or twice.
std::string changed(json document, std::mt19937& random) {
  for (std::uint32_t changes = 1 + random() % 3; changes > 0; --changes) {
    json& value = any_value(document, random);
    if (value.is_array() && !value.empty()) {
      switch (random() % 3) {
        case 0:
          value.erase(random() % value.size());
          break;
        case 1:
          value.push_back(value[random() % value.size()]);
          break;
        default:
          value[random() % value.size()] = odd_value(random);
      }
    } else if (value.is_object() && !value.empty() && random() % 2 == 0) {
      auto field = value.begin();
      std::advance(field, static_cast<std::ptrdiff_t>(random() % value.size()));
      value.erase(field);
    } else {
      json other = random() % 2 == 0 ? odd_value(random) : any_value(document, random);
      any_value(document, random) = std::move(other);
    }
  }
  return document.dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  target().run({bytes, size});
  return 0;
}

/// Reports are changed as documents half of the time.
extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* bytes, std::size_t size,
                                               std::size_t most, unsigned seed) {
  std::mt19937 random(seed);
  if (target().name == "report" && random() % 2 == 0) {
    json document = json::parse(bytes, bytes + size, nullptr, false);
    if (!document.is_discarded()) {
      const std::string text = changed(std::move(document), random);
      if (text.size() <= most) {
        std::copy(text.begin(), text.end(), bytes);
        return text.size();
      }
    }
  }
  return LLVMFuzzerMutate(bytes, size, most);
}
