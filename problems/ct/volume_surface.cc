// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/ct/volume_surface.h"

#include <algorithm>

#include "surfaces/implicit_face.h"
#include "surfaces/marching/polygonize.h"

namespace semblance {

TriMesh SurfaceAt(const CtVolume& volume, double threshold,
                  const std::function<double(std::size_t)>& value_of, const RunContext& context) {
  std::vector<float> samples(volume.values.size());
  for (std::size_t voxel = 0; voxel < samples.size(); ++voxel) {
    samples[voxel] = static_cast<float>(value_of(voxel) - threshold);
  }
  // In coordinates along the volume's own axes, which are turned to LPS at the end.
  const SampleGrid grid{.origin = volume.axes.inverse() * volume.origin,
                        .cell_mm = volume.spacing_mm,
                        .counts = {volume.columns, volume.rows, volume.slices}};
  TriMesh mesh = PolygonizeSamples(samples, grid, context).mesh;
  for (Vec3& p : mesh.points) {
    p = volume.axes * p;
  }
  return mesh;
}

TriMesh SkinSurface(const CtVolume& volume, const HeadMask& mask, double skin_value, double inside,
                    const RunContext& context, int& dropped) {
  const auto value_of = [&](std::size_t voxel) -> double {
    if (mask.outside[voxel]) {
      return std::min<double>(volume.values[voxel], skin_value - 1);  // holder, noise
    }
    return mask.head[voxel] ? volume.values[voxel] : inside;
  };
  return KeepOutermost(SurfaceAt(volume, skin_value, value_of, context), dropped);
}

}  // namespace semblance
