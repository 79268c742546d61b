// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/propose/site_rules.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "interp/dowels/dowel.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

// +x is left, +y back, +z up. A rule without direction leaves the site to the references, because
// its definition names no extremum, or one along the bone (midway, over a tooth, 10 mm below the
// rim). The reach trades off: a larger one finds an extremum farther from the prediction, a smaller
// one trusts the prediction more.
const std::array kRules = {
    SiteRule{"sg", {0, 0, 0}, 0, 0, "closest bone: the hollow above glabella is too shallow"},
    SiteRule{"g", {0, -1, 0}, 8, 0, "most anterior"},
    SiteRule{"n", {0, 1, 0}, 6, 0, "most posterior between brow and nasal bones"},
    SiteRule{"rhi", {0, -0.7, -0.7}, 4, 1.5, "lower end of the nasal bones"},
    SiteRule{"mp", {0, 0, 0}, 0, 0, "closest bone: midway along the maxilla"},
    SiteRule{"pr", {0, 0, 0}, 0, 0, "closest bone: rim between the teeth"},
    SiteRule{"id", {0, 0, 0}, 0, 0, "closest bone: rim between the teeth"},
    SiteRule{"sm", {0, 1, 0}, 6, 0, "most posterior between teeth and chin"},
    SiteRule{"pg", {0, -1, 0}, 8, 0, "most anterior"},
    SiteRule{"me", {0, 0, -1}, 8, 0, "lowest"},
    SiteRule{"fe", {0, 0, 0}, 0, 0, "closest bone: fullest part of the forehead"},
    SiteRule{"mso", {0, 0, 0}, 0, 0, "closest bone: above the middle of the rim"},
    SiteRule{"mio", {0, 0, 0}, 0, 0, "closest bone: front of the rim's lowest part"},
    SiteRule{"im", {0, 0, 0}, 0, 0, "closest bone: cheek bone above its lower border"},
    SiteRule{"lo", {0, 0, 0}, 0, 0, "closest bone: 10 mm below the rim"},
    SiteRule{"zy", {1, 0, 0}, 10, 0, "most lateral"},
    SiteRule{"sgl", {1, 0, 0}, 4, 0, "crest of the arch's posterior root"},
    SiteRule{"go", {0.2, 0.7, -0.7}, 8, 3, "3 mm in from the outline, back and down"},
    SiteRule{"sM2", {0, 0, 0}, 0, 0, "closest bone: over the second molar"},
    SiteRule{"mr", {0, 0, 0}, 0, 0, "closest bone: middle of the ramus"},
    SiteRule{"iM2", {0, 0, 0}, 0, 0, "closest bone: below the second molar"},
};

constexpr double kHalfMidline_mm = 1.5;  // half the width of the strip of bone in the midline

// A rule applied to one skull at one predicted point.
struct ExtremumSearch {
  const SkullShell& skull;
  Vec3 predicted, normal;  // point and normal of the shell
  Vec3 along, left;        // unit
  double reach_mm;
  bool midline;

  double Score(const Vec3& p) const {
    const Vec3 d = p - predicted;
    return along.dot(d) - d.squaredNorm() / (2 * reach_mm);
  }
  bool Counts(std::size_t v) const {
    constexpr double kMinCosine = 0.3;  // 72 degrees
    const Vec3 d = skull.mesh.points[v] - predicted;
    return d.norm() <= 1.5 * reach_mm &&
           skull.surface.vertex_normals()[v].dot(normal) > kMinCosine &&
           (!midline || std::abs(left.dot(d)) <= kHalfMidline_mm);
  }
};

ExtremumSearch MakeSearch(const SiteRule& rule, std::string_view site, const ShellPoint& predicted,
                          const SkullShell& skull, const Mat3& skull_from_average) {
  Vec3 along = rule.direction;
  const Side side = SideOfSite(site);
  if (side == Side::kRight) {
    along.x() = -along.x();
  }
  return {.skull = skull,
          .predicted = predicted.position,
          .normal = predicted.normal,
          .along = (skull_from_average * along).normalized(),
          .left = skull_from_average.col(0),
          .reach_mm = rule.reach_mm,
          .midline = side == Side::kMidline};
}

// The vertex with the best score; nothing if no bone counts.
std::optional<std::size_t> FindExtremum(const ExtremumSearch& search) {
  std::optional<std::size_t> best;
  double most = -std::numeric_limits<double>::infinity();
  for (std::size_t v = 0; v < search.skull.mesh.points.size(); ++v) {
    if (const double score = search.Score(search.skull.mesh.points[v]);
        search.Counts(v) && score > most) {
      most = score;
      best = v;
    }
  }
  return best;
}

double Sharpness_mm(const ExtremumSearch& search, std::size_t best) {
  constexpr double kAsFar_mm = 0.25;  // bone within this of the extremum counts as equally far
  const Vec3& top = search.skull.mesh.points[best];
  double squares = 0;
  int count = 0;
  for (std::size_t v = 0; v < search.skull.mesh.points.size(); ++v) {
    const Vec3& p = search.skull.mesh.points[v];
    if (search.Counts(v) && search.along.dot(top - p) <= kAsFar_mm) {
      squares += (p - top).squaredNorm();
      ++count;
    }
  }
  return count > 0 ? std::sqrt(squares / count) : 0;
}

}  // namespace

const SiteRule& FindSiteRule(std::string_view site) {
  const auto* const found = std::ranges::find(kRules, WithoutSide(site), &SiteRule::landmark);
  if (found == kRules.end()) {
    throw InputError(fmt::format("site rules: {}", StandardSiteFault(site)));
  }
  return *found;
}

SnappedSite SnapToBone(std::string_view site, const Vec3& predicted, const SkullShell& skull,
                       const Mat3& skull_from_average) {
  const SiteRule& rule = FindSiteRule(site);
  const MeshPoint closest = skull.surface.query().Closest(predicted);
  SnappedSite snapped{.point = closest.position,
                      .from_bone_mm = closest.distance_mm,
                      .moved_mm = closest.distance_mm,
                      .sharpness_mm = 0};
  if (rule.reach_mm > 0) {
    const ShellPoint on_shell{closest.position, skull.surface.NormalAt(closest)};
    const ExtremumSearch search = MakeSearch(rule, site, on_shell, skull, skull_from_average);
    if (const auto best = FindExtremum(search)) {
      const Vec3 inside = skull.mesh.points[*best] - rule.inset_mm * search.along;
      snapped.point = skull.surface.query().Closest(inside).position;
      snapped.sharpness_mm = Sharpness_mm(search, *best);
      snapped.moved_mm = (snapped.point - predicted).norm();
    }
  }
  return snapped;
}

}  // namespace semblance::problems
