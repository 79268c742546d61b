// SPDX-License-Identifier: GPL-3.0-or-later
// Tissue depth at every vertex of a dome of bone, interpolated from nine dowels by three schemes.
#include <algorithm>
#include <iostream>

#include "interp/interpolate_depth.h"

using namespace semblance::interp;

constexpr int kSide = 21;  // vertices per side

TriMesh Dome() {
  TriMesh bone;
  for (int i = 0; i < kSide * kSide; ++i) {
    const double x = 2.0 * (i % kSide) / (kSide - 1) - 1, y = 2.0 * (i / kSide) / (kSide - 1) - 1;
    bone.points.emplace_back(60 * x, 60 * y, 30 - 15 * (x * x + y * y));
  }
  for (int row = 0; row + 1 < kSide; ++row) {
    for (int column = 0; column + 1 < kSide; ++column) {
      const int a = row * kSide + column, b = a + 1, c = a + kSide, d = c + 1;
      bone.triangles.push_back({a, b, d});
      bone.triangles.push_back({a, d, c});
    }
  }
  return bone;
}

int main() {
  const TriMesh bone = Dome();
  std::vector<Dowel> dowels;
  for (const int row : {2, 10, 18}) {
    for (const int column : {2, 10, 18}) {
      const Vec3 base = bone.points[row * kSide + column];
      dowels.push_back({.site = std::to_string(dowels.size()),
                        .base = base,
                        .direction = Vec3::UnitZ(),
                        .depth_mm = 8 + base.x() / 20});
    }
  }
  const std::vector<Vec3> normals = VertexNormals(bone);
  const DowelNetwork no_network;  // only `barycentric` and `network_spline` need one
  const DepthInput input{
      .skull = bone, .normals = normals, .dowels = dowels, .network = no_network};
  for (const DepthScheme& scheme :
       {DepthScheme(Nearest{}), DepthScheme(RadialBasis{}), DepthScheme(Kriging{})}) {
    const DepthField field = InterpolateDepth(scheme, input, {});
    const auto [least, most] = std::minmax_element(field.depth_mm.begin(), field.depth_mm.end());
    std::cout << *least << " to " << *most << " mm\n";
  }
}
