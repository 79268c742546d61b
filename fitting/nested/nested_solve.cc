// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/nested/nested_solve.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "fitting/nested/lanes.h"

namespace semblance::fitting {
namespace {

constexpr int kMaxGradientSteps =
    300;  // solves take up to about 80 steps (docs/explanation/fit.md); bounds the loop

using Shares = std::vector<std::vector<double>>;  // by level and patch

// The mean over a patch of the squares of its sixteen B-splines.
std::array<double, 16> MeanSquares() {
  constexpr std::array<double, 4> one = {1.0 / 252, 33.0 / 140, 33.0 / 140, 1.0 / 252};
  std::array<double, 16> squares;
  for (int k = 0; k < 16; ++k) {
    squares[k] = one[k % 4] * one[k / 4];
  }
  return squares;
}

// Adds factor * entries to the sixteen vertices of a patch.
void Scatter(const GridLayout& layout, int i, int j, const std::array<double, 16>& entries,
             double factor, double* to) {
  const int columns = layout.grid.Columns(), rows = layout.grid.Rows();
  for (int k = 0; k < 16; ++k) {
    to[layout.At((i + k % 4) % columns, (j + k / 4) % rows)] += factor * entries[k];
  }
}

// Adds the values of the finer level's patches, times a factor, to their parents.
void SumUp(const GridLayout& finer, const std::vector<double>& of_finer, double factor,
           const GridLayout& coarser, std::vector<double>& of_coarser) {
  for (int j = 0; j < finer.grid.patches_v; ++j) {
    for (int i = 0; i < finer.grid.patches_u; ++i) {
      of_coarser[coarser.Patch(i / 2, j / 2)] += factor * of_finer[finer.Patch(i, j)];
    }
  }
}

// The four rows of vertices of adjacent patches, each from the first patch's first vertex on.
using PatchRows = std::array<const double*, 4>;

SEMBLANCE_INLINE Wider FormOfEight(const Matrix16& form, const PatchRows& rows, int first) {
  Wider vertices[16];
  for (int k = 0; k < 16; ++k) {
    vertices[k] = EightAt(rows[k / 4] + first + k % 4);
  }
  Wider sum = {};
  for (int k = 0; k < 16; ++k) {
    Wider row = 0.5 * form(k, k) * vertices[k];
    for (int l = k + 1; l < 16; ++l) {
      row += form(k, l) * vertices[l];
    }
    sum += vertices[k] * row;
  }
  return 2 * sum;
}

// The sum of vertices^T form vertices over adjacent patches. The last block of eight may reach into
// the space behind a row.
SEMBLANCE_WIDE double SumOfForms(const Matrix16& form, const PatchRows& rows, int count) {
  constexpr int kBlock = GridLayout::kBlock;
  Wider sum = {};
  int first = 0;
  for (; first + kBlock <= count; first += kBlock) {
    sum += FormOfEight(form, rows, first);
  }
  double all = SumOfEight(sum);
  const Wider rest = first < count ? FormOfEight(form, rows, first) : Wider{};
  for (int k = 0; k < count - first; ++k) {
    all += rest[k];
  }
  return all;
}

// Copies the sixteen vertices of a patch; the halo must be filled.
void Gather(const GridValues& values, int channel, int i, int j, std::array<double, 16>& vertices) {
  for (int b = 0; b < 4; ++b) {
    std::copy_n(values.Row(channel, j + b) + i, 4, vertices.begin() + 4 * b);
  }
}

}  // namespace

NestedSolve::NestedSolve(const NestedPoints& points, const Vec2& lengths_mm)
    : points_(points), lengths_mm_(lengths_mm) {}

NestedValues NestedSolve::Zeros() const {
  NestedValues values;
  for (int level = 0; level <= Finest(); ++level) {
    values.emplace_back((*space_)[level].layout, Channels());
  }
  return values;
}

void NestedSolve::Enter(const NestedSpace& space) {
  space_ = &space;
  for (int level = static_cast<int>(solution_.size()); level <= Finest(); ++level) {
    solution_.emplace_back(space[level].layout, Channels());
  }
  absolute_ = Zeros();
}

void NestedSolve::Begin(const NestedSpace& space, PointChoice used, const BendingMetric& metric) {
  Enter(space);
  metric_ = metric;
  used_ = std::move(used);
  levels_.clear();
  Shares data_shares;
  for (int level = 0; level <= Finest(); ++level) {
    const GridLayout& layout = space[level].layout;
    LevelSystem& system = levels_.emplace_back();
    system.leaves = space.Leaves(level);
    if (space[level].leaves) {
      system.matrix = StencilMatrix(layout, RunsAround(layout, system.leaves));
    }
    system.energy = PatchEnergy(layout.grid);
    data_shares.emplace_back(layout.Patches(), 0.0);
  }
  right_ = Zeros();
  direction_ = Zeros();
  product_ = Zeros();
  residual_ = Zeros();
  weight_ = weight_sum_ = square_sum_ = 0;
  AddPoints(data_shares);
  for (int level = Finest(); level > 0; --level) {
    AddRestricted(right_[level], Runs(level), right_[level - 1]);
    right_[level - 1].FoldHalo(Runs(level - 1));
  }
  const double data = MakeDataDiagonals(std::move(data_shares));
  even_weight_ = data / MakeEnergyDiagonals() / std::max(weight_sum_, 1e-300);
}

// Calls visit(leaf, indices) for the chosen points of each leaf. The points of a leaf are
// consecutive.
template <class Visit>
void NestedSolve::ForEachLeaf(std::size_t begin, std::size_t end, const PointChoice& choice,
                              const Visit& visit) const {
  std::vector<std::uint32_t> of_leaf;
  LeafPatch leaf;
  for (std::size_t k = begin; k < end; k += choice.every) {
    if (!choice.Has(k)) {
      continue;
    }
    const double x = points_.X(k), y = points_.Y(k);
    if (of_leaf.empty() || PatchOn((*space_)[leaf.level].layout.grid, leaf.level, x, y) !=
                               std::array{leaf.i, leaf.j}) {
      if (!of_leaf.empty()) {
        visit(leaf, of_leaf);
      }
      of_leaf.clear();
      leaf.level = space_->LeafLevel(x, y);
      const auto [i, j] = PatchOn((*space_)[leaf.level].layout.grid, leaf.level, x, y);
      leaf.i = i;
      leaf.j = j;
    }
    of_leaf.push_back(static_cast<std::uint32_t>(k));
  }
  if (!of_leaf.empty()) {
    visit(leaf, of_leaf);
  }
}

void NestedSolve::AddPoints(Shares& data_shares) {
  const auto add = [&](const LeafPatch& leaf, std::span<const std::uint32_t> indices) {
    const GridLayout& layout = (*space_)[leaf.level].layout;
    const LeafSums sums = SumsOver(points_, leaf, indices);
    levels_[leaf.level].matrix.AddPatch(leaf.i, leaf.j, sums.gram);
    data_shares[leaf.level][layout.Patch(leaf.i, leaf.j)] = sums.weight;
    weight_sum_ += sums.weight;
    square_sum_ += sums.squares;
    for (int c = 0; c < Channels(); ++c) {
      Scatter(layout, leaf.i, leaf.j, sums.right[c], 1, right_[leaf.level].Channel(c));
    }
  };
  ForEachLeaf(0, points_.size(), used_, add);
}

Matrix16 NestedSolve::PatchEnergy(const PatchGrid& grid) const {
  return ThinPlateStiffness(lengths_mm_.x() / grid.patches_u, lengths_mm_.y() / grid.patches_v,
                            metric_) /
         lengths_mm_.prod();
}

// Calls visit(i, j, patch) for each patch that is present.
template <class Visit>
void NestedSolve::ForEachPatch(int level, const Visit& visit) const {
  const GridLayout& layout = (*space_)[level].layout;
  for (int j = 0; j < layout.grid.patches_v; ++j) {
    for (int i = 0; i < layout.grid.patches_u; ++i) {
      const std::size_t patch = layout.Patch(i, j);
      if ((*space_)[level].present[patch] != 0) {
        visit(i, j, patch);
      }
    }
  }
}

// Computes the diagonal of the points' matrix of each level, as if the level were alone and the
// points were spread evenly over each patch. Returns its sum.
double NestedSolve::MakeDataDiagonals(Shares shares) {
  static const std::array<double, 16> squares = MeanSquares();
  double sum = 0;
  for (int level = Finest(); level >= 0; --level) {
    LevelSystem& system = levels_[level];
    const GridLayout& layout = (*space_)[level].layout;
    if (level < Finest()) {
      SumUp((*space_)[level + 1].layout, shares[level + 1], 1, layout, shares[level]);
    }
    system.data_diagonal = GridValues(layout, 1);
    system.inverse = GridValues(layout, 1);
    ForEachPatch(level, [&](int i, int j, std::size_t patch) {
      Scatter(layout, i, j, squares, shares[level][patch], system.data_diagonal.Channel(0));
      sum += shares[level][patch];
    });
  }
  return std::accumulate(squares.begin(), squares.end(), 0.0) * sum;
}

// Computes the diagonal of the energy's matrix of each level at weight 1. Returns its sum.
double NestedSolve::MakeEnergyDiagonals() {
  Shares shares;
  for (const LevelSystem& system : levels_) {
    shares.emplace_back(system.leaves.begin(), system.leaves.end());
  }
  double sum = 0;
  std::array<double, 16> own;
  for (int level = Finest(); level >= 0; --level) {
    LevelSystem& system = levels_[level];
    const GridLayout& layout = (*space_)[level].layout;
    if (level < Finest()) {
      SumUp((*space_)[level + 1].layout, shares[level + 1], 0.25, layout, shares[level]);
    }
    system.energy_diagonal = GridValues(layout, 1);
    Eigen::Map<Eigen::Vector<double, 16>>(own.data()) = system.energy.diagonal();
    ForEachPatch(level, [&](int i, int j, std::size_t patch) {
      Scatter(layout, i, j, own, shares[level][patch], system.energy_diagonal.Channel(0));
      sum += shares[level][patch] * system.energy.trace();
    });
  }
  return sum;
}

// Calls visit(i, j, count) for each run of adjacent leaves of a level.
template <class Visit>
void NestedSolve::ForEachLeafRun(int level, const Visit& visit) const {
  const std::vector<char>& leaves = levels_[level].leaves;
  const PatchGrid& grid = (*space_)[level].layout.grid;
  for (int j = 0; (*space_)[level].leaves && j < grid.patches_v; ++j) {
    const char* const row = leaves.data() + (*space_)[level].layout.Patch(0, j);
    const char* const end = row + grid.patches_u;
    for (const char* at = std::find(row, end, 1); at != end;) {
      const char* const behind = std::find(at, end, 0);
      visit(static_cast<int>(at - row), j, static_cast<int>(behind - at));
      at = std::find(behind, end, 1);
    }
  }
}

// Adds the matrix form_of(system) once per leaf.
template <class FormOf>
void NestedSolve::AddToLeaves(const FormOf& form_of) {
  for (int level = 0; level <= Finest(); ++level) {
    LevelSystem& system = levels_[level];
    const Matrix16 form = form_of(system);
    ForEachLeafRun(level,
                   [&](int i, int j, int count) { system.matrix.AddPatches(i, j, count, form); });
  }
}

// The matrix already contains the energy with the last weight, so only the difference is added.
void NestedSolve::SetWeight(double weight) {
  const double more = (weight - weight_) * weight_sum_;
  weight_ = weight;
  AddToLeaves([&](const LevelSystem& system) -> Matrix16 { return more * system.energy; });
  Invert();
}

void NestedSolve::Invert() {
  for (int level = 0; level <= Finest(); ++level) {
    LevelSystem& system = levels_[level];
    InvertOn(Runs(level), system.data_diagonal.Channel(0), system.energy_diagonal.Channel(0),
             weight_ * weight_sum_, (*space_)[level].active.data(), system.inverse.Channel(0));
  }
}

void NestedSolve::SetMetric(const BendingMetric& metric) {
  metric_ = metric;
  const double factor = weight_ * weight_sum_;
  AddToLeaves([&](const LevelSystem& system) -> Matrix16 { return -factor * system.energy; });
  for (int level = 0; level <= Finest(); ++level) {
    levels_[level].energy = PatchEnergy((*space_)[level].layout.grid);
  }
  AddToLeaves([&](const LevelSystem& system) -> Matrix16 { return factor * system.energy; });
  MakeEnergyDiagonals();
  Invert();
}

// Sets absolute_ to the total displacements: the refined coarser levels plus x.
void NestedSolve::SumLevels(const NestedValues& x) {
  for (int level = 0; level <= Finest(); ++level) {
    for (int c = 0; c < Channels(); ++c) {
      CopyOn(Runs(level), x[level].Channel(c), absolute_[level].Channel(c));
    }
    if (level > 0) {
      AddRefined(absolute_[level - 1], Runs(level), absolute_[level]);
    }
    absolute_[level].FillHalo(Runs(level));
  }
}

void NestedSolve::Multiply(const NestedValues& x, NestedValues& product) {
  SumLevels(x);
  for (int level = 0; level <= Finest(); ++level) {
    product[level].Clear(Runs(level));
    if (!levels_[level].matrix.empty()) {
      levels_[level].matrix.AddProduct(absolute_[level], product[level]);
    }
  }
  for (int level = Finest(); level > 0; --level) {
    product[level].FoldHalo(Runs(level));
    AddRestricted(product[level], Runs(level), product[level - 1]);
  }
  product[0].FoldHalo(Runs(0));
}

GridStep NestedSolve::MakeStep(int level, int channel) {
  return {.inverse = levels_[level].inverse.Channel(0),
          .product = product_[level].Channel(channel),
          .direction = direction_[level].Channel(channel),
          .residual = residual_[level].Channel(channel),
          .solution = solution_[level].Channel(channel)};
}

// The sum of part(level) over all levels.
template <class Part>
double NestedSolve::Sum(const Part& part) const {
  double sum = 0;
  for (int level = 0; level <= Finest(); ++level) {
    sum += part(level);
  }
  return sum;
}

// Computes the residual at the present solution, and the first direction.
NestedSolve::ChannelGain NestedSolve::Begin(int channel, double least_gain) {
  // Remaining gain at which a channel ends, relative to the gain at solution 0: round-off, and for
  // the probe an accuracy of the trace of about 1 %.
  constexpr double kRounding = 1e-16, kProbe = 1e-2;
  const double at_first = Sum([&](int level) {
    CopyOn(Runs(level), right_[level].Channel(channel), residual_[level].Channel(channel));
    return SquaresOn(Runs(level), MakeStep(level, channel).inverse,
                     residual_[level].Channel(channel));
  });
  const bool probe = channel == points_.channels;
  ChannelGain gain;
  gain.enough = probe ? kProbe * at_first : std::max(kRounding * at_first, least_gain);
  gain.left = Sum([&](int level) {
    const GridStep step = MakeStep(level, channel);
    return SubtractOn(Runs(level), step.inverse, step.product, step.residual);
  });
  for (int level = 0; level <= Finest(); ++level) {
    TurnOn(Runs(level), MakeStep(level, channel), 0);
  }
  return gain;
}

// Takes a step of conjugate gradients along a channel's direction; product_ holds the matrix times
// the direction.
void NestedSolve::Advance(int channel, ChannelGain& gain) {
  const double curvature = Sum([&](int level) {
    return DotOn(Runs(level), direction_[level].Channel(channel), product_[level].Channel(channel));
  });
  const double length = curvature > 0 ? gain.left / curvature : 0;
  const double next =
      Sum([&](int level) { return AdvanceOn(Runs(level), MakeStep(level, channel), length); });
  for (int level = 0; level <= Finest(); ++level) {
    TurnOn(Runs(level), MakeStep(level, channel), gain.left > 0 ? next / gain.left : 0);
  }
  gain.left = next;
}

int NestedSolve::Solve(double least_gain) {
  Multiply(solution_, product_);
  std::vector<ChannelGain> gains;
  for (int c = 0; c < Channels(); ++c) {
    gains.push_back(Begin(c, least_gain));
  }
  int steps = 0;
  for (; steps < kMaxGradientSteps && std::ranges::any_of(gains, &ChannelGain::IsMore); ++steps) {
    Multiply(direction_, product_);
    for (int c = 0; c < Channels(); ++c) {
      Advance(c, gains[c]);
    }
  }
  return steps;
}

// The sum of w |v - N x|^2 at the last solution x, without a pass over the points. With (N^T W N +
// w E) x = b - r and b = N^T W v it is sum w |v|^2 - x . b - x . r - w x . E x.
double NestedSolve::SumOfSquares() {
  double sum = square_sum_ - weight_ * weight_sum_ * Energy();
  for (int c = 0; c < points_.channels; ++c) {
    sum -= Sum([&](int level) {
      const double* const x = solution_[level].Channel(c);
      return DotOn(Runs(level), x, right_[level].Channel(c)) +
             DotOn(Runs(level), x, residual_[level].Channel(c));
    });
  }
  return sum;
}

// The sum of a form over the leaves of a level and all channels. Requires absolute_.
double NestedSolve::SumOverLeaves(int level, const Matrix16& form) const {
  double sum = 0;
  ForEachLeafRun(level, [&](int i, int j, int count) {
    for (int c = 0; c < points_.channels; ++c) {
      const GridValues& values = absolute_[level];
      sum += SumOfForms(form,
                        {values.Row(c, j) + i, values.Row(c, j + 1) + i, values.Row(c, j + 2) + i,
                         values.Row(c, j + 3) + i},
                        count);
    }
  });
  return sum;
}

// The energy of the solution at weight 1.
double NestedSolve::Energy() {
  SumLevels(solution_);
  return Sum([&](int level) { return SumOverLeaves(level, levels_[level].energy); });
}

BendingSums NestedSolve::Bending() {
  SumLevels(solution_);
  BendingSums sums{};
  for (int level = 0; level <= Finest(); ++level) {
    const PatchGrid& grid = (*space_)[level].layout.grid;
    const std::array<ElementStiffness, 6> forms =
        BendingStiffnesses(lengths_mm_.x() / grid.patches_u, lengths_mm_.y() / grid.patches_v);
    for (std::size_t k = 0; k < sums.size(); ++k) {
      sums[k] += SumOverLeaves(level, forms[k]);
    }
  }
  return sums;
}

// Sums point by point if the difference of sums would keep too few digits.
double NestedSolve::MeanSquare() {
  constexpr double kMinShare = 1e-10;  // of the sum of squares; six of sixteen digits are then left
  double sum = SumOfSquares();
  if (!(sum > kMinShare * square_sum_)) {
    sum = 0;
    SumLevels(solution_);
    constexpr std::size_t kAtOnce = 1 << 14;  // bounds the memory
    std::vector<NestedResidual> residuals;
    const std::size_t step = kAtOnce * used_.every;
    for (std::size_t begin = 0; begin < points_.size(); begin += step) {
      const std::size_t end = std::min(begin + step, points_.size());
      residuals.clear();
      AddResiduals(begin, end, used_, residuals);
      auto residual = residuals.begin();
      for (std::size_t k = begin; k < end; k += used_.every) {
        sum += used_.Has(k) ? points_.Weight(k) * (residual++)->Square() : 0;
      }
    }
  }
  return sum / weight_sum_ / points_.channels;
}

double NestedSolve::Trace() const {
  const int c = points_.channels;
  return Sum([&](int level) {
    return DotOn(Runs(level), right_[level].Channel(c), solution_[level].Channel(c));
  });
}

NestedSolve::Packed NestedSolve::Solution() const {
  Packed packed;
  for (int level = 0; level <= Finest(); ++level) {
    for (int c = 0; c < Channels(); ++c) {
      for (const GridRun& run : Runs(level)) {
        const double* const from = solution_[level].Channel(c) + run.at;
        packed.insert(packed.end(), from, from + run.size());
      }
    }
  }
  return packed;
}

void NestedSolve::SetSolution(const Packed& solution) {
  solution_ = Zeros();
  auto from = solution.begin();
  for (int level = 0; level <= Finest(); ++level) {
    for (int c = 0; c < Channels(); ++c) {
      for (const GridRun& run : Runs(level)) {
        std::copy_n(from, run.size(), solution_[level].Channel(c) + run.at);
        from += run.size();
      }
    }
  }
}

const NestedValues& NestedSolve::Displacements() {
  SumLevels(solution_);
  return absolute_;
}

// Requires absolute_.
void NestedSolve::AddResiduals(std::size_t begin, std::size_t end, const PointChoice& choice,
                               std::vector<NestedResidual>& residuals) const {
  LeafVertices vertices{};
  ForEachLeaf(begin, end, choice,
              [&](const LeafPatch& leaf, std::span<const std::uint32_t> of_leaf) {
                for (int c = 0; c < points_.channels; ++c) {
                  Gather(absolute_[leaf.level], c, leaf.i, leaf.j, vertices[c]);
                }
                const std::size_t before = residuals.size();
                residuals.resize(before + of_leaf.size());
                ResidualsOver(points_, leaf, vertices, of_leaf, residuals.data() + before);
              });
}

std::vector<NestedResidual> NestedSolve::Residuals(const PointChoice& choice) {
  SumLevels(solution_);
  std::vector<NestedResidual> residuals;
  residuals.reserve(choice.Count(points_));
  AddResiduals(0, points_.size(), choice, residuals);
  return residuals;
}

std::span<const NestedResidual> NestedResiduals::Of(std::size_t begin, std::size_t end) {
  some_.clear();
  solve_.AddResiduals(begin, end, {}, some_);
  return some_;
}

}  // namespace semblance::fitting
