// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/site_page.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <string_view>
#include <vector>

#include "problems/subject/sites.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

struct Definition {
  std::string_view landmark;
  std::string_view words;  // its place on the bone
};

constexpr Definition kDefinitions[] = {
    {"sg", "midline of the forehead, in the shallow hollow just above glabella"},
    {"g", "midline, the most forward point between the brow ridges, above the root of the nose"},
    {"n", "midline, where the suture between nasal bones and frontal bone crosses it"},
    {"rhi", "midline, the lower free end of the nasal bones, where cartilage begins"},
    {"mp", "midline of the upper jaw, as high as the bone is still flat below the nasal spine"},
    {"pr", "midline, the front edge of the upper jaw's bone between the two middle incisors"},
    {"id", "midline, the upper tip of the lower jaw's bone between the two middle incisors"},
    {"sm", "midline, the deepest point of the hollow between lower incisors and chin"},
    {"pg", "midline, the most forward point of the chin's bone"},
    {"me", "midline, the lowest point of the chin's bone; the dowel points down"},
    {"fe", "the bulge of the forehead above the middle of the eyebrow"},
    {"mso",
     "the upper rim of the orbit at its highest point; the dowel points forward, not into "
     "the orbit"},
    {"mio", "the lower rim of the orbit at its lowest point; not the foramen below it"},
    {"im", "the lower part of the cheek bone's front, below the middle of the orbit"},
    {"lo",
     "the cheek bone about 10 mm below the orbit, under its outer rim; not the corner of the "
     "eye"},
    {"zy",
     "the arch of the cheek bone halfway along, as a rule its outermost point seen from above"},
    {"sgl", "the root of the arch, above and a little before the opening of the ear"},
    {"go",
     "the outer side of the angle of the lower jaw, where the lines of its lower and its rear "
     "border meet"},
    {"sM2",
     "the outer edge of the upper jaw's bone above the second molar; the dowel points to the "
     "side"},
    {"mr",
     "the ramus of the lower jaw halfway from front to rear, at the height of the biting "
     "surfaces"},
    {"iM2",
     "the outer edge of the lower jaw's bone below the second molar; the dowel points to the "
     "side"},
    {"op",
     "midline of the back of the head, the point farthest from glabella, above the external "
     "protuberance"},
    {"v", "midline, the highest point of the skull as the head is held"},
    {"mn", "midline, halfway between nasion and the end of the nasals"},
    {"ss", "midline, the deepest point of the profile below the nasal spine"},
    {"gn", "midline, halfway between mental eminence and the point beneath the chin"},
    {"ac", "beside the nasal opening, about 5 mm out from its widest point"},
    {"sC", "the outer edge of the upper jaw's bone above the crown of the canine"},
    {"iC", "the outer edge of the lower jaw's bone below the crown of the canine"},
    {"mmb", "the lower border of the lower jaw, halfway between chin and angle"},
    {"ut", "the temple 45 mm behind and 45 mm above the lateral orbit"},
    {"tf", "the front of the temporal fossa, 15 mm behind and 42 mm above the lateral orbit"},
    {"ma", "the ramus below the arch, 5 mm before the middle of zygomatic arch and occlusal line"},
    {"pa", "the rear part of the ramus, halfway between supraglenoid and gonion"},
};

// The ids of the tables that have the site, as "a"; as "a (part)" if cells of the row are missing.
std::vector<std::string> TablesWith(const Site& site, std::span<const TissueTable> tables) {
  std::vector<std::string> names;
  for (const TissueTable& table : tables) {
    const auto row = std::ranges::find(table.rows, site.landmark, &TissueRow::site);
    if (row == table.rows.end()) {
      continue;
    }
    const auto missing = std::ranges::count_if(
        row->values, [](const auto& cell) { return cell.second.flag == CellFlag::kMissing; });
    names.push_back(missing == 0 ? table.id : fmt::format("{} (part)", table.id));
  }
  return names;
}

std::string Row(const Site& site, std::span<const TissueTable> tables) {
  return fmt::format("| {} | {} | {} | {} | {} | {} |\n",
                     site.side == Side::kMidline ? fmt::format("`{}`", site.code)
                                                 : fmt::format("`{0}_l` `{0}_r`", site.landmark),
                     site.number == 0 ? "" : std::to_string(site.number), site.name,
                     fmt::join(OtherSiteNames(site.landmark), ", "), SiteDefinition(site.landmark),
                     fmt::join(TablesWith(site, tables), ", "));
}

std::string Rows(const std::vector<Site>& sites, std::span<const TissueTable> tables) {
  std::string text =
      "| code | no. | name | also | on the bone | tables |\n|---|--:|---|---|---|---|\n";
  for (const Site& site : sites) {
    if (site.side != Side::kRight) {  // a pair once
      text += Row(site, tables);
    }
  }
  return text;
}

constexpr const char* kBeforeSites = R"md(# The sites

A site is a point of the skull by which tissue depth is known: there a dowel stands. Left and right are the subject's. A landmarks' file names a site
by its code, its number with the side (`18l`), or a name (`left gonion`); upper and lower case make no difference.

This page is made by `semblance landmarks page configs/tables/*.yaml --out docs/reference --force`; a test holds it and the program against each other.

![the sites on the mean skull, by number]({})

The skull is the mean of 54 people. It ends at the vault, and its teeth and the tip of the nasal bones are blurred.

## The 32 of the network

Numbers and names are those of the thesis's tables (Rhine).

)md";

constexpr const char* kBetweenSites = R"md(
## Further sites

The standard network and the generic face lack them. No published table has the last four pairs; `landmarks: {carried: people}` places `ut` and `tf`. A landmark may stand at one: its table gives the depth, the dowel joins the network, and the ray
of the dowel tells where it meets the generic face. An experiment can also place one, or a site of its own:

```yaml
sites:
  mn: {near: [n, rhi]}                    # the bone nearest to the middle of two landmarks; the table's depth
  scar: {near: [31.5, -80, 12], depth: 7.5}  # nearest to a point, in mm (LPS)
  cheek: {uv: [0.7, 0.45], depth: auto}   # under a point of the generic face, as deep as interpolated: for the fit alone
  n: {uv: [0.5, 0.62], hold: true}        # where nasion lies on the generic face, set by hand; relaxation leaves it there
```

)md";

constexpr const char* kAfterTables = R"md(
"(part)": some builds or one sex have no depth there. `tissue: {fill_from: ...}` takes them from another table.

## Where the definitions come from

In our own words, after Caple and Stephan (2016), A standardized nomenclature for craniofacial and facial anthropometry, Int J Legal Med 130:863-879,
for the points that they name. `sg`, `fe`, `im`, `lo` and `sgl` are not among those: for them, and for the directions of dowels, after the usual
instructions for Rhine's set of points.
)md";

std::string TableList(std::span<const TissueTable> tables) {
  std::string text;
  for (const TissueTable& table : tables) {
    text += fmt::format("- `{}`: {}; {}. {}\n", table.id, table.title, table.population_label,
                        table.citation);
  }
  return text;
}

}  // namespace

std::string_view SiteDefinition(std::string_view landmark) {
  const auto* const found = std::ranges::find(kDefinitions, landmark, &Definition::landmark);
  if (found == std::end(kDefinitions)) {
    throw InputError(fmt::format("sites: {} has no definition; write one", landmark));
  }
  return found->words;
}

std::string SitePage(std::span<const TissueTable> tables, const std::string& picture) {
  return fmt::format(kBeforeSites, picture) + Rows(StandardSites(), tables) + kBetweenSites +
         Rows(FurtherSites(), tables) + "\n## The tables\n\n" + TableList(tables) + kAfterTables;
}

}  // namespace semblance::problems
