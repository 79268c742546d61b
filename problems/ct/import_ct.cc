// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/ct/import_ct.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problems/ct/half_maximum_edge.h"
#include "problems/ct/voxel_mask.h"
#include "surfaces/base/error.h"
#include "surfaces/base/parallel.h"
#include "surfaces/implicit_face.h"
#include "surfaces/marching/polygonize.h"

namespace semblance {
namespace {

constexpr float kAirHu = -1000;

VoxelGrid GridOf(const CtVolume& volume) {
  return {{volume.columns, volume.rows, volume.slices}, volume.spacing_mm};
}

VoxelMask Above(const CtVolume& volume, double hu) {
  VoxelMask mask(volume.values.size());
  std::transform(volume.values.begin(), volume.values.end(), mask.begin(),
                 [hu](std::int16_t value) { return static_cast<std::uint8_t>(value >= hu); });
  return mask;
}

VoxelMask Not(VoxelMask mask) {
  std::transform(mask.begin(), mask.end(), mask.begin(),
                 [](std::uint8_t in) { return static_cast<std::uint8_t>(!in); });
  return mask;
}

VoxelMask And(VoxelMask a, const VoxelMask& b) {
  std::transform(a.begin(), a.end(), b.begin(), a.begin(),
                 [](std::uint8_t x, std::uint8_t y) { return static_cast<std::uint8_t>(x && y); });
  return a;
}

void RequireAny(const VoxelMask& mask, const std::string& complaint) {
  if (std::find(mask.begin(), mask.end(), 1) == mask.end()) {
    throw InputError(fmt::format("import-ct: {}", complaint));
  }
}

VoxelMask LargestComponent(const VoxelMask& mask, const VoxelGrid& grid) {
  const VoxelComponents pieces = LabelComponents(mask, grid);
  if (pieces.sizes.empty()) {
    return VoxelMask(mask.size(), 0);
  }
  const auto largest = static_cast<std::int32_t>(
      std::max_element(pieces.sizes.begin(), pieces.sizes.end()) - pieces.sizes.begin());
  VoxelMask kept(mask.size());
  std::transform(
      pieces.of_voxel.begin(), pieces.of_voxel.end(), kept.begin(),
      [largest](std::int32_t piece) { return static_cast<std::uint8_t>(piece == largest); });
  return kept;
}

// Voxels without tissue on the four sides of the volume. Its first and last slice may cut airways
// open, so they let no outside in.
VoxelMask SideFaces(const VoxelMask& tissue, const VoxelGrid& grid) {
  VoxelMask faces(tissue.size(), 0);
  for (int k = 0; k < grid.counts[2]; ++k) {
    for (int j = 0; j < grid.counts[1]; ++j) {
      for (int i = 0; i < grid.counts[0]; ++i) {
        const bool side = i == 0 || j == 0 || i + 1 == grid.counts[0] || j + 1 == grid.counts[1];
        faces[grid.Index(i, j, k)] = side && !tissue[grid.Index(i, j, k)];
      }
    }
  }
  return faces;
}

// Air that the sides of the volume reach without passing an opening narrower than `widest_mm`.
// Above the last slice there is air, so that it reaches the vault of a head that ends just below
// it.
VoxelMask FindOutsideAir(VoxelMask tissue, VoxelGrid grid, double widest_mm, int threads) {
  const std::size_t voxels = tissue.size();
  grid.counts[2] += 1 + static_cast<int>(std::ceil(widest_mm / grid.spacing_mm.z()));
  tissue.resize(static_cast<std::size_t>(grid.Count()), 0);
  const double radius = 0.5 * widest_mm;
  const VoxelMask wide_air = Not(Dilate(tissue, grid, radius, threads));
  const VoxelMask reached = Flood(wide_air, SideFaces(tissue, grid), grid);
  const VoxelMask back = Dilate(reached, grid, radius + grid.spacing_mm.maxCoeff(), threads);
  VoxelMask outside = Flood(And(back, Not(tissue)), reached, grid);
  outside.resize(voxels);
  return outside;
}

// The head's tissue: that of the largest body after what is thin was taken away, with what was thin
// about that body itself (ears, nose) laid on again. Air inside counts as body, else the bone
// before a sinus would be thin.
VoxelMask FindHead(const VoxelMask& tissue, const VoxelMask& outside, const VoxelGrid& grid,
                   double thinnest_mm, int threads) {
  constexpr double kEar_mm = 20;
  const VoxelMask core = Not(Dilate(outside, grid, 0.5 * thinnest_mm, threads));
  const VoxelMask head_core = LargestComponent(core, grid);
  const VoxelMask near = And(Dilate(head_core, grid, 0.5 * thinnest_mm + kEar_mm, threads), tissue);
  return Flood(near, head_core, grid);
}

// Rows run from back to front, that is against +y: the grid's second axis counts them from the
// front.
SampleGrid WorldGrid(const CtVolume& volume) {
  SampleGrid grid;
  grid.origin = volume.World(0, volume.rows - 1, 0);
  grid.cell_mm = volume.spacing_mm;
  grid.counts = {volume.columns, volume.rows, volume.slices};
  return grid;
}

// The value less the threshold, of each voxel as `hu_of(index)` has it.
template <class HuOf>
std::vector<float> Samples(const CtVolume& volume, double threshold, const HuOf& hu_of) {
  std::vector<float> samples;
  samples.reserve(volume.values.size());
  for (int k = 0; k < volume.slices; ++k) {
    for (int row = volume.rows - 1; row >= 0; --row) {
      for (int i = 0; i < volume.columns; ++i) {
        samples.push_back(static_cast<float>(hu_of(volume.Index(i, row, k)) - threshold));
      }
    }
  }
  return samples;
}

TriMesh KeepLargePieces(const TriMesh& mesh, double smallest_cm2, int& dropped) {
  const Components pieces = ConnectedComponents(mesh);
  std::vector<double> area_cm2(pieces.count, 0);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    area_cm2[pieces.of_triangle[t]] += TriangleAreaVector(mesh, mesh.triangles[t]).norm() / 100;
  }
  std::vector<bool> keep(mesh.triangles.size());
  for (std::size_t t = 0; t < keep.size(); ++t) {
    keep[t] = area_cm2[pieces.of_triangle[t]] >= smallest_cm2;
  }
  dropped = static_cast<int>(std::count_if(area_cm2.begin(), area_cm2.end(),
                                           [&](double area) { return area < smallest_cm2; }));
  return Submesh(mesh, keep);
}

TriMesh SkullSurface(const CtVolume& volume, const VoxelMask& head, const CtImportOptions& options,
                     const RunContext& context, int& dropped) {
  const std::vector<float> samples =
      Samples(volume, options.bone_hu, [&](std::size_t voxel) -> double {
        return head[voxel] ? volume.values[voxel] : std::min<double>(volume.values[voxel], 0);
      });
  const TriMesh all = PolygonizeSamples(samples, WorldGrid(volume), context).mesh;
  TriMesh skull = KeepLargePieces(all, options.smallest_bone_cm2, dropped);
  if (skull.triangles.empty()) {
    throw InputError(
        fmt::format("import-ct: no bone at {} HU with {} cm^2 of surface; is the volume in "
                    "Hounsfield units? Lower bone_hu or smallest_bone_cm2",
                    options.bone_hu, options.smallest_bone_cm2));
  }
  return skull;
}

TriMesh SkinSurface(const CtVolume& volume, const VoxelMask& head, const VoxelMask& outside,
                    const CtImportOptions& options, const RunContext& context, int& dropped) {
  const std::vector<float> samples =
      Samples(volume, options.skin_hu, [&](std::size_t voxel) -> double {
        if (outside[voxel]) {
          return std::min<double>(volume.values[voxel], options.skin_hu - 1);  // holder, noise
        }
        return head[voxel] ? volume.values[voxel] : options.skin_hu + 1 - kAirHu / 10;
      });
  return KeepOutermost(PolygonizeSamples(samples, WorldGrid(volume), context).mesh, dropped);
}

void MoveToHalfMaximum(const CtVolume& volume, const RunContext& context, CtImport& result) {
  context.Report("import ct", "edges at half maximum");
  result.skull_move_mm = MoveToHalfMaximum(volume, HalfMaximumOptions{}, context, result.skull);
  result.skin_move_mm = MoveToHalfMaximum(volume, HalfMaximumOptions{}, context, result.skin);
  result.notes.push_back(fmt::format(
      "edges at half maximum: bone moved by {:.2f} mm and skin by {:.2f} mm on average, outward "
      "positive",
      result.skull_move_mm, result.skin_move_mm));
}

}  // namespace

CtImport ImportCt(const CtVolume& volume, const CtImportOptions& options,
                  const RunContext& context) {
  CheckVolume(volume, "import-ct");
  if (!(options.skin_hu < options.bone_hu)) {
    throw InputError(fmt::format("import-ct: skin_hu {} is not below bone_hu {}", options.skin_hu,
                                 options.bone_hu));
  }
  const VoxelGrid grid = GridOf(volume);
  context.Report("import ct", "head and outside air");
  const VoxelMask tissue = Above(volume, options.skin_hu);
  const auto outside_of = [&](const VoxelMask& mask) {
    return FindOutsideAir(mask, grid, options.widest_opening_mm, context.threads);
  };
  const VoxelMask head =
      FindHead(tissue, outside_of(tissue), grid, options.thinnest_head_mm, context.threads);
  RequireAny(head, fmt::format("no tissue above {} HU that is {} mm thick; is the volume in "
                               "Hounsfield units?",
                               options.skin_hu, options.thinnest_head_mm));
  const VoxelMask outside = outside_of(head);
  RequireAny(outside, fmt::format("no air below {} HU reaches the sides of the volume; nothing is "
                                  "outside",
                                  options.skin_hu));
  CtImport result;
  context.ThrowIfStopped();
  context.Report("import ct", "surfaces");
  result.skull = SkullSurface(volume, head, options, context, result.dropped_bone);
  result.skin = SkinSurface(volume, head, outside, options, context, result.dropped_skin);
  if (options.edges == CtEdges::kHalfMaximum) {
    MoveToHalfMaximum(volume, context, result);
  }
  return result;
}

}  // namespace semblance
