// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/pictures/render.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>
#include <vector>

#include "problems/report/pictures/lighting.h"
#include "problems/report/pictures/pictures.h"
#include "problems/report/pictures/raster.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "surfaces/mesh/mesh_primitives.h"
#include "surfaces/mesh_files/srgb.h"
#include "tests/testing/pixels.h"
#include "tests/testing/shapes.h"

namespace semblance::problems {
namespace {

using testing::PixelAt;

constexpr Colour kBlack = {0, 0, 0};

RenderOptions Plain(Lighting lighting = Lighting::kEven) {
  return {.width = 120,
          .height = 120,
          .supersampling = 4,
          .lighting = lighting,
          .background_top = kBlack,
          .background_bottom = kBlack};
}

Camera FrontCamera(double height_mm) {
  Camera camera = CameraFor(View::kFront, Box3(Vec3(-1, -1, -1), Vec3(1, 1, 1)), 1);
  camera.height_mm = height_mm;
  return camera;
}

// A square that faces -y, at the given y, centred on the y axis.
SceneObject Square(double half_mm, double y, const Colour& colour, double opacity = 1) {
  TriMesh mesh;
  mesh.points = {{-half_mm, y, -half_mm},
                 {half_mm, y, -half_mm},
                 {half_mm, y, half_mm},
                 {-half_mm, y, half_mm}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return {.mesh = std::move(mesh),
          .material = MatteMaterial(),
          .vertex_colours = std::vector<Colour>(4, colour),
          .opacity = opacity};
}

void ExpectColour(const Colour& a, const Colour& b, double tolerance = 1.01 / 255) {
  EXPECT_NEAR(a.r, b.r, tolerance);
  EXPECT_NEAR(a.g, b.g, tolerance);
  EXPECT_NEAR(a.b, b.b, tolerance);
}

Colour Centre(const Image& image) { return PixelAt(image, image.width / 2, image.height / 2); }

// A crowded scene with a transparent layer.
Scene Crowd() {
  Scene scene;
  Random random(7);
  for (int i = 0; i < 12; ++i) {
    scene.objects.push_back(SkullObject(MakeSphere(random.InBox(-30, 30), 6, 10)));
  }
  scene.objects.push_back(SkinObject(MakeSphere(Vec3::Zero(), 42, 24), 0.4));
  return scene;
}

TEST(Render, SameBytesForAnyNumberOfThreadsAndEachTime) {
  const Camera camera =
      CameraFor(View::kThreeQuarter, Box3(Vec3(-42, -42, -42), Vec3(42, 42, 42)), 1);
  RenderOptions options{.width = 150, .height = 131};
  const std::string one = EncodePng(Render(Crowd(), camera, options, 1));
  for (const int threads : {1, 2, 3, 8}) {
    EXPECT_EQ(one, EncodePng(Render(Crowd(), camera, options, threads))) << threads;
  }
}

TEST(Render, RenderAllAgreesWithRenderForEachCameraAndLighting) {
  std::vector<Camera> cameras;
  for (const View view : {View::kFront, View::kThreeQuarter, View::kSide}) {
    cameras.push_back(CameraFor(view, Box3(Vec3(-42, -42, -42), Vec3(42, 42, 42)), 1));
  }
  ShadowMaps shadows;
  for (const Lighting lighting : {Lighting::kStudio, Lighting::kEven}) {
    const RenderOptions options{.width = 90, .height = 80, .lighting = lighting};
    const std::vector<Image> all = RenderAll(Crowd(), cameras, options, shadows, 2);
    ASSERT_EQ(all.size(), cameras.size());
    for (std::size_t n = 0; n < cameras.size(); ++n) {
      EXPECT_EQ(all[n].rgb, Render(Crowd(), cameras[n], options, 1).rgb);
    }
  }
}

// Light is interpolated between vertices, so a coarse shadow map suffices.
TEST(Render, FewVerticesNeedFewTexels) {
  const Camera camera = CameraFor(View::kFront, Box3(Vec3(-42, -42, -42), Vec3(42, 42, 42)), 1);
  const RenderOptions options{.width = 90, .height = 80};
  ShadowMaps fine, coarse;
  coarse.texels = fine.texels / 2;
  const Image few = RenderAll(Crowd(), {&camera, 1}, options, coarse, 1).front();
  const Image many = RenderAll(Crowd(), {&camera, 1}, options, fine, 1).front();
  double sum = 0;
  for (std::size_t k = 0; k < few.rgb.size(); ++k) {
    sum += std::abs(few.rgb[k] - many.rgb[k]);
  }
  EXPECT_LT(sum / static_cast<double>(few.rgb.size()), 1);
}

// Every look gives the bytes of a scene of its own, whichever look comes before it.
TEST(Render, LooksAgreeWithScenesOfTheirOwn) {
  Scene scene = Crowd();
  SceneObject& first = scene.objects[0];
  std::vector<Colour> reds(first.mesh.points.size());
  for (std::size_t v = 0; v < reds.size(); ++v) {
    reds[v] = {static_cast<double>(v) / static_cast<double>(reds.size()), 0, 0};
  }
  const std::vector<Look> looks = {
      {.vertex_colours = reds},
      {},
      {.lighting = Lighting::kEven, .material = MatteMaterial(), .vertex_colours = reds},
      {.material = SkinMaterial()},
      {.lighting = Lighting::kEven},
      {.vertex_colours = std::vector<Colour>()}};
  const std::array cameras = {FrontCamera(90), FrontCamera(50)};
  const RenderOptions options{.width = 90, .height = 80};
  ShadowMaps shadows;
  const auto images = RenderLooks(scene, looks, cameras, options, shadows, 2);
  ASSERT_EQ(images.size(), looks.size());
  const SceneObject own = first;
  for (std::size_t k = 0; k < looks.size(); ++k) {
    RenderOptions alone = options;
    alone.lighting = looks[k].lighting.value_or(options.lighting);
    first.material = looks[k].material.value_or(own.material);
    first.vertex_colours = looks[k].vertex_colours.value_or(own.vertex_colours);
    for (std::size_t n = 0; n < cameras.size(); ++n) {
      EXPECT_EQ(images[k].at(n).rgb, Render(scene, cameras[n], alone, 1).rgb) << k << " " << n;
    }
  }
  EXPECT_NE(images[0][0].rgb, images[1][0].rgb);
  EXPECT_NE(images[1][0].rgb, images[3][0].rgb);
}

TEST(Render, ALookCanLeaveOutWhatIsSheer) {
  Scene scene{{Square(10, 0, {0, 1, 0}), Square(20, -5, {1, 0, 0}, 0.5)}};
  const Camera camera = FrontCamera(60);
  ShadowMaps shadows;
  const auto images =
      RenderLooks(scene, {{{}, {.shows_sheer = false}, {}}}, {&camera, 1}, Plain(), shadows, 1);
  EXPECT_EQ(images[0][0].rgb, Render(scene, camera, Plain(), 1).rgb);
  EXPECT_EQ(images[2][0].rgb, images[0][0].rgb);
  scene.objects.pop_back();
  EXPECT_EQ(images[1][0].rgb, Render(scene, camera, Plain(), 1).rgb);
  EXPECT_NE(images[1][0].rgb, images[0][0].rgb);
}

TEST(Render, ALookHasOneColourPerVertexOrNone) {
  const Look look{.vertex_colours = std::vector<Colour>(3)};
  const Camera camera = FrontCamera(60);
  ShadowMaps shadows;
  EXPECT_THROW(
      RenderLooks({{Square(10, 0, kBlack)}}, {&look, 1}, {&camera, 1}, Plain(), shadows, 1),
      InputError);
}

// Shadows are cast by a thinned mesh, whose picture differs little from that of the fine one.
TEST(Render, FineMeshesAreThinnedToCastShadowsAndMarkersAreNot) {
  const SceneObject head = SkullObject(MakeSphere(Vec3::Zero(), 40, 160)),
                    marker = SkullObject(MakeSphere(Vec3(-26, -26, 26), 0.3, 12));
  const Camera camera = FrontCamera(90);
  ShadowMaps shadows;
  RenderAll({{head, marker}}, {&camera, 1}, Plain(Lighting::kStudio), shadows, 1);
  const auto beyond = [](const TriMesh& mesh) {
    return std::ranges::count_if(mesh.triangles, [&mesh](const Triangle& t) {
      return TriangleCentroid(mesh, t).norm() > 41;
    });
  };
  EXPECT_LT(shadows.casters.triangles.size(), head.mesh.triangles.size() / 3);
  EXPECT_EQ(beyond(shadows.casters), beyond(marker.mesh));
  EXPECT_GT(beyond(marker.mesh), 50);
  EXPECT_NEAR(Area(shadows.casters) / Area(head.mesh), 1, 0.02);
}

TEST(Render, SharedShadowsOfOtherMeshesAreRefused) {
  ShadowMaps shadows;
  const Camera camera = FrontCamera(60);
  RenderAll({{Square(10, 0, {1, 1, 1})}}, {&camera, 1}, Plain(), shadows, 1);
  EXPECT_THROW(RenderAll({{Square(11, 0, {1, 1, 1})}}, {&camera, 1}, Plain(), shadows, 1),
               std::logic_error);
}

TEST(Render, SphereIsADiscOfTheRightAreaInTheRightPlace) {
  // The disc is black on white, so the missing white is the covered area.
  SceneObject sphere{.mesh = MakeSphere(Vec3(5, 0, -3), 20, 60), .material = MatteMaterial()};
  sphere.vertex_colours.assign(sphere.mesh.points.size(), kBlack);
  RenderOptions options = Plain();
  options.background_top = options.background_bottom = {1, 1, 1};
  const Image image = Render({{sphere}}, FrontCamera(60), options, 2);
  double area = 0;
  Vec2 centre = Vec2::Zero();
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const double covered = 1 - LinearFromSrgb(PixelAt(image, x, y).g);
      area += covered;
      centre += covered * Vec2(x + 0.5, y + 0.5);
    }
  }
  const double pixels_per_mm = 120 / 60.0;
  EXPECT_NEAR(area / (std::numbers::pi * std::pow(20 * pixels_per_mm, 2)), 1, 0.004);
  EXPECT_NEAR(centre.x() / area, 60 + 5 * pixels_per_mm, 0.05);
  EXPECT_NEAR(centre.y() / area, 60 + 3 * pixels_per_mm, 0.05);
}

TEST(Render, EvenLightShadesASphereSymmetrically) {
  SceneObject sphere{.mesh = MakeSphere(Vec3::Zero(), 25, 80), .material = MatteMaterial()};
  const Image image = Render({{sphere}}, FrontCamera(60), Plain(), 2);
  for (int y = 15; y < 105; y += 5) {
    for (int x = 15; x < 105; x += 5) {
      ExpectColour(PixelAt(image, x, y), PixelAt(image, 119 - x, y), 0.03);
      ExpectColour(PixelAt(image, x, y), PixelAt(image, x, 119 - y), 0.03);
    }
  }
  EXPECT_GT(PixelAt(image, 60, 60).g, PixelAt(image, 60, 14).g + 0.1) << "the rim is darker";
}

TEST(Render, StudioLightComesFromTheUpperLeftOfThePicture) {
  const Image image = Render({{SkullObject(MakeSphere(Vec3::Zero(), 25, 60))}}, FrontCamera(60),
                             Plain(Lighting::kStudio), 2);
  EXPECT_GT(PixelAt(image, 42, 42).g, PixelAt(image, 78, 78).g + 0.1);
}

TEST(Render, SurfaceThatFacesTheViewerKeepsItsColourInEvenLight) {
  const Colour colour = HexColour(0x3b528b);
  ExpectColour(Centre(Render({{Square(10, 0, colour)}}, FrontCamera(40), Plain(), 1)), colour);
}

TEST(Render, ColourIsInterpolatedBetweenTheCorners) {
  SceneObject square = Square(20, 0, kBlack);
  square.vertex_colours = {{0, 0, 0}, {1, 0, 0}, {1, 0, 0}, {0, 0, 0}};  // red grows with x
  const Image image = Render({{square}}, FrontCamera(40), Plain(), 1);
  for (const int x : {12, 30, 60, 90, 108}) {
    EXPECT_NEAR(PixelAt(image, x, 40).r, SrgbFromLinear((x + 0.5) / 120), 0.02) << x;
  }
}

// A pixel within one triangle is shaded once, at its middle.
TEST(Render, WithinATriangleMoreSamplesChangeNothing) {
  SceneObject square = Square(20, 0, kBlack);
  square.vertex_colours = {{0, 0, 1}, {1, 0, 0}, {1, 1, 0}, {0, 0, 0}};
  RenderOptions one = Plain(), many = Plain();
  one.supersampling = 1;
  many.supersampling = 6;
  const Image coarse = Render({{square}}, FrontCamera(40), one, 1),
              fine = Render({{square}}, FrontCamera(40), many, 1);
  for (int y = 1; y < 119; ++y) {
    for (int x = 1; x < 119; ++x) {
      ExpectColour(PixelAt(fine, x, y), PixelAt(coarse, x, y), x + y == 119 ? 0.05 : 1.01 / 255);
    }
  }
}

TEST(Render, NearerSurfacesHideFartherOnesInAnyOrder) {
  const SceneObject near = Square(10, -5, {1, 0, 0}), far = Square(10, 5, {0, 1, 0});
  ExpectColour(Centre(Render({{near, far}}, FrontCamera(40), Plain(), 1)), {1, 0, 0});
  ExpectColour(Centre(Render({{far, near}}, FrontCamera(40), Plain(), 1)), {1, 0, 0});
}

// The samples are those whose barycentric coordinates are not negative, and the depth is the mean
// that these weigh, for small and large triangles in both orders of corners.
TEST(Raster, FoursAgreeWithCoverageAt) {
  constexpr int kSide = 96;
  for (const int grow : {1, 2, 5}) {  // 5: beyond kNarrow
    for (const bool swapped : {false, true}) {
      const RasterPoint a{300 * grow, 200 * grow, 1.5F};
      RasterPoint b{4100 * grow, 900 * grow, 2.5F}, c{1500 * grow, 3700 * grow, -1};
      if (swapped) {
        std::swap(b, c);
      }
      std::vector<float> seen(kSide * (kSide + 3), -100);
      VisitFours(a, b, c, {1, kSide, 2, kSide},
                 [&](int x, int y, const auto& depth, const auto& inside) {
                   for (int lane = 0; lane < 4; ++lane) {
                     if (inside[lane] != 0) {
                       seen[y * (kSide + 3) + x + lane] = depth[lane];
                     }
                   }
                 });
      int count = 0;
      for (int y = 2; y < kSide; ++y) {
        for (int x = 1; x < kSide; ++x) {
          const Coverage at = CoverageAt(a, b, c, kSubsamples * x + kSubsamples / 2,
                                         kSubsamples * y + kSubsamples / 2);
          const bool is_inside = std::min({at.a, at.b, at.c}) >= -1e-6F;
          const float expected =
              is_inside ? at.a * a.depth + at.b * b.depth + at.c * c.depth : -100.0F;
          EXPECT_NEAR(seen[y * (kSide + 3) + x], expected, 1e-4) << x << " " << y;
          EXPECT_EQ(at.is_front, swapped);
          count += is_inside ? 1 : 0;
        }
      }
      EXPECT_GT(count, 50);
    }
  }
}

TEST(Raster, TheNearerDepthStays) {
  DepthGrid grid(2, 2);
  for (const float depth : {3.0F, 1.0F, 2.0F}) {
    VisitFours({0, 0, depth}, {512, 0, depth}, {0, 512, depth}, {0, 2, 0, 2},
               [&](int x, int y, const auto& offered, const auto& inside) {
                 TakeNearer(offered, inside, &grid.depth[grid.Index(x, y)]);
               });
  }
  EXPECT_EQ(grid.depth[grid.Index(0, 0)], 1);
  EXPECT_EQ(grid.depth[grid.Index(1, 0)], 1);  // on the edge
  EXPECT_TRUE(std::isinf(grid.depth[grid.Index(1, 1)]));
}

TEST(Render, NeighbouringTrianglesLeaveNoHole) {
  TriMesh plate = testing::Plate(37.3, 61);
  for (Vec3& p : plate.points) {
    p = Vec3(p.x() - 18.65, 0.01 * p.x(), p.y() - 18.65);
  }
  SceneObject object{.mesh = plate, .material = MatteMaterial()};
  const Image image = Render({{object}}, FrontCamera(30), Plain(), 1);
  for (std::size_t i = 0; i < image.rgb.size(); ++i) {
    ASSERT_GT(image.rgb[i], 100) << i;
  }
}

// Light adds up linearly: a sheet of opacity a over a background of colour b shows a c + (1 - a) b.
TEST(Render, TransparencyMixesLightByOpacity) {
  for (const double opacity : {0.0, 0.25, 0.5, 0.9}) {
    const Image image = Render({{Square(10, 5, {0, 1, 0}), Square(10, -5, {1, 0, 0}, opacity)}},
                               FrontCamera(40), Plain(), 1);
    ExpectColour(Centre(image), {SrgbFromLinear(opacity), SrgbFromLinear(1 - opacity), 0});
  }
}

TEST(Render, SheetAtASlantIsMoreOpaque) {
  SceneObject sheet = Square(30, 0, {1, 1, 1}, 0.4);
  for (Vec3& p : sheet.mesh.points) {
    p.y() = -std::tan(std::numbers::pi / 3) * p.x();  // 60 degrees: twice the way through
  }
  const Image black = Render({{sheet}}, FrontCamera(40), Plain(), 1);
  RenderOptions on_white = Plain();
  on_white.background_top = on_white.background_bottom = {1, 1, 1};
  const Image white = Render({{sheet}}, FrontCamera(40), on_white, 1);
  const double passed = LinearFromSrgb(Centre(white).r) - LinearFromSrgb(Centre(black).r);
  EXPECT_NEAR(passed, 0.6 * 0.6, 0.01);
}

TEST(Render, TransparentSheetBehindIsHidden) {
  const Image image = Render({{Square(10, -5, {0, 1, 0}), Square(10, 5, {1, 0, 0}, 0.5)}},
                             FrontCamera(40), Plain(), 1);
  ExpectColour(Centre(image), {0, 1, 0});
}

TEST(Render, OneSurfaceShadesAnother) {
  // The lid keeps the light off the floor of a box, which is seen past it.
  const SceneObject floor = Square(20, 10, {1, 1, 1});
  SceneObject lid = Square(9, -6, {1, 1, 1});
  const Image open = Render({{floor}}, FrontCamera(40), Plain(Lighting::kStudio), 1);
  const Image shaded = Render({{floor, lid}}, FrontCamera(40), Plain(Lighting::kStudio), 1);
  // Key light from the upper left of the picture: the shadow falls to the lower right.
  EXPECT_LT(PixelAt(shaded, 95, 95).g, PixelAt(open, 95, 95).g);
}

TEST(Camera, FramesTheRegionFromEachSide) {
  const Box3 region(Vec3(-70, -90, -110), Vec3(80, 100, 120));
  for (const View view : {View::kFront, View::kThreeQuarter, View::kSide}) {
    const Camera camera = CameraFor(view, region, 1);
    EXPECT_TRUE(camera.view_from_world.isUnitary(1e-12));
    EXPECT_NEAR(camera.view_from_world.determinant(), 1, 1e-12);
    EXPECT_EQ(camera.centre, region.center());
    EXPECT_NEAR(camera.height_mm, 1.08 * 230, 1e-9);
  }
  // In a narrow picture the width decides.
  EXPECT_NEAR(CameraFor(View::kFront, region, 0.25).height_mm, 1.08 * 150 / 0.25, 1e-9);
  EXPECT_NEAR(CameraFor(View::kSide, region, 0.25).height_mm, 1.08 * 190 / 0.25, 1e-9);
  EXPECT_THROW(CameraFor(View::kFront, Box3(), 1), InputError);
}

TEST(Camera, ViewsLookFromTheirNamedSides) {
  const Box3 region(Vec3(-1, -1, -1), Vec3(1, 1, 1));
  const Vec3 left(1, 0, 0), nose(0, -1, 0), up(0, 0, 1);
  const Mat3 front = CameraFor(View::kFront, region, 1).view_from_world;
  EXPECT_TRUE((front * nose).isApprox(Vec3(0, 0, 1)));
  EXPECT_TRUE((front * left).isApprox(Vec3(1, 0, 0)));
  EXPECT_TRUE((front * up).isApprox(Vec3(0, 1, 0)));
  const Mat3 side = CameraFor(View::kSide, region, 1).view_from_world;
  EXPECT_TRUE((side * left).isApprox(Vec3(0, 0, 1)));
  EXPECT_TRUE((side * nose).isApprox(Vec3(-1, 0, 0)));
  const Vec3 between = CameraFor(View::kThreeQuarter, region, 1).view_from_world * nose;
  EXPECT_NEAR(between.x(), -std::sin(40 * std::numbers::pi / 180), 1e-12);
}

TEST(Render, EmptySceneIsBackground) {
  const Image image = Render({}, FrontCamera(10), {.width = 20, .height = 40}, 2);
  EXPECT_GT(PixelAt(image, 5, 0).g, PixelAt(image, 5, 39).g);
}

TEST(Render, WrongInputIsRefused) {
  SceneObject object = Square(1, 0, kBlack);
  EXPECT_THROW(Render({{object}}, Camera{}, {}, 1), InputError);
  EXPECT_THROW(Render({{object}}, FrontCamera(10), {.width = 0}, 1), InputError);
  object.opacity = 1.5;
  EXPECT_THROW(Render({{object}}, FrontCamera(10), {}, 1), InputError);
  object.opacity = 1;
  object.mesh.points[2].x() = kNaN;
  EXPECT_THROW(Render({{object}}, FrontCamera(10), {}, 1), InputError);
  object.mesh.points[2].x() = 0;
  object.mesh.triangles[1][2] = 4;
  EXPECT_THROW(Render({{object}}, FrontCamera(10), {}, 1), InputError);
  object.mesh.triangles[1][2] = 3;
  object.vertex_colours.pop_back();
  EXPECT_THROW(Render({{object}}, FrontCamera(10), {}, 1), InputError);
}

TEST(Solids, AreClosedAndHaveTheirVolume) {
  const TriMesh cylinder = MakeCylinder(Vec3(1, 2, 3), Vec3(4, -2, 3), 2, 60);
  EXPECT_NEAR(SignedVolume(cylinder), std::numbers::pi * 4 * 5, 0.3);
  EXPECT_NEAR(Area(cylinder), 2 * std::numbers::pi * 2 * (5 + 2), 0.3);
  const TriMesh sphere = MakeSphere(Vec3(1, 2, 3), 5, 40);
  EXPECT_NEAR(SignedVolume(sphere), 4.0 / 3 * std::numbers::pi * 125, 4);
  const EdgeReport edges = CheckEdges(sphere);
  EXPECT_EQ(edges.boundary + edges.non_manifold + edges.inconsistent, 0);
  EXPECT_THROW(MakeCylinder(Vec3::Zero(), Vec3::Zero(), 1), InputError);
  EXPECT_THROW(MakeSphere(Vec3::Zero(), kNaN), InputError);
}

TEST(Pictures, DowelsReachFromBaseToTipAndUnknownDepthsAreLeftOut) {
  const Dowel known{.site = "g", .base = {0, 0, 0}, .direction = {0, -1, 0}, .depth_mm = 8};
  const Dowel unknown{.site = "n", .base = {50, 0, 0}, .direction = {0, -1, 0}};
  const Box3 box = Bounds(DowelObject(std::vector{known, unknown}, 1.0).mesh);
  EXPECT_NEAR(box.min().y(), -8 - 1.6, 0.05);
  EXPECT_NEAR(box.max().y(), 0, 1e-12);
  EXPECT_LT(box.max().x(), 2);
}

TEST(Pictures, MapColoursTheSurfaceAndNaNIsGrey) {
  const ColourMap map = DivergingMap(3);
  TriMesh mesh = Square(10, 0, kBlack).mesh;
  const std::vector<double> low(4, -3.0), none(4, kNaN);
  ExpectColour(Centre(Render({{MappedObject(mesh, low, map)}}, FrontCamera(30), Plain(), 1)),
               ColourAt(map, -3));
  ExpectColour(Centre(Render({{MappedObject(mesh, none, map)}}, FrontCamera(30), Plain(), 1)),
               kNoDataColour);
  EXPECT_THROW(MappedObject(mesh, std::vector<double>(3, 0.0), map), InputError);
}

TEST(Pictures, SheetHoldsEachViewUnchangedAtOneScale) {
  const Scene scene = Crowd();
  const Box3 region(Vec3(-42, -60, -42), Vec3(42, 60, 42));
  const View views[] = {View::kFront, View::kSide};
  const RenderOptions options{.width = 90, .height = 80};
  const Image sheet = RenderViews(scene, region, views, options, 2);
  Camera camera = CameraFor(View::kFront, region, 90 / 80.0);
  camera.height_mm = CameraFor(View::kSide, region, 90 / 80.0).height_mm;  // the greater one
  const Image front = Render(scene, camera, options, 1);
  EXPECT_EQ(sheet.width, 24 + 90 + 16 + 90 + 24);
  EXPECT_EQ(sheet.height, 24 + 80 + 24);
  for (int y = 0; y < 80; ++y) {
    for (int x = 0; x < 90; ++x) {
      ASSERT_EQ(PixelAt(sheet, 24 + x, 24 + y).g, PixelAt(front, x, y).g);
    }
  }
}

TEST(Pictures, ASheetNeedsAPicture) { EXPECT_THROW(ContactSheet({}), InputError); }

}  // namespace
}  // namespace semblance::problems
