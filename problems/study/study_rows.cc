// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/study_rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/random/sobol.hpp>
#include <cmath>

#include "problems/config/config_reader.h"
#include "surfaces/base/fields.h"
#include "surfaces/base/random.h"

namespace semblance {
namespace {

// The map under `key`, or null if there is none or it is no map (which is an error).
const ConfigNode* FindMap(const ConfigNode& study, const char* key, ConfigErrors& errors) {
  const ConfigNode* node = study.Find(key);
  if (node && !node->IsMap()) {
    errors.Add(node->place, key, "a map of option paths is due, as in {interp: [nearest, mean]}");
    return nullptr;
  }
  return node;
}

// Each entry of the map as (path, list of values); entries that are no list of one or more are
// errors.
std::vector<const ConfigNode::Entry*> Axes(const ConfigNode& map, const char* key,
                                           ConfigErrors& errors) {
  std::vector<const ConfigNode::Entry*> axes;
  for (const ConfigNode::Entry& entry : map.entries) {
    if (!entry.value.IsList() || entry.value.items.empty()) {
      errors.Add(entry.value.place, JoinPath(key, entry.key),
                 "a list of one or more values is due, as in [1, 2]");
    } else {
      axes.push_back(&entry);
    }
  }
  return axes;
}

// Every combination of one of `left` with one of `right`, the last varying fastest.
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

std::vector<StudyRow> GridRows(const ConfigNode& study, ConfigErrors& errors) {
  std::vector<StudyRow> rows(1);
  if (const ConfigNode* grid = FindMap(study, "grid", errors)) {
    for (const ConfigNode::Entry* axis : Axes(*grid, "grid", errors)) {
      std::vector<StudyRow> values;
      for (const ConfigNode& value : axis->value.items) {
        values.push_back({{axis->key, axis->key_place, value}});
      }
      rows = Product(rows, values);
    }
  }
  return rows;
}

std::vector<StudyRow> ZipRows(const ConfigNode& study, ConfigErrors& errors) {
  const ConfigNode* zip = FindMap(study, "zip", errors);
  const auto axes = zip ? Axes(*zip, "zip", errors) : std::vector<const ConfigNode::Entry*>{};
  if (axes.empty()) {
    return std::vector<StudyRow>(1);
  }
  std::vector<StudyRow> rows(axes[0]->value.items.size());
  for (const ConfigNode::Entry* axis : axes) {
    if (axis->value.items.size() != rows.size()) {
      errors.Add(axis->value.place, JoinPath("zip", axis->key),
                 fmt::format("{} values, but '{}' has {}; the lists of zip go side by side",
                             axis->value.items.size(), axes[0]->key, rows.size()));
      continue;
    }
    for (std::size_t n = 0; n < rows.size(); ++n) {
      rows[n].push_back({axis->key, axis->key_place, axis->value.items[n]});
    }
  }
  return rows;
}

std::vector<StudyRow> ListRows(const ConfigNode& study, ConfigErrors& errors) {
  const ConfigNode* list = study.Find("list");
  if (!list) {
    return std::vector<StudyRow>(1);
  }
  if (!list->IsList() || list->items.empty()) {
    errors.Add(list->place, "list", "a list of maps is due, as in [{seeds.level: 1}]");
    return std::vector<StudyRow>(1);
  }
  std::vector<StudyRow> rows;
  for (std::size_t n = 0; n < list->items.size(); ++n) {
    const ConfigNode& item = list->items[n];
    if (!item.IsMap()) {
      errors.Add(item.place, JoinPath("list", n), "a map of option paths is due");
      continue;
    }
    StudyRow row;
    for (const ConfigNode::Entry& entry : item.entries) {
      row.push_back({entry.key, entry.key_place, entry.value});
    }
    rows.push_back(row);
  }
  return rows;
}

struct SampleRange {
  const ConfigNode::Entry* entry;
  double low = 0, high = 0;
  bool whole = false;  // both ends are written as whole numbers: so are the samples
};

struct SampleSpec {
  SampleMethod method = SampleMethod::kLhs;
  int n = 0;
  std::uint64_t random_seed = 1;
  std::vector<SampleRange> ranges;
};

void ReadRange(const ConfigNode::Entry& entry, ConfigErrors& errors, SampleSpec& spec) {
  const std::string path = JoinPath("sample.ranges", entry.key);
  SampleRange range{&entry};
  const std::size_t before = errors.size();
  if (!entry.value.IsList() || entry.value.items.size() != 2) {
    errors.Add(entry.value.place, path, "two numbers are due, as in [0.1, 1.0]");
    return;
  }
  ReadScalar(errors, {entry.value.items[0], JoinPath(path, std::size_t{0}), FieldInfo{}},
             range.low);
  ReadScalar(errors, {entry.value.items[1], JoinPath(path, std::size_t{1}), FieldInfo{}},
             range.high);
  if (errors.size() == before && !(range.low < range.high)) {
    errors.Add(entry.value.place, path, "the first number must be the lower");
  }
  range.whole = std::all_of(
      entry.value.items.begin(), entry.value.items.end(),
      [](const ConfigNode& item) { return item.text.find_first_of(".eE") == std::string::npos; });
  spec.ranges.push_back(range);
}

SampleSpec ReadSample(const ConfigNode& sample, ConfigErrors& errors) {
  SampleSpec spec;
  const std::vector<std::string> known = {"method", "n", "random_seed", "ranges"},
                                 methods = {"lhs", "sobol"};
  RefuseUnknownKeys(errors, {sample, "sample", FieldInfo{}}, known);
  if (const ConfigNode* method = sample.Find("method")) {
    const FieldInfo info;
    spec.method =
        ReadWord(errors, {*method, "sample.method", info}, "word", methods).value_or(0) == 0
            ? SampleMethod::kLhs
            : SampleMethod::kSobol;
  }
  if (const ConfigNode* n = sample.Find("n")) {
    const FieldInfo info{.name = "n", .min = 1, .max = 100000};
    ReadScalar(errors, {*n, "sample.n", info}, spec.n);
  } else {
    errors.Add(sample.place, "sample", "n is due: how many samples");
  }
  if (const ConfigNode* seed = sample.Find("random_seed")) {
    const FieldInfo info;
    ReadScalar(errors, {*seed, "sample.random_seed", info}, spec.random_seed);
  }
  const ConfigNode* ranges = sample.Find("ranges");
  if (!ranges || !ranges->IsMap() || ranges->entries.empty()) {
    errors.Add(sample.place, "sample", "ranges are due, as in {seeds.weight: [0.1, 1.0]}");
    return spec;
  }
  for (const ConfigNode::Entry& entry : ranges->entries) {
    ReadRange(entry, errors, spec);
  }
  return spec;
}

std::string SampleText(const SampleRange& range, double unit) {
  if (range.whole) {
    const double count = range.high - range.low + 1;
    return fmt::format("{:.0f}", range.low + std::min(std::floor(unit * count), count - 1));
  }
  const std::string text = fmt::format("{}", range.low + unit * (range.high - range.low));
  return text;
}

std::vector<StudyRow> SampleRows(const ConfigNode& study, ConfigErrors& errors) {
  const ConfigNode* sample = FindMap(study, "sample", errors);
  if (!sample) {
    return std::vector<StudyRow>(1);
  }
  const std::size_t before = errors.size();
  const SampleSpec spec = ReadSample(*sample, errors);
  if (errors.size() > before) {
    return std::vector<StudyRow>(1);
  }
  std::vector<StudyRow> rows;
  for (const auto& point :
       UnitSamples(spec.method, spec.n, static_cast<int>(spec.ranges.size()), spec.random_seed)) {
    StudyRow row;
    for (std::size_t k = 0; k < spec.ranges.size(); ++k) {
      ConfigNode value = ConfigNode::Scalar(SampleText(spec.ranges[k], point[k]));
      value.place = spec.ranges[k].entry->value.place;
      row.push_back({spec.ranges[k].entry->key, spec.ranges[k].entry->key_place, value});
    }
    rows.push_back(row);
  }
  return rows;
}

}  // namespace

std::vector<StudyRow> StudyRows(const ConfigNode& study, ConfigErrors& errors) {
  return Product(Product(GridRows(study, errors), ZipRows(study, errors)),
                 Product(ListRows(study, errors), SampleRows(study, errors)));
}

std::vector<std::vector<double>> UnitSamples(SampleMethod method, int n, int dimensions,
                                             std::uint64_t random_seed) {
  std::vector<std::vector<double>> points(n, std::vector<double>(dimensions));
  if (method == SampleMethod::kSobol) {
    boost::random::sobol engine(dimensions);
    for (auto& point : points) {
      for (double& x : point) {
        x = static_cast<double>(engine() >> 11) * 0x1.0p-53;
      }
    }
    return points;
  }
  Random random(random_seed);
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

}  // namespace semblance
