// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/kriging/kriging.h"

#include <algorithm>
#include <cmath>

#include "interp/kriging/kriging_process.h"
#include "surfaces/base/farthest_first.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::interp {
namespace {

constexpr Eigen::Index kFitSamples = 200;  // enough to determine two numbers; the cost grows with
                                           // the cube

// The dowels' data and, for geodesic distances, the distance from each dowel to each vertex.
struct KrigingScene {
  KrigingData data;
  std::vector<Vec3> bases;
  Eigen::MatrixXd to_vertex_mm;  // n x vertices; empty for straight distances

  Eigen::VectorXd DistancesTo(const Vec3& p, std::size_t vertex) const {
    if (to_vertex_mm.size() > 0) {
      return to_vertex_mm.col(static_cast<Eigen::Index>(vertex));
    }
    Eigen::VectorXd distance_mm(data.depth_mm.size());
    for (Eigen::Index k = 0; k < distance_mm.size(); ++k) {
      distance_mm[k] = (bases[k] - p).norm();
    }
    return distance_mm;
  }
};

// Computes geodesic distances from each dowel to the vertices and, by interpolation between a
// triangle's corners, to the other dowels.
void FindGeodesics(const DepthInput& input, const std::vector<DepthSample>& samples,
                   const RunContext& run, KrigingScene& scene) {
  const auto n = static_cast<Eigen::Index>(samples.size());
  scene.to_vertex_mm.resize(n, static_cast<Eigen::Index>(input.skull.points.size()));
  ForEachGeodesic(Kriging::kName, input.skull, samples, run,
                  [&](std::size_t k, const std::vector<double>& distance_mm) {
                    scene.to_vertex_mm.row(static_cast<Eigen::Index>(k)) =
                        Eigen::Map<const Eigen::RowVectorXd>(distance_mm.data(),
                                                             scene.to_vertex_mm.cols());
                  });
  const MeshQuery query(input.skull);
  for (Eigen::Index j = 0; j < n; ++j) {
    const MeshPoint at = query.Closest(samples[j].base);
    scene.data.distance_mm.row(j).setZero();
    for (int corner = 0; corner < 3; ++corner) {
      if (at.weights[corner] > 0) {  // 0 times infinity is NaN
        const int vertex = input.skull.triangles[at.triangle][corner];
        scene.data.distance_mm.row(j) +=
            at.weights[corner] * scene.to_vertex_mm.col(vertex).transpose();
      }
    }
    scene.data.distance_mm(j, j) = 0;
  }
}

KrigingScene MakeScene(const Kriging& options, const DepthInput& input,
                       const std::vector<DepthSample>& samples, const MeanRegressors& mean,
                       const RunContext& run) {
  const auto n = static_cast<Eigen::Index>(samples.size());
  KrigingScene scene{
      {Eigen::MatrixXd(n, n), Eigen::VectorXd(n), Eigen::VectorXd(n), Eigen::MatrixXd()}, {}, {}};
  for (const DepthSample& sample : samples) {
    const auto i = static_cast<Eigen::Index>(scene.bases.size());
    scene.data.depth_mm[i] = sample.depth_mm;
    scene.data.nugget_mm2[i] = Nugget_mm2(options.nugget_share, sample.sd_mm);
    scene.bases.push_back(sample.base);
  }
  scene.data.regressors = mean.At(scene.bases, run).transpose();
  if (options.distance == DowelDistance::kGeodesic) {
    FindGeodesics(input, samples, run, scene);
  } else {
    for (Eigen::Index j = 0; j < n; ++j) {
      scene.data.distance_mm.row(j) = scene.DistancesTo(scene.bases[j], 0).transpose();
    }
  }
  return scene;
}

KrigingHyper HyperFor(const Kriging& options, const KrigingScene& scene, const RunContext& run) {
  if (scene.data.depth_mm.size() <= kFitSamples) {
    return FitHyper(options, scene.data, run);
  }
  const std::vector<std::size_t> some = FarthestFirst(scene.bases, 0, kFitSamples);
  return FitHyper(options,
                  {scene.data.distance_mm(some, some), scene.data.depth_mm(some),
                   scene.data.nugget_mm2(some), scene.data.regressors(some, Eigen::all)},
                  run);
}

DepthProcess DescribeProcess(const KrigingHyper& hyper, const KrigingScene& scene,
                             const KrigingProcess& process) {
  return {hyper.length_mm, hyper.signal_mm, 0,
          (scene.data.regressors * process.coefficients()).mean(), hyper.at_end};
}

}  // namespace

DepthProcess FitKriging(const Kriging& options, const DepthInput& input, const RunContext& run) {
  CheckDepthInput(input);
  const MeanRegressors mean(options.mean, Kriging::kName, input, run);
  const KrigingScene scene = MakeScene(options, input, DepthSamples(input.dowels), mean, run);
  const KrigingHyper hyper = HyperFor(options, scene, run);
  return DescribeProcess(hyper, scene, KrigingProcess(options.covariance, scene.data, hyper));
}

DepthPosterior KrigingPosterior(const Kriging& options, const DepthInput& input,
                                std::span<const Vec3> points, const RunContext& run) {
  CheckDepthInput(input);
  Kriging straight = options;
  straight.distance = DowelDistance::kEuclidean;
  const MeanRegressors mean(options.mean, Kriging::kName, input, run);
  const KrigingScene scene = MakeScene(straight, input, DepthSamples(input.dowels), mean, run);
  const auto count = static_cast<Eigen::Index>(points.size());
  Eigen::MatrixXd to_dowels_mm(scene.data.depth_mm.size(), count), between_mm(count, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    to_dowels_mm.col(i) = scene.DistancesTo(points[i], 0);
    for (Eigen::Index j = 0; j < count; ++j) {
      between_mm(i, j) = (points[i] - points[j]).norm();
    }
  }
  return KrigingProcess(straight.covariance, scene.data, HyperFor(straight, scene, run))
      .Posterior(to_dowels_mm, between_mm, mean.At(points, run));
}

DepthField InterpolateDepth(const Kriging& options, const DepthInput& input,
                            const RunContext& run) {
  CheckDepthInput(input);
  run.ThrowIfStopped();
  const std::vector<DepthSample> samples = DepthSamples(input.dowels);
  const DepthLimits limits(samples, options.clamp);
  const MeanRegressors mean(options.mean, Kriging::kName, input, run);
  const KrigingScene scene = MakeScene(options, input, samples, mean, run);
  const Eigen::MatrixXd regressors = mean.AtVertices(run);
  const KrigingHyper hyper = HyperFor(options, scene, run);
  KrigingProcess process(options.covariance, scene.data, hyper);
  if (options.state_sd && KnowsSignal(options.signal_mm, scene.data.regressors)) {
    process.PrepareSd();
  }
  DepthField field =
      AssignWhereFacing(input, samples, options.max_angle_deg, run, [&](std::size_t i) {
        const Eigen::VectorXd distance_mm = scene.DistancesTo(input.skull.points[i], i);
        if (!std::isfinite(distance_mm.minCoeff())) {
          return DepthValue{};  // no dowel can be reached along the bone
        }
        const DepthValue value =
            process.ValueAt(distance_mm, regressors.col(static_cast<Eigen::Index>(i)));
        return DepthValue{limits(value.mm), value.sd_mm};
      });
  field.process = DescribeProcess(hyper, scene, process);
  return field;
}

}  // namespace semblance::interp
