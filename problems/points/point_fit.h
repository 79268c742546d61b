// SPDX-License-Identifier: GPL-3.0-or-later
// An H-spline fitted to any scattered points: `semblance fit`.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "fitting/fit.h"
#include "fitting/parameters/parametrise.h"
#include "fitting/plan/fit_faults.h"
#include "fitting/relaxation/foot_moves.h"
#include "fitting/solve/attribute_fit.h"
#include "fitting/solve/surface_sigma.h"
#include "problems/config/config_errors.h"
#include "problems/pipeline/step_clock.h"
#include "problems/points/fit_joins.h"
#include "problems/points/fit_maps.h"
#include "problems/points/fit_trim.h"
#include "problems/points/join_report.h"
#include "problems/points/point_table.h"
#include "problems/points/surface_join.h"
#include "surfaces/base/fields.h"
#include "surfaces/hspline_query/tessellate.h"

namespace semblance {

// What is written of each point.
enum class ResidualFile { kAuto, kCsv, kPly, kNone };
constexpr auto EnumNames(ResidualFile) {
  return std::to_array<std::string_view>({"auto", "csv", "ply", "none"});
}

struct PointFitOptions {
  std::string title = "untitled";            // of the result
  int patches_u = 8;                         // of level 0
  int patches_v = 8;                         // of level 0
  Closure closure = Closure::kOpen;          // whether u, or u and v, go round
  Parameters parameters;                     // where the points' (u,v) come from
  std::vector<std::string> attributes = {};  // further columns that are fitted
  std::vector<SurfaceJoin> joins = {};       // edges that continue other surfaces
  FitOptions fit = {
      .plan = AutoPlan{},
      .terms = {PointTerm{}, SmoothnessTerm{.weight = AutoOr<double>::Auto(), .length_mm = 1}},
      .solver = Solver::kFastest};
  AutoOr<double> chord_mm = AutoOr<double>::Auto(0.05);  // of surface.ply's triangles
  Trim trim = {};                                        // what surface.ply and pictures leave out
  ResidualFile residuals = ResidualFile::kAuto;  // auto: .csv of up to 100,000 points, else .ply
  bool sigma = false;                            // write the standard deviation; for the plan auto
  bool report = true;                            // write report.html
};
template <class Visitor>
void Fields(Visitor& visit, PointFitOptions& o) {
  visit(FieldInfo{.name = "title", .doc = "what the result is headed with"}, o.title);
  visit(FieldInfo{.name = "patches_u",
                  .min = 1,
                  .max = kMostPatches,
                  .doc = "of level 0 along u; each finer level has twice as many; with patches_v "
                         "at most a million control vertices"},
        o.patches_u);
  visit(FieldInfo{.name = "patches_v", .min = 1, .max = kMostPatches, .doc = "of level 0 along v"},
        o.patches_v);
  visit(FieldInfo{.name = "closure",
                  .doc = "open; periodic_u for surfaces that go round in u, as a tube or a ball "
                         "does; periodic_uv for those that go round both ways, as a torus does"},
        o.closure);
  visit(FieldInfo{.name = "parameters", .doc = "where the points' (u,v) come from"}, o.parameters);
  visit(FieldInfo{.name = "attributes",
                  .doc = "further columns of the points (properties of a PLY) that are fitted over "
                         "the surface, such as [intensity] or [red, green, blue]"},
        o.attributes);
  visit(FieldInfo{.name = "joins",
                  .doc = "edges of the new surface that continue edges of surfaces that are there, "
                         "without a gap or a crease, such as [{surface: "
                         "out/a/surface.hspline.json, its_edge: u1, edge: u0}]; needs the points' "
                         "own u and v, and plan: auto or adaptive"},
        o.joins);
  visit(FieldInfo{.name = "fit", .doc = "the fit; its finest level is the surface's"}, o.fit);
  visit(
      FieldInfo{.name = "chord_mm",
                .unit = "mm",
                .min = 1e-9,
                .max = 1e3,
                .doc = "how far a triangle of surface.ply may be from the surface; auto: 1/5000 "
                       "of the points' extent, or more where that would be millions of triangles"},
      o.chord_mm);
  visit(FieldInfo{.name = "trim",
                  .doc = "what surface.ply and the report leave out: none: nothing; cloud: what is "
                         "far from every point. surface.hspline.json stays whole"},
        o.trim);
  visit(FieldInfo{.name = "residuals",
                  .doc = "what is written of each point: csv: residuals.csv; ply: residuals.ply, "
                         "binary, faster and smaller; none: nothing; auto: csv of up to 100000 "
                         "points, ply of more"},
        o.residuals);
  visit(FieldInfo{.name = "sigma",
                  .doc = "whether the standard deviation of the surface along one axis is written, "
                         "at each point (sigma_mm of residuals.csv or .ply) and each vertex of "
                         "surface.ply: what noise and smoothness leave open; needs plan: auto"},
        o.sigma);
  visit(FieldInfo{.name = "report",
                  .doc = "whether report.html is written: the surface, the points' distances and "
                         "the refinement, as one page"},
        o.report);
}

// What the fit's plan, terms and solver cannot do together. Told with the other faults when a
// configuration is read.
std::vector<OptionFault> FaultsBetween(const PointFitOptions& options);

struct PointFit {
  std::string parameters;               // given, plane, cylinder, sphere, torus or mesh
  std::string how;                      // which of them, in words; empty of given ones
  MapFaults map_faults;                 // of what was chosen
  std::optional<FootMoves> moves = {};  // of (u,v) before the fit, where that was asked for
  std::optional<PoleGaps> poles = {};   // on a sphere, at v = 0 and v = 1
  // Its point_rms_mm: each point counts as much as any other. The weights of its smoothness: as the
  // written terms have them.
  FitResult fit;
  double weighted_rms_mm = kNaN;  // the same with the points' weights; NaN where all are equal
  DistanceQuantiles distance;     // of the points from the surface
  std::vector<JoinReport> joins;  // one per join
  std::vector<PointAttribute> attributes;         // as given
  std::vector<std::vector<double>> attribute_at;  // fitted, at the points
  AttributeFit attribute_fit;
  std::shared_ptr<const SurfaceSigma> sigma;  // of the surface; null where it was not asked for
  std::vector<double> sigma_mm;               // at the points
  double sigma_factor = kNaN;  // how many times the sigma that were given the points are off,
                               // outliers apart; NaN where none were, or by another plan than auto
  double reach = kNaN;         // how far the surface goes beyond the points' box, in its diagonals
  double off = kNaN;           // the points' RMS distance from it, weighted, likewise; NaN for
                               // given (u,v)
  std::vector<StepTime> times;

  // Why the result cannot be used; empty if it can. A surface that goes three diagonals beyond the
  // points where nothing holds it is none of theirs; and points that lie a tenth of the diagonal
  // from it, over (u,v) that were found for them, are on no one sheet.
  std::vector<std::string> Faults() const;
};

// Of an adaptive fit: whether every point is within its tolerance (fit_maps.h).
std::optional<ToleranceReport> ToleranceOf(const PointFitOptions& options, const PointFit& result);

// Throws InputError as Parametrise, StartSurface, Fit, FitJoined and FitAttributes do, for a
// closure that does not suit the parameters (a cylinder, a sphere and a closed mesh go round in
// u, a torus both ways, a plane and an open mesh do not), for joins of points without (u,v) of
// their own, for attributes that the table has not, for a trim below what the points are apart, and
// for a chord so fine that a coarse fit of some of the points has already shown surface.ply to be
// too large, and for moves of (u,v) beside exact points. Reads the surfaces that are joined, and
// throws as OpenJoins does.
PointFit FitPoints(PointTable table, const PointFitOptions& options, const RunContext& context);

// What the points came from.
struct PointSource {
  std::string name, sha256;
};

}  // namespace semblance
