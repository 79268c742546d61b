// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/bust/bust_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <utility>

#include "problems/face/bust/whole_head.h"
#include "problems/face/ict_face.h"
#include "problems/face/skin_landmarks.h"
#include "problems/face/template_placement.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/base/lower_case.h"
#include "surfaces/mesh/mesh_query.h"
#include "surfaces/mesh_files/mesh_io.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;

// The mesh of an H-spline head. More columns and rows show finer detail and make larger files.
constexpr int kColumns = 272, kRows = 204;

std::map<std::string, Vec3> SitePoints(const TemplateFace& face) {
  std::map<std::string, Vec3> sites;
  for (const auto& [code, uv] : face.site_uv) {
    sites[code] = face.surface.Point(uv);
  }
  return sites;
}

BustModel MakeModel(const WholeHead& head, TemplateFace face, std::string name) {
  BustModel bust{.name = std::move(name),
                 .mesh = WholeHeadMesh(head, kColumns, kRows),
                 .eyeballs = head.eyeballs,
                 .rest = std::move(face),
                 .sites = {},
                 .obj = std::nullopt};
  bust.sites = SitePoints(*bust.rest);
  return bust;
}

std::optional<BustModel> Load(const NoBust&, const TemplateSource&, const RunContext&) {
  return std::nullopt;
}

std::optional<BustModel> Load(const IctBust&, const TemplateSource& face_template,
                              const RunContext&) {
  // The head was made around the model's own mean.
  BustModel bust = MakeModel(WholeHeadFromJson(IctHead(), "the ICT head"),
                             LoadTemplate(IctTemplate{.mean = IctMean::kModel}), "the ICT head");
  if (!std::holds_alternative<IctTemplate>(face_template)) {
    bust.rest.reset();
  }
  return bust;
}

std::optional<BustModel> Load(const AutoBust&, const TemplateSource& face_template,
                              const RunContext& context) {
  return std::holds_alternative<IctTemplate>(face_template)
             ? Load(IctBust{}, face_template, context)
             : std::nullopt;
}

std::optional<BustModel> Load(const HSplineBust& source, const TemplateSource& face_template,
                              const RunContext&) {
  constexpr double kFarthest_mm = 3;  // of the template's sites from the head
  if (source.file.empty()) {
    throw InputError("it names no file; `semblance template --bust` writes one");
  }
  const std::string name = source.file.string();
  BustModel bust = MakeModel(WholeHeadFromJson(ReadFileBytes(source.file), name),
                             LoadTemplate(face_template), name);
  const MeshQuery query(bust.mesh);
  for (const auto& [code, point] : bust.sites) {
    const double off = query.Closest(point).distance_mm;
    if (off > kFarthest_mm) {
      throw InputError(fmt::format(
          "{}: the template's site '{}' is {:.1f} mm off this head: it is another template's; make "
          "both with one call of `semblance template --bust`",
          name, code, off));
    }
  }
  return bust;
}

void CheckOnePiece(const TriMesh& mesh, const std::string& name) {
  const Components pieces = ConnectedComponents(mesh);
  if (pieces.count > 1) {
    std::vector<int> sizes(pieces.count, 0);
    for (const int piece : pieces.of_triangle) {
      ++sizes[piece];
    }
    throw InputError(fmt::format(
        "{}: a bust is one piece, and this mesh has {}; the largest has {} of {} triangles; join "
        "them or leave the others out",
        name, pieces.count, *std::ranges::max_element(sizes), mesh.triangles.size()));
  }
}

std::optional<BustModel> Load(const MeshBust& source, const TemplateSource&,
                              const RunContext& context) {
  if (source.mesh.empty() || source.landmarks.empty()) {
    throw InputError(fmt::format("it names no {}; both a mesh and its landmarks are needed",
                                 source.mesh.empty() ? "mesh" : "landmarks"));
  }
  BustModel bust{.name = source.mesh.filename().string(),
                 .mesh = ReadMesh(source.mesh),
                 .eyeballs = {},
                 .rest = std::nullopt,
                 .sites = {},
                 .obj = std::nullopt};
  const std::string name = source.mesh.string();
  const std::array files = {source.landmarks};
  const OuterHead outer = PrepareHead(bust.mesh, ReadSkinLandmarks(files), name, context);
  CheckOnePiece(bust.mesh, name);
  for (const SkinLandmark& landmark : outer.points) {
    bust.sites[landmark.code] = landmark.point;
  }
  if (LowerCase(source.mesh.extension().string()) == ".obj") {
    bust.obj = ReadObjText(source.mesh);
  }
  return bust;
}

}  // namespace

std::optional<BustModel> LoadBust(const BustSource& source, const TemplateSource& face_template,
                                  const RunContext& context) {
  return std::visit([&](const auto& given) { return Load(given, face_template, context); }, source);
}

std::vector<fs::path> BustFiles(const BustSource& source) {
  if (const auto* hspline = std::get_if<HSplineBust>(&source)) {
    return {hspline->file};
  }
  if (const auto* mesh = std::get_if<MeshBust>(&source)) {
    std::vector<fs::path> files = {mesh->mesh, mesh->landmarks};
    std::ranges::copy(MaterialFiles(mesh->mesh), std::back_inserter(files));
    return files;
  }
  return {};
}

}  // namespace semblance::problems
