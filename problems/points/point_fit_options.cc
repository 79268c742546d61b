// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/point_fit_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <set>
#include <span>
#include <utility>

#include "fitting/plan/alone_fit.h"
#include "fitting/plan/fit_check.h"
#include "surfaces/base/error.h"

namespace semblance::problems {

HSplineShape ShapeFor(const PointFitOptions& options) {
  return {.patches_u = options.patches_u,
          .patches_v = options.patches_v,
          .max_level = FinestPlanLevel(options.fit.plan),
          .closure = options.closure};
}

std::string ClosureFault(const PointFitOptions& options) {
  const bool goes_round = options.closure == Closure::kPeriodicU;
  if (std::holds_alternative<PlaneParameters>(options.parameters) && goes_round) {
    return "parameters on a plane do not go round; write closure: open";
  }
  if (std::holds_alternative<MeshParameters>(options.parameters) && goes_round) {
    return "parameters on a mesh do not go round; write closure: open";
  }
  return "";
}

int RelaxationRounds(const FitOptions& fit) {
  const auto* const plan = std::get_if<AutoPlan>(&fit.plan);
  return plan == nullptr ? 0 : plan->relaxation_rounds;
}

FitOptions WithoutRelaxation(FitOptions fit) {
  if (auto* const plan = std::get_if<AutoPlan>(&fit.plan)) {
    plan->relaxation_rounds = 0;
  }
  return fit;
}

namespace {

// Each of the following returns what is wrong and what to do, or nothing.

std::string AttributesFault(const std::vector<std::string>& names) {
  static const std::set<std::string> kTaken = {
      "x",  "y",  "z",  "u", "v", "weight", "sigma",    "residual_mm", "outlier",
      "nx", "ny", "nz", "s", "t", "point",  "sigma_mm", "exact"};
  std::set<std::string> seen;
  for (const std::string& name : names) {
    const std::string residual = name + "_residual";
    if (std::find(names.begin(), names.end(), residual) != names.end()) {
      return fmt::format(
          "'{}' is the name of the residuals of '{}' in the residuals' file; give the column "
          "another name",
          residual, name);
    }
    if (kTaken.contains(name) || name.empty() ||
        name.find_first_of(" \t,\"\n") != std::string::npos) {
      return fmt::format("'{}' has a meaning of its own, or blanks in it; name another column",
                         name);
    }
    if (!seen.insert(name).second) {
      return fmt::format("'{}' appears twice; name it once", name);
    }
  }
  return "";
}

std::string ShapeFault(const HSplineShape& shape) try {
  // 1024 x 1024 patches: a fit needs about a gigabyte for them, however few points there are.
  constexpr std::int64_t kMostVertices = 1'100'000;
  CheckShape(shape);
  const std::int64_t vertices = std::int64_t{shape.Columns(0)} * shape.Rows(0);
  return vertices <= kMostVertices
             ? ""
             : fmt::format(
                   "{} x {} patches have {} control vertices; level 0 may have {}; take "
                   "fewer patches, and finer levels where the points have detail",
                   shape.patches_u, shape.patches_v, vertices, kMostVertices);
} catch (const InputError& error) {
  return error.what();
}

// The option to blame: patches_v, if as many patches along v as along u would be allowed.
std::string_view WrongPatches(HSplineShape shape) {
  shape.patches_v = shape.patches_u;
  return ShapeFault(shape).empty() ? "patches_v" : "patches_u";
}

// The part of a subject that a term needs and that points of a file lack; empty if there is none.
std::string_view MissingPart(const Term& term) {
  return std::holds_alternative<LandmarkTerm>(term)         ? "standard landmarks"
         : std::holds_alternative<PriorShapeTerm>(term)     ? "a prior's face"
         : std::holds_alternative<NonPenetrationTerm>(term) ? "bone"
         : std::holds_alternative<SpringTerm>(term)         ? "bone"
                                                            : "";
}

void AddTermFaults(std::span<const Term> terms, std::vector<OptionFault>& faults) {
  for (std::size_t k = 0; k < terms.size(); ++k) {
    if (const std::string_view missing = MissingPart(terms[k]);
        !missing.empty() && TermWeight(terms[k]) > 0) {
      faults.push_back({fmt::format("fit.terms[{}]", k),
                        fmt::format("the term '{}' needs {}, and points of a file have none; "
                                    "leave it out",
                                    TermName(terms[k]), missing)});
    }
  }
}

}  // namespace

std::vector<OptionFault> FaultsBetween(const PointFitOptions& options) {
  std::vector<OptionFault> faults;
  const auto add = [&](std::string path, std::string fault) {
    if (!fault.empty()) {
      faults.push_back({std::move(path), std::move(fault)});
    }
  };
  const HSplineShape shape = ShapeFor(options);
  add("closure", ClosureFault(options));
  add(std::string(WrongPatches(shape)), ShapeFault(shape));
  if (options.sigma && !IsAlone(options.fit)) {
    add("sigma",
        "it follows from the noise and smoothness that plan: auto finds with solver: fastest; take "
        "those, or write sigma: false");
  }
  add("attributes", AttributesFault(options.attributes));
  if (!std::holds_alternative<RestoreFeatures>(options.fit.features)) {
    add("fit.features", "a surface through points of a file has no features; leave the option out");
  }
  AddTermFaults(options.fit.terms, faults);
  for (const FitFault& fault : FindFitFaults(WithoutRelaxation(options.fit), shape.max_level)) {
    add("fit." + fault.path, fault.what);
  }
  return faults;
}

}  // namespace semblance::problems
