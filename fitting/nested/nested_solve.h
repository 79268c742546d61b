// SPDX-License-Identifier: GPL-3.0-or-later
// The penalised least squares of a nested fit, by conjugate gradients over all levels at once.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "fitting/nested/grid_sums.h"
#include "fitting/nested/leaf_sums.h"
#include "fitting/nested/nested_points.h"
#include "fitting/nested/nested_space.h"
#include "fitting/nested/stencil_matrix.h"

namespace semblance {

using NestedValues = std::vector<GridValues>;  // one per level

// sum w |e|^2 / sum w + weight * (thin-plate energy / area), in displacements from the start; one
// matrix for all channels. The matrix is kept by the level of the leaves that it stands for. Every
// level's vertices are unknowns, each divided by its own diagonal: that is the multilevel
// preconditioner of Bramble, Pasciak & Xu (1990), by way of Griebel's generating system (1994), so
// that the number of steps does not grow with the vertices.
class NestedSolve {
 public:
  // lengths_mm: what [0,1] stands for along u and v. All must outlive the solve.
  NestedSolve(const NestedPoints& points, const Vec2& lengths_mm);

  // Takes the space as it is linked; it must outlive what is asked of it. What was solved for
  // before is kept as the start of the next solve; the space must hold it.
  void Enter(const NestedSpace& space);
  // Enters it, and takes the points of a choice. With one more channel, a random sign per point,
  // for the trace.
  void Begin(const NestedSpace& space, PointChoice used,
             const BendingMetric& metric = BendingMetric::Identity());
  // The weight of the thin-plate energy, mm^2 per energy.
  void SetWeight(double weight);
  // In which lengths bending is measured instead of those since the beginning.
  void SetMetric(const BendingMetric& metric);
  const BendingMetric& metric() const { return metric_; }
  // Until what is left to gain is below `least_gain` of the sum of w |e|^2 (0: far below rounding).
  // Returns the number of steps.
  int Solve(double least_gain);

  // The mean of w |e|^2 along one axis, of the points that were taken, at the last solution.
  double MeanSquare();
  // The trace of the influence matrix at the last solution, by one probe (Hutchinson 1990).
  double Trace() const;
  BendingSums Bending();  // of the last solution, over all channels but the probe
  double WeightSum() const { return weight_sum_; }
  // The diagonals' sums over those of the energy at weight 1: where points and energy balance.
  double EvenWeight() const { return even_weight_; }

  // The vertices of the space's runs, level by level; for the same space again.
  using Packed = std::vector<double>;
  Packed Solution() const;
  void SetSolution(const Packed& solution);

  // The absolute displacements of every level's vertices, halos filled; until the next call of
  // anything else.
  const NestedValues& Displacements();
  // Of the points of a choice, in their order.
  std::vector<NestedResidual> ResidualsOf(const PointChoice& choice);

 private:
  struct LevelSystem {
    StencilMatrix matrix;  // of the leaves; empty where there are none
    std::vector<char> leaves;
    Matrix16 energy;  // of a patch, at weight 1
    GridValues data_diagonal, energy_diagonal, inverse;
  };
  // What a channel has to gain, and what is not worth a step.
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
  Matrix16 EnergyOf(const PatchGrid& grid) const;
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
  void Absolute(const NestedValues& x);
  double Energy();
  double SumOfSquares();
  GridStep StepOf(int level, int channel);
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

// What the last solution of a solve leaves of its points, some of them at a time: all of them would
// need half as much memory as the points. Until the solve is asked for anything else.
class NestedResiduals {
 public:
  explicit NestedResiduals(NestedSolve& solve) : solve_(solve) { solve_.Displacements(); }

  // Of points begin .. end - 1; until the next call.
  std::span<const NestedResidual> Of(std::size_t begin, std::size_t end);

 private:
  NestedSolve& solve_;
  std::vector<NestedResidual> some_;
};

}  // namespace semblance
