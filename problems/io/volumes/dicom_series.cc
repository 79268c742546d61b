// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/volumes/dicom_series.h"

#include <fmt/format.h>
#include <iconv.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <memory>
#include <numbers>
#include <sstream>
#include <string_view>
#include <utility>

#include "problems/io/volumes/volume_headers.h"
#include "surfaces/base/error.h"
#include "surfaces/base/lower_case.h"
#include "surfaces/base/quantile.h"
#include "surfaces/mesh_files/text_lines.h"

namespace semblance::problems {
// ---------------------------------------------------------------------------------------------
// Texts and numbers of tags
// ---------------------------------------------------------------------------------------------

namespace {

std::vector<std::string> SplitValues(const std::string& text) {
  std::vector<std::string> values;
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, '\\');) {
    values.push_back(part);
  }
  return values;
}

// The name that iconv has for a character set of DICOM (PS3.3, C.12.1.1.2).
const char* IconvName(const std::string& characters) {
  struct CharacterSet {
    std::string_view ends;  // of DICOM's name, which begins with "ISO_IR" or "ISO 2022 IR"
    const char* iconv;
  };
  constexpr std::array kSets = {
      CharacterSet{"IR 100", "ISO-8859-1"},   CharacterSet{"IR 101", "ISO-8859-2"},
      CharacterSet{"IR 109", "ISO-8859-3"},   CharacterSet{"IR 110", "ISO-8859-4"},
      CharacterSet{"IR 144", "ISO-8859-5"},   CharacterSet{"IR 127", "ISO-8859-6"},
      CharacterSet{"IR 126", "ISO-8859-7"},   CharacterSet{"IR 138", "ISO-8859-8"},
      CharacterSet{"IR 148", "ISO-8859-9"},   CharacterSet{"IR 203", "ISO-8859-15"},
      CharacterSet{"IR 166", "TIS-620"},      CharacterSet{"IR 13", "SHIFT_JIS"},
      CharacterSet{"IR 87", "ISO-2022-JP-2"}, CharacterSet{"IR 159", "ISO-2022-JP-2"},
      CharacterSet{"IR 149", "EUC-KR"},       CharacterSet{"IR 58", "GB18030"},
      CharacterSet{"GB18030", "GB18030"},     CharacterSet{"GBK", "GBK"},
  };
  // The last set is that of the names; the first may be empty, which is ASCII.
  const std::vector<std::string> values = SplitValues(characters);
  std::string last = values.empty() ? "" : values.back();
  std::ranges::replace(last, '_', ' ');
  for (const CharacterSet& set : kSets) {
    if (last.ends_with(set.ends)) {
      return set.iconv;
    }
  }
  return "ISO-8859-1";  // not stated, or ASCII: most such texts are of Western Europe
}

// Removes the escapes that announce a character set, except for Japanese, where iconv needs them.
std::string WithoutEscapes(const std::string& text, std::string_view iconv_name) {
  if (iconv_name.starts_with("ISO-2022")) {
    return text;
  }
  std::string plain;
  for (std::size_t k = 0; k < text.size(); ++k) {
    if (text[k] == '\x1b') {  // ESC, then signs from ' ' to '/', then a letter or digit
      while (k + 1 < text.size() && text[k + 1] >= ' ' && text[k + 1] <= '/') {
        ++k;
      }
      ++k;
    } else {
      plain.push_back(text[k]);
    }
  }
  return plain;
}

// Converts a text to UTF-8; '?' stands for each byte that cannot be converted.
std::string Convert(const std::string& text, const char* from) {
  const iconv_t converter = ::iconv_open("UTF-8", from);
  // NOLINTNEXTLINE(performance-no-int-to-ptr): the value that iconv_open returns for an error
  if (converter == reinterpret_cast<iconv_t>(-1)) {
    std::string ascii = text;
    std::ranges::replace_if(
        ascii, [](unsigned char c) { return c >= 0x80; }, '?');
    return ascii;
  }
  std::string in = text, result;
  char* rest = in.data();
  std::size_t left = in.size();
  while (left > 0) {
    std::array<char, 256> block{};
    char* out = block.data();
    std::size_t space = block.size();
    const std::size_t before = left;
    const bool is_done =
        ::iconv(converter, &rest, &left, &out, &space) != static_cast<std::size_t>(-1);
    result.append(block.data(), block.size() - space);
    if (!is_done && left == before && left > 0) {  // a byte that cannot be converted
      result.push_back('?');
      ++rest;
      --left;
    }
  }
  ::iconv_close(converter);
  return result;
}

// Replaces control characters, U+0000 to U+001F and U+007F to U+009F, by '?' in UTF-8.
std::string WithoutControls(const std::string& utf8) {
  std::string clean;
  for (std::size_t k = 0; k < utf8.size(); ++k) {
    const auto c = static_cast<unsigned char>(utf8[k]);
    const auto next = k + 1 < utf8.size() ? static_cast<unsigned char>(utf8[k + 1]) : 0U;
    const bool is_latin = c == 0xC2 && next >= 0x80 && next < 0xA0;
    clean.push_back(is_latin || c < 0x20 || c == 0x7F ? '?' : utf8[k]);
    k += is_latin ? 1 : 0;
  }
  return clean;
}

}  // namespace

Decimals ParseDecimals(const std::string& text) {
  Decimals decimals;
  for (std::string part : SplitValues(text)) {
    if (std::ranges::count(part, ',') == 1 && part.find('.') == part.npos) {
      std::ranges::replace(part, ',', '.');
      decimals.has_comma = true;
    }
    const std::optional<double> number = ParseNumber(part);
    if (!number) {
      return {};
    }
    decimals.numbers.push_back(*number);
  }
  return decimals;
}

std::string DicomTextToUtf8(const std::string& text, const std::string& characters) {
  // Many programs write UTF-8 without stating it. Other texts with letters beyond ASCII are hardly
  // ever valid UTF-8. A text with escapes is ASCII to this test.
  const bool is_utf8 = characters.ends_with("IR 192") ||
                       (text.find('\x1b') == text.npos && Convert(text, "UTF-8") == text);
  const char* const from = is_utf8 ? "UTF-8" : IconvName(characters);
  return WithoutControls(Convert(WithoutEscapes(text, from), from));
}

std::string CleanDicomText(const std::string& text) { return Shown(text); }

void AddWords(const std::string& words, std::string& list) {
  list += (list.empty() || words.empty() ? "" : ", ") + words;
}

void CheckSlicePlace(DicomHeader& header) {
  constexpr double kRounding = 0.02;  // of directions with two decimals
  if (header.along_columns && header.along_rows) {
    Vec3 &x = *header.along_columns, &y = *header.along_rows;
    if (std::abs(x.norm() - 1) > kRounding || std::abs(y.norm() - 1) > kRounding ||
        std::abs(x.dot(y)) > kRounding) {
      AddWords(fmt::format("{} does not hold two unit vectors at right angles", kOrientationTag),
               header.fault);
    }
    x.normalize();
    y.normalize();
  }
  if (header.spacing_mm && !(header.spacing_mm->minCoeff() >= kMinSpacing_mm &&
                             header.spacing_mm->maxCoeff() <= kMaxSpacing_mm)) {
    AddWords(
        fmt::format("{} is {} and {} mm, and each must be {} to {} mm", kSpacingTag,
                    header.spacing_mm->y(), header.spacing_mm->x(), kMinSpacing_mm, kMaxSpacing_mm),
        header.fault);
  }
}

// ---------------------------------------------------------------------------------------------
// Series
// ---------------------------------------------------------------------------------------------

namespace {

constexpr std::size_t kMinHeadSlices = 8;  // scout images have fewer

bool SameSlices(const DicomHeader& a, const DicomHeader& b) {
  // Differences that come from rounding in the headers: 0.1 deg, and 0.2 mm over 512 pixels.
  constexpr double kSameDirection = 1.75e-3, kSameSpacing_mm = 4e-4;
  return a.series_uid == b.series_uid && a.rows == b.rows && a.columns == b.columns &&
         (*a.along_columns - *b.along_columns).norm() < kSameDirection &&
         (*a.along_rows - *b.along_rows).norm() < kSameDirection &&
         (*a.spacing_mm - *b.spacing_mm).norm() < kSameSpacing_mm;
}

// Lists at most four of the items, and the number of the others.
std::string ListFirst(const std::vector<std::string>& items) {
  constexpr std::size_t kMaxListed = 4;
  if (items.size() <= kMaxListed) {
    return fmt::format("{}", fmt::join(items, ", "));
  }
  return fmt::format("{} and {} more", fmt::join(items.begin(), items.begin() + kMaxListed, ", "),
                     items.size() - kMaxListed);
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
  std::map<std::string, int> lacking;
  for (const DicomHeader& header : headers) {
    if (IsImage(header) && !header.lacking.empty()) {
      ++lacking[header.lacking];
    }
  }
  for (const auto& [tags, count] : lacking) {
    notes.push_back(fmt::format("{} images left out, because they lack {}", count, tags));
  }
}

bool IsScan(const DicomSeries& series) {
  const std::string& modality = series.First().modality;
  return modality == "CT" || modality == "MR";
}

// True for kinds in which cone-beam scanners and converters export volumes, and for none.
bool MayBeScan(const DicomSeries& series) {
  constexpr std::array<std::string_view, 6> kKinds = {"", "OT", "DX", "IO", "PX", "XA"};
  return std::ranges::count(kKinds, series.First().modality) > 0;
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

// Some programs that remove names give each slice a series UID of its own. Such slices get the UID
// of the first slice that has the same number, kind, description, patient and space.
std::vector<DicomHeader> WithCommonUids(std::vector<DicomHeader> headers,
                                        std::vector<std::string>& notes) {
  std::map<std::string, int> slices_of_uid;
  for (const DicomHeader& header : headers) {
    ++slices_of_uid[header.series_uid];
  }
  std::map<std::vector<std::string>, std::vector<DicomHeader*>> single;
  for (DicomHeader& header : headers) {
    if (slices_of_uid[header.series_uid] == 1) {
      single[{header.series_number, header.modality, header.description, header.patient_id,
              header.patient_name}]
          .push_back(&header);
    }
  }
  for (const auto& [tags, slices] : single) {
    if (slices.size() >= kMinHeadSlices) {
      notes.push_back(fmt::format(
          "{} slices have a series UID each, and agree in number, kind, description and patient; "
          "taken as one series",
          slices.size()));
      for (DicomHeader* const slice : slices) {
        slice->series_uid = slices.front()->series_uid;
      }
    }
  }
  return headers;
}

// The slices of one series may lie on several grids, as with a scout or a reformatted part. Keeps
// the grid with most slices if it has twice as many as each other one.
void KeepMainGrid(std::vector<const DicomSeries*>& grids) {
  if (grids.size() < 2) {
    return;
  }
  std::ranges::stable_sort(grids, std::ranges::greater{},
                           [](const DicomSeries* s) { return s->slices.size(); });
  const DicomSeries& most = *grids.front();
  const bool one_series = std::ranges::all_of(grids, [&](const DicomSeries* s) {
    return s->First().series_uid == most.First().series_uid;
  });
  if (one_series && most.slices.size() >= 2 * grids[1]->slices.size()) {
    grids.resize(1);
  }
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
  for (const DicomHeader& header : WithCommonUids(headers, notes)) {
    if (!IsImage(header) || !HasPosition(header)) {
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
  const auto filter = [](const std::vector<const DicomSeries*>& some, const auto& keep) {
    std::vector<const DicomSeries*> kept;
    std::ranges::copy_if(some, std::back_inserter(kept), [&](const auto* s) { return keep(*s); });
    return kept;
  };
  auto fitting = filter(Pointers(all), [&](const auto& s) { return Matches(wanted, s); });
  const auto large =
      filter(fitting, [](const auto& s) { return s.slices.size() >= kMinHeadSlices; });
  auto heads = filter(large, IsScan);
  if (heads.empty()) {
    heads = filter(large, MayBeScan);
  }
  if (wanted.empty() || (fitting.size() > 1 && heads.size() == 1)) {
    fitting = heads;
  }
  KeepMainGrid(fitting);
  if (fitting.empty()) {
    throw InputError(fmt::format(
        "{}: {}; the series are:{}", where,
        wanted.empty()
            ? fmt::format("no series is CT or MR with at least {} slices; if one of these is a "
                          "head, choose it by its number (--series, or series: under subject)",
                          kMinHeadSlices)
            : fmt::format("no series is called '{}'", CleanDicomText(wanted)),
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
  if (!IsScan(*fitting.front())) {
    notes.push_back(
        fmt::format("the modality of the series is '{}', neither CT nor MR; its values "
                    "are taken as Hounsfield units",
                    fitting.front()->First().modality));
  }
  return *fitting.front();
}

namespace {

std::string ImageName(const DicomHeader& header) {
  const std::string name = Shown(header.file.filename().string());
  return header.frames > 1 ? fmt::format("{} image {}", name, header.frame + 1) : name;
}

void RequireUsable(const DicomSeries& series, const std::vector<DicomHeader>& headers,
                   const std::string& where) {
  std::vector<std::string> faults;
  for (const DicomHeader& header : headers) {
    const bool belongs =
        header.series_uid.empty() || header.series_uid == series.First().series_uid;
    if (belongs && !header.fault.empty()) {
      faults.push_back(fmt::format("{} ({})", ImageName(header), header.fault));
    }
  }
  if (!faults.empty()) {
    throw InputError(fmt::format("{}: {} images cannot be used: {}; copy or export them again",
                                 where, faults.size(), ListFirst(faults)));
  }
}

// The images by their value of a text.
using ImagesByValue = std::map<std::string, std::vector<std::string>>;

// Throws InputError, naming the images with rare values, if there are several values.
void RequireOneValue(const ImagesByValue& images, const std::string& tag, const std::string& remedy,
                     const std::string& where) {
  const auto most =
      std::ranges::max_element(images, {}, [](const auto& value) { return value.second.size(); });
  std::vector<std::string> others;
  for (const auto& [value, names] : images) {
    if (value != most->first) {
      others.insert(others.end(), names.begin(), names.end());
    }
  }
  if (!others.empty()) {
    throw InputError(fmt::format("{}: {} slices differ from the others in {}: {}; {}", where,
                                 others.size(), tag, ListFirst(others), remedy));
  }
}

// Empty texts do not count, and neither do capitals and the signs that end a name.
ImagesByValue CollectValues(const DicomSeries& series, std::string DicomHeader::*member) {
  ImagesByValue images;
  for (const DicomHeader& slice : series.slices) {
    std::string value = LowerCase(slice.*member);
    value.erase(value.find_last_not_of(" ^") + 1);
    if (!value.empty()) {
      images[value].push_back(ImageName(slice));
    }
  }
  return images;
}

void RequireOnePerson(const DicomSeries& series, const std::string& where) {
  const char* const remedy = "they belong to another person: remove their files";
  RequireOneValue(CollectValues(series, &DicomHeader::patient_id), "Patient ID (0010,0020)", remedy,
                  where);
  RequireOneValue(CollectValues(series, &DicomHeader::patient_name), "Patient Name (0010,0010)",
                  remedy, where);
  RequireOneValue(CollectValues(series, &DicomHeader::birth_date), "Birth Date (0010,0030)", remedy,
                  where);
  const ImagesByValue spaces = CollectValues(series, &DicomHeader::space_uid);
  if (spaces.size() < series.slices.size()) {  // else a program that removes names made them
    RequireOneValue(spaces, "Frame of Reference UID (0020,0052)",
                    "their places cannot be compared with those of the others: remove their files",
                    where);
  }
}

// All slices have the number, or none does; in a CT, its slopes are equal.
void CheckRescale(const DicomSeries& series, double DicomHeader::*member, const std::string& tag,
                  const std::string& where, std::vector<std::string>& notes) {
  ImagesByValue present, values;
  for (const DicomHeader& slice : series.slices) {
    present[std::isnan(slice.*member) ? "no" : "yes"].push_back(ImageName(slice));
    values[fmt::format("{}", slice.*member)].push_back(ImageName(slice));
  }
  RequireOneValue(present, fmt::format("having a {} or none", tag),
                  "their values are not comparable: export the series again", where);
  if (series.First().modality != "CT") {
    return;
  }
  if (present.contains("no")) {
    notes.push_back(fmt::format("no slice has a {}, which a CT must have", tag));
  } else if (member == &DicomHeader::slope) {
    RequireOneValue(values, tag, "in a CT it is the same: export the series again", where);
  }
}

void NoteCommas(const DicomSeries& series, std::vector<std::string>& notes) {
  const auto with_comma = [](const DicomHeader& slice) { return !slice.comma.empty(); };
  const auto first = std::ranges::find_if(series.slices, with_comma);
  if (first != series.slices.end()) {
    notes.push_back(fmt::format(
        "{} slices have decimal commas in their numbers, such as {}; read as decimal points",
        std::ranges::count_if(series.slices, with_comma), first->comma));
  }
}

}  // namespace

void CheckSeries(const DicomSeries& series, const std::vector<DicomHeader>& headers,
                 const std::string& where, std::vector<std::string>& notes) {
  RequireUsable(series, headers, where);
  RequireOnePerson(series, where);
  CheckRescale(series, &DicomHeader::intercept, kInterceptTag, where, notes);
  CheckRescale(series, &DicomHeader::slope, kSlopeTag, where, notes);
  NoteCommas(series, notes);
}

// ---------------------------------------------------------------------------------------------
// The stack of slices
// ---------------------------------------------------------------------------------------------

namespace {

constexpr double kSamePlace_mm = 0.02;  // nearer slices are doubles
// A slice may be off its regular place by this share of a step, or by this distance if that is
// more. Larger values accept uneven stacks and bend the head; smaller ones interpolate stacks whose
// positions are merely rounded.
constexpr double kMaxOffShare = 0.1;
constexpr double kAlwaysAllowedOff_mm = 0.1;
constexpr double kMaxSteps = 1e4;  // between neighbours; keeps the number within an int

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

double Median(std::vector<double> values) { return UpperMedian(values); }

std::vector<double> Distances(const std::vector<Level>& levels) {
  std::vector<double> distances;
  for (std::size_t k = 1; k < levels.size(); ++k) {
    distances.push_back(levels[k].height_mm - levels[k - 1].height_mm);
  }
  return distances;
}

// The number of steps in each distance; empty if a distance is no multiple of the step.
std::vector<int> CountSteps(const std::vector<double>& distances, double step) {
  std::vector<int> counts;
  for (const double distance : distances) {
    const double steps = std::clamp(std::round(distance / step), 1.0, kMaxSteps);
    if (std::abs(distance / step - steps) > std::max(kMaxOffShare, kAlwaysAllowedOff_mm / step)) {
      return {};
    }
    counts.push_back(static_cast<int>(steps));
  }
  return counts;
}

// Unequal distances are counted in steps of 1, but for those that are about twice as long as both
// neighbours and most others: there a slice is missing.
std::vector<int> CountUnequalSteps(const std::vector<double>& distances) {
  constexpr double kMissing = 1.9;
  const double median = Median(distances);
  std::vector<int> counts;
  for (std::size_t k = 0; k < distances.size(); ++k) {
    const double below = k > 0 ? distances[k - 1] : 0;
    const double above = k + 1 < distances.size() ? distances[k + 1] : 0;
    counts.push_back(distances[k] > kMissing * std::max({below, above, median}) ? 2 : 1);
  }
  return counts;
}

// Notes the gaps. They are errors unless options.fill is set and they are short.
void CheckGaps(const std::vector<Level>& levels, const std::vector<int>& steps,
               const StackOptions& options, const std::string& where,
               std::vector<std::string>& notes) {
  std::vector<std::string> gaps;
  double longest_mm = 0;
  int missing = 0;
  for (std::size_t k = 1; k < levels.size(); ++k) {
    if (steps[k - 1] > 1) {
      const double low = levels[k - 1].height_mm, high = levels[k].height_mm;
      gaps.push_back(fmt::format("between {:.2f} and {:.2f} mm", low, high));
      longest_mm = std::max(longest_mm, high - low);
      missing += steps[k - 1] - 1;
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

// The places of slices at the given heights among the levels.
std::vector<double> PlacesAt(const std::vector<Level>& levels, int count) {
  const double low = levels.front().height_mm, high = levels.back().height_mm;
  std::vector<double> places;
  std::size_t below = 0;
  for (int k = 0; k < count; ++k) {
    const double height = low + (high - low) * k / (count - 1);
    while (below + 2 < levels.size() && levels[below + 1].height_mm <= height) {
      ++below;
    }
    const double from = levels[below].height_mm, to = levels[below + 1].height_mm;
    places.push_back(static_cast<double>(below) +
                     std::clamp((height - from) / (to - from), 0., 1.));
  }
  return places;
}

// Slices at equal distances that are interpolated between slices at unequal ones. The distance is
// about the shortest one that is frequent, so that no detail is lost.
std::vector<double> InterpolatedPlaces(const std::vector<Level>& levels,
                                       const std::vector<double>& distances,
                                       const StackOptions& options, const std::string& where,
                                       std::vector<std::string>& notes) {
  const auto [shortest, longest] = std::ranges::minmax(distances);
  if (longest > options.longest_fill_mm) {
    throw InputError(fmt::format(
        "{}: the slices are not at equal distances, {:.2f} to {:.2f} mm, and only distances up to "
        "{} mm are interpolated; export the series again, resampled to equal distances",
        where, shortest, longest, options.longest_fill_mm));
  }
  std::vector<double> sorted = distances;
  const double frequent = std::max(Quantile(sorted, 0.1), 0.25 * Median(distances));
  const double length = levels.back().height_mm - levels.front().height_mm;
  const int count = 1 + static_cast<int>(std::max(1.0, std::round(length / frequent)));
  notes.push_back(fmt::format(
      "the slices are not at equal distances, {:.2f} to {:.2f} mm: interpolated to {} slices at "
      "equal distances of {:.2f} mm",
      shortest, longest, count, length / (count - 1)));
  return PlacesAt(levels, count);
}

// The places of a regular stack: whole numbers, and fractions where slices are missing.
std::vector<double> RegularPlaces(const std::vector<int>& steps) {
  std::vector<double> places = {0};
  for (std::size_t k = 0; k < steps.size(); ++k) {
    for (int n = 1; n <= steps[k]; ++n) {
      places.push_back(static_cast<double>(k) + static_cast<double>(n) / steps[k]);
    }
  }
  return places;
}

// Throws InputError if slices are off the straight line from the first to the last.
void CheckStraight(std::span<const Vec3> positions, const std::vector<Level>& levels,
                   const SliceStack& stack, std::span<const std::string> names,
                   const std::string& where) {
  const double allowed_mm = std::max(kAlwaysAllowedOff_mm, kMaxOffShare * stack.step.norm());
  const double low = levels.front().height_mm, length = levels.back().height_mm - low;
  const Vec3 first = positions[levels.front().slice], last = positions[levels.back().slice];
  std::vector<std::string> aside;
  for (const Level& level : levels) {
    const Vec3 expected = first + (level.height_mm - low) / length * (last - first);
    const double off = (positions[level.slice] - expected).norm();
    if (off > allowed_mm) {
      aside.push_back(fmt::format("{} by {:.2f} mm", names[level.slice], off));
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
  const std::vector<double> distances = Distances(levels);
  const std::vector<int> steps = CountSteps(distances, Median(distances));
  const bool is_regular = !steps.empty();
  CheckGaps(levels, is_regular ? steps : CountUnequalSteps(distances), options, where, stack.notes);
  stack.places = is_regular ? RegularPlaces(steps)
                            : InterpolatedPlaces(levels, distances, options, where, stack.notes);
  stack.origin = positions[levels.front().slice];
  stack.step = (positions[levels.back().slice] - stack.origin) /
               static_cast<double>(stack.places.size() - 1);
  CheckStraight(positions, levels, stack, names, where);
  for (const Level& level : levels) {
    stack.scanned.push_back(level.slice);
  }
  return stack;
}

void NoteSliceTags(const DicomSeries& series, const SliceStack& stack, const Vec3& normal,
                   std::vector<std::string>& notes) {
  constexpr double kMuchThinner = 1.5, kNotedTilt_deg = 0.5;
  const DicomHeader& first = series.First();
  const double step_mm = stack.step.dot(normal);
  if (step_mm > kMuchThinner * first.thickness_mm) {
    notes.push_back(fmt::format(
        "the slices are {:.4g} mm thick and {:.4g} mm apart: some may be missing, and what lies "
        "between them is interpolated",
        first.thickness_mm, step_mm));
  }
  std::vector<double> numbers_apart;
  for (std::size_t k = 1; k < stack.scanned.size(); ++k) {
    numbers_apart.push_back(std::abs(series.slices[stack.scanned[k]].instance -
                                     series.slices[stack.scanned[k - 1]].instance));
  }
  const double numbers_step = Median(numbers_apart);
  if (numbers_step > 1) {
    notes.push_back(fmt::format(
        "the slices are numbered in steps of {} (Instance Number (0020,0013)): those between them "
        "may be missing",
        numbers_step));
  }
  const double cosine = std::clamp(stack.step.normalized().dot(normal), -1.0, 1.0);
  const double tilt_deg = std::acos(cosine) * 180 / std::numbers::pi;
  if (std::abs(first.tilt_deg) > kNotedTilt_deg && tilt_deg < kNotedTilt_deg) {
    notes.push_back(fmt::format(
        "Gantry/Detector Tilt (0018,1120) is {:.1f} deg, but the positions of the slices show no "
        "tilt: if the slices were not resampled, the head is slanted",
        first.tilt_deg));
  }
}

}  // namespace semblance::problems
