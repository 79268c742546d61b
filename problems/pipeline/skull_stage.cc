// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/pipeline/skull_stage.h"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <string>

#include "problems/pipeline/dowel_projection.h"
#include "problems/pipeline/extra_dowels.h"
#include "problems/pipeline/implicit_cache.h"
#include "problems/pipeline/stage_key.h"

namespace semblance {
namespace {

// What the dowels do not tell of the process that they are taken for.
void NoteEnds(const DepthField& depth, std::vector<std::string>& notes) {
  for (const std::string& words :
       depth.process ? depth.process->at_end : std::vector<std::string>()) {
    notes.push_back(fmt::format(
        "interp: {}, and the likelihood would go on; the dowels do not determine it. Set "
        "length_mm or signal_mm, or a smaller length_prior_spread",
        words));
  }
}

DepthStage Make(const Experiment& e, StageCache& cache, StepClock& step,
                const RunContext& context) {
  constexpr double kLeastDepth_mm = 1;
  const auto data = step("load subject", [&] {
    return cache.Get<SubjectData>(StageKey("subject", e.subject),
                                  [&] { return LoadSubject(e.subject, context); });
  });
  Case subject = MakeCase(*data, e);
  const auto shell = step("fill skull", [&] {
    return cache.Get<TriMesh>(StageKey("shell", e.subject, e.fill),
                              [&] { return FillSkull(data->skull, e.fill, context); });
  });
  const auto* const wrap = std::get_if<WrapFill>(&e.fill);
  TriMesh pressed =
      wrap ? IndentShell(*shell, subject.dowels_on_bone, data->skull, wrap->press_mm) : *shell;
  ProjectedDowels projected = ProjectOntoShell(subject.dowels_on_bone, pressed, kLeastDepth_mm);
  subject.notes.insert(subject.notes.end(), projected.notes.begin(), projected.notes.end());
  std::vector<Vec3> normals = VertexNormals(pressed);
  ProjectedDowels expected = ProjectOntoShell(subject.expected_on_bone, pressed, kLeastDepth_mm);
  ProjectedDowels scored = ProjectOntoShell(subject.scored_on_bone, pressed, kLeastDepth_mm);
  DepthStage stage{std::move(subject),
                   std::move(pressed),
                   std::move(normals),
                   std::move(projected.dowels_on_shell),
                   std::move(expected.dowels_on_shell),
                   std::move(scored.dowels_on_shell),
                   {}};
  stage.depth = step("interpolate depth", [&] {
    return ApplyOutsideRule(e.outside, stage.Input(),
                            InterpolateDepth(e.interp, stage.Input(), context), context);
  });
  NoteEnds(stage.depth, stage.subject.notes);
  FillOpenDowels(stage.shell, stage.depth, stage.subject);
  return stage;
}

// All that the depth comes from. The generic face is among it where a dowel is placed by its (u,v).
std::string KeyOfDepth(const Experiment& e) {
  std::string key = StageKey("depth", e.subject, e.landmarks, e.tissue, e.sites, e.network,
                             e.interp, e.outside, e.fill);
  return std::ranges::any_of(e.sites, [](const auto& entry) { return entry.second.uv.has_value(); })
             ? key + StageKey("placed on", e.face_template, e.placement)
             : key;
}

}  // namespace

std::shared_ptr<const DepthStage> MakeDepthStage(const Experiment& e, StageCache& cache,
                                                 StepClock& step, const RunContext& context) {
  return cache.Get<DepthStage>("stage " + KeyOfDepth(e),
                               [&] { return Make(e, cache, step, context); });
}

namespace {

// The shell's depths, none on the lid that closes it where the scan was cut off: for a face that is
// to end there.
std::vector<double> DepthsToTheEnds(const DepthStage& stage, std::span<const CutPlane> cuts) {
  constexpr double kLid_mm = 1;
  std::vector<double> depth_mm = stage.depth.depth_mm;
  for (const CutPlane& plane : cuts) {
    for (std::size_t v = 0; v < depth_mm.size(); ++v) {
      depth_mm[v] = plane.Beyond_mm(stage.shell.points[v]) > -kLid_mm ? kNaN : depth_mm[v];
    }
  }
  return depth_mm;
}

}  // namespace

std::shared_ptr<const SkullStage> MakeSkullStage(const Experiment& e, StageCache& cache,
                                                 StepClock& step, const RunContext& context) {
  return cache.Get<SkullStage>(StageKey("skull stage", e.implicit) + KeyOfDepth(e), [&] {
    auto depth = MakeDepthStage(e, cache, step, context);
    const TriMesh& skull = depth->subject.skull;
    std::vector<BoneOrigin> origin = step("observed bone", [&] {
      return OriginOfShell(depth->shell, skull, depth->subject.origin, context.threads);
    });
    std::vector<CutPlane> cuts = FindCutPlanes(skull);
    ImplicitFace implicit = step("implicit face", [&] {
      return CachedImplicitFace(depth->shell,
                                e.implicit.ends == FaceEnds::kOpen ? DepthsToTheEnds(*depth, cuts)
                                                                   : depth->depth.depth_mm,
                                e.implicit, cache.disk(), context);
    });
    return SkullStage{std::move(depth), std::move(origin), std::move(cuts), std::move(implicit)};
  });
}

}  // namespace semblance
