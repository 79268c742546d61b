// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/bust/head_samples.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace semblance {
namespace {

struct Corner {
  Vec3 point, normal;
  Vec2 uv;
};
using Corners = std::array<Corner, 3>;

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
    // The crown is a side of the domain: the triangle is a quad there.
    const Corner& a = c[(crown + 1) % 3];
    const Corner& b = c[(crown + 2) % 3];
    Corner over_a = c[crown], over_b = c[crown];
    over_a.uv = {a.uv.x(), 1};
    over_b.uv = {b.uv.x(), 1};
    sampler.Add({a, b, over_b});
    sampler.Add({a, over_b, over_a});
  }
  return std::move(sampler).Samples();
}

}  // namespace semblance
