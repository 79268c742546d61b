// SPDX-License-Identifier: GPL-3.0-or-later
// The penalised least-squares solve of a nested fit, by conjugate gradients over all levels at
// once.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "fitting/nested/grid_values.h"
#include "fitting/nested/leaf_sums.h"
#include "fitting/nested/nested_points.h"
#include "fitting/nested/nested_space.h"
#include "fitting/nested/stencil_matrix.h"

namespace semblance::fitting {

using NestedValues = std::vector<GridValues>;  // one per level

// Minimises
//
//   sum w |e|^2 / sum w + weight * (thin-plate energy / area)
//
// in displacements from the start, with one matrix for all channels. The matrix is stored per
// level, each part for the leaves of the level. The vertices of every level are unknowns, scaled by
// their own diagonals. This is the multilevel preconditioner of Bramble, Pasciak & Xu (1990) as
// Griebel's generating system (1994): the number of steps does not grow with the vertices.
//
// Order of calls: Begin (points, metric), then SetWeight, then Solve; SetWeight, SetMetric and
// Solve may repeat. Enter alone suffices for SetSolution, Displacements and residuals.
class NestedSolve {
 public:
  // lengths_mm: lengths of [0,1] along u and v. `points` must outlive the solve.
  NestedSolve(const NestedPoints& points, const Vec2& lengths_mm);

  // Adopts a linked space, which must outlive its use. The last solution stays as the start of the
  // next solve; its levels must be levels of the space.
  void Enter(const NestedSpace& space);
  // Forgets the last solution, so that the next space need not have its levels.
  void Forget() { solution_.clear(); }
  // Enters the space, and assembles the chosen points. An additional channel holds a random sign
  // per point, for the trace.
  void Begin(const NestedSpace& space, PointChoice used,
             const BendingMetric& metric = BendingMetric::Identity());
  // Sets the weight of the thin-plate energy, mm^2 per energy.
  void SetWeight(double weight);
  // Changes the metric of bending.
  void SetMetric(const BendingMetric& metric);
  const BendingMetric& metric() const { return metric_; }
  // Solves until the remaining decrease of the sum of w |e|^2 is below `least_gain` (0: round-off).
  // Returns the number of steps.
  int Solve(double least_gain);

  // The mean of w |e|^2 along one axis over the chosen points, at the last solution.
  double MeanSquare();
  // The trace of the influence matrix at the last solution, by one probe (Hutchinson 1990).
  double Trace() const;
  BendingSums Bending();  // of the last solution, summed over the channels without the probe
  double WeightSum() const { return weight_sum_; }
  // The weight at which points and energy balance: the ratio of the sums of their diagonals.
  double EvenWeight() const { return even_weight_; }

  // A solution as the values in the space's runs, level by level. It fits the same space only.
  using Packed = std::vector<double>;
  Packed Solution() const;
  void SetSolution(const Packed& solution);

  // The total displacements of every level's vertices, with filled halos. Valid until the next
  // non-const call.
  const NestedValues& Displacements();
  // The residuals of the chosen points, in their order.
  std::vector<NestedResidual> Residuals(const PointChoice& choice);

 private:
  struct LevelSystem {
    StencilMatrix matrix;      // of the leaves; empty if there are none
    std::vector<char> leaves;  // per patch
    Matrix16 energy;           // of a patch, at weight 1
    GridValues data_diagonal, energy_diagonal, inverse;
  };
  // The remaining gain of a channel, and the gain that ends its iteration.
  struct ChannelGain {
    double left = 0, enough = 0;
    bool IsMore() const { return left > enough; }
  };
  int Channels() const { return points_.channels + 1; }
  const GridRuns& Runs(int level) const { return (*space_)[level].runs; }
  int Finest() const { return space_->finest(); }
  NestedValues Zeros() const;
  friend class NestedResiduals;
  template <class Visit>
  void ForEachLeaf(std::size_t begin, std::size_t end, const PointChoice& choice,
                   const Visit& visit) const;
  void AddResiduals(std::size_t begin, std::size_t end, const PointChoice& choice,
                    std::vector<NestedResidual>& residuals) const;
  void AddPoints(std::vector<std::vector<double>>& data_shares);
  Matrix16 PatchEnergy(const PatchGrid& grid) const;
  template <class Visit>
  void ForEachPatch(int level, const Visit& visit) const;
  double MakeDataDiagonals(std::vector<std::vector<double>> shares);
  double MakeEnergyDiagonals();
  template <class Visit>
  void ForEachLeafRun(int level, const Visit& visit) const;
  template <class FormOf>
  void AddToLeaves(const FormOf& form_of);
  void Invert();
  double SumOverLeaves(int level, const Matrix16& form) const;
  void Multiply(const NestedValues& x, NestedValues& product);
  void SumLevels(const NestedValues& x);
  double Energy();
  double SumOfSquares();
  GridStep MakeStep(int level, int channel);
  ChannelGain Begin(int channel, double least_gain);
  void Advance(int channel, ChannelGain& gain);
  template <class Part>
  double Sum(const Part& part) const;

  const NestedPoints& points_;
  Vec2 lengths_mm_;
  const NestedSpace* space_ = nullptr;
  PointChoice used_;
  std::vector<LevelSystem> levels_;
  NestedValues right_, solution_, absolute_, direction_, product_, residual_;
  BendingMetric metric_ = BendingMetric::Identity();
  double weight_ = 0, weight_sum_ = 0, square_sum_ = 0, even_weight_ = kNaN;
};

// The residuals of the last solution for ranges of points; all residuals at once would take half
// the memory of the points. Valid until the next non-const call of the solve.
class NestedResiduals {
 public:
  explicit NestedResiduals(NestedSolve& solve) : solve_(solve) { solve_.Displacements(); }

  // The residuals of points begin .. end - 1. Valid until the next call.
  std::span<const NestedResidual> Of(std::size_t begin, std::size_t end);

  // Calls visit(k, residual) for all points, in the order of the curve.
  template <class Visit>
  void ForEach(const Visit& visit) {
    constexpr std::size_t kAtOnce = 1 << 14;  // bounds the memory
    const std::size_t count = solve_.points_.size();
    for (std::size_t begin = 0; begin < count; begin += kAtOnce) {
      std::size_t k = begin;
      for (const NestedResidual& residual : Of(begin, std::min(begin + kAtOnce, count))) {
        visit(k++, residual);
      }
    }
  }

 private:
  NestedSolve& solve_;
  std::vector<NestedResidual> some_;
};

}  // namespace semblance::fitting
