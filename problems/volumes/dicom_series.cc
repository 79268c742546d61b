// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/volumes/dicom_series.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "surfaces/base/error.h"

namespace semblance {
namespace {

constexpr std::size_t kFewestSlices = 8;  // of a head; scouts have fewer

bool SameSlices(const DicomHeader& a, const DicomHeader& b) {
  constexpr double kSameDirection = 1e-3, kSameSpacing_mm = 1e-4;
  return a.series_uid == b.series_uid && a.rows == b.rows && a.columns == b.columns &&
         (*a.along_columns - *b.along_columns).norm() < kSameDirection &&
         (*a.along_rows - *b.along_rows).norm() < kSameDirection &&
         (*a.spacing_mm - *b.spacing_mm).norm() < kSameSpacing_mm;
}

bool IsImage(const DicomHeader& header) { return header.rows > 0 && header.columns > 0; }

bool HasPosition(const DicomHeader& header) {
  return header.position && header.along_columns && header.along_rows && header.spacing_mm;
}

std::string NumberOf(const DicomHeader& header) {
  return header.series_number.empty() ? "-" : header.series_number;
}

// Names by number; those that share one get ":1", ":2" ... behind it.
void NameSeries(std::vector<DicomSeries>& all) {
  std::map<std::string, int> count, seen;
  for (const DicomSeries& series : all) {
    ++count[NumberOf(series.First())];
  }
  for (DicomSeries& series : all) {
    const std::string number = NumberOf(series.First());
    series.name = count[number] == 1 ? number : fmt::format("{}:{}", number, ++seen[number]);
  }
}

void NoteLeftOut(const std::vector<DicomHeader>& headers, std::vector<std::string>& notes) {
  const auto unplaced = std::ranges::count_if(
      headers, [](const auto& h) { return IsImage(h) && h.frames == 1 && !HasPosition(h); });
  const auto many = std::ranges::count_if(headers, [](const auto& h) { return h.frames > 1; });
  if (unplaced > 0) {
    notes.push_back(fmt::format("{} images without a position or orientation left out", unplaced));
  }
  if (many > 0) {
    notes.push_back(fmt::format(
        "{} files with several images each (enhanced CT) left out; save them as one file per "
        "slice, or as NIfTI",
        many));
  }
}

bool CanBeHead(const DicomSeries& series) {
  const std::string& modality = series.First().modality;
  return (modality == "CT" || modality == "MR") && series.slices.size() >= kFewestSlices;
}

bool Means(const std::string& wanted, const DicomSeries& series) {
  return wanted.empty() || series.name == wanted || NumberOf(series.First()) == wanted ||
         series.First().series_uid == wanted;
}

std::string List(const std::vector<const DicomSeries*>& some) {
  std::string list;
  for (const DicomSeries* series : some) {
    list += fmt::format("\n  {}", InWords(*series));
  }
  return list;
}

std::vector<const DicomSeries*> Pointers(const std::vector<DicomSeries>& all) {
  std::vector<const DicomSeries*> pointers;
  pointers.reserve(all.size());
  for (const DicomSeries& series : all) {
    pointers.push_back(&series);
  }
  return pointers;
}

}  // namespace

std::vector<DicomSeries> GroupSeries(const std::vector<DicomHeader>& headers,
                                     std::vector<std::string>& notes) {
  std::vector<DicomSeries> all;
  for (const DicomHeader& header : headers) {
    if (!IsImage(header) || !HasPosition(header) || header.frames > 1) {
      continue;
    }
    const auto found = std::ranges::find_if(
        all, [&](const DicomSeries& series) { return SameSlices(series.First(), header); });
    (found == all.end() ? all.emplace_back() : *found).slices.push_back(header);
  }
  NameSeries(all);
  NoteLeftOut(headers, notes);
  return all;
}

std::string InWords(const DicomSeries& series) {
  const DicomHeader& first = series.First();
  return fmt::format("{}: {}, {} slices of {} x {}, '{}', UID {}", series.name,
                     first.modality.empty() ? "no modality" : first.modality, series.slices.size(),
                     first.columns, first.rows, first.description, first.series_uid);
}

const DicomSeries& ChooseSeries(const std::vector<DicomSeries>& all, const std::string& wanted,
                                const std::string& where, std::vector<std::string>& notes) {
  std::vector<const DicomSeries*> fitting, heads;
  for (const DicomSeries* series : Pointers(all)) {
    if (Means(wanted, *series)) {
      fitting.push_back(series);
      if (CanBeHead(*series)) {
        heads.push_back(series);
      }
    }
  }
  if (wanted.empty() || (fitting.size() > 1 && heads.size() == 1)) {
    fitting = heads;
  }
  if (fitting.empty()) {
    throw InputError(fmt::format(
        "{}: {}; the series are:{}", where,
        wanted.empty() ? fmt::format("no series is CT or MR with {} slices and more", kFewestSlices)
                       : fmt::format("no series is called '{}'", wanted),
        List(Pointers(all))));
  }
  if (fitting.size() > 1) {
    throw InputError(
        fmt::format("{}: {} series; choose one by its number or UID (--series, or series: under "
                    "subject):{}",
                    where, fitting.size(), List(fitting)));
  }
  for (const DicomSeries* series : Pointers(all)) {
    if (series != fitting.front()) {
      notes.push_back(fmt::format("series left out: {}", InWords(*series)));
    }
  }
  return *fitting.front();
}

}  // namespace semblance
