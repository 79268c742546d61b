// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/metrics/protocols.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "surfaces/base/parallel.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {
namespace {

using Motion = Eigen::Matrix<double, 6, 1>;  // turn (radians about a middle), then shift
using Normal6 = Eigen::Matrix<double, 6, 6>;

struct Sampled {
  std::vector<Vec3> points;
  std::vector<double> weights;  // of sum 1
  Vec3 middle = Vec3::Zero();
};

Sampled TakeEvenly(const TriMesh& truth, const std::vector<bool>& scored) {
  constexpr std::size_t kMostSamples = 4000;  // more cost time and hardly move the minimum
  const std::vector<double> areas = VertexAreas(truth);
  const std::size_t count = std::count(scored.begin(), scored.end(), true);
  const std::size_t stride = (count + kMostSamples - 1) / kMostSamples;
  Sampled sampled;
  double sum = 0;
  for (std::size_t v = 0, n = 0; v < scored.size(); ++v) {
    if (scored[v] && n++ % stride == 0) {
      sampled.points.push_back(truth.points[v]);
      sampled.weights.push_back(areas[v]);
      sampled.middle += areas[v] * truth.points[v];
      sum += areas[v];
    }
  }
  for (double& w : sampled.weights) {
    w /= sum;
  }
  sampled.middle /= sum;
  return sampled;
}

Similarity Inverse(const Similarity& rigid) {
  const Mat3 back = rigid.rotation.transpose();
  return {1, back, -(back * rigid.translation)};
}

// `pose`, followed by a motion about `middle`, a point in the target frame of the pose.
Similarity Moved(const Similarity& pose, const Motion& motion, const Vec3& middle) {
  const Vec3 turn = motion.head<3>();
  const double angle = turn.norm();
  const Mat3 rotation =
      angle > 0 ? Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix() : Mat3::Identity();
  return {1, rotation * pose.rotation,
          rotation * (pose.translation - middle) + middle + Vec3(motion.tail<3>())};
}

// The cost of a pose of the truth in the face's frame, and its quadratic model there.
struct Linearized {
  double cost = 0;  // mean squared distance, mm^2
  Motion gradient = Motion::Zero();
  Normal6 hessian = Normal6::Zero();
};

Linearized Linearize(const Sampled& sampled, const Similarity& face_from_truth,
                     const MeshQuery& face, const RunContext& context) {
  const Vec3 middle = face_from_truth * sampled.middle;
  std::vector<Vec3> at(sampled.points.size()), offset(sampled.points.size());
  ParallelFor(at.size(), context.threads, 64, [&](std::size_t k) {
    at[k] = face_from_truth * sampled.points[k];
    offset[k] = at[k] - face.Closest(at[k]).position;
  });
  Linearized model;
  for (std::size_t k = 0; k < at.size(); ++k) {
    const double w = sampled.weights[k], distance = offset[k].norm();
    model.cost += w * distance * distance;
    if (distance > 0) {
      Motion row;
      const Vec3 away = offset[k] / distance;
      row << (at[k] - middle).cross(away), away;
      model.gradient += w * distance * row;
      model.hessian += w * row * row.transpose();
    }
  }
  return model;
}

struct Alignment {
  Similarity face_from_truth;
  int steps = 0;
  bool converged = false;
};

Alignment Align(const Sampled& sampled, const MeshQuery& face, const RunContext& context) {
  constexpr int kMostSteps = 60;    // bounds the time of a search that does not converge
  constexpr double kAtRest = 1e-7;  // a smaller relative decrease of the cost ends the search
  Alignment result;
  Linearized model = Linearize(sampled, result.face_from_truth, face, context);
  double damping = 1e-4;
  while (result.steps < kMostSteps && !result.converged) {
    context.ThrowIfStopped();
    ++result.steps;
    Normal6 damped = model.hessian;
    damped.diagonal() *= 1 + damping;
    damped.diagonal().array() += 1e-12;
    const Motion step = -damped.ldlt().solve(model.gradient);
    const Similarity moved =
        Moved(result.face_from_truth, step, result.face_from_truth * sampled.middle);
    const Linearized next = Linearize(sampled, moved, face, context);
    if (next.cost < model.cost) {
      result.converged = model.cost - next.cost <= kAtRest * model.cost;
      result.face_from_truth = moved;
      model = next;
      damping /= 10;
    } else {
      result.converged = damping > 1e6 || model.cost == 0;
      damping *= 10;
    }
  }
  return result;
}

// The distance from p towards the viewer of the last point at which that ray leaves a mesh. NaN if
// there is none within reach.
double FrontHit(const MeshQuery& mesh, const Vec3& p, const Vec3& to_front, double reach_mm) {
  const auto hit = mesh.FirstHit(p + reach_mm * to_front, -to_front, 2 * reach_mm);
  return hit ? reach_mm - hit->distance_mm : kNaN;
}

}  // namespace

BestFitScore ScoreBestFit(const TriMesh& truth, const FaceRegion& region, const TriMesh& face,
                          const RunContext& context) {
  const Sampled sampled = TakeEvenly(truth, region.scored);
  const Alignment found = Align(sampled, MeshQuery(face), context);
  BestFitScore score;
  score.aligned_from_face = Inverse(found.face_from_truth);
  score.truth_to_face =
      CompareFaces(truth, region, Transformed(face, score.aligned_from_face), context)
          .truth_to_face;
  score.turned_deg =
      Eigen::AngleAxisd(found.face_from_truth.rotation).angle() * 180 / std::numbers::pi;
  score.moved_mm = (found.face_from_truth * sampled.middle - sampled.middle).norm();
  score.steps = found.steps;
  score.converged = found.converged;
  return score;
}

ViewRayScore ScoreAlongView(const TriMesh& truth, const FaceRegion& region, const TriMesh& face,
                            const Vec3& to_front, const RunContext& context) {
  constexpr double kReach_mm = 400;        // longer than a head
  constexpr double kSelf_mm = 0.1;         // a first hit within this of the vertex is the vertex
  constexpr double kLeastCosine = 0.2588;  // of 75 degrees
  const MeshQuery truth_query(truth), face_query(face);
  const std::vector<Vec3> normals = VertexNormals(truth);
  const std::vector<double> areas = VertexAreas(truth);
  std::vector<double> along(truth.points.size(), kNaN), seen_mm2(truth.points.size(), 0);
  ParallelFor(along.size(), context.threads, 256, [&](std::size_t v) {
    const double cosine = normals[v].dot(to_front);
    const Vec3& p = truth.points[v];
    if (region.scored[v] && cosine >= kLeastCosine &&
        std::abs(FrontHit(truth_query, p, to_front, kReach_mm)) <= kSelf_mm) {
      along[v] = FrontHit(face_query, p, to_front, kReach_mm);
      seen_mm2[v] = cosine * areas[v];
    }
  });
  ViewRayScore score{SummarizeDistances(along, seen_mm2, [](std::size_t) { return true; }), 0};
  for (std::size_t v = 0; v < along.size(); ++v) {
    score.missed_cm2 += std::isnan(along[v]) ? seen_mm2[v] / 100 : 0;
  }
  return score;
}

}  // namespace semblance::problems
