// SPDX-License-Identifier: GPL-3.0-or-later
// The other direction of config_binder.h: values to trees, and types to descriptions.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "problems/config/config_binder.h"

namespace semblance::config_internal {

// Scalars as they are read back: numbers in the fewest digits that give the same bits, paths
// absolute.
ConfigNode ScalarToTree(bool value);
ConfigNode ScalarToTree(int value);
ConfigNode ScalarToTree(std::uint64_t value);
ConfigNode ScalarToTree(double value);
ConfigNode ScalarToTree(const AutoOr<double>& value);
ConfigNode ScalarToTree(const std::string& value);
ConfigNode ScalarToTree(const std::filesystem::path& value);
inline ConfigNode ScalarToTree(const ConfigNode& value) { return value; }

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
      // Through the value's own type, as std::vector<bool> has items of another.
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
    map.Set("type", ConfigNode::Quoted(NamesOf(&value)[value.index()]));
    std::visit([&](const auto& chosen) { FieldsToTree(chosen, map); }, value);
    return map;
  } else if constexpr (std::is_enum_v<T>) {
    return ConfigNode::Quoted(WordsOf<T>().at(static_cast<std::size_t>(value)));
  } else if constexpr (HasFields<T>) {
    ConfigNode map = ConfigNode::Map();
    FieldsToTree(value, map);
    return map;
  } else {
    return ScalarToTree(value);
  }
}

// The type with the defaults that `value` holds: those of the struct around it, which may differ
// from the type's own.
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

// The chosen alternative has the options of `value`, the others their own defaults.
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
    type.words = WordsOf<T>();
  } else if constexpr (HasFields<T>) {
    type.kind = Kind::kStruct;
    type.fields = DescribeFields(value);
  } else {
    type.kind = ScalarKind<T>();
  }
  return type;
}

}  // namespace semblance::config_internal
