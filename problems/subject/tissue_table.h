// SPDX-License-Identifier: GPL-3.0-or-later
// Tables of tissue depth (thesis app. A; configs/tables): a row per site, a cell per stratum.
//
// A table has either the six strata of build and sex, "emaciated_male" ... "obese_female", or only
// the stratum "adult". The latter is a pooled table, which applies to every sex and build.
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

namespace semblance::problems {

enum class Sex { kMale, kFemale };
enum class Build { kEmaciated, kNormal, kObese };
// The state of a cell: a suspect depth is used but reported; a missing one has no mean.
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
  std::optional<double> mean;  // mm
  std::optional<double> sd;    // mm
  std::optional<int> n;
  CellFlag flag = CellFlag::kOk;
  std::string note;
};

struct TissueRow {
  std::string site;  // need not be a standard site
  std::optional<int> number;
  std::string name;
  std::map<std::string, TissueCell> values;  // by stratum
};

struct TissueMeasurement {
  DepthMethod method = DepthMethod::kUnspecified;
  DepthConvention convention = DepthConvention::kUnspecified;
  DepthPosture posture = DepthPosture::kUnspecified;
};

// A property of a person other than a depth, as a number.
struct TissueCovariate {
  std::string name;  // one of CovariateNames()
  double mean = kNaN, sd = kNaN;
};

// Correlations of depths over people, from which a known depth predicts the others.
struct TissueCorrelations {
  int subjects = 0;
  double shrinkage = 0;
  std::vector<TissueCovariate> covariates;
  std::vector<std::string> names;
  std::vector<std::vector<double>> rows;  // row k: correlations with names 0 .. k-1
};

struct TissueTable {
  std::string id;
  std::string title;
  std::string citation;
  std::string population_label;
  std::string units = "mm";
  TissueMeasurement measurement;
  std::vector<TissueRow> rows;
  std::optional<TissueCorrelations> correlations;
};

struct TissueDepth {
  double mean_mm = 0;  // > 0
  std::optional<double> sd_mm;
  CellFlag flag = CellFlag::kOk;  // never kMissing
  std::string note;
  std::optional<int> n;  // number of subjects
};

template <class Visitor>
void Fields(Visitor& visit, TissueCell& o) {
  visit(FieldInfo{.name = "mean",
                  .unit = "mm",
                  .min = 0.01,
                  .max = 100,
                  .doc = "mean depth; null if and only if the cell is missing"},
        o.mean);
  visit(FieldInfo{.name = "sd", .unit = "mm", .min = 0, .max = 100, .doc = "standard deviation"},
        o.sd);
  visit(FieldInfo{.name = "n", .min = 1, .max = 1e7, .doc = "number of subjects"}, o.n);
  visit(FieldInfo{.name = "flag", .doc = "suspect: used, but reported; missing: no mean"}, o.flag);
  visit(FieldInfo{.name = "note", .doc = "why the cell is flagged"}, o.note);
}

template <class Visitor>
void Fields(Visitor& visit, TissueRow& o) {
  visit(FieldInfo{.name = "site", .doc = "code without side"}, o.site);
  visit(FieldInfo{.name = "number", .min = 1, .doc = "number in the printed table"}, o.number);
  visit(FieldInfo{.name = "name", .doc = "name as printed"}, o.name);
  visit(FieldInfo{.name = "values", .doc = "a cell for each stratum"}, o.values);
}

template <class Visitor>
void Fields(Visitor& visit, TissueMeasurement& o) {
  visit(FieldInfo{.name = "method", .doc = "how depths were measured"}, o.method);
  visit(FieldInfo{.name = "convention", .doc = "direction of measurement"}, o.convention);
  visit(FieldInfo{.name = "posture", .doc = "posture of the subjects"}, o.posture);
}

template <class Visitor>
void Fields(Visitor& visit, TissueCovariate& o) {
  visit(FieldInfo{.name = "name",
                  .doc = "sex (0 female, 1 male), build (-1 emaciated, 0 normal, 1 "
                         "obese), age_years or bmi"},
        o.name);
  visit(FieldInfo{.name = "mean", .doc = "mean over the subjects, in its own unit"}, o.mean);
  visit(FieldInfo{.name = "sd", .min = 1e-9, .doc = "standard deviation over the subjects"}, o.sd);
}

template <class Visitor>
void Fields(Visitor& visit, TissueCorrelations& o) {
  visit(FieldInfo{.name = "subjects",
                  .min = 0,
                  .max = 1e7,
                  .doc = "number of subjects behind the correlations; 0: taken as exact"},
        o.subjects);
  visit(FieldInfo{.name = "shrinkage",
                  .min = 0,
                  .max = 1,
                  .doc = "part of each correlation that comes from a model and not from subjects"},
        o.shrinkage);
  visit(FieldInfo{.name = "covariates", .doc = "the names that are not sites"}, o.covariates);
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
  visit(FieldInfo{.name = "title", .doc = "title for people"}, o.title);
  visit(FieldInfo{.name = "citation", .doc = "where the numbers were published"}, o.citation);
  visit(FieldInfo{.name = "population_label", .doc = "who was measured, as printed"},
        o.population_label);
  visit(FieldInfo{.name = "units", .doc = "always mm"}, o.units);
  visit(FieldInfo{.name = "measurement", .doc = "method, convention and posture"}, o.measurement);
  visit(FieldInfo{.name = "rows", .min = 1, .doc = "one per site"}, o.rows);
  visit(FieldInfo{.name = "correlations",
                  .doc = "correlations over people of depths with each other and with build, sex "
                         "and age; null: not known"},
        o.correlations);
}

// The properties of a person that depths may be conditioned on: sex, build, age_years, bmi.
std::vector<std::string> CovariateNames();

// The numbers that stand for sex and build: male 1, female 0; emaciated -1, normal 0, obese 1.
double CovariateValue(Sex sex);
double CovariateValue(Build build);

// "emaciated_male" ... "obese_female".
std::string StratumName(Sex sex, Build build);

// Reads and checks a table. Read tables only with this function, because the checks need its
// translation unit. Throws IoError if the file cannot be read. Throws ConfigError if it is not such
// a table: units other than mm, strata that are neither the six nor "adult", a site that appears
// twice or with a side, a mean in a missing cell or no mean in another cell, correlations that are
// not positive definite, or a correlation of a site without sd.
TissueTable ReadTissueTable(const std::filesystem::path& path);

// The depth at a site, whose code may be with or without _l / _r. A pooled table ignores `sex` and
// `build`. Returns nothing if the table has no such site or its cell is missing.
std::optional<TissueDepth> FindDepth(const TissueTable& table, Sex sex, Build build,
                                     const std::string& site);

// The reason why FindDepth finds none: "not in the table", or "missing" with the cell's note.
std::string WhyNoDepth(const TissueTable& table, Sex sex, Build build, const std::string& site);

// The codes of the rows, in the table's order, that belong to one of `sites` and in which depth
// does not grow from emaciated over normal to obese in this sex. A depth between two builds must
// not be interpolated there.
std::vector<std::string> UnorderedLandmarks(const TissueTable& table, Sex sex,
                                            std::span<const std::string> sites);

// One line for each row in which depth does not grow from emaciated over normal to obese in one of
// the sexes, and one line for each suspect cell. These are warnings and not errors, because the
// published tables contain such rows and cells.
std::vector<std::string> TableWarnings(const TissueTable& table);

// The depth at a site of the T-Table 2023 (Hona & Stephan 2024, adults pooled).
struct PublishedDepth {
  double mean_mm = kNaN, sd_mm = kNaN;
};
// Nothing if the table lacks the site, whose code may be with or without side.
std::optional<PublishedDepth> FindPublishedDepth(std::string_view site);

}  // namespace semblance::problems
