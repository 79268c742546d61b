// SPDX-License-Identifier: GPL-3.0-or-later
// Tables of tissue depth (thesis app. A; configs/tables): a row per site, a cell per stratum.
//
// A table has either the six strata of build and sex, "emaciated_male" ... "obese_female", or the
// one stratum "adult": then it is pooled, and holds for every sex and build alike.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "surfaces/base/fields.h"
#include "surfaces/base/geometry.h"

namespace semblance {

enum class Sex { kMale, kFemale };
enum class Build { kEmaciated, kNormal, kObese };
// Of one cell: kSuspect is used but reported, kMissing has no mean.
enum class CellFlag { kOk, kSuspect, kMissing };
enum class DepthMethod { kUnspecified, kNeedle, kUltrasound, kCt, kMri, kMixed };
enum class DepthConvention { kUnspecified, kAlongBoneNormal, kClosestPoint };
enum class DepthPosture { kUnspecified, kSupine, kUpright, kMixed };

constexpr auto EnumNames(Sex) { return std::to_array<std::string_view>({"male", "female"}); }
constexpr auto EnumNames(Build) {
  return std::to_array<std::string_view>({"emaciated", "normal", "obese"});
}
constexpr auto EnumNames(CellFlag) {
  return std::to_array<std::string_view>({"ok", "suspect", "missing"});
}
constexpr auto EnumNames(DepthMethod) {
  return std::to_array<std::string_view>(
      {"unspecified", "needle", "ultrasound", "ct", "mri", "mixed"});
}
constexpr auto EnumNames(DepthConvention) {
  return std::to_array<std::string_view>({"unspecified", "along_bone_normal", "closest_point"});
}
constexpr auto EnumNames(DepthPosture) {
  return std::to_array<std::string_view>({"unspecified", "supine", "upright", "mixed"});
}

struct TissueCell {
  std::optional<double> mean;  // mm; none if and only if missing
  std::optional<double> sd;    // mm
  std::optional<int> n;        // subjects behind them
  CellFlag flag = CellFlag::kOk;
  std::string note;  // for people
};

struct TissueRow {
  std::string site;                          // code without side; need not be a standard one
  std::optional<int> number;                 // in the printed table
  std::string name;                          // as printed
  std::map<std::string, TissueCell> values;  // by stratum
};

struct TissueMeasurement {
  DepthMethod method = DepthMethod::kUnspecified;              // e.g. needle, ultrasound, CT
  DepthConvention convention = DepthConvention::kUnspecified;  // along which direction
  DepthPosture posture = DepthPosture::kUnspecified;           // of the people measured
};

// What is known of a person beside depths, as a number.
struct TissueCovariate {
  std::string name;               // one of CovariateNames()
  double mean = kNaN, sd = kNaN;  // over people, in its own unit
};

// How depths go together over people: what one of them tells of the others.
struct TissueCorrelations {
  int subjects = 0;                         // they were found on
  double shrinkage = 0;                     // part that is not theirs but a model's
  std::vector<TissueCovariate> covariates;  // that are among the names
  std::vector<std::string> names;           // sites with their side, and covariates
  std::vector<std::vector<double>> rows;    // row k: with the names 0 .. k-1
};

struct TissueTable {
  std::string id;                // short, for messages
  std::string title;             // for people
  std::string citation;          // where the numbers were published
  std::string population_label;  // as printed
  std::string units = "mm";      // always
  TissueMeasurement measurement;
  std::vector<TissueRow> rows;                     // one per site
  std::optional<TissueCorrelations> correlations;  // where they are known
};

struct TissueDepth {
  double mean_mm = 0;  // > 0
  std::optional<double> sd_mm;
  CellFlag flag = CellFlag::kOk;  // never kMissing
  std::string note;
  std::optional<int> n;  // subjects
};

template <class Visitor>
void Fields(Visitor& visit, TissueCell& o) {
  visit(FieldInfo{.name = "mean", .unit = "mm", .min = 0.01, .max = 100, .doc = "null if missing"},
        o.mean);
  visit(FieldInfo{.name = "sd", .unit = "mm", .min = 0, .max = 100, .doc = "standard deviation"},
        o.sd);
  visit(FieldInfo{.name = "n", .min = 1, .max = 1e7, .doc = "subjects behind them"}, o.n);
  visit(FieldInfo{.name = "flag", .doc = "suspect: used, but reported; missing: no mean"}, o.flag);
  visit(FieldInfo{.name = "note", .doc = "why the cell is flagged"}, o.note);
}

template <class Visitor>
void Fields(Visitor& visit, TissueRow& o) {
  visit(FieldInfo{.name = "site", .doc = "code without side"}, o.site);
  visit(FieldInfo{.name = "number", .min = 1, .doc = "in the printed table"}, o.number);
  visit(FieldInfo{.name = "name", .doc = "as printed"}, o.name);
  visit(FieldInfo{.name = "values", .doc = "a cell for each stratum"}, o.values);
}

template <class Visitor>
void Fields(Visitor& visit, TissueMeasurement& o) {
  visit(FieldInfo{.name = "method", .doc = "how depths were measured"}, o.method);
  visit(FieldInfo{.name = "convention", .doc = "in which direction"}, o.convention);
  visit(FieldInfo{.name = "posture", .doc = "how the subjects lay or sat"}, o.posture);
}

template <class Visitor>
void Fields(Visitor& visit, TissueCovariate& o) {
  visit(FieldInfo{.name = "name",
                  .doc = "sex (0 female, 1 male), build (-1 emaciated, 0 normal, 1 "
                         "obese), age_years or bmi"},
        o.name);
  visit(FieldInfo{.name = "mean", .doc = "over the subjects"}, o.mean);
  visit(FieldInfo{.name = "sd", .min = 1e-9, .doc = "over the subjects"}, o.sd);
}

template <class Visitor>
void Fields(Visitor& visit, TissueCorrelations& o) {
  visit(FieldInfo{.name = "subjects",
                  .min = 0,
                  .max = 1e7,
                  .doc = "that they were found on; 0: taken as exact"},
        o.subjects);
  visit(FieldInfo{.name = "shrinkage",
                  .min = 0,
                  .max = 1,
                  .doc = "part of each correlation that is a model's and not the subjects'"},
        o.shrinkage);
  visit(FieldInfo{.name = "covariates", .doc = "what the names beside sites are"}, o.covariates);
  visit(FieldInfo{.name = "names", .min = 1, .doc = "sites with their side, and covariates"},
        o.names);
  visit(FieldInfo{.name = "rows",
                  .min = 1,
                  .doc = "one per name: its correlations with the names before it, so the first "
                         "row is empty"},
        o.rows);
}

template <class Visitor>
void Fields(Visitor& visit, TissueTable& o) {
  visit(FieldInfo{.name = "id", .doc = "short name for messages"}, o.id);
  visit(FieldInfo{.name = "title", .doc = "for people"}, o.title);
  visit(FieldInfo{.name = "citation", .doc = "where the numbers were published"}, o.citation);
  visit(FieldInfo{.name = "population_label", .doc = "who was measured, as printed"},
        o.population_label);
  visit(FieldInfo{.name = "units", .doc = "mm"}, o.units);
  visit(FieldInfo{.name = "measurement", .doc = "method, convention and posture"}, o.measurement);
  visit(FieldInfo{.name = "rows", .min = 1, .doc = "one per site"}, o.rows);
  visit(FieldInfo{.name = "correlations",
                  .doc = "of depths with each other, with build, sex and age, over people; null: "
                         "not known"},
        o.correlations);
}

// sex, build, age_years, bmi: what depths may be conditioned on beside depths.
std::vector<std::string> CovariateNames();

// As the table counts them: male 1, female 0; emaciated -1, normal 0, obese 1.
double CovariateOf(Sex sex);
double CovariateOf(Build build);

// "emaciated_male" ... "obese_female".
std::string StratumName(Sex sex, Build build);

// The one way to read a table, as the checks are made here. Throws IoError if the file cannot be
// read; ConfigError if it is not such a table: units other than mm, strata that are neither the six
// nor "adult", a site that appears twice or with a side, a mean in a missing cell or none in
// another, correlations that no depths can have (not positive definite) or of a site without sd.
TissueTable ReadTissueTable(const std::filesystem::path& path);

// The depth at a site, with or without _l / _r; a pooled table ignores `sex` and `build`. None if
// the table has no such site or its cell is missing.
std::optional<TissueDepth> FindDepth(const TissueTable& table, Sex sex, Build build,
                                     const std::string& site);

// Why there is none: "not in the table", or "missing" with the cell's note.
std::string WhyNoDepth(const TissueTable& table, Sex sex, Build build, const std::string& site);

// The rows, by their code and in the table's order, that hold one of `sites` and in which depth
// does not grow from emaciated over normal to obese in this sex: a depth between two builds must
// not be interpolated there.
std::vector<std::string> UnorderedLandmarks(const TissueTable& table, Sex sex,
                                            std::span<const std::string> sites);

// One line for each row in which depth does not grow from emaciated over normal to obese in one of
// the sexes, and one for each suspect cell. To be told, not to be refused: the published tables
// have them.
std::vector<std::string> TableWarnings(const TissueTable& table);

}  // namespace semblance
