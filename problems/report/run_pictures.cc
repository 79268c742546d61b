// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/run_pictures.h"

#include <fmt/format.h>

#include "problems/pictures/pictures.h"
#include "problems/pictures/render.h"
#include "surfaces/base/parallel.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance {
namespace {

constexpr std::array kViews = {View::kFront, View::kThreeQuarter, View::kSide};
constexpr int kWidth = 560, kHeight = 640;

// What all pictures are framed to: skull, face and dowels.
Box3 Region(const RunResult& result) {
  Box3 box = Bounds(result.face.mesh);
  box.extend(Bounds(result.shell));
  if (result.bust) {  // its ears, not its shoulders
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

RenderOptions Options(Lighting lighting) {
  return {.width = kWidth, .height = kHeight, .lighting = lighting};
}

void WriteViews(const Scene& scene, const RunResult& result, const Sheet& sheet, Lighting lighting,
                OutputFolder& folder, const char* name, int threads) {
  folder.Write(name, EncodePng(RenderViews(scene, Region(result), kViews, sheet, Options(lighting),
                                           threads)));
}

Image Front(const Scene& scene, const RunResult& result, int threads) {
  const double aspect = static_cast<double>(kWidth) / kHeight;
  return Render(scene, CameraFor(View::kFront, Region(result), aspect), Options(Lighting::kStudio),
                threads);
}

Scene SkullScene(const RunResult& result) {
  return {{SkullObject(result.subject.skull), DowelObject(result.subject.dowels_on_bone)}};
}

// The story in one row: skull and dowels, implicit face, H-spline face and, where it is known, the
// true skin.
void WriteOverview(const RunResult& result, OutputFolder& folder, int threads) {
  std::vector<Image> pictures = {Front(SkullScene(result), result, threads),
                                 Front({{SkinObject(result.implicit.dense)}}, result, threads),
                                 Front({{SkinObject(result.face.mesh)}}, result, threads)};
  Sheet sheet{.title = "",
              .captions = {"skull and depth markers", "first face (implicit)", "recovered face"},
              .legend = std::nullopt};
  if (result.bust) {
    pictures.push_back(Front(HeadScene(result), result, threads));
    sheet.captions.push_back("head");
  }
  if (result.subject.skin) {
    pictures.push_back(Front({{SkinObject(*result.subject.skin)}}, result, threads));
    sheet.captions.push_back("true skin");
  }
  folder.Write("pictures/overview.png", EncodePng(ContactSheet(pictures, sheet)));
}

Colour PlaceColour(SkinPlace place) {
  switch (place) {
    case SkinPlace::kScored:
      return HexColour(0x4f9d69);
    case SkinPlace::kMasked:
      return HexColour(0xe0a030);
    case SkinPlace::kInner:
      return HexColour(0xb03060);
    case SkinPlace::kEnd:
      return HexColour(0x6070c0);
    case SkinPlace::kBeyond:
      break;
  }
  return HexColour(0xc8c0b8);
}

// Green is scored, yellow masked, red inner, blue a lid; the rest is grey.
void WriteScoredSkin(const RunResult& result, OutputFolder& folder, int threads) {
  const std::vector<SkinPlace>& places = result.truth->skin.place;
  SceneObject object = SkinObject(*result.subject.skin);
  for (const SkinPlace place : places) {
    object.vertex_colours.push_back(PlaceColour(place));
  }
  WriteViews({{object}}, result, {InWords(result.truth->skin), {}, std::nullopt}, Lighting::kStudio,
             folder, "pictures/scored.png", threads);
}

void WriteTruth(const RunResult& result, OutputFolder& folder, int threads) {
  const TriMesh& skin = *result.subject.skin;
  WriteViews({{SkinObject(skin)}}, result, {"True skin", {}, std::nullopt}, Lighting::kStudio,
             folder, "pictures/truth.png", threads);
  WriteScoredSkin(result, folder, threads);
  const Legend legend{ErrorColours(), "recovered face outside (+) or inside (-) the true skin"};
  WriteViews({{MappedObject(skin, result.truth->face.signed_mm, legend.map)}}, result,
             {"Signed error on the true skin", {}, legend}, Lighting::kEven, folder,
             "pictures/error.png", threads);
  const Legend implicit_legend{ErrorColours(),
                               "first face outside (+) or inside (-) the true skin"};
  WriteViews({{MappedObject(skin, result.truth->implicit.signed_mm, implicit_legend.map)}}, result,
             {"Signed error of the first face", {}, implicit_legend}, Lighting::kEven, folder,
             "pictures/error_implicit.png", threads);
}

SceneObject ByOrigin(SceneObject object, const RunResult& result, int threads) {
  for (const BoneOrigin origin : OriginUnder(object.mesh, result.shell, result.origin, threads)) {
    object.vertex_colours.push_back(OriginColour(origin));
  }
  return object;
}

// Where any of it is invented: the shell, and the face over it.
void WriteOrigin(const RunResult& result, OutputFolder& folder, int threads) {
  const auto [observed, mirrored, inferred] = AreaByOrigin_cm2(result.shell, result.origin);
  if (mirrored + inferred == 0) {
    return;
  }
  const std::string title = fmt::format(
      "Bone: {:.0f} cm² observed, {:.0f} cm² mirrored (blue), {:.0f} cm² inferred (yellow)",
      observed, mirrored, inferred);
  WriteViews({{ByOrigin(SkullObject(result.shell), result, threads)}}, result,
             {title, {}, std::nullopt}, Lighting::kStudio, folder, "pictures/origin.png", threads);
  WriteViews({{ByOrigin(SkinObject(result.face.mesh), result, threads)}}, result,
             {"The face, by the bone under it", {}, std::nullopt}, Lighting::kStudio, folder,
             "pictures/origin_face.png", threads);
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

std::vector<double> SignedErrorOf(const TriMesh& mesh, const RunResult& result,
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
  const int threads = context.threads;
  WriteOverview(result, folder, threads);
  WriteViews(SkullScene(result), result, {"Skull and dowels", {}, std::nullopt}, Lighting::kStudio,
             folder, "pictures/skull_dowels.png", threads);
  const Legend depth{DepthColours(), "tissue depth on the skull's shell"};
  WriteViews({{MappedObject(result.shell, result.depth.depth_mm, depth.map)}}, result,
             {"Interpolated tissue depth", {}, depth}, Lighting::kEven, folder,
             "pictures/depth.png", threads);
  WriteViews({{SkinObject(result.implicit.dense)}}, result,
             {"First face, straight from the depths (implicit surface)", {}, std::nullopt},
             Lighting::kStudio, folder, "pictures/implicit.png", threads);
  WriteViews({{SkinObject(result.face.mesh)}}, result, {"Recovered face", {}, std::nullopt},
             Lighting::kStudio, folder, "pictures/face.png", threads);
  if (result.bust) {
    folder.Write(
        "pictures/bust.png",
        EncodePng(RenderViews(HeadScene(result), Bounds(result.bust->skin), kViews,
                              {"", {}, std::nullopt}, Options(Lighting::kStudio), threads)));
  }
  WriteOrigin(result, folder, threads);
  Scene over = SkullScene(result);
  over.objects.push_back(SkinObject(result.face.mesh, 0.55));
  WriteViews(over, result, {"Recovered face over skull and depth markers", {}, std::nullopt},
             Lighting::kStudio, folder, "pictures/face_over_skull.png", threads);
  if (result.uncertainty && !result.uncertainty->sigma_mm.empty()) {
    const Legend sigma{SigmaColours(), "standard deviation along the normal"};
    WriteViews({{MappedObject(result.face.mesh, result.uncertainty->sigma_mm, sigma.map)}}, result,
               {"How far the face may be off", {}, sigma}, Lighting::kEven, folder,
               "pictures/sigma.png", threads);
  }
  if (result.truth) {
    WriteTruth(result, folder, threads);
  }
}

}  // namespace semblance
