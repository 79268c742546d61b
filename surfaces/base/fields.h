// SPDX-License-Identifier: GPL-3.0-or-later
// How an options struct lists its fields, once. The reader, the writer, the range checks, the
// reference and the JSON Schema all come from that one list; a struct needs no more than this
// header to have one, so options can live on any floor.
//
//   struct SplitEmitter {
//     static constexpr std::string_view kName = "split";
//     double decay = 6;
//     double split = 0.5;
//   };
//   template <class Visitor>
//   void Fields(Visitor& visit, SplitEmitter& o) {
//     visit(FieldInfo{.name = "decay", .min = 0.5, .max = 50, .doc = "k of eq. 3.2; larger blends
//     less"}, o.decay); visit(FieldInfo{.name = "split", .min = 0, .max = 1, .doc = "t of
//     eq. 3.2"}, o.split);
//   }
//
// A field may be: bool, int, std::uint64_t, double, std::string, std::filesystem::path (relative to
// the config file), std::array<double, N>, an enum with EnumNames, std::optional<T>,
// std::vector<T>, std::map<std::string, T>, another struct with Fields, or a std::variant of
// structs with kName (written as a map with `type:`, or as the bare name when all its options keep
// their defaults). No field may be named `type`. `min` is the least size of a std::vector; else min
// and max bound the numbers inside.
#pragma once

#include <limits>
#include <string_view>

namespace semblance {

struct FieldInfo {
  std::string_view name;
  std::string_view unit = {};  // "mm", "deg", "s" or empty; for the reference
  double min = -std::numeric_limits<double>::infinity();  // smallest value allowed, for numbers;
                                                          // also the least size of a list
  double max = std::numeric_limits<double>::infinity();   // largest value allowed
  std::string_view doc = {};  // what it means, effect of more or less, source
};

// For an enum E: `constexpr auto EnumNames(E) { return std::to_array<std::string_view>({"male",
// "female"}); }`, found by ADL, in the order of the values 0, 1, ...

}  // namespace semblance
