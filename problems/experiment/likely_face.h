// SPDX-License-Identifier: GPL-3.0-or-later
// The most likely face of a statistical model, given a subject's dowels and implicit face.
#pragma once

#include <cstdint>
#include <vector>

#include "problems/experiment/make_face.h"
#include "problems/face/face_source.h"

namespace semblance::problems {

struct LikelyFace {
  MadeFace made;       // the face as a placed template that was not fitted
  ShapeTarget target;  // what it was estimated from; refers to in.implicit
};

// Throws InputError as PriorTarget and EstimateShape do; Cancelled.
LikelyFace FindLikelyFace(const PriorUse& use, PlacedTemplate placed, const FaceInput& in,
                          const RunContext& context);

// With depths of a table the person's build is unknown. The tips carry this into sigma. Around
// sites without a dowel, for example where no bone was scanned, no tip does, so this function adds
// the deviation of the nearest site. on_mean: positions on the prior's mean, one per sigma.
void WidenWhereNoDowelIs(const FacePrior& prior, std::span<const Dowel> dowels,
                         const TableDepthOptions& table, std::span<const Vec3> on_mean,
                         std::vector<double>& sigma_mm);

// The random seeds of the faces to draw: use.draw, if it is not 0, and those of
// uncertainty.samples.
std::vector<std::uint64_t> ListDraws(const PriorUse& use, const UncertaintyOptions& options);
// The face moved as each shape that the estimate drew.
std::vector<HSplineSurface> MoveAsDrawn(const LoadedPrior& prior, const MadeFace& made);
// Takes the faces that were drawn with the seeds of ListDraws: the first one replaces the face
// itself if use.draw > 0, and the others are made.samples.
void TakeDraws(const PriorUse& use, std::vector<HSplineSurface> drawn, MadeFace& made);

// The part of a table's deviations by which each depth errs alone, and the part that all share.
TableDepthOptions SplitTableError(const TableDepthOptions& table, const Experiment& experiment);

}  // namespace semblance::problems
