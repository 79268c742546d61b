// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/run_pictures.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "problems/report/pictures/lighting.h"
#include "problems/report/pictures/pictures.h"
#include "problems/report/pictures/render.h"
#include "surfaces/base/parallel.h"
#include "surfaces/mesh/mesh_primitives.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {
namespace {

constexpr std::array kViews = {View::kFront, View::kThreeQuarter, View::kSide};
constexpr int kPictureWidth = 560, kPictureHeight = 640;
constexpr double kPictureAspect = static_cast<double>(kPictureWidth) / kPictureHeight;

// The box that all pictures frame: skull, face and dowels.
Box3 Region(const RunResult& result) {
  Box3 box = Bounds(result.face.mesh);
  box.extend(Bounds(result.shell));
  if (result.bust) {  // frames its ears, but not its shoulders
    const double chin_mm = box.min().z();
    for (const Vec3& point : result.bust->skin.points) {
      if (point.z() >= chin_mm) {
        box.extend(point);
      }
    }
  }
  for (const Dowel& dowel : result.subject.dowels_on_bone) {
    box.extend(dowel.Tip());
  }
  return box;
}

// The state that the sheets of one run share.
struct Album {
  const RunResult& result;
  OutputFolder& folder;
  int threads;
  std::vector<Camera> cameras = CamerasFor(kViews, Region(result), kPictureAspect);
};

// Writes the scene from all sides, a sheet per look. Returns the first one from the front.
Image WriteSheets(std::span<const char* const> names, const Scene& scene,
                  std::span<const Look> looks, Album& album) {
  ShadowMaps shadows;
  std::vector<std::vector<Image>> sheets =
      RenderLooks(scene, looks, album.cameras, {.width = kPictureWidth, .height = kPictureHeight},
                  shadows, album.threads);
  for (std::size_t k = 0; k < sheets.size(); ++k) {
    album.folder.Write(names[k], EncodePng(ContactSheet(sheets[k])));
  }
  return std::move(sheets.front().front());
}

Image WriteSheet(const char* name, const Scene& scene, Album& album) {
  return WriteSheets({&name, 1}, scene, {{Look{}}}, album);
}

// The first object of a scene coloured by one value per vertex (MappedObject, pictures.h).
Look MappedLook(std::span<const double> values_mm, const ColourMap& map) {
  return {.lighting = Lighting::kEven,
          .material = MatteMaterial(),
          .vertex_colours = ColoursAt(map, values_mm)};
}

// Returns the head in the frame of the other pictures.
Image HeadFromFront(const Album& album) {
  ShadowMaps shadows;
  return std::move(RenderAll(HeadScene(album.result), {album.cameras.data(), 1},
                             {.width = kPictureWidth, .height = kPictureHeight}, shadows,
                             album.threads)
                       .front());
}

Colour StatusColour(SkinStatus status) {
  switch (status) {
    case SkinStatus::kScored:
      return HexColour(0x4f9d69);
    case SkinStatus::kMasked:
      return HexColour(0xe0a030);
    case SkinStatus::kInner:
      return HexColour(0xb03060);
    case SkinStatus::kEnd:
      return HexColour(0x6070c0);
    case SkinStatus::kBeyond:
      break;
  }
  return HexColour(0xc8c0b8);
}

// Green: scored, yellow: masked, red: inner, blue: a lid, grey: the rest.
std::vector<Colour> StatusColours(const ScoredSkin& skin) {
  std::vector<Colour> colours(skin.status.size());
  std::ranges::transform(skin.status, colours.begin(), StatusColour);
  return colours;
}

// Returns the true skin from the front.
Image WriteTruth(Album& album) {
  const TruthComparison& truth = *album.result.truth;
  return WriteSheets({{"pictures/truth.png", "pictures/scored.png", "pictures/error.png"}},
                     {{SkinObject(*album.result.subject.skin)}},
                     {{{},
                       {.vertex_colours = StatusColours(truth.skin)},
                       MappedLook(truth.face.signed_mm, ErrorColours())}},
                     album);
}

// Returns the implicit surface from the front.
Image WriteImplicit(Album& album) {
  return WriteSheet("pictures/implicit.png", {{SkinObject(album.result.implicit.dense)}}, album);
}

// Writes skull and dowels, without and with the face over them. Returns the first from the front.
Image WriteSkull(Album& album) {
  return WriteSheets(
      {{"pictures/skull_dowels.png", "pictures/face_over_skull.png"}},
      {{SkullObject(album.result.subject.skull), DowelObject(album.result.subject.dowels_on_bone),
        SkinObject(album.result.face.mesh, 0.55)}},
      {{{.shows_sheer = false}, {}}}, album);
}

// The way on the face from one (u,v) to another, a little above it. u may lead over the seam.
std::vector<Vec3> WayOnFace(const HSplineSurface& face, const Vec2& from, const Vec2& to) {
  constexpr int kParts = 12;
  constexpr double kAbove_mm = 0.6;
  const bool is_closed = face.shape().ClosedU();
  Vec2 step = to - from;
  step.x() -= is_closed ? std::round(step.x()) : 0;
  std::vector<Vec3> way;
  for (int k = 0; k <= kParts; ++k) {
    Vec2 uv = from + k * step / kParts;
    uv.x() -= is_closed ? std::floor(uv.x()) : 0;
    const SurfaceFrame frame = face.Frame(uv);
    way.emplace_back(frame.point + kAbove_mm * frame.Normal());
  }
  return way;
}

// The ways of the markers' (u,v) in the last round.
SceneObject WaysObject(const RunResult& result) {
  constexpr double kShown_mm = 0.3;  // shorter ways would be hidden by their end
  SceneObject ways{.mesh = {}, .material = PlasticMaterial(HexColour(0xe0a030))};
  for (std::size_t k = 0; k < result.target.points.size(); ++k) {
    const FitPoint& point = result.target.points[k];
    if (point.role == PointRole::kSeed) {
      continue;
    }
    const std::vector<Vec3> way = WayOnFace(result.fit.surface, point.uv, result.fit.uv[k]);
    if ((way.back() - way.front()).norm() >= kShown_mm) {
      for (std::size_t n = 1; n < way.size(); ++n) {
        Append(ways.mesh, MakeCylinder(way[n - 1], way[n], 0.7));
      }
      Append(ways.mesh, MakeSphere(way.back(), 1.4));
    }
  }
  return ways;
}

SceneObject SeedsObject(const RunResult& result) {
  constexpr int kRings = 4;  // a seed covers a few pixels, and there are thousands
  SceneObject seeds{.mesh = {}, .material = PlasticMaterial(HexColour(0x2f7fc1))};
  for (const FitPoint& point : result.target.points) {
    if (point.role == PointRole::kSeed) {
      Append(seeds.mesh, MakeSphere(point.position, 0.8, kRings));
    }
  }
  return seeds;
}

// The translucent face with the points of its fit. Skipped if nothing was fitted.
void WriteFit(Album& album) {
  const RunResult& result = album.result;
  if (result.fit.levels.empty()) {
    return;
  }
  Scene scene{{DowelObject(result.subject.dowels_on_bone)}};
  for (const SceneObject& object : {SeedsObject(result), WaysObject(result)}) {
    if (!object.mesh.triangles.empty()) {
      scene.objects.push_back(object);
    }
  }
  scene.objects.push_back(SkinObject(result.face.mesh, 0.6));
  WriteSheet("pictures/fit.png", scene, album);
}

// Writes the face, also by its sigma. Returns it from the front.
Image WriteFace(Album& album) {
  std::vector<const char*> names = {"pictures/face.png"};
  std::vector<Look> looks(1);
  const auto& uncertainty = album.result.uncertainty;
  if (uncertainty && !uncertainty->sigma_mm.empty()) {
    names.push_back("pictures/sigma.png");
    looks.push_back(MappedLook(uncertainty->sigma_mm, SigmaColours()));
  }
  return WriteSheets(names, {{SkinObject(album.result.face.mesh)}}, looks, album);
}

}  // namespace

Colour OriginColour(BoneOrigin origin) {
  switch (origin) {
    case BoneOrigin::kObserved:
      return HexColour(0xe3dac9);
    case BoneOrigin::kMirrored:
      return HexColour(0x2f7fc1);
    case BoneOrigin::kInferred:
      break;
  }
  return HexColour(0xe0a030);
}

Scene HeadScene(const RunResult& result) {
  if (!result.bust) {
    return {{SkinObject(result.face.mesh)}};
  }
  Scene scene{{SkinObject(result.bust->skin)}};
  for (const EyePart& part : result.bust->eyes) {
    const auto& c = part.colour;
    scene.objects.push_back(EyeObject(part.mesh, {c[0], c[1], c[2]}));
  }
  return scene;
}

ColourMap DepthColours() { return SequentialMap(0, 25); }
ColourMap ErrorColours() { return DivergingMap(8); }
ColourMap SigmaColours() { return SequentialMap(0, 6); }

std::vector<double> SignedErrors(const TriMesh& mesh, const RunResult& result,
                                 const RunContext& context) {
  const FaceRegion& region = result.truth->skin.region;
  const TriMesh skin = OuterSurface(*result.subject.skin, region);
  const std::vector<bool> comparable = ComparableTriangles(skin, region);
  const MeshQuery query(skin);
  const std::vector<Vec3> normals = VertexNormals(skin);
  std::vector<double> error(mesh.points.size(), kNaN);
  ParallelFor(error.size(), context.threads, 256, [&](std::size_t v) {
    const MeshPoint nearest = query.Closest(mesh.points[v]);
    const Triangle& t = skin.triangles[nearest.triangle];
    if (comparable[nearest.triangle]) {
      const double side =
          (mesh.points[v] - nearest.position).dot(normals[t[0]] + normals[t[1]] + normals[t[2]]);
      error[v] = side < 0 ? -nearest.distance_mm : nearest.distance_mm;
    }
  });
  return error;
}

void WritePictures(const RunResult& result, OutputFolder& folder, const RunContext& context) {
  context.Report("pictures");
  Album album{.result = result, .folder = folder, .threads = context.threads};
  std::vector<Image> overview = {WriteSkull(album)};
  overview.push_back(WriteImplicit(album));
  overview.push_back(WriteFace(album));
  if (result.bust) {
    overview.push_back(HeadFromFront(album));
  }
  WriteFit(album);
  if (result.truth) {
    overview.push_back(WriteTruth(album));
  }
  folder.Write("pictures/overview.png", EncodePng(ContactSheet(overview)));
}

}  // namespace semblance::problems
