// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/skull_stage.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>

#include "problems/experiment/dowel_projection.h"
#include "problems/experiment/experiment_config.h"
#include "problems/experiment/extra_dowels.h"
#include "problems/experiment/limit_depths.h"
#include "problems/io/manifest.h"
#include "problems/subject/average_skull.h"
#include "problems/subject/sites.h"
#include "surfaces/base/encoding.h"
#include "surfaces/base/error.h"
#include "surfaces/mesh/refine_mesh.h"

namespace semblance::problems {
namespace {

template <class T>
requires std::is_trivially_copyable_v<T>
void Append(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

void Append(std::string& bytes, std::span<const double> values) {
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
}

void Append(std::string& bytes, const TriMesh& mesh) {
  Append(bytes, mesh.points.size());
  Append(bytes, mesh.triangles.size());
  for (const Vec3& point : mesh.points) {
    Append(bytes, std::span<const double>(point.data(), 3));
  }
  for (const Triangle& triangle : mesh.triangles) {
    Append(bytes, triangle);
  }
}

// Takes values off the front. If the bytes run out, all later values are invalid and
// WholeAndEmpty() is false.
class Reader {
 public:
  explicit Reader(std::string_view bytes) : rest_(bytes) {}

  template <class T>
  requires std::is_trivially_copyable_v<T>
  void Take(T& value) { Take(&value, sizeof(T)); }
  void Take(TriMesh& mesh) {
    mesh.points.resize(TakeCount(3 * sizeof(double)));
    mesh.triangles.resize(TakeCount(sizeof(Triangle)));
    for (Vec3& point : mesh.points) {
      Take(point.data(), 3 * sizeof(double));
    }
    for (Triangle& triangle : mesh.triangles) {
      Take(triangle);
    }
  }
  void Take(std::string& text) {
    text.resize(TakeCount(1));
    Take(text.data(), text.size());
  }
  // A count of items of bytes_each bytes; 0 if fewer bytes are left.
  std::size_t TakeCount(std::size_t bytes_each) {
    std::size_t count = 0;
    Take(count);
    whole_ &= count <= rest_.size() / bytes_each;
    return whole_ ? count : 0;
  }
  bool WholeAndEmpty() const { return whole_ && rest_.empty(); }

 private:
  void Take(void* to, std::size_t size) {
    whole_ &= size <= rest_.size();
    if (whole_ && size > 0) {
      std::memcpy(to, rest_.data(), size);
      rest_.remove_prefix(size);
    }
  }

  std::string_view rest_;
  bool whole_ = true;
};

std::string MakeKey(const TriMesh& shell, std::span<const double> depth_mm,
                    const ImplicitFaceOptions& options) {
  std::string made_from = StageKey("implicit face", options) + ProgramHash();
  Append(made_from, shell);
  Append(made_from, depth_mm);
  return Sha256OfText(made_from);
}

}  // namespace

std::string ToBytes(const ImplicitFace& face) {
  std::string bytes;
  Append(bytes, face.dense);
  Append(bytes, face.mesh);
  Append(bytes, face.cell_mm);
  Append(bytes, face.emitters);
  Append(bytes, face.emitters_per_square_depth);
  Append(bytes, face.dropped_components);
  Append(bytes, face.counts);
  Append(bytes, face.decimation);
  Append(bytes, face.notes.size());
  for (const std::string& note : face.notes) {
    Append(bytes, note.size());
    bytes += note;
  }
  return bytes;
}

std::optional<ImplicitFace> ImplicitFaceFrom(std::string_view bytes) {
  Reader reader(bytes);
  ImplicitFace face;
  reader.Take(face.dense);
  reader.Take(face.mesh);
  reader.Take(face.cell_mm);
  reader.Take(face.emitters);
  reader.Take(face.emitters_per_square_depth);
  reader.Take(face.dropped_components);
  reader.Take(face.counts);
  reader.Take(face.decimation);
  face.notes.resize(reader.TakeCount(sizeof(std::size_t)));
  for (std::string& note : face.notes) {
    reader.Take(note);
  }
  return reader.WholeAndEmpty() ? std::optional(std::move(face)) : std::nullopt;
}

ImplicitFace CachedImplicitFace(const TriMesh& shell, std::span<const double> depth_mm,
                                const ImplicitFaceOptions& options, const DiskCache* cache,
                                const RunContext& context) {
  if (!cache) {
    return BuildImplicitFace(shell, depth_mm, options, context);
  }
  const std::string key = MakeKey(shell, depth_mm, options);
  if (const std::optional<std::string> bytes = cache->Get(key)) {
    if (std::optional<ImplicitFace> face = ImplicitFaceFrom(*bytes)) {
      return std::move(*face);
    }
  }
  ImplicitFace face = BuildImplicitFace(shell, depth_mm, options, context);
  cache->Put(key, ToBytes(face));
  return face;
}

namespace {

// Notes the parameters of the depth process that the dowels do not determine.
void NoteEnds(const DepthField& depth, std::vector<std::string>& notes) {
  for (const std::string& words :
       depth.process ? depth.process->at_end : std::vector<std::string>()) {
    notes.push_back(fmt::format(
        "interp: {}, and the likelihood would go on; the dowels do not determine it. Set "
        "length_mm or signal_mm, or a smaller length_prior_spread",
        words));
  }
}

// The rotation from the subject's frame to that of the average skull, or none without three sites.
// Alpha wrapping and marching cubes work along their axes. They do so in this frame, so that the
// face turns with the skull.
Mat3 FindUpright(const SubjectData& data) {
  constexpr std::size_t kFewestSites = 3;
  std::vector<SitePoint> sites;
  for (const Landmark& landmark : data.landmarks.landmarks) {
    if (IsStandardSite(landmark.site)) {
      sites.push_back({landmark.site, landmark.Position()});
    }
  }
  return sites.size() < kFewestSites
             ? Mat3(Mat3::Identity())
             : Mat3(FitAverageSkull(sites).skull_from_average.rotation.transpose());
}

TriMesh Rotated(TriMesh mesh, const Mat3& rotation) {
  for (Vec3& p : mesh.points) {
    p = rotation * p;
  }
  return mesh;
}

// A depth is linear across a triangle, so without filling the face would depend on the size of a
// coarse mesh's triangles. A phantom's triangles are an option, its rings, and a depth map is one
// of the skull's vertices.
bool RefinesUnfilled(const Experiment& e) {
  return !std::holds_alternative<PhantomOptions>(e.subject) &&
         !std::holds_alternative<interp::DepthMap>(WayToDepth(e));
}

TriMesh FillUpright(const SubjectData& data, const Experiment& e, const RunContext& context) {
  if (std::holds_alternative<NoFill>(e.fill)) {
    return RefinesUnfilled(e) ? RefineTo(data.skull, kEdgeForSums_mm) : data.skull;
  }
  const Mat3 upright = FindUpright(data);
  return Rotated(FillSkull(Rotated(data.skull, upright), e.fill, context), upright.transpose());
}

std::string SchemeName(const DepthScheme& scheme) {
  return std::visit(
      []<class Scheme>(const Scheme& options) {
        if constexpr (std::is_same_v<Scheme, ExternalScheme>) {
          return options.name;
        } else {
          return std::string(Scheme::kName);
        }
      },
      scheme);
}

// Refuses a field without a depth of the scheme: the rule `outside` would fill all of it, and its
// depths would pass for the scheme's. Adds a note if a scheme that may leave vertices out did so.
void CheckAssigned(const DepthScheme& scheme, DepthField& depth) {
  const auto all = depth.status.size();
  const auto assigned =
      static_cast<std::size_t>(std::ranges::count(depth.status, DepthStatus::kAssigned));
  if (assigned == 0) {
    throw InputError(fmt::format(
        "interp: {} gave no depth to any of the {} vertices of the skull, so that all depths would "
        "be those of the rule `outside`; check that it belongs to this skull, and its result",
        SchemeName(scheme), all));
  }
  if (assigned < all && (std::holds_alternative<ExternalScheme>(scheme) ||
                         std::holds_alternative<DepthMap>(scheme))) {
    depth.notes.push_back(fmt::format(
        "interp: {} gave no depth to {} of the {} vertices of the skull; the rule `outside` gives "
        "them theirs",
        SchemeName(scheme), all - assigned, all));
  }
}

DepthStage BuildDepthStage(const Experiment& e, StageCache& cache, StepClock& step,
                           const RunContext& context) {
  constexpr double kLeastDepth_mm = 1;  // of a dowel on the shell
  const auto data = step("load subject", [&] {
    return cache.Get<SubjectData>(StageKey("subject", e.subject),
                                  [&] { return LoadSubject(e.subject, context); });
  });
  Case subject = MakeCase(*data, e, context);
  const auto shell = step("fill skull", [&] {
    const char* const stage = RefinesUnfilled(e) ? "shell" : "shell as given";
    return cache.Get<TriMesh>(StageKey(stage, e.subject, e.fill),
                              [&] { return FillUpright(*data, e, context); });
  });
  const auto* const wrap = std::get_if<WrapFill>(&e.fill);
  TriMesh pressed =
      wrap ? IndentShell(*shell, subject.dowels_on_bone, data->skull, wrap->press_mm) : *shell;
  const MeshQuery query(pressed);
  const auto project = [&](std::span<const Dowel> dowels_on_bone) {
    return ProjectOntoShell(dowels_on_bone, pressed, query, kLeastDepth_mm);
  };
  ProjectedDowels projected = project(subject.dowels_on_bone);
  subject.notes.insert(subject.notes.end(), projected.notes.begin(), projected.notes.end());
  std::vector<Vec3> normals = VertexNormals(pressed);
  ProjectedDowels expected = project(subject.expected_on_bone);
  ProjectedDowels scored = project(subject.scored_on_bone);
  DepthStage stage{std::move(subject),
                   FindUpright(*data),
                   std::move(pressed),
                   std::move(normals),
                   std::move(projected.dowels_on_shell),
                   std::move(expected.dowels_on_shell),
                   std::move(scored.dowels_on_shell),
                   {},
                   !std::holds_alternative<NoFill>(e.fill)};
  stage.depth = step("interpolate depth", [&] {
    const DepthScheme scheme = WayToDepth(e);
    DepthField depth = InterpolateDepth(scheme, stage.Input(), context);
    CheckAssigned(scheme, depth);
    return ApplyOutsideRule(e.outside, stage.Input(), std::move(depth), context);
  });
  LimitDepths(e, stage.shell, stage.subject, stage.depth);
  stage.subject.notes.insert(stage.subject.notes.end(), stage.depth.notes.begin(),
                             stage.depth.notes.end());
  NoteEnds(stage.depth, stage.subject.notes);
  FillOpenDowels(stage.shell, stage.depth, stage.subject);
  return stage;
}

// The key of the depth. It includes the generic face if a dowel is placed by its (u,v).
std::string MakeDepthKey(const Experiment& e) {
  std::string key = StageKey("depth", e.subject, e.landmarks, e.tissue, e.sites, e.network,
                             WayToDepth(e), e.outside, e.fill, e.depth_truth);
  return std::ranges::any_of(e.sites, [](const auto& entry) { return entry.second.uv.has_value(); })
             ? key + StageKey("placed on", e.face_template, e.placement)
             : key;
}

}  // namespace

std::shared_ptr<const DepthStage> MakeDepthStage(const Experiment& e, StageCache& cache,
                                                 StepClock& step, const RunContext& context) {
  return cache.Get<DepthStage>("stage " + MakeDepthKey(e),
                               [&] { return BuildDepthStage(e, cache, step, context); });
}

namespace {

// The shell's depths, without those on the lids that close it where the scan was cut off. The face
// then ends there.
std::vector<double> DepthsToTheEnds(const DepthStage& stage, std::span<const CutPlane> cuts) {
  constexpr double kLid_mm = 1;  // vertices within this of the cut belong to the lid
  std::vector<double> depth_mm = stage.depth.depth_mm;
  for (const CutPlane& plane : cuts) {
    for (std::size_t v = 0; v < depth_mm.size(); ++v) {
      depth_mm[v] = plane.Beyond_mm(stage.shell.points[v]) > -kLid_mm ? kNaN : depth_mm[v];
    }
  }
  return depth_mm;
}

ImplicitFace UprightImplicitFace(const DepthStage& stage, std::span<const double> depth_mm,
                                 const ImplicitFaceOptions& options, const DiskCache* cache,
                                 const RunContext& context) {
  ImplicitFace face =
      CachedImplicitFace(Rotated(stage.shell, stage.upright), depth_mm, options, cache, context);
  face.dense = Rotated(std::move(face.dense), stage.upright.transpose());
  face.mesh = Rotated(std::move(face.mesh), stage.upright.transpose());
  return face;
}

}  // namespace

std::shared_ptr<const SkullStage> MakeSkullStage(const Experiment& e, StageCache& cache,
                                                 StepClock& step, const RunContext& context) {
  return cache.Get<SkullStage>(StageKey("skull stage", e.implicit) + MakeDepthKey(e), [&] {
    auto depth = MakeDepthStage(e, cache, step, context);
    const TriMesh& skull = depth->subject.skull;
    std::vector<BoneOrigin> origin = step("observed bone", [&] {
      return OriginOfShell(depth->shell, skull, depth->subject.origin, context.threads);
    });
    std::vector<CutPlane> cuts = FindCutPlanes(skull);
    const std::vector<double> depth_mm =
        e.implicit.ends == FaceEnds::kOpen ? DepthsToTheEnds(*depth, cuts) : depth->depth.depth_mm;
    ImplicitFace implicit = step("implicit face", [&] {
      return UprightImplicitFace(*depth, depth_mm, e.implicit, cache.disk(), context);
    });
    auto field = std::make_shared<const ImplicitSurface>(depth->shell, depth_mm, e.implicit.field);
    return SkullStage{std::move(depth), std::move(origin), std::move(cuts), std::move(implicit),
                      std::move(field)};
  });
}

}  // namespace semblance::problems
