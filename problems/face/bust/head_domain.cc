// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/bust/head_domain.h"

#include <fmt/format.h>

#include <Eigen/SparseCore>
#include <Eigen/SparseLU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "surfaces/base/error.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kRound_mm = 600, kUp_mm = 450;  // about the lengths of u and v on a head
// EvenOut: kPower is the strength of the correction in each round. kDensity gives regions of short
// edges more of the domain than their size alone would.
constexpr double kDensity = 0.5, kPower = 0.15;

using Loop = VertexLoop;  // points of a border, with the surface on its left

double Length(const TriMesh& mesh, const Loop& loop) {
  double sum = 0;
  for (std::size_t k = 0; k < loop.size(); ++k) {
    sum += (mesh.points[loop[(k + 1) % loop.size()]] - mesh.points[loop[k]]).norm();
  }
  return sum;
}

struct PocketRing {
  double scale;     // of the rim, about its middle
  double depth_mm;  // inwards
};
constexpr PocketRing kPocket[] = {{0.96, 1.5}, {0.85, 3.5}, {0.6, 5.5}, {0.3, 6.5}};

void ClosePocket(const Loop& rim, TriMesh& mesh) {
  const int n = static_cast<int>(rim.size());
  Vec3 middle = Vec3::Zero(), outward = Vec3::Zero();
  for (int k = 0; k < n; ++k) {
    middle += mesh.points[rim[k]] / n;
  }
  for (int k = 0; k < n; ++k) {  // the hole is on the right of its border
    outward -= (mesh.points[rim[k]] - middle).cross(mesh.points[rim[(k + 1) % n]] - middle);
  }
  outward.normalize();
  const auto append = [&](const Vec3& p) {
    mesh.points.push_back(p);
    return static_cast<std::int32_t>(mesh.points.size() - 1);
  };
  Loop outer = rim;
  for (const PocketRing& ring : kPocket) {
    Loop inner;
    for (const std::int32_t v : rim) {
      inner.push_back(
          append(middle + ring.scale * (mesh.points[v] - middle) - ring.depth_mm * outward));
    }
    for (int k = 0; k < n; ++k) {
      const int m = (k + 1) % n;
      mesh.triangles.push_back({outer[m], outer[k], inner[k]});
      mesh.triangles.push_back({outer[m], inner[k], inner[m]});
    }
    outer = std::move(inner);
  }
  const std::int32_t bottom = append(middle - 7 * outward);
  for (int k = 0; k < n; ++k) {
    mesh.triangles.push_back({outer[(k + 1) % n], outer[k], bottom});
  }
}

// One row per point: the weights of its neighbours, by point.
using GridRows = std::vector<std::map<std::int32_t, double>>;

GridRows MeanValueWeights(const TriMesh& mesh) {
  GridRows rows(mesh.points.size());
  for (const Triangle& t : mesh.triangles) {
    for (int c = 0; c < 3; ++c) {
      const std::int32_t i = t[c], j = t[(c + 1) % 3], k = t[(c + 2) % 3];
      const Vec3 a = mesh.points[j] - mesh.points[i], b = mesh.points[k] - mesh.points[i];
      const double la = std::max(a.norm(), 1e-9), lb = std::max(b.norm(), 1e-9);
      const double cosine = std::clamp(a.dot(b) / (la * lb), -0.9999, 0.9999);
      const double half_tangent = std::sqrt((1 - cosine) / (1 + cosine));
      rows[i][j] += half_tangent / la;
      rows[i][k] += half_tangent / lb;
    }
  }
  return rows;
}

class Layout {
 public:
  Layout(const TriMesh& mesh, const Loop& neck)
      : mesh_(mesh), neck_(neck), rows_(MeanValueWeights(mesh)) {
    for (const std::int32_t v : neck) {
      axis_ += mesh.points[v] / static_cast<double>(neck.size());
    }
    const Box3 box = Bounds(mesh);
    axis_.y() = box.center().y();
    for (std::size_t v = 0; v < mesh.points.size(); ++v) {
      const Vec3& p = mesh.points[v];
      if (crown_ < 0 || CrownScore(p) > CrownScore(mesh.points[crown_])) {
        crown_ = static_cast<int>(v);
      }
      turn_.push_back(0.5 + std::atan2(p.x() - axis_.x(), axis_.y() - p.y()) / kTurn);
    }
  }

  std::vector<Vec2> Solve() {
    constexpr int kRounds = 3;  // more even the map out further, and cost two solves each
    std::vector<Vec2> uv = Map();
    for (int round = 0; round < kRounds; ++round) {
      EvenOut(uv);
      uv = Map();
    }
    return uv;
  }
  int crown() const { return crown_; }

 private:
  std::vector<Vec2> Map() const {
    std::vector<double> v = Height();
    Stretch(v);
    const std::vector<double> u = Round();
    std::vector<Vec2> uv;
    for (std::size_t k = 0; k < v.size(); ++k) {
      uv.emplace_back(u[k] - std::floor(u[k]), v[k]);
    }
    return uv;
  }

  // Lowers the weight of points that are crowded in the domain, so that they attract their
  // neighbours less (Yoshizawa et al. 2004).
  void EvenOut(const std::vector<Vec2>& uv) {
    std::vector<double> stretch(uv.size(), 0), area(uv.size(), 0), length(uv.size(), 0),
        count(uv.size(), 0);
    for (const Triangle& t : mesh_.triangles) {
      if (std::ranges::find(t, crown_) != t.end()) {
        continue;
      }
      const Vec3 p = mesh_.points[t[1]] - mesh_.points[t[0]],
                 q = mesh_.points[t[2]] - mesh_.points[t[0]];
      Vec2 a = uv[t[1]] - uv[t[0]], b = uv[t[2]] - uv[t[0]];
      a.x() -= std::round(a.x());
      b.x() -= std::round(b.x());
      const double in_domain = std::max(std::abs(a.x() * b.y() - a.y() * b.x()), 1e-14);
      const Vec3 du = (p * b.y() - q * a.y()) / in_domain, dv = (q * a.x() - p * b.x()) / in_domain;
      const double here = p.cross(q).norm() / 2;
      const double squared =
          0.5 * (du.squaredNorm() / (kRound_mm * kRound_mm) + dv.squaredNorm() / (kUp_mm * kUp_mm));
      for (int c = 0; c < 3; ++c) {
        stretch[t[c]] += here * squared;
        area[t[c]] += here;
        length[t[c]] += (mesh_.points[t[(c + 1) % 3]] - mesh_.points[t[c]]).norm();
        count[t[c]] += 1;
      }
    }
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      for (auto& [j, w] : rows_[i]) {
        if (j != crown_ && count[j] > 0) {
          const double mean_edge = length[j] / count[j];
          w /= std::pow(std::sqrt(stretch[j] / area[j]) / std::pow(mean_edge, kDensity), kPower);
        }
      }
    }
  }

  double CrownScore(const Vec3& p) const {
    return p.z() - 0.5 * std::abs(p.x() - axis_.x()) - 0.2 * std::abs(p.y() - axis_.y());
  }

  // Solves for values that are weighted means of their neighbours. fixed: NaN marks unknowns,
  // infinity a point without a value. jump(i, j): added to j's value as seen from i; u jumps by 1
  // at the seam.
  template <class Jump>
  std::vector<double> Harmonic(const std::vector<double>& fixed, const Jump& jump) const {
    const int n = static_cast<int>(fixed.size());
    std::vector<Eigen::Triplet<double>> entries;
    Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
    for (int i = 0; i < n; ++i) {
      entries.emplace_back(i, i, 1);
      if (!std::isnan(fixed[i])) {
        right[i] = fixed[i];
        continue;
      }
      double sum = 0;
      for (const auto& [j, w] : rows_[i]) {
        sum += std::isinf(fixed[j]) ? 0 : w;
      }
      for (const auto& [j, w] : rows_[i]) {
        if (!std::isinf(fixed[j])) {
          entries.emplace_back(i, j, -w / sum);
          right[i] += w / sum * jump(i, j);
        }
      }
    }
    for (int i = 0; i < n; ++i) {
      right[i] = std::isinf(right[i]) ? 0 : right[i];
    }
    Eigen::SparseMatrix<double> matrix(n, n);
    matrix.setFromTriplets(entries.begin(), entries.end());
    const Eigen::SparseLU<Eigen::SparseMatrix<double>> factor(matrix);
    const Eigen::VectorXd x = factor.solve(right);
    return {x.begin(), x.end()};
  }

  std::vector<double> Height() const {
    std::vector<double> fixed(mesh_.points.size(), kNaN);
    for (const std::int32_t v : neck_) {
      fixed[v] = 0;
    }
    fixed[crown_] = 1;
    return Harmonic(fixed, [](int, int) { return 0.0; });
  }

  // Stretches v to measure the mean way along the surface. Each edge gives the length of a step in
  // v.
  void Stretch(std::vector<double>& v) const {
    constexpr int kBins = 400;  // more follow the stretch more closely, from fewer edges each
    std::vector<double> way(kBins, 0), weight(kBins, 0);
    // Each bin has the same number of points, because v is crowded towards the crown.
    std::vector<double> sorted(v);
    std::ranges::sort(sorted);
    std::vector<double> knots;
    for (int k = 0; k <= kBins; ++k) {
      knots.push_back(sorted[(sorted.size() - 1) * k / kBins]);
    }
    knots.erase(std::unique(knots.begin(), knots.end()), knots.end());
    const int bins = static_cast<int>(knots.size()) - 1;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      for (const auto& [j, w] : rows_[i]) {
        const double low = v[i], high = v[j];
        if (high <= low) {
          continue;
        }
        const double slope = (mesh_.points[j] - mesh_.points[i]).norm() / (high - low);
        int k =
            static_cast<int>(std::upper_bound(knots.begin(), knots.end(), low) - knots.begin()) - 1;
        for (k = std::max(k, 0); k < bins && knots[k] < high; ++k) {
          const double part = std::min(high, knots[k + 1]) - std::max(low, knots[k]);
          way[k] += part * slope;
          weight[k] += part;
        }
      }
    }
    std::vector<double> sum(bins + 1, 0);
    for (int k = 0; k < bins; ++k) {
      sum[k + 1] = sum[k] + (weight[k] > 0 ? way[k] / weight[k] : 0) * (knots[k + 1] - knots[k]);
    }
    for (double& value : v) {
      int k =
          static_cast<int>(std::upper_bound(knots.begin(), knots.end(), value) - knots.begin()) - 1;
      k = std::clamp(k, 0, bins - 1);
      const double part = std::clamp((value - knots[k]) / (knots[k + 1] - knots[k]), 0.0, 1.0);
      value = (sum[k] + part * (sum[k + 1] - sum[k])) / sum[bins];
    }
  }

  std::vector<double> Round() const {
    constexpr double kNone = std::numeric_limits<double>::infinity();
    std::vector<double> fixed(mesh_.points.size(), kNaN);
    fixed[crown_] = kNone;
    for (const std::int32_t v : neck_) {
      fixed[v] = turn_[v];
    }
    return Harmonic(fixed, [this](int i, int j) { return -std::round(turn_[j] - turn_[i]); });
  }

  const TriMesh& mesh_;
  const Loop& neck_;
  GridRows rows_;
  Vec3 axis_ = Vec3::Zero();
  std::vector<double> turn_;  // azimuth about the axis, in turns
  int crown_ = -1;
};

}  // namespace

HeadDomain LayOutHead(const TriMesh& head, const std::string& name) {
  if (ConnectedComponents(head).count != 1) {
    throw InputError(fmt::format("{}: the head is not one piece", name));
  }
  HeadDomain domain{.mesh = head, .uv = {}, .rims = BorderLoops(head, "head")};
  if (domain.rims.empty()) {
    throw InputError(fmt::format("{}: the head has no border; it must be open at the neck", name));
  }
  const auto neck = std::ranges::max_element(domain.rims, {},
                                             [&](const Loop& loop) { return Length(head, loop); });
  const Loop neck_loop = *neck;
  domain.rims.erase(neck);
  for (const Loop& rim : domain.rims) {
    ClosePocket(rim, domain.mesh);
  }
  Layout layout(domain.mesh, neck_loop);
  domain.uv = layout.Solve();
  domain.crown = layout.crown();
  return domain;
}

namespace {

struct DomainCorner {
  Vec3 point, normal;
  Vec2 uv;
};
using Corners = std::array<DomainCorner, 3>;

Vec3 PnPoint(const Corners& c, double w0, double w1, double w2) {
  const auto along = [&](int i, int j) -> Vec3 {  // a third of the way from i to j
    const Vec3 d = c[j].point - c[i].point;
    return (2 * c[i].point + c[j].point - d.dot(c[i].normal) * c[i].normal) / 3;
  };
  const std::array<Vec3, 6> edge = {along(0, 1), along(1, 0), along(1, 2),
                                    along(2, 1), along(2, 0), along(0, 2)};
  Vec3 middle = Vec3::Zero();
  for (const Vec3& e : edge) {
    middle += e / 6;
  }
  const Vec3 flat = (c[0].point + c[1].point + c[2].point) / 3;
  middle += (middle - flat) / 2;
  return c[0].point * (w0 * w0 * w0) + c[1].point * (w1 * w1 * w1) + c[2].point * (w2 * w2 * w2) +
         3 * (edge[0] * (w0 * w0 * w1) + edge[1] * (w0 * w1 * w1) + edge[2] * (w1 * w1 * w2) +
              edge[3] * (w1 * w2 * w2) + edge[4] * (w2 * w2 * w0) + edge[5] * (w2 * w0 * w0)) +
         6 * middle * (w0 * w1 * w2);
}

class Sampler {
 public:
  Sampler(int columns, int rows)
      : columns_(columns), rows_(rows), taken_(static_cast<std::size_t>(columns) * (rows + 1)) {}

  void Add(const Corners& c) {
    Vec2 a = c[0].uv, b = c[1].uv - a, d = c[2].uv - a;
    const double area = b.x() * d.y() - b.y() * d.x();
    if (area <= 0) {
      return;
    }
    const auto [low_u, high_u] = std::minmax({0.0, b.x(), d.x()});
    const auto [low_v, high_v] = std::minmax({0.0, b.y(), d.y()});
    const auto first = [](double x, int n) { return static_cast<int>(std::ceil(x * n - 1e-9)); };
    const auto last = [](double x, int n) { return static_cast<int>(std::floor(x * n + 1e-9)); };
    for (int m = first(a.y() + low_v, rows_); m <= last(a.y() + high_v, rows_); ++m) {
      for (int k = first(a.x() + low_u, columns_); k <= last(a.x() + high_u, columns_); ++k) {
        const Vec2 at = Vec2(double(k) / columns_, double(m) / rows_) - a;
        const double w1 = (at.x() * d.y() - at.y() * d.x()) / area;
        const double w2 = (b.x() * at.y() - b.y() * at.x()) / area;
        if (w1 >= -1e-9 && w2 >= -1e-9 && w1 + w2 <= 1 + 1e-9) {
          Take((k % columns_ + columns_) % columns_, m, PnPoint(c, 1 - w1 - w2, w1, w2));
        }
      }
    }
  }
  HeadSamples Samples() && { return std::move(samples_); }

 private:
  void Take(int k, int m, const Vec3& point) {
    if (m < 0 || m > rows_ || taken_[static_cast<std::size_t>(m) * columns_ + k]) {
      return;
    }
    taken_[static_cast<std::size_t>(m) * columns_ + k] = true;
    samples_.points.push_back(point);
    samples_.uv.emplace_back(double(k) / columns_, double(m) / rows_);
  }

  int columns_, rows_;
  std::vector<bool> taken_;
  HeadSamples samples_;
};

}  // namespace

HeadSamples SampleHead(const HeadDomain& head, int columns, int rows) {
  const std::vector<Vec3> normals = VertexNormals(head.mesh);
  Sampler sampler(columns, rows);
  for (const Triangle& t : head.mesh.triangles) {
    Corners c;
    int crown = -1;
    for (int k = 0; k < 3; ++k) {
      c[k] = {head.mesh.points[t[k]], normals[t[k]], head.uv[t[k]]};
      crown = t[k] == head.crown ? k : crown;
    }
    const int base = crown == 0 ? 1 : 0;
    for (int k = 0; k < 3; ++k) {
      if (k != crown) {
        c[k].uv.x() -= std::round(c[k].uv.x() - c[base].uv.x());
      }
    }
    if (crown < 0) {
      sampler.Add(c);
      continue;
    }
    // The crown is a whole side of the domain, so a triangle at the crown is a quad in the domain.
    const DomainCorner& a = c[(crown + 1) % 3];
    const DomainCorner& b = c[(crown + 2) % 3];
    DomainCorner over_a = c[crown], over_b = c[crown];
    over_a.uv = {a.uv.x(), 1};
    over_b.uv = {b.uv.x(), 1};
    sampler.Add({a, b, over_b});
    sampler.Add({a, over_b, over_a});
  }
  return std::move(sampler).Samples();
}

}  // namespace semblance::problems
