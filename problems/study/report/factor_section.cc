// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/report/factor_section.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>

#include "problems/experiment/metrics/factor_effects.h"
#include "problems/report/plain_names.h"
#include "problems/report/plots/factor_plot.h"
#include "problems/report/plots/heat_map.h"

namespace semblance::problems {
namespace {

constexpr std::size_t kLeastGridSubjects = 6;  // five cannot reach p < 0.05 with two levels
constexpr std::size_t kMostPivotRows = 60;

// The metric in words, without its path, which would be longer than a picture is wide.
std::string MetricLabel(const StudyResults& results) {
  const std::string words = WordsOfMetric(results.metric), path = " (" + results.metric + ")";
  return (words.ends_with(path) ? words.substr(0, words.size() - path.size()) : words) +
         results.preference.TargetSuffix();
}

std::string ProbabilityText(double p) { return p < 0.0001 ? "<0.0001" : fmt::format("{:.4f}", p); }

// The means of all combinations of some factors over the subjects.
struct FactorMeans {
  std::vector<std::size_t> factors;  // ascending
  std::vector<PlottedMean> means;    // of each combination, the last factor fastest
};

// The intervals are those of the values without the differences between subjects.
FactorMeans ComputeMeans(const FactorGrid& grid, std::vector<std::size_t> factors) {
  std::ranges::sort(factors);
  std::vector<std::vector<double>> rows;
  for (std::size_t n = 0; n < grid.subjects.size(); ++n) {
    rows.push_back(LevelMeans(grid.values, n, factors));
  }
  rows = RemoveSubjectMeans(rows);
  FactorMeans result{std::move(factors), {}};
  for (std::size_t c = 0; c < rows[0].size(); ++c) {
    std::vector<double> column;
    for (const std::vector<double>& row : rows) {
      column.push_back(row[c]);
    }
    const SampleSummary s = Summarize(column);
    result.means.push_back({s.mean, s.mean_95});
  }
  return result;
}

// The mean at these levels, one per factor of the grid. Levels of other factors are ignored.
const PlottedMean& MeanAt(const FactorGrid& grid, const FactorMeans& means,
                          const std::vector<std::size_t>& levels) {
  std::size_t at = 0;
  for (const std::size_t factor : means.factors) {
    at = at * grid.factors[factor].levels.size() + levels[factor];
  }
  return means.means[at];
}

std::vector<FactorEffect> ComputeEffects(const FactorGrid& grid) {
  std::vector<FactorEffect> effects;
  for (std::size_t k = 0; k < grid.factors.size(); ++k) {
    effects.push_back(ComputeEffect(grid.values, {k}));
  }
  for (std::size_t k = 0; k < grid.factors.size(); ++k) {
    for (std::size_t j = k + 1; j < grid.factors.size(); ++j) {
      effects.push_back(ComputeEffect(grid.values, {k, j}));
    }
  }
  return effects;
}

// The factors in the order in which they are drawn: along the x axis, as lines, as panels. An
// ordered factor goes along the axis; the others follow by the share of their effects. `effects`
// begins with the main effects.
std::vector<std::size_t> ChooseRoles(const FactorGrid& grid,
                                     const std::vector<FactorEffect>& effects) {
  std::vector<std::size_t> order(grid.factors.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(
      order, [&](std::size_t a, std::size_t b) { return effects[a].share > effects[b].share; });
  const auto has_order = [&](std::size_t k) { return grid.factors[k].is_ordered; };
  const auto more_levels = [&](std::size_t a, std::size_t b) {
    return grid.factors[a].levels.size() < grid.factors[b].levels.size();
  };
  auto first = std::ranges::find_if(order, has_order);
  first = first == order.end() ? std::ranges::max_element(order, more_levels) : first;
  std::rotate(order.begin(), first, first + 1);
  return order;
}

// "a, averaged over b and c" for the factors that are not among the first `shown` roles.
std::string AveragedText(const FactorGrid& grid, const std::vector<std::size_t>& roles,
                         std::size_t shown) {
  std::vector<std::string> names;
  for (std::size_t k = shown; k < roles.size(); ++k) {
    names.push_back(grid.factors[roles[k]].name);
  }
  return names.empty() ? "" : fmt::format(", averaged over {}", fmt::join(names, " and "));
}

ReportImage LinesImage(const StudyResults& results, const FactorGrid& grid,
                       const std::vector<std::size_t>& roles) {
  const std::size_t shown = std::min<std::size_t>(roles.size(), 3);
  const FactorMeans means =
      ComputeMeans(grid, {roles.begin(), roles.begin() + static_cast<long>(shown)});
  const StudyFactor& across = grid.factors[roles[0]];
  FactorPlot plot{.x_label = across.name,
                  .y_label = MetricLabel(results),
                  .levels = across.levels,
                  .positions = across.positions,
                  .lines = shown > 1 ? grid.factors[roles[1]].levels : std::vector{std::string()},
                  .panels = {}};
  const std::vector<std::string> panels =
      shown > 2 ? grid.factors[roles[2]].levels : std::vector{std::string()};
  std::vector<std::size_t> at(grid.factors.size(), 0);
  for (std::size_t p = 0; p < panels.size(); ++p) {
    plot.panels.push_back(
        {shown > 2 ? fmt::format("{} = {}", grid.factors[roles[2]].name, panels[p]) : "", {}});
    at[roles[std::min<std::size_t>(2, roles.size() - 1)]] = p;
    for (std::size_t n = 0; n < plot.lines.size(); ++n) {
      plot.panels[p].lines.emplace_back();
      if (shown > 1) {
        at[roles[1]] = n;
      }
      for (std::size_t k = 0; k < plot.levels.size(); ++k) {
        at[roles[0]] = k;
        plot.panels[p].lines[n].push_back(MeanAt(grid, means, at));
      }
    }
  }
  const std::string parallel =
      shown > 1 ? fmt::format(
                      " Lines: {}. If they are not parallel, the effect of one factor depends "
                      "on the other.",
                      grid.factors[roles[1]].name)
                : std::string();
  return {FactorPlotSvg(plot),
          fmt::format("Means over {}{}. Whiskers: 95 % intervals without the differences between "
                      "subjects.{}",
                      Counted(std::ssize(grid.subjects), "subject"),
                      AveragedText(grid, roles, shown), parallel),
          fmt::format("means of the metric along {}, one line per level of the other factors",
                      across.name)};
}

ReportImage MarginsImage(const StudyResults& results, const FactorGrid& grid) {
  std::vector<PlottedLevel> rows;
  for (std::size_t k = 0; k < grid.factors.size(); ++k) {
    const FactorMeans means = ComputeMeans(grid, {k});
    for (std::size_t n = 0; n < means.means.size(); ++n) {
      rows.push_back({grid.factors[k].name, grid.factors[k].levels[n], means.means[n]});
    }
  }
  return {MeansPlotSvg(rows, MetricLabel(results)),
          "Marginal means: each level, averaged over all levels of the other factors, with the 95 "
          "% interval without the differences between subjects.",
          "marginal means of the metric with intervals, one row per level of each factor"};
}

ReportImage HeatImage(const StudyResults& results, const FactorGrid& grid,
                      const std::vector<std::size_t>& roles) {
  const FactorMeans means = ComputeMeans(grid, roles);
  HeatMap map{.rows = grid.factors[roles[1]].levels,
              .columns = grid.factors[roles[0]].levels,
              .values = {},
              .title = MetricLabel(results)};
  std::vector<std::size_t> at(2, 0);
  for (at[roles[1]] = 0; at[roles[1]] < map.rows.size(); ++at[roles[1]]) {
    map.values.emplace_back();
    for (at[roles[0]] = 0; at[roles[0]] < map.columns.size(); ++at[roles[0]]) {
      map.values.back().push_back(MeanAt(grid, means, at).mean);
    }
  }
  return {HeatMapSvg(map), "The same means as colours.",
          "means of the metric for every combination of the two factors, as colours"};
}

std::string EffectName(const FactorGrid& grid, const FactorEffect& effect) {
  std::vector<std::string> names;
  for (const std::size_t factor : effect.factors) {
    names.push_back(grid.factors[factor].name);
  }
  return fmt::format("{}", fmt::join(names, " x "));
}

// The worst level of a factor against its best one, paired by subject.
struct LargestDifference {
  std::string levels;  // "nearest minus kriging"
  SampleSummary difference;
};

LargestDifference FindLargestDifference(const StudyResults& results, const FactorGrid& grid,
                                        std::size_t factor) {
  const std::vector<PlottedMean> means = ComputeMeans(grid, {factor}).means;
  const auto is_better = [&](const PlottedMean& a, const PlottedMean& b) {
    return results.preference.IsBetter(a.mean, b.mean);
  };
  const auto best = static_cast<std::size_t>(std::ranges::min_element(means, is_better) -
                                             means.begin()),
             worst = static_cast<std::size_t>(std::ranges::max_element(means, is_better) -
                                              means.begin());
  std::vector<double> differences;
  for (std::size_t n = 0; n < grid.subjects.size(); ++n) {
    const std::vector<double> levels = LevelMeans(grid.values, n, {factor});
    differences.push_back(levels[worst] - levels[best]);
  }
  const std::vector<std::string>& names = grid.factors[factor].levels;
  return {fmt::format("{} minus {}", names[worst], names[best]), Summarize(differences)};
}

// Explains the columns of EffectsTable.
std::string TestText(const FactorGrid& grid, const std::vector<FactorEffect>& effects) {
  if (grid.subjects.size() < kLeastGridSubjects) {
    return fmt::format("There is no test: at least {} subjects with every combination are needed.",
                       kLeastGridSubjects);
  }
  const bool is_exact = std::ranges::all_of(effects, &FactorEffect::exact);
  return fmt::format(
      "p is the share of rearrangements of a factor's levels within each subject ({}) that give an "
      "effect at least as large; Holm's correction is for all effects of this table. The share of "
      "the variation refers to all deviations from the subjects' own means; all else is how "
      "subjects differ in their response{}.",
      is_exact ? "all of them" : "up to 20,000 random ones where there are more",
      grid.factors.size() > 2 ? ", and interactions of three or more factors" : "");
}

// The last row holds the part of the variation that no listed effect explains.
ReportTable EffectsTable(const StudyResults& results, const FactorGrid& grid,
                         const std::vector<FactorEffect>& effects) {
  ReportTable table{"Effects of the factors and of their interactions. " + TestText(grid, effects),
                    {"effect", "share of the variation (%)", "worst minus best level", "difference",
                     "95 % interval", "p", "p, Holm"}};
  std::vector<double> p;
  std::ranges::transform(effects, std::back_inserter(p), &FactorEffect::p);
  const std::vector<double> adjusted = Holm(p);
  const bool is_tested = grid.subjects.size() >= kLeastGridSubjects;
  double rest = 1;
  for (std::size_t k = 0; k < effects.size(); ++k) {
    const FactorEffect& effect = effects[k];
    const LargestDifference largest = effect.factors.size() == 1
                                          ? FindLargestDifference(results, grid, effect.factors[0])
                                          : LargestDifference();
    rest -= effect.share;
    table.AddRow(EffectName(grid, effect), TablePercent(effect.share), largest.levels,
                 largest.difference.mean, IntervalText(largest.difference.mean_95),
                 is_tested ? ProbabilityText(effect.p) : "",
                 is_tested ? ProbabilityText(adjusted[k]) : "");
  }
  table.AddRow("all else", TablePercent(std::max(0.0, rest)), "", "", "", "", "");
  return table;
}

// Every combination: the levels of the x axis as columns, all other factors as rows, and the means
// of both.
ReportTable PivotTable(const StudyResults& results, const FactorGrid& grid, std::size_t across) {
  std::vector<std::size_t> all(grid.factors.size()), others;
  std::iota(all.begin(), all.end(), 0);
  std::ranges::copy_if(all, std::back_inserter(others), [&](std::size_t k) { return k != across; });
  const FactorMeans cells = ComputeMeans(grid, all), rows = ComputeMeans(grid, others),
                    columns = ComputeMeans(grid, {across});
  std::vector<std::string> names;
  for (const std::size_t k : others) {
    names.push_back(grid.factors[k].name);
  }
  ReportTable table{
      fmt::format("{}: means over {}; columns: {}", MetricLabel(results),
                  Counted(std::ssize(grid.subjects), "subject"), grid.factors[across].name),
      {fmt::format("{}", fmt::join(names, ", "))}};
  std::ranges::copy(grid.factors[across].levels, std::back_inserter(table.header));
  table.header.emplace_back("mean");
  double mean = 0;
  for (std::size_t r = 0; r < std::min(rows.means.size(), kMostPivotRows); ++r) {
    std::vector<std::size_t> at(grid.factors.size(), 0);
    std::vector<std::string> labels(others.size());
    for (std::size_t k = others.size(), rest = r; k-- > 0;) {
      const std::vector<std::string>& levels = grid.factors[others[k]].levels;
      at[others[k]] = rest % levels.size();
      labels[k] = levels[at[others[k]]];
      rest /= levels.size();
    }
    std::vector<std::string> row = {fmt::format("{}", fmt::join(labels, ", "))};
    for (at[across] = 0; at[across] < grid.factors[across].levels.size(); ++at[across]) {
      row.push_back(TableNumber(MeanAt(grid, cells, at).mean));
    }
    row.push_back(TableNumber(rows.means[r].mean));
    table.rows.push_back(std::move(row));
  }
  std::vector<std::string> last = {"mean"};
  for (const PlottedMean& column : columns.means) {
    last.push_back(TableNumber(column.mean));
    mean += column.mean / static_cast<double>(columns.means.size());
  }
  last.push_back(TableNumber(mean));
  table.rows.push_back(std::move(last));
  return table;
}

ReportTable MarginsTable(const FactorGrid& grid) {
  ReportTable table{"Marginal means", {"level", "factor", "mean", "95 % interval within subjects"}};
  for (std::size_t k = 0; k < grid.factors.size(); ++k) {
    const FactorMeans means = ComputeMeans(grid, {k});
    for (std::size_t n = 0; n < means.means.size(); ++n) {
      table.AddRow(grid.factors[k].levels[n], grid.factors[k].name, means.means[n].mean,
                   IntervalText(means.means[n].interval));
    }
  }
  return table;
}

// States which subjects are compared.
std::string SubjectsText(const FactorGrid& grid) {
  std::vector<std::string> factors;
  for (const StudyFactor& factor : grid.factors) {
    factors.push_back(fmt::format("{} ({} levels)", factor.name, factor.levels.size()));
  }
  std::string text = fmt::format(
      "{} {} a value for every combination of {}; only these are "
      "compared.",
      Counted(std::ssize(grid.subjects), "subject"), grid.subjects.size() == 1 ? "has" : "have",
      fmt::join(factors, " and "));
  if (!grid.left_out.empty()) {
    text += fmt::format(" Left out, because a combination is missing: {}.",
                        Counted(std::ssize(grid.left_out), "subject"));
  }
  return text;
}

ReportSection OneFactor(const StudyResults& results, const FactorGrid& grid) {
  return {.heading = fmt::format("Along {}", grid.factors[0].name),
          .images = {LinesImage(results, grid, {0})}};
}

std::string NoSubjectText(const FactorGrid& grid) {
  return fmt::format(
      "No subject has a value for every combination of the factors ({} lack at least one), so "
      "their effects cannot be separated. Run the missing trials.",
      Counted(std::ssize(grid.left_out), "subject"));
}

}  // namespace

std::vector<ReportSection> FactorSections(const StudyResults& results, const FactorGrid& grid) {
  ReportSection section{.heading = "Factors"};
  if (!grid.complaint.empty()) {
    section.paragraphs = {grid.complaint};
    return {section};
  }
  if (grid.factors.empty() || (grid.factors.size() == 1 && !grid.factors[0].is_ordered)) {
    return {};
  }
  if (grid.subjects.empty()) {
    section.paragraphs = {NoSubjectText(grid)};
    return {section};
  }
  if (grid.factors.size() == 1) {
    return {OneFactor(results, grid)};
  }
  const std::vector<FactorEffect> effects = ComputeEffects(grid);
  const std::vector<std::size_t> roles = ChooseRoles(grid, effects);
  section.paragraphs = {SubjectsText(grid)};
  section.images = {LinesImage(results, grid, roles), MarginsImage(results, grid)};
  if (roles.size() == 2) {
    section.images.push_back(HeatImage(results, grid, roles));
  }
  section.tables = {EffectsTable(results, grid, effects)};
  return {section,
          {.heading = "Factors in numbers",
           .tables = {PivotTable(results, grid, roles[0]), MarginsTable(grid)},
           .folded = true}};
}

}  // namespace semblance::problems
