// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study_report/search_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "problems/plots/svg_plot.h"
#include "problems/report/plain_names.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/base/json_text.h"

namespace semblance {
namespace {

using Json = nlohmann::ordered_json;

// The metric; where the values nearest to something are sought, its distance from that.
double ValueOf(const TrialRow& row, const StudyResults& results) {
  const auto value = row.metrics.find(results.metric);
  return row.status == "done" && value != row.metrics.end()
             ? results.preference.Compared(value->second)
             : kNaN;
}

bool IsBase(const TrialRow& row) {
  return std::ranges::all_of(row.values, [](const std::string& value) { return value.empty(); });
}

// NaN if one of them is.
double MeanOf(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) {
    sum += value;
  }
  return values.empty() ? kNaN : sum / static_cast<double>(values.size());
}

double BaseOf(const StudyResults& results) {
  std::vector<double> values;
  for (const TrialRow& row : results.trials) {
    if (IsBase(row) && !row.aside) {
      values.push_back(ValueOf(row, results));
    }
  }
  return MeanOf(values);
}

void AddTreatments(const Json& steps, const StudyResults& results, SearchResults& search) {
  std::map<std::string, double> by_id;
  for (const TrialRow& row : results.trials) {
    by_id[row.id] = ValueOf(row, results);
  }
  double spent = 0, best = kNaN;
  for (const Json& step : steps) {
    std::vector<double> values;
    for (const Json& id : step.at("trials")) {
      const auto value = by_id.find(id.get<std::string>());
      values.push_back(value == by_id.end() ? kNaN : value->second);
    }
    const double cost = step.at("cost");
    spent += cost;
    SearchedTreatment treatment{.label = {}, .cost = cost, .spent = spent, .value = MeanOf(values)};
    treatment.values = step.at("values").get<std::vector<std::string>>();
    treatment.label = TreatmentLabel(results.axes, treatment.values);
    const bool is_better = search.preference.IsBetter(treatment.value, best);
    if (cost == 1 && std::isfinite(treatment.value) && (is_better || !std::isfinite(best))) {
      best = treatment.value;
      search.improvements.push_back(search.treatments.size());
    }
    search.treatments.push_back(std::move(treatment));
  }
}

void AddHeldOut(const StudyResults& results, SearchResults& search) {
  std::map<std::string, std::size_t> place;
  for (const TrialRow& row : results.trials) {
    if (row.aside && IsBase(row)) {
      place[row.subject] = search.held_out.size();
      search.held_out.push_back({row.subject, ValueOf(row, results), kNaN});
    }
  }
  if (!search.ended || search.improvements.empty()) {
    return;
  }
  const auto& best = search.treatments[search.improvements.back()].values;
  for (const TrialRow& row : results.trials) {
    const auto at = place.find(row.subject);
    if (row.aside && at != place.end() && row.values == best) {
      search.held_out[at->second].best = ValueOf(row, results);
    }
  }
}

std::vector<double> DifferencesOf(const SearchResults& search) {
  std::vector<double> differences;
  for (const HeldOutPair& pair : search.held_out) {
    if (std::isfinite(pair.best - pair.base)) {
      differences.push_back(pair.best - pair.base);
    }
  }
  return differences;
}

// What the subjects held out say of the best treatment; the search chose it on others.
std::string Verdict(const SearchResults& search) {
  if (search.held_out.empty()) {
    return "No subject was held out: on others the best treatment may do worse than it did here, "
           "where it was chosen.";
  }
  const std::vector<double> d = DifferencesOf(search);
  if (d.empty()) {
    return search.ended ? "The base as it stands is the best, or no subject held out has a value."
                        : "The subjects held out are run when the search has ended.";
  }
  const SampleSummary s = Summarize(d);
  const auto better =
      std::ranges::count_if(d, [&](double x) { return search.preference.IsBetter(x, 0); });
  const bool is_sure = std::isfinite(s.mean_95.low) && (s.mean_95.low > 0 || s.mean_95.high < 0);
  const bool is_better = search.preference.IsBetter(s.mean, 0);
  const std::string interval =
      std::isfinite(s.mean_95.low)
          ? fmt::format(", 95 % interval {:.4g} to {:.4g}", s.mean_95.low, s.mean_95.high)
          : "";
  return fmt::format(
      "On {} held out, the best treatment less the base as it stands: {:+.4g} on average{}; better "
      "in {} of {}. {}",
      Counted(static_cast<long long>(d.size()), "subject"), s.mean, interval, better, d.size(),
      !is_sure    ? "So few and so unlike, they do not say which of the two is better."
      : is_better ? "It beats the base there too."
                  : "It does worse than the base there.");
}

double Spent(const SearchResults& search) {
  return search.treatments.empty() ? 0 : search.treatments.back().spent;
}

// "{type: bayes, initial: null, batch: 2}" as "bayes (batch: 2)": what was left out says nothing.
std::string MethodWords(std::string_view flow) {
  const std::regex type(R"(^\{type: (\w+)(?:, )?(.*)\}$)"), left_out(R"(\w+: null(, )?)");
  std::cmatch parts;
  if (!std::regex_match(flow.begin(), flow.end(), parts, type)) {
    return std::string(flow);
  }
  std::string options = std::regex_replace(parts[2].str(), left_out, "");
  if (options.ends_with(", ")) {
    options.resize(options.size() - 2);
  }
  return options.empty() ? parts[1].str() : fmt::format("{} ({})", parts[1].str(), options);
}

// A search among few choices draws some of them again and again.
std::string TreatmentsInWords(const SearchResults& search) {
  std::set<std::vector<std::string>> different;
  for (const SearchedTreatment& treatment : search.treatments) {
    different.insert(treatment.values);
  }
  const std::string asked = Counted(std::ssize(search.treatments), "treatment");
  return different.size() == search.treatments.size()
             ? asked
             : fmt::format("{}, {}", Counted(std::ssize(search.treatments), "draw"),
                           Counted(std::ssize(different), "different treatment"));
}

std::string Summary(const StudyResults& results, const SearchResults& search) {
  const Preference& wanted = search.preference;
  const std::string which =
      wanted.better == Better::kNearest
          ? fmt::format(
                "values of {} nearest to {} are better, and the values here are their "
                "distances from it",
                WordsOfMetric(results.metric), wanted.target)
          : fmt::format("{} values of {} are better",
                        wanted.better == Better::kHigher ? "higher" : "lower",
                        WordsOfMetric(results.metric));
  return fmt::format(
      "Searched by {}: {:.4g} of {} full runs spent on {}{}; {}. The base as it stands has {}.",
      MethodWords(search.method), Spent(search), search.budget, TreatmentsInWords(search),
      search.ended ? "" : ", and the search has not ended", which,
      std::isfinite(search.base) ? TableNumber(search.base) : "no value");
}

std::vector<AxisLine> CurvesOf(const SearchResults& search) {
  AxisLine best{"best so far", {}}, each{"each full run", {}}, base{"base as it stands", {}};
  each.is_joined = false;
  double least = kNaN;
  for (std::size_t n = 0; n < search.treatments.size(); ++n) {
    const SearchedTreatment& t = search.treatments[n];
    if (t.cost != 1 || !std::isfinite(t.value)) {
      continue;
    }
    const bool is_better = std::ranges::find(search.improvements, n) != search.improvements.end();
    least = is_better ? t.value : least;
    best.points.push_back({t.spent, least, fmt::format("after {:.4g}: {:.6g}", t.spent, least)});
    each.points.push_back({t.spent, t.value, fmt::format("{}: {:.6g}", t.label, t.value)});
  }
  std::vector<AxisLine> lines = {best, each};
  if (std::isfinite(search.base)) {
    const std::string name = fmt::format("base as it stands: {:.6g}", search.base);
    base.points = {{0, search.base, name}, {Spent(search), search.base, name}};
    lines.push_back(base);
  }
  return lines;
}

ReportTable ImprovementsTable(const SearchResults& search) {
  ReportTable table{"Each full run that was better than all before",
                    {"treatment", "full runs spent", "value", "less the base"},
                    {}};
  for (const std::size_t n : search.improvements) {
    const SearchedTreatment& t = search.treatments[n];
    table.rows.push_back({t.label, fmt::format("{:.4g}", t.spent), TableNumber(t.value),
                          TableNumber(t.value - search.base)});
  }
  return table;
}

ReportTable HeldOutTable(const SearchResults& search) {
  ReportTable table{"Subjects held out", {"subject", "base", "best treatment", "difference"}, {}};
  for (const HeldOutPair& pair : search.held_out) {
    table.rows.push_back({pair.subject, TableNumber(pair.base), TableNumber(pair.best),
                          TableNumber(pair.best - pair.base)});
  }
  return table;
}

}  // namespace

std::optional<SearchResults> ReadSearchResults(const std::filesystem::path& folder,
                                               const StudyResults& results) {
  const std::filesystem::path file = folder / "plan.json";
  try {
    const Json plan = ParseJson(ReadFileBytes(file), file.string());
    if (!plan.contains("search")) {
      return std::nullopt;
    }
    const Json& json = plan["search"];
    SearchResults search{.method = json.at("method"),
                         .budget = json.at("budget"),
                         .ended = json.at("ended"),
                         .preference = results.preference,
                         .treatments = {},
                         .improvements = {},
                         .base = BaseOf(results),
                         .held_out = {}};
    AddTreatments(json.at("steps"), results, search);
    AddHeldOut(results, search);
    return search;
  } catch (const nlohmann::json::exception&) {
    throw IoError(
        fmt::format("{}: its search is cut short or of another version; run the study "
                    "again, which writes it anew",
                    file.string()));
  }
}

ReportSection SearchSection(const StudyResults& results, const SearchResults& search) {
  ReportSection section{.heading = "The search"};
  section.paragraphs = {Summary(results, search), Verdict(search)};
  if (!search.improvements.empty()) {
    section.images = {{AxisPlotSvg(CurvesOf(search), "full runs spent",
                                   WordsOfMetric(results.metric) + search.preference.OfWhat()),
                       "The best of the full runs so far, mean over the subjects. Short runs count "
                       "by their length, and are not drawn.",
                       "the best value found so far against the runs spent"}};
    section.tables = {ImprovementsTable(search)};
  }
  if (!search.held_out.empty()) {
    section.tables.push_back(HeldOutTable(search));
  }
  return section;
}

std::string SearchText(const StudyResults& results, const SearchResults& search) {
  std::string text = Summary(results, search) + "\n";
  if (!search.improvements.empty()) {
    text += "best so far, by full runs spent:\n";
  }
  for (const std::size_t n : search.improvements) {
    const SearchedTreatment& t = search.treatments[n];
    text += fmt::format("{:>8.4g}  {:>10.4g}  {}\n", t.spent, t.value, t.label);
  }
  return text + Verdict(search) + "\n";
}

}  // namespace semblance
