// SPDX-License-Identifier: GPL-3.0-or-later
// Gives dowels their tissue depth: from a table (thesis app. A) or from what was measured on the
// subject.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "interp/dowels/dowel.h"
#include "problems/subject/landmarks.h"
#include "problems/subject/tissue_table.h"
#include "surfaces/base/fields.h"

namespace semblance {

enum class DepthSource { kTable, kMeasured };

constexpr auto EnumNames(DepthSource) {
  return std::to_array<std::string_view>({"table", "measured"});
}

// How depths of people go together where a table does not say: the correlation of two sites at the
// distance d, and d' with both laid on one side of the head, is
//   common + twins exp(-d' / length) + (1 - common - twins - own) exp(-d / length).
struct SiteCorrelation {
  double common = 0.45;   // a fat face is fat everywhere
  double twins = 0.3;     // left and right are alike
  double own = 0.1;       // what a site shares with none
  double length_mm = 25;  // over which the rest falls to 37 %
};
template <class Visitor>
void Fields(Visitor& visit, SiteCorrelation& o) {
  visit(FieldInfo{.name = "common",
                  .min = 0,
                  .max = 1,
                  .doc = "part of a depth's variance that all sites of a person share"},
        o.common);
  visit(FieldInfo{.name = "twins",
                  .min = 0,
                  .max = 1,
                  .doc = "part that a site shares with its neighbours on both sides of the head"},
        o.twins);
  visit(FieldInfo{.name = "own",
                  .min = 0.001,
                  .max = 1,
                  .doc = "part that it shares with no other, also that of measuring; what is left "
                         "it shares with its neighbours on its side"},
        o.own);
  visit(FieldInfo{.name = "length_mm",
                  .unit = "mm",
                  .min = 1,
                  .max = 1000,
                  .doc = "distance on an average skull at which neighbours share 37 % of these"},
        o.length_mm);
}
template <class Report>
void CheckValue(Report& report, const SiteCorrelation& o) {
  if (o.common + o.twins + o.own > 1) {
    report("common", "common, twins and own are parts of one variance: together at most 1");
  }
}

// What is known of this person, on which a table's depths are conditioned.
struct TissueGiven {
  std::map<std::string, double> depths_mm;  // by site
  std::vector<std::string> measured;        // sites of the landmarks' file, or `all`
  double error_mm = 0;                      // sd of each of these depths
  std::optional<Sex> sex;                   // where the table has the covariate
  std::optional<Build> build;               // likewise
  std::optional<double> age_years, bmi;     // likewise
  std::filesystem::path spread;             // another table, for deviations and correlations
  SiteCorrelation correlation;              // where the table has none

  bool HasNothing() const {
    return depths_mm.empty() && measured.empty() && !sex && !build && !age_years && !bmi;
  }
};
template <class Visitor>
void Fields(Visitor& visit, TissueGiven& o) {
  visit(FieldInfo{.name = "depths_mm",
                  .unit = "mm",
                  .min = 0.01,
                  .max = 100,
                  .doc = "known depths by site, e.g. {me: 7, go: 12}; a pair's code without side "
                         "means both sides. The site need not have a landmark"},
        o.depths_mm);
  visit(FieldInfo{.name = "measured",
                  .doc = "sites whose depth in the landmarks' file is known, e.g. [g, pg, zy]; "
                         "[all]: all that have one there"},
        o.measured);
  visit(FieldInfo{.name = "error_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 50,
                  .doc = "standard deviation of the error of each known depth; 0: exact, and the "
                         "dowel gets it as it is"},
        o.error_mm);
  visit(FieldInfo{.name = "sex",
                  .doc = "where the table has the covariate; `tissue.sex` chooses a column of a "
                         "table that has one for each"},
        o.sex);
  visit(FieldInfo{.name = "build", .doc = "likewise, of `tissue.build`"}, o.build);
  visit(
      FieldInfo{
          .name = "age_years", .min = 0, .max = 130, .doc = "where the table has the covariate"},
      o.age_years);
  visit(FieldInfo{.name = "bmi",
                  .min = 8,
                  .max = 100,
                  .doc = "body mass index, kg/m2, where the table has the covariate"},
        o.bmi);
  visit(FieldInfo{.name = "spread",
                  .doc = "table whose standard deviations and correlations hold, where `table` "
                         "states none; empty: `table`"},
        o.spread);
  visit(FieldInfo{.name = "correlation",
                  .doc = "how depths go together, where that table has no correlations"},
        o.correlation);
}

struct TissueOptions {
  DepthSource depths = DepthSource::kTable;  // measured: those in the landmark file
  std::filesystem::path table;               // tissue table; for depths or a mean of it
  std::filesystem::path fill_from;           // another table, for the sites that `table` lacks
  Sex sex = Sex::kMale;                      // of the subject; a pooled table does not ask
  Build build = Build::kNormal;              // of the subject; never interpolated between builds
  double sds = 0;                            // added to the depths of a table
  std::map<std::string, double> set_mm;      // by site, before all others
  TissueGiven given;                         // of this person; it changes the table's depths
};

template <class Visitor>
void Fields(Visitor& visit, TissueOptions& o) {
  visit(FieldInfo{.name = "depths",
                  .doc = "table: those of a population; measured: those in the landmark file"},
        o.depths);
  visit(FieldInfo{.name = "table",
                  .doc = "file of the tissue table; for depths: table, and for a scheme with mean: "
                         "table"},
        o.table);
  visit(FieldInfo{.name = "fill_from",
                  .doc = "another table, of the same sex and build, for the sites that `table` "
                         "lacks; a site that both lack has no dowel"},
        o.fill_from);
  visit(
      FieldInfo{.name = "sex", .doc = "of the subject; a table of pooled adults has no use for it"},
      o.sex);
  visit(FieldInfo{.name = "build",
                  .doc = "of the subject: emaciated, normal or obese; not for pooled adults"},
        o.build);
  visit(FieldInfo{.name = "sds",
                  .min = -3,
                  .max = 3,
                  .doc = "standard deviations that are added to each depth of a table, for faces "
                         "fatter (1) or leaner (-1) than its mean; where a table states none, its "
                         "mean stays, with a note; a depth stays at 0.5 mm at least"},
        o.sds);
  visit(FieldInfo{.name = "set_mm",
                  .unit = "mm",
                  .min = 0.01,
                  .max = 100,
                  .doc = "depths by site, e.g. {me: 7, go_l: 12}, in place of the table's or the "
                         "measured ones; a pair's code without side means both sides"},
        o.set_mm);
  visit(FieldInfo{.name = "given",
                  .doc = "what is known of this person: the table's depths become what is to be "
                         "expected of people with these depths, sex, build, age or body mass "
                         "index, and their standard deviations what that leaves open; both go on "
                         "into the interpolation (docs/populations.md)"},
        o.given);
}
template <class Report>
void CheckValue(Report& report, const TissueOptions& o) {
  if (o.depths == DepthSource::kMeasured && !o.given.HasNothing()) {
    report("given",
           "is for the depths of a table; write `depths: table`, and the measured sites that are "
           "to count under given.measured");
  }
}

// Sets depth_mm and sd_mm of each dowel. A depth under set_mm comes first (that of "go_l" before
// that of "go"). Measured depths are those along the normal, else to the closest skin. Dowels of
// landmarks without any measured depth, or without one in a table and in `given`, are removed.
//
// Returns what people should know: suspect cells used, rows used whose depths do not grow with the
// build, sites filled from the second table or from `given`, entries of set_mm used and unused,
// depths to the closest skin, dowels removed and why. What else `given` says has its own function
// (condition_depths.h), which comes after this one. Throws InputError if a table is needed and not
// given, if set_mm names an unknown site, if no dowel is left, or as KnownDepths; IoError and
// ConfigError as ReadTissueTable.
std::vector<std::string> FillDepths(const TissueOptions& options, const LandmarkFile& landmarks,
                                    std::vector<Dowel>& dowels);

// The depths that are known of this person, by site with side: of depths_mm and measured. Throws
// InputError for a site that is unknown or appears twice, or one in `measured` without a measured
// depth.
std::map<std::string, double> KnownDepths(const TissueGiven& given, const LandmarkFile& landmarks);

// The key of set_mm that holds for the site; empty where none does.
std::string SetFor(const TissueOptions& options, const std::string& site);

// The tables that the options name and use, in the order in which they are asked.
std::vector<std::filesystem::path> TablesOf(const TissueOptions& options);

}  // namespace semblance
