// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/run_report.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "problems/config/config.h"
#include "problems/plots/svg_plot.h"
#include "problems/report/plain_names.h"
#include "problems/report/report.h"
#include "problems/report/scene_json.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/csv.h"
#include "surfaces/base/error.h"
#include "surfaces/base/json_text.h"

namespace semblance {
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

std::string Percent(const Json& share) {
  return share.is_null() ? "" : fmt::format("{:.1f}", 100 * share.get<double>());
}

// Runs of older versions say nothing of it.
bool HasSigma(const Json& result) {
  return result.contains("uncertainty") && !result.at("uncertainty").is_null() &&
         !result.at("uncertainty").at("sigma_median_mm").is_null();
}

std::vector<ReportTile> Tiles(const Json& result) {
  const Json& face = result.at("face");
  const Json& fit = result.at("fit");
  std::vector<ReportTile> tiles;
  if (!face.is_null()) {
    tiles = {{"mean error", Number(face.at("mean_abs_mm")), "mm",
              "recovered face against the true skin"},
             {"RMS error", Number(face.at("rms_mm")), "mm", ""},
             {"median", Number(face.at("median_mm")), "mm", ""},
             {"95th percentile", Number(face.at("p95_mm")), "mm", ""},
             {"within 2.5 mm", Percent(face.at("within_2_5mm")), "%", "of the scored area"}};
  }
  tiles.push_back({"depth markers", Number(fit.at("dowel_rms_mm")), "mm",
                   "RMS from the markers' tips to the face"});
  if (HasSigma(result)) {
    tiles.push_back({"may be off", Number(result.at("uncertainty").at("sigma_median_mm")), "mm",
                     "median standard deviation of the face along its normal"});
  }
  return tiles;
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
                     "max (mm)", "signed mean (mm)", "≤ 2.5 mm (%)", "≤ 5 mm (%)"},
                    {}};
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
    numbers.push_back(value.is_number() ? value.get<double>() : kNaN);
  }
  return numbers;
}

// None where fewer than two steps have a distance.
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

// How the points' (u,v) moved; empty without relaxation, or for runs of older versions.
ReportTable RelaxationTable(const Json& fit) {
  ReportTable table{
      "How markers and extra points moved over the face: mean penalties after each step",
      {"step", "distance before (mm²)", "distance (mm²)", "bunching (mm²)", "distortion (mm²)",
       "crease (mm²)", "largest move (mm)", "folds prevented"},
      {}};
  int step = 0;
  for (const Json& moves : fit.value("relaxations", Json::array())) {
    const Json& after = moves.at("after");
    table.rows.push_back({std::to_string(++step), Number(moves.at("before").at("distance"), 3),
                          Number(after.at("distance"), 3), Number(after.at("bunching"), 3),
                          Number(after.at("distortion"), 3), Number(after.at("crease"), 3),
                          Number(moves.at("max_move_mm")), Number(moves.at("flips_prevented"))});
  }
  return table;
}

// Without rows where there was nothing to fit: the features are those of the generic face.
ReportTable FeaturesTable(const Json& fit) {
  ReportTable table{
      "What the fit did to the generic face's features: strain against the template",
      {"part", "area (cm²)", "RMS strain (%)", "largest strain (%)", "RMS change of area (%)"},
      {}};
  const Json parts = fit.value("feature_distortion", Json::object());
  if (fit.at("levels").empty()) {
    return table;
  }
  for (const auto& [part, d] : parts.items()) {
    table.rows.push_back({WordsOfKey(part), Number(d.at("area_cm2"), 1),
                          Percent(d.at("rms_strain")), Percent(d.at("max_strain")),
                          Percent(d.at("rms_area"))});
  }
  return table;
}

// Those with rows.
std::vector<ReportTable> Filled(std::vector<ReportTable> tables) {
  std::erase_if(tables, [](const ReportTable& table) { return table.rows.empty(); });
  return tables;
}

ReportTable LevelsTable(const Json& fit) {
  ReportTable table{
      "Steps of the schedule",
      {"step", "level", "fraction", "RMS before (mm)", "RMS after (mm)", "largest move (mm)",
       "rank of the data", "vertices free", "vertices without data", "patches without data"},
      {}};
  int step = 0;
  for (const Json& level : fit.at("levels")) {
    table.rows.push_back({std::to_string(++step), Number(level.at("level")),
                          Number(level.at("fraction")), Number(level.at("rms_before_mm")),
                          Number(level.at("rms_after_mm")), Number(level.at("max_move_mm")),
                          Number(level.at("rank")), Number(level.at("free_vertices")),
                          Number(level.at("uncovered_vertices")),
                          OutOf(level, "empty_patches", "patches")});
  }
  return table;
}

// Some columns of dowels.csv, rounded for reading.
ReportTable DowelsTable(const std::filesystem::path& file) {
  ReportTable table{
      "Depth markers (dowels): the tissue depth at each landmark, and how far the face is from it",
      {"landmark", "depth (mm)", "SD (mm)", "u", "v", "distance left (mm)", "role"},
      {}};
  const std::string text = ReadFileBytes(file);
  CsvReader csv(text, file.string());
  const std::size_t site = csv.ColumnOf("site");
  while (csv.NextRow()) {
    std::vector<std::string> row = {WordsOfSite(csv.Cell(site))};
    for (const char* column : {"depth_mm", "sd_mm", "u", "v", "fit_residual_mm"}) {
      const double value = csv.NumberOrNan(csv.ColumnOf(column));
      row.push_back(std::isnan(value) ? "" : fmt::format("{:.2f}", value));
    }
    const auto role = csv.Find("role");  // folders of older versions have none
    row.emplace_back(role ? csv.Cell(*role) : "landmark");
    table.rows.push_back(std::move(row));
  }
  return table;
}

ReportTable CountsTable(const std::string& caption, const Json& values) {
  ReportTable table{caption, {"what", "value"}, {}};
  for (const auto& [name, value] : values.items()) {
    if (!value.is_structured()) {
      table.rows.push_back({WordsOfKey(name), Number(value, 3)});
    }
  }
  return table;
}

// With the weights of an average of schemes, and what kriging found.
ReportTable DepthTable(const Json& depth) {
  ReportTable table = CountsTable("Tissue depth over the bone", depth);
  const Json shares = depth.value("shares", Json::object());
  for (const auto& [scheme, weight] : shares.items()) {
    table.rows.push_back({fmt::format("weight of {}", scheme), Number(weight, 3)});
  }
  const Json process = depth.value("process", Json::object());
  for (const auto& [name, value] : process.items()) {
    table.rows.push_back({"process: " + WordsOfKey(name), Number(value, 3)});
  }
  return table;
}

void AddProtocols(const Json& face, ReportSection& section) {
  if (!face.contains("protocols")) {
    return;
  }
  ReportTable table = MetricsTable("Recovered face, as other papers score theirs", face);
  table.rows = {
      MetricsRow("in the scan's frame", face.at("protocols").at("ct_frame")),
      MetricsRow("after the best rigid fit (Lee 2012, Miranda 2018)",
                 face.at("protocols").at("best_fit")),
      MetricsRow("along the view from the front (Hu 2021)", face.at("protocols").at("view_ray"))};
  section.tables.push_back(std::move(table));
}

ReportSection ErrorSection(const Json& result, const OutputFolder& folder) {
  ReportSection section{.heading = "Against the true skin", .folded = true};
  section.paragraphs = {
      "Scored is the outer skin of the face, without the zones that the configuration excludes "
      "(see "
      "resolved.yaml, region, and the picture of the scored skin). Distances are to the closest "
      "point, weighted by area; nothing was aligned to the true skin but where a table says so."};
  section.images = {ReportImageFromFile(folder.Root() / "pictures/error_implicit.png", "",
                                        "signed error of the first face on the true skin"),
                    ReportImageFromFile(folder.Root() / "pictures/truth.png", "",
                                        "the true skin from three sides")};
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
  ReportSection section{.heading = "From skull to face, in pictures", .folded = true};
  for (const auto& [file, alt] :
       {std::pair("skull_dowels", "skull with depth markers"),
        std::pair("depth", "interpolated tissue depth on the skull's shell"),
        std::pair("implicit", "first face, straight from the depths"),
        std::pair("face", "recovered face"),
        std::pair("face_over_skull", "recovered face, translucent, over skull and markers")}) {
    section.images.push_back(
        ReportImageFromFile(folder.Root() / "pictures" / (std::string(file) + ".png"), "",
                            fmt::format("{} from three sides", alt)));
  }
  return section;
}

std::string Words(const Json& list, const char* between) {
  std::string words;
  for (const Json& word : list) {
    words += (words.empty() ? "" : between) + word.get<std::string>();
  }
  return words;
}

// A folder may hold the alternatives of another run that was made in it before.
bool HasAlternatives(const OutputFolder& folder) {
  const std::filesystem::path file = folder.Root() / "resolved.yaml";
  ConfigErrors ignored;
  const ConfigNode options = ParseConfigText(
      ReadFileBytes(file), {.name = file.string(), .folder = folder.Root()}, ignored);
  const ConfigNode* const list = options.Find("alternatives");
  return list != nullptr && !list->items.empty() &&
         std::filesystem::exists(folder.Root() / "alternatives.json");
}

// Where the run has alternatives (alternatives.h).
ReportSection AlternativesSection(const Json& answers, const OutputFolder& folder) {
  ReportSection section{.heading = "Alternatives side by side", .folded = true};
  section.paragraphs = {
      "The same skull with other options. All pictures have one camera; the maps show how far each "
      "face lies outside (+) or inside (-) this run's own."};
  for (const auto& [file, alt] :
       {std::pair("front", "heads of the alternatives, from the front"),
        std::pair("three_quarter", "heads of the alternatives, from between front and side"),
        std::pair("side", "heads of the alternatives, from the side"),
        std::pair("difference", "difference of the alternatives from this run's own face")}) {
    section.images.push_back(ReportImageFromFile(
        folder.Root() / "pictures" / fmt::format("alternatives_{}.png", file), "", alt));
  }
  ReportTable table{"What differs, and by how much",
                    {"alternative", "otherwise", "depth markers", "sites left out",
                     "mean outside (mm)", "RMS difference (mm)", "least (mm)", "most (mm)",
                     "mean error (mm)", "p95 error (mm)", "≤ 2.5 mm (%)"},
                    {}};
  for (const Json& answer : answers) {
    const Json none = {
        {"mean_mm", nullptr}, {"rms_mm", nullptr}, {"least_mm", nullptr}, {"most_mm", nullptr}};
    const Json unknown = {{"mean_abs_mm", nullptr}, {"p95_mm", nullptr}, {"within_2_5mm", nullptr}};
    const Json& d = answer.at("difference").is_null() ? none : answer.at("difference");
    const Json& face = answer.at("face").is_null() ? unknown : answer.at("face");
    table.rows.push_back({Number(answer.at("name")), Words(answer.at("set"), "; "),
                          Number(answer.at("dowels")), Words(answer.at("left_out"), ", "),
                          Number(d.at("mean_mm")), Number(d.at("rms_mm")), Number(d.at("least_mm")),
                          Number(d.at("most_mm")), Number(face.at("mean_abs_mm")),
                          Number(face.at("p95_mm")), Percent(face.at("within_2_5mm"))});
  }
  section.tables = {table};
  return section;
}

// Folders of older versions do not say.
bool IsPartlyInvented(const Json& result) {
  return result.contains("bone") && result.at("bone").at("mirrored_cm2").get<double>() +
                                            result.at("bone").at("inferred_cm2").get<double>() >
                                        0;
}

ReportSection BoneSection(const Json& bone, const OutputFolder& folder) {
  return {
      .heading = "What of the bone was seen",
      .paragraphs = {fmt::format(
          "Of the shell that carries the tissue {} cm² lie on bone of the scan. Invented are {} "
          "cm² mirrored from the other side (blue) and {} cm² inferred, where temples, orbits "
          "and gaps are bridged (yellow). What of the face stands on them is not evidence.",
          Number(bone.at("observed_cm2"), 0), Number(bone.at("mirrored_cm2"), 0),
          Number(bone.at("inferred_cm2"), 0))},
      .images = {ReportImageFromFile(folder.Root() / "pictures/origin.png", "",
                                     "observed, mirrored and inferred bone from three sides"),
                 ReportImageFromFile(folder.Root() / "pictures/origin_face.png", "",
                                     "the face by the bone under it, from three sides")},
      .folded = true};
}

ReportSection UncertaintySection(const Json& result, const OutputFolder& folder) {
  const Json& uncertainty = result.at("uncertainty");
  ReportSection section{.heading = "How far the face may be off", .folded = true};
  section.paragraphs = {fmt::format(
      "Standard deviation of the face along its normal, from that of the markers' depths, of the "
      "depths between them, and of what the fit's smoothness holds back: {} mm in the median and "
      "{} mm at the 95th percentile of the area that markers and extra points hold. It knows "
      "nothing of a "
      "wrong skull, wrong landmarks or a table of other people.",
      Number(uncertainty.at("sigma_median_mm")), Number(uncertainty.at("sigma_p95_mm")))};
  if (!uncertainty.at("coverage_90").is_null()) {
    section.paragraphs.push_back(
        fmt::format("Of the true skin that is scored (of a fit without a prior the features' "
                    "regions apart) {} % lie within the interval that should hold 90 %.",
                    Percent(uncertainty.at("coverage_90"))));
  }
  section.images = {
      ReportImageFromFile(folder.Root() / "pictures/sigma.png", "",
                          "standard deviation of the recovered face from three sides")};
  return section;
}

ReportSection RulesSection(const Json& rules) {
  ReportSection section{
      .heading = "Rules for what bone does not carry",
      .paragraphs = {"Each is one observation among the depth markers. What is left goes from "
                     "the face to what the rule predicted."},
      .folded = true};
  ReportTable table{
      "The rules at work", {"rule", "point", "coordinate", "left (mm)", "SD (mm)", "source"}, {}};
  for (const Json& rule : rules) {
    table.rows.push_back({WordsOfKey(rule.at("rule").get<std::string>()),
                          WordsOfKey(rule.at("point").get<std::string>()),
                          rule.at("coordinate").get<std::string>(), Number(rule.at("residual_mm")),
                          Number(rule.at("sd_mm")), rule.at("source").get<std::string>()});
  }
  section.tables = {std::move(table)};
  return section;
}

// What went wrong, then what is to be known.
std::vector<std::string> Notes(const Json& result) {
  std::vector<std::string> notes;
  for (const Json& fault : result.value("faults", Json::array())) {
    notes.push_back("The result is not usable: " + fault.get<std::string>());
  }
  for (const Json& note : result.at("notes")) {
    notes.push_back(note.get<std::string>());
  }
  return notes;
}

ReportSection FitSection(const Json& fit) {
  return {.heading = "The fit",
          .images = ConvergencePlots(fit),
          .tables = Filled({LevelsTable(fit), RelaxationTable(fit), FeaturesTable(fit),
                            CountsTable("Counts of the fit", fit)}),
          .folded = true};
}

ReportSection ProvenanceSection(const std::filesystem::path& file) {
  return {
      .heading = "What it was made of",
      .paragraphs = {"What went in, by content, and what it was made with. manifest.json beside "
                     "this page has the hash of every output too. This folder holds no copy of "
                     "the inputs; where they lie beside resolved.yaml, semblance run "
                     "resolved.yaml makes it all again."},
      .preformatted = ReadFileBytes(file),
      .folded = true};
}

std::vector<ReportSection> Sections(const Json& result, const OutputFolder& folder) {
  std::vector<ReportSection> sections;
  if (!result.at("face").is_null()) {
    sections.push_back(ErrorSection(result, folder));
  }
  if (HasAlternatives(folder)) {
    const std::filesystem::path alternatives = folder.Root() / "alternatives.json";
    sections.push_back(
        AlternativesSection(ParseJson(ReadFileBytes(alternatives), alternatives.string()), folder));
  }
  sections.push_back(PictureSection(folder));
  if (IsPartlyInvented(result)) {
    sections.push_back(BoneSection(result.at("bone"), folder));
  }
  sections.push_back({.heading = "Depth at the landmarks",
                      .tables = {DowelsTable(folder.Root() / "dowels.csv")},
                      .folded = true});
  sections.push_back(FitSection(result.at("fit")));
  if (HasSigma(result)) {
    sections.push_back(UncertaintySection(result, folder));
  }
  sections.push_back({.heading = "Depth and first face",
                      .tables = {DepthTable(result.at("depth")),
                                 CountsTable("First face: the implicit surface of these depths",
                                             result.at("implicit"))},
                      .folded = true});
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

// Folders of older versions have no picture of it.
std::vector<ReportImage> ScoreImages(const Json& face, const OutputFolder& folder) {
  if (face.is_null()) {
    return {};
  }
  std::vector<ReportImage> images;
  if (face.contains("scored_skin")) {
    images.push_back(ReportImageFromFile(
        folder.Root() / "pictures/scored.png",
        "The score is of the green skin. Yellow: masked by the configuration. Red: inner walls and "
        "folds. Blue: where the scan ended.",
        "the scored part of the true skin from three sides"));
  }
  images.push_back(
      ReportImageFromFile(folder.Root() / "pictures/error.png",
                          "Where the recovered face lies outside (red) or inside (blue) of the "
                          "true skin.",
                          "signed error of the recovered face on the true skin from three sides"));
  return images;
}

Report BuildReport(const Json& result, const OutputFolder& folder) {
  Report report;
  report.title = result.at("title").get<std::string>();
  report.subtitle = "Facial approximation of " + result.at("subject").get<std::string>() +
                    ". An approximation, not an identification.";
  report.notes = Notes(result);
  report.tiles = Tiles(result);
  report.score_heading = result.at("face").is_null() ? "In figures" : "Score";
  report.score_images = ScoreImages(result.at("face"), folder);
  report.main_images = {ReportImageFromFile(
      folder.Root() / "pictures/overview.png", "",
      fmt::format("skull and depth markers, first face, recovered face{}, from the front",
                  result.at("face").is_null() ? "" : " and true skin"))};
  const std::filesystem::path scene = folder.Root() / "scene.json";
  if (std::filesystem::exists(scene)) {  // runs of older versions have none
    report.scenes = CollectScenes({{result.at("subject"), ReadFileBytes(scene)}}, 0).json;
  }
  report.sections = Sections(result, folder);
  report.footer = "semblance " SEMBLANCE_VERSION;
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
        "{}: not the result of a run ({}); a report is made anew of a run or a study alone",
        file.string(), JsonFault(e)));
  }
}

}  // namespace semblance
