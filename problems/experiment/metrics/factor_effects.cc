// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/metrics/factor_effects.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include "surfaces/base/error.h"
#include "surfaces/base/random.h"

namespace semblance::problems {
namespace {

// A table of numbers over several factors, the last one fastest.
struct Table {
  std::vector<std::size_t> levels;
  std::vector<double> values;
};

std::size_t CountCells(const std::vector<std::size_t>& levels) {
  return std::accumulate(levels.begin(), levels.end(), std::size_t{1}, std::multiplies<>());
}

// The distance in `values` between neighbouring levels of a factor.
std::size_t FindStride(const std::vector<std::size_t>& levels, std::size_t factor) {
  return CountCells({levels.begin() + static_cast<long>(factor) + 1, levels.end()});
}

std::size_t LevelOf(const std::vector<std::size_t>& levels, std::size_t cell, std::size_t factor) {
  return cell / FindStride(levels, factor) % levels[factor];
}

double Mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

// Subtracts the mean along one factor from every line of the table.
void CentreAlong(Table& table, std::size_t factor) {
  const std::size_t stride = FindStride(table.levels, factor), count = table.levels[factor];
  for (std::size_t cell = 0; cell < table.values.size(); ++cell) {
    if (LevelOf(table.levels, cell, factor) == 0) {
      double sum = 0;
      for (std::size_t k = 0; k < count; ++k) {
        sum += table.values[cell + k * stride];
      }
      for (std::size_t k = 0; k < count; ++k) {
        table.values[cell + k * stride] -= sum / static_cast<double>(count);
      }
    }
  }
}

// The deviations of one subject that belong to the effect alone.
Table EffectTable(const GridValues& grid, std::size_t subject,
                  const std::vector<std::size_t>& factors) {
  Table table{{}, LevelMeans(grid, subject, factors)};
  for (const std::size_t factor : factors) {
    table.levels.push_back(grid.levels[factor]);
  }
  for (std::size_t k = 0; k < factors.size(); ++k) {
    CentreAlong(table, k);
  }
  return table;
}

// The table with new levels in place of the old ones: `order` has one permutation per factor.
std::vector<double> Rearranged(const Table& table,
                               const std::vector<std::vector<std::size_t>>& order) {
  std::vector<double> values(table.values.size());
  for (std::size_t cell = 0; cell < values.size(); ++cell) {
    std::size_t from = 0, stride = 1, rest = cell;
    for (std::size_t k = table.levels.size(); k-- > 0;) {  // the last factor is the fastest
      from += stride * order[k][rest % table.levels[k]];
      rest /= table.levels[k];
      stride *= table.levels[k];
    }
    values[cell] = table.values[from];
  }
  return values;
}

std::vector<std::vector<std::size_t>> FirstOrder(const std::vector<std::size_t>& levels) {
  std::vector<std::vector<std::size_t>> order;
  for (const std::size_t count : levels) {
    order.emplace_back(count);
    std::iota(order.back().begin(), order.back().end(), 0);
  }
  return order;
}

double SumOfSquares(const std::vector<double>& values) {
  return std::inner_product(values.begin(), values.end(), values.begin(), 0.0);
}

void Add(const std::vector<double>& values, std::vector<double>& sum) {
  std::ranges::transform(values, sum, sum.begin(), std::plus<>());
}

// The arrangements of one subject, and of all subjects but the first: only the differences between
// subjects matter, so that the first one keeps its order. Infinite if too many.
struct ArrangementCount {
  double one = 1, all = 1;
};

ArrangementCount CountArrangements(const std::vector<std::size_t>& levels, std::size_t subjects) {
  ArrangementCount count;
  for (const std::size_t n : levels) {
    count.one *= std::tgamma(static_cast<double>(n) + 1);
  }
  count.all = std::pow(count.one, static_cast<double>(subjects) - 1);
  return count;
}

// All arrangements of one subject's table.
std::vector<std::vector<double>> ListArrangements(const Table& table) {
  std::vector<std::vector<double>> all;
  auto order = FirstOrder(table.levels);
  const std::function<void(std::size_t)> permute = [&](std::size_t k) {
    if (k == order.size()) {
      all.push_back(Rearranged(table, order));
      return;
    }
    do {
      permute(k + 1);
    } while (std::ranges::next_permutation(order[k]).found);
  };
  permute(0);
  return all;
}

// Equal sums of squares may differ by rounding, and count as equal.
bool IsAtLeast(double squares, double observed) { return squares >= observed * (1 - 1e-9); }

double CountExactly(const std::vector<Table>& tables, double observed) {
  // The first subject keeps its order. Its arrangements may be too many even to be listed: a single
  // subject and a factor of eleven levels have forty million.
  std::vector<std::vector<std::vector<double>>> choices(tables.size());
  for (std::size_t subject = 1; subject < tables.size(); ++subject) {
    choices[subject] = ListArrangements(tables[subject]);
  }
  std::size_t extreme = 0, count = 0;
  const std::function<void(std::size_t, const std::vector<double>&)> visit =
      [&](std::size_t subject, const std::vector<double>& sum) {
        if (subject == tables.size()) {
          ++count;
          extreme += IsAtLeast(SumOfSquares(sum), observed) ? 1 : 0;
          return;
        }
        for (const std::vector<double>& choice : choices[subject]) {
          std::vector<double> next = sum;
          Add(choice, next);
          visit(subject + 1, next);
        }
      };
  visit(1, tables[0].values);
  return static_cast<double>(extreme) / static_cast<double>(count);
}

// The number of draws: fewer for large grids, so that an effect takes a second or so.
int CountDraws(const std::vector<Table>& tables) {
  constexpr double kMostDraws = 19999, kFewestDraws = 999, kMostCells = 1e8;
  const auto cells = static_cast<double>(tables.size() * tables[0].values.size());
  return static_cast<int>(std::clamp(std::floor(kMostCells / cells), kFewestDraws, kMostDraws));
}

// The observed arrangement counts as one draw, so that p is never 0 (Phipson and Smyth 2010).
double CountByDraws(const std::vector<Table>& tables, double observed) {
  const int draws = CountDraws(tables);
  Random random(1);
  auto order = FirstOrder(tables[0].levels);
  int extreme = 1;
  for (int draw = 0; draw < draws; ++draw) {
    std::vector<double> sum(tables[0].values.size(), 0);
    for (const Table& table : tables) {
      for (std::vector<std::size_t>& levels : order) {
        random.Shuffle(levels);
      }
      Add(Rearranged(table, order), sum);
    }
    extreme += IsAtLeast(SumOfSquares(sum), observed) ? 1 : 0;
  }
  return static_cast<double>(extreme) / (draws + 1);
}

double SquaresWithinSubjects(const GridValues& grid) {
  double squares = 0;
  for (const std::vector<double>& row : grid.subject) {
    const double mean = Mean(row);
    for (const double value : row) {
      squares += (value - mean) * (value - mean);
    }
  }
  return squares;
}

}  // namespace

void CheckGrid(const GridValues& grid) {
  const bool has_levels =
      !grid.levels.empty() && std::ranges::all_of(grid.levels, [](std::size_t n) { return n > 1; });
  if (!has_levels || grid.subject.empty()) {
    throw InputError(fmt::format(
        "a grid of {} factors and {} subjects: it needs a factor, two levels or more of each "
        "factor, and a subject",
        grid.levels.size(), grid.subject.size()));
  }
  const std::size_t cells = CountCells(grid.levels);
  for (std::size_t n = 0; n < grid.subject.size(); ++n) {
    const auto finite =
        std::ranges::count_if(grid.subject[n], [](double value) { return std::isfinite(value); });
    if (grid.subject[n].size() != cells || finite != std::ssize(grid.subject[n])) {
      throw InputError(
          fmt::format("a grid of {} cells: subject {} has {} finite values; give one per cell",
                      cells, n, finite));
    }
  }
}

std::vector<double> LevelMeans(const GridValues& grid, std::size_t subject,
                               const std::vector<std::size_t>& factors) {
  std::size_t count = 1;
  for (const std::size_t factor : factors) {
    count *= grid.levels[factor];
  }
  std::vector<double> means(count, 0);
  const std::vector<double>& row = grid.subject[subject];
  for (std::size_t cell = 0; cell < row.size(); ++cell) {
    std::size_t to = 0;
    for (const std::size_t factor : factors) {
      to = to * grid.levels[factor] + LevelOf(grid.levels, cell, factor);
    }
    means[to] += row[cell] * static_cast<double>(count) / static_cast<double>(row.size());
  }
  return means;
}

FactorEffect ComputeEffect(const GridValues& grid, const std::vector<std::size_t>& factors) {
  constexpr double kMostCounted = 20000;
  CheckGrid(grid);
  std::vector<Table> tables;
  for (std::size_t n = 0; n < grid.subject.size(); ++n) {
    tables.push_back(EffectTable(grid, n, factors));
  }
  std::vector<double> sum(tables[0].values.size(), 0);
  for (const Table& table : tables) {
    Add(table.values, sum);
  }
  const double within = SquaresWithinSubjects(grid), observed = SumOfSquares(sum);
  const auto subjects = static_cast<double>(tables.size());
  const double cells_per_mean =
      static_cast<double>(grid.subject[0].size()) / static_cast<double>(sum.size());
  FactorEffect effect{.factors = factors};
  effect.share = within > 0 ? observed / subjects * cells_per_mean / within : kNaN;
  effect.exact = CountArrangements(tables[0].levels, tables.size()).all <= kMostCounted;
  effect.p = effect.exact ? CountExactly(tables, observed) : CountByDraws(tables, observed);
  return effect;
}

std::vector<std::vector<double>> RemoveSubjectMeans(const std::vector<std::vector<double>>& rows) {
  if (rows.empty() || rows[0].size() < 2) {
    return rows;
  }
  const auto columns = static_cast<double>(rows[0].size());
  std::vector<double> column_means(rows[0].size(), 0);
  for (const std::vector<double>& row : rows) {
    for (std::size_t c = 0; c < row.size(); ++c) {
      column_means[c] += row[c] / static_cast<double>(rows.size());
    }
  }
  const double mean = Mean(column_means), widening = std::sqrt(columns / (columns - 1));
  std::vector<std::vector<double>> removed = rows;
  for (std::vector<double>& row : removed) {
    const double own = Mean(row);
    for (std::size_t c = 0; c < row.size(); ++c) {
      row[c] = column_means[c] + widening * (row[c] - own + mean - column_means[c]);
    }
  }
  return removed;
}

}  // namespace semblance::problems
