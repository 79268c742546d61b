// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/run_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "problems/config/config.h"
#include "problems/report/plain_names.h"
#include "problems/report/plots/svg_plot.h"
#include "problems/report/report_kit.h"
#include "problems/report/run_pictures.h"
#include "problems/report/scene_json.h"
#include "problems/report/section_pictures.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/csv.h"
#include "surfaces/base/error.h"
#include "surfaces/base/json_text.h"

namespace semblance::problems {
namespace {

using Json = nlohmann::ordered_json;

std::string Number(const Json& value, int digits = 2) {
  if (value.is_number_float()) {
    return fmt::format("{:.{}f}", value.get<double>(), digits);
  }
  if (value.is_boolean()) {
    return value.get<bool>() ? "yes" : "no";
  }
  return value.is_null() ? "" : value.is_string() ? value.get<std::string>() : value.dump();
}

double NumberOrNan(const Json& value) { return value.is_number() ? value.get<double>() : kNaN; }

std::string Percent(const Json& share) {
  return share.is_null() ? "" : TablePercent(share.get<double>());
}

// In percent.
std::string InventedShare(const Json& bone) {
  const double observed = bone.at("observed_cm2").get<double>();
  const double invented =
      bone.at("mirrored_cm2").get<double>() + bone.at("inferred_cm2").get<double>();
  return TablePercent(invented / (observed + invented));
}

// The folder of an older version has no uncertainty.
bool HasSigma(const Json& result) {
  return result.contains("uncertainty") && !result.at("uncertainty").is_null() &&
         !result.at("uncertainty").at("sigma_median_mm").is_null();
}

// The distance to the face's closest point. Folders of older versions only have the distance to
// each marker's own (u,v), which is larger where the surface slid along itself.
ReportTile MarkerTile(const Json& fit) {
  const bool has_closest = fit.contains("dowel_closest_rms_mm");
  return {"depth markers", Number(fit.at(has_closest ? "dowel_closest_rms_mm" : "dowel_rms_mm")),
          "mm",
          has_closest ? "RMS distance from the markers' tips to the face: how well the face keeps "
                        "the tissue depths"
                      : "RMS distance from the markers' tips to their places on the face"};
}

// Three numbers. The tables below have the others.
std::vector<ReportTile> Tiles(const Json& result) {
  const Json& face = result.at("face");
  std::vector<ReportTile> tiles;
  if (!face.is_null()) {
    tiles = {{"mean error", Number(face.at("mean_abs_mm")), "mm",
              "mean distance between the recovered face and the true skin"},
             {"within 2.5 mm", Percent(face.at("within_2_5mm")), "%",
              "share of the scored skin; people hardly see smaller differences"}};
  }
  tiles.push_back(MarkerTile(result.at("fit")));
  if (face.is_null() && HasSigma(result)) {
    tiles.push_back({"may be off", Number(result.at("uncertainty").at("sigma_median_mm")), "mm",
                     "expected error of the face (median standard deviation); people of the same "
                     "skull differ by that much"});
  }
  if (face.is_null() && result.contains("bone")) {
    tiles.push_back({"invented bone", InventedShare(result.at("bone")), "%",
                     "share of the bone under the face that the scan does not show"});
  }
  return tiles;
}

// The most important first. A reader has to act on a warning of the first group, and to know one of
// the second; all others report routine corrections.
std::vector<std::string> SortedNotes(std::vector<std::string> notes) {
  constexpr std::array kActs = {"no person has confirmed", "fractur",  "exchanged",
                                "mirrored volume",         "seems to", "is not trusted"};
  constexpr std::array kMatters = {"cut off",     "dropped",  "left out because",
                                   "no dowel at", "mirrored", "beyond"};
  const auto rank = [&](const std::string& note) {
    const auto has = [&](const char* words) { return note.find(words) != std::string::npos; };
    return std::ranges::any_of(kActs, has) ? 0 : std::ranges::any_of(kMatters, has) ? 1 : 2;
  };
  std::ranges::stable_sort(notes, {}, rank);
  return notes;
}

std::vector<std::string> MetricsRow(const std::string& name, const Json& s) {
  return {name,
          Number(s.at("area_cm2"), 1),
          Number(s.at("mean_abs_mm")),
          Number(s.at("rms_mm")),
          Number(s.at("median_mm")),
          Number(s.at("p95_mm")),
          Number(s.at("max_mm")),
          Number(s.at("mean_signed_mm")),
          Percent(s.at("within_2_5mm")),
          Percent(s.at("within_5mm"))};
}

ReportTable MetricsTable(const std::string& caption, const Json& metrics) {
  ReportTable table{caption,
                    {"part", "area (cm²)", "mean (mm)", "RMS (mm)", "median (mm)", "p95 (mm)",
                     "max (mm)", "signed mean (mm)", "≤ 2.5 mm (%)", "≤ 5 mm (%)"}};
  table.rows.push_back(MetricsRow("all, skin to face", metrics));
  table.rows.push_back(MetricsRow("all, face to skin", metrics.at("reverse")));
  for (const auto& [name, summary] : metrics.at("regions").items()) {
    table.rows.push_back(MetricsRow(WordsOfKey(name), summary));
  }
  return table;
}

std::vector<double> Numbers(const Json& list) {
  std::vector<double> numbers;
  for (const Json& value : list) {
    numbers.push_back(NumberOrNan(value));
  }
  return numbers;
}

// Empty if fewer than two steps have a distance.
std::vector<ReportImage> ConvergencePlots(const Json& fit) {
  BoxRow row{"last round", {}};
  for (const Json& level : fit.at("levels")) {
    if (row.values.empty() && level.at("rms_before_mm").is_number()) {
      row.values.push_back(level.at("rms_before_mm").get<double>());
    }
    row.values.push_back(
        level.at("rms_after_mm").is_number() ? level.at("rms_after_mm").get<double>() : kNaN);
  }
  if (std::ranges::count_if(row.values, [](double v) { return std::isfinite(v); }) < 2) {
    return {};
  }
  return {{ConvergencePlotSvg({row}, "RMS distance of the fitted points (mm)"),
           "How far the fitted points are from the surface, step by step.",
           "root mean square distance by step of the schedule"}};
}

std::string OutOf(const Json& level, const char* part, const char* all) {
  return level.contains(part) && level.at(part).is_number()
             ? fmt::format("{} of {}", level.at(part).dump(), level.at(all).dump())
             : "";
}

// The moves of the points' (u,v). Empty without relaxation and for runs of older versions.
ReportTable RelaxationTable(const Json& fit) {
  ReportTable table{
      "How markers and extra points moved over the face: mean penalties after each step",
      {"step", "distance before (mm²)", "distance (mm²)", "bunching (mm²)", "distortion (mm²)",
       "crease (mm²)", "largest move (mm)", "folds prevented"}};
  int step = 0;
  for (const Json& moves : fit.value("relaxations", Json::array())) {
    const Json& after = moves.at("after");
    table.AddRow(++step, Number(moves.at("before").at("distance"), 3),
                 Number(after.at("distance"), 3), Number(after.at("bunching"), 3),
                 Number(after.at("distortion"), 3), Number(after.at("crease"), 3),
                 Number(moves.at("max_move_mm")), Number(moves.at("flips_prevented")));
  }
  return table;
}

// Empty if nothing was fitted, because the features are then those of the generic face.
ReportTable FeaturesTable(const Json& fit) {
  ReportTable table{
      "What the fit did to the generic face's features: strain against the template",
      {"part", "area (cm²)", "RMS strain (%)", "largest strain (%)", "RMS change of area (%)"}};
  const Json parts = fit.value("feature_distortion", Json::object());
  if (fit.at("levels").empty()) {
    return table;
  }
  for (const auto& [part, d] : parts.items()) {
    table.AddRow(WordsOfKey(part), Number(d.at("area_cm2"), 1), Percent(d.at("rms_strain")),
                 Percent(d.at("max_strain")), Percent(d.at("rms_area")));
  }
  return table;
}

ReportTable LevelsTable(const Json& fit) {
  ReportTable table{"Steps of the schedule",
                    {"step", "level", "fraction", "RMS before (mm)", "RMS after (mm)",
                     "largest move (mm)", "rank of the data", "vertices free", "vertices moved",
                     "vertices without data", "patches without data"}};
  int step = 0;
  for (const Json& level : fit.at("levels")) {
    table.AddRow(++step, Number(level.at("level")), Number(level.at("fraction")),
                 Number(level.at("rms_before_mm")), Number(level.at("rms_after_mm")),
                 Number(level.at("max_move_mm")), Number(level.at("rank")),
                 Number(level.at("free_vertices")), Number(level.value("moved_vertices", Json())),
                 Number(level.at("uncovered_vertices")), OutOf(level, "empty_patches", "patches"));
  }
  return table;
}

// Rounded columns of dowels.csv.
ReportTable DowelsTable(const std::filesystem::path& file) {
  ReportTable table{
      "Depth markers (dowels): the tissue depth at each landmark, and how far the face is from it",
      {"landmark", "depth (mm)", "SD (mm)", "u", "v", "distance left (mm)", "role"}};
  const std::string text = ReadFileBytes(file);
  CsvReader csv(text, file.string());
  const std::size_t site = csv.RequireColumn("site");
  while (csv.NextRow()) {
    std::vector<std::string> row = {WordsOfSite(csv.Cell(site))};
    for (const char* column : {"depth_mm", "sd_mm", "u", "v", "fit_residual_mm"}) {
      row.push_back(TableNumber(csv.NumberOrNan(csv.RequireColumn(column)), 2));
    }
    const auto role = csv.Find("role");  // folders of older versions have none
    row.emplace_back(role ? csv.Cell(*role) : "landmark");
    table.rows.push_back(std::move(row));
  }
  return table;
}

// "Turned from the bone's own direction: Gonion, left, by 23 degrees." Empty if no dowel is turned
// by 5 degrees or more: normals of other programs differ by less. Folders of older versions have no
// such column.
std::vector<std::string> TurnedDowels(const std::filesystem::path& file) {
  constexpr double kNotable_deg = 5;
  const std::string text = ReadFileBytes(file);
  CsvReader csv(text, file.string());
  const auto turned = csv.Find("turned_deg");
  std::vector<std::string> sites;
  while (turned && csv.NextRow()) {
    const double turn_deg = csv.NumberOrNan(*turned);
    if (turn_deg >= kNotable_deg) {
      sites.push_back(fmt::format("{} by {:.0f}\u00b0",
                                  WordsOfSite(csv.Cell(csv.RequireColumn("site"))), turn_deg));
    }
  }
  if (sites.empty()) {
    return {};
  }
  return {fmt::format("Markers whose given direction is turned from the bone's own: {}.",
                      fmt::join(sites, "; "))};
}

ReportTable CountsTable(const std::string& caption, const Json& values) {
  ReportTable table{caption, {"quantity", "value"}};
  for (const auto& [name, value] : values.items()) {
    if (!value.is_structured()) {
      table.AddRow(WordsOfKey(name), Number(value, 3));
    }
  }
  return table;
}

// The counts of depths, with the weights of averaged schemes and the estimates of kriging.
ReportTable DepthTable(const Json& depth) {
  ReportTable table = CountsTable("Tissue depth over the bone", depth);
  const Json shares = depth.value("shares", Json::object());
  for (const auto& [scheme, weight] : shares.items()) {
    table.AddRow(fmt::format("weight of {}", scheme), Number(weight, 3));
  }
  const Json process = depth.value("process", Json::object());
  for (const auto& [name, value] : process.items()) {
    table.AddRow("process: " + WordsOfKey(name), Number(value, 3));
  }
  return table;
}

// The bounds that the expert stated, and what they moved. No table if there are none.
std::vector<ReportTable> BoundTables(const Json& depth) {
  ReportTable table{"Bounds on the tissue depth (tissue.bounds)",
                    {"where", "least (mm)", "most (mm)", "bone (cm²)", "moved (%)",
                     "moved by up to (mm)", "depth markers moved"}};
  for (const Json& bound : depth.value("bounds", Json::array())) {
    const auto moved = bound.at("moved_dowels").get<std::vector<std::string>>();
    table.AddRow(bound.at("holds").get<std::string>(), Number(bound.at("least_mm")),
                 Number(bound.at("most_mm")), Number(bound.at("bone_cm2")),
                 TableNumber(100 * bound.at("moved_share").get<double>(), 1),
                 Number(bound.at("largest_move_mm")),
                 moved.empty() ? "none" : fmt::format("{}", fmt::join(moved, ", ")));
  }
  return table.rows.empty() ? std::vector<ReportTable>() : std::vector{std::move(table)};
}

ReportSection DepthSection(const Json& result) {
  ReportSection section{.heading = "Depth and first face",
                        .tables = {DepthTable(result.at("depth"))},
                        .folded = true};
  std::ranges::move(BoundTables(result.at("depth")), std::back_inserter(section.tables));
  section.tables.push_back(
      CountsTable("First face: the implicit surface of these depths", result.at("implicit")));
  return section;
}

void AddProtocols(const Json& face, ReportSection& section) {
  if (!face.contains("protocols")) {
    return;
  }
  ReportTable table = MetricsTable("Recovered face, scored by the protocols of other papers", face);
  table.rows = {
      MetricsRow("in the scan's frame", face.at("protocols").at("ct_frame")),
      MetricsRow("after the best rigid fit (Lee 2012, Miranda 2018)",
                 face.at("protocols").at("best_fit")),
      MetricsRow("along the view from the front (Hu 2021)", face.at("protocols").at("view_ray"))};
  section.tables.push_back(std::move(table));
}

ReportSection ErrorSection(const Json& result) {
  ReportSection section{.heading = "Against the true skin", .folded = true};
  section.paragraphs = {
      "The score covers the outer skin of the face, without the zones that the configuration "
      "excludes (see resolved.yaml, region, and the picture of the scored skin). Distances go to "
      "the closest point and are weighted by area. Nothing was aligned to the true skin, except "
      "where a table says so."};
  section.images.push_back(
      {QuantilePlotSvg({{"recovered face", Numbers(result.at("face").at("quantiles_mm"))},
                        {"first face (implicit surface)",
                         Numbers(result.at("implicit_face").at("quantiles_mm"))}},
                       "distance from the true skin (mm)"),
       "Share of the scored skin within each distance, up to 95 %.",
       "cumulative distribution of the errors of both faces"});
  section.tables = {MetricsTable("Recovered face", result.at("face")),
                    MetricsTable("First face, straight from the depths (implicit surface)",
                                 result.at("implicit_face"))};
  AddProtocols(result.at("face"), section);
  return section;
}

ReportSection PictureSection(const OutputFolder& folder) {
  struct Picture {
    const char *file, *caption;
  };
  ReportSection section{
      .heading = "From skull to face, in pictures",
      .paragraphs = {"The 3-D view also shows the tissue depth on the skull, the true skin, the "
                     "head and the errors of both faces, as far as the run has them."},
      .folded = true};
  for (const Picture& picture : std::vector<Picture>{
           {"implicit", "First face, straight from the depths (implicit surface)."},
           {"face", "Recovered face."},
           {"face_over_skull", "Recovered face, translucent, over skull and depth markers."}}) {
    section.images.push_back(
        ReportImageFromFile(folder.Root() / "pictures" / fmt::format("{}.png", picture.file),
                            picture.caption, fmt::format("from three sides: {}", picture.caption)));
  }
  return section;
}

// Empty for folders of older versions and for skulls whose landmarks define no planes.
ReportSection CrossSections(const OutputFolder& folder) {
  return {.heading = "Cross-sections",
          .paragraphs = {"Skull and faces, cut by planes at landmarks. The axes are those of an "
                         "average skull that was fitted to the landmarks. Where the run read a CT, "
                         "its grey values are behind the outlines."},
          .images = SectionImages(folder),
          .folded = true};
}

std::string Words(const Json& list, const char* between) {
  std::string words;
  for (const Json& word : list) {
    words += (words.empty() ? "" : between) + word.get<std::string>();
  }
  return words;
}

// Looks into resolved.yaml, because the folder may still hold the alternatives of an earlier run.
bool HasAlternatives(const OutputFolder& folder) {
  const std::filesystem::path file = folder.Root() / "resolved.yaml";
  ConfigErrors ignored;
  const ConfigNode options = ParseConfigText(
      ReadFileBytes(file), {.name = file.string(), .folder = folder.Root()}, ignored);
  const ConfigNode* const list = options.Find("alternatives");
  return list != nullptr && !list->items.empty() &&
         std::filesystem::exists(folder.Root() / "alternatives.json");
}

std::string AlternativesCaption(const Json& answers) {
  std::string names;
  for (const Json& answer : answers) {
    names += (names.empty() ? "" : ", ") + answer.at("name").get<std::string>();
  }
  return fmt::format("From left to right: {}.", names);
}

// The alternatives of the run (alternatives.h).
ReportSection AlternativesSection(const Json& answers, const OutputFolder& folder) {
  ReportSection section{.heading = "Alternatives side by side", .folded = true};
  section.paragraphs = {
      "The same skull with other options. All pictures share one camera. The maps show how far "
      "each face lies outside (+) or inside (\u2212) this run's own face."};
  for (const auto& [file, alt] :
       {std::pair("front", "heads of the alternatives, from the front"),
        std::pair("three_quarter", "heads of the alternatives, from between front and side"),
        std::pair("side", "heads of the alternatives, from the side"),
        std::pair("difference", "difference of the alternatives from this run's own face")}) {
    section.images.push_back(
        ReportImageFromFile(folder.Root() / "pictures" / fmt::format("alternatives_{}.png", file),
                            AlternativesCaption(answers), alt));
  }
  section.images.back().legends = {
      {ErrorColours(), "outside (+) or inside (\u2212) this run's own face"}};
  ReportTable table{"Differences of the alternatives",
                    {"alternative", "changed options", "depth markers", "sites left out",
                     "mean outside (mm)", "RMS difference (mm)", "least (mm)", "most (mm)",
                     "mean error (mm)", "p95 error (mm)", "≤ 2.5 mm (%)"}};
  for (const Json& answer : answers) {
    const Json none = {
        {"mean_mm", nullptr}, {"rms_mm", nullptr}, {"least_mm", nullptr}, {"most_mm", nullptr}};
    const Json unknown = {{"mean_abs_mm", nullptr}, {"p95_mm", nullptr}, {"within_2_5mm", nullptr}};
    const Json& d = answer.at("difference").is_null() ? none : answer.at("difference");
    const Json& face = answer.at("face").is_null() ? unknown : answer.at("face");
    table.AddRow(Number(answer.at("name")), Words(answer.at("set"), "; "),
                 Number(answer.at("dowels")), Words(answer.at("left_out"), ", "),
                 Number(d.at("mean_mm")), Number(d.at("rms_mm")), Number(d.at("least_mm")),
                 Number(d.at("most_mm")), Number(face.at("mean_abs_mm")), Number(face.at("p95_mm")),
                 Percent(face.at("within_2_5mm")));
  }
  section.tables = {table};
  return section;
}

// False for folders of older versions, which do not record the origin of the bone.
bool IsPartlyInvented(const Json& result) {
  return result.contains("bone") && result.at("bone").at("mirrored_cm2").get<double>() +
                                            result.at("bone").at("inferred_cm2").get<double>() >
                                        0;
}

ReportSection BoneSection(const Json& bone) {
  return {
      .heading = "Observed and invented bone",
      .paragraphs = {fmt::format(
          "{} cm² of the shell that carries the tissue lie on bone of the scan. The rest is "
          "invented: {} cm² are mirrored from the other side (blue), and {} cm² are inferred where "
          "the shell bridges temples, orbits and gaps (yellow). The face above invented bone is "
          "not evidence. \"Bone by origin\" in the 3-D view shows where.",
          Number(bone.at("observed_cm2"), 0), Number(bone.at("mirrored_cm2"), 0),
          Number(bone.at("inferred_cm2"), 0))},
      .folded = true};
}

ReportSection UncertaintySection(const Json& result, const OutputFolder& folder) {
  const Json& uncertainty = result.at("uncertainty");
  ReportSection section{.heading = "How far the face may be off", .folded = true};
  section.paragraphs = {fmt::format(
      "Standard deviation of the face along its normal: {} mm in the median and {} mm at the 95th "
      "percentile of the area that markers and extra points hold. It combines the spread of the "
      "markers' depths, of the depths between them, and of what the fit's smoothness suppresses. "
      "It does not cover a wrong skull, wrong landmarks or a depth table of other people.",
      Number(uncertainty.at("sigma_median_mm")), Number(uncertainty.at("sigma_p95_mm")))};
  if (!uncertainty.at("coverage_90").is_null()) {
    section.paragraphs.push_back(fmt::format(
        "The interval that should hold 90 % of the scored true skin holds {} %. (For a fit "
        "without a prior, the regions of the features are left out.)",
        Percent(uncertainty.at("coverage_90"))));
  }
  section.images = {
      ReportImageFromFile(folder.Root() / "pictures/sigma.png", "How far the face may be off.",
                          "standard deviation of the recovered face from three sides",
                          {{SigmaColours(), "standard deviation of the face along its normal"}})};
  return section;
}

ReportSection RulesSection(const Json& rules) {
  ReportSection section{
      .heading = "Rules for parts without bone",
      .paragraphs = {"Each rule is one observation among the depth markers. The remaining distance "
                     "runs from the face to the rule's prediction."},
      .folded = true};
  ReportTable table{"Applied rules",
                    {"rule", "point", "coordinate", "distance left (mm)", "SD (mm)", "source"}};
  for (const Json& rule : rules) {
    table.AddRow(WordsOfKey(rule.at("rule").get<std::string>()),
                 WordsOfKey(rule.at("point").get<std::string>()),
                 rule.at("coordinate").get<std::string>(), Number(rule.at("residual_mm")),
                 Number(rule.at("sd_mm")), rule.at("source").get<std::string>());
  }
  section.tables = {std::move(table)};
  return section;
}

// The checks of the face against their limits. Empty for folders of older versions.
ReportTable PlausibilityTable(const Json& result) {
  ReportTable table{"The face against the limits of a plausible face (options: plausibility)",
                    {"check", "value", "limit", "unit", "passed", "finding"}};
  const Json checks = result.value("plausibility", Json::object());
  for (const auto& [name, check] : checks.items()) {
    table.AddRow(WordsOfKey(name), Number(check.at("value"), 3), Number(check.at("limit"), 3),
                 Number(check.at("unit")), Number(check.at("passed")),
                 Number(check.at("sentence")));
  }
  return table;
}

// The cost of each term before and after each solve, and their sum.
ReportTable CostsTable(const Json& fit) {
  ReportTable table{"What each solve made least: weight times mean square, before and after it",
                    {"step", "level", "term", "cost before (mm²)", "cost after (mm²)"}};
  int step = 0;
  for (const Json& level : fit.at("levels")) {
    ++step;
    double before = 0, after = 0;
    for (const Json& term : level.at("terms")) {
      table.AddRow(step, Number(level.at("level")), WordsOfKey(term.at("term").get<std::string>()),
                   Number(term.at("before"), 4), Number(term.at("after"), 4));
      before += NumberOrNan(term.at("before"));
      after += NumberOrNan(term.at("after"));
    }
    if (level.at("terms").size() > 1) {
      table.AddRow(step, Number(level.at("level")), "all terms", TableNumber(before, 4),
                   TableNumber(after, 4));
    }
  }
  return table;
}

// The largest move of a point's (u,v) over the face; 0 without relaxation.
double LargestRelaxation_mm(const Json& fit) {
  double largest = 0;
  for (const Json& moves : fit.value("relaxations", Json::array())) {
    largest = std::max(largest, NumberOrNan(moves.at("max_move_mm")));
  }
  return largest;
}

std::string PointsSentence(const Json& fit) {
  const int seeds = fit.at("seeds").get<int>();
  const double moved_mm = LargestRelaxation_mm(fit);
  return fmt::format(
      "{} depth markers and {} extra points (seeds) of the first face drew the surface{}.",
      fit.at("points").get<int>() - seeds, seeds,
      moved_mm > 0
          ? fmt::format("; relaxation moved their places on it by up to {:.1f} mm", moved_mm)
          : "; their places on it did not move");
}

// Empty if no step needed a hold (FitLevelHeld).
std::string HoldSentence(const Json& fit) {
  double hold = 0;
  for (const Json& level : fit.at("levels")) {
    hold = std::max(hold, level.value("hold", 0.0));
  }
  return hold > 0 ? fmt::format(
                        " The points alone hardly determined some of the vertices; a hold "
                        "of weight {:.0e} kept them near their places.",
                        hold)
                  : "";
}

std::string FitSentence(const Json& fit) {
  const Json& levels = fit.at("levels");
  if (levels.empty()) {
    return "No control vertex was solved for. The face is the face model's or the placed "
           "template's (option face), and its distances from the markers were measured.";
  }
  std::set<int> named;
  std::set<std::string> solvers;
  for (const Json& level : levels) {
    named.insert(level.at("level").get<int>());
    solvers.insert(level.at("solver").get<std::string>());
  }
  return fmt::format(
      "The last round took {} at level{} {} of the H-spline, solved by {}. Each step moved the "
      "control vertices by its fraction of the way to the solution. {}{}",
      Counted(std::ssize(levels), "step", "steps"), named.size() == 1 ? "" : "s",
      fmt::join(named, ", "), fmt::join(solvers, " and "), PointsSentence(fit), HoldSentence(fit));
}

// Empty for a result of an older version, which does not state it.
std::string MethodSentence(const Json& result) {
  if (!result.contains("method")) {
    return "";
  }
  const Json& method = result.at("method");
  return fmt::format("Method of the face: {}. Interpolation of depth: {}. ",
                     method.at("face").get<std::string>(), method.at("interp").get<std::string>());
}

ReportSection FitSection(const Json& result, const OutputFolder& folder) {
  const Json& fit = result.at("fit");
  ReportSection section{
      .heading = "How the face was fitted",
      .paragraphs = {MethodSentence(result) + FitSentence(fit)},
      .tables = WithoutEmptyTables({LevelsTable(fit), CostsTable(fit), RelaxationTable(fit),
                                    FeaturesTable(fit), CountsTable("Counts of the fit", fit)}),
      .folded = true};
  const std::filesystem::path picture = folder.Root() / "pictures/fit.png";
  if (!fit.at("levels").empty() && std::filesystem::exists(picture)) {  // not of older versions
    section.images.push_back(ReportImageFromFile(
        picture,
        "Points of the fit: depth markers (red), extra points on the first face (blue), and the "
        "ways of the markers' places over the face in the last round (yellow, with a ball at the "
        "end).",
        "from three sides: the translucent face with the points that it was fitted to"));
  }
  for (ReportImage& plot : ConvergencePlots(fit)) {
    section.images.push_back(std::move(plot));
  }
  return section;
}

ReportSection ProvenanceSection(const std::filesystem::path& file) {
  return {.heading = "Inputs and versions",
          .paragraphs = {"The inputs by their hashes, and the versions of program and libraries. "
                         "manifest.json in the same folder also has the hash of every output. This "
                         "folder holds no copy of the inputs. If they lie beside resolved.yaml, "
                         "semblance run resolved.yaml repeats the run."},
          .preformatted = ReadFileBytes(file),
          .folded = true};
}

std::vector<ReportSection> Sections(const Json& result, const OutputFolder& folder) {
  std::vector<ReportSection> sections;
  if (!result.at("face").is_null()) {
    sections.push_back(ErrorSection(result));
  }
  if (HasAlternatives(folder)) {
    const std::filesystem::path alternatives = folder.Root() / "alternatives.json";
    sections.push_back(
        AlternativesSection(ParseJson(ReadFileBytes(alternatives), alternatives.string()), folder));
  }
  if (ReportTable checks = PlausibilityTable(result); !checks.rows.empty()) {
    sections.push_back({.heading = "Plausibility", .tables = {std::move(checks)}, .folded = true});
  }
  sections.push_back(PictureSection(folder));
  if (ReportSection cuts = CrossSections(folder); !cuts.images.empty()) {
    sections.push_back(std::move(cuts));
  }
  if (IsPartlyInvented(result)) {
    sections.push_back(BoneSection(result.at("bone")));
  }
  sections.push_back({.heading = "Depth at the landmarks",
                      .paragraphs = TurnedDowels(folder.Root() / "dowels.csv"),
                      .tables = {DowelsTable(folder.Root() / "dowels.csv")},
                      .folded = true});
  sections.push_back(FitSection(result, folder));
  if (HasSigma(result)) {
    sections.push_back(UncertaintySection(result, folder));
  }
  sections.push_back(DepthSection(result));
  if (result.contains("rules") && !result.at("rules").empty()) {
    sections.push_back(RulesSection(result.at("rules")));
  }
  sections.push_back({.heading = "All options",
                      .preformatted = ReadFileBytes(folder.Root() / "resolved.yaml"),
                      .folded = true});
  const std::filesystem::path provenance = folder.Root() / "provenance.json";
  if (std::filesystem::exists(provenance)) {
    sections.push_back(ProvenanceSection(provenance));
  }
  return sections;
}

// The picture of the scored skin is missing from folders of older versions.
std::vector<ReportImage> ScoreImages(const Json& face, const OutputFolder& folder) {
  if (face.is_null()) {
    return {};
  }
  std::vector<ReportImage> images;
  if (face.contains("scored_skin")) {
    images.push_back(
        ReportImageFromFile(folder.Root() / "pictures/scored.png",
                            "The green skin is scored. Yellow: masked by the configuration. Red: "
                            "inner walls and folds. "
                            "Blue: the lid where the scan ended. Grey: beyond the face.",
                            "the scored part of the true skin from three sides"));
  }
  images.push_back(ReportImageFromFile(
      folder.Root() / "pictures/error.png", "Signed error of the recovered face.",
      "signed error of the recovered face on the true skin from three sides",
      {{ErrorColours(), "recovered face outside (+) or inside (\u2212) the true skin"}}));
  return images;
}

// "Case 2026-17. Age: 35 to 50 years. Notes." with what the record states. Folders of older
// versions have no record.
std::string RecordText(const Json& record) {
  std::string text;
  for (const auto& [key, label] :
       {std::pair("number", "Case "), std::pair("age", "Age: "), std::pair("notes", "")}) {
    const std::string stated = record.value(key, "");
    if (!stated.empty()) {
      text += fmt::format(" {}{}{}", label, stated, stated.ends_with('.') ? "" : ".");
    }
  }
  return text;
}

void RequirePictures(const OutputFolder& folder) {
  if (!std::filesystem::exists(folder.Root() / "pictures/overview.png")) {
    throw IoError(
        fmt::format("{}: it has no pictures, and the report needs them; make it again with "
                    "`semblance run --set report=true`",
                    folder.Root().string()));
  }
}

Report BuildReport(const Json& result, const OutputFolder& folder) {
  Report report;
  report.title = result.at("title").get<std::string>();
  RequirePictures(folder);
  report.subtitle = "Facial approximation of " + result.at("subject").get<std::string>() +
                    ". An approximation, not an identification." +
                    RecordText(result.value("record", Json::object()));
  report.faults = result.value("faults", std::vector<std::string>());
  report.notes = SortedNotes(result.at("notes").get<std::vector<std::string>>());
  report.tiles = Tiles(result);
  report.score_heading = result.at("face").is_null() ? "In figures" : "Score";
  report.score_images = ScoreImages(result.at("face"), folder);
  const std::string parts = fmt::format("skull and depth markers, first face, recovered face{}{}",
                                        result.contains("bust") ? ", head" : "",
                                        result.at("face").is_null() ? "" : ", true skin");
  report.main_images = {ReportImageFromFile(folder.Root() / "pictures/overview.png",
                                            fmt::format("From left to right: {}.", parts),
                                            fmt::format("{}, from the front", parts))};
  const std::filesystem::path scene = folder.Root() / "scene.json";
  if (std::filesystem::exists(scene)) {  // missing from folders of older versions
    report.scenes = CollectScenes({{result.at("subject"), ReadFileBytes(scene)}}, 0).json;
  }
  report.sections = Sections(result, folder);
  return report;
}

}  // namespace

void WriteReport(OutputFolder& folder) {
  const std::filesystem::path file = folder.Root() / "result.json";
  try {
    folder.Write("report.html",
                 ReportHtml(BuildReport(ParseJson(ReadFileBytes(file), file.string()), folder)));
  } catch (const nlohmann::json::exception& e) {
    throw IoError(fmt::format(
        "{}: not the result of a run ({}); semblance report takes the folder of a run or a study",
        file.string(), JsonFault(e)));
  }
}

}  // namespace semblance::problems
