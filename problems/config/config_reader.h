// SPDX-License-Identifier: GPL-3.0-or-later
// The part of reading that needs no template: one entry of a tree to one plain value, with every
// complaint about it. config_binder.h calls these for each field of a struct.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "problems/config/config_errors.h"
#include "problems/config/config_tree.h"
#include "surfaces/base/fields.h"

namespace semblance {

// An entry on its way to a field.
struct ConfigItem {
  const ConfigNode& node;
  std::string path;       // "" for the whole document
  const FieldInfo& info;  // of the field, for its range and unit
};

// Each ReadX leaves `out` alone and adds an error if the entry is not an X within its range.
//   bool     true or false, and nothing else
//   integer  decimal digits with an optional sign; 1e3, 1.0, 010 and 0x10 are errors
//   number   decimal, `.` and exponent allowed; nan and inf are errors, also as too large a number
//   text     any scalar, plain or quoted, other than null
//   any      whatever stands there, for who knows later what it is
//   path     a text; relative ones are relative to the folder of the file it stands in (or to the
//            current folder, in an override); an absolute one that leads nowhere is a file of that
//            name beside the file, where one lies there (a run's folder that was sent to somebody);
//            absolute and normal when read; empty stays empty
void ReadScalar(ConfigErrors& errors, const ConfigItem& item, bool& out);
void ReadScalar(ConfigErrors& errors, const ConfigItem& item, int& out);
void ReadScalar(ConfigErrors& errors, const ConfigItem& item, std::uint64_t& out);
void ReadScalar(ConfigErrors& errors, const ConfigItem& item, double& out);
void ReadScalar(ConfigErrors& errors, const ConfigItem& item, AutoOr<double>& out);  // or `auto`
void ReadScalar(ConfigErrors& errors, const ConfigItem& item, std::string& out);
void ReadScalar(ConfigErrors& errors, const ConfigItem& item, std::filesystem::path& out);
void ReadScalar(ConfigErrors& errors, const ConfigItem& item, ConfigNode& out);

// The index of the scalar in `words`, or nothing and an error. `what` is "word" or "type".
std::optional<std::size_t> ReadWord(ConfigErrors& errors, const ConfigItem& item,
                                    std::string_view what, std::span<const std::string> words);

// The index of the type that a variant's entry names, be it a bare name or a map with `type`; a map
// without `type` means `default_index`, or is an error where that is nothing.
std::optional<std::size_t> ReadTypeName(ConfigErrors& errors, const ConfigItem& item,
                                        std::span<const std::string> names,
                                        std::optional<std::size_t> default_index);

// Whether the entry is of that kind; adds an error if not.
bool RequireMap(ConfigErrors& errors, const ConfigItem& item);
bool RequireList(ConfigErrors& errors, const ConfigItem& item);
// Whether a list has `size` items; or, with no size, at least info.min.
bool RequireSize(ConfigErrors& errors, const ConfigItem& item, std::optional<std::size_t> size);

// Complains about each key of the map that is not among `known`.
void RefuseUnknownKeys(ConfigErrors& errors, const ConfigItem& item,
                       std::span<const std::string> known);

// "a.b", or "b" at the top.
std::string JoinPath(std::string_view parent, std::string_view key);
std::string JoinPath(std::string_view parent, std::size_t index);

// "0 to 10 mm", "at least 0 mm", "at most 5", or "" where nothing is bounded.
std::string RangeText(const FieldInfo& info);

}  // namespace semblance
