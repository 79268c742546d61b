// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/place_points.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "fitting/plan/alone_fit.h"
#include "fitting/problem/start_surface.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

// Moves (u,v) and triangles out of the table, so that their memory is free during the fit.
// given: of each point, if not all take part.
Parametrisation FindParameters(PointTable& table, std::span<const Triangle> triangles,
                               std::span<const std::uint32_t> given,
                               const PointFitOptions& options) {
  const auto name_of = [&](std::size_t point) {
    return PointName(table, given.empty() ? point : given[point]);
  };
  return Parametrise({.positions = table.positions,
                      .given_uv = std::exchange(table.uv, {}),
                      .triangles = triangles,
                      .closure = options.closure,
                      .name_of = name_of,
                      .has_map_columns = table.has_map_columns},
                     options.parameters);
}

FootMoves MoveUv(const PointTable& table, std::span<const Triangle> triangles,
                 const PointFitOptions& options, const HSplineShape& shape,
                 const RunContext& context, std::vector<Vec2>& uv) {
  if (!table.exact.empty()) {
    throw InputError(
        "fit.plan.relaxation_rounds: exact points need their (u,v), and those around them, as they "
        "are; write relaxation_rounds: 0, or leave the column exact out");
  }
  MovedUv moved = MoveToFeet(shape, {table.positions, uv, table.weights}, triangles,
                             std::get<AutoPlan>(options.fit.plan), context);
  uv = std::move(moved.uv);
  return moved.moves;
}

// The sides of the domain in space; NaN where they are not known.
Vec2 SidesOf(const Parametrisation& parameters, std::span<const Vec3> positions, Closure closure) {
  constexpr double kMostSlant = 0.5;  // cosine, beyond which (u,v) in other units bend the sides
  if (closure != Closure::kOpen || parameters.source != ParameterSource::kGiven) {
    return parameters.lengths_mm;
  }
  const HSplineShape one{.patches_u = 1, .patches_v = 1, .max_level = 0};
  const SurfaceFrame frame = StartSurface(one, positions, parameters.uv).Frame({0.5, 0.5});
  const double slant = std::abs(frame.du.dot(frame.dv)) / (frame.du.norm() * frame.dv.norm());
  return slant < kMostSlant ? Vec2(frame.du.norm(), frame.dv.norm()) : Vec2::Constant(kNaN);
}

// The shape with about as many patches of level 0, which are square in a domain with these sides.
// points: their number; a long strip gets more patches if they allow it.
HSplineShape BySides(HSplineShape shape, const Vec2& sides_mm, std::size_t points) {
  constexpr double kMostLong = 3;  // of a patch, relative to its width
  constexpr double kPointsPerPatch = 6;
  const double longer = sides_mm.x() / shape.patches_u / (sides_mm.y() / shape.patches_v);
  if (shape.ClosedU() || !(longer > kMostLong || longer < 1 / kMostLong)) {
    return shape;
  }
  const double patches = static_cast<double>(shape.patches_u) * shape.patches_v,
               aspect = sides_mm.x() / sides_mm.y(), most = kMaxPatches >> shape.max_level;
  const auto along = [&](double ratio) {
    const double in_strip = std::min(ratio, static_cast<double>(points) / kPointsPerPatch);
    const double count = ratio > patches ? std::max(patches, in_strip) : std::sqrt(patches * ratio);
    return static_cast<int>(std::clamp(std::round(count), 1.0, most));
  };
  shape.patches_u = along(aspect);
  shape.patches_v = along(1 / aspect);
  return shape;
}

HSplineShape ShapeOver(const Parametrisation& parameters, const PointTable& table,
                       const PointFitOptions& options) {
  const HSplineShape shape = ShapeFor(options);
  return options.patches_by_shape
             ? BySides(shape, SidesOf(parameters, table.positions, options.closure),
                       table.positions.size())
             : shape;
}

}  // namespace

PreparedPoints PlacePoints(PointTable& table, std::span<const std::uint32_t> given,
                           const PointFitOptions& options, StepClock& step,
                           const RunContext& context) {
  if (const std::string fault = ClosureFault(options); !fault.empty()) {
    throw InputError("closure: " + fault);
  }
  const std::vector<Triangle> triangles = std::exchange(table.triangles, {});
  PreparedPoints placed{
      .parameters =
          step("parameters", [&] { return FindParameters(table, triangles, given, options); }),
      .shape = {}};
  placed.shape = ShapeOver(placed.parameters, table, options);
  if (RelaxationRounds(options.fit) == 0 && placed.parameters.is_graph && IsAlone(options.fit)) {
    placed.shape.reference = OffsetReference::kWorld;  // so that z can be scaled
  }
  if (RelaxationRounds(options.fit) > 0) {
    placed.moves = step("relaxation", [&] {
      return MoveUv(table, triangles, options, placed.shape, context, placed.parameters.uv);
    });
  }
  return placed;
}

}  // namespace semblance::problems
