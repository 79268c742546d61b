// SPDX-License-Identifier: GPL-3.0-or-later
// What can be configured, as data: made from the `Fields` lists by config_binder.h, read by the
// reference, the JSON Schema, and whatever wants to offer options to people.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "problems/config/config_tree.h"
#include "surfaces/base/fields.h"

namespace semblance {

struct ConfigField;
struct ConfigAlternative;

struct ConfigType {
  enum class Kind {
    kBool,
    kInteger,
    kUnsigned,
    kNumber,
    kAutoNumber,  // a number or the word auto
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
  FieldInfo info;  // its views must outlive this, as string literals do
  ConfigType type;
  ConfigNode default_value;
};

struct ConfigAlternative {
  std::string name;
  std::vector<ConfigField> fields;
};

}  // namespace semblance
