// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/volumes/header_place.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <map>

#include "surfaces/base/error.h"
#include "surfaces/base/lower_case.h"
#include "surfaces/mesh_files/text_lines.h"

namespace semblance {
namespace {

// ---------------------------------------------------------------------------------------------
// Lines of a header
// ---------------------------------------------------------------------------------------------

// Values by their names in lower case; the first of each name.
using HeaderLines = std::map<std::string, std::string>;

std::string_view Trimmed(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r\n";
  text.remove_prefix(std::min(text.size(), text.find_first_not_of(kBlanks)));
  return text.substr(0, text.find_last_not_of(kBlanks) + 1);
}

// Up to a line that is `last`, or whose name is.
HeaderLines LinesOf(std::string_view head, std::string_view sign, std::string_view last) {
  HeaderLines lines;
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
      lines.emplace(LowerCase(std::string(name)), Trimmed(line.substr(at + sign.size())));
    }
  }
  return lines;
}

// Empty where there is no such line.
std::string ValueOf(const HeaderLines& lines, const std::string& name) {
  const auto line = lines.find(name);
  return line == lines.end() ? "" : line->second;
}

// ---------------------------------------------------------------------------------------------
// Units
// ---------------------------------------------------------------------------------------------

std::optional<double> MmPer(const std::string& unit) {
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

// The unit of all lengths; nothing is said by an empty one.
void TakeUnit(const std::string& unit, HeaderPlace& place) {
  const std::optional<double> mm = unit.empty() ? 1 : MmPer(unit);
  place.to_mm = mm.value_or(1);
  if (!mm) {
    place.notes.push_back(fmt::format(
        "the file's lengths are in '{}', which is not known here; taken as mm", Shown(unit)));
  } else if (*mm != 1) {
    place.notes.push_back(
        fmt::format("the file's lengths are in {}; multiplied by {} to mm", unit, *mm));
  }
}

// Of what stands between quotation marks, as "cm" "cm" "cm", what is not empty; once if all is
// alike. The axis of time, behind those of space, does not count.
std::string UnitOf(const std::string& quoted) {
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
  const bool alike = std::ranges::adjacent_find(units, std::ranges::not_equal_to()) == units.end();
  units.resize(alike ? std::min<std::size_t>(units.size(), 1) : units.size());
  return fmt::format("{}", fmt::join(units, ", "));
}

// ---------------------------------------------------------------------------------------------
// NRRD
// ---------------------------------------------------------------------------------------------

struct NrrdSpace {
  std::string_view name, short_name;
  std::array<double, 3> to_lps;
  bool tells_sides;  // which way left, back and up are
};
constexpr std::array kSpaces = {
    NrrdSpace{"left-posterior-superior", "lps", {1, 1, 1}, true},
    NrrdSpace{"right-anterior-superior", "ras", {-1, -1, 1}, true},
    NrrdSpace{"left-anterior-superior", "las", {1, -1, 1}, true},
    NrrdSpace{"left-posterior-superior-time", "lpst", {1, 1, 1}, true},
    NrrdSpace{"right-anterior-superior-time", "rast", {-1, -1, 1}, true},
    NrrdSpace{"left-anterior-superior-time", "last", {1, -1, 1}, true},
    // Of a patient on the back, head first, as LPS.
    NrrdSpace{"scanner-xyz", "", {1, 1, 1}, false},
    NrrdSpace{"scanner-xyz-time", "", {1, 1, 1}, false},
    NrrdSpace{"3d-right-handed", "", {1, 1, 1}, false},
    NrrdSpace{"3d-right-handed-time", "", {1, 1, 1}, false},
};
constexpr std::string_view kSidesInWords =
    "right-anterior-superior (RAS), left-anterior-superior (LAS) or left-posterior-superior (LPS)";

const NrrdSpace& SpaceOf(const std::string& space, const std::string& where) {
  const std::string lower = LowerCase(space);
  for (const NrrdSpace& known : kSpaces) {
    if (lower == known.name || lower == known.short_name) {
      return known;
    }
  }
  if (lower.starts_with("3d-left-handed")) {
    throw InputError(fmt::format(
        "{}: its space, {}, does not tell left from right, and taken as LPS the head would be a "
        "mirror image; write {} into its header",
        where, Shown(space), kSidesInWords));
  }
  throw InputError(fmt::format("{}: '{}' is not a space of NRRD; it must be {}", where,
                               Shown(space), kSidesInWords));
}

// The numbers within each pair of brackets, "(1,0,0) none (0,1,0)", the first three of each.
std::vector<Vec3> VectorsOf(const std::string& text, const std::string& where) {
  std::vector<Vec3> vectors;
  for (std::size_t at = text.find('('); at != text.npos; at = text.find('(', at + 1)) {
    const char* rest = text.c_str() + at;
    Vec3 vector;
    for (int a = 0; a < 3; ++a) {
      char* end = nullptr;
      vector[a] = std::strtod(rest + 1, &end);
      end += std::strspn(end, " \t");
      const bool parted = *end == ',' || (a == 2 && *end == ')');
      if (!parted) {
        throw InputError(
            fmt::format("{}: '{}' in its header are no vectors of three numbers; export it again",
                        where, Shown(text)));
      }
      rest = end;
    }
    vectors.push_back(vector);
  }
  return vectors;
}

void TakeSteps(const HeaderLines& lines, const NrrdSpace* space, const std::string& where,
               HeaderPlace& place) {
  std::vector<Vec3> steps = VectorsOf(ValueOf(lines, "space directions"), where);
  if (steps.empty()) {
    return;
  }
  if (space && space->name.ends_with("-time") && steps.size() == 4) {
    steps.pop_back();
  }
  const std::vector<Vec3> origin = VectorsOf(ValueOf(lines, "space origin"), where);
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

void NoteWhatIsOpen(const HeaderLines& lines, const NrrdSpace* space, HeaderPlace& place) {
  const std::string name = ValueOf(lines, "space");
  if (space && space->tells_sides && place.steps) {
    return;
  }
  const std::string why = !space         ? "its header has no 'space'"
                          : !place.steps ? "its header has no 'space directions'"
                                         : fmt::format("its space is {}", name);
  const bool has_spacing = place.steps || lines.contains("spacings");
  place.notes.push_back(fmt::format("the file does not say how it lies ({}); taken as LPS{}", why,
                                    has_spacing ? "" : ", its voxels 1 mm apart"));
}

}  // namespace

HeaderPlace PlaceOfNrrd(std::string_view head, const std::string& where) {
  const HeaderLines lines = LinesOf(head, ": ", "");
  const std::string name = ValueOf(lines, "space");
  const NrrdSpace* const space = name.empty() ? nullptr : &SpaceOf(name, where);
  HeaderPlace place;
  TakeSteps(lines, space, where, place);
  TakeUnit(UnitOf(ValueOf(lines, lines.contains("space units") ? "space units" : "units")), place);
  NoteWhatIsOpen(lines, space, place);
  return place;
}

HeaderPlace PlaceOfMetaImage(std::string_view head) {
  const HeaderLines lines = LinesOf(head, "=", "ElementDataFile");
  HeaderPlace place;
  const std::string unit = ValueOf(lines, "distanceunits");
  TakeUnit(unit == "?" ? "" : unit, place);
  if (!lines.contains("transformmatrix") && !lines.contains("rotation") &&
      !lines.contains("orientation")) {
    place.notes.emplace_back(
        "the file does not say how it lies (its header has no 'TransformMatrix'); taken as LPS");
  }
  return place;
}

void TakePlace(const HeaderPlace& place, VoxelArray& array) {
  if (place.steps) {
    array.steps = *place.steps;
    array.origin = place.origin;
  }
  array.steps *= place.to_mm;
  array.origin *= place.to_mm;
  array.notes.insert(array.notes.end(), place.notes.begin(), place.notes.end());
}

}  // namespace semblance
