// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/relaxation/relaxation.h"

#include <type_traits>
#include <vector>

#include "fitting/relaxation/dowel_mesh.h"
#include "fitting/relaxation/relaxer.h"

namespace semblance {

std::optional<NetworkMoves> MovesOf(const Relaxation& relaxation) {
  return std::visit(
      []<class R>(const R& chosen) -> std::optional<NetworkMoves> {
        if constexpr (std::is_base_of_v<NetworkMoves, R>) {
          return chosen;
        } else if constexpr (std::is_base_of_v<PointMoves, R>) {
          return NetworkMoves{chosen, /*bunching=*/0, /*distortion=*/0, /*crease=*/0};
        } else {
          return std::nullopt;
        }
      },
      relaxation);
}

DowelMesh NetworkOf(const HSplineSurface& rest, const FitTarget& target,
                    const NetworkMoves& moves) {
  std::vector<Vec2> uv;
  for (const FitPoint& p : target.points) {
    uv.push_back(p.uv);
  }
  const bool linked =
      moves.barrier || moves.bunching > 0 || moves.distortion > 0 || moves.crease > 0;
  return {rest, uv, linked ? DowelLinks::kDelaunay : DowelLinks::kNone};
}

RelaxationSummary Relax(const HSplineSurface& surface, const HSplineSurface& rest,
                        const DowelMesh& mesh, const NetworkMoves& moves, FitTarget& target,
                        const MeasuredPenalties& measured) {
  Relaxer relaxer(surface, rest, mesh, moves, target);
  RelaxationSummary summary;
  if (measured.before) {
    summary.before = relaxer.Penalties();
  }
  for (int round = 0; round < moves.rounds; ++round) {
    relaxer.Round(summary);
  }
  if (measured.after) {
    summary.after = relaxer.Penalties();
  }
  MovePoints(surface, relaxer.uv(), target, summary);
  return summary;
}

}  // namespace semblance
