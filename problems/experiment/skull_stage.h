// SPDX-License-Identifier: GPL-3.0-or-later
// The first half of the main job: from a subject to its depth, and on to its implicit face. It does
// not depend on the fit, so experiments that differ in the fit alone share it.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "problems/experiment/case.h"
#include "problems/experiment/stage_cache.h"
#include "problems/experiment/step_clock.h"
#include "problems/io/disk_cache.h"
#include "problems/subject/mirror.h"
#include "surfaces/implicit_face.h"
#include "surfaces/mesh/cut_planes.h"

namespace semblance::problems {

// ---------------------------------------------------------------------------------------------
// The cache of the implicit face, the longest step of a run, in a folder that processes share
// ---------------------------------------------------------------------------------------------

// BuildImplicitFace, or the cached result that the same build of the program made from the same
// shell, depths and options, to the bit. cache: may be null. Throws as BuildImplicitFace does.
ImplicitFace CachedImplicitFace(const TriMesh& shell, std::span<const double> depth_mm,
                                const ImplicitFaceOptions& options, const DiskCache* cache,
                                const RunContext& context);

// A face as bytes in this machine's format, and back. None if the bytes are no face.
std::string ToBytes(const ImplicitFace& face);
std::optional<ImplicitFace> ImplicitFaceFrom(std::string_view bytes);

// ---------------------------------------------------------------------------------------------
// The stages
// ---------------------------------------------------------------------------------------------

struct DepthStage {
  Case subject;
  Mat3 upright;               // rotates the subject's frame to that of the average skull
  TriMesh shell;              // outer shell of the skull with bridged temples and gaps; it emits
  std::vector<Vec3> normals;  // of the shell's vertices
  std::vector<Dowel> dowels_on_shell;    // subject.dowels_on_bone, projected onto the shell
  std::vector<Dowel> expected_on_shell;  // subject.expected_on_bone, projected
  std::vector<Dowel> scored_on_shell;    // subject.scored_on_bone, projected
  DepthField depth;                      // of the shell's vertices, after the outside rule
  bool filled = false;                   // the shell is more than the bone (`fill`)

  DepthInput Input() const {
    return {shell,           normals,           dowels_on_shell,
            subject.network, expected_on_shell, filled ? &subject.skull : nullptr};
  }
};

// Loads the case, fills the skull and interpolates depth. Takes each from `cache` if it was made
// from the same options before. Throws as LoadSubject does, and Cancelled.
std::shared_ptr<const DepthStage> MakeDepthStage(const Experiment& experiment, StageCache& cache,
                                                 StepClock& step, const RunContext& context);

struct SkullStage {
  std::shared_ptr<const DepthStage> depth_stage;
  std::vector<BoneOrigin> origin;  // of the shell's triangles
  std::vector<CutPlane> cuts;      // the planes at which the subject's skull is cut off
  ImplicitFace implicit;
  std::shared_ptr<const ImplicitSurface> field;  // the surface whose polygons `implicit` has
};

// The depth stage and the implicit face.
std::shared_ptr<const SkullStage> MakeSkullStage(const Experiment& experiment, StageCache& cache,
                                                 StepClock& step, const RunContext& context);

}  // namespace semblance::problems
