// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/plan/attribute_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "fitting/least_squares/patch_energy.h"
#include "fitting/nested/nested_fit.h"
#include "surfaces/base/error.h"
#include "surfaces/hspline_query/hspline_batch.h"

namespace semblance::fitting {
namespace {

void CheckColumns(const AttributeColumns& points) {
  for (const std::span<const double>& column : points.columns) {
    if (const std::size_t count = points.uv.size(); column.size() != count) {
      throw InputError(
          fmt::format("attributes: a column has {} numbers for {} points; give one each",
                      column.size(), count));
    }
    const auto bad = std::find_if_not(column.begin(), column.end(),
                                      [](double value) { return std::isfinite(value); });
    if (bad != column.end()) {
      throw InputError(
          fmt::format("attributes: the number of point {} is not finite", bad - column.begin()));
    }
  }
}

void CheckCount(std::size_t points) {
  constexpr std::size_t kFewest = 16;  // of the auto plan
  if (points < kFewest) {
    throw InputError(fmt::format(
        "attributes: {} points are too few for a fit of their own; give at least {}, or leave "
        "`attributes` out",
        points, kFewest));
  }
}

std::vector<std::uint32_t> AllBut(std::span<const std::uint32_t> left_out, std::size_t count) {
  std::vector<std::uint32_t> used;
  for (std::uint32_t k = 0; k < count; ++k) {
    if (!std::binary_search(left_out.begin(), left_out.end(), k)) {
      used.push_back(k);
    }
  }
  return used;
}

// Level 0 of the surface, without detail, as the start of a fit down to the plan's finest level.
HSplineSurface StartOver(const HSplineSurface& surface, const AutoPlan& plan) {
  HSplineShape shape = surface.shape();
  shape.max_level = plan.finest;
  shape.reference = OffsetReference::kWorld;
  return HSplineSurface(shape, surface.Net(0));
}

// The used points, and their places on the start.
struct Base {
  std::vector<std::uint32_t> used;
  std::vector<Vec2> uv;
  std::vector<double> weights;  // empty: all 1
  std::vector<Vec3> on_start;
};

Base MakeBase(const HSplineSurface& start, const AttributeColumns& points,
              std::vector<std::uint32_t> used, int threads) {
  Base base{.used = std::move(used), .uv = {}, .weights = {}, .on_start = {}};
  for (const std::uint32_t k : base.used) {
    base.uv.push_back(points.uv[k]);
    if (!points.weights.empty()) {
      base.weights.push_back(points.weights[k]);
    }
  }
  base.on_start = HSplineBatch(start).Points(base.uv, threads);
  return base;
}

// A column is fitted as (value - mean) * factor, so that its unit has no effect.
struct ColumnScale {
  double mean = 0, factor = 1;
};

ColumnScale ComputeScale(std::span<const double> values, const Base& base, double length_mm) {
  constexpr double kSpread =
      0.06;  // sd per length of the domain, as that of heights (HeightFactor)
  double sum = 0, squares = 0;
  for (const std::uint32_t k : base.used) {
    sum += values[k];
  }
  const double count = static_cast<double>(base.used.size()), mean = sum / count;
  for (const std::uint32_t k : base.used) {
    squares += (values[k] - mean) * (values[k] - mean);
  }
  const double sd = std::sqrt(squares / count);
  return {.mean = mean, .factor = sd > 0 ? kSpread * length_mm / sd : 1};
}

// Returns the fitted surface less the start: its x is then the value. An offset counts from the
// point of the coarser surface, and not from the refined vertex, so that the start has a part in
// it.
HSplineSurface DifferenceFromStart(const HSplineSurface& fitted, const HSplineSurface& start,
                                   const ColumnScale& scale) {
  ControlNet net = fitted.Net(0), rest = start.Net(0);
  for (std::size_t k = 0; k < net.vertices.size(); ++k) {
    const double moved = net.vertices[k].x() - rest.vertices[k].x();
    net.vertices[k] = Vec3(moved / scale.factor + scale.mean, 0, 0);
  }
  HSplineSurface values(fitted.shape(), net);
  for (int level = 1; level <= fitted.shape().max_level; ++level) {
    rest = Refine(fitted.shape(), rest, level - 1);
    std::map<VertexId, std::optional<Vec3>> offsets;
    for (const auto& [vertex, offset] : fitted.Offsets(level)) {
      const double of_start =
          rest.At(vertex.i, vertex.j).x() - start.Point(start.GrevillePoint(vertex)).x();
      offsets.emplace_hint(offsets.end(), vertex,
                           Vec3((offset.x() - of_start) / scale.factor, 0, 0));
    }
    values.SetOffsets(offsets);
  }
  return values;
}

// Fits one column, and adds it to the fit.
void AddColumn(std::span<const double> values, const HSplineSurface& start, const Base& base,
               const AutoPlan& plan, const RunContext& context, AttributeFit& fit) {
  const ColumnScale scale = ComputeScale(values, base, MeanLengths(start).maxCoeff());
  std::vector<Vec3> moved = base.on_start;
  for (std::size_t n = 0; n < moved.size(); ++n) {
    moved[n].x() += scale.factor * (values[base.used[n]] - scale.mean);
  }
  const NestedFitResult found = FitNested(start, {moved, base.uv, base.weights}, plan, context);
  const AutoReport& report = found.report;
  const NestedRound& round = report.rounds[static_cast<std::size_t>(report.chosen_round)];
  fit.surfaces.push_back(DifferenceFromStart(found.surface, start, scale));
  fit.columns.push_back({.weight = report.weight,
                         .degrees_of_freedom = round.degrees_of_freedom,
                         .vertices = round.vertices});
}

double Misfit(std::span<const double> values, std::span<const double> fitted,
              const AttributeColumns& points, const Base& base) {
  double squares = 0, weights = 0;
  for (const std::uint32_t k : base.used) {
    squares += points.Weight(k) * (values[k] - fitted[k]) * (values[k] - fitted[k]);
    weights += points.Weight(k);
  }
  return std::sqrt(squares / weights);
}

}  // namespace

std::vector<std::vector<double>> AttributeFit::At(std::span<const Vec2> uv, int threads) const {
  std::vector<std::vector<double>> values;
  for (const HSplineSurface& surface : surfaces) {
    std::vector<double>& column = values.emplace_back();
    column.reserve(uv.size());
    for (const Vec3& p : HSplineBatch(surface).Points(uv, threads)) {
      column.push_back(p.x());
    }
  }
  return values;
}

AttributeFit FitAttributes(const HSplineSurface& surface, const AttributeColumns& points,
                           std::span<const std::uint32_t> left_out, const AutoPlan& plan,
                           const RunContext& context) {
  CheckColumns(points);
  const HSplineSurface start = StartOver(surface, plan);
  const Base base = MakeBase(start, points, AllBut(left_out, points.uv.size()), context.threads);
  CheckCount(base.used.size());
  AttributeFit fit;
  for (const std::span<const double>& values : points.columns) {
    AddColumn(values, start, base, plan, context, fit);
  }
  const std::vector<std::vector<double>> fitted = fit.At(points.uv, context.threads);
  for (std::size_t c = 0; c < fitted.size(); ++c) {
    fit.columns[c].rms = Misfit(points.columns[c], fitted[c], points, base);
  }
  return fit;
}

}  // namespace semblance::fitting
