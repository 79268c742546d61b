// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/problem/seeding.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>

#include "surfaces/base/error.h"

namespace semblance::fitting {
namespace {

struct Patches {
  int u = 0, v = 0;
  bool periodic_u = false;
  Vec2 Center(int i, int j) const { return {(i + 0.5) / u, (j + 0.5) / v}; }
};

// The seed of a patch. Seeds are stored with i fastest.
struct Seed {
  Vec3 on_surface = Vec3::Constant(kNaN);
  std::optional<Vec3> on_mesh;
};

[[noreturn]] void FailSeeding(const std::string& what) { throw InputError("seeding: " + what); }

void CheckOptions(const SeedOptions& o, int max_level) {
  if (o.level < 0 || o.level > 8) {
    FailSeeding(fmt::format("level {} is not in 0..8", o.level));
  }
  if (o.direction_level < 0 || o.direction_level > max_level) {
    FailSeeding(fmt::format("direction_level {}; the surface has levels 0..{}", o.direction_level,
                            max_level));
  }
  if (!(std::isfinite(o.max_distance_mm) && o.max_distance_mm > 0)) {
    FailSeeding(fmt::format("max_distance_mm {} is not a positive number", o.max_distance_mm));
  }
  if (!(o.max_normal_angle_deg >= 0 && o.max_normal_angle_deg <= 90)) {
    FailSeeding(fmt::format("max_normal_angle_deg {} is not in 0..90", o.max_normal_angle_deg));
  }
  if (!(std::isfinite(o.weight) && o.weight > 0)) {
    FailSeeding(fmt::format("weight {} is not a positive number", o.weight));
  }
}

void CheckMasks(std::span<const Sphere> masks) {
  for (std::size_t i = 0; i < masks.size(); ++i) {
    if (!masks[i].center.allFinite() ||
        !(std::isfinite(masks[i].radius_mm) && masks[i].radius_mm > 0)) {
      FailSeeding(fmt::format("mask {} needs a finite center and a radius_mm > 0, not {}", i,
                              masks[i].radius_mm));
    }
  }
}

bool IsMasked(const Vec3& p, std::span<const Sphere> masks) {
  return std::any_of(masks.begin(), masks.end(), [&](const Sphere& s) { return s.Contains(p); });
}

// The unit normal of a coarse level's own surface. Normals of the full surface cross within the
// radius of its concave parts (under the lip and beside the nose: a few mm), so rays of 10 mm and
// more would land in the wrong order. The coarse levels of a face have no such parts.
Vec3 SmoothNormal(const HSplineSurface& surface, int level, const Vec2& uv) {
  const SurfaceFrame frame = surface.LevelFrame(level, uv);
  return frame.du.cross(frame.dv).normalized();  // zero where the surface has no tangent plane
}

class Seeder {
 public:
  Seeder(const MeshQuery& implicit, const TriMesh& mesh, const SeedOptions& options)
      : implicit_(implicit),
        mesh_(mesh),
        options_(options),
        min_cosine_(std::cos(options.max_normal_angle_deg * std::numbers::pi / 180) - 1e-12) {}

  std::optional<Vec3> Find(const Vec3& origin, const Vec3& direction) const {
    if (!(direction.squaredNorm() > 0.5)) {
      return std::nullopt;
    }
    return options_.method == SeedMethod::kRay ? AlongRay(origin, direction)
                                               : Closest(origin, direction);
  }

 private:
  bool Faces(const MeshPoint& hit, const Vec3& direction) const {
    const Vec3 area = TriangleAreaVector(mesh_, mesh_.triangles[hit.triangle]);
    return area.dot(direction) > 0 && area.dot(direction) >= min_cosine_ * area.norm();
  }

  std::optional<Vec3> AlongRay(const Vec3& origin, const Vec3& direction) const {
    MeshPoint best{.distance_mm = std::numeric_limits<double>::infinity()};
    for (const double sign : {1.0, -1.0}) {
      for (const MeshPoint& hit :
           implicit_.AllHits(origin, sign * direction, options_.max_distance_mm)) {
        if (hit.distance_mm < best.distance_mm && Faces(hit, direction)) {
          best = hit;
        }
      }
    }
    return best.triangle >= 0 ? std::optional(best.position) : std::nullopt;
  }

  std::optional<Vec3> Closest(const Vec3& origin, const Vec3& direction) const {
    const MeshPoint hit = implicit_.Closest(origin);
    const bool fits = hit.distance_mm <= options_.max_distance_mm && Faces(hit, direction);
    return fits ? std::optional(hit.position) : std::nullopt;
  }

  const MeshQuery& implicit_;
  const TriMesh& mesh_;
  const SeedOptions& options_;
  double min_cosine_;
};

std::vector<Seed> FindSeeds(const HSplineSurface& placed, const Seeder& seeder,
                            const Patches& patches, std::span<const Sphere> masks,
                            const SeedOptions& options, SeedResult& result) {
  std::vector<Seed> seeds;
  for (int j = 0; j < patches.v; ++j) {
    for (int i = 0; i < patches.u; ++i) {
      const Vec2 uv = patches.Center(i, j);
      Seed seed{.on_surface = placed.Point(uv), .on_mesh = std::nullopt};
      if (!IsMasked(seed.on_surface, masks)) {
        seed.on_mesh =
            seeder.Find(seed.on_surface, SmoothNormal(placed, options.direction_level, uv));
        result.missed += seed.on_mesh ? 0 : 1;
      } else {
        ++result.masked;
      }
      if (seed.on_mesh && IsMasked(*seed.on_mesh, masks)) {
        seed.on_mesh.reset();
        ++result.masked;
      }
      seeds.push_back(seed);
    }
  }
  return seeds;
}

// Returns whether the direction from a to b on the mesh is opposite to that on the surface.
bool Reversed(const Seed& a, const Seed& b) {
  return a.on_mesh && b.on_mesh && (*b.on_mesh - *a.on_mesh).dot(b.on_surface - a.on_surface) < 0;
}

// Counts the neighbours (of four) that have changed places with patch (i, j).
int CountReversed(const std::vector<Seed>& seeds, const Patches& patches, int i, int j) {
  const auto at = [&](int a, int b) -> const Seed* {
    a = WrapIndex(patches.u, a, patches.periodic_u);
    b = WrapIndex(patches.v, b, false);
    return a >= 0 && b >= 0 ? &seeds[a + patches.u * b] : nullptr;
  };
  const Seed& seed = *at(i, j);
  int count = 0;
  for (const Seed* neighbour : {at(i - 1, j), at(i + 1, j), at(i, j - 1), at(i, j + 1)}) {
    count += neighbour != nullptr && Reversed(seed, *neighbour) ? 1 : 0;
  }
  return count;
}

// A fold is a pair of neighbours that have changed places. Drops the seed with most folds until
// none is left; ties drop the seed that lies farther from the surface, then the first one. Returns
// the number of dropped seeds.
int DropFolds(const Patches& patches, std::vector<Seed>& seeds) {
  for (int dropped = 0;; ++dropped) {
    std::pair<int, double> worst = {0, 0};
    Seed* culprit = nullptr;
    for (std::size_t k = 0; k < seeds.size(); ++k) {
      const int index = static_cast<int>(k);
      const int count = CountReversed(seeds, patches, index % patches.u, index / patches.u);
      if (count == 0) {
        continue;
      }
      const std::pair<int, double> badness = {count,
                                              (*seeds[k].on_mesh - seeds[k].on_surface).norm()};
      if (culprit == nullptr || badness > worst) {
        worst = badness;
        culprit = &seeds[k];
      }
    }
    if (culprit == nullptr) {
      return dropped;
    }
    culprit->on_mesh.reset();
  }
}

}  // namespace

SeedResult SeedDowels(const HSplineSurface& placed, const MeshQuery& implicit,
                      const TriMesh& implicit_mesh, std::span<const Sphere> masks,
                      const SeedOptions& options) {
  CheckOptions(options, placed.shape().max_level);
  CheckMasks(masks);
  const Patches patches{.u = placed.shape().PatchesU(options.level),
                        .v = placed.shape().PatchesV(options.level),
                        .periodic_u = placed.shape().ClosedU()};
  SeedResult result{.points = {}, .masked = 0, .missed = 0, .folded = 0};
  const Seeder seeder(implicit, implicit_mesh, options);
  std::vector<Seed> seeds = FindSeeds(placed, seeder, patches, masks, options, result);
  result.folded = DropFolds(patches, seeds);
  for (std::size_t k = 0; k < seeds.size(); ++k) {
    const int i = static_cast<int>(k) % patches.u, j = static_cast<int>(k) / patches.u;
    if (seeds[k].on_mesh) {
      result.points.push_back({.label = fmt::format("seed_{}_{}", i, j),
                               .position = *seeds[k].on_mesh,
                               .uv = patches.Center(i, j),
                               .weight = options.weight,
                               .role = PointRole::kSeed});
    }
  }
  return result;
}

}  // namespace semblance::fitting
