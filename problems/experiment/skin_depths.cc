// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/skin_depths.h"

#include <fmt/format.h>

#include "interp/evaluation/depth_truth.h"
#include "surfaces/base/error.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {
namespace {

interp::TruthMap MeasureAt(const std::vector<Dowel>& dowels, const TriMesh& skin,
                           const DepthTruthOptions& options, const RunContext& context) {
  TriMesh bases;
  std::vector<Vec3> directions;
  for (const Dowel& dowel : dowels) {
    bases.points.push_back(dowel.base);
    directions.push_back(dowel.direction);
  }
  const TriMesh outside = Submesh(skin, SeenFromOutside(skin, context.threads));
  return MeasureDepthTruth(bases, directions, outside, options, context).along_direction;
}

}  // namespace

std::vector<std::string> MeasureOnSkin(const Experiment& experiment, const MeshQuery& skull,
                                       const RunContext& context, SubjectData& subject) {
  if (!subject.skin) {
    throw InputError(
        "tissue.depths: skin: the subject has no true skin to measure on; name one under "
        "subject.skin, or take `table` or `measured`");
  }
  std::vector<Landmark>& landmarks = subject.landmarks.landmarks;
  const std::vector<Dowel> dowels =
      PlaceDowels(subject.landmarks, subject.skull, skull, experiment.landmarks);
  const interp::TruthMap truth = MeasureAt(dowels, *subject.skin, experiment.depth_truth, context);
  std::vector<std::string> notes;
  for (std::size_t k = 0; k < dowels.size(); ++k) {
    Landmark& landmark = landmarks.at(k);
    landmark.depth_along_normal_mm.reset();
    landmark.depth_closest_mm.reset();
    if (truth.status[k] == interp::TruthStatus::kValid) {
      landmark.depth_along_normal_mm = truth.depth_mm[k];
    } else {
      notes.push_back(fmt::format("site {}: no depth along the normal: {}",
                                  DescribeSite(landmark.site),
                                  interp::DescribeStatus(truth.status[k])));
    }
  }
  return notes;
}

}  // namespace semblance::problems
