// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/solve/surface_sigma.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "fitting/least_squares/sparse_factor.h"
#include "fitting/solve/space_system.h"
#include "fitting/space/hierarchical_spline_space.h"
#include "fitting/space/point_cloud.h"
#include "surfaces/base/error.h"

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

std::vector<Observation> UsedPoints(const AttributeColumns& points,
                                    std::span<const std::uint32_t> left_out) {
  std::vector<Observation> observations;
  observations.reserve(points.uv.size());
  auto next = left_out.begin();
  for (std::uint32_t k = 0; k < points.uv.size(); ++k) {
    if (next != left_out.end() && *next == k) {
      ++next;
    } else {
      observations.push_back(
          {.uv = points.uv[k], .position = Vec3::Zero(), .weight = points.Weight(k)});
    }
  }
  if (observations.empty()) {
    throw InputError("sigma: no point is left that counts; give some");
  }
  return observations;
}

// The covariance of a patch's sixteen vertices, from that of all unknowns. The product known *
// known^T is subtracted from the latter.
Matrix16 PatchCovariance(const SplineElement& element, const SelectedInverse& inverse,
                         const Eigen::MatrixXd& known) {
  const auto count = static_cast<Eigen::Index>(element.dofs.size());
  Eigen::MatrixXd of_dofs(count, count);
  for (Eigen::Index a = 0; a < count; ++a) {
    for (Eigen::Index b = 0; b <= a; ++b) {
      const int row = element.dofs[a], column = element.dofs[b];
      of_dofs(a, b) = of_dofs(b, a) =
          inverse.At(row, column) - known.row(row).dot(known.row(column));
    }
  }
  return element.IsIdentity()
             ? Matrix16(of_dofs)
             : Matrix16(element.extraction * of_dofs * element.extraction.transpose());
}

// Adds a small shift to the diagonal. On several levels some surfaces can be written in several
// ways, so the matrix has no inverse. The shift selects one of them; sigma does not depend on the
// selection.
SparseMatrix Shifted(SparseMatrix lower) {
  constexpr double kShift = 1e-10;  // far above round-off, far below the points' contributions
  const double shift = kShift * std::max(lower.diagonal().mean(), 1e-300);
  for (int k = 0; k < lower.rows(); ++k) {
    lower.coeffRef(k, k) += shift;
  }
  return lower;
}

// The B-splines of the unknowns at each place, one column per place.
Eigen::MatrixXd FunctionsAt(std::span<const Vec2> places, const SplineElements& elements,
                            Eigen::Index unknowns) {
  Eigen::MatrixXd functions = Eigen::MatrixXd::Zero(unknowns, std::ssize(places));
  for (Eigen::Index k = 0; k < functions.cols(); ++k) {
    const SplineElement& element = elements[elements.At(places[k])];
    const std::array<double, 16> weights = PatchWeights(
        elements.shape(), PatchPointAt(elements.shape(), element.patch.level, places[k]));
    const Eigen::Map<const Eigen::RowVectorXd> of_patch(weights.data(), 16);
    const Eigen::RowVectorXd of_dofs =
        element.IsIdentity() ? Eigen::RowVectorXd(of_patch) : of_patch * element.extraction;
    for (Eigen::Index a = 0; a < of_dofs.size(); ++a) {
      functions(element.dofs[a], k) += of_dofs[a];
    }
  }
  return functions;
}

// The factor P = H^-1 C^T (C H^-1 C^T)^-1/2 for equations C x = d that hold: H^-1 is reduced by P
// P^T. Dependent equations are used once.
Eigen::MatrixXd KnownPart(const Eigen::MatrixXd& equations, const SparseMatrix& lower) {
  constexpr double kDependent = 1e-9;  // of the largest eigenvalue; smaller ones are round-off
  if (equations.cols() == 0) {
    return equations;
  }
  const SparseFactor factor(lower, 0);
  if (!factor.usable()) {
    throw InputError("sigma: rounding leaves no factor of the fit's matrix; write sigma: false");
  }
  const Eigen::MatrixXd ways = factor.Solve(equations);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> gram(equations.transpose() * ways);
  const Eigen::VectorXd& squares = gram.eigenvalues();
  const double least = kDependent * squares.maxCoeff();
  const Eigen::VectorXd scales =
      squares.unaryExpr([&](double square) { return square > least ? 1 / std::sqrt(square) : 0; });
  return ways * gram.eigenvectors() * scales.asDiagonal();
}

}  // namespace

struct SurfaceSigma::Model {
  Model(const HSplineSurface& surface, std::vector<Observation> points, const SigmaOptions& options)
      : empty(EmptyLike(surface)),
        cloud(surface.shape(), points),
        space(empty, empty, cloud),
        elements(space) {
    count = static_cast<double>(points.size());
    points = std::vector<Observation>();  // frees it, which {} would not
    space.Measure({}, /*threads=*/1, nullptr);
    const double scale = 1 / cloud.weight_sum();
    const std::vector<Term> smooth = {SmoothnessTerm{.weight = options.weight,
                                                     .of = SmoothnessOf::kSurface,
                                                     .length_mm = 1,
                                                     .stretch = options.stretch,
                                                     .direction_deg = options.direction_deg}};
    const SparseMatrix of_points = Assemble(space, scale, {}).lower;
    const SparseMatrix energy =
        Assemble(space, 0, StiffnessByLevel(space.shape(), smooth, options.lengths_mm)).lower;
    const SparseMatrix normal = Shifted(of_points + energy);
    const SelectedInverse inverse(normal);
    if (!inverse.usable()) {
      throw InputError("sigma: rounding leaves no factor of the fit's matrix; write sigma: false");
    }
    const Eigen::MatrixXd known =
        KnownPart(FunctionsAt(options.met, elements, normal.rows()), normal);
    for (int e = 0; e < elements.size(); ++e) {
      covariances.push_back(PatchCovariance(elements[e], inverse, known));
    }
    variance = options.noise_mm * options.noise_mm / count;
    determined = -known.cwiseProduct(of_points.selfadjointView<Eigen::Lower>() * known).sum();
    for (int k = 0; k < of_points.outerSize(); ++k) {
      for (SparseMatrix::InnerIterator entry(of_points, k); entry; ++entry) {
        const double both = entry.row() == entry.col() ? 1 : 2;
        determined += both * entry.value() *
                      inverse.At(static_cast<int>(entry.row()), static_cast<int>(entry.col()));
      }
    }
  }

  HSplineSurface empty;
  PointCloud cloud;
  HierarchicalSplineSpace space;
  SplineElements elements;
  std::vector<Matrix16> covariances;  // of each element's vertices, for noise 1
  double count = kNaN, variance = kNaN, determined = kNaN;
};

SurfaceSigma::SurfaceSigma(const HSplineSurface& surface, const AttributeColumns& points,
                           std::span<const std::uint32_t> left_out, const SigmaOptions& options) {
  if (!std::isfinite(options.noise_mm) || !(options.weight >= 0) ||
      !options.lengths_mm.allFinite()) {
    throw InputError("sigma: the fit has found no noise or smoothness; write sigma: false");
  }
  model_ = std::make_unique<Model>(surface, UsedPoints(points, left_out), options);
}

SurfaceSigma::~SurfaceSigma() = default;
SurfaceSigma::SurfaceSigma(SurfaceSigma&&) noexcept = default;
SurfaceSigma& SurfaceSigma::operator=(SurfaceSigma&&) noexcept = default;

std::vector<double> SurfaceSigma::At(std::span<const Vec2> uv) const {
  std::vector<double> sigma;
  sigma.reserve(uv.size());
  for (const Vec2& at : uv) {
    const int element = model_->elements.At(at);
    const int level = model_->elements[element].patch.level;
    const std::array<double, 16> weights =
        PatchWeights(model_->space.shape(), PatchPointAt(model_->space.shape(), level, at));
    const Eigen::Map<const Eigen::Matrix<double, 16, 1>> n(weights.data());
    sigma.push_back(std::sqrt(std::max(
        model_->variance * n.dot(model_->covariances[static_cast<std::size_t>(element)] * n),
        0.0)));
  }
  return sigma;
}

double SurfaceSigma::degrees_of_freedom() const { return model_->determined; }

std::vector<double> SurfaceSigma::OfChosen(std::span<const Vec2> uv) const {
  constexpr double kLeastLeft = 0.02;  // of the points; a factor beyond 7 would say nothing
  const double factor = 1 / std::sqrt(std::max(1 - model_->determined / model_->count, kLeastLeft));
  std::vector<double> sigma = At(uv);
  for (double& at : sigma) {
    at *= factor;
  }
  return sigma;
}

}  // namespace semblance::fitting
