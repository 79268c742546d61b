// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/adaptive_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "fitting/adaptive/refinement_marking.h"
#include "fitting/adaptive/tree_solver.h"

namespace semblance {
namespace {

class AdaptiveFitter {
 public:
  AdaptiveFitter(const HSplineSurface& start, const HSplineSurface& rest, const FitTarget& target,
                 const FitOptions& options, const RunContext& context)
      : rest_(rest),
        given_(target),
        options_(options),
        context_(context),
        moves_(MovesOf(options.relaxation)),
        cloud_(start.shape(), target),
        tree_(start, rest, cloud_),
        points_(PointsOf(options.terms), cloud_, tree_, context.threads),
        solver_(rest, options.terms, cloud_, tree_, points_) {
    if (moves_) {
      moved_ = target;
      mesh_.emplace(NetworkOf(rest, target, *moves_));
    }
  }

  FitResult Run() {
    FitResult result{.surface = rest_};
    points_.Measure();
    for (bool more = true; more;) {
      context_.ThrowIfStopped();
      context_.Report(
          "fit", fmt::format("{} vertices to level {}", tree_.unknowns().size(), tree_.finest()));
      result.levels.push_back(solver_.Solve(SolveTolerance::kLoose));
      if (mesh_) {
        result.relaxations.push_back(MovePoints());
      }
      const std::vector<VertexId> finer =
          MarkForRefinement(tree_, std::get<AdaptivePlan>(options_.plan));
      more = !finer.empty();
      if (more) {
        tree_.Edit(finer);
        points_.Measure();
      }
    }
    points_.Settle();
    points_.Measure();
    result.levels.push_back(solver_.Solve(SolveTolerance::kTight));
    solver_.MeasureCoverage(result.levels.back());
    Finish(result);
    return result;
  }

 private:
  const FitTarget& target() const { return mesh_ ? moved_ : given_; }

  RelaxationSummary MovePoints() {
    const RelaxationSummary summary = Relax(tree_.Surface(), rest_, *mesh_, *moves_, moved_);
    cloud_ = PointCloud(tree_.shape(), moved_);
    tree_.Rebin();
    points_.Measure();
    return summary;
  }

  void Finish(FitResult& result) {
    result.surface = tree_.Surface();
    std::vector<double> squares;
    tree_.Measure({}, context_.threads, &squares);
    result.point_rms_mm = std::sqrt(tree_.Squares() / cloud_.weight_sum());
    result.residual_mm.resize(squares.size());
    double dowels = 0, weights = 0;
    for (std::size_t k = 0; k < squares.size(); ++k) {
      result.residual_mm[cloud_.Given(k)] = std::sqrt(squares[k]);
      if (target().points[cloud_.Given(k)].role != PointRole::kSeed) {
        dowels += cloud_.points()[k].weight * squares[k];
        weights += cloud_.points()[k].weight;
      }
    }
    result.dowel_rms_mm = weights > 0 ? std::sqrt(dowels / weights) : kNaN;
    result.uv.reserve(squares.size());
    for (const FitPoint& p : target().points) {
      result.uv.push_back(p.uv);
    }
    result.restored_features = 0;
    result.usable = std::all_of(result.levels.begin(), result.levels.end(),
                                [](const LevelSummary& s) { return s.usable; });
  }

  const HSplineSurface& rest_;
  const FitTarget& given_;
  const FitOptions& options_;
  const RunContext& context_;
  std::optional<NetworkMoves> moves_;
  FitTarget moved_;  // the points as relaxation has left them; unused without
  std::optional<DowelMesh> mesh_;
  PointCloud cloud_;
  OffsetTree tree_;
  RobustPointResiduals points_;
  TreeSolver solver_;
};

}  // namespace

FitResult FitAdaptively(const HSplineSurface& start, const HSplineSurface& rest,
                        const FitTarget& target, const FitOptions& options,
                        const RunContext& context) {
  return AdaptiveFitter(start, rest, target, options, context).Run();
}

}  // namespace semblance
