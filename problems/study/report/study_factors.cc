// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/report/study_factors.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>
#include <numeric>
#include <optional>
#include <regex>
#include <set>
#include <utility>

#include "problems/config/value_filter.h"

namespace semblance::problems {
namespace {

constexpr const char* kTitleAxis = "title";

// A level as the text around its numbers, and the numbers.
struct SplitLevel {
  std::string words;
  std::vector<double> numbers;
};

SplitLevel Split(const std::string& level) {
  static const std::regex kNumber(R"([-+]?\d+(\.\d+)?([eE][-+]?\d+)?)");
  SplitLevel split{.words = std::regex_replace(level, kNumber, "#"), .numbers = {}};
  for (std::sregex_iterator at(level.begin(), level.end(), kNumber), end; at != end; ++at) {
    split.numbers.push_back(NumberIn(at->str()).value_or(kNaN));
  }
  return split;
}

// The one number in which the levels differ, or none if there is no such number. At least two
// levels must have it.
std::optional<std::vector<double>> FindNumbers(const std::vector<std::string>& levels) {
  std::vector<SplitLevel> split;
  std::ranges::transform(levels, std::back_inserter(split), Split);
  std::set<std::size_t> differing;
  for (const SplitLevel& level : split) {
    if (level.words != split[0].words || level.numbers.size() != split[0].numbers.size()) {
      return std::nullopt;
    }
    for (std::size_t k = 0; k < level.numbers.size(); ++k) {
      if (level.numbers[k] != split[0].numbers[k]) {
        differing.insert(k);
      }
    }
  }
  if (differing.size() != 1) {
    return std::nullopt;
  }
  std::vector<double> numbers;
  for (const SplitLevel& level : split) {
    numbers.push_back(level.numbers[*differing.begin()]);
  }
  return numbers;
}

std::vector<double> CountUp(std::size_t count) {
  std::vector<double> positions(count);
  std::iota(positions.begin(), positions.end(), 0);
  return positions;
}

// The different values of an axis in the order of the plan.
std::vector<std::string> ListLevels(const std::vector<Treatment>& treatments, std::size_t axis) {
  std::vector<std::string> levels;
  std::set<std::string> seen;
  for (const Treatment& treatment : treatments) {
    if (seen.insert(treatment.values[axis]).second) {
      levels.push_back(treatment.values[axis]);
    }
  }
  return levels;
}

// Returns true if the value of one axis follows from that of the other, in both directions.
bool ChangeTogether(const std::vector<Treatment>& treatments, std::size_t one, std::size_t other) {
  std::set<std::pair<std::string, std::string>> pairs;
  for (const Treatment& treatment : treatments) {
    pairs.emplace(treatment.values[one], treatment.values[other]);
  }
  return pairs.size() == ListLevels(treatments, one).size() &&
         pairs.size() == ListLevels(treatments, other).size();
}

// The axes that vary, without those that change together with an earlier one.
std::vector<std::size_t> ListFreeAxes(const StudyResults& results,
                                      const std::vector<Treatment>& treatments) {
  std::vector<std::size_t> axes;
  for (std::size_t axis = 0; axis < results.axes.size(); ++axis) {
    const bool varies = ListLevels(treatments, axis).size() > 1;
    const bool is_new = std::ranges::none_of(
        axes, [&](std::size_t other) { return ChangeTogether(treatments, axis, other); });
    if (varies && is_new && results.axes[axis] != kTitleAxis) {
      axes.push_back(axis);
    }
  }
  return axes;
}

// The treatment of each cell, the last factor fastest. Empty unless each cell has one treatment.
std::vector<const Treatment*> FindCells(const std::vector<Treatment>& treatments,
                                        const std::vector<std::size_t>& axes,
                                        const std::vector<StudyFactor>& factors) {
  std::size_t count = 1;
  for (const StudyFactor& factor : factors) {
    count *= factor.levels.size();
  }
  if (count != treatments.size()) {  // before memory is taken: axes of numbers may be very long
    return {};
  }
  std::vector<const Treatment*> cells(count, nullptr);
  for (const Treatment& treatment : treatments) {
    std::size_t cell = 0;
    for (std::size_t k = 0; k < axes.size(); ++k) {
      const std::vector<std::string>& levels = factors[k].levels;
      cell = cell * levels.size() +
             static_cast<std::size_t>(std::ranges::find(levels, treatment.values[axes[k]]) -
                                      levels.begin());
    }
    cells[cell] = &treatment;
  }
  return std::ranges::find(cells, nullptr) == cells.end() ? cells : std::vector<const Treatment*>();
}

std::string ComplainAboutGrid(const std::vector<StudyFactor>& factors, std::size_t treatments) {
  std::vector<std::string> names;
  std::vector<std::size_t> counts;
  for (const StudyFactor& factor : factors) {
    names.push_back(factor.name);
    counts.push_back(factor.levels.size());
  }
  return fmt::format(
      "The {} treatments are not every combination of {} ({} values), so the effects of these "
      "factors cannot be separated.",
      treatments, fmt::join(names, " and "), fmt::join(counts, " x "));
}

std::string ComplainAboutCell(const Treatment& treatment) {
  return fmt::format(
      "The treatment {} has no value, so the effects of the factors cannot be separated.",
      treatment.label);
}

// Adds the subjects: those with a value in every cell, and the names of the others.
void FillSubjects(const StudyResults& results, const std::vector<const Treatment*>& cells,
                  FactorGrid& grid) {
  std::set<std::string> all;
  for (const Treatment* cell : cells) {
    for (const auto& [subject, value] : cell->by_subject) {
      all.insert(subject);
    }
  }
  for (const std::string& subject : all) {
    std::vector<double> row;
    for (const Treatment* cell : cells) {
      if (const auto value = cell->by_subject.find(subject); value != cell->by_subject.end()) {
        row.push_back(results.preference.Compared(value->second));
      }
    }
    if (row.size() == cells.size()) {
      grid.subjects.push_back(subject);
      grid.values.subject.push_back(std::move(row));
    } else {
      grid.left_out.push_back(subject);
    }
  }
}

}  // namespace

StudyFactor OrderLevels(std::string name, std::vector<std::string> levels) {
  StudyFactor factor{std::move(name), levels, CountUp(levels.size()), /*is_ordered=*/false};
  std::vector<std::string> first, last;
  const auto take = [&levels](const char* word, std::vector<std::string>& to) {
    if (std::erase(levels, word) > 0) {
      to.emplace_back(word);
    }
  };
  take("none", first);
  take("all", last);
  const auto numbers = levels.size() > 1 ? FindNumbers(levels) : std::nullopt;
  if (!numbers) {
    return factor;
  }
  std::vector<std::pair<double, std::string>> sorted;
  for (std::size_t k = 0; k < levels.size(); ++k) {
    sorted.emplace_back((*numbers)[k], levels[k]);
  }
  std::ranges::stable_sort(sorted);
  factor.is_ordered = true;
  factor.levels = first;
  for (const auto& [number, level] : sorted) {
    factor.levels.push_back(level);
  }
  factor.levels.insert(factor.levels.end(), last.begin(), last.end());
  if (std::ranges::all_of(factor.levels, [](const auto& l) { return NumberIn(l).has_value(); })) {
    std::ranges::transform(sorted, factor.positions.begin(), [](const auto& l) { return l.first; });
  }
  return factor;
}

FactorGrid FindFactorGrid(const StudyResults& results) {
  const std::vector<Treatment> treatments = Treatments(results, results.metric);
  const std::vector<std::size_t> axes = ListFreeAxes(results, treatments);
  FactorGrid grid;
  for (const std::size_t axis : axes) {
    grid.factors.push_back(OrderLevels(results.axes[axis], ListLevels(treatments, axis)));
    grid.values.levels.push_back(grid.factors.back().levels.size());
  }
  if (grid.factors.empty()) {
    return {};
  }
  const std::vector<const Treatment*> cells = FindCells(treatments, axes, grid.factors);
  if (cells.empty()) {
    FactorGrid none;
    none.complaint = ComplainAboutGrid(grid.factors, treatments.size());
    return none;
  }
  for (const Treatment* cell : cells) {
    if (cell->by_subject.empty()) {
      FactorGrid none;
      none.complaint = ComplainAboutCell(*cell);
      return none;
    }
  }
  FillSubjects(results, cells, grid);
  return grid;
}

}  // namespace semblance::problems
