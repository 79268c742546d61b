// SPDX-License-Identifier: GPL-3.0-or-later
// The penalised least squares of a nested fit, by conjugate gradients over all levels at once.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

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
  // lengths_mm: what [0,1] stands for along u and v. probe: with one more channel, a random sign
  // per point, for the trace. All must outlive the solve.
  NestedSolve(const NestedPoints& points, const Vec2& lengths_mm);

  // Takes the space as it is linked, and those points whose index is in `used` (ascending). What
  // was solved for before is kept as the start of the next solve.
  void Begin(const NestedSpace& space, std::vector<std::uint32_t> used);
  // The weight of the thin-plate energy, mm^2 per energy.
  void SetWeight(double weight);
  // Until what is left to gain is below `least_gain` of the sum of w |e|^2 (0: far below rounding).
  // Returns the number of steps.
  int Solve(double least_gain);

  // The trace of the influence matrix at the last solution, by one probe (Hutchinson 1990).
  double Trace() const;
  double WeightSum() const { return weight_sum_; }
  // The diagonals' sums over those of the energy at weight 1: where points and energy balance.
  double EvenWeight() const;
  const NestedValues& solution() const { return solution_; }
  void SetSolution(NestedValues values) { solution_ = std::move(values); }
  // The absolute displacements of every level's vertices, halos filled.
  NestedValues Displacements() const;

  struct Residual {
    std::array<double, 3> along{};  // each channel, mm
    double Square() const {
      return along[0] * along[0] + along[1] * along[1] + along[2] * along[2];
    }
  };
  // Of point k, on the surface that Displacements gave.
  Residual ResidualAt(const NestedValues& displacements, std::uint32_t k) const;
  const NestedSpace& space() const { return *space_; }

 private:
  struct LevelSystem {
    StencilMatrix matrix;              // of the leaves; empty where there are none
    std::vector<double> data_share;    // per patch: of the points' weights below it
    std::vector<double> energy_share;  // per patch: of the leaves below it, in units of one
    std::vector<double> data_diagonal, diagonal;
    Matrix16 energy;  // of a patch, at weight 1
  };
  int Channels() const { return points_.channels + 1; }
  double Probe(std::uint32_t k) const;
  void AddPoints();
  void AddLeaf(int level, int i, int j, std::span<const std::uint32_t> points);
  void ShareWeights();
  void MakeDiagonals();
  void Multiply(const NestedValues& x, NestedValues& product, NestedValues& absolute) const;
  void Mask(int level, GridValues& values) const;
  NestedValues Zeros() const;
  std::vector<double> Divide(const NestedValues& residual, NestedValues& divided) const;

  const NestedPoints& points_;
  Vec2 lengths_mm_;
  const NestedSpace* space_ = nullptr;
  std::vector<std::uint32_t> used_;
  std::vector<LevelSystem> levels_;
  NestedValues right_, solution_;
  double weight_ = 0, weight_sum_ = 0;
};

}  // namespace semblance
