// SPDX-License-Identifier: GPL-3.0-or-later
// The visitors of a `Fields` list (surfaces/base/fields.h): ReadValue, ToTree, DescribeType and
// NamedFiles. config.h explains how they fit together. These templates only dispatch on the type;
// the work is in config_reader.cc and options_reference.cc, so that a variant of many structs stays
// cheap to compile.
//
// A struct may also check several fields together: `template <class Report> void CheckValue(Report&
// report, const T& value)`, found by ADL. It is called after all fields were read without an error,
// and calls `report("field", "what is wrong and what to do")` for each fault.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "problems/config/config_reader.h"
#include "problems/config/options_reference.h"

namespace semblance::problems::config_internal {

template <class T, template <class...> class Template>
inline constexpr bool kIs = false;
template <template <class...> class Template, class... Args>
inline constexpr bool kIs<Template<Args...>, Template> = true;

template <class T>
inline constexpr bool kIsArray = false;
template <class T, std::size_t N>
inline constexpr bool kIsArray<std::array<T, N>> = true;

struct AnyVisitor {
  template <class T>
  void operator()(const FieldInfo&, T&) {}
};
template <class T>
concept HasFields = requires(AnyVisitor& visit, T& value) {
  Fields(visit, value);
};

struct AnyReport {
  void operator()(std::string_view, std::string_view) {}
};
template <class T>
concept HasCheck = requires(AnyReport& report, const T& value) {
  CheckValue(report, value);
};

template <class E>
std::vector<std::string> EnumWords() {
  const auto names = EnumNames(E{});
  return {names.begin(), names.end()};
}

template <class... Types>
std::vector<std::string> TypeNames(const std::variant<Types...>*) {
  return {std::string(Types::kName)...};
}

// Makes the variant's alternative `index` with its defaults.
template <class... Types>
std::variant<Types...> MakeAlternative(const std::variant<Types...>*, std::size_t index) {
  static const std::array<std::variant<Types...> (*)(), sizeof...(Types)> kMakers = {
      [] { return std::variant<Types...>(Types{}); }...};
  return kMakers.at(index)();
}

template <class T>
void ReadValue(ConfigErrors& errors, const ConfigItem& item, T& out);

template <class T>
void CheckWhole(ConfigErrors& errors, const ConfigItem& item, const T& value) {
  if constexpr (HasCheck<T>) {
    const auto report = [&](std::string_view field, std::string_view what) {
      const ConfigNode* node = item.node.Find(field);
      errors.Add(node ? node->location : item.node.location, JoinPath(item.path, field), what);
    };
    CheckValue(report, value);
  }
}

// Reads the map in `item` into the fields of `out`; `is_alternative` allows the key `type`.
template <class T>
void ReadFields(ConfigErrors& errors, const ConfigItem& item, T& out, bool is_alternative) {
  const std::size_t errors_before = errors.size();
  std::vector<std::string> known;
  const auto visit = [&](const FieldInfo& info, auto& field) {
    known.emplace_back(info.name);
    for (const ConfigNode::Entry& entry : item.node.entries) {
      if (entry.key == info.name) {
        ReadValue(errors, {entry.value, JoinPath(item.path, info.name), info}, field);
      }
    }
  };
  Fields(visit, out);
  if (is_alternative) {
    known.emplace_back("type");
  }
  RefuseUnknownKeys(errors, item, known);
  if (errors.size() == errors_before) {
    CheckWhole(errors, item, out);
  }
}

template <class T>
void ReadVariant(ConfigErrors& errors, const ConfigItem& item, T& out,
                 std::optional<std::size_t> default_index) {
  const T* no_value = nullptr;
  const auto index = ReadTypeName(errors, item, TypeNames(no_value), default_index);
  if (!index) {
    return;
  }
  if (*index != out.index()) {
    out = MakeAlternative(no_value, *index);
  }
  std::visit(
      [&](auto& chosen) {
        if (item.node.IsMap()) {
          ReadFields(errors, item, chosen, /*is_alternative=*/true);
        } else {
          CheckWhole(errors, item, chosen);
        }
      },
      out);
}

// Reads an item of a list or map. A variant must name its type, as there is no default type.
template <class T>
void ReadElement(ConfigErrors& errors, const ConfigItem& item, T& out) {
  if constexpr (kIs<T, std::variant>) {
    ReadVariant(errors, item, out, std::nullopt);
  } else {
    ReadValue(errors, item, out);
  }
}

template <class T>
void ReadList(ConfigErrors& errors, const ConfigItem& item, T& out) {
  std::optional<std::size_t> size;
  FieldInfo info = item.info;
  if constexpr (kIsArray<T>) {
    size = out.size();
  } else {
    info.min = FieldInfo{}.min;  // here the minimum is the size of the list, not of its numbers
  }
  if (!RequireList(errors, item) || !RequireSize(errors, item, size)) {
    return;
  }
  if constexpr (!kIsArray<T>) {
    out.assign(item.node.items.size(), {});
  }
  for (std::size_t i = 0; i < item.node.items.size(); ++i) {
    const ConfigNode& node = item.node.items[i];
    typename T::value_type element{};
    ReadElement(errors, {node, JoinPath(item.path, i), info}, element);
    out[i] = std::move(element);
  }
}

template <class T>
void ReadMap(ConfigErrors& errors, const ConfigItem& item, T& out) {
  if (!RequireMap(errors, item)) {
    return;
  }
  out.clear();
  for (const ConfigNode::Entry& entry : item.node.entries) {
    ReadElement(errors, {entry.value, JoinPath(item.path, entry.key), item.info}, out[entry.key]);
  }
}

template <class T>
void ReadMap(ConfigErrors& errors, const ConfigItem& item, ConfigMap<T>& out) {
  if (!RequireMap(errors, item)) {
    return;
  }
  out.entries.clear();
  for (const ConfigNode::Entry& entry : item.node.entries) {
    out.entries.push_back({entry.key, entry.key_location, T{}});
    ReadElement(errors, {entry.value, JoinPath(item.path, entry.key), item.info},
                out.entries.back().value);
  }
}

template <class T>
void ReadValue(ConfigErrors& errors, const ConfigItem& item, T& out) {
  if constexpr (kIs<T, std::optional>) {
    if (item.node.IsNull()) {
      out.reset();
    } else {
      typename T::value_type value = out.value_or(typename T::value_type{});
      ReadValue(errors, item, value);
      out = std::move(value);
    }
  } else if constexpr (kIs<T, std::vector> || kIsArray<T>) {
    ReadList(errors, item, out);
  } else if constexpr (kIs<T, std::map> || kIs<T, ConfigMap>) {
    ReadMap(errors, item, out);
  } else if constexpr (kIs<T, std::variant>) {
    ReadVariant(errors, item, out, out.index());
  } else if constexpr (std::is_enum_v<T>) {
    if (const auto index = ReadWord(errors, item, "word", EnumWords<T>())) {
      out = static_cast<T>(*index);
    }
  } else if constexpr (HasFields<T>) {
    if (RequireMap(errors, item)) {
      ReadFields(errors, item, out, /*is_alternative=*/false);
    }
  } else {
    ReadScalar(errors, item, out);
  }
}

template <class T>
ConfigNode ToTree(const T& value);

template <class T>
void FieldsToTree(const T& value, ConfigNode& map) {
  const auto visit = [&](const FieldInfo& info, const auto& field) {
    map.Set(info.name, ToTree(field));
  };
  T copy = value;  // Fields takes a value that it may write to
  Fields(visit, copy);
}

template <class T>
ConfigNode ItemsToTree(const T& value) {
  ConfigNode node = kIs<T, std::map> ? ConfigNode::Map() : ConfigNode::List();
  for (const auto& item : value) {
    if constexpr (kIs<T, std::map>) {
      node.Set(item.first, ToTree(item.second));
    } else {
      // The explicit type is for std::vector<bool>, whose items are proxies.
      node.items.push_back(ToTree<typename T::value_type>(item));
    }
  }
  return node;
}

template <class T>
ConfigNode ItemsToTree(const ConfigMap<T>& value) {
  ConfigNode node = ConfigNode::Map();
  for (const auto& entry : value.entries) {
    node.Set(entry.key, ToTree(entry.value));
  }
  return node;
}

template <class T>
ConfigNode ToTree(const T& value) {
  if constexpr (kIs<T, std::optional>) {
    return value ? ToTree(*value) : ConfigNode{};
  } else if constexpr (kIs<T, std::vector> || kIsArray<T> || kIs<T, std::map> ||
                       kIs<T, ConfigMap>) {
    return ItemsToTree(value);
  } else if constexpr (kIs<T, std::variant>) {
    ConfigNode map = ConfigNode::Map();
    map.Set("type", ConfigNode::Quoted(TypeNames(&value)[value.index()]));
    std::visit([&](const auto& chosen) { FieldsToTree(chosen, map); }, value);
    return map;
  } else if constexpr (std::is_enum_v<T>) {
    return ConfigNode::Quoted(EnumWords<T>().at(static_cast<std::size_t>(value)));
  } else if constexpr (HasFields<T>) {
    ConfigNode map = ConfigNode::Map();
    FieldsToTree(value, map);
    return map;
  } else {
    return ScalarToTree(value);
  }
}

// Describes the type, with the values in `value` as defaults: the surrounding struct may have other
// defaults than the type itself.
template <class T>
ConfigType DescribeType(const T& value);

template <class T>
std::vector<ConfigField> DescribeFields(const T& value) {
  std::vector<ConfigField> fields;
  const auto visit = [&](const FieldInfo& info, const auto& field) {
    if (info.name == "type") {
      throw std::logic_error("a field may not be named `type`: that is the key of variants");
    }
    fields.push_back({info, DescribeType(field), ToTree(field)});
  };
  T copy = value;  // Fields takes a value that it may write to
  Fields(visit, copy);
  return fields;
}

// The chosen alternative has the values of `value` as defaults, the others have their own.
template <class... Types>
std::vector<ConfigAlternative> DescribeAlternatives(const std::variant<Types...>& value) {
  const auto describe = [&]<class T>(const T* chosen) {
    return ConfigAlternative{std::string(T::kName), DescribeFields(chosen ? *chosen : T{})};
  };
  return {describe(std::get_if<Types>(&value))...};
}

template <class T>
constexpr ConfigType::Kind ScalarKind() {
  using Kind = ConfigType::Kind;
  if constexpr (std::is_same_v<T, bool>) {
    return Kind::kBool;
  } else if constexpr (std::is_same_v<T, int>) {
    return Kind::kInteger;
  } else if constexpr (std::is_same_v<T, std::uint64_t>) {
    return Kind::kUnsigned;
  } else if constexpr (std::is_same_v<T, double>) {
    return Kind::kNumber;
  } else if constexpr (std::is_same_v<T, AutoOr<double>>) {
    return Kind::kAutoNumber;
  } else if constexpr (std::is_same_v<T, std::filesystem::path>) {
    return Kind::kPath;
  } else if constexpr (std::is_same_v<T, ConfigNode>) {
    return Kind::kAny;
  } else {
    static_assert(std::is_same_v<T, std::string>, "a field of this type cannot be configured");
    return Kind::kText;
  }
}

template <class T>
ConfigType DescribeType(const T& value) {
  using Kind = ConfigType::Kind;
  ConfigType type;
  if constexpr (kIs<T, std::optional>) {
    type.kind = Kind::kOptional;
    type.inner = {DescribeType(value.value_or(typename T::value_type{}))};
  } else if constexpr (kIs<T, std::vector>) {
    type.kind = Kind::kList;
    type.inner = {DescribeType(typename T::value_type{})};
  } else if constexpr (kIsArray<T>) {
    type.kind = Kind::kArray;
    type.size = std::tuple_size_v<T>;
    type.inner = {DescribeType(typename T::value_type{})};
  } else if constexpr (kIs<T, std::map>) {
    type.kind = Kind::kMap;
    type.inner = {DescribeType(typename T::mapped_type{})};
  } else if constexpr (kIs<T, ConfigMap>) {
    type.kind = Kind::kMap;
    type.inner = {DescribeType(decltype(T::Entry::value){})};
  } else if constexpr (kIs<T, std::variant>) {
    type.kind = Kind::kVariant;
    type.alternatives = DescribeAlternatives(value);
  } else if constexpr (std::is_enum_v<T>) {
    type.kind = Kind::kWord;
    type.words = EnumWords<T>();
  } else if constexpr (HasFields<T>) {
    type.kind = Kind::kStruct;
    type.fields = DescribeFields(value);
  } else {
    type.kind = ScalarKind<T>();
  }
  return type;
}

}  // namespace semblance::problems::config_internal

namespace semblance::problems {

struct NamedFile {
  std::string option;          // path of the option, e.g. "subject.skull"
  std::filesystem::path file;  // not empty
};

namespace config_internal {

template <class T>
void CollectFiles(const T& value, const std::string& option, std::vector<NamedFile>& files) {
  if constexpr (std::is_same_v<T, std::filesystem::path>) {
    if (!value.empty()) {
      files.push_back({option, value});
    }
  } else if constexpr (kIs<T, std::optional>) {
    if (value) {
      CollectFiles(*value, option, files);
    }
  } else if constexpr (kIs<T, std::vector> || kIsArray<T>) {
    for (std::size_t k = 0; k < value.size(); ++k) {
      CollectFiles<typename T::value_type>(value[k], JoinPath(option, k), files);
    }
  } else if constexpr (kIs<T, std::map>) {
    for (const auto& [key, item] : value) {
      CollectFiles(item, JoinPath(option, key), files);
    }
  } else if constexpr (kIs<T, std::variant>) {
    std::visit([&](const auto& chosen) { CollectFiles(chosen, option, files); }, value);
  } else if constexpr (HasFields<T>) {
    T copy = value;  // Fields takes a value that it may write to
    const auto visit = [&](const FieldInfo& info, const auto& field) {
      CollectFiles(field, JoinPath(option, info.name), files);
    };
    Fields(visit, copy);
  }
}

}  // namespace config_internal

// Collects all files that the options name, in any nested struct or strategy, in the order of the
// fields.
template <class T>
std::vector<NamedFile> NamedFiles(const T& value) {
  std::vector<NamedFile> files;
  config_internal::CollectFiles(value, "", files);
  return files;
}

}  // namespace semblance::problems
