// SPDX-License-Identifier: GPL-3.0-or-later
// Structs with every kind of field, for tests of the configuration.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "surfaces/base/fields.h"

namespace semblance::testing {
using namespace problems;

enum class Sex { kMale, kFemale };
constexpr auto EnumNames(Sex) { return std::to_array<std::string_view>({"male", "female"}); }

struct Thesis {
  static constexpr std::string_view kName = "thesis";
  double decay = 6;
  bool operator==(const Thesis&) const = default;
};
template <class Visitor>
void Fields(Visitor& visit, Thesis& o) {
  visit(FieldInfo{.name = "decay", .min = 0.5, .max = 50, .doc = "k of eq. 3.1"}, o.decay);
}

struct Flat {
  static constexpr std::string_view kName = "flat";
  int rings = 2;
  bool operator==(const Flat&) const = default;
};
template <class Visitor>
void Fields(Visitor& visit, Flat& o) {
  visit(FieldInfo{.name = "rings", .min = 1}, o.rings);
}

using Emitter = std::variant<Thesis, Flat>;

struct Mixed {
  static constexpr std::string_view kName = "mixed";
  std::vector<Emitter> parts = {Thesis{}};
  Emitter rest = Flat{};
  bool operator==(const Mixed&) const = default;
};
template <class Visitor>
void Fields(Visitor& visit, Mixed& o) {
  visit(FieldInfo{.name = "parts", .min = 1}, o.parts);
  visit(FieldInfo{.name = "rest"}, o.rest);
}

struct Step {
  int level = 0;
  double fraction = 0.4;
  bool operator==(const Step&) const = default;
};
template <class Visitor>
void Fields(Visitor& visit, Step& o) {
  visit(FieldInfo{.name = "level", .min = 0, .max = 6}, o.level);
  visit(FieldInfo{.name = "fraction", .min = 0, .max = 1}, o.fraction);
}
template <class Report>
void CheckValue(Report& report, const Step& step) {
  if (step.level == 0 && step.fraction == 1) {
    report("fraction", "level 0 may not be fitted wholly; use less than 1");
  }
}

struct Options {
  bool verbose = false;
  int count = 3;
  std::uint64_t random_seed = 1;
  double radius_mm = 2.5;
  std::string label = "one";
  std::filesystem::path skull;
  std::array<double, 3> center_mm = {0, 0, 0};
  Sex sex = Sex::kMale;
  std::optional<double> limit;
  std::vector<Step> schedule = {{0, 0.4}, {1, 0.35}};
  std::map<std::string, std::optional<double>> values;
  std::variant<Thesis, Flat, Mixed> emitter = Flat{};
  Step last;
  std::vector<std::string> tags;
  bool operator==(const Options&) const = default;
};
template <class Visitor>
void Fields(Visitor& visit, Options& o) {
  visit(FieldInfo{.name = "verbose"}, o.verbose);
  visit(FieldInfo{.name = "count", .min = 1, .max = 100}, o.count);
  visit(FieldInfo{.name = "random_seed"}, o.random_seed);
  visit(FieldInfo{.name = "radius_mm", .unit = "mm", .min = 0, .max = 10, .doc = "of the sphere"},
        o.radius_mm);
  visit(FieldInfo{.name = "label"}, o.label);
  visit(FieldInfo{.name = "skull"}, o.skull);
  visit(FieldInfo{.name = "center_mm", .unit = "mm"}, o.center_mm);
  visit(FieldInfo{.name = "sex"}, o.sex);
  visit(FieldInfo{.name = "limit", .min = 0}, o.limit);
  visit(FieldInfo{.name = "schedule", .min = 1}, o.schedule);
  visit(FieldInfo{.name = "values", .unit = "mm", .min = 0}, o.values);
  visit(FieldInfo{.name = "emitter", .doc = "how the skull gives depth"}, o.emitter);
  visit(FieldInfo{.name = "last"}, o.last);
  visit(FieldInfo{.name = "tags"}, o.tags);
}

}  // namespace semblance::testing
