// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/ct/import_ct.h"

#include <fmt/format.h>

#include <algorithm>

#include "problems/ct/half_maximum_edge.h"
#include "problems/ct/head_mask.h"
#include "problems/ct/head_size.h"
#include "problems/ct/volume_surface.h"
#include "problems/ct/voxel_mask.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

TriMesh KeepLargePieces(const TriMesh& mesh, double smallest_cm2, CtImport& result) {
  const Components pieces = ConnectedComponents(mesh);
  std::vector<double> area_cm2(pieces.count, 0);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    area_cm2[pieces.of_triangle[t]] += TriangleAreaVector(mesh, mesh.triangles[t]).norm() / 100;
  }
  std::vector<bool> keep(mesh.triangles.size());
  for (std::size_t t = 0; t < keep.size(); ++t) {
    keep[t] = area_cm2[pieces.of_triangle[t]] >= smallest_cm2;
  }
  double left_out_cm2 = 0;
  result.dropped_bone = 0;
  for (const double area : area_cm2) {
    result.dropped_bone += area < smallest_cm2 ? 1 : 0;
    left_out_cm2 += area < smallest_cm2 ? area : 0;
  }
  if (result.dropped_bone > 0) {
    result.notes.push_back(
        fmt::format("{} pieces of bone below {} cm^2 left out, {:.1f} cm^2 in all",
                    result.dropped_bone, smallest_cm2, left_out_cm2));
  }
  return Submesh(mesh, keep);
}

// Streaks of metal (fillings, clips): what passes for bone, is thinner than bone is, and lies in
// the slices that have metal in them. Nothing where there is no metal.
VoxelMask FindStreaks(const CtVolume& volume, const CtImportOptions& options,
                      const RunContext& context, std::vector<std::string>& notes) {
  const VoxelGrid grid = GridOf(volume);
  const VoxelMask metal = AtLeast(volume, options.metal_hu);
  const VoxelComponents pieces = LabelComponents(metal, grid);
  VoxelMask streaks(metal.size(), 0);
  if (pieces.runs.empty() || options.thinnest_bone_mm <= 0) {
    return streaks;
  }
  const std::int64_t slice = std::int64_t{grid.counts[0]} * grid.counts[1];
  const auto first = static_cast<std::ptrdiff_t>(pieces.runs.front().first / slice * slice);
  const auto past = static_cast<std::ptrdiff_t>((pieces.runs.back().first / slice + 1) * slice);
  const double radius = 0.5 * options.thinnest_bone_mm;
  const VoxelMask bone = AtLeast(volume, options.bone_hu);
  const VoxelMask core = Not(Dilate(Not(bone), grid, radius, context.threads));
  const VoxelMask thick = Dilate(core, grid, radius + grid.spacing_mm.maxCoeff(), context.threads);
  const VoxelMask thin = And(Not(thick), bone);
  std::copy(thin.begin() + first, thin.begin() + past, streaks.begin() + first);
  const double voxel_cm3 = grid.spacing_mm.prod() / 1000;
  notes.push_back(fmt::format(
      "metal: {} pieces above {} HU in slices {} to {} of {}; {:.1f} cm^3 of streaks thinner than "
      "{} mm taken out of the bone there; look at it",
      pieces.sizes.size(), options.metal_hu, first / slice + 1, past / slice, grid.counts[2],
      voxel_cm3 * static_cast<double>(std::count(streaks.begin(), streaks.end(), 1)),
      options.thinnest_bone_mm));
  return streaks;
}

TriMesh SkullSurface(const CtVolume& volume, const VoxelMask& head, const CtImportOptions& options,
                     const RunContext& context, CtImport& result) {
  const VoxelMask streaks = FindStreaks(volume, options, context, result.notes);
  const auto value_of = [&](std::size_t voxel) -> double {
    const bool bone = head[voxel] && !streaks[voxel];
    return bone ? volume.values[voxel] : std::min<double>(volume.values[voxel], 0);
  };
  const TriMesh all = SurfaceAt(volume, options.bone_hu, value_of, context);
  TriMesh skull = KeepLargePieces(all, options.smallest_bone_cm2, result);
  if (skull.triangles.empty()) {
    throw InputError(
        fmt::format("import-ct: no bone at {} HU with {} cm^2 of surface; is the volume in "
                    "Hounsfield units? Lower bone_hu or smallest_bone_cm2",
                    options.bone_hu, options.smallest_bone_cm2));
  }
  CheckIsNotTooSmall(skull, "the skull");
  return skull;
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

// Of a volume as it is.
CtImport ImportAsItIs(const CtVolume& volume, const CtImportOptions& options,
                      const RunContext& context) {
  constexpr double kTissueHu = 100;  // above skin_hu: what air inside counts as
  context.Report("import ct", "head and outside air");
  const HeadMask mask = FindHeadMask(volume,
                                     {.skin_value = options.skin_hu,
                                      .thinnest_head_mm = options.thinnest_head_mm,
                                      .widest_opening_mm = options.widest_opening_mm},
                                     context);
  CtImport result;
  result.notes = mask.notes;
  context.ThrowIfStopped();
  context.Report("import ct", "surfaces");
  result.skull = SkullSurface(volume, mask.head, options, context, result);
  result.skin = SkinSurface(volume, mask, options.skin_hu, options.skin_hu + 1 + kTissueHu, context,
                            result.dropped_skin);
  if (options.edges == CtEdges::kHalfMaximum) {
    MoveToHalfMaximum(volume, context, result);
  }
  return result;
}

CtImport ImportCoarser(const CtVolume& volume, const CtImportOptions& options,
                       const RunContext& context) {
  context.Report("import ct", "coarser voxels");
  const CtVolume coarser = CoarserVolume(volume, options.coarsen, context.threads);
  CtImport result = ImportAsItIs(coarser, options, context);
  const Vec3 &from = volume.spacing_mm, &to = coarser.spacing_mm;
  result.notes.insert(
      result.notes.begin(),
      fmt::format("made coarser: voxels of {:.4g} x {:.4g} x {:.4g} mm instead of {:.4g} x {:.4g} "
                  "x {:.4g} mm",
                  to.x(), to.y(), to.z(), from.x(), from.y(), from.z()));
  return result;
}

}  // namespace

CtImport ImportCt(const CtVolume& volume, const CtImportOptions& options,
                  const RunContext& context) {
  CheckVolume(volume, "import-ct");
  CheckHeadFits(volume);
  if (!(options.skin_hu < options.bone_hu)) {
    throw InputError(fmt::format("import-ct: skin_hu {} is not below bone_hu {}", options.skin_hu,
                                 options.bone_hu));
  }
  return IsFinerThan(volume, options.coarsen) ? ImportCoarser(volume, options, context)
                                              : ImportAsItIs(volume, options, context);
}

}  // namespace semblance
