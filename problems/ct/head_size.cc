// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/ct/head_size.h"

#include "surfaces/mesh/mesh_check.h"

namespace semblance {
namespace {

void CheckLongest(double longest_mm, const std::string& name) {
  if (longest_mm < kSmallestHead_mm) {
    CheckHeadSize(longest_mm, name, "multiply spacing and origin in the volume's header by {}");
  }
}

}  // namespace

void CheckHeadFits(const CtVolume& volume) {
  const Vec3 counts(volume.columns, volume.rows, volume.slices);
  CheckLongest(volume.spacing_mm.cwiseProduct(counts).maxCoeff(), "import-ct: the volume");
}

void CheckIsNotTooSmall(const TriMesh& mesh, const std::string& name) {
  CheckLongest(Bounds(mesh).sizes().maxCoeff(), "import-ct: " + name);
}

}  // namespace semblance
