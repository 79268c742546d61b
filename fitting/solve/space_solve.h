// SPDX-License-Identifier: GPL-3.0-or-later
// The least-squares fit of a hierarchical space. LevelSolve fits one level, the space with a single
// level. AdaptiveSolve fits all levels at once, and again after each refinement (AdaptivePlan).
// Both minimise the sum of their terms (term.h).
//
// Solvers. All of them reach the same minimum:
//
//   solver   terms                               method
//   fastest  separable, perhaps with a loss      damped Gauss-Newton steps by one sparse Cholesky
//                                                factor, assembled from moments of each leaf's
//                                                points
//   fastest  linear, but some couple x, y and z  one factor over all coordinates (SolveCoupled)
//   ceres    separable                           a ceres::Problem per coordinate (SolveBlocked)
//   any      all others                          one ceres::Problem (SolveByCeres)
//
// A term is separable if it treats x, y and z alike. Ceres receives rows, which are compressed by
// QR and keep the condition that moments square. Separable terms with a loss are solved by
// iterative reweighting. If another term couples x, y and z, Ceres applies the loss itself.
//
// States of an AdaptiveSolve:
//
//                         UpdatePoints, Refine
//             +---------------------------+-----------------------------+
//             v                           |                             |
//   create -> READY ------Solve-----> SOLVED ------FinalSolve-----> FINAL
//             |                                                      ^
//             +----------------------- FinalSolve -------------------+
//
// A LevelSolve begins in READY with final loss widths, and has only Solve and FinalSolve.
//
// Invariants between two public calls:
//   1. The space is measured: the leaves' sums belong to the present unknowns. If the terms have a
//      loss or landmarks, the sums include the factors that follow from squares_, and weighed_ is
//      true.
//   2. start_ holds the unknowns at the beginning of the last solve, or after the last change of
//      the space.
//   3. View() describes the space, the points and start_.
//   4. With a symmetry term the mirror of each edited vertex is edited too, so the mirror image of
//      a patch is a patch.
//   5. Before FinalSolve each loss is at least three times the points' median distance wide,
//      because the surface is still far from most points, which would otherwise count as outliers.
//      After FinalSolve (final_loss_width_) a loss has the width of its term.
//   6. After a solve the exact points hold as nearly as the vertices allow.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "fitting/problem/fit_schedule.h"
#include "fitting/solve/ceres_solver.h"
#include "fitting/solve/level_summary.h"
#include "fitting/solve/refinement_marking.h"
#include "fitting/solve/space_system.h"
#include "fitting/space/hierarchical_spline_space.h"
#include "fitting/space/point_cloud.h"

namespace semblance::fitting {

// The accuracy of a solve: the last step moves the surface by less than 1e-4 of its size, or by
// less than 1e-13 (1e-12 with a loss), which is round-off.
enum class SolveTolerance { kLoose, kTight };

// The engine of both solves. It owns the space and its points.
class SpaceSolve {
 public:
  virtual ~SpaceSolve() = default;
  SpaceSolve(const SpaceSolve&) = delete;
  SpaceSolve& operator=(const SpaceSolve&) = delete;

  // Chooses the weight of a term with `weight: auto`, then finds the minimum.
  LevelSummary Solve(SolveTolerance until, SolveReport report = SolveReport::kFull);
  // Solves tightly with final loss widths (invariant 5). The full report also states the coverage
  // and rank of the points.
  LevelSummary FinalSolve(SolveReport report = SolveReport::kFull);

  // Chooses the weight of the `auto` term at the present surface by generalised cross-validation,
  // in a decade around its last value. Returns NaN if no term is `auto`. Throws InputError if no
  // weight has a usable solve.
  double ChooseSmoothness();
  // The normal equations of some of the terms at the present surface.
  NormalSystem System(std::span<const Term> terms, SystemPart part = SystemPart::kBoth);
  // The factor of each point's squared misfit in the cost, including that of a loss at the present
  // surface. The points are in their given order.
  std::vector<double> PointWeights() const;
  // The view for terms with rows (invariant 3). Valid until the next non-const call.
  virtual const LevelView& View() = 0;

  std::span<const Term> terms() const { return terms_; }  // with the weight that was chosen last
  ControlNet Values() const { return space_.Values(); }
  HSplineSurface Surface() const { return space_.Surface(); }
  HSplineSurface SurfaceAfter(const Eigen::MatrixX3d& step) const;  // step: a row per unknown
  int dofs() const { return static_cast<int>(space_.dofs().size()); }
  int finest() const { return space_.finest(); }

 protected:
  struct Problem {
    HSplineSurface start;
    HSplineSurface rest;  // the template
    PointCloud cloud;
    std::span<const Term> terms;
    Solver solver = Solver::kCeres;
    int threads = 1;
    Vec2 lengths_mm;
    double landmark_weight = 0;
    bool final_loss_width = false;
  };
  // The constructor of a derived class must end with Measure(), which establishes invariant 1.
  explicit SpaceSolve(Problem problem);

  // Records start_ (invariant 2).
  virtual void MarkStart() { start_ = space_.Values(); }
  // Measures the space and the points' distances (invariant 1).
  void Measure();

  HSplineSurface rest_;
  PointCloud cloud_;
  HierarchicalSplineSpace space_;
  std::vector<Term> terms_;
  int threads_;
  Vec2 lengths_mm_;
  double landmark_weight_;  // sum over the landmarks
  ControlNet start_;

 private:
  struct CostState {
    double rms_mm = kNaN;            // root mean square distance of the points, weighted
    std::vector<double> costs = {};  // of each term, mm^2; empty without a report
  };

  virtual bool IsLandmark(std::size_t k) const = 0;  // of point k of the cloud
  virtual std::span<const ExactPoint> exact() const { return {}; }

  bool IsDirect() const;
  bool HasLoss() const;
  bool HasOneLevel() const { return space_.finest() == 0; }

  SolverOutcome SolveByNewton(SolveTolerance until);
  SolverOutcome SolveWithOneFactor();
  SolverOutcome SolveWithCeres(SolveTolerance until);
  SolverOutcome SolveReweighted(double least_move);
  double DampingShift(const NormalSystem& system) const;
  Eigen::MatrixX3d ComputeStep(const SparseFactor& factor, const NormalSystem& system) const;
  double ApplyStep(const Eigen::MatrixX3d& step, const Eigen::MatrixX3d& right);
  double SetUnknowns(const ControlNet& net);

  CostState EvaluateCosts(SolveReport report);
  double Cost(const Term& term);
  double MaxMove() const;
  void AddCoverage(LevelSummary& summary);

  std::vector<double> LossFactors(const std::vector<double>& squares) const;
  double LandmarkFactor(std::size_t k) const;
  double LeastLossWidth_mm() const;
  double PointScale() const;  // factor of the sum of w |e|^2 in the cost

  int auto_term_;  // index of the `auto` term, or -1
  Solver solver_;
  double chosen_ = 0;            // weight of the `auto` term; 0: not chosen yet
  bool final_loss_width_;        // invariant 5
  bool weighed_ = false;         // invariant 1
  double rms_mm_ = kNaN;         // of the points with factors 1
  std::vector<double> squares_;  // |e|^2 of each point, in the cloud's order, if weighed_
};

// Fits one level.
class LevelSolve final : public SpaceSolve {
 public:
  // Throws InputError for sizes that disagree, more than one `weight: auto`, and a term without its
  // input: an extent of the template, a foot on bone, a landmark, or a prior's shape.
  LevelSolve(LevelView level, std::span<const Term> terms, Solver solver);
  const LevelView& View() override { return view_; }

 private:
  static Problem Prepare(LevelView& level, std::span<const Term> terms, Solver solver);
  bool IsLandmark(std::size_t k) const override { return view_.observations[k].landmark; }

  LevelView view_;  // without observations if no term needs rows of them
};

// The input of an AdaptiveSolve. The target must outlive the solve.
struct SpaceProblem {
  const HSplineSurface& start;
  const HSplineSurface& rest;  // the template, of the same shape
  const FitTarget& target;
  std::span<const Term> terms;
  std::span<const VertexId> held = {};  // vertices that a PriorTerm with held_only holds
  Solver solver = Solver::kCeres;
  int threads = 1;
  bool final_loss_width = false;  // from the first solve on (invariant 5)
};

// Fits all levels at once.
class AdaptiveSolve final : public SpaceSolve {
 public:
  // Throws InputError like LevelSolve.
  explicit AdaptiveSolve(const SpaceProblem& problem);
  const LevelView& View() override;

  // Adopts the target's points after they have moved.
  void UpdatePoints();

  // Adds the vertices that the plan requires, and those over exact points that do not hold. Returns
  // false if there are none.
  bool Refine(const AdaptivePlan& plan);
  // The distance by which each exact point is missed, mm (exact_points.h).
  std::vector<double> ExactMisses() const;
  // The largest miss that is round-off: 1e-10 of the net's size, mm.
  double MissTolerance_mm() const;

 private:
  void MarkStart() override;
  bool IsLandmark(std::size_t k) const override;
  std::span<const ExactPoint> exact() const override { return target_.exact; }
  void Edit(std::span<const VertexId> vertices);
  void EditMirrors();
  std::vector<Vec2> UnmetPlaces() const;
  std::vector<int> HeldRows() const;

  const FitTarget& target_;
  std::vector<VertexId> held_;
  std::optional<LevelView> view_;  // made on demand
};

struct LevelSolution {
  ControlNet net;
  LevelSummary summary;
};

// Minimises the sum of the terms over the control vertices of one level, seen as a plain B-spline.
// If the terms leave vertices undetermined, the solution nearest to view.start is taken: the steps
// are damped by a multiple of the identity, a proximal-point iteration that converges to it
// (thesis 4.2 does not treat this case). The order of the observations has no effect. Without a
// report the summary has no term costs, coverage or rank. Throws InputError like LevelSolve.
LevelSolution FitLevel(LevelView view, std::span<const Term> terms, Solver solver = Solver::kCeres,
                       SolveReport report = SolveReport::kFull);

// The same, but if the terms are of points alone, no vertex moves further than ten times the
// largest misfit: a vertex that the points hardly determine stays near its start instead of running
// away (LevelSummary::hold). Fit uses it for FitAim::kLevel, the way of the thesis.
LevelSolution FitLevelHeld(const LevelView& view, std::span<const Term> terms,
                           Solver solver = Solver::kCeres, SolveReport report = SolveReport::kFull);

// Summarises the numbers of observations per patch.
PatchCoverage MakeCoverage(const std::vector<int>& counts);

}  // namespace semblance::fitting
