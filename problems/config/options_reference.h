// SPDX-License-Identifier: GPL-3.0-or-later
// A description of all options as data (ConfigType), which config_binder.h makes from the `Fields`
// lists, and its forms: text for people, JSON Schema for editors, JSON values for programs.
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "problems/config/config_tree.h"
#include "surfaces/base/fields.h"

namespace semblance::problems {

struct ConfigField;
struct ConfigAlternative;

struct ConfigType {
  enum class Kind {
    kBool,
    kInteger,
    kUnsigned,
    kNumber,
    kAutoNumber,  // a number or the word `auto`
    kAny,         // any part of a tree
    kText,
    kPath,
    kWord,      // an enum; words
    kOptional,  // inner[0] or null
    kArray,     // `size` of inner[0]
    kList,      // any number of inner[0]
    kMap,       // free keys to inner[0]
    kStruct,    // fields
    kVariant    // alternatives
  };
  Kind kind = Kind::kText;
  std::size_t size = 0;
  std::vector<std::string> words;
  std::vector<ConfigType> inner;
  std::vector<ConfigField> fields;
  std::vector<ConfigAlternative> alternatives;
};

struct ConfigField {
  FieldInfo info;  // its string views must outlive this struct, as string literals do
  ConfigType type;
  ConfigNode default_value;
};

struct ConfigAlternative {
  std::string name;
  std::vector<ConfigField> fields;
};

// Writes one paragraph per option: "emitter.decay (type: split): number, default 6, 0.5 to 50",
// then its meaning, indented. An item of a list is `path[]`, an entry of a map `path.<name>`.
std::string ReferenceText(const ConfigType& type);

// Writes a JSON Schema (draft 2020-12) of a file with these options.
std::string SchemaText(const ConfigType& type);

// Converts the tree of a value of that type (MakeConfigTree) to JSON: an object for a struct, an
// object with `type` for a variant, null for a number that is not finite.
nlohmann::ordered_json ValueJson(const ConfigNode& tree, const ConfigType& type);

}  // namespace semblance::problems
