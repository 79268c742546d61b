// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/population/dense_mesh.h"

namespace semblance {

DenseMesh MeshOf(const DepthModes& dense) {
  DenseMesh mesh;
  std::vector<std::int32_t> vertex(dense.n.size(), -1);
  for (std::size_t cell = 0; cell < vertex.size(); ++cell) {
    if (dense.n[cell] > 0) {
      vertex[cell] = static_cast<std::int32_t>(mesh.cells.size());
      mesh.cells.push_back(cell);
      mesh.mesh.points.push_back(dense.bone[cell]);
    }
  }
  const auto add = [&](std::size_t a, std::size_t b, std::size_t c) {
    if (vertex[a] >= 0 && vertex[b] >= 0 && vertex[c] >= 0) {
      mesh.mesh.triangles.push_back({vertex[a], vertex[b], vertex[c]});
    }
  };
  for (int j = 0; j + 1 < dense.rows; ++j) {
    for (int i = 0; i + 1 < dense.columns; ++i) {
      const std::size_t a = i + static_cast<std::size_t>(dense.columns) * j, b = a + 1,
                        c = a + dense.columns, d = c + 1;
      add(a, b, d);
      add(a, d, c);
    }
  }
  return mesh;
}

std::vector<double> OnVertices(const DenseMesh& mesh, const std::vector<double>& by_cell) {
  std::vector<double> values;
  for (const std::size_t cell : mesh.cells) {
    values.push_back(by_cell[cell]);
  }
  return values;
}

}  // namespace semblance
