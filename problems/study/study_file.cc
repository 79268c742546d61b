// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/study_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/random/sobol.hpp>
#include <cmath>
#include <iterator>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "problems/config/config.h"
#include "problems/config/config_reader.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/base/fields.h"
#include "surfaces/base/random.h"

namespace semblance::problems {
namespace {

// Combines each row of `left` with each row of `right`. The right row varies fastest.
std::vector<StudyRow> Product(const std::vector<StudyRow>& left,
                              const std::vector<StudyRow>& right) {
  std::vector<StudyRow> rows;
  for (const StudyRow& a : left) {
    for (const StudyRow& b : right) {
      rows.push_back(a);
      rows.back().insert(rows.back().end(), b.begin(), b.end());
    }
  }
  return rows;
}

std::vector<StudyRow> GridRows(const OptionAxes& grid) {
  std::vector<StudyRow> rows(1);
  for (const OptionAxes::Entry& axis : grid.entries) {
    std::vector<StudyRow> values;
    for (const ConfigNode& value : axis.value) {
      values.push_back({{axis.key, axis.key_location, value}});
    }
    rows = Product(rows, values);
  }
  return rows;
}

std::vector<StudyRow> ZipRows(const OptionAxes& zip, ConfigErrors& errors) {
  if (zip.entries.empty()) {
    return std::vector<StudyRow>(1);
  }
  const OptionAxes::Entry& first = zip.entries.front();
  std::vector<StudyRow> rows(first.value.size());
  for (const OptionAxes::Entry& axis : zip.entries) {
    if (axis.value.size() != rows.size()) {
      errors.Add(axis.key_location, JoinPath("zip", axis.key),
                 fmt::format("{} values, but '{}' has {}; all lists of zip have the same length",
                             axis.value.size(), first.key, rows.size()));
      continue;
    }
    for (std::size_t n = 0; n < rows.size(); ++n) {
      rows[n].push_back({axis.key, axis.key_location, axis.value[n]});
    }
  }
  return rows;
}

std::vector<StudyRow> ListRows(const std::vector<OptionValues>& list) {
  std::vector<StudyRow> rows;
  for (const OptionValues& row : list) {
    rows.push_back(row.entries);
  }
  return rows.empty() ? std::vector<StudyRow>(1) : rows;
}

struct SampleRange {
  double low = 0, high = 0;
  bool whole = false;  // samples are whole numbers, because both ends are written so
};

// Reads a range. If the two are not a lower and a higher number, adds an error and returns nothing.
std::optional<SampleRange> ReadRange(const std::string& path, const ConfigLocation& location,
                                     const std::array<ConfigNode, 2>& ends, ConfigErrors& errors) {
  SampleRange range;
  const std::size_t before = errors.size();
  ReadScalar(errors, {ends[0], JoinPath(path, std::size_t{0}), FieldInfo{}}, range.low);
  ReadScalar(errors, {ends[1], JoinPath(path, std::size_t{1}), FieldInfo{}}, range.high);
  if (errors.size() == before && !(range.low < range.high)) {
    errors.Add(location, path, "the first number must be lower than the second");
  }
  range.whole = std::all_of(ends.begin(), ends.end(), [](const ConfigNode& end) {
    return end.text.find_first_of(".eE") == std::string::npos;
  });
  return errors.size() == before ? std::optional(range) : std::nullopt;
}

std::vector<std::vector<double>> SobolPoints(int n, int dimensions) {
  boost::random::sobol engine(dimensions);
  std::vector<std::vector<double>> points(n, std::vector<double>(dimensions));
  for (auto& point : points) {
    for (double& x : point) {
      x = static_cast<double>(engine() >> 11) *
          0x1.0p-53;  // the 53 highest bits, which a double holds
    }
  }
  return points;
}

std::vector<std::vector<double>> LatinHypercube(int n, int dimensions, std::uint64_t random_seed) {
  Random random(random_seed);
  std::vector<std::vector<double>> points(n, std::vector<double>(dimensions));
  for (int d = 0; d < dimensions; ++d) {
    std::vector<int> slice(n);
    for (int k = 0; k < n; ++k) {
      const int other = static_cast<int>(random.Uniform() * (k + 1));
      slice[k] = slice[other];
      slice[other] = k;
    }
    for (int k = 0; k < n; ++k) {
      points[k][d] = (slice[k] + random.Uniform()) / n;
    }
  }
  return points;
}

// samples.n points of the unit cube, which has one dimension for each range.
std::vector<std::vector<double>> UnitSamples(const StudySamples& samples) {
  const int dimensions = static_cast<int>(samples.ranges.entries.size());
  return samples.method == SampleMethod::kSobol
             ? SobolPoints(samples.n, dimensions)
             : LatinHypercube(samples.n, dimensions, samples.random_seed);
}

std::string SampleText(const SampleRange& range, double unit) {
  if (range.whole) {
    const double count = range.high - range.low + 1;
    return fmt::format("{:.0f}", range.low + std::min(std::floor(unit * count), count - 1));
  }
  return fmt::format("{}", range.low + unit * (range.high - range.low));
}

std::vector<StudyRow> SampleRows(const std::optional<StudySamples>& samples, ConfigErrors& errors) {
  if (!samples) {
    return std::vector<StudyRow>(1);
  }
  const auto& axes = samples->ranges.entries;
  std::vector<StudyRow> rows(static_cast<std::size_t>(samples->n));
  const auto points = UnitSamples(*samples);
  for (std::size_t k = 0; k < axes.size(); ++k) {
    const auto range = ReadRange(JoinPath("sample.ranges", axes[k].key), axes[k].key_location,
                                 axes[k].value, errors);
    for (std::size_t n = 0; range && n < rows.size(); ++n) {
      ConfigNode value = ConfigNode::Scalar(SampleText(*range, points[n][k]));
      value.location = axes[k].value[0].location;
      rows[n].push_back({axes[k].key, axes[k].key_location, std::move(value)});
    }
  }
  return rows;
}

// Counts the trials. The result is a double because it could overflow an integer.
double TrialCount(const StudyFile& study) {
  const auto at_least_one = [](const auto& list) {
    return static_cast<double>(std::max<std::size_t>(list.size(), 1));
  };
  double count = at_least_one(study.subjects) * at_least_one(study.list);
  for (const OptionAxes::Entry& axis : study.grid.entries) {
    count *= static_cast<double>(axis.value.size());
  }
  count *= study.zip.entries.empty() ? 1 : at_least_one(study.zip.entries[0].value);
  return study.sample ? count * study.sample->n : count;
}

// Two settings of one row: `later` is applied after `earlier`. Both paths are canonical.
bool SetTheSame(const std::string& earlier_path, const ConfigNode& earlier,
                const std::string& later_path, const ConfigNode& later) {
  if (SetsEntry(earlier_path, earlier, later_path)) {
    return true;
  }
  // A whole value that is not merged drops what was set within it before.
  const bool replaces = !later.IsMap() || later.Find("type") != nullptr;
  return SetsEntry(later_path, replaces ? ConfigNode() : later, earlier_path);
}

// Adds an error for each setting that sets an option which another one of its row has set, also by
// a path above or below, or by another spelling of the path.
void RefuseSameOptions(const std::vector<StudyRow>& rows, ConfigErrors& errors) {
  std::set<std::pair<std::string, std::string>> refused;
  for (const StudyRow& row : rows) {
    std::vector<std::string> paths;
    try {
      std::ranges::transform(row, std::back_inserter(paths), CanonicalPath, &OptionSetting::key);
    } catch (const ConfigError&) {
      return;  // ApplySetting reports a malformed path
    }
    for (std::size_t b = 0; b < row.size(); ++b) {
      for (std::size_t a = 0; a < b; ++a) {
        if (SetTheSame(paths[a], row[a].value, paths[b], row[b].value) &&
            refused.emplace(row[a].key, row[b].key).second) {
          errors.Add(row[b].key_location, row[b].key,
                     fmt::format("sets the same option as '{}' in line {}; take one of them out",
                                 row[a].key, row[a].key_location.line));
        }
      }
    }
  }
}

}  // namespace

StudyFile ReadStudyFile(const std::filesystem::path& file, ConfigNode& tree, ConfigErrors& errors) {
  const ConfigSource source{.name = file.string(),
                            .folder = std::filesystem::absolute(file).parent_path()};
  tree = ParseConfigText(ReadFileBytes(file), source, errors);
  if (tree.Find("search")) {
    errors.Add(FindLocation(tree, "search"), "search",
               "removed in 1.0; use Optuna, as docs/examples/search_with_optuna.py does");
    std::erase_if(tree.entries, [](const auto& entry) { return entry.key == "search"; });
  }
  return ReadConfigTree<StudyFile>(tree, errors);
}

std::string ComplaintAboutSize(const StudyFile& study) {
  constexpr double kMaxTrials = 100'000;
  const double count = TrialCount(study);
  return count <= kMaxTrials
             ? ""
             : fmt::format(
                   "subjects, grid, zip, list and sample make {:.6g} trials; a study has at most "
                   "{:.0f}: take values out, or draw some with sample",
                   count, kMaxTrials);
}

std::vector<StudyRow> MakeStudyRows(const StudyFile& study, ConfigErrors& errors) {
  std::vector<StudyRow> rows =
      Product(Product(GridRows(study.grid), ZipRows(study.zip, errors)),
              Product(ListRows(study.list), SampleRows(study.sample, errors)));
  RefuseSameOptions(rows, errors);
  return rows;
}

void ApplySetting(const OptionSetting& setting, const ConfigNode& defaults, ConfigNode& tree,
                  ConfigErrors& errors) {
  try {
    SetPath(tree, setting.key, setting.value, &defaults);
  } catch (const ConfigError& error) {
    errors.Add(setting.key_location, "", error.what());
  }
}

}  // namespace semblance::problems
