// SPDX-License-Identifier: GPL-3.0-or-later
// Which of a subject's landmarks an experiment uses: what is a face worth that is made of fewer?
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "surfaces/base/fields.h"
#include "surfaces/base/geometry.h"

namespace semblance {

struct KeepAll {
  static constexpr std::string_view kName = "all";
};
template <class Visitor>
void Fields(Visitor&, KeepAll&) {}

// Farthest points first: the landmark farthest from the mean of all, then always the one that is
// farthest from those that are kept (Gonzalez 1985). Those of 12 are among those of 16.
struct KeepSpread {
  static constexpr std::string_view kName = "spread";
  int n = 16;  // as widely apart as they can be
};
template <class Visitor>
void Fields(Visitor& visit, KeepSpread& o) {
  visit(FieldInfo{.name = "n",
                  .min = 3,
                  .max = 1000,
                  .doc = "how many are kept, spread as widely as they can be; all, where the "
                         "subject has no more"},
        o.n);
}

struct KeepNames {
  static constexpr std::string_view kName = "names";
  std::vector<std::string> sites;  // by code
};
template <class Visitor>
void Fields(Visitor& visit, KeepNames& o) {
  visit(FieldInfo{.name = "sites",
                  .doc = "codes of the sites that are kept; one that the subject lacks is passed "
                         "over, with a note"},
        o.sites);
}
template <class Report>
void CheckValue(Report& report, const KeepNames& o) {
  if (o.sites.empty()) {
    report("sites", "there is none; name the sites to keep, as in [n, g, me, go_l, go_r]");
  }
}

struct KeepRandom {
  static constexpr std::string_view kName = "random";
  int n = 16;                     // of all
  std::uint64_t random_seed = 1;  // which
};
template <class Visitor>
void Fields(Visitor& visit, KeepRandom& o) {
  visit(FieldInfo{.name = "n",
                  .min = 3,
                  .max = 1000,
                  .doc = "how many are kept; all, where the subject has no more"},
        o.n);
  visit(
      FieldInfo{
          .name = "random_seed",
          .doc = "which; of one random_seed, those of a small n are among those of a larger one"},
      o.random_seed);
}

using LandmarksKept = std::variant<KeepAll, KeepSpread, KeepNames, KeepRandom>;

// Whether each site is kept. points: one per site. `names` keeps a site by its own code alone.
// Ties of `spread` go to the site that stands first.
std::vector<bool> KeptSites(const LandmarksKept& kept, std::span<const std::string> sites,
                            std::span<const Vec3> points);

}  // namespace semblance
