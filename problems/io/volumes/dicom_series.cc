// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/volumes/dicom_series.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "surfaces/base/error.h"
#include "surfaces/base/quantile.h"

namespace semblance::problems {
namespace {

constexpr std::size_t kMinHeadSlices = 8;  // scout images have fewer

bool SameSlices(const DicomHeader& a, const DicomHeader& b) {
  // Differences that come from rounding in the headers.
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

std::string SeriesNumber(const DicomHeader& header) {
  return header.series_number.empty() ? "-" : header.series_number;
}

// Names each series by its number. Series that share a number get ":1", ":2" ... after it.
void NameSeries(std::vector<DicomSeries>& all) {
  std::map<std::string, int> count, seen;
  for (const DicomSeries& series : all) {
    ++count[SeriesNumber(series.First())];
  }
  for (DicomSeries& series : all) {
    const std::string number = SeriesNumber(series.First());
    series.name = count[number] == 1 ? number : fmt::format("{}:{}", number, ++seen[number]);
  }
}

void NoteUnusedImages(const std::vector<DicomHeader>& headers, std::vector<std::string>& notes) {
  const auto unplaced = std::ranges::count_if(
      headers, [](const auto& h) { return IsImage(h) && h.frames == 1 && !HasPosition(h); });
  const auto many = std::ranges::count_if(headers, [](const auto& h) { return h.frames > 1; });
  if (unplaced > 0) {
    notes.push_back(fmt::format("{} images without a position or orientation left out", unplaced));
  }
  if (many > 0) {
    notes.push_back(fmt::format(
        "{} files with several images each (enhanced CT) left out; save each slice as a file of "
        "its own, or all as NIfTI",
        many));
  }
}

bool CanBeHead(const DicomSeries& series) {
  const std::string& modality = series.First().modality;
  return (modality == "CT" || modality == "MR") && series.slices.size() >= kMinHeadSlices;
}

bool Matches(const std::string& wanted, const DicomSeries& series) {
  return wanted.empty() || series.name == wanted || SeriesNumber(series.First()) == wanted ||
         series.First().series_uid == wanted;
}

std::string ListSeries(const std::vector<const DicomSeries*>& some) {
  std::string list;
  for (const DicomSeries* series : some) {
    list += fmt::format("\n  {}", DescribeSeries(*series));
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
  NoteUnusedImages(headers, notes);
  return all;
}

std::string DescribeSeries(const DicomSeries& series) {
  const DicomHeader& first = series.First();
  return fmt::format("{}: {}, {} slices of {} x {}, '{}', UID {}", series.name,
                     first.modality.empty() ? "no modality" : first.modality, series.slices.size(),
                     first.columns, first.rows, first.description, first.series_uid);
}

const DicomSeries& ChooseSeries(const std::vector<DicomSeries>& all, const std::string& wanted,
                                const std::string& where, std::vector<std::string>& notes) {
  std::vector<const DicomSeries*> fitting, heads;
  for (const DicomSeries* series : Pointers(all)) {
    if (Matches(wanted, *series)) {
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
        wanted.empty()
            ? fmt::format("no series is CT or MR with at least {} slices", kMinHeadSlices)
            : fmt::format("no series is called '{}'", wanted),
        ListSeries(Pointers(all))));
  }
  if (fitting.size() > 1) {
    throw InputError(
        fmt::format("{}: {} series; choose one by its number or UID (--series, or series: under "
                    "subject):{}",
                    where, fitting.size(), ListSeries(fitting)));
  }
  for (const DicomSeries* series : Pointers(all)) {
    if (series != fitting.front()) {
      notes.push_back(fmt::format("series left out: {}", DescribeSeries(*series)));
    }
  }
  return *fitting.front();
}

// ---------------------------------------------------------------------------------------------
// The stack of slices
// ---------------------------------------------------------------------------------------------

namespace {

constexpr double kSamePlace_mm = 0.02;  // nearer slices are doubles
// A slice may be off its regular place by this share of a step, or by this distance if that is
// more. Larger values accept uneven stacks and bend the head; smaller ones refuse rounded
// positions.
constexpr double kMaxOffShare = 0.1;
constexpr double kAlwaysAllowedOff_mm = 0.1;
constexpr double kMaxSteps = 1e4;  // between neighbours; keeps the number within an int

// Lists at most four of the items, and the number of the others.
std::string ListFirst(const std::vector<std::string>& items) {
  constexpr std::size_t kMaxListed = 4;
  if (items.size() <= kMaxListed) {
    return fmt::format("{}", fmt::join(items, ", "));
  }
  return fmt::format("{} and {} more", fmt::join(items.begin(), items.begin() + kMaxListed, ", "),
                     items.size() - kMaxListed);
}

// A slice and its height along the normal.
struct Level {
  int slice = -1;
  double height_mm = kNaN;
};

std::vector<Level> SortedLevels(std::span<const Vec3> positions, const Vec3& normal) {
  std::vector<Level> levels;
  for (const Vec3& p : positions) {
    levels.push_back({static_cast<int>(levels.size()), p.dot(normal)});
  }
  std::ranges::stable_sort(levels, {}, &Level::height_mm);
  return levels;
}

// Keeps the first slice at each place. Doubled slices are an error unless options.fill is set.
std::vector<Level> RemoveDoubles(const std::vector<Level>& levels,
                                 std::span<const std::string> names, const StackOptions& options,
                                 const std::string& where, std::vector<std::string>& notes) {
  std::vector<Level> kept;
  std::vector<std::string> doubles;
  for (const Level& level : levels) {
    if (kept.empty() || level.height_mm - kept.back().height_mm > kSamePlace_mm) {
      kept.push_back(level);
    } else {
      doubles.push_back(fmt::format("{:.2f} mm ({} and {})", level.height_mm,
                                    names[kept.back().slice], names[level.slice]));
    }
  }
  if (!doubles.empty() && !options.fill) {
    throw InputError(fmt::format(
        "{}: {} doubled slices, at {} along the normal: the series holds two scans or copies; "
        "remove one of each pair, or set fill_slices, which uses the first",
        where, doubles.size(), ListFirst(doubles)));
  }
  if (!doubles.empty()) {
    notes.push_back(fmt::format("{} doubled slices, the first of each pair is used: at {}",
                                doubles.size(), ListFirst(doubles)));
  }
  return kept;
}

double MedianStep(const std::vector<Level>& levels) {
  std::vector<double> steps;
  for (std::size_t k = 1; k < levels.size(); ++k) {
    steps.push_back(levels[k].height_mm - levels[k - 1].height_mm);
  }
  return UpperMedian(steps);
}

// Assigns each level a place in a regular stack.
std::vector<int> FindPlaces(const std::vector<Level>& levels, const std::string& where) {
  const double step = MedianStep(levels);
  std::vector<int> places = {0};
  std::vector<std::string> odd;
  for (std::size_t k = 1; k < levels.size(); ++k) {
    const double apart = (levels[k].height_mm - levels[k - 1].height_mm) / step;
    const int steps = static_cast<int>(std::lround(std::clamp(apart, 1.0, kMaxSteps)));
    places.push_back(places.back() + steps);
    if (std::abs(apart - steps) > std::max(kMaxOffShare, kAlwaysAllowedOff_mm / step)) {
      odd.push_back(
          fmt::format("{:.2f} to {:.2f} mm", levels[k - 1].height_mm, levels[k].height_mm));
    }
  }
  if (!odd.empty()) {
    throw InputError(fmt::format(
        "{}: the slices are not at equal distances: most are {:.2f} mm apart, but not those at {} "
        "along the normal; export the series again, resampled to equal distances",
        where, step, ListFirst(odd)));
  }
  return places;
}

// Notes the gaps. They are errors unless options.fill is set and they are short.
void CheckGaps(const std::vector<Level>& levels, const std::vector<int>& places,
               const StackOptions& options, const std::string& where,
               std::vector<std::string>& notes) {
  std::vector<std::string> gaps;
  double longest_mm = 0;
  int missing = 0;
  for (std::size_t k = 1; k < levels.size(); ++k) {
    if (places[k] - places[k - 1] > 1) {
      const double low = levels[k - 1].height_mm, high = levels[k].height_mm;
      gaps.push_back(fmt::format("between {:.2f} and {:.2f} mm", low, high));
      longest_mm = std::max(longest_mm, high - low);
      missing += places[k] - places[k - 1] - 1;
    }
  }
  if (gaps.empty()) {
    return;
  }
  const std::string what =
      fmt::format("{} missing slices, {} along the normal", missing, ListFirst(gaps));
  if (!options.fill) {
    throw InputError(fmt::format(
        "{}: {}; add their files, or set fill_slices, which interpolates them", where, what));
  }
  if (longest_mm > options.longest_fill_mm) {
    throw InputError(fmt::format(
        "{}: {}; the longest gap is {:.1f} mm, and at most {} mm are filled; add the files", where,
        what, longest_mm, options.longest_fill_mm));
  }
  notes.push_back(fmt::format("{}: interpolated", what));
}

// Throws InputError if slices are off the straight line from the first to the last.
void CheckStraight(std::span<const Vec3> positions, const std::vector<Level>& levels,
                   const std::vector<int>& places, const SliceStack& stack,
                   std::span<const std::string> names, const std::string& where) {
  const double allowed_mm = std::max(kAlwaysAllowedOff_mm, kMaxOffShare * stack.step.norm());
  std::vector<std::string> aside;
  for (std::size_t k = 0; k < levels.size(); ++k) {
    const Vec3 expected = stack.origin + places[k] * stack.step;
    const double off = (positions[levels[k].slice] - expected).norm();
    if (off > allowed_mm) {
      aside.push_back(fmt::format("{} by {:.2f} mm", names[levels[k].slice], off));
    }
  }
  if (!aside.empty()) {
    throw InputError(
        fmt::format("{}: {} slices lie off the line from the first to the last: {}; the table or "
                    "the field of view moved: choose a series of one scan",
                    where, aside.size(), ListFirst(aside)));
  }
}

}  // namespace

SliceStack StackSlices(std::span<const Vec3> positions, const Vec3& normal,
                       std::span<const std::string> names, const StackOptions& options,
                       const std::string& where) {
  SliceStack stack;
  const std::vector<Level> levels =
      RemoveDoubles(SortedLevels(positions, normal), names, options, where, stack.notes);
  if (levels.size() < 2) {
    throw InputError(
        fmt::format("{}: {} slices are not a volume; it needs at least 2", where, levels.size()));
  }
  const std::vector<int> places = FindPlaces(levels, where);
  CheckGaps(levels, places, options, where, stack.notes);
  stack.origin = positions[levels.front().slice];
  stack.step = (positions[levels.back().slice] - stack.origin) / places.back();
  CheckStraight(positions, levels, places, stack, names, where);
  stack.slices.assign(places.back() + 1, -1);
  for (std::size_t k = 0; k < levels.size(); ++k) {
    stack.slices[places[k]] = levels[k].slice;
  }
  return stack;
}

double TiltDeg(const SliceStack& stack, const Vec3& normal) {
  const double cosine = std::clamp(stack.step.normalized().dot(normal), -1.0, 1.0);
  return std::acos(cosine) * 180 / std::numbers::pi;
}

}  // namespace semblance::problems
