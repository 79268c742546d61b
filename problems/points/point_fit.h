// SPDX-License-Identifier: GPL-3.0-or-later
// An H-spline fitted to any scattered points: `semblance fit`.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "fitting/fit.h"
#include "fitting/plan/fit_faults.h"
#include "fitting/problem/parametrise.h"
#include "problems/config/config_errors.h"
#include "problems/output/files.h"
#include "problems/pipeline/step_clock.h"
#include "problems/points/point_table.h"

namespace semblance {

struct PointFitOptions {
  std::string title = "untitled";
  int patches_u = 8;
  int patches_v = 8;
  Closure closure = Closure::kOpen;
  Parameters parameters;
  FitOptions fit = {
      .plan = AdaptivePlan{},
      .terms = {PointTerm{}, SmoothnessTerm{.weight = AutoOr<double>::Auto(), .length_mm = 1}},
      .solver = Solver::kFastest};
  double chord_mm = 0.05;
};
template <class Visitor>
void Fields(Visitor& visit, PointFitOptions& o) {
  visit(FieldInfo{.name = "title", .doc = "what the result is headed with"}, o.title);
  visit(FieldInfo{.name = "patches_u",
                  .min = 1,
                  .max = 4096,
                  .doc = "of level 0 along u; each finer level has twice as many"},
        o.patches_u);
  visit(FieldInfo{.name = "patches_v", .min = 1, .max = 4096, .doc = "of level 0 along v"},
        o.patches_v);
  visit(FieldInfo{.name = "closure", .doc = "periodic_u for surfaces that go round"}, o.closure);
  visit(FieldInfo{.name = "parameters", .doc = "where the points' (u,v) come from"}, o.parameters);
  visit(FieldInfo{.name = "fit", .doc = "the fit; its finest level is the surface's"}, o.fit);
  visit(FieldInfo{.name = "chord_mm",
                  .unit = "mm",
                  .min = 1e-9,
                  .max = 1e3,
                  .doc = "how far a triangle of surface.ply may be from the surface"},
        o.chord_mm);
}

// What the fit's plan, terms and solver cannot do together. Told with the other faults when a
// configuration is read.
std::vector<OptionFault> FaultsBetween(const PointFitOptions& options);

struct PointFit {
  std::string parameters;  // given, plane or cylinder
  FitResult fit;
  std::vector<StepTime> times;

  // Why the result cannot be used; empty if it can.
  std::vector<std::string> Faults() const { return FaultsIn(fit); }
};

// Throws InputError as Parametrise, StartSurface and Fit do, and for a closure that does not suit
// the parameters (a cylinder is periodic, a plane is not).
PointFit FitPoints(const PointTable& table, const PointFitOptions& options,
                   const RunContext& context);

// Writes resolved.yaml, result.json, residuals.csv (in the order of the table),
// surface.hspline.json, surface.ply and timing.json; the same bytes for the same input, timing.json
// apart.
void WritePointFit(const PointFitOptions& options, const std::filesystem::path& points,
                   const PointFit& result, OutputFolder& folder, const RunContext& context);

}  // namespace semblance
