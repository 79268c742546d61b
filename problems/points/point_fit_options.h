// SPDX-License-Identifier: GPL-3.0-or-later
// The options of `semblance fit`, and the contradictions between them.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "fitting/fit.h"
#include "fitting/parameters/parametrise.h"
#include "problems/config/config_tree.h"
#include "surfaces/base/fields.h"
#include "surfaces/hspline_query/tessellate.h"

namespace semblance::problems {

enum class ResidualFile { kAuto, kCsv, kPly, kNone };
constexpr auto EnumNames(ResidualFile) {
  return std::to_array<std::string_view>({"auto", "csv", "ply", "none"});
}

struct PointFitOptions {
  std::string title = "untitled";
  int patches_u = 8;
  int patches_v = 8;
  bool patches_by_shape = true;
  Closure closure = Closure::kOpen;
  Parameters parameters;
  std::vector<std::string> attributes = {};
  FitOptions fit = {
      .plan = AutoPlan{},
      .terms = {PointTerm{}, SmoothnessTerm{.weight = AutoOr<double>::Auto(), .length_mm = 1}},
      .solver = Solver::kFastest};
  AutoOr<double> chord_mm = AutoOr<double>::Auto(0.05);
  std::string unit = "";
  ResidualFile residuals = ResidualFile::kAuto;
  bool sigma = false;
  bool report = true;
};
template <class Visitor>
void Fields(Visitor& visit, PointFitOptions& o) {
  visit(FieldInfo{.name = "title", .doc = "heading of the result"}, o.title);
  visit(FieldInfo{.name = "patches_u",
                  .min = 1,
                  .max = kMaxPatches,
                  .doc = "of level 0 along u; each finer level has twice as many; with patches_v "
                         "at most a million control vertices"},
        o.patches_u);
  visit(FieldInfo{.name = "patches_v", .min = 1, .max = kMaxPatches, .doc = "of level 0 along v"},
        o.patches_v);
  visit(FieldInfo{.name = "patches_by_shape",
                  .doc =
                      "for a domain in whose shape these patches would be more than three times as "
                      "long as wide: share about as many out so that they are square"},
        o.patches_by_shape);
  visit(FieldInfo{.name = "closure",
                  .doc = "open; or periodic_u for surfaces that go round in u, as a tube does"},
        o.closure);
  visit(FieldInfo{.name = "parameters",
                  .doc = "source of the points' (u,v); auto: the columns u and v if there are any, "
                         "else cylinder with closure: periodic_u, else mesh if there are triangles "
                         "and the points fold over every plane, else plane"},
        o.parameters);
  visit(FieldInfo{.name = "attributes",
                  .doc = "further columns of the points (properties of a PLY) that are fitted over "
                         "the surface, such as [intensity] or [red, green, blue]"},
        o.attributes);
  visit(FieldInfo{.name = "fit", .doc = "the fit; its finest level is that of the surface"}, o.fit);
  visit(
      FieldInfo{.name = "chord_mm",
                .unit = "mm",
                .min = 1e-9,
                .max = 1e3,
                .doc = "largest distance of the triangles of surface.ply from the surface, along z "
                       "for heights over x and y; auto: 1/5000 of the points' extent, or more if "
                       "that would be millions of triangles"},
      o.chord_mm);
  visit(FieldInfo{.name = "unit",
                  .doc = "unit of the heights (of all coordinates, where they share one), which is "
                         "printed beside lengths, such as m; files of points do not state it, so "
                         "without this option lengths have no unit, whatever the options' names"},
        o.unit);
  visit(FieldInfo{.name = "residuals",
                  .doc = "file of the points' residuals: csv: residuals.csv; ply: residuals.ply, "
                         "binary, faster and smaller; none: no file; auto: csv for up to 100000 "
                         "points, ply for more"},
        o.residuals);
  visit(FieldInfo{.name = "sigma",
                  .doc = "write the standard deviation of the surface along one axis, from noise "
                         "and smoothness, at each point (sigma_mm of residuals.csv or .ply) and at "
                         "each vertex of surface.ply; needs plan: auto"},
        o.sigma);
  visit(FieldInfo{.name = "report",
                  .doc = "write report.html: one page with the surface, the points' distances and "
                         "the refinement"},
        o.report);
}

// Options that contradict each other. They are reported with the other faults when a configuration
// is read.
std::vector<OptionFault> FaultsBetween(const PointFitOptions& options);

// The shape of the surface that the options ask for, before the shape of the domain counts.
HSplineShape ShapeFor(const PointFitOptions& options);
// Returns what is wrong with the closure for these parameters and what to do, or nothing.
std::string ClosureFault(const PointFitOptions& options);
// The rounds in which (u,v) move before the fit; 0 for plans other than auto.
int RelaxationRounds(const FitOptions& fit);
// The options of the fit itself, before which (u,v) have been moved.
FitOptions WithoutRelaxation(FitOptions fit);

}  // namespace semblance::problems
