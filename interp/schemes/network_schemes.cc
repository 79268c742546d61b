// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/schemes/network_schemes.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

namespace semblance::interp {
namespace {

using Edge = std::array<int, 2>;  // dowels, lower index first
using Tangents = Eigen::Matrix<double, 3, 2>;

std::set<Edge> CollectEdges(const DowelNetwork& network) {
  std::set<Edge> edges;
  for (const auto& area : network.areas) {
    for (int k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(area[k], area[(k + 1) % 3]);
      edges.insert({low, high});
    }
  }
  return edges;
}

// Two unit vectors perpendicular to the direction and to each other.
Tangents MakeTangents(const Vec3& direction) {
  Tangents tangents;
  tangents.col(0) = direction.unitOrthogonal();
  tangents.col(1) = direction.cross(tangents.col(0));
  return tangents;
}

// The normal equations of least bending. For an edge of length l with slopes a and b at its ends
// and the mean slope m, the integral is 4 / l (a^2 + a b + b^2 - 3 m (a + b) + 3 m^2).
class BendingEquations {
 public:
  explicit BendingEquations(std::span<const Dowel> dowels) : dowels_(dowels) {
    for (const Dowel& dowel : dowels) {
      tangents_.push_back(MakeTangents(dowel.direction));
    }
    right_ = Eigen::VectorXd::Zero(2 * static_cast<Eigen::Index>(dowels.size()));
  }

  void Add(const Edge& edge) {
    const Vec3 along = dowels_[edge[1]].base - dowels_[edge[0]].base;
    const double length = along.norm();
    const double rise = dowels_[edge[1]].depth_mm - dowels_[edge[0]].depth_mm;
    std::array<Eigen::Vector2d, 2> slope;  // slope along the edge per unit of each tangent
    for (int k = 0; k < 2; ++k) {
      slope[k] = tangents_[edge[k]].transpose() * along / length;
      right_.segment<2>(2 * edge[k]) += 12 * rise / (length * length) * slope[k];
      largest_ = std::max(largest_, 8 / length);
    }
    for (int k = 0; k < 2; ++k) {
      for (int other = 0; other < 2; ++other) {
        AddBlock(edge[k], edge[other],
                 (k == other ? 8 : 4) / length * slope[k] * slope[other].transpose());
      }
    }
  }

  // The gradients in space, one per dowel. The slope is 0 in a direction in which the dowel has no
  // edge.
  std::vector<Vec3> Gradients() {
    constexpr double kRidge = 1e-10;  // relative; affects only directions without edges
    for (Eigen::Index i = 0; i < right_.size(); ++i) {
      entries_.emplace_back(i, i, kRidge * largest_);
    }
    Eigen::SparseMatrix<double> matrix(right_.size(), right_.size());
    matrix.setFromTriplets(entries_.begin(), entries_.end());
    const Eigen::VectorXd solution =
        Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(matrix).solve(right_);
    std::vector<Vec3> gradients;
    for (std::size_t d = 0; d < tangents_.size(); ++d) {
      gradients.push_back(tangents_[d] * solution.segment<2>(2 * static_cast<Eigen::Index>(d)));
    }
    return gradients;
  }

 private:
  void AddBlock(int row, int column, const Eigen::Matrix2d& block) {
    for (int r = 0; r < 2; ++r) {
      for (int c = 0; c < 2; ++c) {
        entries_.emplace_back(2 * row + r, 2 * column + c, block(r, c));
      }
    }
  }

  std::span<const Dowel> dowels_;
  std::vector<Tangents> tangents_;
  std::vector<Eigen::Triplet<double>> entries_;
  Eigen::VectorXd right_;
  double largest_ = 0;
};

// An edge's depth as a function of space with continuous first derivatives: the cubic at p's foot
// on the edge, the dowels' linear functions beyond its ends, and perpendicular to the edge a slope
// that changes smoothly from one gradient to the other.
struct EdgeDepth {
  Vec3 base, along;  // along: vector to the other base
  double square;     // squared length
  double depth_mm, rise_mm;
  double slope_0, slope_1;  // slopes of the cubic at its ends, mm per whole edge
  Vec3 gradient_0, gradient_change;

  double At(const Vec3& p) const {
    const Vec3 from_base = p - base;
    const double foot = from_base.dot(along) / square, t = std::clamp(foot, 0.0, 1.0);
    const double step = t * t * (3 - 2 * t), left = 1 - t;
    const double cubic =
        depth_mm + rise_mm * step + slope_0 * t * left * left - slope_1 * t * t * left;
    return cubic + (gradient_0 + step * gradient_change).dot(from_base - t * along);
  }
};

EdgeDepth MakeEdgeDepth(const Dowel& a, const Dowel& b, const Vec3& gradient_a,
                        const Vec3& gradient_b) {
  const Vec3 along = b.base - a.base;
  return {.base = a.base,
          .along = along,
          .square = along.squaredNorm(),
          .depth_mm = a.depth_mm,
          .rise_mm = b.depth_mm - a.depth_mm,
          .slope_0 = gradient_a.dot(along),
          .slope_1 = gradient_b.dot(along),
          .gradient_0 = gradient_a,
          .gradient_change = gradient_b - gradient_a};
}

// The three edges of an area, number k opposite corner k. An edge starts at its lower dowel in both
// its areas, so that the areas agree to the bit.
using AreaEdges = std::array<EdgeDepth, 3>;

std::vector<AreaEdges> MakeAreaEdges(const DepthInput& input, const std::vector<Vec3>& gradients) {
  std::vector<AreaEdges> all;
  for (const auto& area : input.network.areas) {
    AreaEdges edges;
    for (int k = 0; k < 3; ++k) {
      const auto [a, b] = std::minmax(area[(k + 1) % 3], area[(k + 2) % 3]);
      edges[k] = MakeEdgeDepth(input.dowels[a], input.dowels[b], gradients[a], gradients[b]);
    }
    all.push_back(edges);
  }
  return all;
}

double Blend(const AreaEdges& edges, const Vec3& w, const Vec3& p) {
  constexpr double kAtDowel = 1e-24;  // at a dowel all edges agree and the weights are 0 / 0
  double sum = 0, total = 0;
  for (int k = 0; k < 3; ++k) {
    const double product = w[(k + 1) % 3] * w[(k + 2) % 3];
    total += product * product;
    sum += product * product * edges[k].At(p);
  }
  if (total > kAtDowel) {
    return sum / total;
  }
  int nearest = 0;
  w.maxCoeff(&nearest);
  return edges[(nearest + 1) % 3].At(p);
}

}  // namespace

DepthField InterpolateDepth(const Barycentric& options, const DepthInput& input,
                            const RunContext& run) {
  CheckDepthInput(input);
  const std::vector<DowelArea> areas = DowelAreas(Barycentric::kName, input);
  return AssignInAreas(
      areas, options.distance, options.max_angle_deg, input, run,
      [&](const AreaPoint& in, const Vec3&) {
        const auto& [a, b, c] = in.area->dowels;
        return in.weights.dot(
            Vec3(input.dowels[a].depth_mm, input.dowels[b].depth_mm, input.dowels[c].depth_mm));
      });
}
DepthField InterpolateDepth(const NetworkSpline& options, const DepthInput& input,
                            const RunContext& run) {
  CheckDepthInput(input);
  const std::vector<DowelArea> areas = DowelAreas(NetworkSpline::kName, input);
  BendingEquations bending(input.dowels);
  for (const Edge& edge : CollectEdges(input.network)) {
    bending.Add(edge);
  }
  const std::vector<AreaEdges> edges = MakeAreaEdges(input, bending.Gradients());
  const DepthLimits limits(DepthSamples(input.dowels), options.clamp);
  return AssignInAreas(areas, options.distance, options.max_angle_deg, input, run,
                       [&](const AreaPoint& in, const Vec3& p) {
                         return limits(Blend(edges[in.area - areas.data()], in.weights, p));
                       });
}

}  // namespace semblance::interp
