// SPDX-License-Identifier: GPL-3.0-or-later
// Describes the fields of an options struct in one list. The YAML reader, the writer, the range
// checks, the reference and the JSON Schema all use that list. A struct needs only this header to
// have one, so options can live in any layer.
//
//   struct SplitEmitter {
//     static constexpr std::string_view kName = "split";
//     double decay = 6;
//     double split = 0.5;
//   };
//   template <class Visitor>
//   void Fields(Visitor& visit, SplitEmitter& o) {
//     visit(FieldInfo{.name = "decay", .min = 0.5, .max = 50,
//                     .doc = "k of eq. 3.2; larger blends less"}, o.decay);
//     visit(FieldInfo{.name = "split", .min = 0, .max = 1, .doc = "t of eq. 3.2"}, o.split);
//   }
//
// A field may be: bool, int, std::uint64_t, double, std::string, std::filesystem::path (relative to
// the config file), std::array<double, N>, an enum with EnumNames, std::optional<T>,
// std::vector<T>, std::map<std::string, T>, AutoOr<T>, another struct with Fields, or a
// std::variant of structs with kName. A variant is written as a map with `type:`, or as the bare
// name if all its options keep their defaults. No field may be named `type`.
//
// An enum E needs `constexpr auto EnumNames(E) { return std::to_array<std::string_view>({"male",
// "female"}); }`, found by argument-dependent lookup, in the order of the values 0, 1, ...
#pragma once

#include <limits>
#include <string_view>

#include "surfaces/base/layers.h"

namespace semblance::surfaces {

struct FieldInfo {
  std::string_view name;
  std::string_view unit = {};  // "mm", "deg", "s" or empty; for the reference
  // Smallest and largest value allowed for numbers; `min` is also the least size of a list.
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  std::string_view doc = {};  // meaning, effect of more or less, source
};

// A value that may be left to the program. In a config it is a value or the word `auto`. If
// `automatic`, `value` is only the start of the program's search. Converts to its value.
template <class T>
struct AutoOr {
  T value = {};
  bool automatic = false;

  constexpr AutoOr(T given = {}) : value(given) {}  // NOLINT: stands for a value
  static constexpr AutoOr Auto(T start = 1) {
    AutoOr result(start);
    result.automatic = true;
    return result;
  }
  constexpr operator T() const { return value; }  // NOLINT
};

}  // namespace semblance::surfaces
