// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/pictures/site_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "problems/report/pictures/lighting.h"
#include "problems/report/pictures/pictures.h"
#include "problems/subject/phantom.h"
#include "problems/subject/propose/mean_skull.h"
#include "problems/subject/sites.h"
#include "surfaces/base/encoding.h"
#include "surfaces/base/error.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {
namespace {

constexpr int kSiteWidth = 460, kSiteHeight = 540;

void Disc(Image& image, double x, double y, double radius, const Colour& colour) {
  for (int row = static_cast<int>(y - radius) - 1; row <= static_cast<int>(y + radius) + 1; ++row) {
    for (int column = static_cast<int>(x - radius) - 1; column <= static_cast<int>(x + radius) + 1;
         ++column) {
      const double inside = radius + 0.5 - std::hypot(column + 0.5 - x, row + 0.5 - y);
      BlendPixel(image, column, row, colour, std::clamp(inside, 0.0, 1.0));
    }
  }
}

// The position of a disc in pixels, its number, and the side of the disc that shows the number.
struct Numbered {
  double x = 0, y = 0;
  bool left = false;
  int number = 0;
};

bool NumbersTouch(const Numbered& a, const Numbered& b) {
  constexpr double kWide = 20, kHigh = 13;
  return a.left == b.left && std::abs(a.x - b.x) < kWide && std::abs(a.y - b.y) < kHigh;
}

std::string MarkSvg(const Numbered& mark) {
  return fmt::format(
      "<circle cx=\"{0:.1f}\" cy=\"{1:.1f}\" r=\"4.5\" fill=\"#b3261e\" stroke=\"#fff\"/>"
      "<text x=\"{2:.1f}\" y=\"{3:.1f}\" text-anchor=\"{4}\">{5}</text>\n",
      mark.x, mark.y, mark.x + (mark.left ? -9 : 9), mark.y + 5, mark.left ? "end" : "start",
      mark.number);
}

Numbered MarkOf(const Site& site, const Vec3& point, const Camera& camera, View view) {
  const Vec3 seen = camera.view_from_world * (point - camera.centre);
  const double pixels = kSiteHeight / camera.height_mm;
  return {.x = kSiteWidth / 2.0 + pixels * seen.x(),
          .y = kSiteHeight / 2.0 - pixels * seen.y(),
          .left = view == View::kFront ? site.side != Side::kLeft : site.side == Side::kMidline,
          .number = site.number};
}

std::map<std::string, Vec3> PlacesOf(const ReferenceHead& head) {
  std::map<std::string, Vec3> places;
  for (const SitePoint& site : head.sites) {
    places[site.site] = site.point;
  }
  return places;
}

// The marks of the visible sites. A number that would touch a former one moves to the other side.
std::vector<Numbered> MarksSeenFrom(View view, const ReferenceHead& head, const Camera& camera) {
  const std::map<std::string, Vec3> places = PlacesOf(head);
  std::vector<Numbered> marks;
  for (const Site& site : StandardSites()) {
    if (view == View::kFront || site.side != Side::kRight) {
      Numbered mark = MarkOf(site, places.at(site.code), camera, view);
      mark.left ^= std::ranges::any_of(
          marks, [&](const Numbered& former) { return NumbersTouch(former, mark); });
      marks.push_back(mark);
    }
  }
  return marks;
}

// One view as a group of the drawing, its left edge at x, with a caption below.
std::string ViewSvg(View view, const char* caption, int x, const ReferenceHead& head,
                    const Box3& region, int threads) {
  const Camera camera = CameraFor(view, region, static_cast<double>(kSiteWidth) / kSiteHeight);
  const Image image = Render({{SkullObject(head.shell.mesh)}}, camera,
                             {.width = kSiteWidth, .height = kSiteHeight}, threads);
  std::string svg = fmt::format(
      "<g transform=\"translate({} 0)\">\n<image width=\"{}\" height=\"{}\" "
      "href=\"data:image/png;base64,{}\"/>\n<text x=\"{}\" y=\"{}\" "
      "text-anchor=\"middle\">{}</text>\n",
      x, kSiteWidth, kSiteHeight, Base64(EncodePng(image)), kSiteWidth / 2, kSiteHeight + 22,
      caption);
  for (const Numbered& mark : MarksSeenFrom(view, head, camera)) {
    svg += MarkSvg(mark);
  }
  return svg + "</g>\n";
}

// ---------------------------------------------------------------------------------------------
// One site at a time
// ---------------------------------------------------------------------------------------------

constexpr int kSketchWidth = 220, kSketchHeight = 260;

// A place between two standard landmarks, for a pair those on its side:
// first + share * (second - first).
struct Between {
  std::string_view landmark, first, second;
  double share;
  double behind_mm = 0, above_mm = 0;  // added
};
constexpr std::array<Between, 11> kBetween = {{{"mn", "n", "rhi", 0.5},
                                               {"ss", "rhi", "mp", 0.85},
                                               {"gn", "pg", "me", 0.5},
                                               {"ac", "mp", "mio", 0.5},
                                               {"sC", "mp", "sM2", 0.55},
                                               {"iC", "id", "iM2", 0.5},
                                               {"mmb", "me", "go", 0.5},
                                               {"ut", "lo", "lo", 0, 45, 45},
                                               {"tf", "lo", "lo", 0, 15, 42},
                                               {"ma", "zy", "mr", 0.5, -5, 0},
                                               {"pa", "sgl", "go", 0.5}}};

std::string OnSideOf(const Site& site, std::string_view landmark) {
  const auto known = std::ranges::find(StandardSites(), landmark, &Site::landmark);
  return known->side == Side::kMidline
             ? std::string(landmark)
             : fmt::format("{}_{}", landmark, site.side == Side::kLeft ? "l" : "r");
}

// The point near the midline with the largest value of `far`.
template <class Far>
Vec3 FarthestInMidline(const TriMesh& skull, const Far& far) {
  constexpr double kNear_mm = 3;
  Vec3 best = Vec3::Zero();
  double most = -std::numeric_limits<double>::infinity();
  for (const Vec3& p : skull.points) {
    if (std::abs(p.x()) < kNear_mm && far(p) > most) {
      best = p;
      most = far(p);
    }
  }
  return best;
}

// Vertex and opisthocranion. The mean skull is cut below the one and before the other, so they are
// marked where the brain case of a phantom over the same nasion has them.
std::map<std::string, Vec3> VaultPlaces(const Vec3& nasion) {
  const Phantom phantom = MakePhantom({.random_seed = 1, .rings = 40});
  const auto place = [&](std::string_view code) {
    return std::ranges::find(phantom.sites, code, &PhantomSite::site)->base;
  };
  const Vec3 g = place("g"), shift = nasion - place("n");
  const Vec3 v = FarthestInMidline(phantom.skull, [](const Vec3& p) { return p.z(); });
  const Vec3 op = FarthestInMidline(phantom.skull, [&](const Vec3& p) { return (p - g).norm(); });
  return {{"v", v + shift}, {"op", op + shift}};
}

Vec3 PlaceOf(const Site& site, const MeshQuery& query,
             const std::map<std::string, Vec3>& standard) {
  const auto* const between = std::ranges::find(kBetween, site.landmark, &Between::landmark);
  if (between == kBetween.end()) {
    throw InputError(fmt::format("sites: no picture has a place for {}; write one", site.code));
  }
  const Vec3 a = standard.at(OnSideOf(site, between->first)),
             b = standard.at(OnSideOf(site, between->second));
  const Vec3 added(0, between->behind_mm, between->above_mm);
  return query.Closest(a + between->share * (b - a) + added).position;
}

// The places of the standard sites and of the further ones.
std::map<std::string, Vec3> AllPlaces(const ReferenceHead& head, const MeshQuery& query) {
  const std::map<std::string, Vec3> standard = PlacesOf(head);
  std::map<std::string, Vec3> places = standard;
  places.merge(VaultPlaces(standard.at("n")));
  for (const Site& site : FurtherSites()) {
    if (!places.contains(site.code)) {
      places[site.code] = PlaceOf(site, query, standard);
    }
  }
  return places;
}

// The camera from the right: the left one turned by 180 degrees, because CameraFor has no right
// side.
Camera FromItsRight(Camera camera) {
  camera.view_from_world.row(0) *= -1;
  camera.view_from_world.row(2) *= -1;
  return camera;
}

bool IsHidden(const MeshQuery& bone, const Camera& camera, const Vec3& place) {
  constexpr double kAbove_mm = 2, kFar_mm = 1000;
  const Vec3 towards = camera.view_from_world.row(2);
  return bone.FirstHit(place + kAbove_mm * towards, towards, kFar_mm).has_value();
}

// Draws a disc with a white rim; hollow if bone hides the place.
void Spot(Image& image, const SiteSketch::Seen& seen, const Vec3& place, double radius,
          std::uint32_t colour, bool hollow) {
  const Vec3 at = seen.camera.view_from_world * (place - seen.camera.centre);
  const double pixels = kSketchHeight / seen.camera.height_mm;
  const double x = kSketchWidth / 2.0 + pixels * at.x(), y = kSketchHeight / 2.0 - pixels * at.y();
  Disc(image, x, y, radius + 1.5, HexColour(0xffffff));
  Disc(image, x, y, radius, HexColour(colour));
  if (hollow) {
    Disc(image, x, y, 0.55 * radius, HexColour(0xffffff));
  }
}

Image Marked(const SiteSketch& sketch, const SiteSketch::Seen& seen, const Site& site,
             bool from_its_side) {
  Image image = seen.bone;
  for (const Site& other : StandardSites()) {
    const bool is_seen = !from_its_side || other.side == Side::kMidline || other.side == site.side;
    if (is_seen && other.code != site.code && !seen.hides.at(other.code)) {
      Spot(image, seen, sketch.places.at(other.code), 2.5, 0x6f7883, /*hollow=*/false);
    }
  }
  Spot(image, seen, sketch.places.at(site.code), 9, 0xb3261e, seen.hides.at(site.code));
  return image;
}

const Site& KnownSite(std::string_view code) {
  if (const Site* const site = FindSite(code); site != nullptr) {
    return *site;
  }
  throw InputError(SiteFault(code));
}

}  // namespace

std::string SitePictureSvg(int threads) {
  constexpr int kGap = 16;
  const ReferenceHead head = ReadMeanSkull().head;
  Box3 region = Bounds(head.shell.mesh);
  region.extend(Vec3(region.min() - Vec3(0, 15, 0)));  // room for the numbers before the face
  return fmt::format(
             "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" "
             "height=\"{1}\" font-family=\"system-ui, sans-serif\" font-size=\"14\" "
             "fill=\"#16304f\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
             2 * kSiteWidth + kGap, kSiteHeight + 34) +
         ViewSvg(View::kFront, "front", 0, head, region, threads) +
         ViewSvg(View::kSide, "left side", kSiteWidth + kGap, head, region, threads) + "</svg>\n";
}

SiteSketch MakeSiteSketch(int threads) {
  const ReferenceHead head = ReadMeanSkull().head;
  const MeshQuery bone(head.shell.mesh);
  SiteSketch sketch{.places = AllPlaces(head, bone), .seen = {}};
  const Vec3 room_mm = Vec3::Constant(8);  // for the discs of vertex and opisthocranion
  Box3 region = Bounds(head.shell.mesh);
  for (const auto& [site, place] : sketch.places) {
    region.extend(Vec3(place - room_mm));
    region.extend(Vec3(place + room_mm));
  }
  constexpr double kAspect = static_cast<double>(kSketchWidth) / kSketchHeight;
  std::vector<Camera> cameras = CamerasFor(std::array{View::kFront, View::kSide}, region, kAspect);
  cameras.push_back(FromItsRight(cameras.back()));
  ShadowMaps shadows;
  std::vector<Image> images =
      RenderAll({{SkullObject(head.shell.mesh)}}, cameras,
                {.width = kSketchWidth, .height = kSketchHeight}, shadows, threads);
  for (std::size_t k = 0; k < cameras.size(); ++k) {
    sketch.seen[k] = {cameras[k], std::move(images[k]), {}};
    for (const auto& [site, place] : sketch.places) {
      sketch.seen[k].hides[site] = IsHidden(bone, cameras[k], place);
    }
  }
  return sketch;
}

Image DrawSitePicture(const SiteSketch& sketch, std::string_view code) {
  const Site& site = KnownSite(code);
  Image both = MakeImage(2 * kSketchWidth, kSketchHeight, HexColour(0xffffff));
  Paste(both, Marked(sketch, sketch.seen[0], site, /*from_its_side=*/false), 0, 0);
  Paste(both,
        Marked(sketch, sketch.seen[site.side == Side::kRight ? 2 : 1], site,
               /*from_its_side=*/true),
        kSketchWidth, 0);
  return both;
}

}  // namespace semblance::problems
