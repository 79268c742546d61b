// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/volumes/head_mask.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

// Throws InputError with the message if the mask is empty.
void RequireAny(const VoxelMask& mask, const std::string& message) {
  if (std::find(mask.begin(), mask.end(), 1) == mask.end()) {
    throw InputError(fmt::format("import-ct: {}", message));
  }
}

VoxelMask LargestComponent(const VoxelMask& mask, const VoxelGrid& grid) {
  const VoxelComponents pieces = LabelComponents(mask, grid);
  std::vector<bool> keep(pieces.sizes.size(), false);
  if (!keep.empty()) {
    keep[pieces.Largest()] = true;
  }
  return MakeMask(pieces, keep, grid);
}

// Layers of air around a volume: on its four sides, because a table may be close to them, and
// above, so that air reaches the vault of a head that ends just below the last slice. There is none
// below, because the first slice may cut airways open.
struct Padding {
  int columns = 0, rows = 0, above = 0;

  Padding(const VoxelGrid& grid, double width_mm)
      : columns(1 + static_cast<int>(std::ceil(width_mm / grid.spacing_mm.x()))),
        rows(1 + static_cast<int>(std::ceil(width_mm / grid.spacing_mm.y()))),
        above(1 + static_cast<int>(std::ceil(width_mm / grid.spacing_mm.z()))) {}
  VoxelGrid Around(VoxelGrid grid) const {
    grid.counts[0] += 2 * columns;
    grid.counts[1] += 2 * rows;
    grid.counts[2] += above;
    return grid;
  }
  // Calls copy(first voxel of a row inside, first of the same row with the padding).
  template <class Copy>
  void ForRows(const VoxelGrid& inside, const Copy& copy) const {
    const VoxelGrid around = Around(inside);
    for (int k = 0; k < inside.counts[2]; ++k) {
      for (int j = 0; j < inside.counts[1]; ++j) {
        copy(inside.Index(0, j, k), around.Index(columns, j + rows, k));
      }
    }
  }
};

// The voxels on the four sides of a grid.
VoxelMask SideFaces(const VoxelGrid& grid) {
  VoxelMask faces(static_cast<std::size_t>(grid.Count()), 0);
  for (int k = 0; k < grid.counts[2]; ++k) {
    for (int j = 0; j < grid.counts[1]; ++j) {
      const bool side = j == 0 || j + 1 == grid.counts[1];
      const int step = side ? 1 : grid.counts[0] - 1;
      for (int i = 0; i < grid.counts[0]; i += step) {
        faces[grid.Index(i, j, k)] = 1;
      }
    }
  }
  return faces;
}

// Finds the air that is connected to the sides and the top of the volume by openings wider than
// `widest_mm`. The air starts from the sides only, because the first slice may cut airways open.
// Shrinks the air by half the width, which closes narrow openings; floods what remains from the
// sides; and grows the result back to the tissue.
VoxelMask FindOutsideAir(const VoxelMask& tissue, const VoxelGrid& grid, double widest_mm,
                         int threads) {
  const double radius = 0.5 * widest_mm;
  const Padding padding(grid, widest_mm);
  const VoxelGrid around = padding.Around(grid);
  VoxelMask air(static_cast<std::size_t>(around.Count()), 1);
  padding.ForRows(grid, [&](std::int64_t inside, std::int64_t padded) {
    std::transform(tissue.begin() + inside, tissue.begin() + inside + grid.counts[0],
                   air.begin() + padded,
                   [](std::uint8_t in) { return static_cast<std::uint8_t>(!in); });
  });
  const VoxelMask wide_air = Not(Dilate(Not(air), around, radius, threads));
  const VoxelMask reached = Flood(wide_air, SideFaces(around), around);
  const VoxelMask back = Dilate(reached, around, radius + grid.spacing_mm.maxCoeff(), threads);
  const VoxelMask outside_all = Flood(And(air, back), reached, around);
  VoxelMask outside(tissue.size());
  padding.ForRows(grid, [&](std::int64_t inside, std::int64_t padded) {
    std::copy_n(outside_all.begin() + padded, grid.counts[0], outside.begin() + inside);
  });
  return outside;
}

// Finds the head's tissue: the largest body after thin structures were removed, with the thin parts
// of that body itself (ears, nose) added again. Air inside counts as body; otherwise the bone in
// front of a sinus would be thin.
VoxelMask FindHead(const VoxelMask& tissue, const VoxelMask& outside, const VoxelGrid& grid,
                   double thinnest_mm, int threads) {
  constexpr double kEar_mm = 20;  // thin parts of the head reach at most this far from its core
  const VoxelMask core = Not(Dilate(outside, grid, 0.5 * thinnest_mm, threads));
  const VoxelMask head_core = LargestComponent(core, grid);
  const VoxelMask near = And(Dilate(head_core, grid, 0.5 * thinnest_mm + kEar_mm, threads), tissue);
  return Flood(near, head_core, grid);
}

// The longest side of a component's bounding box.
double ComponentLength_mm(const VoxelComponents& components, int component, const VoxelGrid& grid) {
  Box3 box;
  const std::int64_t row = grid.counts[0], slice = row * grid.counts[1];
  for (const VoxelRun& run : components.runs) {
    if (run.component == component) {
      const std::int64_t i = run.first % row, j = run.first % slice / row, k = run.first / slice;
      const Vec3 first(static_cast<double>(i), static_cast<double>(j), static_cast<double>(k));
      box.extend(first.cwiseProduct(grid.spacing_mm));
      box.extend((first + Vec3(run.length, 1, 1)).cwiseProduct(grid.spacing_mm));
    }
  }
  return box.sizes().maxCoeff();
}

// Describes the dense objects outside of the head in one line; no line if there are none.
std::vector<std::string> NoteDroppedObjects(const VoxelMask& tissue, const VoxelMask& head,
                                            const VoxelGrid& grid) {
  constexpr double kSpeck_cm3 = 1;  // smaller objects are only counted
  const VoxelComponents pieces = LabelComponents(And(Not(head), tissue), grid);
  if (pieces.sizes.empty()) {
    return {};
  }
  const double voxel_cm3 = grid.spacing_mm.prod() / 1000;
  const auto things = std::count_if(pieces.sizes.begin(), pieces.sizes.end(), [&](auto voxels) {
    return static_cast<double>(voxels) * voxel_cm3 >= kSpeck_cm3;
  });
  const auto specks = static_cast<std::ptrdiff_t>(pieces.sizes.size()) - things;
  const int largest = pieces.Largest();
  const std::string large = fmt::format(
      "{} of at least {} cm^3 (head holder, table, tubes; the largest {:.0f} cm^3, {:.0f} mm long)",
      things, kSpeck_cm3, static_cast<double>(pieces.sizes[largest]) * voxel_cm3,
      ComponentLength_mm(pieces, largest, grid));
  return {fmt::format("left out because not part of the head: {}{}{}", things > 0 ? large : "",
                      things > 0 && specks > 0 ? "; " : "",
                      specks > 0 ? fmt::format("{} smaller (specks, noise)", specks) : "")};
}

}  // namespace

VoxelGrid MakeVoxelGrid(const CtVolume& volume) {
  return {{volume.columns, volume.rows, volume.slices}, volume.spacing_mm};
}

VoxelMask AtLeast(const CtVolume& volume, double least) {
  VoxelMask mask(volume.values.size());
  std::transform(volume.values.begin(), volume.values.end(), mask.begin(),
                 [least](std::int16_t value) { return static_cast<std::uint8_t>(value >= least); });
  return mask;
}

VoxelMask Not(VoxelMask mask) {
  std::transform(mask.begin(), mask.end(), mask.begin(),
                 [](std::uint8_t in) { return static_cast<std::uint8_t>(!in); });
  return mask;
}

VoxelMask And(VoxelMask a, const VoxelMask& b) {
  std::transform(a.begin(), a.end(), b.begin(), a.begin(),
                 [](std::uint8_t x, std::uint8_t y) { return static_cast<std::uint8_t>(x & y); });
  return a;
}

HeadMask FindHeadMask(const CtVolume& volume, const HeadMaskOptions& options,
                      const RunContext& context) {
  const VoxelGrid grid = MakeVoxelGrid(volume);
  const VoxelMask tissue = AtLeast(volume, options.skin_value);
  const auto find_outside = [&](const VoxelMask& mask) {
    context.ThrowIfStopped();
    return FindOutsideAir(mask, grid, options.widest_opening_mm, context.threads);
  };
  HeadMask result;
  result.head =
      FindHead(tissue, find_outside(tissue), grid, options.thinnest_head_mm, context.threads);
  RequireAny(result.head, fmt::format("no tissue above {} HU that is {} mm thick; is the volume in "
                                      "Hounsfield units?",
                                      options.skin_value, options.thinnest_head_mm));
  result.outside = find_outside(result.head);
  RequireAny(result.outside,
             fmt::format("no air below {} HU reaches the sides of the volume; nothing is outside; "
                         "is the volume in Hounsfield units? (for an MR, import-ct --modality mr "
                         "extracts the skin)",
                         options.skin_value));
  result.notes = NoteDroppedObjects(tissue, result.head, grid);
  return result;
}

}  // namespace semblance::problems
