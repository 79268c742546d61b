// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/phantom.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <iterator>
#include <numbers>
#include <optional>
#include <string_view>

#include "problems/subject/phantom_shape.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {
namespace {

// Bone and tissue of an average head at a landmark; the left one of a pair.
struct PhantomLandmark {
  std::string_view code;  // Site::landmark
  Vec3 near_bone;         // mm; the ray from the centre through it meets the landmark
  double depth_mm;        // tissue depth of an average adult
};

const PhantomLandmark kAverageHead[] = {
    {"sg", {0, 2, 32}, 4.3},    {"g", {0, -3, 11}, 5.3},     {"n", {0, 0, 0}, 6.5},
    {"rhi", {0, -10, -21}, 4},  {"mp", {0, -5, -58}, 10},    {"pr", {0, -8, -69}, 10},
    {"id", {0, -5, -86}, 11},   {"sm", {0, -1, -96}, 11},    {"pg", {0, -4, -107}, 11},
    {"me", {0, 8, -118}, 7.5},  {"fe", {30, 10, 44}, 4.5},   {"mso", {27, 3, 13}, 7},
    {"mio", {32, 8, -28}, 7},   {"im", {40, 17, -46}, 12},   {"lo", {50, 22, -28}, 10},
    {"zy", {66, 58, -26}, 8},   {"sgl", {66, 82, -20}, 8.5}, {"go", {50, 70, -85}, 11.5},
    {"sM2", {37, 28, -62}, 15}, {"mr", {50, 56, -60}, 14},   {"iM2", {36, 32, -88}, 14},
};
constexpr double kVaultDepth_mm = 5;
constexpr double kBlendWidth = 0.27;  // radians; a larger one blends the depths of sites more

struct DirectionAnchor {
  Vec3 direction;
  double depth_mm;
};

class DepthFormula {
 public:
  explicit DepthFormula(Random& random);
  double At(const Vec3& direction) const;  // mm, > 0
  double Thickness() const { return subject_; }

 private:
  std::vector<DirectionAnchor> anchors_;
  double subject_;
  WaveSum waves_;
};

const PhantomLandmark& AverageAt(const Site& site) {
  const auto* const found = std::ranges::find(kAverageHead, site.landmark, &PhantomLandmark::code);
  assert(found != std::end(kAverageHead));
  return *found;
}

Vec3 SiteDirection(const Site& site) {
  const Vec3& left = AverageAt(site).near_bone;
  const double side = site.side == Side::kRight ? -1 : 1;
  return PhantomDirection({side * left.x(), left.y(), left.z()});
}

std::vector<DirectionAnchor> SiteAnchors() {
  std::vector<DirectionAnchor> anchors;
  for (const Site& site : StandardSites()) {
    anchors.push_back({SiteDirection(site), AverageAt(site).depth_mm});
  }
  return anchors;
}

// Points spread evenly over the sphere (a Fibonacci lattice) and far from every site keep the vault
// at its depth.
std::vector<DirectionAnchor> VaultAnchors(const std::vector<DirectionAnchor>& sites) {
  constexpr int kPoints = 200;
  const double far = std::cos(35 * std::numbers::pi / 180);
  std::vector<DirectionAnchor> anchors;
  for (int i = 0; i < kPoints; ++i) {
    const double z = 1 - (2 * i + 1.0) / kPoints;
    const double azimuth = i * std::numbers::pi * (3 - std::sqrt(5.0));
    const double s = std::sqrt(1 - z * z);
    const Vec3 d(s * std::cos(azimuth), s * std::sin(azimuth), z);
    if (std::ranges::all_of(sites,
                            [&](const DirectionAnchor& a) { return a.direction.dot(d) < far; })) {
      anchors.push_back({d, kVaultDepth_mm});
    }
  }
  return anchors;
}

DepthFormula::DepthFormula(Random& random)
    : anchors_(SiteAnchors()),
      subject_(std::clamp(1 + 0.08 * random.BoundedNormal(), 0.84, 1.16)),
      waves_(DrawWaves(random)) {
  const std::vector<DirectionAnchor> vault = VaultAnchors(anchors_);
  anchors_.insert(anchors_.end(), vault.begin(), vault.end());
}

double DepthFormula::At(const Vec3& direction) const {
  constexpr double kWaveShare = 0.05;  // random variation of depth; rms about 0.7 of it
  double sum = 0, weights = 0;
  for (const DirectionAnchor& a : anchors_) {
    const double weight = std::exp((a.direction.dot(direction) - 1) / (kBlendWidth * kBlendWidth));
    sum += weight * a.depth_mm;
    weights += weight;
  }
  return subject_ * (1 + kWaveShare * waves_.Value(direction)) * sum / weights;
}

// Ring k of n has 6 min(k, n - k) directions, so that triangles have about the same size
// everywhere.
int RingSize(int ring, int rings) { return std::max(1, 6 * std::min(ring, rings - ring)); }

// The polar angle, 0..pi, of the ring at `share`, 0..1. Rings are densest at the height of the
// chin, where the bone curves most.
double PolarAngle(double share) {
  constexpr double kCrowding = 0.25, kClosest = 0.74, kTurn = 2 * std::numbers::pi;
  const double wave = std::sin(kTurn * (share - kClosest)) + std::sin(kTurn * kClosest);
  return std::numbers::pi * (share - kCrowding / kTurn * wave);
}

std::vector<Vec3> RingDirections(int rings) {
  std::vector<Vec3> directions;
  for (int k = 0; k <= rings; ++k) {
    const double theta = PolarAngle(static_cast<double>(k) / rings);
    const int size = RingSize(k, rings);
    for (int i = 0; i < size; ++i) {
      const double phi = 2 * std::numbers::pi * i / size;
      directions.emplace_back(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi),
                              std::cos(theta));
    }
  }
  return directions;
}

// Joins two rings by triangles. Each step advances on the ring whose next point comes first round
// the axis.
void JoinRings(int upper_first, int upper_size, int lower_first, int lower_size,
               std::vector<Triangle>& triangles) {
  const int upper_steps = upper_size > 1 ? upper_size : 0;
  const int lower_steps = lower_size > 1 ? lower_size : 0;
  int u = 0, l = 0;
  while (u < upper_steps || l < lower_steps) {
    const std::int32_t a = upper_first + u % upper_size, b = lower_first + l % lower_size;
    const bool lower_next = u == upper_steps || (l < lower_steps && (2 * l + 1) * upper_size <=
                                                                        (2 * u + 1) * lower_size);
    if (lower_next) {
      triangles.push_back({a, b, lower_first + ++l % lower_size});
    } else {
      triangles.push_back({a, b, upper_first + ++u % upper_size});
    }
  }
}

std::vector<Triangle> RingTriangles(int rings) {
  std::vector<Triangle> triangles;
  int first = 0;
  for (int k = 0; k < rings; ++k) {
    const int size = RingSize(k, rings);
    JoinRings(first, size, first + size, RingSize(k + 1, rings), triangles);
    first += size;
  }
  return triangles;
}

class Head {
 public:
  explicit Head(const PhantomOptions& options)
      : random_(options.random_seed), shape_(random_), depth_(random_) {
    if (options.bone == PhantomBone::kLikePeople) {
      relief_.emplace(random_);
    }
    const Vec3 nasion = PhantomDirection(Vec3::Zero());
    centre_ = -(relief_ ? RoughRadius(nasion) : shape_.Radius(nasion)) * nasion;
  }
  const Vec3& Centre() const { return centre_; }
  double Thickness() const { return depth_.Thickness() * (relief_ ? relief_->Weight() : 1); }
  bool IsSmooth() const { return !relief_; }

  // The point on the smooth bone; the skin is laid from it along the normals.
  PhantomSite Smooth(std::string site, const Vec3& direction) const {
    return {std::move(site), centre_ + shape_.Radius(direction) * direction,
            shape_.Normal(direction), depth_.At(direction)};
  }
  Vec3 RoughBone(const Vec3& direction) const {
    return centre_ + RoughRadius(direction) * direction;
  }
  // The point on the rough bone, with the normal of the plane through points 3 mm away on four
  // sides, because a person who places a landmark looks at the bone around it. The depth is still
  // NaN.
  PhantomSite Rough(std::string site, const Vec3& direction) const {
    const double step = 3 / RoughRadius(direction);
    const auto bone = [&](const Vec3& aside) {
      return RoughBone((direction + aside).normalized());
    };
    const Vec3 along = step * direction.unitOrthogonal(), across = direction.cross(along);
    const Vec3 normal =
        (bone(along) - bone(-along)).cross(bone(across) - bone(-across)).normalized();
    return {std::move(site), RoughBone(direction), normal, kNaN};
  }

 private:
  double RoughRadius(const Vec3& direction) const {
    const double smooth_mm = depth_.At(direction);
    return shape_.Radius(direction) + smooth_mm - relief_->Thickness(direction, smooth_mm);
  }

  Random random_;
  PhantomShape shape_;
  DepthFormula depth_;
  std::optional<PhantomRelief> relief_;
  Vec3 centre_;
};

std::vector<PhantomSite> SitesOn(const Head& head) {
  std::vector<PhantomSite> sites;
  for (const Site& site : StandardSites()) {
    const Vec3 direction = SiteDirection(site);
    sites.push_back(head.IsSmooth() ? head.Smooth(site.code, direction)
                                    : head.Rough(site.code, direction));
  }
  return sites;
}

// Measures the depths of rough bone: the distance along each normal to the skin.
void MeasureDepths(Phantom& phantom) {
  const MeshQuery skin(phantom.face);
  const auto depth_mm = [&](const Vec3& base, const Vec3& normal) {
    constexpr double kReach_mm = 400;  // longer than a head, so that every ray leaves the skin
    const std::optional<MeshPoint> hit = skin.FirstHit(base, normal, kReach_mm);
    if (!hit) {
      throw InputError("phantom: the bone protrudes through the skin; give it more rings");
    }
    return hit->distance_mm;
  };
  const std::vector<Vec3> normals = VertexNormals(phantom.skull);
  for (std::size_t v = 0; v < normals.size(); ++v) {
    phantom.depth_mm[v] = depth_mm(phantom.skull.points[v], normals[v]);
  }
  for (PhantomSite& site : phantom.sites) {
    site.depth_mm = depth_mm(site.base, site.normal);
  }
}

}  // namespace

std::string RingsFault(const PhantomOptions& options) {
  const bool rough = options.bone == PhantomBone::kLikePeople;
  const int least = rough ? 30 : 8;
  return options.rings >= least && options.rings <= 1000
             ? ""
             : fmt::format("{} is too {}, allowed is {} to 1000{}; choose a number in that range",
                           options.rings, options.rings < least ? "few" : "many", least,
                           rough ? " with bone: like_people" : "");
}

Phantom MakePhantom(const PhantomOptions& options) {
  if (const std::string fault = RingsFault(options); !fault.empty()) {
    throw InputError("phantom: rings: " + fault);
  }
  const Head head(options);
  Phantom phantom;
  phantom.centre = head.Centre();
  phantom.thickness = head.Thickness();
  phantom.skull.triangles = RingTriangles(options.rings);
  phantom.face.triangles = phantom.skull.triangles;
  for (const Vec3& direction : RingDirections(options.rings)) {
    const PhantomSite p = head.Smooth({}, direction);
    phantom.skull.points.push_back(head.IsSmooth() ? p.base : head.RoughBone(direction));
    phantom.depth_mm.push_back(p.depth_mm);
    phantom.face.points.push_back(p.base + p.depth_mm * p.normal);
  }
  phantom.sites = SitesOn(head);
  if (!head.IsSmooth()) {
    MeasureDepths(phantom);
  }
  return phantom;
}

LandmarkFile PhantomLandmarks(std::span<const PhantomSite> sites, std::uint64_t random_seed) {
  LandmarkFile file;
  file.subject = fmt::format("phantom {}", random_seed);
  for (const PhantomSite& site : sites) {
    Landmark landmark;
    landmark.site = site.site;
    landmark.MoveTo(site.base);
    landmark.normal = {site.normal.x(), site.normal.y(), site.normal.z()};
    landmark.depth_along_normal_mm = site.depth_mm;
    file.landmarks.push_back(landmark);
  }
  return file;
}

}  // namespace semblance::problems
