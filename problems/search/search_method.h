// SPDX-License-Identifier: GPL-3.0-or-later
// The ways to search, as options: which treatment is tried next, given what those before were
// worth.
#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <variant>
#include <vector>

#include "problems/config/config_tree.h"
#include "surfaces/base/fields.h"

namespace semblance {

// A Gaussian process of the metric over the axes says where it may be lower than anything found so
// far (expected improvement: Jones, Schonlau & Welch 1998).
struct BayesSearch {
  static constexpr std::string_view kName = "bayes";
  std::optional<int> initial = std::nullopt;  // none: twice the axes and two more
  int batch = 2;  // more at a time use more processors and fewer results
};
template <class Visitor>
void Fields(Visitor& visit, BayesSearch& o) {
  visit(FieldInfo{.name = "initial",
                  .min = 2,
                  .max = 10000,
                  .doc = "treatments before the process is asked, a Latin hypercube; none: twice "
                         "the number of axes and two more"},
        o.initial);
  visit(FieldInfo{.name = "batch",
                  .min = 1,
                  .max = 1000,
                  .doc = "treatments that are chosen together, and run side by side; each after "
                         "the first as if those before it had given what the process expects "
                         "(kriging believer: Ginsbourger et al. 2010)"},
        o.batch);
}

// A normal cloud of treatments that moves, stretches and shrinks towards the better half of its
// last draws (Hansen 2016, The CMA evolution strategy: a tutorial).
struct CmaEsSearch {
  static constexpr std::string_view kName = "cmaes";
  std::optional<int> population = std::nullopt;  // none: 4 + 3 ln(axes), as published
  double sigma = 0.3;                            // a third of an axis: the whole of it is seen
};
template <class Visitor>
void Fields(Visitor& visit, CmaEsSearch& o) {
  visit(FieldInfo{.name = "population",
                  .min = 4,
                  .max = 10000,
                  .doc = "draws of a generation; none: 4 + 3 ln(n) of n numbers, a choice of m "
                         "counting as m. More see further and learn later"},
        o.population);
  visit(FieldInfo{.name = "sigma",
                  .min = 1e-3,
                  .max = 2,
                  .doc = "standard deviation of the first generation, around the middle of each "
                         "axis and as a part of its length"},
        o.sigma);
}

enum class Brackets { kAll, kFirst };
constexpr auto EnumNames(Brackets) { return std::to_array<std::string_view>({"all", "first"}); }

// Many random treatments are run short; the best of them longer, and the best of those in full
// (successive halving: Jamieson & Talwalkar 2016; with brackets, Hyperband: Li et al. 2018).
struct HalvingSearch {
  static constexpr std::string_view kName = "halving";
  int rungs = 3;                                  // lengths of a run, the last in full
  double eta = 3;                                 // the published choice
  Brackets brackets = Brackets::kAll;             // short runs may mislead: some begin higher up
  std::vector<ConfigMap<ConfigNode>> short_runs;  // empty: by the steps of the fit
};
template <class Visitor>
void Fields(Visitor& visit, HalvingSearch& o) {
  visit(
      FieldInfo{
          .name = "rungs", .min = 2, .max = 8, .doc = "lengths of a run, the last of them in full"},
      o.rungs);
  visit(FieldInfo{.name = "eta",
                  .min = 1.5,
                  .max = 10,
                  .doc = "one of so many goes on to the next rung, which is so many times as long"},
        o.eta);
  visit(FieldInfo{.name = "brackets",
                  .doc = "all: Hyperband, in turn many treatments from the first rung, fewer from "
                         "the second, ..., some in full at once; first: from the first rung alone, "
                         "which trusts the short runs"},
        o.brackets);
  visit(FieldInfo{.name = "short_runs",
                  .doc = "what a run is shortened by on each rung but the last, cheapest first, by "
                         "option path, as in [{implicit.resolution: 30}, {implicit.resolution: "
                         "50}]; left out, the fit's own steps: eta times fewer steps of a "
                         "schedule, passes, or levels per rung"},
        o.short_runs);
}
template <class Report>
void CheckValue(Report& report, const HalvingSearch& o) {
  if (!o.short_runs.empty() && static_cast<int>(o.short_runs.size()) != o.rungs - 1) {
    report("short_runs",
           "there must be one for each rung but the last: rungs less one, or none at all");
  }
}

// Each treatment even over the axes, whatever the others gave: what a search must beat.
struct RandomSearch {
  static constexpr std::string_view kName = "random";
};
template <class Visitor>
void Fields(Visitor&, RandomSearch&) {}

using SearchMethod = std::variant<BayesSearch, CmaEsSearch, HalvingSearch, RandomSearch>;

}  // namespace semblance
