// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/solve/attribute_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "fitting/least_squares/cross_validation.h"
#include "fitting/least_squares/patch_energy.h"
#include "fitting/least_squares/sparse_factor.h"
#include "fitting/solve/space_system.h"
#include "fitting/space/hierarchical_spline_space.h"
#include "fitting/space/point_cloud.h"
#include "surfaces/base/error.h"
#include "surfaces/hspline_query/hspline_batch.h"

namespace semblance::fitting {

HSplineSurface EmptyLike(const HSplineSurface& surface) {
  HSplineShape shape = surface.shape();
  shape.reference = OffsetReference::kWorld;
  const ControlNet net{
      shape.Columns(0), shape.Rows(0),
      std::vector<Vec3>(static_cast<std::size_t>(shape.Columns(0)) * shape.Rows(0), Vec3::Zero())};
  std::map<VertexId, std::optional<Vec3>> offsets;
  for (const auto& [vertex, offset] : surface.Offsets()) {
    offsets.emplace_hint(offsets.end(), vertex, Vec3(Vec3::Zero()));
  }
  HSplineSurface empty(shape, net);
  empty.SetOffsets(offsets);
  return empty;
}

namespace {

constexpr int kColumnsPerSurface = 3;  // columns of a surface

// Up to three columns as the coordinates of points in one space.
struct ColumnGroup {
  ColumnGroup(const HSplineSurface& empty, const std::vector<Observation>& points)
      : cloud(empty.shape(), points), space(empty, empty, cloud) {}
  PointCloud cloud;
  HierarchicalSplineSpace space;
};

// The scale of a column: values are fitted as (value - mean) / sd.
struct ColumnScale {
  double mean = 0, sd = 1;
};

ColumnScale ComputeScale(const AttributeColumns& points, std::span<const double> values,
                         const std::vector<std::uint32_t>& used) {
  double sum = 0, squares = 0, weights = 0;
  for (const std::uint32_t k : used) {
    sum += points.Weight(k) * values[k];
    weights += points.Weight(k);
  }
  const double mean = sum / weights;
  for (const std::uint32_t k : used) {
    squares += points.Weight(k) * (values[k] - mean) * (values[k] - mean);
  }
  const double sd = std::sqrt(squares / weights);
  return {.mean = mean, .sd = sd > 0 ? sd : 1};
}

// The result of one weight.
struct WeightTrial {
  Eigen::MatrixXd values;      // unknowns x columns
  std::vector<double> scores;  // of each column
  double trace = kNaN;
};

class AttributeSolver {
 public:
  AttributeSolver(const HSplineSurface& surface, const AttributeColumns& points,
                  std::vector<std::uint32_t> used)
      : points_(points),
        values_(points.columns),
        used_(std::move(used)),
        empty_(EmptyLike(surface)) {
    for (const std::span<const double>& column : values_) {
      scales_.push_back(ComputeScale(points_, column, used_));
    }
    for (std::size_t first = 0; first < values_.size(); first += kColumnsPerSurface) {
      groups_.push_back(std::make_unique<ColumnGroup>(empty_, Observations(first)));
      groups_.back()->space.Measure({}, /*threads=*/1, nullptr);
    }
    MakeSystem(MeanLengths(surface));
  }

  AttributeFit Run() {
    const double even = points_part_.diagonal().sum() / std::max(energy_.diagonal().sum(), 1e-300);
    const std::size_t columns = values_.size();
    best_.assign(columns, {});
    std::vector<int> turned(columns, 0);
    for (int decade = 2;
         decade >= -10 && std::any_of(turned.begin(), turned.end(), [](int t) { return t < 2; });
         --decade) {
      const WeightTrial trial = Try(even * std::pow(10.0, decade));
      for (std::size_t c = 0; c < columns; ++c) {
        turned[c] += trial.scores[c] <= best_[c].score ? 0 : 1;
      }
    }
    for (const double factor : {std::sqrt(10.0), std::sqrt(std::sqrt(10.0))}) {
      std::set<double> near;
      for (const Best& best : best_) {
        near.insert({best.weight * factor, best.weight / factor});
      }
      for (const double weight : near) {
        Try(weight);
      }
    }
    return Result();
  }

 private:
  struct Best {
    double weight = kNaN, score = kNaN, trace = kNaN;
    Eigen::VectorXd values;
  };

  std::vector<Observation> Observations(std::size_t first) const {
    std::vector<Observation> observations;
    observations.reserve(used_.size());
    for (const std::uint32_t k : used_) {
      Observation o{.uv = points_.uv[k], .position = Vec3::Zero(), .weight = points_.Weight(k)};
      for (std::size_t c = first; c < std::min(first + kColumnsPerSurface, values_.size()); ++c) {
        o.position[static_cast<Eigen::Index>(c - first)] =
            (values_[c][k] - scales_[c].mean) / scales_[c].sd;
      }
      observations.push_back(o);
    }
    return observations;
  }

  void MakeSystem(const Vec2& lengths_mm) {
    const HierarchicalSplineSpace& space = groups_.front()->space;
    const std::vector<Term> smooth = {
        SmoothnessTerm{.weight = 1, .of = SmoothnessOf::kSurface, .length_mm = 1}};
    const double scale = 1 / groups_.front()->cloud.weight_sum();
    points_part_ = Assemble(space, scale, {}).lower;
    energy_ = Assemble(space, 0, StiffnessByLevel(space.shape(), smooth, lengths_mm)).lower;
    right_.resize(space.rows(), static_cast<Eigen::Index>(values_.size()));
    for (std::size_t c = 0; c < values_.size(); ++c) {
      right_.col(static_cast<Eigen::Index>(c)) =
          Assemble(groups_[c / kColumnsPerSurface]->space, scale, {}, SystemPart::kRight)
              .right.col(static_cast<Eigen::Index>(c % kColumnsPerSurface));
    }
    constexpr int kProbes = 16;  // of the trace: time against accuracy
    probes_ = TraceProbes(points_part_.rows(), kProbes);
    influenced_ = points_part_.selfadjointView<Eigen::Lower>() * probes_.directions();
  }

  WeightTrial Try(double weight) {
    constexpr double kShift = 1e-11;  // keeps the factor usable; small against the diagonal's mean
    WeightTrial trial{.values = {}, .scores = std::vector<double>(values_.size(), kNaN)};
    const SparseMatrix lower = points_part_ + weight * energy_;
    const SparseFactor factor(lower, kShift * std::max(lower.diagonal().mean(), 1e-300));
    if (!factor.usable()) {
      return trial;
    }
    trial.values = factor.Solve(right_);
    trial.trace = probes_.Estimate(factor.Solve(influenced_));
    const Eigen::MatrixXd product = points_part_.selfadjointView<Eigen::Lower>() * trial.values;
    for (std::size_t c = 0; c < values_.size(); ++c) {
      const auto column = static_cast<Eigen::Index>(c);
      const double misfit = 1 - 2 * trial.values.col(column).dot(right_.col(column)) +
                            trial.values.col(column).dot(product.col(column));
      trial.scores[c] =
          CrossValidationScore(misfit, trial.trace, static_cast<double>(used_.size()));
      Keep(weight, trial, c);
    }
    return trial;
  }

  void Keep(double weight, const WeightTrial& trial, std::size_t c) {
    Best& best = best_[c];
    if (trial.scores[c] < best.score || (std::isnan(best.score) && !std::isnan(trial.scores[c]))) {
      best = {.weight = weight,
              .score = trial.scores[c],
              .trace = trial.trace,
              .values = trial.values.col(static_cast<Eigen::Index>(c))};
    }
  }

  AttributeFit Result() {
    AttributeFit fit;
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      fit.surfaces.push_back(MakeSurface(g));
    }
    for (const Best& best : best_) {
      fit.columns.push_back({.weight = best.weight, .degrees_of_freedom = best.trace});
    }
    return fit;
  }

  // The surface of column group g, in the columns' own units.
  HSplineSurface MakeSurface(std::size_t g) {
    HierarchicalSplineSpace& space = groups_[g]->space;
    ControlNet unknowns = space.Values();
    Vec3 mean = Vec3::Zero();
    for (std::size_t c = g * kColumnsPerSurface;
         c < std::min((g + 1) * kColumnsPerSurface, values_.size()); ++c) {
      const auto at = static_cast<Eigen::Index>(c % kColumnsPerSurface);
      mean[at] = scales_[c].mean;
      for (Eigen::Index row = 0; row < best_[c].values.size(); ++row) {
        unknowns.vertices[static_cast<std::size_t>(row)][at] = scales_[c].sd * best_[c].values[row];
      }
    }
    space.SetValues(unknowns);
    HSplineSurface surface = space.Surface();
    ControlNet net = surface.Net(0);
    for (Vec3& vertex : net.vertices) {
      vertex += mean;
    }
    surface.SetNet(0, net);
    return surface;
  }

  const AttributeColumns& points_;
  const std::vector<std::span<const double>>& values_;
  std::vector<std::uint32_t> used_;
  HSplineSurface empty_;
  std::vector<ColumnScale> scales_;
  std::vector<std::unique_ptr<ColumnGroup>> groups_;
  SparseMatrix points_part_, energy_;  // lower triangles
  Eigen::MatrixXd right_, influenced_;
  TraceProbes probes_;
  std::vector<Best> best_;
};

std::vector<std::uint32_t> AllBut(std::span<const std::uint32_t> left_out, std::size_t count) {
  std::vector<std::uint32_t> used;
  for (std::uint32_t k = 0; k < count; ++k) {
    if (!std::binary_search(left_out.begin(), left_out.end(), k)) {
      used.push_back(k);
    }
  }
  return used;
}

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

// Sets the columns' rms over the used points.
void MeasureColumns(const AttributeColumns& points, std::span<const std::uint32_t> used,
                    int threads, AttributeFit& fit) {
  const std::vector<std::vector<double>> fitted = fit.At(points.uv, threads);
  for (std::size_t c = 0; c < points.columns.size(); ++c) {
    double squares = 0, weights = 0;
    for (const std::uint32_t k : used) {
      const double off = points.columns[c][k] - fitted[c][k];
      squares += points.Weight(k) * off * off;
      weights += points.Weight(k);
    }
    fit.columns[c].rms = std::sqrt(squares / weights);
  }
}

}  // namespace

std::vector<std::vector<double>> AttributeFit::At(std::span<const Vec2> uv, int threads) const {
  std::vector<std::vector<double>> values;
  for (std::size_t c = 0; c < columns.size(); c += kColumnsPerSurface) {
    const std::vector<Vec3> at = HSplineBatch(surfaces[c / kColumnsPerSurface]).Points(uv, threads);
    for (std::size_t k = c; k < std::min(c + kColumnsPerSurface, columns.size()); ++k) {
      std::vector<double>& column = values.emplace_back();
      column.reserve(at.size());
      for (const Vec3& p : at) {
        column.push_back(p[static_cast<Eigen::Index>(k - c)]);
      }
    }
  }
  return values;
}

AttributeFit FitAttributes(const HSplineSurface& surface, const AttributeColumns& points,
                           std::span<const std::uint32_t> left_out, int threads) {
  CheckColumns(points);
  const std::vector<std::uint32_t> used = AllBut(left_out, points.uv.size());
  if (used.empty()) {
    throw InputError("attributes: no point is left to fit them to; give some");
  }
  if (points.columns.empty()) {
    return {};
  }
  AttributeFit fit = AttributeSolver(surface, points, used).Run();
  MeasureColumns(points, used, threads, fit);
  return fit;
}

}  // namespace semblance::fitting
