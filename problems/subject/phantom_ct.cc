// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/phantom_ct.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "surfaces/base/error.h"
#include "surfaces/base/parallel.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {
namespace {

constexpr double kAirHu = -1000, kTissueHu = 40, kBoneHu = 1000, kPlasticHu = 100;
constexpr int kLines = 3;  // lines through a voxel along y, and along z; more is finer and slower

CtVolume EmptyVolume(const Box3& head, const PhantomCtOptions& options) {
  CtVolume volume;
  volume.spacing_mm = Vec3(options.pixel_mm, options.pixel_mm, options.slice_mm);
  volume.origin = head.min() - Vec3::Constant(options.margin_mm);
  const Vec3 counts =
      (head.sizes() + Vec3::Constant(2 * options.margin_mm)).cwiseQuotient(volume.spacing_mm);
  volume.columns = static_cast<int>(std::ceil(counts.x())) + 1;
  volume.rows = static_cast<int>(std::ceil(counts.y())) + 1;
  volume.slices = static_cast<int>(std::ceil(counts.z())) + 1;
  volume.values.resize(volume.Index(0, 0, volume.slices));
  return volume;
}

// The distances at which the line from `start` along +x alternately enters and leaves a closed
// mesh. A line that hits an edge may count it twice or miss it; then the line is moved a little and
// retried.
std::vector<double> Crossings(const MeshQuery& mesh, Vec3 start, double length_mm) {
  constexpr double kSameHit_mm = 1e-7, kNudge_mm = 1e-4;
  for (;;) {
    std::vector<double> crossings;
    for (const MeshPoint& hit : mesh.AllHits(start, Vec3::UnitX(), length_mm)) {
      if (crossings.empty() || hit.distance_mm - crossings.back() > kSameHit_mm) {
        crossings.push_back(hit.distance_mm);
      }
    }
    if (crossings.size() % 2 == 0) {
      return crossings;
    }
    start += Vec3(0, kNudge_mm, 0.7 * kNudge_mm);
  }
}

// Adds to each voxel of a row `share` times the fraction of its length that lies between crossings.
// The near face of the first voxel is at x_mm, measured as the crossings are.
void AddCoverage(const std::vector<double>& crossings, double x_mm, double pixel_mm, double share,
                 std::vector<double>& row) {
  for (std::size_t n = 0; n + 1 < crossings.size(); n += 2) {
    const double in = (crossings[n] - x_mm) / pixel_mm, out = (crossings[n + 1] - x_mm) / pixel_mm;
    const int last = std::min(static_cast<int>(row.size()) - 1, static_cast<int>(out));
    for (int i = std::max(0, static_cast<int>(in)); i <= last; ++i) {
      row[i] += share * std::max(0.0, std::min(out, i + 1.0) - std::max(in, double(i)));
    }
  }
}

// The fraction of each voxel of a row that is inside a mesh, 0..1.
std::vector<double> RowCoverage(const MeshQuery& mesh, const CtVolume& volume, int row, int slice) {
  std::vector<double> coverage(volume.columns, 0);
  const double pixel_mm = volume.spacing_mm.x(), before_mm = pixel_mm;
  for (int a = 0; a < kLines; ++a) {
    for (int b = 0; b < kLines; ++b) {
      Vec3 start =
          volume.World(0, row + (a + 0.5) / kLines - 0.5, slice + (b + 0.5) / kLines - 0.5);
      start.x() -= 0.5 * pixel_mm + before_mm;
      const double length_mm = (volume.columns + 2) * pixel_mm;
      AddCoverage(Crossings(mesh, start, length_mm), before_mm, pixel_mm, 1.0 / (kLines * kLines),
                  coverage);
    }
  }
  return coverage;
}

// The fraction of each voxel of a row that is inside the mesh in which most of it is.
std::vector<double> TissueOfRow(const std::vector<MeshQuery>& tissue, const CtVolume& volume,
                                int row, int slice) {
  std::vector<double> most = RowCoverage(tissue.front(), volume, row, slice);
  for (std::size_t k = 1; k < tissue.size(); ++k) {
    const std::vector<double> other = RowCoverage(tissue[k], volume, row, slice);
    std::ranges::transform(most, other, most.begin(),
                           [](double a, double b) { return std::max(a, b); });
  }
  return most;
}

// The inner side of the skull: its outer side drawn towards the centre.
TriMesh InnerTable(const Phantom& phantom, double bone_mm) {
  TriMesh inner = phantom.skull;
  for (Vec3& p : inner.points) {
    const Vec3 from_centre = p - phantom.centre;
    p = phantom.centre + from_centre * std::max(0.1, 1 - bone_mm / from_centre.norm());
  }
  return inner;
}

// A sheet behind the head, 3 mm thick and 160 mm wide.
bool InHolder(const Vec3& p, const Box3& head, const PhantomCtOptions& options) {
  constexpr double kGap_mm = 4, kThick_mm = 3, kHalfWidth_mm = 80;
  const double behind = p.y() - head.max().y();
  return options.head_holder && behind > kGap_mm && behind < kGap_mm + kThick_mm &&
         std::abs(p.x() - head.center().x()) < kHalfWidth_mm;
}

}  // namespace

LostBone::LostBone(std::span<const PhantomSite> sites, const BoneDefect& defect) {
  if (defect.site.empty()) {
    return;
  }
  const auto site = std::ranges::find(sites, defect.site, &PhantomSite::site);
  if (site == sites.end()) {
    throw InputError(
        fmt::format("phantom: the head has no site '{}' to lose bone at; docs/reference/sites.md "
                    "lists the sites",
                    defect.site));
  }
  centre_ = site->base;
  radius_mm_ = defect.radius_mm;
}

CtVolume VoxeliseHead(const ScannedHead& head, const PhantomCtOptions& options) {
  if (!(options.pixel_mm > 0) || !(options.slice_mm > 0)) {
    throw InputError(fmt::format("phantom: voxels of {} x {} mm are not usable; each must be > 0",
                                 options.pixel_mm, options.slice_mm));
  }
  const LostBone lost(head.sites, options.defect);
  const Box3 box = Bounds(*head.tissue.front());
  std::vector<MeshQuery> tissue;
  for (const TriMesh* mesh : head.tissue) {
    tissue.emplace_back(*mesh);
  }
  CtVolume volume = EmptyVolume(box, options);
  const std::size_t lines = static_cast<std::size_t>(volume.rows) * volume.slices;
  ParallelFor(lines, options.threads, 64, [&](std::size_t line) {
    const int row = static_cast<int>(line % volume.rows);
    const int slice = static_cast<int>(line / volume.rows);
    const std::vector<double> in_tissue = TissueOfRow(tissue, volume, row, slice);
    const std::vector<double> in_bone = head.bone(volume, row, slice);
    for (int i = 0; i < volume.columns; ++i) {
      const Vec3 at = volume.World(i, row, slice);
      const double bone_here = lost.Holds(at) ? 0 : in_bone[i];
      const double hu =
          kAirHu + in_tissue[i] * (kTissueHu - kAirHu) + bone_here * (kBoneHu - kTissueHu);
      const bool holder = InHolder(at, box, options);
      volume.values[volume.Index(i, row, slice)] =
          static_cast<std::int16_t>(std::lround(holder ? kPlasticHu : hu));
    }
  });
  return volume;
}

CtVolume VoxelisePhantom(const Phantom& phantom, const PhantomCtOptions& options) {
  const MeshQuery outer(phantom.skull), inner(InnerTable(phantom, options.bone_mm));
  const auto bone = [&](const CtVolume& volume, int row, int slice) {
    std::vector<double> share = RowCoverage(outer, volume, row, slice);
    const std::vector<double> in_brain = RowCoverage(inner, volume, row, slice);
    for (std::size_t i = 0; i < share.size(); ++i) {
      share[i] -= in_brain[i];
    }
    return share;
  };
  return VoxeliseHead({{&phantom.face}, bone, phantom.sites}, options);
}

}  // namespace semblance::problems
