// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/run_pictures.h"

#include <fmt/format.h>

#include "problems/pictures/lighting.h"
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

// What the sheets of one run share.
struct Album {
  const RunResult& result;
  OutputFolder& folder;
  int threads;
  std::vector<Camera> cameras =
      CamerasFor(kViews, Region(result), static_cast<double>(kWidth) / kHeight);
  ShadowMaps of_skull = {}, of_face = {}, of_skin = {};
};

// Returns the pictures on the sheet, one per side.
std::vector<Image> WriteSheet(const char* name, const Scene& scene, const Sheet& sheet,
                              Lighting lighting, ShadowMaps& shadows, Album& album) {
  std::vector<Image> sides =
      RenderAll(scene, album.cameras, Options(lighting), shadows, album.threads);
  album.folder.Write(name, EncodePng(ContactSheet(sides, sheet)));
  return sides;
}

Scene SkullScene(const RunResult& result) {
  return {{SkullObject(result.subject.skull), DowelObject(result.subject.dowels_on_bone)}};
}

// Framed by itself. Returns the head from the front as the other pictures are framed.
Image WriteBust(Album& album) {
  const Scene head = HeadScene(album.result);
  const RenderOptions options = Options(Lighting::kStudio);
  album.folder.Write("pictures/bust.png",
                     EncodePng(RenderViews(head, Bounds(album.result.bust->skin), kViews,
                                           {"", {}, std::nullopt}, options, album.threads)));
  return Render(head, album.cameras.front(), options, album.threads);
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

// Green is scored, yellow masked, red inner, blue a lid; the rest is grey.
void WriteScoredSkin(Album& album) {
  const ScoredSkin& skin = album.result.truth->skin;
  SceneObject object = SkinObject(*album.result.subject.skin);
  for (const SkinStatus status : skin.status) {
    object.vertex_colours.push_back(StatusColour(status));
  }
  WriteSheet("pictures/scored.png", {{object}}, {InWords(skin), {}, std::nullopt},
             Lighting::kStudio, album.of_skin, album);
}

void WriteError(const char* name, const char* title, std::span<const double> signed_mm,
                const Legend& legend, Album& album) {
  WriteSheet(name, {{MappedObject(*album.result.subject.skin, signed_mm, legend.map)}},
             {title, {}, legend}, Lighting::kEven, album.of_skin, album);
}

// Returns the true skin from the front.
Image WriteTruth(Album& album) {
  std::vector<Image> skin =
      WriteSheet("pictures/truth.png", {{SkinObject(*album.result.subject.skin)}},
                 {"True skin", {}, std::nullopt}, Lighting::kStudio, album.of_skin, album);
  WriteScoredSkin(album);
  const TruthComparison& truth = *album.result.truth;
  WriteError("pictures/error.png", "Signed error on the true skin", truth.face.signed_mm,
             {ErrorColours(), "recovered face outside (+) or inside (-) the true skin"}, album);
  WriteError("pictures/error_implicit.png", "Signed error of the first face",
             truth.implicit.signed_mm,
             {ErrorColours(), "first face outside (+) or inside (-) the true skin"}, album);
  return std::move(skin.front());
}

SceneObject ByOrigin(SceneObject object, const RunResult& result, int threads) {
  for (const BoneOrigin origin : OriginUnder(object.mesh, result.shell, result.origin, threads)) {
    object.vertex_colours.push_back(OriginColour(origin));
  }
  return object;
}

// Where any of it is invented: the shell, and the face over it.
void WriteOrigin(Album& album) {
  const RunResult& result = album.result;
  const auto [observed, mirrored, inferred] = AreaByOrigin_cm2(result.shell, result.origin);
  if (mirrored + inferred == 0) {
    return;
  }
  const std::string title = fmt::format(
      "Bone: {:.0f} cm² observed, {:.0f} cm² mirrored (blue), {:.0f} cm² inferred (yellow)",
      observed, mirrored, inferred);
  ShadowMaps of_shell;
  WriteSheet("pictures/origin.png", {{ByOrigin(SkullObject(result.shell), result, album.threads)}},
             {title, {}, std::nullopt}, Lighting::kStudio, of_shell, album);
  WriteSheet("pictures/origin_face.png",
             {{ByOrigin(SkinObject(result.face.mesh), result, album.threads)}},
             {"The face, by the bone under it", {}, std::nullopt}, Lighting::kStudio, album.of_face,
             album);
}

void WriteDepth(Album& album) {
  const Legend depth{DepthColours(), "tissue depth on the skull's shell"};
  ShadowMaps of_shell;
  WriteSheet("pictures/depth.png",
             {{MappedObject(album.result.shell, album.result.depth.depth_mm, depth.map)}},
             {"Interpolated tissue depth", {}, depth}, Lighting::kEven, of_shell, album);
}

// Returns the implicit surface from the front.
Image WriteImplicit(Album& album) {
  ShadowMaps of_implicit;
  return std::move(
      WriteSheet("pictures/implicit.png", {{SkinObject(album.result.implicit.dense)}},
                 {"First face, straight from the depths (implicit surface)", {}, std::nullopt},
                 Lighting::kStudio, of_implicit, album)
          .front());
}

void WriteFaceOverSkull(Album& album) {
  Scene over = SkullScene(album.result);
  over.objects.push_back(SkinObject(album.result.face.mesh, 0.55));
  WriteSheet("pictures/face_over_skull.png", over,
             {"Recovered face over skull and depth markers", {}, std::nullopt}, Lighting::kStudio,
             album.of_skull, album);
}

void WriteSigma(Album& album) {
  const auto& uncertainty = album.result.uncertainty;
  if (!uncertainty || uncertainty->sigma_mm.empty()) {
    return;
  }
  const Legend sigma{SigmaColours(), "standard deviation along the normal"};
  WriteSheet("pictures/sigma.png",
             {{MappedObject(album.result.face.mesh, uncertainty->sigma_mm, sigma.map)}},
             {"How far the face may be off", {}, sigma}, Lighting::kEven, album.of_face, album);
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
  Album album{.result = result, .folder = folder, .threads = context.threads};
  std::vector<Image> story;
  Sheet sheet{.title = "", .captions = {}, .legend = std::nullopt};
  const auto tell = [&](Image picture, const char* caption) {
    story.push_back(std::move(picture));
    sheet.captions.push_back(caption);
  };
  tell(WriteSheet("pictures/skull_dowels.png", SkullScene(result),
                  {"Skull and dowels", {}, std::nullopt}, Lighting::kStudio, album.of_skull, album)
           .front(),
       "skull and depth markers");
  WriteDepth(album);
  tell(WriteImplicit(album), "first face (implicit)");
  tell(WriteSheet("pictures/face.png", {{SkinObject(result.face.mesh)}},
                  {"Recovered face", {}, std::nullopt}, Lighting::kStudio, album.of_face, album)
           .front(),
       "recovered face");
  if (result.bust) {
    tell(WriteBust(album), "head");
  }
  WriteOrigin(album);
  WriteFaceOverSkull(album);
  WriteSigma(album);
  if (result.truth) {
    tell(WriteTruth(album), "true skin");
  }
  folder.Write("pictures/overview.png", EncodePng(ContactSheet(story, sheet)));
}

}  // namespace semblance
