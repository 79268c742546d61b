// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/nested/nested_solve.h"

#include <algorithm>
#include <cmath>

namespace semblance {
namespace {

constexpr int kMostSteps = 300;

// The products of two of four weights, each pair once.
constexpr int kPairs = 10;
constexpr std::array<std::array<int, 4>, 4> kPair = {
    {{0, 1, 2, 3}, {1, 4, 5, 6}, {2, 5, 7, 8}, {3, 6, 8, 9}}};
using Pairs = std::array<double, kPairs>;

Pairs PairsOf(const std::array<double, 4>& weights, double factor) {
  Pairs pairs;
  for (int a = 0; a < 4; ++a) {
    for (int b = a; b < 4; ++b) {
      pairs[kPair[a][b]] = factor * weights[a] * weights[b];
    }
  }
  return pairs;
}

Matrix16 GramOf(const std::array<Pairs, kPairs>& sums) {
  Matrix16 gram;
  for (int k = 0; k < 16; ++k) {
    for (int l = 0; l < 16; ++l) {
      gram(k, l) = sums[kPair[k / 4][l / 4]][kPair[k % 4][l % 4]];
    }
  }
  return gram;
}

// Of the squares of a patch's sixteen weights over the patch.
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
  const int columns = layout.grid.Columns();
  for (int k = 0; k < 16; ++k) {
    to[layout.At((i + k % 4) % columns, j + k / 4)] += factor * entries[k];
  }
}

// A patch's quantity, summed from the finest level up.
void SumUp(const GridLayout& finer, const std::vector<double>& of_finer, double factor,
           const GridLayout& coarser, std::vector<double>& of_coarser) {
  for (int j = 0; j < finer.grid.patches_v; ++j) {
    for (int i = 0; i < finer.grid.patches_u; ++i) {
      of_coarser[coarser.Patch(i / 2, j / 2)] += factor * of_finer[finer.Patch(i, j)];
    }
  }
}

double Dot(const GridValues& a, const GridValues& b, int channel) {
  const double *const x = a.Channel(channel), *const y = b.Channel(channel);
  double sum = 0;
  for (std::size_t k = 0; k < a.layout().Size(); ++k) {
    sum += x[k] * y[k];
  }
  return sum;
}

double Dot(const NestedValues& a, const NestedValues& b, int channel) {
  double sum = 0;
  for (std::size_t level = 0; level < a.size(); ++level) {
    sum += Dot(a[level], b[level], channel);
  }
  return sum;
}

// to += factor * x, or to = x + factor * to.
void AddMultiple(double factor, const NestedValues& x, int channel, NestedValues& to) {
  for (std::size_t level = 0; level < x.size(); ++level) {
    const double* const from = x[level].Channel(channel);
    double* const out = to[level].Channel(channel);
    for (std::size_t k = 0; k < x[level].layout().Size(); ++k) {
      out[k] += factor * from[k];
    }
  }
}
void ContinueFrom(const NestedValues& x, double factor, int channel, NestedValues& to) {
  for (std::size_t level = 0; level < x.size(); ++level) {
    const double* const from = x[level].Channel(channel);
    double* const out = to[level].Channel(channel);
    for (std::size_t k = 0; k < x[level].layout().Size(); ++k) {
      out[k] = from[k] + factor * out[k];
    }
  }
}

}  // namespace

NestedSolve::NestedSolve(const NestedPoints& points, const Vec2& lengths_mm)
    : points_(points), lengths_mm_(lengths_mm) {}

// Of a point's place along the curve, so that it does not depend on the order as given.
double NestedSolve::Probe(std::uint32_t k) const {
  std::uint64_t bits = (k + 1) * 0x9E3779B97F4A7C15u;
  bits = (bits ^ bits >> 29) * 0xBF58476D1CE4E5B9u;
  return ((bits ^ bits >> 32) & 1) != 0 ? 1 : -1;
}

NestedValues NestedSolve::Zeros() const {
  NestedValues values;
  for (int level = 0; level <= space_->finest(); ++level) {
    values.emplace_back((*space_)[level].layout, Channels());
  }
  return values;
}

void NestedSolve::Begin(const NestedSpace& space, std::vector<std::uint32_t> used) {
  space_ = &space;
  used_ = std::move(used);
  levels_.assign(space.finest() + 1, {});
  for (int level = 0; level <= space.finest(); ++level) {
    const GridLayout& layout = space[level].layout;
    LevelSystem& system = levels_[level];
    system.matrix = space[level].leaves ? StencilMatrix(layout) : StencilMatrix();
    system.data_share.assign(layout.Patches(), 0);
    system.data_diagonal.assign(layout.Size(), 0);
    system.energy = ThinPlateStiffness(lengths_mm_.x() / layout.grid.patches_u,
                                       lengths_mm_.y() / layout.grid.patches_v) /
                    lengths_mm_.prod();
  }
  right_ = Zeros();
  weight_ = weight_sum_ = 0;
  AddPoints();
  for (int level = space.finest(); level > 0; --level) {
    AddRestricted(right_[level], right_[level - 1]);
  }
  for (int level = 0; level <= space.finest(); ++level) {
    Mask(level, right_[level]);
  }
  ShareWeights();
  for (int level = static_cast<int>(solution_.size()); level <= space.finest(); ++level) {
    solution_.emplace_back(space[level].layout, Channels());
  }
}

// Points of one leaf follow each other.
void NestedSolve::AddPoints() {
  std::size_t begin = 0;
  while (begin < used_.size()) {
    const int level = space_->LeafLevel(points_.x[used_[begin]], points_.y[used_[begin]]);
    const PatchGrid& grid = (*space_)[level].layout.grid;
    const auto place = [&](std::size_t k) {
      return PlaceOn(grid, level, points_.x[used_[k]], points_.y[used_[k]]);
    };
    const NestedPlace first = place(begin);
    std::size_t end = begin + 1;
    for (; end < used_.size(); ++end) {
      const NestedPlace next = place(end);
      if (next.i != first.i || next.j != first.j) {
        break;
      }
    }
    AddLeaf(level, first.i, first.j, std::span(used_).subspan(begin, end - begin));
    begin = end;
  }
}

void NestedSolve::AddLeaf(int level, int i, int j, std::span<const std::uint32_t> points) {
  const GridLayout& layout = (*space_)[level].layout;
  std::array<Pairs, kPairs> sums{};
  std::array<std::array<double, 16>, 4> right{};
  double weight = 0;
  for (const std::uint32_t k : points) {
    const NestedPlace place = PlaceOn(layout.grid, level, points_.x[k], points_.y[k]);
    const double w = points_.weight[k];
    const Pairs u = PairsOf(place.along_u, 1), v = PairsOf(place.along_v, w);
    for (int r = 0; r < kPairs; ++r) {
      for (int c = 0; c < kPairs; ++c) {
        sums[r][c] += v[r] * u[c];
      }
    }
    for (int c = 0; c < Channels(); ++c) {
      const double value = c < points_.channels ? w * points_.value[c][k] : std::sqrt(w) * Probe(k);
      for (int m = 0; m < 16; ++m) {
        right[c][m] += value * place.along_u[m % 4] * place.along_v[m / 4];
      }
    }
    weight += w;
  }
  levels_[level].matrix.AddPatch(i, j, GramOf(sums));
  levels_[level].data_share[layout.Patch(i, j)] = weight;
  weight_sum_ += weight;
  for (int c = 0; c < Channels(); ++c) {
    Scatter(layout, i, j, right[c], 1, right_[level].Channel(c));
  }
}

void NestedSolve::ShareWeights() {
  static const std::array<double, 16> squares = MeanSquares();
  const NestedSpace& space = *space_;
  for (int level = space.finest(); level >= 0; --level) {
    LevelSystem& system = levels_[level];
    const GridLayout& layout = space[level].layout;
    system.energy_share.assign(layout.Patches(), 0);
    for (std::size_t p = 0; p < layout.Patches(); ++p) {
      system.energy_share[p] = space.IsLeaf(level, p) ? 1 : 0;
    }
    if (level < space.finest()) {
      const GridLayout& finer = space[level + 1].layout;
      SumUp(finer, levels_[level + 1].data_share, 1, layout, system.data_share);
      SumUp(finer, levels_[level + 1].energy_share, 0.25, layout, system.energy_share);
    }
    for (int j = 0; j < layout.grid.patches_v; ++j) {
      for (int i = 0; i < layout.grid.patches_u; ++i) {
        Scatter(layout, i, j, squares, system.data_share[layout.Patch(i, j)],
                system.data_diagonal.data());
      }
    }
  }
}

double NestedSolve::EvenWeight() const {
  double data = 0, energy = 0;
  for (const LevelSystem& system : levels_) {
    for (std::size_t p = 0; p < system.data_share.size(); ++p) {
      energy += system.energy_share[p] * system.energy.trace();
    }
    for (const double d : system.data_diagonal) {
      data += d;
    }
  }
  return data / energy / std::max(weight_sum_, 1e-300);
}

// The matrix as it stands has the weight of the last call.
void NestedSolve::SetWeight(double weight) {
  const double more = (weight - weight_) * weight_sum_;
  weight_ = weight;
  for (int level = 0; level <= space_->finest(); ++level) {
    const GridLayout& layout = (*space_)[level].layout;
    const Matrix16 form = more * levels_[level].energy;
    for (int j = 0; (*space_)[level].leaves && j < layout.grid.patches_v; ++j) {
      for (int i = 0; i < layout.grid.patches_u; ++i) {
        if (space_->IsLeaf(level, layout.Patch(i, j))) {
          levels_[level].matrix.AddPatch(i, j, form);
        }
      }
    }
  }
  MakeDiagonals();
}

void NestedSolve::MakeDiagonals() {
  for (int level = 0; level <= space_->finest(); ++level) {
    LevelSystem& system = levels_[level];
    const GridLayout& layout = (*space_)[level].layout;
    std::array<double, 16> own;
    for (int k = 0; k < 16; ++k) {
      own[k] = system.energy(k, k);
    }
    system.diagonal = system.data_diagonal;
    for (int j = 0; j < layout.grid.patches_v; ++j) {
      for (int i = 0; i < layout.grid.patches_u; ++i) {
        Scatter(layout, i, j, own, weight_ * weight_sum_ * system.energy_share[layout.Patch(i, j)],
                system.diagonal.data());
      }
    }
  }
}

void NestedSolve::Mask(int level, GridValues& values) const {
  const std::vector<char>& active = (*space_)[level].active;
  for (int c = 0; level > 0 && c < values.channels(); ++c) {
    double* const v = values.Channel(c);
    for (std::size_t k = 0; k < active.size(); ++k) {
      v[k] = active[k] != 0 ? v[k] : 0;
    }
  }
}

void NestedSolve::Multiply(const NestedValues& x, NestedValues& product,
                           NestedValues& absolute) const {
  for (int level = 0; level <= space_->finest(); ++level) {
    absolute[level].values() = x[level].values();
    if (level > 0) {
      AddRefined(absolute[level - 1], absolute[level]);
    }
    absolute[level].FillHalo();
    product[level].Clear();
    if (!levels_[level].matrix.empty()) {
      levels_[level].matrix.AddProduct(absolute[level], product[level]);
      product[level].FoldHalo();
    }
  }
  for (int level = space_->finest(); level > 0; --level) {
    AddRestricted(product[level], product[level - 1]);
    Mask(level, product[level]);
  }
}

// Returns the scalar products of the two, per channel.
std::vector<double> NestedSolve::Divide(const NestedValues& residual, NestedValues& divided) const {
  for (int level = 0; level <= space_->finest(); ++level) {
    const std::vector<double>& diagonal = levels_[level].diagonal;
    for (int c = 0; c < Channels(); ++c) {
      const double* const r = residual[level].Channel(c);
      double* const z = divided[level].Channel(c);
      for (std::size_t k = 0; k < diagonal.size(); ++k) {
        z[k] = diagonal[k] > 0 ? r[k] / diagonal[k] : 0;
      }
    }
  }
  std::vector<double> products;
  for (int c = 0; c < Channels(); ++c) {
    products.push_back(Dot(residual, divided, c));
  }
  return products;
}

int NestedSolve::Solve(double least_gain) {
  constexpr double kRounding = 1e-16, kProbe = 1e-3;  // of what there was to gain at first
  NestedValues residual = right_, divided = Zeros(), product = Zeros(), absolute = Zeros();
  std::vector<double> enough = Divide(residual, divided);
  for (int c = 0; c < Channels(); ++c) {
    enough[c] *= c < points_.channels ? kRounding : kProbe;
    enough[c] = c < points_.channels ? std::max(enough[c], least_gain) : enough[c];
  }
  Multiply(solution_, product, absolute);
  for (int c = 0; c < Channels(); ++c) {
    AddMultiple(-1, product, c, residual);
  }
  std::vector<double> left = Divide(residual, divided);
  NestedValues direction = divided;
  int steps = 0;
  for (; steps < kMostSteps; ++steps) {
    bool done = true;
    for (int c = 0; c < Channels(); ++c) {
      done = done && !(left[c] > enough[c]);
    }
    if (done) {
      break;
    }
    Multiply(direction, product, absolute);
    for (int c = 0; c < Channels(); ++c) {
      const double curvature = Dot(direction, product, c);
      const double length = curvature > 0 ? left[c] / curvature : 0;
      AddMultiple(length, direction, c, solution_);
      AddMultiple(-length, product, c, residual);
    }
    const std::vector<double> next = Divide(residual, divided);
    for (int c = 0; c < Channels(); ++c) {
      ContinueFrom(divided, left[c] > 0 ? next[c] / left[c] : 0, c, direction);
    }
    left = next;
  }
  return steps;
}

double NestedSolve::Trace() const { return Dot(right_, solution_, points_.channels); }

NestedValues NestedSolve::Displacements() const {
  NestedValues absolute = solution_;
  for (int level = 0; level <= space_->finest(); ++level) {
    if (level > 0) {
      AddRefined(absolute[level - 1], absolute[level]);
    }
    absolute[level].FillHalo();
  }
  return absolute;
}

NestedSolve::Residual NestedSolve::ResidualAt(const NestedValues& displacements,
                                              std::uint32_t k) const {
  const int level = space_->LeafLevel(points_.x[k], points_.y[k]);
  const GridValues& values = displacements[level];
  const NestedPlace place = PlaceOn(values.layout().grid, level, points_.x[k], points_.y[k]);
  Residual residual;
  for (int c = 0; c < points_.channels; ++c) {
    double sum = 0;
    for (int b = 0; b < 4; ++b) {
      const double* const row = values.Row(c, place.j + b) + place.i;
      double along = 0;
      for (int a = 0; a < 4; ++a) {
        along += place.along_u[a] * row[a];
      }
      sum += place.along_v[b] * along;
    }
    residual.along[c] = points_.value[c][k] - sum;
  }
  return residual;
}

}  // namespace semblance
