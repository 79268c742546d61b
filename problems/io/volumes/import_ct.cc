// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/volumes/import_ct.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "problems/io/volumes/head_check.h"
#include "problems/io/volumes/head_mask.h"
#include "problems/io/volumes/volume_surface.h"
#include "problems/io/volumes/voxel_mask.h"
#include "surfaces/base/error.h"
#include "surfaces/mesh/mesh_check.h"

namespace semblance::problems {
namespace {

// Throws InputError if this is shorter than any head: then the unit of the file's lengths is
// another one, which the message names, and its header must be corrected.
void CheckLongestSide(double longest_mm, const std::string& name) {
  if (longest_mm < kSmallestHead_mm) {
    CheckHeadSize(longest_mm, name, "multiply spacing and origin in the volume's header by {}");
  }
}

// A volume may be larger than any head.
void CheckVolumeSize(const CtVolume& volume) {
  const Vec3 counts(volume.columns, volume.rows, volume.slices);
  CheckLongestSide(volume.spacing_mm.cwiseProduct(counts).maxCoeff(), "import-ct: the volume");
}

void CheckMeshSize(const TriMesh& mesh, const std::string& name) {
  CheckLongestSide(Bounds(mesh).sizes().maxCoeff(), "import-ct: " + name);
}

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

// Finds streaks of metal (fillings, clips): voxels with the value of bone that belong to structures
// thinner than bone, in the slices between the first and the last with metal. Empty without metal.
VoxelMask FindStreaks(const CtVolume& volume, const CtImportOptions& options,
                      const RunContext& context, std::vector<std::string>& notes) {
  const VoxelGrid grid = MakeVoxelGrid(volume);
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
      "{} mm removed from the bone there; check it",
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
  CheckMeshSize(skull, "the skull");
  return skull;
}

void MoveEdges(const CtVolume& volume, const RunContext& context, CtImport& result) {
  context.Report("import ct", "edges at half maximum");
  result.skull_move_mm = MoveToHalfMaximum(volume, HalfMaximumOptions{}, context, result.skull);
  result.skin_move_mm = MoveToHalfMaximum(volume, HalfMaximumOptions{}, context, result.skin);
  result.notes.push_back(fmt::format(
      "edges at half maximum: bone moved by {:.2f} mm and skin by {:.2f} mm on average, outward "
      "positive",
      result.skull_move_mm, result.skin_move_mm));
}

// Imports a volume without making it coarser.
CtImport ImportVolume(const CtVolume& volume, const CtImportOptions& options,
                      const RunContext& context) {
  // Air inside counts as this much above the skin's value, so that no surface forms around it.
  constexpr double kInsideAboveSkin_hu = 100;
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
  result.skin =
      SkinSurface(volume, mask, options.skin_hu, options.skin_hu + 1 + kInsideAboveSkin_hu, context,
                  result.dropped_skin);
  CheckHeadExtent(volume, mask, result.skin, result.notes);
  if (options.edges == CtEdges::kHalfMaximum) {
    MoveEdges(volume, context, result);
  }
  return result;
}

CtImport ImportCoarser(const CtVolume& volume, const CtImportOptions& options,
                       const RunContext& context) {
  context.Report("import ct", "coarser voxels");
  const CtVolume coarser = MakeCoarserVolume(volume, options.coarsen, context.threads);
  CtImport result = ImportVolume(coarser, options, context);
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
  CheckVolumeSize(volume);
  if (!(options.skin_hu < options.bone_hu)) {
    throw InputError(fmt::format("import-ct: skin_hu {} is not below bone_hu {}", options.skin_hu,
                                 options.bone_hu));
  }
  std::vector<std::string> notes;
  CheckHounsfieldUnits(volume, options.skin_hu, options.bone_hu, notes);
  CtImport result = IsFinerThan(volume, options.coarsen) ? ImportCoarser(volume, options, context)
                                                         : ImportVolume(volume, options, context);
  result.notes.insert(result.notes.begin(), notes.begin(), notes.end());
  return result;
}

// ---------------------------------------------------------------------------------------------
// The skin from an MR volume
// ---------------------------------------------------------------------------------------------

namespace {

constexpr int kOtsuClasses = 256;

// The number of the last dark class. It maximises the variance between dark and bright classes,
// which minimises the variance within both.
int LastDarkClass(const std::array<double, kOtsuClasses>& counts) {
  double all = 0, all_sum = 0;
  for (int n = 0; n < kOtsuClasses; ++n) {
    all += counts[n];
    all_sum += n * counts[n];
  }
  double dark = 0, dark_sum = 0, best = -1;
  int last = 0;
  for (int n = 0; n + 1 < kOtsuClasses; ++n) {
    dark += counts[n];
    dark_sum += n * counts[n];
    const double bright = all - dark;
    if (dark > 0 && bright > 0) {
      const double distance = dark_sum / dark - (all_sum - dark_sum) / bright;
      const double between = dark * bright * distance * distance;
      if (between > best) {
        best = between;
        last = n;
      }
    }
  }
  return last;
}

// The value that one voxel in a thousand exceeds.
double NearlyBrightest(const CtVolume& volume) {
  std::array<std::int64_t, 65536> counts = {};
  for (const std::int16_t value : volume.values) {
    ++counts[value + 32768];
  }
  const auto allowed = static_cast<std::int64_t>(volume.values.size() / 1000);
  int value = 65535;
  for (std::int64_t above = counts[value]; above <= allowed && value > 0; above += counts[value]) {
    --value;
  }
  return value - 32768;
}

}  // namespace

double OtsuThreshold(const CtVolume& volume) {
  const double low = *std::ranges::min_element(volume.values);
  const double width = std::max(1.0, NearlyBrightest(volume) - low) / kOtsuClasses;
  std::array<double, kOtsuClasses> counts = {};
  for (const std::int16_t value : volume.values) {
    ++counts[std::min(kOtsuClasses - 1, static_cast<int>((value - low) / width))];
  }
  return low + width * (LastDarkClass(counts) + 1);
}

MrSkin ImportMrSkin(const CtVolume& volume, const MrSkinOptions& options,
                    const RunContext& context) {
  CheckVolume(volume, "import-ct");
  CheckVolumeSize(volume);
  MrSkin result;
  result.skin_value = options.skin_value > 0 ? options.skin_value : OtsuThreshold(volume);
  context.Report("import mr", "head and outside air");
  const HeadMask mask = FindHeadMask(volume,
                                     {.skin_value = result.skin_value,
                                      .thinnest_head_mm = options.thinnest_head_mm,
                                      .widest_opening_mm = options.widest_opening_mm},
                                     context);
  context.Report("import mr", "skin");
  result.notes = mask.notes;
  result.skin = SkinSurface(volume, mask, result.skin_value, 2 * std::abs(result.skin_value) + 1,
                            context, result.dropped);
  CheckMeshSize(result.skin, "the skin");
  CheckHeadExtent(volume, mask, result.skin, result.notes);
  result.notes.push_back(fmt::format("skin at the grey value {:.0f}{}", result.skin_value,
                                     options.skin_value > 0 ? "" : ", found by Otsu's method"));
  result.notes.push_back(
      "no skull: bone is as dark as air in MR; take the skull from a CT of the same head");
  return result;
}

}  // namespace semblance::problems
