// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study_report/identify_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "problems/metrics/identification.h"
#include "problems/plots/svg_plot.h"

namespace semblance {
namespace {

using BySubject = std::map<std::string, double>;

// A kind of face that was asked about, with the rank of its own person.
struct Probe {
  std::string label;
  BySubject rank;

  std::vector<double> Ranks() const {
    std::vector<double> ranks;
    for (const auto& [subject, value] : rank) {
      ranks.push_back(value);
    }
    return ranks;
  }
};

// The metric of a treatment's trials.
BySubject MetricOf(const StudyResults& results, const Treatment& treatment,
                   const std::string& metric) {
  BySubject values;
  for (const std::size_t n : treatment.trials) {
    const TrialRow& row = results.trials[n];
    if (const auto it = row.metrics.find(metric); it != row.metrics.end()) {
      values[row.subject] = it->second;
    }
  }
  return values;
}

// The treatments, then the ceiling and the floor, which are the same for all of them.
std::vector<Probe> ProbesBy(const std::string& measure, const StudyResults& results,
                            const std::vector<Treatment>& ranked) {
  std::vector<Probe> probes;
  for (const Treatment& t : ranked) {
    probes.push_back({t.label, MetricOf(results, t, fmt::format("identify.{}.rank", measure))});
  }
  for (const auto& [path, label] : {std::pair("ceiling", "ceiling: the true face, seen again"),
                                    std::pair("floor", "floor: the generic face")}) {
    probes.push_back({label, MetricOf(results, ranked.front(),
                                      fmt::format("identify.{}.{}.rank", path, measure))});
  }
  std::erase_if(probes, [](const Probe& probe) { return probe.rank.empty(); });
  return probes;
}

double Mean(const std::vector<double>& values) { return Summarize(values).mean; }

// Within the first k, of all that were asked.
std::string Share(const std::vector<double>& ranks, int gallery, int k) {
  if (k > gallery) {
    return "";
  }
  const double share = CumulativeMatch(ranks, gallery)[static_cast<std::size_t>(k - 1)];
  return fmt::format("{:.0f} % ({} of {})", 100 * share,
                     std::lround(share * static_cast<double>(ranks.size())), ranks.size());
}

std::vector<double> Gains(const Probe& probe, const Probe& floor) {
  std::vector<double> gains;
  for (const auto& [subject, rank] : probe.rank) {
    if (const auto it = floor.rank.find(subject); it != floor.rank.end()) {
      gains.push_back(it->second - rank);
    }
  }
  return gains;
}

ReportTable TableOf(const std::vector<Probe>& probes, int gallery) {
  constexpr int kLeastSubjects = 6;  // two-sided, five cannot reach p < 0.05
  ReportTable table{fmt::format("Ranks in a gallery of {}; by chance the mean is {}", gallery,
                                ChanceRank(gallery)),
                    {"face", "rank 1", "rank 5", "mean rank", "gained over the floor",
                     "95 % interval", "Wilcoxon p"},
                    {}};
  const Probe& floor = probes.back();
  for (const Probe& probe : probes) {
    const std::vector<double> ranks = probe.Ranks(), gains = Gains(probe, floor);
    const SampleSummary gain = Summarize(gains);
    const bool tested = &probe != &floor && gain.n >= kLeastSubjects;
    const double p = tested ? Wilcoxon(gains).p : kNaN;
    const bool interval = &probe != &floor && std::isfinite(gain.mean_95.low);
    table.rows.push_back(
        {probe.label, Share(ranks, gallery, 1), Share(ranks, gallery, 5), TableNumber(Mean(ranks)),
         &probe == &floor ? "" : TableNumber(gain.mean),
         interval ? fmt::format("{:.2f} to {:.2f}", gain.mean_95.low, gain.mean_95.high) : "",
         std::isfinite(p) ? fmt::format("{:.4f}", p) : ""});
  }
  return table;
}

std::vector<BoxRow> Rows(const std::vector<Probe>& probes) {
  std::vector<BoxRow> rows;
  for (const Probe& probe : probes) {
    rows.push_back({probe.label, probe.Ranks()});
  }
  return rows;
}

ReportSection SectionBy(const std::string& measure, const std::string& words,
                        const StudyResults& results, const std::vector<Treatment>& ranked,
                        int gallery) {
  ReportSection section{.heading = fmt::format("Identification by {}", words)};
  const std::vector<Probe> probes = ProbesBy(measure, results, ranked);
  if (probes.size() < 2) {
    return section;
  }
  section.images = {
      {CumulativePlotSvg(Rows(probes), "rank of the right person"),
       "Cumulative match characteristic: share of faces whose person is among the first so many.",
       fmt::format("cumulative match characteristic by {}, with ceiling and floor", words)}};
  section.tables = {TableOf(probes, gallery)};
  return section;
}

// What a gallery of this size can say.
std::string GalleryWords(int gallery) {
  constexpr int kSmall = 100;
  const std::string size = fmt::format("The gallery holds {} people.", gallery);
  return gallery >= kSmall
             ? size
             : size + fmt::format(
                          " It is small: by chance {:.0f} % of the faces would come first, and "
                          "nothing follows for a gallery of hundreds.",
                          100.0 / gallery);
}

int GalleryOf(const StudyResults& results) {
  for (const TrialRow& row : results.trials) {
    if (const auto it = row.metrics.find("identify.gallery"); it != row.metrics.end()) {
      return static_cast<int>(it->second);
    }
  }
  return 0;
}

}  // namespace

std::vector<ReportSection> IdentifySections(const StudyResults& results,
                                            const std::vector<Treatment>& ranked) {
  const int gallery = GalleryOf(results);
  if (gallery == 0 || ranked.empty()) {
    return {};
  }
  std::vector<ReportSection> sections = {
      SectionBy("surface", "the surface after alignment", results, ranked, gallery),
      SectionBy("landmarks", "the configuration of landmarks", results, ranked, gallery)};
  sections.front().paragraphs = {GalleryWords(gallery)};
  return sections;
}

}  // namespace semblance
