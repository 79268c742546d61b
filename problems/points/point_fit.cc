// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/point_fit.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "fitting/plan/fit_check.h"
#include "fitting/problem/start_surface.h"
#include "problems/config/config.h"
#include "problems/points/fit_page.h"
#include "problems/points/fit_report.h"
#include "problems/points/residual_files.h"
#include "problems/report/fit_json.h"
#include "problems/report/timing_json.h"
#include "surfaces/base/error.h"
#include "surfaces/hspline_files/hspline_json.h"
#include "surfaces/hspline_query/adaptive_tessellation.h"
#include "surfaces/mesh_files/mesh_io.h"

namespace semblance {
namespace {

using Json = nlohmann::ordered_json;

HSplineShape ShapeOf(const PointFitOptions& options) {
  return {.patches_u = options.patches_u,
          .patches_v = options.patches_v,
          .max_level = FinestLevelOf(options.fit.plan),
          .closure = options.closure};
}

std::string_view NameOf(ParameterSource source) {
  return EnumNames(source)[static_cast<std::size_t>(source)];
}

// Empty if they go together.
std::string ClosureFault(ParameterSource source, Closure closure) {
  if (source == ParameterSource::kCylinder && closure == Closure::kOpen) {
    return "parameters on a cylinder go round; write closure: periodic_u";
  }
  if (source == ParameterSource::kPlane && closure == Closure::kPeriodicU) {
    return "parameters on a plane do not go round; write closure: open";
  }
  return "";
}

void CheckClosure(ParameterSource source, Closure closure) {
  if (const std::string fault = ClosureFault(source, closure); !fault.empty()) {
    throw InputError("closure: " + fault);
  }
}

// What the parameters will be; nothing where that follows from the points.
std::optional<ParameterSource> SourceAsked(const Parameters& parameters) {
  return std::holds_alternative<PlaneParameters>(parameters)
             ? std::optional(ParameterSource::kPlane)
         : std::holds_alternative<CylinderParameters>(parameters)
             ? std::optional(ParameterSource::kCylinder)
             : std::nullopt;
}

Json VerticesJson(const HSplineSurface& surface) {
  const int coarsest = surface.Columns(0) * surface.Rows(0);
  Json json = {{"total", coarsest + surface.Offsets().size()},
               {"by_level", Json::array({coarsest})}};
  for (int level = 1; level <= surface.shape().max_level; ++level) {
    json["by_level"].push_back(surface.Offsets(level).size());
  }
  return json;
}

Json ResultJsonOf(const PointFitOptions& options, const PointSource& source,
                  const PointFit& result) {
  const DistanceQuantiles distance = QuantilesOf(result.fit);
  Json json = {{"title", options.title},
               {"version", SEMBLANCE_VERSION},
               {"points_file", source.name},
               {"points_sha256", source.sha256},
               {"points", result.fit.residual_mm.size()},
               {"parameters", result.parameters},
               {"rms_mm", result.fit.point_rms_mm},
               {"median_mm", distance.median_mm},
               {"p95_mm", distance.p95_mm},
               {"max_mm", distance.max_mm},
               {"control_vertices", VerticesJson(result.fit.surface)},
               {"usable", result.Faults().empty()},
               {"faults", result.Faults()}};
  if (result.fit.automatic) {
    json["automatic"] = AutoJson(*result.fit.automatic);
  }
  if (const auto tolerance = ToleranceOf(options, result)) {
    json["tolerance"] = {{"tolerance_mm", tolerance->tolerance_mm},
                         {"met", tolerance->Met()},
                         {"points_beyond", tolerance->beyond},
                         {"cells", tolerance->cells},
                         {"cells_on_finest_level", tolerance->at_finest}};
  }
  json.update(StepsToJson(result.fit));
  return json;
}

// Of the points' box.
double DiagonalOf(std::span<const Vec3> positions) {
  Eigen::AlignedBox3d box;
  for (const Vec3& p : positions) {
    box.extend(p);
  }
  return box.diagonal().norm();
}

// Before the fit: what could only be refused after it.
void CheckChord(const AutoOr<double>& chord_mm, std::span<const Vec3> positions) {
  constexpr double kFinest = 1e-7;
  const double least = kFinest * DiagonalOf(positions);
  if (!chord_mm.automatic && chord_mm.value < least) {
    throw InputError(fmt::format(
        "chord_mm: {} is too fine for points that extend over {:.3g} mm: surface.ply would have "
        "too many triangles; give at least {:.2g}, or auto",
        chord_mm.value, DiagonalOf(positions), least));
  }
}

// `chord_mm`, or as much more as keeps the triangles within a million or so.
double AffordableChord(const HSplineSurface& surface, double chord_mm) {
  constexpr double kMostCells = 500'000;
  while (std::isfinite(chord_mm) && CellsToChord(surface, chord_mm) > kMostCells) {
    chord_mm *= 2;
  }
  return chord_mm;
}

double ExtentOf(const HSplineSurface& surface) { return DiagonalOf(surface.Net(0).vertices); }

std::string SurfacePly(const HSplineSurface& surface, const AutoOr<double>& chord_mm, int threads) {
  constexpr double kChords = 5000;
  const double chord = chord_mm.automatic ? AffordableChord(surface, ExtentOf(surface) / kChords)
                                          : static_cast<double>(chord_mm);
  Tessellation tessellation = TessellateToChord(surface, chord, threads);
  return EncodeMesh(tessellation.mesh, ".ply", {std::move(tessellation.normals), {}, {}});
}

void WriteResiduals(ResidualFile kind, const FitResult& fit, OutputFolder& folder) {
  constexpr std::size_t kMostAsText = 100'000;
  if (kind == ResidualFile::kAuto) {
    kind = fit.residual_mm.size() <= kMostAsText ? ResidualFile::kCsv : ResidualFile::kPly;
  }
  if (kind == ResidualFile::kCsv) {
    folder.Write("residuals.csv", ResidualsCsv(fit));
  } else if (kind == ResidualFile::kPly) {
    folder.Write("residuals.ply", ResidualsPly(fit));
  }
}

}  // namespace

namespace {

// What points of a file have not; empty for a term that they have all for.
std::string_view WhatIsMissing(const Term& term) {
  return std::holds_alternative<LandmarkTerm>(term)         ? "standard landmarks"
         : std::holds_alternative<PriorShapeTerm>(term)     ? "a prior's face"
         : std::holds_alternative<NonPenetrationTerm>(term) ? "bone"
         : std::holds_alternative<SpringTerm>(term)         ? "bone"
                                                            : "";
}

// Whether there is a surface of so many patches; empty if there is.
std::string ShapeFault(const PointFitOptions& options) try {
  CheckShape(ShapeOf(options));
  return "";
} catch (const InputError& error) {
  return error.what();
}

}  // namespace

std::vector<OptionFault> FaultsBetween(const PointFitOptions& options) {
  std::vector<OptionFault> faults;
  if (const auto source = SourceAsked(options.parameters)) {
    if (std::string fault = ClosureFault(*source, options.closure); !fault.empty()) {
      faults.push_back({"closure", std::move(fault)});
    }
  }
  if (const std::string fault = ShapeFault(options); !fault.empty()) {
    faults.push_back({"patches_u", fault});
  }
  for (std::size_t k = 0; k < options.fit.terms.size(); ++k) {
    const Term& term = options.fit.terms[k];
    if (const std::string_view missing = WhatIsMissing(term);
        !missing.empty() && WeightOf(term) > 0) {
      faults.push_back({fmt::format("fit.terms[{}]", k),
                        fmt::format("the term '{}' looks at {}, and points of a file have none; "
                                    "leave it out",
                                    TermName(term), missing)});
    }
  }
  for (const FitFault& fault : FaultsOf(options.fit, ShapeOf(options).max_level)) {
    faults.push_back({"fit." + fault.path, fault.what});
  }
  return faults;
}

std::optional<ToleranceReport> ToleranceOf(const PointFitOptions& options, const PointFit& result) {
  const auto* adaptive = std::get_if<AdaptivePlan>(&options.fit.plan);
  return adaptive == nullptr || !result.Faults().empty()
             ? std::nullopt
             : std::optional(ToleranceOf(result.fit, adaptive->tolerance_mm, adaptive->finest));
}

PointFit FitPoints(const PointTable& table, const PointFitOptions& options,
                   const RunContext& context) {
  const HSplineShape shape = ShapeOf(options);
  CheckChord(options.chord_mm, table.positions);
  StepClock step(context);
  const Parametrisation parameters = step(
      "parameters", [&] { return Parametrise(table.positions, options.parameters, table.uv); });
  CheckClosure(parameters.source, options.closure);
  const HSplineSurface start = StartSurface(shape, table.positions, parameters.uv);
  PointFit result{.parameters = std::string(NameOf(parameters.source)),
                  .fit = step("fit",
                              [&] {
                                return Fit(start, {table.positions, parameters.uv, table.weights},
                                           options.fit, context);
                              }),
                  .times = {}};
  result.times = step.Take();
  return result;
}

void WritePointFit(const PointFitOptions& options, const PointSource& source,
                   const PointFit& result, OutputFolder& folder, const RunContext& context) {
  context.Report("write");
  // First what can still be refused.
  const std::string mesh = SurfacePly(result.fit.surface, options.chord_mm, context.threads);
  folder.Write("resolved.yaml", WriteConfig(options));
  folder.Write("surface.hspline.json", HSplineToJson(result.fit.surface));
  folder.Write("surface.ply", mesh);
  WriteResiduals(options.residuals, result.fit, folder);
  if (options.report && result.Faults().empty()) {
    folder.Write("report.html", FitPageHtml(options, source, result, context.threads));
  }
  folder.Write("timing.json", TimingJson(result.times));
  folder.Write(
      "result.json",
      ResultJsonOf(options, source, result).dump(2, ' ', false, Json::error_handler_t::replace) +
          "\n");
}

}  // namespace semblance
