// SPDX-License-Identifier: GPL-3.0-or-later
// Conversions between one entry of a tree and one plain value, in both directions: the part of
// reading and writing that needs no template. config_binder.h calls these functions for each field
// of a struct.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "problems/config/config_tree.h"
#include "surfaces/base/fields.h"

namespace semblance::problems {

// An entry of a tree and the field that it is read into.
struct ConfigItem {
  const ConfigNode& node;
  std::string path;       // "" for the whole document
  const FieldInfo& info;  // range and unit of the field
};

// Each overload reads a value of the type of `out`. If the entry is not such a value within its
// range, it adds an error and leaves `out` unchanged.
//   bool     true or false, and no other word
//   integer  decimal digits with an optional sign; 1e3, 1.0, 010 and 0x10 are errors
//   number   decimal, `.` and exponent allowed; nan, inf and numbers too large for a double are
//   errors text     any scalar, plain or quoted, other than null any      any part of a tree,
//   copied without checks path     a text. A relative path is relative to the folder of its file,
//   or to the current folder
//            in an override. If an absolute path does not exist but a file of the same name lies
//            in the folder of the file, that file is taken: the folder of a run may have been moved
//            to another machine. The result is absolute and normal; an empty path stays empty.
void ReadScalar(ConfigErrors& errors, const ConfigItem& item, bool& out);
void ReadScalar(ConfigErrors& errors, const ConfigItem& item, int& out);
void ReadScalar(ConfigErrors& errors, const ConfigItem& item, std::uint64_t& out);
void ReadScalar(ConfigErrors& errors, const ConfigItem& item, double& out);
void ReadScalar(ConfigErrors& errors, const ConfigItem& item, AutoOr<double>& out);  // or `auto`
void ReadScalar(ConfigErrors& errors, const ConfigItem& item, std::string& out);
void ReadScalar(ConfigErrors& errors, const ConfigItem& item, std::filesystem::path& out);
void ReadScalar(ConfigErrors& errors, const ConfigItem& item, ConfigNode& out);

// Returns the index of the scalar in `words`, or adds an error and returns nothing. `what` is
// "word" or "type".
std::optional<std::size_t> ReadWord(ConfigErrors& errors, const ConfigItem& item,
                                    std::string_view what, std::span<const std::string> words);

// Returns the index of the type that a variant's entry names, as a bare name or in a map with
// `type`. A map without `type` means `default_index`; if that is nothing, it is an error.
std::optional<std::size_t> ReadTypeName(ConfigErrors& errors, const ConfigItem& item,
                                        std::span<const std::string> names,
                                        std::optional<std::size_t> default_index);

// Each returns true if the entry is of that kind, and adds an error otherwise.
bool RequireMap(ConfigErrors& errors, const ConfigItem& item);
bool RequireList(ConfigErrors& errors, const ConfigItem& item);
// Returns true if the list has `size` items, or, without a size, at least info.min items. Adds an
// error otherwise.
bool RequireSize(ConfigErrors& errors, const ConfigItem& item, std::optional<std::size_t> size);

// Adds an error for each key of the map that is not in `known`.
void RefuseUnknownKeys(ConfigErrors& errors, const ConfigItem& item,
                       std::span<const std::string> known);

// Describes the range: "0 to 10 mm", "at least 0 mm", "at most 5", or "" without bounds.
std::string RangeText(const FieldInfo& info);

namespace config_internal {

// Write a value so that ReadScalar reads the same value: numbers with the fewest digits that give
// the same bits, paths absolute.
ConfigNode ScalarToTree(bool value);
ConfigNode ScalarToTree(int value);
ConfigNode ScalarToTree(std::uint64_t value);
ConfigNode ScalarToTree(double value);
ConfigNode ScalarToTree(const AutoOr<double>& value);
ConfigNode ScalarToTree(const std::string& value);
ConfigNode ScalarToTree(const std::filesystem::path& value);
inline ConfigNode ScalarToTree(const ConfigNode& value) { return value; }

}  // namespace config_internal

}  // namespace semblance::problems
