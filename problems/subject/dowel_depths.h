// SPDX-License-Identifier: GPL-3.0-or-later
// Gives dowels their tissue depth: from a table (thesis app. A) or from measurements on the
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
#include "problems/subject/depth_bounds.h"
#include "problems/subject/landmarks.h"
#include "problems/subject/tissue_table.h"
#include "surfaces/base/fields.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {

// kMeasured: depths in the landmark file. kSkin: measured on the subject's true skin.
enum class DepthSource { kTable, kMeasured, kSkin };

constexpr auto EnumNames(DepthSource) {
  return std::to_array<std::string_view>({"table", "measured", "skin"});
}

// A model of the correlation of depths over people, for tables without correlations. The
// correlation of two sites at the distance d, which is d' if both are laid on one side of the head,
// is
//   common + twins exp(-d' / length) + (1 - common - twins - own) exp(-d / length).
// A fat face is fat everywhere (common); left and right are alike (twins).
struct SiteCorrelation {
  double common = 0.45;
  double twins = 0.3;
  double own = 0.1;
  double length_mm = 25;
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
                  .doc = "part that a site shares with no other, including errors of measurement; "
                         "the rest it shares with its neighbours on its side"},
        o.own);
  visit(FieldInfo{.name = "length_mm",
                  .unit = "mm",
                  .min = 1,
                  .max = 1000,
                  .doc =
                      "distance on an average skull at which neighbours share 37 % of these parts"},
        o.length_mm);
}
template <class Report>
void CheckValue(Report& report, const SiteCorrelation& o) {
  if (o.common + o.twins + o.own > 1) {
    report("common", "common, twins and own are parts of one variance: together at most 1");
  }
}

// The facts known about this person, on which a table's depths are conditioned.
struct TissueGiven {
  std::map<std::string, double> depths_mm;
  std::vector<std::string> measured;
  double error_mm = 0;
  std::optional<Sex> sex;
  std::optional<Build> build;
  std::optional<double> build_sds, age_years, bmi;
  std::filesystem::path spread;
  SiteCorrelation correlation;

  bool HasNothing() const {
    return depths_mm.empty() && measured.empty() && !sex && !build && !build_sds && !age_years &&
           !bmi;
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
                  .doc = "sites whose depth in the landmark file is known, e.g. [g, pg, zy]; "
                         "[all]: all sites that have one there"},
        o.measured);
  visit(FieldInfo{.name = "error_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 50,
                  .doc = "standard deviation of the error of each known depth; 0: exact, and the "
                         "dowel gets exactly this depth"},
        o.error_mm);
  visit(FieldInfo{.name = "sex",
                  .doc = "sex as a covariate, if the table has it; `tissue.sex` instead chooses a "
                         "column of a table with a column for each sex"},
        o.sex);
  visit(FieldInfo{.name = "build", .doc = "build as a covariate, if the table has it; see sex"},
        o.build);
  visit(FieldInfo{.name = "build_sds",
                  .min = -4,
                  .max = 4,
                  .doc = "build as a number, if the table has the covariate: standard deviations "
                         "of its people from their mean; thin is below 0"},
        o.build_sds);
  visit(
      FieldInfo{
          .name = "age_years", .min = 0, .max = 130, .doc = "age, if the table has the covariate"},
      o.age_years);
  visit(FieldInfo{.name = "bmi",
                  .min = 8,
                  .max = 100,
                  .doc = "body mass index, kg/m2, if the table has the covariate"},
        o.bmi);
  visit(FieldInfo{.name = "spread",
                  .doc = "table that provides standard deviations and correlations, if `table` "
                         "has none; empty: `table`"},
        o.spread);
  visit(
      FieldInfo{.name = "correlation", .doc = "model of the correlations, if that table has none"},
      o.correlation);
}

struct TissueOptions {
  DepthSource depths = DepthSource::kTable;
  std::filesystem::path table;
  std::filesystem::path fill_from;
  Sex sex = Sex::kMale;
  Build build = Build::kNormal;  // depths are never interpolated between builds
  double sds = 0;
  std::map<std::string, double> set_mm;
  TissueGiven given;
  std::vector<DepthBound> bounds;

  // Returns whether the depths are this person's own, not those of a table.
  bool AreMeasured() const { return depths != DepthSource::kTable; }
};

template <class Visitor>
void Fields(Visitor& visit, TissueOptions& o) {
  visit(FieldInfo{.name = "depths",
                  .doc = "table: depths of a population; measured: depths in the landmark file; "
                         "skin: those to the subject's true skin, along the bone's normal at "
                         "each landmark (depth_truth), in place of the file's"},
        o.depths);
  visit(FieldInfo{.name = "table",
                  .doc = "file of the tissue table; needed for depths: table, and for a scheme "
                         "with mean: table"},
        o.table);
  visit(FieldInfo{.name = "fill_from",
                  .doc = "another table, read for the same sex and build, for the sites that "
                         "`table` lacks; a site that both lack gets no dowel"},
        o.fill_from);
  visit(FieldInfo{.name = "sex", .doc = "sex of the subject; a table of pooled adults ignores it"},
        o.sex);
  visit(FieldInfo{.name = "build",
                  .doc = "build of the subject: emaciated, normal or obese; a table of pooled "
                         "adults ignores it"},
        o.build);
  visit(FieldInfo{.name = "sds",
                  .min = -3,
                  .max = 3,
                  .doc = "standard deviations that are added to each depth of a table, for faces "
                         "fatter (1) or leaner (-1) than its mean; a depth without a standard "
                         "deviation stays at its mean, with a note; no depth gets below 0.5 mm"},
        o.sds);
  visit(FieldInfo{.name = "set_mm",
                  .unit = "mm",
                  .min = 0.01,
                  .max = 100,
                  .doc = "depths by site, e.g. {me: 7, go_l: 12}, that replace the table's or the "
                         "measured ones; a pair's code without side means both sides"},
        o.set_mm);
  visit(FieldInfo{.name = "given",
                  .doc = "facts known about this person: the table's depths become those "
                         "expected for people with these depths, sex, build, age or body mass "
                         "index, and the standard deviations become the remaining uncertainty; the "
                         "interpolation uses both (docs/how-to/populations.md)"},
        o.given);
  visit(FieldInfo{.name = "bounds",
                  .doc = "limits of the depth that an expert knows, e.g. [{region: cheeks, "
                         "least_mm: 6, most_mm: 20}, {sites: [zy], most_mm: 12}]: depths of a "
                         "table and interpolated depths beyond them become the nearest allowed "
                         "ones (docs/how-to/populations.md)"},
        o.bounds);
}
template <class Report>
void CheckValue(Report& report, const TissueOptions& o) {
  if (o.AreMeasured() && !o.given.HasNothing()) {
    report("given",
           "applies to the depths of a table; write `depths: table`, and list the measured sites "
           "to use under given.measured");
  }
  if (o.given.build && o.given.build_sds) {
    report("given.build_sds", "states the build a second time; leave given.build out");
  }
}

// Sets depth_mm and sd_mm of each dowel; both depend on the dowel's site alone. A depth under
// set_mm takes precedence (that of "go_l" over that of "go"). A measured depth is the one along the
// normal, otherwise the one to the closest skin. A dowel is removed if its landmark has no measured
// depth, or if neither a table nor `given` has a depth for its site. ConditionDepths
// (condition_depths.h), to be called afterwards, applies the rest of `given`.
//
// Returns notes for people: suspect cells used, rows used whose depths do not grow with the build,
// sites filled from the second table or from `given`, entries of set_mm used and unused, depths to
// the closest skin, and dowels removed with the reason. Throws InputError if a table is needed and
// not named, if set_mm names an unknown site, if no dowel is left, or as KnownDepths. Throws
// IoError and ConfigError as ReadTissueTable.
std::vector<std::string> FillDepths(const TissueOptions& options, const LandmarkFile& landmarks,
                                    std::vector<Dowel>& dowels);

// Fills two lists of dowels in one pass, so that each table is read once: `all` has a dowel for
// every landmark, `used` one for each landmark that an experiment uses, possibly moved to another
// point. The sites of `used` must be among those of `all`. Equal sites get equal depths. The notes
// concern `used` alone. Throws as above, for each of the lists.
std::vector<std::string> FillDepths(const TissueOptions& options, const LandmarkFile& landmarks,
                                    std::vector<Dowel>& all, std::vector<Dowel>& used);

// The known depths of this person, by site with side: those of given.depths_mm and given.measured.
// Throws InputError for a site that is unknown or appears twice, and for a site in `measured`
// without a measured depth.
std::map<std::string, double> KnownDepths(const TissueGiven& given, const LandmarkFile& landmarks);

// The surroundings of dowels whose depth was not measured along their normal.
struct ClosestSkin {
  const LandmarkFile& landmarks;
  const TriMesh* skin = nullptr;  // null: not known
  const TriMesh& bone;
  const MeshQuery& skull;  // of `bone`
  double noise_mm = 0;     // by which the dowels may have been moved from their landmarks
  int threads = 1;
};

// A depth to the closest skin is no depth along the normal, which may point sideways or inwards.
// Turns each dowel that has such a depth towards the closest skin that is seen from outside. Drops
// it if that skin is not at this depth, within 3 mm and three times the noise. Without a skin a
// dowel keeps its direction, unless it crosses bone or ends within it, which drops it. Notes
// concern `used` alone. Throws InputError if no dowel is left.
std::vector<std::string> TurnToSkin(const ClosestSkin& closest, std::vector<Dowel>& all,
                                    std::vector<Dowel>& used);

// The key of set_mm that applies to the site; empty if none does.
std::string FindSetKey(const TissueOptions& options, const std::string& site);

// The files of the tables that the options name and use, in the order in which they are searched.
std::vector<std::filesystem::path> TissueTableFiles(const TissueOptions& options);

}  // namespace semblance::problems
