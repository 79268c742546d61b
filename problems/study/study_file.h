// SPDX-License-Identifier: GPL-3.0-or-later
// The YAML file of a study, and the rows of settings that it expands to:
//
//     title: ...
//     base: ../phantom.yaml            # the experiment that the trials vary
//     set: {implicit.resolution: 75}   # for all trials
//     subjects:                        # each with its changes; left out: the base's own subject
//       - {name: a, set: {subject.random_seed: 1}}
//       - {name: b, base: ../cranium.yaml, optional: true}   # skipped if its files are missing
//     grid: {interp: [nearest, mean], implicit.resolution: [40, 60]}   # every combination
//     zip: {fit.features: [restore, free], title: [a, b]}              # side by side
//     list: [{seeds.level: 1}, {seeds.level: 2, rounds: 2}]            # by hand
//     sample: {method: lhs, n: 20, random_seed: 1, ranges: {seeds.weight: [0.1, 1.0]}}
//     tags: [paper, 2026]              # words to find the study by
//     metric: face.rms_mm              # the report ranks by it
//     keep: summary
//     job: face
//     plugins: [mine.py]               # schemes and metrics in Python
//     identify: {others: [{name: c, set: {subject.random_seed: 3}}]}   # for job: identify
//
// Each of grid, zip, list and sample gives rows of settings. A trial is a subject with one row of
// each. A value is any part of an experiment: a number, or a whole strategy.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "problems/config/config_tree.h"
#include "surfaces/base/fields.h"

namespace semblance::problems {

// Values by option path ("interp", "seeds.weight"), and lists of them.
using OptionValues = ConfigMap<ConfigNode>;
using OptionAxes = ConfigMap<std::vector<ConfigNode>>;

enum class TrialFiles { kSummary, kView, kRun };
constexpr auto EnumNames(TrialFiles) {
  return std::to_array<std::string_view>({"summary", "view", "run"});
}

enum class StudyJob { kFace, kDepth, kIdentify };
constexpr auto EnumNames(StudyJob) {
  return std::to_array<std::string_view>({"face", "depth", "identify"});
}

struct StudySubject {
  std::string name;
  std::filesystem::path base;  // empty: none
  OptionValues set;
  bool optional = false;  // not the default: a study without one of its subjects is another study
  std::vector<std::string> tags;
};
template <class Visitor>
void Fields(Visitor& visit, StudySubject& o) {
  visit(FieldInfo{.name = "name", .doc = "name of the subject; each subject has its own"}, o.name);
  visit(FieldInfo{.name = "base", .doc = "file of an experiment, merged over the study's base"},
        o.base);
  visit(
      FieldInfo{
          .name = "set",
          .doc = "values by option path, for this subject; merged over both bases and the study's "
                 "own set"},
      o.set);
  visit(
      FieldInfo{.name = "optional",
                .doc = "skip the subject with a note if its files are missing, rather than refuse "
                       "the study"},
      o.optional);
  visit(FieldInfo{.name = "tags",
                  .doc = "free words, e.g. [phantom, broken], for `study --only 'tag = phantom'`"},
        o.tags);
}

// The gallery is the study's subjects and these others; everyone in it has a true skin. The ceiling
// compares a person's true face with itself, resampled and noisy as in another scan.
struct IdentifyOptions {
  std::vector<StudySubject> others;
  double ceiling_cell_mm = 3;
  double ceiling_noise_mm = 0.5;
  std::uint64_t random_seed = 1;
};
template <class Visitor>
void Fields(Visitor& visit, IdentifyOptions& o) {
  visit(
      FieldInfo{.name = "others",
                .doc = "further people of the gallery, for whom there is no trial: name, base and "
                       "set as for subjects"},
      o.others);
  visit(
      FieldInfo{
          .name = "ceiling_cell_mm",
          .unit = "mm",
          .min = 0.1,
          .max = 20,
          .doc = "distance between the vertices of the ceiling, the true face in another scan"},
      o.ceiling_cell_mm);
  visit(FieldInfo{.name = "ceiling_noise_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 20,
                  .doc = "rms error of each vertex of the ceiling along its normal"},
        o.ceiling_noise_mm);
  visit(FieldInfo{.name = "random_seed", .doc = "seed of the ceiling's noise"}, o.random_seed);
}

// kLhs: a Latin hypercube, one point in each of n equal slices of each axis (McKay et al. 1979).
// kSobol: the first n points of Sobol's sequence after its origin.
enum class SampleMethod { kLhs, kSobol };
constexpr auto EnumNames(SampleMethod) { return std::to_array<std::string_view>({"lhs", "sobol"}); }

struct StudySamples {
  SampleMethod method = SampleMethod::kLhs;
  int n = 0;  // must be given
  std::uint64_t random_seed = 1;
  // Lowest and highest number, as written: [1, 5] means whole numbers, [1.0, 5.0] any numbers.
  ConfigMap<std::array<ConfigNode, 2>> ranges;
};
template <class Visitor>
void Fields(Visitor& visit, StudySamples& o) {
  visit(
      FieldInfo{.name = "method",
                .doc = "lhs, a Latin hypercube, covers each axis evenly for any n; sobol, Sobol's "
                       "sequence, is best if n is a power of two"},
      o.method);
  visit(FieldInfo{.name = "n", .min = 1, .max = 100000, .doc = "number of samples; must be given"},
        o.n);
  visit(FieldInfo{.name = "random_seed", .doc = "seed of lhs; sobol draws no random numbers"},
        o.random_seed);
  visit(FieldInfo{.name = "ranges",
                  .doc =
                      "lowest and highest number by option path; if both are whole numbers, so are "
                      "the samples"},
        o.ranges);
}
template <class Report>
void CheckValue(Report& report, const StudySamples& o) {
  if (o.n == 0) {
    report("n", "the number of samples is missing; write it as in n: 20");
  }
  if (o.ranges.entries.empty()) {
    report("ranges", "there is no range; give one or more, as in {seeds.weight: [0.1, 1.0]}");
  }
}

struct StudyFile {
  std::string title = "untitled";
  std::filesystem::path base;  // must be given: a study varies an experiment that runs by itself
  OptionValues set;
  std::vector<StudySubject> subjects;  // empty: the base's own subject
  OptionAxes grid;                     // the last axis varies fastest
  OptionAxes zip;
  std::vector<OptionValues> list;
  std::optional<StudySamples> sample;
  std::vector<std::string> tags;
  std::string metric = "face.rms_mm";
  TrialFiles keep = TrialFiles::kSummary;  // a run keeps some 30 MB, a summary 10 kB
  StudyJob job = StudyJob::kFace;
  std::optional<IdentifyOptions> identify;
  std::vector<std::filesystem::path> plugins;
};
template <class Visitor>
void Fields(Visitor& visit, StudyFile& o) {
  visit(FieldInfo{.name = "title", .doc = "title of the report"}, o.title);
  visit(FieldInfo{.name = "base", .doc = "file of the experiment that the trials vary"}, o.base);
  visit(FieldInfo{.name = "set", .doc = "values by option path, for all trials"}, o.set);
  visit(
      FieldInfo{
          .name = "subjects",
          .min = 1,
          .doc = "the subjects that results are averaged and tested over; left out, the base's own "
                 "subject"},
      o.subjects);
  visit(
      FieldInfo{
          .name = "grid", .min = 1, .doc = "values by option path; every combination is a row"},
      o.grid);
  visit(
      FieldInfo{.name = "zip",
                .min = 1,
                .doc = "lists of values by option path, of the same length: the first of each make "
                       "the first row, and so on"},
      o.zip);
  visit(FieldInfo{.name = "list", .min = 1, .doc = "rows written out: values by option path"},
        o.list);
  visit(FieldInfo{.name = "sample", .doc = "rows of numbers drawn from ranges"}, o.sample);
  visit(
      FieldInfo{.name = "tags",
                .doc = "free words to find the study by; its report and results.sqlite have them"},
      o.tags);
  visit(FieldInfo{.name = "metric",
                  .doc = "the number that the report ranks by, as a path in result.json: higher is "
                         "better for shares within a distance (face.within_2_5mm), nearest to its "
                         "target for signed errors and coverages, lower for all others; or an "
                         "expression over such numbers (+ - * /, abs, sqrt, min, max; lower is "
                         "better), e.g. \"face.rms_mm + 0.5 * abs(face.mean_signed_mm)\"; "
                         "`semblance options metrics` lists the numbers"},
        o.metric);
  visit(FieldInfo{.name = "keep",
                  .doc = "files kept per trial: summary, the numbers; view, also the faces for the "
                         "report's 3-D view (job: depth: pictures of the first subject's depth "
                         "maps); run, all files of a run"},
        o.keep);
  visit(
      FieldInfo{.name = "job",
                .doc =
                    "face: a run per trial; depth: the interpolated depth without a fit; identify: "
                    "a run, and the rank of the face among the subjects' true faces"},
      o.job);
  visit(FieldInfo{.name = "identify", .doc = "options of job: identify"}, o.identify);
  visit(FieldInfo{.name = "plugins",
                  .doc = "Python files with schemes and metrics for this study, which `python3 -m "
                         "semblance study` then runs"},
        o.plugins);
}
template <class Report>
void CheckValue(Report& report, const StudyFile& o) {
  if (o.identify && o.job != StudyJob::kIdentify) {
    report("identify", "only a study with job: identify has it; set that job, or take it out");
  }
}

// Reads a study file. Adds its faults to `errors`, and stores its tree in `tree` for the locations
// of later faults. Throws IoError if the file cannot be read.
StudyFile ReadStudyFile(const std::filesystem::path& file, ConfigNode& tree, ConfigErrors& errors);

using OptionSetting = OptionValues::Entry;
using StudyRow = std::vector<OptionSetting>;

// Returns a complaint if subjects and rows make more than 100,000 trials, else "". It only counts,
// because a plan holds each trial with all options in memory.
std::string ComplaintAboutSize(const StudyFile& study);

// Expands the rows: every combination of one row each of grid, zip, list and sample, or one empty
// row if there are none. Adds faults to `errors`.
std::vector<StudyRow> MakeStudyRows(const StudyFile& study, ConfigErrors& errors);

// Sets an option in an experiment's tree, with `defaults` as for SetPath. A path that does not
// exist is an error at its location.
void ApplySetting(const OptionSetting& setting, const ConfigNode& defaults, ConfigNode& tree,
                  ConfigErrors& errors);

}  // namespace semblance::problems
