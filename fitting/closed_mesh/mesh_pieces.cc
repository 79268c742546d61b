// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/closed_mesh/mesh_pieces.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "surfaces/base/error.h"

namespace semblance {

void CheckOnePiece(const TriMesh& mesh, const std::string& refused) {
  std::vector<char> used(mesh.points.size(), 0);
  for (const Triangle& t : mesh.triangles) {
    used[t[0]] = used[t[1]] = used[t[2]] = 1;
  }
  if (const auto loose = std::count(used.begin(), used.end(), 0); loose > 0) {
    throw InputError(fmt::format("{}: {} of its {} points belong to no triangle; remove them",
                                 refused, loose, mesh.points.size()));
  }
  if (const int pieces = ConnectedComponents(mesh).count; pieces != 1) {
    throw InputError(fmt::format("{}: it has {} pieces; keep one", refused, pieces));
  }
}

}  // namespace semblance
