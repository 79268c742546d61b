// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/plain_names.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "problems/subject/sites.h"

namespace semblance::problems {
namespace {

const std::map<std::string_view, std::string_view>& Words() {
  static const std::map<std::string_view, std::string_view> kWords = {
      {"areas", "areas between the depth markers"},
      {"assigned", "bone vertices with a depth"},
      {"cell_mm", "cell of the grid (mm)"},
      {"corner_evaluations", "evaluations at cells' corners"},
      {"crossed_cells", "cells that the surface crosses"},
      {"decimation_ended_by", "simplification ended by"},
      {"decimation_error_mm", "error of simplification (mm)"},
      {"dowel_closest_rms_mm", "RMS distance of the depth markers from the face (mm)"},
      {"dowel_rms_mm", "RMS distance of the depth markers (mm)"},
      {"dowels", "depth markers"},
      {"dropped_components", "loose pieces dropped"},
      {"edge_evaluations", "evaluations along cells' edges"},
      {"flips", "triangles between markers turned over"},
      {"flips_prevented", "folds prevented"},
      {"max_mm", "largest depth (mm)"},
      {"mean_mm", "mean depth (mm)"},
      {"min_mm", "smallest depth (mm)"},
      {"not_facing", "bone vertices that face away from tissue"},
      {"outside", "bone vertices outside the network"},
      {"point_rms_mm", "RMS distance of all fitted points (mm)"},
      {"points", "fitted points"},
      {"restored_features", "restored details of eyes, nose and mouth"},
      {"seeds", "extra points taken from the first face"},
      {"seeds_folded", "extra points left out: folded"},
      {"seeds_masked", "extra points left out: at eyes, nose and mouth"},
      {"seeds_missed", "extra points left out: nothing there"},
      {"sharpest_crease_deg", "sharpest crease between markers (°)"},
      {"template_scale", "size relative to the generic face"},
      {"triangles", "triangles"},
      {"triangles_dense", "triangles before simplification"},
      {"usable", "result is usable"},
      {"bone_share", "share of bone outside the face"},
      {"bone_most_mm", "bone outside the face, at most (mm)"},
      {"marker_mm", "depth markers off the face, median (mm)"},
      {"facing_share", "share of markers on the face's inner side"},
      {"template_factor", "size against the generic face, factor"},
      {"skull_factor", "size against the skull, factor"},
      {"crease_share", "share of the face that is creased"},
      {"crossing_share", "share of the face that cuts itself"},
      {"unsolved_share", "share of steps at the limit of iterations"},
      {"undetermined_share", "share of control vertices without data"},
      {"direction_deg", "depth marker off the outward direction (degrees)"},
      {"depth_sds", "depth off the published mean (SD)"},
      {"depth_factor", "depths against published ones, factor"},
      {"depth_scatter", "scatter of the depths against published ones"},
      {"vertices", "bone vertices"},
  };
  return kWords;
}

constexpr std::array<std::pair<std::string_view, std::string_view>, 6> kUnits = {
    {{"_mm", "mm"}, {"_cm2", "cm²"}, {"_cm3", "cm³"}, {"_deg", "°"}, {"_s", "s"}, {"_mm2", "mm²"}}};

constexpr std::array<std::pair<std::string_view, std::string_view>, 2> kSides = {
    {{"_l", ", left"}, {"_r", ", right"}}};

// The words for a key in a list of pairs. Empty if the list does not hold the key.
template <std::size_t N>
std::string_view Find(const std::array<std::pair<std::string_view, std::string_view>, N>& pairs,
                      std::string_view key) {
  const auto found = std::ranges::find(pairs, key, [](const auto& pair) { return pair.first; });
  return found == pairs.end() ? "" : found->second;
}

constexpr std::array<std::pair<std::string_view, std::string_view>, 7> kMeasures = {
    {{"rms_mm", "RMS distance (mm)"},
     {"mean_abs_mm", "mean distance (mm)"},
     {"median_mm", "median distance (mm)"},
     {"p95_mm", "95th percentile of the distance (mm)"},
     {"max_mm", "largest distance (mm)"},
     {"within_2_5mm", "share within 2.5 mm"},
     {"mean_signed_mm", "mean signed distance (mm)"}}};

constexpr std::array<std::pair<std::string_view, std::string_view>, 5> kObjects = {
    {{"face", "of the recovered face"},
     {"implicit_face", "of the first face"},
     {"fit", "of the fit"},
     {"depth_truth", "of the depths from the true ones"},
     {"cross_validation", "at markers left out"}}};

// Spells a key with blanks, the unit in brackets and the side in words.
std::string SpellKey(std::string_view key) {
  std::string words(key), unit;
  for (const auto& [ending, side] : kSides) {
    if (key.ends_with(ending) && key.size() > ending.size()) {
      words.replace(key.size() - ending.size(), ending.size(), side);
    }
  }
  for (const auto& [ending, name] : kUnits) {
    if (key.ends_with(ending) && key.size() > ending.size()) {
      words.resize(key.size() - ending.size());
      unit = fmt::format(" ({})", name);
    }
  }
  std::ranges::replace(words, '_', ' ');
  return words + unit;
}

}  // namespace

std::string WordsOfKey(std::string_view key) {
  const auto found = Words().find(key);
  return found == Words().end() ? SpellKey(key) : std::string(found->second);
}

std::string WordsOfMetric(std::string_view path) {
  const std::string_view last = path.substr(path.rfind('.') == path.npos ? 0 : path.rfind('.') + 1);
  const std::string_view object = Find(kObjects, path.substr(0, path.find('.')));
  const std::string_view measure = Find(kMeasures, last);
  if (object.empty() || measure.empty()) {
    return std::string(path);
  }
  return fmt::format("{} {} ({})", measure, object, path);
}

std::string WordsOfMeasure(std::string_view key) {
  const std::string_view words = Find(kMeasures, key);
  return std::string(words.empty() ? key : words);
}

std::string WordsOfSite(std::string_view site) {
  const Site* const known = FindSite(site);
  if (known == nullptr) {
    return std::string(site);
  }
  const std::string_view side = known->side == Side::kLeft    ? ", left"
                                : known->side == Side::kRight ? ", right"
                                                              : "";
  return fmt::format("{}{} ({})", known->name, side, site);
}

std::string Counted(long long count, std::string_view noun, std::string_view plural) {
  return count == 1 ? fmt::format("1 {}", noun)
                    : fmt::format("{} {}", count,
                                  plural.empty() ? fmt::format("{}s", noun) : std::string(plural));
}

}  // namespace semblance::problems
