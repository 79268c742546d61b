// SPDX-License-Identifier: GPL-3.0-or-later
// Gives dowels their tissue depth: from a table (thesis app. A) or from what was measured on the
// subject.
#pragma once

#include <array>
#include <filesystem>
#include <map>
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

struct TissueOptions {
  DepthSource depths = DepthSource::kTable;  // measured: those in the landmark file
  std::filesystem::path table;               // tissue table; for depths or a mean of it
  std::filesystem::path fill_from;           // another table, for the sites that `table` lacks
  Sex sex = Sex::kMale;                      // of the subject; a pooled table does not ask
  Build build = Build::kNormal;              // of the subject; never interpolated between builds
  double sds = 0;                            // added to the depths of a table
  std::map<std::string, double> set_mm;      // by site, before all others
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
}

// Sets depth_mm and sd_mm of each dowel. A depth under set_mm comes first (that of "go_l" before
// that of "go"). Measured depths are those along the normal, else to the closest skin. Dowels of
// landmarks without any measured depth, or without one in a table, are removed.
//
// Returns what people should know: suspect cells used, rows used whose depths do not grow with the
// build, sites filled from the second table, entries of set_mm used and unused, depths to the
// closest skin, dowels removed and why. Throws InputError if a table is needed and not given, if
// set_mm names an unknown site, or if no dowel is left; IoError and ConfigError as ReadTissueTable.
std::vector<std::string> FillDepths(const TissueOptions& options, const LandmarkFile& landmarks,
                                    std::vector<Dowel>& dowels);

// The tables that the options name and use, in the order in which they are asked.
std::vector<std::filesystem::path> TablesOf(const TissueOptions& options);

// TableWarnings of TablesOf.
// Throws as ReadTissueTable.
std::vector<std::string> DepthWarnings(const TissueOptions& options);

}  // namespace semblance
