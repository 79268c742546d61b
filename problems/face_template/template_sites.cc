// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face_template/template_sites.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <iterator>
#include <limits>
#include <string_view>

#include "problems/face_template/head_formula.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

// Where the soft-tissue point of a landmark lies on an average adult; of a pair, on the left.
struct SkinSite {
  std::string_view code;  // without side, as Site::landmark
  Vec3 near_skin;         // of HeadPoint, mm
};

// Heights and widths after the definitions of the sites on the skull, moved out to the skin along
// the direction in which the dowel of the site stands.
const SkinSite kAverageSkin[] = {
    {"sg", {0, 0, 25}},       // the shallow above glabella
    {"g", {0, -2, 13}},       // most forward point of the brow
    {"n", {0, 1, 1}},         // the root of the nose
    {"rhi", {0, -10, -16}},   // the bony end of the bridge
    {"mp", {0, -6, -60}},     // the middle of the philtrum
    {"pr", {0, -11, -69.5}},  // the middle of the upper lip
    {"id", {0, -7, -85}},     // the middle of the lower lip
    {"sm", {0, 4, -94}},      // the deepest of the chin-lip fold
    {"pg", {0, 1, -107}},     // most forward point of the chin
    {"me", {0, 19, -121}},    // the underside of the chin; its dowel points down
    {"fe", {34, 14, 47}},     // the forehead's fullest, over the middle of the brow
    {"mso", {31, 8, 12}},     // the brow over the middle of the orbit
    {"mio", {35, 9, -26}},    // below the middle of the orbit, on its rim
    {"im", {42, 10, -45}},    // the lower border of the cheek bone, below mio
    {"lo", {50, 14, -37}},    // below the lateral margin of the orbit, 10 mm under its floor
    {"zy", {71, 62, -30}},    // halfway along the zygomatic arch
    {"sgl", {72, 83, -29}},   // the root of the arch, before and above the ear opening
    {"go", {61, 74, -84}},    // the angle of the jaw
    {"sM2", {57, 39, -58}},   // the cheek over the second upper molar
    {"mr", {65, 58, -70}},    // the ramus at the height of the mouth
    {"iM2", {51, 33, -82}},   // the cheek over the second lower molar
};

// On the formula's own features; of a pair, on the left.
const SkinSite kFacialLandmarks[] = {
    {"prn", {0, -45, -44}},   // from far in front: the tip itself
    {"sn", {0, -7, -54.5}},   // where the septum meets the philtrum
    {"sbal", {12, -8, -52}},  // under the wing
    {"en", {18, 11, -7}},     // ends of the line between the lids
    {"ex", {45, 25, -6}},     //
    {"ch", {26, 6, -75.5}},   //
    {"ls", {0, -8, -66}},     // borders of the lips, and the line between them
    {"sto", {0, -6, -74.5}},  //
    {"li", {0, -6, -85}},     //
};

const Vec3& NearSkin(const Site& site) {
  const auto* const found = std::ranges::find(kAverageSkin, site.landmark, &SkinSite::code);
  assert(found != std::end(kAverageSkin));
  return found->near_skin;
}

double DistanceSquared(const Vec2& uv, const Vec3& near_skin) {
  return (HeadPoint(uv.x(), uv.y()) - near_skin).squaredNorm();
}

// The closest point of the left half (u from 0.5) or of the midline (`last_u` = 0.5).
Vec2 ClosestOnGrid(const Vec3& near_skin, double last_u) {
  constexpr int kSteps = 60;
  double least = std::numeric_limits<double>::infinity();
  Vec2 best = Vec2::Constant(kNaN);
  for (int j = 0; j <= 2 * kSteps; ++j) {
    for (int i = 0; i <= (last_u > 0.5 ? kSteps : 0); ++i) {
      const Vec2 uv(0.5 + (last_u - 0.5) * i / kSteps, j / (2.0 * kSteps));
      if (const double d = DistanceSquared(uv, near_skin); d < least) {
        least = d;
        best = uv;
      }
    }
  }
  return best;
}

// Pattern search from the grid's best: halve the step when no neighbour is closer.
Vec2 Closest(const Vec3& near_skin, double last_u) {
  Vec2 best = ClosestOnGrid(near_skin, last_u);
  double least = DistanceSquared(best, near_skin);
  for (double step = 0.5 / 60; step > 1e-9;) {
    const double u_step = last_u > 0.5 ? step : 0;
    const Vec2 start = best;
    for (const Vec2& d : {Vec2(u_step, 0), Vec2(-u_step, 0), Vec2(0, step), Vec2(0, -step)}) {
      const Vec2 uv = (start + d).cwiseMax(Vec2(0.5, 0)).cwiseMin(Vec2(last_u, 1));
      if (const double distance = DistanceSquared(uv, near_skin); distance < least) {
        least = distance;
        best = uv;
      }
    }
    step = best == start ? step / 2 : step;
  }
  return best;
}

}  // namespace

std::map<std::string, Vec2> TemplateSites() {
  std::map<std::string, Vec2> sites;
  for (const Site& site : StandardSites()) {
    if (site.side == Side::kRight) {
      const Vec2& left = sites.at(site.mirror);
      sites[site.code] = Vec2(1 - left.x(), left.y());
    } else {
      sites[site.code] = Closest(NearSkin(site), site.side == Side::kMidline ? 0.5 : 1);
    }
  }
  return sites;
}

std::map<std::string, Vec2> FacialLandmarks() {
  std::map<std::string, Vec2> landmarks;
  for (const SkinSite& place : kFacialLandmarks) {
    const std::string code(place.code);
    if (place.near_skin.x() == 0) {
      landmarks[code] = Closest(place.near_skin, 0.5);
    } else {
      const Vec2 left = Closest(place.near_skin, 1);
      landmarks[code + "_l"] = left;
      landmarks[code + "_r"] = Vec2(1 - left.x(), left.y());
    }
  }
  return landmarks;
}

std::vector<std::string> FacialLandmarkCodes() {
  std::vector<std::string> codes;
  for (const SkinSite& place : kFacialLandmarks) {
    const std::string code(place.code);
    const bool midline = place.near_skin.x() == 0;
    codes.push_back(midline ? code : code + "_l");
    if (!midline) {
      codes.push_back(code + "_r");
    }
  }
  return codes;
}

Vec2 UvOnGenericHead(const std::string& code) {
  static const std::map<std::string, Vec2> places = [] {
    std::map<std::string, Vec2> all = TemplateSites();
    all.merge(FacialLandmarks());
    return all;
  }();
  const auto found = places.find(code);
  if (found == places.end()) {
    throw InputError(fmt::format("landmark '{}' is not known on the generic head", code));
  }
  return found->second;
}

}  // namespace semblance
