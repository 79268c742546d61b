// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/volumes/volume_headers.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "surfaces/base/encoding.h"
#include "surfaces/base/error.h"
#include "surfaces/base/geometry.h"
#include "surfaces/base/lower_case.h"
#include "surfaces/mesh_files/text_lines.h"

namespace semblance::problems {
namespace {

// ---------------------------------------------------------------------------------------------
// Lines of a header
// ---------------------------------------------------------------------------------------------

// Values by names in lower case. If a name repeats, the first value counts.
using HeaderLines = std::map<std::string, std::string>;

std::string_view Trimmed(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r\n";
  text.remove_prefix(std::min(text.size(), text.find_first_not_of(kBlanks)));
  return text.substr(0, text.find_last_not_of(kBlanks) + 1);
}

// Parses lines of the form NAME sign VALUE, up to a line whose name, or whole text, is `last`.
HeaderLines ParseHeaderLines(std::string_view head, std::string_view sign, std::string_view last) {
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
    const char* rest = text.c_str() + at;
    Vec3 vector;
    for (int a = 0; a < 3; ++a) {
      char* end = nullptr;
      vector[a] = std::strtod(rest + 1, &end);
      end += std::strspn(end, " \t");
      const bool is_separated = *end == ',' || (a == 2 && *end == ')');
      if (!is_separated) {
        throw InputError(
            fmt::format("{}: '{}' in its header are not vectors of three numbers; export it again",
                        where, Shown(text)));
      }
      rest = end;
    }
    vectors.push_back(vector);
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

// ---------------------------------------------------------------------------------------------
// NIfTI
// ---------------------------------------------------------------------------------------------

constexpr std::size_t kNiftiHeader_bytes = 348;

struct NiftiHeader {
  int datatype = -1;                     // NIfTI's code of the stored type of a voxel
  double voxels_at = kNaN;               // offset of the voxels, bytes
  int qform_code = -1, sform_code = -1;  // > 0: the header has a quaternion, a matrix
  std::array<float, 3> steps{};          // distance of voxels along each axis
  std::array<float, 6> quaternion{};     // and its offset
  std::array<float, 12> matrix{};        // rows
};

// Fewer bytes if the file ends before.
std::string ReadNiftiHeaderBytes(const std::filesystem::path& file) {
  std::string bytes;
  if (IsGzip(file)) {
    Unpack(file, [&](std::string_view block) {
      bytes += block.substr(0, kNiftiHeader_bytes - bytes.size());
      return bytes.size() < kNiftiHeader_bytes;
    });
    return bytes;
  }
  bytes.resize(kNiftiHeader_bytes);
  std::ifstream in(file, std::ios::binary);
  in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(in.gcount()));
  return bytes;
}

// A value of the header; `swapped` reverses its bytes.
template <class Value>
Value ValueAt(const std::string& header, std::size_t at, bool swapped) {
  std::array<char, sizeof(Value)> bytes{};
  std::memcpy(bytes.data(), header.data() + at, bytes.size());
  if (swapped) {
    std::ranges::reverse(bytes);
  }
  return std::bit_cast<Value>(bytes);
}

template <std::size_t count>
void ReadFloats(const std::string& header, std::size_t at, bool swapped,
                std::array<float, count>& values) {
  for (std::size_t k = 0; k < count; ++k) {
    values[k] = ValueAt<float>(header, at + sizeof(float) * k, swapped);
  }
}

// The stored size of a voxel; 0 for types other than one real number.
double NiftiVoxel_bytes(int datatype) {
  switch (datatype) {
    case 2:    // uint8
    case 256:  // int8
      return 1;
    case 4:    // int16
    case 512:  // uint16
      return 2;
    case 8:    // int32
    case 768:  // uint32
    case 16:   // float32
      return 4;
    case 1024:  // int64
    case 1280:  // uint64
    case 64:    // float64
      return 8;
    default:
      return 0;
  }
}

// Empty if the file is shorter than a header.
std::optional<NiftiHeader> ReadNiftiHeader(const std::filesystem::path& file) {
  const std::string bytes = ReadNiftiHeaderBytes(file);
  if (bytes.size() < kNiftiHeader_bytes) {
    return std::nullopt;
  }
  const bool swapped = ValueAt<std::int32_t>(bytes, 0, /*swapped=*/true) == kNiftiHeader_bytes;
  NiftiHeader header;
  header.datatype = ValueAt<std::int16_t>(bytes, 70, swapped);
  // If the stored offset is not a number, std::max returns the end of the header.
  header.voxels_at = std::max<double>(kNiftiHeader_bytes, ValueAt<float>(bytes, 108, swapped));
  header.qform_code = ValueAt<std::int16_t>(bytes, 252, swapped);
  header.sform_code = ValueAt<std::int16_t>(bytes, 254, swapped);
  ReadFloats(bytes, 80, swapped, header.steps);
  ReadFloats(bytes, 256, swapped, header.quaternion);
  ReadFloats(bytes, 280, swapped, header.matrix);
  return header;
}

// The unpacked size of the file. Stops unpacking, and returns more than `enough`, once that is
// exceeded.
double UnpackedSize(const std::filesystem::path& file, double enough) {
  if (!IsGzip(file)) {
    return static_cast<double>(std::filesystem::file_size(file));
  }
  double count = 0;
  Unpack(file, [&](std::string_view block) {
    count += static_cast<double>(block.size());
    return count <= enough;
  });
  return count;
}

}  // namespace

HeaderPlace ParseNrrdPlace(std::string_view head, const std::string& where) {
  const HeaderLines lines = ParseHeaderLines(head, ": ", "");
  const std::string name = HeaderValue(lines, "space");
  const NrrdSpace* const space = name.empty() ? nullptr : &FindSpace(name, where);
  HeaderPlace place;
  SetSteps(lines, space, where, place);
  SetUnit(QuotedUnit(HeaderValue(lines, lines.contains("space units") ? "space units" : "units")),
          place);
  NoteAssumptions(lines, space, place);
  return place;
}

HeaderPlace ParseMetaImagePlace(std::string_view head) {
  const HeaderLines lines = ParseHeaderLines(head, "=", "ElementDataFile");
  HeaderPlace place;
  const std::string unit = HeaderValue(lines, "distanceunits");
  SetUnit(unit == "?" ? "" : unit, place);
  if (!lines.contains("transformmatrix") && !lines.contains("rotation") &&
      !lines.contains("orientation")) {
    place.notes.emplace_back(
        "the file does not state its orientation (its header has no 'TransformMatrix'); taken as "
        "LPS");
  }
  return place;
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

void CheckNiftiPlace(const std::filesystem::path& file) {
  constexpr double kMaxCoordinate_mm = 1e9;  // far beyond any head, far below overflow
  const std::optional<NiftiHeader> header = ReadNiftiHeader(file);
  if (!header) {
    return;
  }
  const auto check = [&](std::span<const float> values) {
    for (const double value : values) {
      if (!(std::abs(value) <= kMaxCoordinate_mm)) {
        throw InputError(
            fmt::format("{}: one of the numbers that place its voxels is {}; export it again",
                        file.string(), value));
      }
    }
  };
  check(header->steps);
  if (header->qform_code > 0) {
    check(header->quaternion);
  }
  if (header->sform_code > 0) {
    check(header->matrix);
  }
}

bool NiftiHasPlace(const std::filesystem::path& file) {
  const std::optional<NiftiHeader> header = ReadNiftiHeader(file);
  return header && (header->qform_code > 0 || header->sform_code > 0);
}

void CheckNiftiWhole(const std::filesystem::path& file, double voxels) {
  // Unpacking this much more reaches the end of the gzip member, and so verifies its checksum.
  constexpr double kEndOfMember_bytes = 1 << 20;
  const std::optional<NiftiHeader> header = ReadNiftiHeader(file);
  if (!header) {
    return;
  }
  const double needed = voxels * NiftiVoxel_bytes(header->datatype);
  const double whole = header->voxels_at + needed;
  if (UnpackedSize(file, whole + kEndOfMember_bytes) < whole) {
    throw IoError(
        fmt::format("{}: the file is cut short: {:.0f} bytes of voxels are needed; copy or export "
                    "it again",
                    file.string(), needed));
  }
}

}  // namespace semblance::problems
