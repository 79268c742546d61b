// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/turntable.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "problems/report/pictures/lighting.h"
#include "problems/report/pictures/pictures.h"
#include "problems/report/scene_file.h"
#include "surfaces/base/error.h"
#include "surfaces/mesh_files/glb.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;

// One of the two bodies that turn.
struct TurnedBody {
  std::string name;
  Scene scene;
};

// The head with its eyes if the run has one, otherwise the recovered face.
Scene FaceScene(const std::vector<SceneMesh>& meshes, const fs::path& file) {
  const SceneMesh* const head = FindSceneMesh(meshes, "bust");
  const SceneMesh* const face = head != nullptr ? head : FindSceneMesh(meshes, "face");
  if (face == nullptr) {
    throw IoError(fmt::format("{}: it holds no face; run it again", file.string()));
  }
  Scene scene{{SkinObject(face->mesh)}};
  for (const ScenePart& part : face->parts) {
    scene.objects.push_back(EyeObject(part.mesh, part.colour));
  }
  return scene;
}

std::array<TurnedBody, 2> ReadBodies(const fs::path& run) {
  CheckRunFolder(run);
  const fs::path file = run / "scene.json";
  const std::vector<SceneMesh> meshes = ReadSceneMeshes(file);
  const SceneMesh* const skull = FindSceneMesh(meshes, "skull");
  if (skull == nullptr) {
    throw IoError(fmt::format("{}: it holds no skull", file.string()));
  }
  return {{{"skull", {{SkullObject(skull->mesh), DowelObject(ReadRunDowels(run / "dowels.csv"))}}},
           {"face", FaceScene(meshes, file)}}};
}

// The vertical axis through the middle of both bodies, and what they sweep.
struct Sweep {
  Vec3 centre = Vec3::Constant(kNaN);
  double radius_mm = 0;  // around the axis
  double height_mm = 0;
};

Sweep MeasureSweep(const std::array<TurnedBody, 2>& bodies) {
  Box3 box;
  for (const TurnedBody& body : bodies) {
    for (const SceneObject& object : body.scene.objects) {
      box.extend(Bounds(object.mesh));
    }
  }
  Sweep sweep{.centre = box.center(), .height_mm = box.sizes().z()};
  for (const TurnedBody& body : bodies) {
    for (const SceneObject& object : body.scene.objects) {
      for (const Vec3& p : object.mesh.points) {
        sweep.radius_mm = std::max(sweep.radius_mm, (p - sweep.centre).head<2>().norm());
      }
    }
  }
  return sweep;
}

GlbNode TurningNode(const TurnedBody& body, const Vec3& place, const Sweep& sweep, double seconds) {
  GlbNode still{.name = body.name + " mesh", .offset_mm = -sweep.centre};
  for (const SceneObject& object : body.scene.objects) {
    if (!object.mesh.triangles.empty()) {
      const Colour& c = object.material.colour;
      still.parts.push_back({.material = {.name = body.name, .colour = {c.r, c.g, c.b}},
                             .points = object.mesh.points,
                             .normals = VertexNormals(object.mesh),
                             .triangles = object.mesh.triangles});
    }
  }
  return {.name = body.name, .children = {std::move(still)}, .offset_mm = place, .turn_s = seconds};
}

std::string TurntableGlb(const std::array<TurnedBody, 2>& bodies, const Sweep& sweep,
                         double seconds) {
  const Vec3 aside(1.05 * sweep.radius_mm, 0, 0);
  const std::array nodes = {TurningNode(bodies[0], -aside, sweep, seconds),
                            TurningNode(bodies[1], aside, sweep, seconds)};
  return EncodeGlb(nodes);
}

// The camera that sees the subject turned by the angle to its right, so that its left side comes
// into view first.
Camera CameraAt(double angle, const Sweep& sweep, double height_mm) {
  const Vec3 towards(std::sin(angle), -std::cos(angle), 0),
      right(std::cos(angle), std::sin(angle), 0);
  Camera camera{.centre = sweep.centre, .height_mm = height_mm};
  camera.view_from_world << right.transpose(), Vec3::UnitZ().transpose(), towards.transpose();
  return camera;
}

// Keeps the shadows of the sky, which serve every picture. The shadows of lights that
// move with the camera are dropped after each picture, because they would fill the memory.
class TurnPainter {
 public:
  explicit TurnPainter(const Scene& scene) : scene_(scene) {}

  Image Paint(const Camera& camera, const RenderOptions& look, int threads) {
    ShadowMaps shadows = sky_;
    Image image = std::move(RenderAll(scene_, {&camera, 1}, look, shadows, threads).front());
    if (sky_.of_direction.empty()) {
      sky_ = std::move(shadows);
    }
    return image;
  }

 private:
  const Scene& scene_;
  ShadowMaps sky_ = {};
};

void CheckOptions(const TurntableOptions& o) {
  if (o.frames < 1 || o.frames > 720 || !(o.seconds > 0 && o.seconds <= 3600) || o.height_px < 64 ||
      o.height_px > 2160) {
    throw InputError(fmt::format(
        "turntable: {} frames, {} s, {} pixels; 1 to 720 frames, more than 0 to 3600 s and 64 to "
        "2160 pixels are allowed",
        o.frames, o.seconds, o.height_px));
  }
}

}  // namespace

Turntable MakeTurntable(const fs::path& run, const TurntableOptions& options,
                        const RunContext& context) {
  constexpr double kMargin = 1.06;
  CheckOptions(options);
  const std::array<TurnedBody, 2> bodies = ReadBodies(run);
  const Sweep sweep = MeasureSweep(bodies);
  Turntable table{.glb = TurntableGlb(bodies, sweep, options.seconds), .frames = {}};
  const double height_mm = kMargin * sweep.height_mm;
  const double aspect = 2 * kMargin * sweep.radius_mm / height_mm;
  const RenderOptions look{.width = std::max(16, static_cast<int>(options.height_px * aspect)),
                           .height = options.height_px};
  std::array<TurnPainter, 2> painters = {TurnPainter(bodies[0].scene),
                                         TurnPainter(bodies[1].scene)};
  for (int k = 0; k < options.frames; ++k) {
    context.ThrowIfStopped();
    context.Report("frames", "", static_cast<double>(k) / options.frames);
    const Camera camera = CameraAt(2 * std::numbers::pi * k / options.frames, sweep, height_mm);
    const std::array pictures = {painters[0].Paint(camera, look, context.threads),
                                 painters[1].Paint(camera, look, context.threads)};
    table.frames.push_back({fmt::format("frame_{:03}.png", k), EncodePng(ContactSheet(pictures))});
  }
  return table;
}

}  // namespace semblance::problems
