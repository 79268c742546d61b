// SPDX-License-Identifier: GPL-3.0-or-later
// What the YAML file of a study says:
//
//     title: ...
//     base: ../phantom.yaml            # the experiment that the trials vary
//     set: {implicit.resolution: 75}   # for all trials
//     subjects:                        # each with what it changes; without it, the base's own
//       - {name: a, set: {subject.random_seed: 1}}
//       - {name: b, base: ../cranium.yaml, optional: true}   # skipped where its files are missing
//     grid: {interp: [nearest, mean], implicit.resolution: [40, 60]}   # every combination
//     zip: {fit.features: [restore, free], title: [a, b]}              # side by side
//     list: [{seeds.level: 1}, {seeds.level: 2, rounds: 2}]            # by hand
//     sample: {method: lhs, n: 20, random_seed: 1, ranges: {seeds.weight: [0.1, 1.0]}}
//     tags: [paper, 2026]              # words that people find it by
//     metric: face.rms_mm              # that the report ranks by
//     keep: summary
//     job: face
//     identify: {others: [{name: c, set: {subject.random_seed: 3}}]}   # for job: identify
//
// Each of grid, zip, list and sample gives rows; a trial is a subject with one row of each. A value
// is any part of an experiment, be it a number or a whole strategy.
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

namespace semblance {

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
  std::string name;            // unique in the study
  std::filesystem::path base;  // laid over the study's base; empty: none
  OptionValues set;            // laid over both, and over the study's own `set`
  bool optional = false;       // not the default: a study that lacks a subject says something else
  std::vector<std::string> tags;  // words that --only can ask for, e.g. [phantom]
};
template <class Visitor>
void Fields(Visitor& visit, StudySubject& o) {
  visit(FieldInfo{.name = "name", .doc = "of the subject; no two have the same"}, o.name);
  visit(FieldInfo{.name = "base", .doc = "file of an experiment, laid over the study's base"},
        o.base);
  visit(FieldInfo{.name = "set", .doc = "values by option path, for this subject"}, o.set);
  visit(FieldInfo{.name = "optional",
                  .doc = "skip the subject where its files are missing, and say so, rather than "
                         "refuse the study"},
        o.optional);
  visit(FieldInfo{.name = "tags",
                  .doc = "words of one's own, e.g. [phantom, broken], for `study --only 'tag = "
                         "phantom'`"},
        o.tags);
}

// The gallery is the study's subjects and these others; everyone in it has a true skin.
struct IdentifyOptions {
  std::vector<StudySubject> others;  // whom no trial asks for
  double ceiling_cell_mm = 3;        // the ceiling is the true face in vertices so far apart,
  double ceiling_noise_mm = 0.5;     // each off by so much (rms): what another scan would show
  std::uint64_t random_seed = 1;     // of the noise
};
template <class Visitor>
void Fields(Visitor& visit, IdentifyOptions& o) {
  visit(FieldInfo{.name = "others",
                  .doc = "people of the gallery beside the study's subjects, whom no trial asks "
                         "for: name, base and set as those have"},
        o.others);
  visit(
      FieldInfo{.name = "ceiling_cell_mm",
                .unit = "mm",
                .min = 0.1,
                .max = 20,
                .doc = "of the ceiling, the true face seen again: how far its vertices are apart"},
      o.ceiling_cell_mm);
  visit(FieldInfo{.name = "ceiling_noise_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 20,
                  .doc = "of the ceiling: rms by which each vertex is off along its normal"},
        o.ceiling_noise_mm);
  visit(FieldInfo{.name = "random_seed", .doc = "of the ceiling's noise"}, o.random_seed);
}

// lhs: one point in each of n equal slices of each axis (McKay et al. 1979); sobol: the first n
// points of the sequence after its origin.
enum class SampleMethod { kLhs, kSobol };
constexpr auto EnumNames(SampleMethod) { return std::to_array<std::string_view>({"lhs", "sobol"}); }

struct StudySamples {
  SampleMethod method = SampleMethod::kLhs;  // covers each axis evenly whatever n is; sobol is best
                                             // for powers of two
  int n = 0;                                 // must be given
  std::uint64_t random_seed = 1;             // of lhs
  ConfigMap<std::array<ConfigNode, 2>> ranges;  // lowest and highest; as they are written, because
                                                // [1, 5] asks for whole numbers and [1.0, 5.0] not
};
template <class Visitor>
void Fields(Visitor& visit, StudySamples& o) {
  visit(FieldInfo{.name = "method", .doc = "Latin hypercube, or Sobol's sequence"}, o.method);
  visit(FieldInfo{.name = "n", .min = 1, .max = 100000, .doc = "how many samples; must be given"},
        o.n);
  visit(FieldInfo{.name = "random_seed", .doc = "of lhs; sobol draws no random numbers"},
        o.random_seed);
  visit(FieldInfo{.name = "ranges",
                  .doc = "lowest and highest number by option path; where both are written without "
                         "a point, so are the samples"},
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
  std::string title = "untitled";  // of the report
  std::filesystem::path base;  // must be given: a study varies an experiment that runs by itself
  OptionValues set;            // for all trials
  std::vector<StudySubject> subjects;       // empty: the base's own subject
  OptionAxes grid;                          // the last axis varies fastest
  OptionAxes zip;                           // values side by side
  std::vector<OptionValues> list;           // rows by hand
  std::optional<StudySamples> sample;       // rows drawn from ranges
  std::vector<std::string> tags;            // that it is found by
  std::string metric = "face.rms_mm";       // that the report ranks by
  TrialFiles keep = TrialFiles::kSummary;   // the files of a run are some 30 MB, of a summary 10 kB
  StudyJob job = StudyJob::kFace;           // face, depth, or identify
  std::optional<IdentifyOptions> identify;  // of that job only; left out, its defaults
};
template <class Visitor>
void Fields(Visitor& visit, StudyFile& o) {
  visit(FieldInfo{.name = "title", .doc = "what the report is headed with"}, o.title);
  visit(FieldInfo{.name = "base", .doc = "file of the experiment that the trials vary"}, o.base);
  visit(FieldInfo{.name = "set", .doc = "values by option path, for all trials"}, o.set);
  visit(FieldInfo{.name = "subjects",
                  .min = 1,
                  .doc = "what a result is averaged and tested over; left out, the base's own"},
        o.subjects);
  visit(
      FieldInfo{
          .name = "grid", .min = 1, .doc = "values by option path; every combination is a row"},
      o.grid);
  visit(FieldInfo{.name = "zip",
                  .min = 1,
                  .doc = "values by option path, side by side: the first of each is a row, ..."},
        o.zip);
  visit(FieldInfo{.name = "list", .min = 1, .doc = "rows by hand: values by option path"}, o.list);
  visit(FieldInfo{.name = "sample", .doc = "rows of numbers drawn from ranges"}, o.sample);
  visit(FieldInfo{.name = "tags",
                  .doc = "words of one's own that the study is found by; they stand in its report "
                         "and in results.sqlite"},
        o.tags);
  visit(FieldInfo{.name = "metric",
                  .doc = "a number of result.json by its path, which the report ranks by: lower "
                         "is better, but of shares within a distance, as face.within_2_5mm"},
        o.metric);
  visit(FieldInfo{.name = "keep",
                  .doc = "of each trial: summary, the numbers; view, also what the report's 3-D "
                         "view needs (job: depth: pictures of the first subject's depth maps); "
                         "run, all files of a run"},
        o.keep);
  visit(FieldInfo{.name = "job",
                  .doc = "face; depth: the interpolated depth without a fit; identify: the face, "
                         "and its rank among the subjects' true faces"},
        o.job);
  visit(FieldInfo{.name = "identify", .doc = "for job: identify"}, o.identify);
}
template <class Report>
void CheckValue(Report& report, const StudyFile& o) {
  if (o.identify && o.job != StudyJob::kIdentify) {
    report("identify", "is for a study of that job only; set job: identify, or take it out");
  }
}

// Throws IoError if the file cannot be read. What is wrong with it goes to `errors`; `tree` gets
// what the file says, for the places of further faults.
StudyFile ReadStudyFile(const std::filesystem::path& file, ConfigNode& tree, ConfigErrors& errors);

using OptionSetting = OptionValues::Entry;
using StudyRow = std::vector<OptionSetting>;

// A plan holds each of its trials with all options.
inline constexpr double kMostTrials = 100'000;

// Whether subjects and rows make more trials than that, in words, known before one is made; empty
// if they do not.
std::string ComplaintAboutSize(const StudyFile& study);

// The rows of the whole file: every combination of one row of grid, zip, list and sample each; one
// empty row if there is none of them. Faults go to `errors`.
std::vector<StudyRow> StudyRows(const StudyFile& study, ConfigErrors& errors);

// Sets the option in an experiment's tree; `defaults` as for SetPath. A path that leads nowhere is
// an error at its location.
void ApplySetting(const OptionSetting& setting, const ConfigNode& defaults, ConfigNode& tree,
                  ConfigErrors& errors);

}  // namespace semblance
