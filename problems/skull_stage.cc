// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/skull_stage.h"

#include "problems/implicit_cache.h"
#include "problems/shell_dowels.h"
#include "problems/stage_key.h"

namespace semblance {
namespace {

DepthField FindDepth(const Experiment& experiment, Case& subject, const TriMesh& shell,
                     const RunContext& context) {
  constexpr double kLeastDepth_mm = 1;
  const ShellDowels standing = StandOnShell(subject.dowels, shell, kLeastDepth_mm);
  subject.notes.insert(subject.notes.end(), standing.notes.begin(), standing.notes.end());
  const std::vector<Vec3> normals = VertexNormals(shell);
  const DepthInput input{shell, normals, standing.dowels, subject.network};
  return ApplyOutsideRule(experiment.outside, input,
                          InterpolateDepth(experiment.interp, input, context), context);
}

SkullStage Make(const Experiment& e, StageCache& cache, StepClock& step,
                const RunContext& context) {
  const auto data = step("load subject", [&] {
    return cache.Get<SubjectData>(StageKey("subject", e.subject),
                                  [&] { return LoadSubject(e.subject, context); });
  });
  Case subject = MakeCase(*data, e);
  const auto shell = step("fill skull", [&] {
    return cache.Get<TriMesh>(StageKey("shell", e.subject, e.fill),
                              [&] { return FillSkull(data->skull, e.fill, context); });
  });
  DepthField depth =
      step("interpolate depth", [&] { return FindDepth(e, subject, *shell, context); });
  ImplicitFace implicit = step("implicit face", [&] {
    return CachedImplicitFace(*shell, depth.depth_mm, e.implicit, cache.disk(), context);
  });
  return {std::move(subject), *shell, std::move(depth), std::move(implicit)};
}

}  // namespace

std::shared_ptr<const SkullStage> MakeSkullStage(const Experiment& e, StageCache& cache,
                                                 StepClock& step, const RunContext& context) {
  return cache.Get<SkullStage>(StageKey("skull stage", e.subject, e.landmarks, e.tissue, e.network,
                                        e.interp, e.outside, e.fill, e.implicit),
                               [&] { return Make(e, cache, step, context); });
}

}  // namespace semblance
