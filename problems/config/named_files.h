// SPDX-License-Identifier: GPL-3.0-or-later
// The files that a value of options names, whatever struct or strategy they stand in.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "problems/config/config_binder.h"

namespace semblance {

struct NamedFile {
  std::string option;          // its path, e.g. "subject.skull"
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

// In the order of the fields.
template <class T>
std::vector<NamedFile> NamedFiles(const T& value) {
  std::vector<NamedFile> files;
  config_internal::CollectFiles(value, "", files);
  return files;
}

}  // namespace semblance
