// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/dowel_depths.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <set>
#include <utility>

#include "problems/config/spelling_suggestion.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

// Notes for people, of which only those about certain sites are kept.
class FillNotes {
 public:
  FillNotes() = default;  // keeps notes about all sites
  explicit FillNotes(std::set<std::string> sites) : sites_(std::move(sites)) {}

  bool Concern(const std::string& site) const { return !sites_ || sites_->contains(site); }
  void Add(std::string line) { lines_.push_back(std::move(line)); }
  void Add(const std::string& site, std::string line) {
    if (Concern(site)) {
      Add(std::move(line));
    }
  }
  const std::vector<std::string>& Lines() const { return lines_; }

 private:
  std::optional<std::set<std::string>> sites_;
  std::vector<std::string> lines_;
};

void CheckSetSites(const std::map<std::string, double>& set_mm) {
  std::vector<std::string> known;
  for (const Site& site : AllSites()) {
    known.push_back(site.code);
    if (site.side == Side::kLeft) {
      known.push_back(site.landmark);
    }
  }
  for (const auto& [site, depth_mm] : set_mm) {
    if (std::find(known.begin(), known.end(), site) == known.end()) {
      throw InputError(fmt::format("set_mm: unknown site '{}'{}", site, Suggestion(site, known)));
    }
    if (!(depth_mm > 0 && std::isfinite(depth_mm))) {
      throw InputError(fmt::format("set_mm: the depth of site {} is {} mm; it must be above 0",
                                   DescribeSite(site), depth_mm));
    }
  }
}

// The entry of set_mm that applies to the site: its own, otherwise that of the pair.
std::map<std::string, double>::const_iterator FindSet(const TissueOptions& options,
                                                      const std::string& site) {
  const auto own = options.set_mm.find(site);
  return own != options.set_mm.end() ? own : options.set_mm.find(WithoutSide(site));
}

void NoteUnusedSets(const TissueOptions& options, const std::vector<Dowel>& dowels,
                    FillNotes& notes) {
  for (const auto& entry : options.set_mm) {
    const bool used = std::any_of(dowels.begin(), dowels.end(), [&](const Dowel& dowel) {
      const auto it = FindSet(options, dowel.site);
      return notes.Concern(dowel.site) && it != options.set_mm.end() && it->first == entry.first;
    });
    if (!used) {
      notes.Add(
          fmt::format("set_mm: no dowel uses the depth of site {}", DescribeSite(entry.first)));
    }
  }
}

// Sets the depths of set_mm and returns the dowels that still need one.
std::vector<Dowel*> ApplySets(const TissueOptions& options, std::vector<Dowel>& dowels,
                              FillNotes& notes) {
  std::vector<Dowel*> open;
  for (Dowel& dowel : dowels) {
    dowel.depth_mm = dowel.sd_mm = kNaN;
    const auto it = FindSet(options, dowel.site);
    if (it == options.set_mm.end()) {
      open.push_back(&dowel);
      continue;
    }
    dowel.depth_mm = it->second;
    notes.Add(dowel.site, fmt::format("site {}: depth set to {} mm by hand",
                                      DescribeSite(dowel.site), it->second));
  }
  return open;
}

void NoteUnorderedRows(const TissueTable& table, Sex sex, std::span<const std::string> sites,
                       FillNotes& notes) {
  const std::vector<std::string> landmarks = UnorderedLandmarks(table, sex, sites);
  if (!landmarks.empty()) {
    notes.Add(fmt::format(
        "tissue table '{}': depth does not grow from emaciated to obese at {}; `semblance check` "
        "shows the rows",
        table.id, fmt::join(landmarks, ", ")));
  }
}

void SetDepth(const TissueTable& table, const TissueDepth& depth, double sds, Dowel& dowel,
              FillNotes& notes) {
  constexpr double kLeastDepth_mm = 0.5;  // a depth of 0 or less would put skin inside bone
  dowel.depth_mm = depth.mean_mm;
  dowel.sd_mm = depth.sd_mm.value_or(kNaN);
  if (sds != 0 && depth.sd_mm) {
    dowel.depth_mm = std::max(depth.mean_mm + sds * *depth.sd_mm, kLeastDepth_mm);
  }
  if (depth.flag == CellFlag::kSuspect) {
    notes.Add(dowel.site,
              fmt::format("site {}: the depth of {:.2f} mm in table '{}' is suspect: {}",
                          DescribeSite(dowel.site), depth.mean_mm, table.id, depth.note));
  }
}

// Sets the depths that the table has and returns the dowels that still need one.
std::vector<Dowel*> ApplyTable(const TissueOptions& options, const TissueTable& table,
                               const std::vector<Dowel*>& open, FillNotes& notes) {
  std::vector<Dowel*> left;
  std::vector<std::string> sites, without_sd;
  for (Dowel* dowel : open) {
    if (const auto depth = FindDepth(table, options.sex, options.build, dowel->site)) {
      SetDepth(table, *depth, options.sds, *dowel, notes);
      if (!notes.Concern(dowel->site)) {
        continue;
      }
      sites.push_back(dowel->site);
      if (options.sds != 0 && !depth->sd_mm) {
        without_sd.push_back(dowel->site);
      }
    } else {
      left.push_back(dowel);
    }
  }
  NoteUnorderedRows(table, options.sex, sites, notes);
  if (!without_sd.empty()) {
    notes.Add(
        fmt::format("tissue table '{}' has no standard deviation for {}: `sds` does not change "
                    "their mean depth",
                    table.id, fmt::join(without_sd, ", ")));
  }
  return left;
}

void NoteFilled(const TissueTable& lacking, const TissueTable& filling,
                const std::vector<Dowel*>& open, FillNotes& notes) {
  std::vector<std::string> sites;
  for (const Dowel* dowel : open) {
    if (!std::isnan(dowel->depth_mm) && notes.Concern(dowel->site)) {
      sites.push_back(dowel->site);
    }
  }
  if (!sites.empty()) {
    notes.Add(fmt::format("tissue table '{}' has no depth for {}: taken from '{}'", lacking.id,
                          fmt::join(sites, ", "), filling.id));
  }
}

void NoteLeftOut(const TissueOptions& options, const TissueTable& table,
                 const std::vector<Dowel*>& left, FillNotes& notes) {
  for (const Dowel* dowel : left) {
    notes.Add(
        dowel->site,
        fmt::format("site {}: no depth in tissue table '{}' ({}); dowel left out. Name another "
                    "table in `fill_from`, or a depth in `set_mm`, to keep it",
                    DescribeSite(dowel->site), table.id,
                    WhyNoDepth(table, options.sex, options.build, dowel->site)));
  }
}

// Sets the depths that no table has but `given` has; returns the dowels that still need one.
std::vector<Dowel*> ApplyKnown(const TissueOptions& options, const LandmarkFile& landmarks,
                               const std::vector<Dowel*>& open, FillNotes& notes) {
  const std::map<std::string, double> known = KnownDepths(options.given, landmarks);
  std::vector<Dowel*> left;
  for (Dowel* dowel : open) {
    const auto own = known.find(dowel->site);
    if (own == known.end()) {
      left.push_back(dowel);
      continue;
    }
    dowel->depth_mm = own->second;
    dowel->sd_mm = options.given.error_mm;
    notes.Add(dowel->site,
              fmt::format("site {}: no table has a depth; the known depth of {} mm is used",
                          DescribeSite(dowel->site), own->second));
  }
  return left;
}

void FillFromTable(const TissueOptions& options, const LandmarkFile& landmarks,
                   const std::vector<Dowel*>& open, FillNotes& notes) {
  if (open.empty()) {
    return;
  }
  if (options.table.empty()) {
    throw InputError(
        "tissue depths come from a table, but no table is named; set `table` to a file such as "
        "configs/tables/rhine_caucasoid.yaml, or `depths: measured`");
  }
  const TissueTable table = ReadTissueTable(options.table);
  std::vector<Dowel*> left = ApplyTable(options, table, open, notes);
  if (!options.fill_from.empty()) {
    const TissueTable filling = ReadTissueTable(options.fill_from);
    const std::vector<Dowel*> lacking = left;
    left = ApplyTable(options, filling, lacking, notes);
    NoteFilled(table, filling, lacking, notes);
  }
  NoteLeftOut(options, table, ApplyKnown(options, landmarks, left, notes), notes);
}

const Landmark& LandmarkAt(const LandmarkFile& file, const std::string& site) {
  if (const Landmark* const landmark = file.Find(site); landmark != nullptr) {
    return *landmark;
  }
  throw InputError(
      fmt::format("site {}: it has no landmark, so it has no measured depth", DescribeSite(site)));
}

void FillFromMeasured(const LandmarkFile& file, const std::vector<Dowel*>& open, FillNotes& notes) {
  for (Dowel* dowel : open) {
    const Landmark& landmark = LandmarkAt(file, dowel->site);
    if (landmark.depth_along_normal_mm) {
      dowel->depth_mm = *landmark.depth_along_normal_mm;
    } else if (landmark.depth_closest_mm) {
      dowel->depth_mm = *landmark.depth_closest_mm;
      notes.Add(
          dowel->site,
          fmt::format("site {}: no depth along the normal; {:.2f} mm to the closest skin used "
                      "instead",
                      DescribeSite(dowel->site), dowel->depth_mm));
    } else {
      notes.Add(dowel->site, fmt::format("site {}: no measured depth; dowel dropped",
                                         DescribeSite(dowel->site)));
    }
  }
}

// The sites that a code means; the code of a pair without side means both sites.
std::vector<std::string> SitesMeant(const std::string& code) {
  std::vector<std::string> sites;
  for (const Site& site : AllSites()) {
    if (site.code == code || site.landmark == code) {
      sites.push_back(site.code);
    }
  }
  return sites;
}

[[noreturn]] void RefuseSite(const char* option, const std::string& code) {
  throw InputError(fmt::format("tissue.given.{}: {}", option, SiteFault(code)));
}

void AddKnown(const char* option, const std::string& site, double depth_mm,
              std::map<std::string, double>& known) {
  if (!known.emplace(site, depth_mm).second) {
    throw InputError(fmt::format("tissue.given.{}: the depth of {} is given twice; leave one out",
                                 option, DescribeSite(site)));
  }
}

std::optional<double> MeasuredAt(const LandmarkFile& file, const std::string& site) {
  const Landmark* const at = file.Find(site);
  if (at == nullptr) {
    return std::nullopt;
  }
  return at->depth_along_normal_mm ? at->depth_along_normal_mm : at->depth_closest_mm;
}

void AddMeasured(const std::string& code, const LandmarkFile& file,
                 std::map<std::string, double>& known) {
  const std::vector<std::string> sites = SitesMeant(code);
  if (sites.empty()) {
    RefuseSite("measured", code);
  }
  bool any = false;
  for (const std::string& site : sites) {
    if (const auto depth_mm = MeasuredAt(file, site)) {
      AddKnown("measured", site, *depth_mm, known);
      any = true;
    }
  }
  if (!any) {
    throw InputError(fmt::format(
        "tissue.given.measured: {} has no measured depth in the landmark file; add one there, or "
        "give the depth under depths_mm",
        DescribeSite(code)));
  }
}

// Sets the depth of each dowel, or NaN if its site has none.
void SetDepths(const TissueOptions& options, const LandmarkFile& landmarks,
               std::vector<Dowel>& dowels, FillNotes& notes) {
  CheckSetSites(options.set_mm);
  const std::vector<Dowel*> open = ApplySets(options, dowels, notes);
  NoteUnusedSets(options, dowels, notes);
  if (options.depths == DepthSource::kTable) {
    FillFromTable(options, landmarks, open, notes);
  } else {
    FillFromMeasured(landmarks, open, notes);
  }
}

void EraseWithoutDepth(const FillNotes& notes, std::vector<Dowel>& dowels) {
  std::erase_if(dowels, [](const Dowel& dowel) { return std::isnan(dowel.depth_mm); });
  if (dowels.empty()) {
    constexpr std::size_t kNamed = 3;
    const std::vector<std::string>& lines = notes.Lines();
    const std::size_t named = std::min(kNamed, lines.size());
    throw InputError(fmt::format(
        "no dowel has a tissue depth ({}{}); measure at least one in the landmark file, name a "
        "table that has one of these sites, or write `depths: skin` if the true skin is known",
        fmt::join(lines.begin(), lines.begin() + named, "; "),
        lines.size() > named ? fmt::format("; and {} more", lines.size() - named) : ""));
  }
}

// Turns or drops dowels with a depth to the closest skin.
class SkinTurner {
 public:
  explicit SkinTurner(const ClosestSkin& closest) : closest_(closest) {}

  // Depths of dropped dowels become NaN.
  void Turn(std::vector<Dowel>& dowels, FillNotes& notes) {
    for (Dowel& dowel : dowels) {
      const Landmark* const at = closest_.landmarks.Find(dowel.site);
      if (at != nullptr && !at->depth_along_normal_mm && at->depth_closest_mm &&
          dowel.depth_mm == *at->depth_closest_mm) {
        closest_.skin != nullptr ? TurnToClosest(dowel, notes) : DropIfInBone(dowel, notes);
      }
    }
  }

 private:
  void TurnToClosest(Dowel& dowel, FillNotes& notes) {
    if (!seen_) {
      const TriMesh& skin = *closest_.skin;
      seen_.emplace(Submesh(skin, SeenFromOutside(skin, closest_.threads)));
    }
    const MeshPoint nearest = seen_->Closest(dowel.base);
    const double allowed_mm = kMaxOff_mm + kNoises * closest_.noise_mm;
    if (!(std::abs(nearest.distance_mm - dowel.depth_mm) <= allowed_mm) ||
        nearest.distance_mm == 0) {
      Drop(fmt::format("the closest skin is {:.2f} mm away, and the landmark file has {:.2f} mm",
                       nearest.distance_mm, dowel.depth_mm),
           dowel, notes);
      return;
    }
    const Vec3 direction = (nearest.position - dowel.base).normalized();
    const double cosine = std::clamp(direction.dot(dowel.direction), -1.0, 1.0);
    notes.Add(dowel.site,
              fmt::format("site {}: its dowel points to the closest skin, {:.0f} degrees from the "
                          "normal",
                          DescribeSite(dowel.site), std::acos(cosine) * 180 / std::numbers::pi));
    dowel.direction = direction;
  }

  void DropIfInBone(Dowel& dowel, FillNotes& notes) {
    constexpr double kStart_mm = 1;  // beyond the roughness of bone
    const bool crosses_bone =
        closest_.skull
            .FirstHit(dowel.base + kStart_mm * dowel.direction, dowel.direction,
                      std::max(0.0, dowel.depth_mm - kStart_mm))
            .has_value();
    if (crosses_bone || EndsBehindBone(dowel)) {
      Drop(
          "its normal points into the skull, and without a skin the direction of its depth is "
          "not known",
          dowel, notes);
    }
  }

  // A dowel can end within solid bone without crossing a further surface.
  bool EndsBehindBone(const Dowel& dowel) const {
    const MeshPoint at = closest_.skull.Closest(dowel.Tip());
    const Vec3 outward = TriangleAreaVector(closest_.bone, closest_.bone.triangles[at.triangle]);
    return (dowel.Tip() - at.position).dot(outward) < 0;
  }

  static void Drop(const std::string& why, Dowel& dowel, FillNotes& notes) {
    notes.Add(dowel.site, fmt::format("site {}: {}; dowel dropped", DescribeSite(dowel.site), why));
    dowel.depth_mm = kNaN;
  }

  static constexpr double kMaxOff_mm = 3, kNoises = 3;
  const ClosestSkin& closest_;
  std::optional<MeshQuery> seen_;  // the outer skin, if a dowel needed it
};

void AddAllMeasured(const LandmarkFile& file, std::map<std::string, double>& known) {
  for (const Landmark& landmark : file.landmarks) {
    const auto depth_mm = MeasuredAt(file, landmark.site);
    if (depth_mm && !known.contains(landmark.site)) {
      known[landmark.site] = *depth_mm;
    }
  }
}

}  // namespace

std::map<std::string, double> KnownDepths(const TissueGiven& given, const LandmarkFile& file) {
  std::map<std::string, double> known;
  for (const auto& [code, depth_mm] : given.depths_mm) {
    const std::vector<std::string> sites = SitesMeant(code);
    if (sites.empty()) {
      RefuseSite("depths_mm", code);
    }
    for (const std::string& site : sites) {
      AddKnown("depths_mm", site, depth_mm, known);
    }
  }
  for (const std::string& code : given.measured) {
    code == "all" ? AddAllMeasured(file, known) : AddMeasured(code, file, known);
  }
  return known;
}

std::vector<std::string> FillDepths(const TissueOptions& options, const LandmarkFile& landmarks,
                                    std::vector<Dowel>& dowels) {
  FillNotes notes;
  SetDepths(options, landmarks, dowels, notes);
  EraseWithoutDepth(notes, dowels);
  return notes.Lines();
}

std::vector<std::string> FillDepths(const TissueOptions& options, const LandmarkFile& landmarks,
                                    std::vector<Dowel>& all, std::vector<Dowel>& used) {
  std::set<std::string> sites;
  for (const Dowel& dowel : used) {
    sites.insert(dowel.site);
  }
  FillNotes notes(std::move(sites));
  SetDepths(options, landmarks, all, notes);
  for (Dowel& dowel : used) {
    const auto same = std::ranges::find(all, dowel.site, &Dowel::site);
    dowel.depth_mm = same->depth_mm;
    dowel.sd_mm = same->sd_mm;
  }
  EraseWithoutDepth(notes, all);
  EraseWithoutDepth(notes, used);
  return notes.Lines();
}

std::vector<std::string> TurnToSkin(const ClosestSkin& closest, std::vector<Dowel>& all,
                                    std::vector<Dowel>& used) {
  SkinTurner turner(closest);
  FillNotes notes, of_all;
  turner.Turn(used, notes);
  turner.Turn(all, of_all);
  EraseWithoutDepth(of_all, all);
  EraseWithoutDepth(notes, used);
  return notes.Lines();
}

std::string FindSetKey(const TissueOptions& options, const std::string& site) {
  const auto set = FindSet(options, site);
  return set == options.set_mm.end() ? "" : set->first;
}

std::vector<std::filesystem::path> TissueTableFiles(const TissueOptions& options) {
  std::vector<std::filesystem::path> tables;
  if (options.depths == DepthSource::kTable) {
    tables = {options.table, options.fill_from};
    std::erase(tables, std::filesystem::path());
  }
  return tables;
}

}  // namespace semblance::problems
