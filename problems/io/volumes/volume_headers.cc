// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/volumes/volume_headers.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "surfaces/base/error.h"
#include "surfaces/base/geometry.h"
#include "surfaces/base/lower_case.h"
#include "surfaces/mesh_files/text_lines.h"

namespace semblance::problems {
namespace {

// ---------------------------------------------------------------------------------------------
// Lines of a header
// ---------------------------------------------------------------------------------------------

struct HeaderLine {
  std::string name, value;
};

std::string_view Trimmed(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r\n";
  text.remove_prefix(std::min(text.size(), text.find_first_not_of(kBlanks)));
  return text.substr(0, text.find_last_not_of(kBlanks) + 1);
}

// Parses lines of the form NAME sign VALUE, up to a line whose name, or whole text, is `last`.
std::vector<HeaderLine> ParseLines(std::string_view head, std::string_view sign,
                                   std::string_view last) {
  std::vector<HeaderLine> lines;
  while (!head.empty()) {
    const std::size_t end = std::min(head.find('\n'), head.size() - 1);
    const std::string_view line = Trimmed(head.substr(0, end + 1));
    head.remove_prefix(end + 1);
    const std::size_t at = line.find(sign);
    const std::string_view name = Trimmed(line.substr(0, at));
    if (name == last) {
      return lines;
    }
    if (at != line.npos && !line.starts_with('#')) {
      lines.push_back({std::string(name), std::string(Trimmed(line.substr(at + sign.size())))});
    }
  }
  return lines;
}

// Values by names in lower case. If a name repeats, the first value counts.
using HeaderLines = std::map<std::string, std::string>;

// Empty if there is no such line.
std::string HeaderValue(const HeaderLines& lines, const std::string& name) {
  const auto line = lines.find(name);
  return line == lines.end() ? "" : line->second;
}

// ---------------------------------------------------------------------------------------------
// Units
// ---------------------------------------------------------------------------------------------

std::optional<double> MillimetresPer(const std::string& unit) {
  struct Unit {
    std::array<std::string_view, 4> words;
    double mm;
  };
  constexpr std::array kUnits = {
      Unit{{"mm", "millimeter", "millimetre", "millimeters"}, 1},
      Unit{{"cm", "centimeter", "centimetre", "centimeters"}, 10},
      Unit{{"m", "meter", "metre", "meters"}, 1000},
      Unit{{"um", "micrometer", "micron", "microns"}, 0.001},
      Unit{{"in", "inch", "inches", "\""}, 25.4},
  };
  for (const Unit& known : kUnits) {
    if (std::ranges::count(known.words, LowerCase(unit)) > 0) {
      return known.mm;
    }
  }
  return std::nullopt;
}

// Sets the unit of all lengths. An empty text means mm.
void SetUnit(const std::string& unit, HeaderPlace& place) {
  const std::optional<double> mm = unit.empty() ? 1 : MillimetresPer(unit);
  place.to_mm = mm.value_or(1);
  if (!mm) {
    place.notes.push_back(fmt::format(
        "the file's lengths are in '{}', which is an unknown unit; taken as mm", Shown(unit)));
  } else if (*mm != 1) {
    place.notes.push_back(
        fmt::format("the file's lengths are in {}; multiplied by {} to mm", unit, *mm));
  }
}

// Returns the unit of a list of quoted units such as "cm" "cm" "cm". Empty ones do not count; if
// they differ, all are returned. The axis of time, which follows those of space, is ignored.
std::string QuotedUnit(const std::string& quoted) {
  constexpr std::size_t kAxes = 3;
  std::vector<std::string> units;
  for (std::size_t from = quoted.find('"'); from != quoted.npos;) {
    const std::size_t to = quoted.find('"', from + 1);
    if (to == quoted.npos) {
      break;
    }
    if (to > from + 1 && units.size() < kAxes) {
      units.push_back(quoted.substr(from + 1, to - from - 1));
    }
    from = quoted.find('"', to + 1);
  }
  const bool all_equal =
      std::ranges::adjacent_find(units, std::ranges::not_equal_to()) == units.end();
  units.resize(all_equal ? std::min<std::size_t>(units.size(), 1) : units.size());
  return fmt::format("{}", fmt::join(units, ", "));
}

// ---------------------------------------------------------------------------------------------
// NRRD
// ---------------------------------------------------------------------------------------------

struct NrrdSpace {
  std::string_view name, short_name;
  std::array<double, 3> to_lps;
  bool names_sides;  // states the directions of left, back and up
};
constexpr std::array kSpaces = {
    NrrdSpace{"left-posterior-superior", "lps", {1, 1, 1}, true},
    NrrdSpace{"right-anterior-superior", "ras", {-1, -1, 1}, true},
    NrrdSpace{"left-anterior-superior", "las", {1, -1, 1}, true},
    NrrdSpace{"left-posterior-superior-time", "lpst", {1, 1, 1}, true},
    NrrdSpace{"right-anterior-superior-time", "rast", {-1, -1, 1}, true},
    NrrdSpace{"left-anterior-superior-time", "last", {1, -1, 1}, true},
    // For a patient on the back, head first, these are LPS.
    NrrdSpace{"scanner-xyz", "", {1, 1, 1}, false},
    NrrdSpace{"scanner-xyz-time", "", {1, 1, 1}, false},
    NrrdSpace{"3d-right-handed", "", {1, 1, 1}, false},
    NrrdSpace{"3d-right-handed-time", "", {1, 1, 1}, false},
};
constexpr std::string_view kSidesInWords =
    "right-anterior-superior (RAS), left-anterior-superior (LAS) or left-posterior-superior (LPS)";

const NrrdSpace& FindSpace(const std::string& space, const std::string& where) {
  const std::string lower = LowerCase(space);
  for (const NrrdSpace& known : kSpaces) {
    if (lower == known.name || lower == known.short_name) {
      return known;
    }
  }
  if (lower.starts_with("3d-left-handed")) {
    throw InputError(fmt::format(
        "{}: its space, {}, does not distinguish left from right, and taken as LPS the head would "
        "be a mirror image; write {} into its header",
        where, Shown(space), kSidesInWords));
  }
  throw InputError(fmt::format("{}: '{}' is not a space of NRRD; it must be {}", where,
                               Shown(space), kSidesInWords));
}

// Parses the vectors in brackets, e.g. "(1,0,0) none (0,1,0)"; the first three numbers of each.
std::vector<Vec3> ParseVectors(const std::string& text, const std::string& where) {
  std::vector<Vec3> vectors;
  for (std::size_t at = text.find('('); at != text.npos; at = text.find('(', at + 1)) {
    std::istringstream parts(text.substr(at + 1, text.find(')', at) - at - 1));
    Vec3& vector = vectors.emplace_back(Vec3::Constant(kNaN));
    std::string part;
    for (int a = 0; a < 3 && std::getline(parts, part, ','); ++a) {
      vector[a] = ParseNumber(part).value_or(kNaN);
    }
    if (!vector.allFinite()) {
      throw InputError(
          fmt::format("{}: '{}' in its header are not vectors of three numbers; export it again",
                      where, Shown(text)));
    }
  }
  return vectors;
}

void SetSteps(const HeaderLines& lines, const NrrdSpace* space, const std::string& where,
              HeaderPlace& place) {
  std::vector<Vec3> steps = ParseVectors(HeaderValue(lines, "space directions"), where);
  if (steps.empty()) {
    return;
  }
  if (space && space->name.ends_with("-time") && steps.size() == 4) {
    steps.pop_back();
  }
  const std::vector<Vec3> origin = ParseVectors(HeaderValue(lines, "space origin"), where);
  if (steps.size() != 3 || origin.size() > 1) {
    throw InputError(fmt::format("{}: {} space directions and {} origins; a volume has 3 and 1",
                                 where, steps.size(), origin.size()));
  }
  const Vec3 to_lps = space ? Vec3(space->to_lps.data()) : Vec3(Vec3::Ones());
  Mat3 in_space;
  in_space << steps[0], steps[1], steps[2];
  place.steps = Mat3(to_lps.asDiagonal() * in_space);
  place.origin = origin.empty() ? Vec3(Vec3::Zero()) : Vec3(to_lps.cwiseProduct(origin[0]));
}

void NoteAssumptions(const HeaderLines& lines, const NrrdSpace* space, HeaderPlace& place) {
  const std::string name = HeaderValue(lines, "space");
  if (space && space->names_sides && place.steps) {
    return;
  }
  const std::string why = !space         ? "its header has no 'space'"
                          : !place.steps ? "its header has no 'space directions'"
                                         : fmt::format("its space is {}", name);
  const bool has_spacing = place.steps || lines.contains("spacings");
  place.notes.push_back(fmt::format("the file does not state its orientation ({}); taken as LPS{}",
                                    why, has_spacing ? "" : ", its voxels 1 mm apart"));
}

// The library of NRRD reads each number up to its first odd character.
void CheckNrrdSpacings(const HeaderLines& lines, const std::string& where) {
  std::istringstream words(HeaderValue(lines, "spacings"));
  for (std::string word; words >> word;) {
    const std::optional<double> spacing = ParseNumber(word);
    const bool is_unknown = LowerCase(word) == "nan";  // of an axis that is not one of space
    if (!is_unknown && !(spacing && *spacing > 0)) {
      throw InputError(
          fmt::format("{}: '{}' among the spacings of its header is not a number > 0; "
                      "export it again",
                      where, Shown(word)));
    }
  }
}

// ---------------------------------------------------------------------------------------------
// MetaImage
// ---------------------------------------------------------------------------------------------

// Fields of numbers, and how many there are: 0: one per axis, -1: one per pair of axes.
struct MetaField {
  std::string_view name;
  int count;
};
constexpr std::array kMetaNumbers = {
    MetaField{"TransformMatrix", -1},
    MetaField{"Rotation", -1},
    MetaField{"Orientation", -1},
    MetaField{"Offset", 0},
    MetaField{"Position", 0},
    MetaField{"Origin", 0},
    MetaField{"CenterOfRotation", 0},
    MetaField{"ElementSpacing", 0},
    MetaField{"ElementSize", 0},
    MetaField{"DimSize", 0},
    MetaField{"NDims", 1},
    MetaField{"HeaderSize", 1},
    MetaField{"ElementNumberOfChannels", 1},
    MetaField{"ElementToIntensityFunctionSlope", 1},
    MetaField{"ElementToIntensityFunctionOffset", 1},
};
constexpr std::array<std::string_view, 9> kMetaTexts = {
    "BinaryData",         "BinaryDataByteOrderMSB", "ElementByteOrderMSB", "CompressedData",
    "CompressedDataSize", "AnatomicalOrientation",  "DistanceUnits",       "ElementType",
    "ElementDataFile"};

// MetaImage's name of the field that has this name but for capital letters; empty if there is none.
std::string_view MetaName(const std::string& name) {
  const auto same = [&](std::string_view known) {
    return LowerCase(std::string(known)) == LowerCase(name);
  };
  const auto number = std::ranges::find_if(kMetaNumbers, same, &MetaField::name);
  const auto text = std::ranges::find_if(kMetaTexts, same);
  return number != kMetaNumbers.end() ? number->name
         : text != kMetaTexts.end()   ? *text
                                      : std::string_view();
}

// The lines by their names. The library ignores names with other capital letters, and uses the last
// one of repeated fields.
HeaderLines ParseMetaImageLines(std::string_view head, const std::string& where) {
  HeaderLines lines;
  for (const HeaderLine& line : ParseLines(head, "=", "ElementDataFile")) {
    const std::string_view known = MetaName(line.name);
    if (!known.empty() && known != line.name) {
      throw InputError(fmt::format("{}: '{}' in its header is not a field of MetaImage; write '{}'",
                                   where, line.name, known));
    }
    if (!lines.emplace(line.name, line.value).second && !known.empty()) {
      throw InputError(
          fmt::format("{}: its header has {} twice; remove the wrong one", where, line.name));
    }
  }
  return lines;
}

// The library loops over as many axes as the header claims, without a limit. Returns 0 if the
// header does not state them, because the library reports what is missing.
int MetaImageAxes(const HeaderLines& lines, const std::string& where) {
  const std::string text = HeaderValue(lines, "NDims");
  constexpr double kMaxAxes = 10;  // the limit of the library
  const double axes = ParseNumber(text).value_or(kNaN);
  if (!text.empty() && !(axes >= 1 && axes <= kMaxAxes && axes == std::floor(axes))) {
    throw InputError(fmt::format("{}: NDims is not a number of axes; a volume has 3", where));
  }
  return text.empty() ? 0 : static_cast<int>(axes);
}

void CheckMetaImageNumbers(const std::string& name, const std::string& value, int axes,
                           const std::string& where) {
  const auto field = std::ranges::find(kMetaNumbers, name, &MetaField::name);
  if (field == kMetaNumbers.end() || axes == 0) {
    return;
  }
  const int expected = field->count == 0 ? axes : field->count < 0 ? axes * axes : field->count;
  int count = 0;
  bool are_numbers = true;
  std::istringstream words(value);
  for (std::string word; words >> word; ++count) {
    are_numbers = are_numbers && ParseNumber(word).has_value();
  }
  if (!are_numbers || count != expected) {
    throw InputError(fmt::format(
        "{}: {} in its header is '{}', which is not {} (with a decimal point); export it again",
        where, name, Shown(value),
        expected == 1 ? "a number" : fmt::format("{} numbers", expected)));
  }
}

// The library tests the first letter.
bool IsTrue(const std::string& value) {
  return value.starts_with('T') || value.starts_with('t') || value.starts_with('1');
}

// The library uses the last one of two fields for the order of bytes.
void CheckByteOrder(const HeaderLines& lines, const std::string& where) {
  const std::string binary = HeaderValue(lines, "BinaryDataByteOrderMSB"),
                    element = HeaderValue(lines, "ElementByteOrderMSB");
  if (!binary.empty() && !element.empty() && IsTrue(binary) != IsTrue(element)) {
    throw InputError(fmt::format(
        "{}: BinaryDataByteOrderMSB and ElementByteOrderMSB in its header contradict each other; "
        "remove the wrong one",
        where));
  }
}

// The library skips HeaderSize bytes from the beginning of the file also where the voxels follow
// the header, and reads nothing of compressed voxels without their size.
void CheckMetaImageData(const HeaderLines& lines, std::string_view head, const std::string& where) {
  const double skipped = ParseNumber(HeaderValue(lines, "HeaderSize")).value_or(0);
  const std::size_t data = head.find("ElementDataFile");  // ends the lines
  if (skipped > 0 && data != head.npos &&
      head.substr(data, head.find('\n', data) - data).find("LOCAL") != head.npos) {
    throw InputError(fmt::format(
        "{}: its header has HeaderSize = {} beside ElementDataFile = LOCAL, so the voxels would "
        "begin within the header; remove HeaderSize",
        where, skipped));
  }
  if (IsTrue(HeaderValue(lines, "CompressedData")) && !lines.contains("CompressedDataSize")) {
    throw InputError(fmt::format(
        "{}: its voxels are compressed, and its header lacks CompressedDataSize; add the number of "
        "bytes, or save the volume without compression",
        where));
  }
}

enum class AxisEnd { kFirst, kLast };

// The sides where the axes of a matrix begin, or end, such as RAI and LPS for the frame LPS.
std::string AxisLetters(const std::string& matrix, AxisEnd named) {
  constexpr std::array<std::string_view, 3> kBegin = {"RL", "AP", "IS"};  // of +x, -x and so on
  std::istringstream words(matrix);
  std::string letters;
  for (Vec3 axis; words >> axis.x() >> axis.y() >> axis.z();) {
    int main = 0;
    axis.cwiseAbs().maxCoeff(&main);
    letters += kBegin[main][(axis[main] < 0) != (named == AxisEnd::kLast) ? 1 : 0];
  }
  return letters;
}

// Notes letters that fit the matrix in neither of their two meanings.
void NoteContradictingLetters(const HeaderLines& lines, const std::string& matrix,
                              HeaderPlace& place) {
  const std::string letters = HeaderValue(lines, "AnatomicalOrientation");
  const std::string begin = AxisLetters(matrix, AxisEnd::kFirst),
                    end = AxisLetters(matrix, AxisEnd::kLast);
  if (letters.size() == 3 && letters.find('?') == letters.npos && letters != begin &&
      letters != end) {
    place.notes.push_back(fmt::format(
        "its AnatomicalOrientation is {}, but its TransformMatrix gives {}; the matrix is used: "
        "check where the front and the left side of the head are",
        Shown(letters), begin));
  }
}

// Notes a header without a matrix. AnatomicalOrientation cannot replace it, because programs
// disagree whether its letters name the side where an axis begins or ends; "RAI" and "LPS" mean the
// frame LPS in one of the two ways, and its direction is what a file without a matrix is taken as.
void CheckMetaImageOrientation(const HeaderLines& lines, const std::string& where,
                               HeaderPlace& place) {
  for (const char* const matrix : {"TransformMatrix", "Rotation", "Orientation"}) {
    if (lines.contains(matrix)) {
      NoteContradictingLetters(lines, HeaderValue(lines, matrix), place);
      return;
    }
  }
  const std::string letters = HeaderValue(lines, "AnatomicalOrientation");
  if (!letters.empty() && letters != "RAI" && letters != "LPS" && !letters.starts_with('?')) {
    throw InputError(fmt::format(
        "{}: its header has AnatomicalOrientation = {} but no TransformMatrix, which alone places "
        "the voxels; add it, e.g. TransformMatrix = 1 0 0 0 1 0 0 0 1 for columns to the left, "
        "rows to the back and slices upwards",
        where, Shown(letters)));
  }
  place.notes.emplace_back(
      "the file does not state its orientation (its header has no 'TransformMatrix'); taken as "
      "LPS");
}

}  // namespace

std::optional<double> ParseNumber(std::string_view text) {
  text = Trimmed(text);
  if (text.starts_with('+')) {  // from_chars rejects a plus sign
    text.remove_prefix(1);
  }
  double value = kNaN;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool is_whole = error == std::errc() && end == text.data() + text.size();
  return is_whole && std::isfinite(value) ? std::optional(value) : std::nullopt;
}

HeaderPlace ParseNrrdPlace(std::string_view head, const std::string& where) {
  HeaderLines lines;
  for (const HeaderLine& line : ParseLines(head, ": ", "")) {
    lines.emplace(LowerCase(line.name), line.value);
  }
  const std::string name = HeaderValue(lines, "space");
  const NrrdSpace* const space = name.empty() ? nullptr : &FindSpace(name, where);
  CheckNrrdSpacings(lines, where);
  HeaderPlace place;
  SetSteps(lines, space, where, place);
  SetUnit(QuotedUnit(HeaderValue(lines, lines.contains("space units") ? "space units" : "units")),
          place);
  NoteAssumptions(lines, space, place);
  return place;
}

HeaderPlace ParseMetaImagePlace(std::string_view head, const std::string& where) {
  const HeaderLines lines = ParseMetaImageLines(head, where);
  const int axes = MetaImageAxes(lines, where);
  for (const auto& [name, value] : lines) {
    CheckMetaImageNumbers(name, value, axes, where);
  }
  HeaderPlace place;
  const std::string unit = HeaderValue(lines, "DistanceUnits");
  SetUnit(unit == "?" ? "" : unit, place);
  place.slope = ParseNumber(HeaderValue(lines, "ElementToIntensityFunctionSlope")).value_or(1);
  place.intercept = ParseNumber(HeaderValue(lines, "ElementToIntensityFunctionOffset")).value_or(0);
  if (place.slope != 1 || place.intercept != 0) {
    place.notes.push_back(
        fmt::format("the values were multiplied by {} and {} was added, as its "
                    "ElementToIntensityFunctionSlope and -Offset state",
                    place.slope, place.intercept));
  }
  CheckByteOrder(lines, where);
  CheckMetaImageData(lines, head, where);
  CheckMetaImageOrientation(lines, where, place);
  return place;
}

bool IsCompressedMetaImage(std::string_view head) {
  for (const HeaderLine& line : ParseLines(head, "=", "ElementDataFile")) {
    if (line.name == "CompressedData") {
      return IsTrue(line.value);
    }
  }
  return false;
}

bool HasDetachedVoxels(const std::filesystem::path& file) {
  const std::string ending = file.extension().string();
  return ending == ".nhdr" || ending == ".mhd" || ending == ".hdr";
}

void ApplyPlace(const HeaderPlace& place, VoxelArray& array) {
  if (place.steps) {
    array.steps = *place.steps;
    array.origin = place.origin;
  }
  array.steps *= place.to_mm;
  array.origin *= place.to_mm;
  array.notes.insert(array.notes.end(), place.notes.begin(), place.notes.end());
}

}  // namespace semblance::problems
