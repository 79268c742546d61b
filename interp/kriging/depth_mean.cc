// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/kriging/depth_mean.h"

#include <fmt/format.h>

#include <vector>

#include "interp/kriging/kriging.h"
#include "interp/on_surface/bone_geometry.h"
#include "interp/on_surface/coarse_surface.h"
#include "surfaces/base/error.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::interp {
namespace {

constexpr double kReliefEdge_mm = 3;  // mesh for the relief; well below the smaller scale
constexpr std::array kReliefScales_mm = {10.0, 40.0};

// The expected depths t at points.
Eigen::MatrixXd ExpectedAt(std::span<const Vec3> points, std::span<const Dowel> expected,
                           const RunContext& run) {
  const TriMesh at{{points.begin(), points.end()}, {}};
  const std::vector<Vec3> normals(points.size(), Vec3::Zero());
  const DowelNetwork none;
  const Kriging ordinary{.state_sd = false, .max_angle_deg = 180};
  const DepthField field = InterpolateDepth(ordinary, {at, normals, expected, none}, run);
  return Eigen::Map<const Eigen::RowVectorXd>(field.depth_mm.data(), std::ssize(field.depth_mm));
}

}  // namespace

std::size_t FewestDowels(DepthMean mean) {
  const std::size_t relief = UsesBone(mean) ? kReliefScales_mm.size() : 0,
                    geometry = mean == DepthMean::kGeometry ? kBoneGeometry : 0;
  return 1 + relief + geometry;
}

struct MeanRegressors::Bone {
  Bone(DepthMean mean, const DepthInput& input, const RunContext& run)
      : surface(input.skull, kReliefEdge_mm, run),
        query(input.skull),
        at_vertices(AtMeshVertices(mean, surface.mesh(), input.dowels)) {}

  static Eigen::MatrixXd AtMeshVertices(DepthMean mean, const TriMesh& mesh,
                                        std::span<const Dowel> dowels) {
    const Eigen::MatrixXd relief = BoneRelief(mesh, kReliefScales_mm);
    if (mean != DepthMean::kGeometry) {
      return relief;
    }
    Eigen::MatrixXd both(relief.rows() + kBoneGeometry, relief.cols());
    both << relief, BoneGeometry(mesh, FindHeadFrame(dowels));
    return both;
  }

  // 1 and the bone's regressors at p, which is near a vertex of the skull.
  Eigen::VectorXd At(const Vec3& p, int skull_vertex) const {
    const CornerWeights at = surface.Locate(p, skull_vertex);
    Eigen::VectorXd regressors = Eigen::VectorXd::Zero(1 + at_vertices.rows());
    regressors[0] = 1;
    for (int c = 0; c < 3; ++c) {
      regressors.tail(at_vertices.rows()) += at.weights[c] * at_vertices.col(at.corners[c]);
    }
    return regressors;
  }

  CoarseSurface surface;
  MeshQuery query;
  Eigen::MatrixXd at_vertices;  // at vertices of the coarse surface
};

MeanRegressors::MeanRegressors(DepthMean mean, std::string_view scheme, const DepthInput& input,
                               const RunContext& run)
    : mean_(mean), input_(input) {
  if (mean == DepthMean::kTable && input.expected.empty()) {
    throw InputError(fmt::format(
        "{}: `mean: table` needs the mean depths of a table besides the dowels' own, and there are "
        "none; name tissue.table and measured depths, or choose `mean: constant`",
        scheme));
  }
  if (UsesBone(mean)) {
    CheckSurface(scheme, input.skull);
    const std::size_t places = DepthSamples(input.dowels).size();
    if (places < FewestDowels(mean)) {
      throw InputError(fmt::format(
          "{}: `mean: {}` fits {} factors, for which {} are too few; place more, or choose `mean: "
          "constant`",
          scheme, EnumNames(mean)[static_cast<std::size_t>(mean)], FewestDowels(mean),
          places == 1 ? "1 dowel" : fmt::format("{} dowels", places)));
    }
    bone_ = std::make_unique<Bone>(mean, input, run);
  }
}

MeanRegressors::~MeanRegressors() = default;

Eigen::MatrixXd MeanRegressors::At(std::span<const Vec3> points, const RunContext& run) const {
  const auto count = static_cast<Eigen::Index>(points.size());
  if (mean_ == DepthMean::kConstant) {
    return Eigen::MatrixXd::Ones(1, count);
  }
  if (mean_ == DepthMean::kTable) {
    return ExpectedAt(points, input_.expected, run);
  }
  Eigen::MatrixXd regressors(1 + bone_->at_vertices.rows(), count);
  for (std::size_t k = 0; k < points.size(); ++k) {
    const MeshPoint on = bone_->query.Closest(points[k]);
    regressors.col(static_cast<Eigen::Index>(k)) =
        bone_->At(on.position, NearestCorner(input_.skull, on));
  }
  return regressors;
}

Eigen::MatrixXd MeanRegressors::AtVertices(const RunContext& run) const {
  if (!UsesBone(mean_)) {
    return At(input_.skull.points, run);
  }
  Eigen::MatrixXd regressors(1 + bone_->at_vertices.rows(), std::ssize(input_.skull.points));
  ForEachVertex(input_, run, [&](std::size_t i) {
    regressors.col(static_cast<Eigen::Index>(i)) =
        bone_->At(input_.skull.points[i], static_cast<int>(i));
  });
  return regressors;
}

}  // namespace semblance::interp
