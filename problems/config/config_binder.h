// SPDX-License-Identifier: GPL-3.0-or-later
// Binds structs with a `Fields` list (surfaces/base/fields.h) to trees: ReadValue, ToTree and
// DescribeType. Only the choice by type is done here; the work is in config_reader.cc and
// options_reference.cc, so that a variant of many structs stays cheap to compile.
//
// A struct may check itself as a whole: `template <class Report> void CheckValue(Report& report,
// const T& value)`, found by ADL and called after all its fields were read without an error; it
// says `report("field", "what is wrong and what to do")` for each complaint.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "problems/config/config_reader.h"
#include "problems/config/config_types.h"

namespace semblance::config_internal {

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
std::vector<std::string> WordsOf() {
  const auto names = EnumNames(E{});
  return {names.begin(), names.end()};
}

template <class... Types>
std::vector<std::string> NamesOf(const std::variant<Types...>*) {
  return {std::string(Types::kName)...};
}

// The variant's alternative `index` with its defaults.
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
  const auto index = ReadTypeName(errors, item, NamesOf(no_value), default_index);
  if (!index) {
    return;
  }
  if (*index != out.index()) {
    out = MakeAlternative(no_value, *index);
  }
  if (item.node.IsMap()) {
    std::visit([&](auto& chosen) { ReadFields(errors, item, chosen, /*is_alternative=*/true); },
               out);
  }
}

// An item of a list or map: it has no default that a map without `type` could mean.
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
    info.min = FieldInfo{}.min;  // the least size of this list, not the least of its numbers
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
    if (const auto index = ReadWord(errors, item, "word", WordsOf<T>())) {
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

}  // namespace semblance::config_internal
