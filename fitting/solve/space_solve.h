// SPDX-License-Identifier: GPL-3.0-or-later
// The least-squares fit of a hierarchical space: of a level alone, which is the space with one
// level, or of all levels at once, again and again on finer vertices (AdaptivePlan).
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "fitting/problem/fit_schedule.h"
#include "fitting/solve/ceres_solver.h"
#include "fitting/solve/level_fit.h"
#include "fitting/solve/refinement_marking.h"
#include "fitting/solve/space_system.h"
#include "fitting/space/hierarchical_spline_space.h"
#include "fitting/space/point_cloud.h"

namespace semblance {

// How far a step may move the surface, of its size, and be the last.
enum class SolveTolerance { kLoose, kTight };

// Of all levels at once. All but the terms must outlive the solve.
struct SpaceProblem {
  const HSplineSurface& start;
  const HSplineSurface& rest;  // the template, of the same shape
  const FitTarget& target;
  std::span<const Term> terms;
  std::span<const VertexId> held = {};  // that a PriorTerm with held_only looks at
  Solver solver = Solver::kCeres;
  int threads = 1;
  bool settled = false;  // from the start; see Settle
};

// Two ways to the same minimum. With `fastest`, and terms that treat x, y and z alike, damped
// Gauss-Newton steps by one sparse Cholesky factor, assembled from moments of each leaf's points
// (with terms that couple x, y and z and are linear: one factor over all coordinates); else Ceres,
// with a view of the space, which takes rows: those are reduced by QR and keep the condition that
// moments square. Either goes with a loss by iterative reweighting, unless a term couples x, y and
// z.
class SpaceSolve {
 public:
  // Throw InputError for sizes that disagree, more than one `weight: auto`, and a term that has
  // nothing to look at: no extent of the template, no foot on bone, no landmark.
  explicit SpaceSolve(const SpaceProblem& problem);
  SpaceSolve(LevelView level, std::span<const Term> terms, Solver solver);
  SpaceSolve(const SpaceSolve&) = delete;
  SpaceSolve& operator=(const SpaceSolve&) = delete;

  // After the target's points have moved.
  void SeePoints();
  // Chooses `weight: auto`, then goes to the minimum.
  LevelSummary Solve(SolveTolerance until, SolveReport report = SolveReport::kFull);
  // Adds the vertices that the plan asks for, those over exact points that are not met, and with a
  // term that pairs vertices their mirrors; false if there are none.
  bool Refine(const AdaptivePlan& plan);
  // Of the target's exact points: how far the unknowns are from holding them (exact_points.h).
  std::vector<double> ExactMisses() const;
  // More than rounding of so large a net: 1e-10 of its size.
  double LeastMiss_mm() const;
  // The last solve, tight, with what the points determine of it. From now on a loss is as wide as
  // its term has it; before, where the surface is still far from most points, at least three times
  // their median distance, so that it does not take them for outliers.
  LevelSummary Settle(SolveReport report = SolveReport::kFull);

  // By generalised cross-validation at the surface as it stands, around the weight of the last
  // time; NaN if no term is `auto`.
  double ChooseSmoothness();
  // Of some of the terms, at the surface as it stands.
  NormalSystem System(std::span<const Term> terms, SystemPart part = SystemPart::kBoth);
  // What the squared misfit of each point is multiplied by in the cost, with the factors that the
  // losses give it where the surface stands; in the order in which the points were given.
  std::vector<double> PointWeights() const;
  const LevelView& View();  // as the last solve began

  std::span<const Term> terms() const { return terms_; }  // with the weight that was chosen last
  ControlNet Values() const { return space_.Values(); }
  HSplineSurface Surface() const { return space_.Surface(); }
  HSplineSurface SurfaceAfter(const Eigen::MatrixX3d& step) const;  // step: a row per unknown
  int dofs() const { return static_cast<int>(space_.dofs().size()); }
  int finest() const { return space_.finest(); }

 private:
  struct Standing {
    double rms_mm = kNaN;            // of the points, weighted
    std::vector<double> costs = {};  // of each term, mm^2; none without a report
  };

  void Begin();
  void EditMirrors();
  double Shift(const NormalSystem& system) const;
  double Move(const Eigen::MatrixX3d& step, const Eigen::MatrixX3d& right);
  double Take(const ControlNet& net);
  SolverOutcome Descend(SolveTolerance until);
  Eigen::MatrixX3d StepBy(const SparseFactor& factor, const NormalSystem& system) const;
  SolverOutcome SolveAtOnce();
  SolverOutcome SolveWithCeres(SolveTolerance until);
  SolverOutcome Reweigh(double least_move);
  bool GoesDirectly() const;
  bool HasExact() const { return target_ != nullptr && !target_->exact.empty(); }
  std::vector<Vec2> Unmet() const;
  void Measure();
  std::vector<double> FactorsOf(const std::vector<double>& squares) const;
  std::vector<int> HeldRows() const;
  Standing Stand(SolveReport report);
  double CostOf(const Term& term);
  double LeastLossWidth_mm() const;
  double MaxMove() const;
  double Scale() const;  // of w |e|^2 in the cost
  double LandmarkShare(std::size_t k) const;
  bool AloneInItsLevel() const { return space_.finest() == 0; }
  bool HasLoss() const;
  void NoteCoverage(LevelSummary& summary);

  const FitTarget* target_ = nullptr;  // of all levels; null: `view_` is a level's, as given
  std::optional<LevelView> view_;      // without observations where no term takes rows of them
  HSplineSurface rest_;
  PointCloud cloud_;
  HierarchicalSplineSpace space_;  // measured, its points weighted by what the terms make of them
  std::vector<Term> terms_;
  std::vector<VertexId> held_;
  int auto_term_;  // or -1
  Solver solver_;
  int threads_ = 1;
  Vec2 lengths_mm_;
  ControlNet start_;             // the unknowns when the last solve began
  double chosen_ = 0;            // weight; 0: none yet
  bool settled_ = false;         // a loss is as wide as it will be
  bool weighed_ = false;         // points have factors: of a loss, or of landmarks
  double landmark_weight_ = 0;   // of all landmarks among the points
  double rms_mm_ = kNaN;         // without factors
  std::vector<double> squares_;  // with factors, of each point, in the cloud's order
};

}  // namespace semblance
