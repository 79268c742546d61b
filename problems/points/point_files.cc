// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/point_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iostream>
#include <iterator>
#include <map>
#include <numeric>
#include <optional>
#include <string_view>
#include <tuple>
#include <utility>

#include "problems/io/manifest.h"
#include "problems/points/column_mistakes.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/encoding.h"
#include "surfaces/base/error.h"
#include "surfaces/base/lower_case.h"
#include "surfaces/base/npy.h"
#include "surfaces/mesh_files/read_obj.h"
#include "surfaces/mesh_files/read_off.h"
#include "surfaces/mesh_files/read_ply.h"
#include "surfaces/mesh_files/read_stl.h"
#include "surfaces/mesh_files/text_lines.h"

namespace semblance::problems {
namespace {

constexpr std::string_view kGzip = "\x1f\x8b";

std::string Unzipped(const std::string& bytes, const std::string& name) {
  if (!bytes.starts_with(kGzip)) {
    throw IoError(
        fmt::format("{}: it is not a gzip file; compress it, or take .gz off its name", name));
  }
  return Unpacked(bytes, name);
}

PointTable NonEmpty(PointTable table, const std::string& name) {
  if (table.positions.empty()) {
    throw InputError(fmt::format("{}: there is no point; give at least one", name));
  }
  return table;
}

double NextFinite(TextLines& lines) {
  const double number = lines.NextDouble();
  if (!std::isfinite(number)) {
    lines.Fail("a number is not finite; give numbers");
  }
  return number;
}

Vec3 NextPosition(TextLines& lines) {
  Vec3 p;
  for (int c = 0; c < 3; ++c) {
    p[c] = NextFinite(lines);
  }
  return p;
}

// Reads x, y and z on each line, and leaves out as many further numbers as the first line has.
PointTable ParseXyz(std::string_view text, const std::string& name) {
  TextLines lines(text, name, {.comment = '#'});
  PointTable table;
  std::size_t further = 0;
  while (lines.NextLine()) {
    Vec3 p;
    for (int c = 0; c < 3; ++c) {
      const double number = lines.NextDouble();
      if (std::isinf(number)) {
        lines.Fail("a number is infinite; give numbers, or nan for a point without a place");
      }
      p[c] = number;
    }
    std::size_t count = 0;
    for (; !lines.AtLineEnd() && (table.positions.empty() || count < further); ++count) {
      lines.NextDouble();
    }
    further = table.positions.empty() ? count : further;
    if (!lines.AtLineEnd()) {
      lines.Fail(fmt::format(
          "'{}' follows x, y and z; leave it out, or give a CSV, whose first line names "
          "the further columns",
          Shown(lines.RestOfLine())));
    }
    if (count != further) {
      lines.Fail(fmt::format("{} numbers, and the first point has {}; give all points as many",
                             count + 3, further + 3));
    }
    table.positions.push_back(p);
  }
  RefuseRowNumbers(table, further, name);
  if (further > 0) {
    table.notes.push_back(fmt::format(
        "{} after x, y and z without effect; a first line such as 'x y z red green blue' names "
        "them, so that the option `attributes` can fit them",
        further == 1 ? "1 number" : fmt::format("{} numbers", further)));
  }
  return table;
}

std::string_view FirstLine(std::string_view text) { return text.substr(0, text.find('\n')); }

// Returns whether a first line begins with a number, so that no column has a name.
bool IsBare(std::string_view line) {
  const std::size_t first = line.find_first_not_of(" \t\xEF\xBB\xBF\"");
  return first != line.npos &&
         (std::isdigit(static_cast<unsigned char>(line[first])) != 0 ||
          std::string_view("+-.").find(line[first]) != std::string_view::npos);
}

// Returns whether a first line names columns: it is no comment, and begins with a letter or with
// //.
bool NamesColumns(std::string_view line) {
  const std::size_t first = line.find_first_not_of(" \t\xEF\xBB\xBF\"");
  return first != line.npos && (line.substr(first).starts_with("//") ||
                                std::isalpha(static_cast<unsigned char>(line[first])) != 0);
}

// Turns blanks between entries into commas. A head of CloudCompare begins with //.
std::string WithCommas(std::string_view text) {
  std::string table;
  table.reserve(text.size());
  for (std::size_t begin = 0, end = 0; begin < text.size(); begin = end + 1) {
    end = std::min(text.find('\n', begin), text.size());
    bool is_first = true;
    for (std::size_t at = begin; at < end;) {
      at = std::min(text.find_first_not_of(" \t\r", at), end);
      const std::size_t stop = std::min(text.find_first_of(" \t\r", at), end);
      if (stop > at) {
        std::string_view entry = text.substr(at, stop - at);
        entry.remove_prefix(begin == 0 && entry.starts_with("//") ? 2 : 0);
        table += is_first || entry.empty() ? "" : ",";
        table += entry;
        is_first = is_first && entry.empty();
      }
      at = stop;
    }
    table += end < text.size() ? "\n" : "";
  }
  return table;
}

// Turns semicolons between entries into commas, and decimal commas, if there are any, into points.
// rows: where the rows of numbers begin. Throws IoError for separators of thousands.
std::string WithoutSemicolons(std::string_view text, std::size_t rows, const std::string& name) {
  RefuseThousands(text.substr(rows), ";", name);
  std::string table(text);
  std::replace(table.begin() + static_cast<std::ptrdiff_t>(rows), table.end(), ',', '.');
  std::replace(table.begin(), table.end(), ';', ',');
  return table;
}

// A table with semicolons or blanks between the entries, with commas in their place; nothing for a
// table with commas.
std::optional<std::string> AsCommaTable(const std::string& text, const std::string& name) {
  const std::string_view first = FirstLine(text);
  if (first.find(',') != first.npos) {
    return std::nullopt;
  }
  if (first.find(';') != first.npos) {
    return WithoutSemicolons(text, first.size(), name);
  }
  return NamesColumns(first) ? std::optional(WithCommas(text)) : std::nullopt;
}

// Reads a table with commas, semicolons or blanks between the entries. Without commas every named
// column is allowed, because other programs write such tables.
PointTable ParseTable(const std::string& text, const std::string& name,
                      std::span<const std::string> attributes) {
  const std::optional<std::string> table = AsCommaTable(text, name);
  return table ? ParsePointTable(*table, name, attributes, FurtherColumns::kAny)
               : ParsePointTable(text, name, attributes);
}

// Reads the points with all their digits, and the faces, if there are any, as triangles.
PointTable ParseObj(std::string_view text, const std::string& name) {
  PointTable table;
  table.triangles = ReadObj(text, name).triangles;  // also without faces: it refuses other lines
  TextLines lines(text, name, {.comment = '#', .goes_on_after_backslash = true});
  while (lines.NextLine()) {
    if (lines.NextWord() == "v") {
      table.positions.push_back(NextPosition(lines));
      while (!lines.AtLineEnd()) {
        NextFinite(lines);  // a weight or a colour
      }
    }
  }
  return table;
}

PointTable PointsOf(TriMesh mesh) {
  PointTable table;
  table.positions = std::move(mesh.points);
  table.triangles = std::move(mesh.triangles);
  return table;
}

PointTable ParseNpyPoints(std::string_view bytes, const std::string& name) {
  const NpyArray array = ParseNpy(bytes, name);
  const std::size_t columns = array.shape.size() == 2 ? array.shape[1] : 0;
  if (columns != 3 && columns != 5) {
    throw InputError(
        fmt::format("{}: the array is neither n x 3 (x, y, z) nor n x 5 (x, y, z, u, v)", name));
  }
  PointTable table;
  for (std::size_t k = 0; k < array.values.size(); k += columns) {
    const double* const row = array.values.data() + k;
    table.positions.emplace_back(row[0], row[1], row[2]);
    if (columns == 5) {
      table.uv.emplace_back(row[3], row[4]);
    }
  }
  return table;
}

bool HasProperties(const PlyHeader& header, std::initializer_list<std::string_view> names) {
  return std::all_of(names.begin(), names.end(), [&](std::string_view name) {
    return std::any_of(header.elements.begin(), header.elements.end(), [&](const PlyElement& e) {
      return e.name == "vertex" && std::any_of(e.properties.begin(), e.properties.end(),
                                               [&](const auto& p) { return p.name == name; });
    });
  });
}

// Reads the weights of a PLY from its property weight or sigma.
void TakeWeights(const PlyHeader& header, std::string_view bytes, const std::string& name,
                 PointTable& table) {
  const bool sigma = HasProperties(header, {"sigma"}), weight = HasProperties(header, {"weight"});
  if (sigma && weight) {
    throw InputError(
        fmt::format("{}: the vertices have 'weight' and 'sigma'; give one of them", name));
  }
  if (!sigma && !weight) {
    return;
  }
  table.weights_of_sigma = sigma;
  table.weights = ReadPlyVertexScalar(bytes, sigma ? "sigma" : "weight", name);
  for (std::size_t k = 0; k < table.weights.size(); ++k) {
    double& number = table.weights[k];
    const bool positive = number > 0;
    number = sigma ? 1 / (number * number) : number;
    if (!positive || !std::isfinite(number) || number == 0) {
      throw InputError(fmt::format("{}: the {} of point {} is not positive and finite", name,
                                   sigma ? "sigma" : "weight", k + 1));
    }
  }
}

std::vector<double> FiniteScalar(std::string_view bytes, const std::string& scalar,
                                 const std::string& name) {
  std::vector<double> values = ReadPlyVertexScalar(bytes, scalar, name);
  const auto bad =
      std::find_if_not(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
  if (bad != values.end()) {
    throw InputError(fmt::format("{}: the {} of point {} is not finite; leave it out", name, scalar,
                                 bad - values.begin() + 1));
  }
  return values;
}

// Returns both names if the vertices have both properties, nothing if they have neither.
std::optional<std::array<std::string_view, 2>> PairIn(const PlyHeader& header,
                                                      std::string_view first,
                                                      std::string_view second,
                                                      const std::string& name) {
  const bool has_first = HasProperties(header, {first});
  if (has_first != HasProperties(header, {second})) {
    throw InputError(fmt::format("{}: the vertices have '{}' without '{}'; give both, or neither",
                                 name, has_first ? first : second, has_first ? second : first));
  }
  return has_first ? std::optional(std::array{first, second}) : std::nullopt;
}

// Reads (u,v) from the properties u and v, or else s and t.
void TakeUv(const PlyHeader& header, std::string_view bytes, const std::string& name,
            PointTable& table) {
  auto pair = PairIn(header, "u", "v", name);
  if (!pair) {
    pair = PairIn(header, "s", "t", name);
  }
  if (!pair) {
    return;
  }
  const std::vector<double> u = FiniteScalar(bytes, std::string(pair->front()), name),
                            v = FiniteScalar(bytes, std::string(pair->back()), name);
  for (std::size_t k = 0; k < u.size(); ++k) {
    table.uv.emplace_back(u[k], v[k]);
  }
}

// Reads the normals of the vertices; zero if they have none.
std::vector<Vec3> ReadNormals(const PlyHeader& header, std::string_view bytes,
                              const std::string& name, std::size_t count) {
  std::vector<Vec3> normals(count, Vec3::Zero());
  constexpr std::array kNames = {"nx", "ny", "nz"};
  const auto found = std::ranges::count_if(
      kNames, [&](std::string_view property) { return HasProperties(header, {property}); });
  if (found != 0 && found != 3) {
    throw InputError(fmt::format(
        "{}: nx, ny and nz beside 'exact' are normals of exact points; give all three, or none",
        name));
  }
  for (int c = 0; c < found; ++c) {
    const std::vector<double> values = FiniteScalar(bytes, kNames[c], name);
    for (std::size_t k = 0; k < count; ++k) {
      normals[k][c] = values[k];
    }
  }
  return normals;
}

// Reads the exact points of a PLY: those whose property exact is 1.
void TakeExact(const PlyHeader& header, std::string_view bytes, const std::string& name,
               PointTable& table) {
  if (!HasProperties(header, {"exact"})) {
    return;
  }
  const std::vector<double> exact = FiniteScalar(bytes, "exact", name);
  const std::vector<Vec3> normals = ReadNormals(header, bytes, name, exact.size());
  for (std::size_t k = 0; k < exact.size(); ++k) {
    if (exact[k] != 0 && exact[k] != 1) {
      throw InputError(
          fmt::format("{}: the exact of point {} is {}; write 1 for a point that must be met "
                      "exactly, else 0",
                      name, k + 1, exact[k]));
    }
    if (exact[k] == 1) {
      AddExact(table, k, normals[k]);
    }
  }
}

bool HasFaces(const PlyHeader& header) {
  return std::any_of(header.elements.begin(), header.elements.end(), [](const PlyElement& e) {
    return (e.name == "face" || e.name == "tristrips") && e.count > 0;
  });
}

PointTable ParsePlyPoints(std::string_view bytes, const std::string& name,
                          std::span<const std::string> attributes) {
  const PlyHeader header = ReadPlyHeader(bytes, name);
  const auto scalar = [&](const char* of) { return ReadPlyVertexScalar(bytes, of, name); };
  const std::vector<double> x = scalar("x"), y = scalar("y"), z = scalar("z");
  PointTable table;
  for (std::size_t k = 0; k < x.size(); ++k) {
    table.positions.emplace_back(x[k], y[k], z[k]);  // not finite where a camera saw nothing
  }
  TakeUv(header, bytes, name, table);
  TakeWeights(header, bytes, name, table);
  TakeExact(header, bytes, name, table);
  for (const std::string& attribute : attributes) {
    table.attributes.push_back({attribute, FiniteScalar(bytes, attribute, name)});
  }
  if (HasFaces(header)) {
    table.triangles = ReadPly(bytes, name).triangles;
  }
  return table;
}

// Reads a table without names of columns: x, y, z and further numbers with commas, semicolons or
// blanks between them.
PointTable ParseBare(const std::string& bytes, const std::string& name) {
  const std::string_view first = FirstLine(bytes);
  std::string text = first.find(';') == first.npos ? bytes : WithoutSemicolons(bytes, 0, name);
  const bool has_decimal_commas = HasDecimalCommas(first);
  if (has_decimal_commas) {
    RefuseThousands(bytes, " \t", name);
  } else {
    RefuseCommasWithin(bytes, name);
  }
  std::ranges::replace(text, ',', has_decimal_commas ? '.' : ' ');
  PointTable table = ParseXyz(text, name);
  table.first_line = 1;
  table.notes.insert(
      table.notes.begin(),
      fmt::format("the file names no columns: the first three are taken for x, y and z{}",
                  has_decimal_commas ? "; its commas are read as decimal points" : ""));
  return table;
}

// Reads the points of a .pts: their number, then x, y, z and further numbers on each line.
PointTable ParsePts(const std::string& bytes, const std::string& name) {
  const std::string_view first = FirstLine(bytes);
  const bool has_count = first.find_first_not_of("0123456789 \t\r") == first.npos &&
                         first.find_first_of(" \t") == first.npos;
  return ParseXyz(has_count && first.size() < bytes.size() ? bytes.substr(first.size() + 1) : bytes,
                  name);
}

// Reads the nodes of an ASCII grid of ESRI, without those that have no data.
PointTable ParseEsriGrid(const std::string& bytes, const std::string& name) {
  TextLines lines(bytes, name, {.comment = '#'});
  std::map<std::string, double> head;
  const auto value = [&](const char* key, double otherwise) {
    return head.contains(key) ? head[key] : otherwise;
  };
  PointTable table;
  double rows = 0, columns = 0;
  for (double row = 0; lines.NextLine();) {
    if (row == 0 && NamesColumns(lines.RestOfLine())) {
      const std::string key = LowerCase(std::string(lines.NextWord()));
      head[key] = NextFinite(lines);
      continue;
    }
    columns = value("ncols", 0);
    rows = value("nrows", 0);
    const double step = value("cellsize", kNaN), half = step / 2,
                 left = value("xllcenter", value("xllcorner", 0) + half),
                 low = value("yllcenter", value("yllcorner", 0) + half);
    double column = 0;
    for (; !lines.AtLineEnd(); ++column) {
      const double z = NextFinite(lines);
      if (z != value("nodata_value", -9999)) {
        table.positions.emplace_back(left + step * column, low + step * (rows - 1 - row), z);
      }
    }
    if (column != columns) {
      lines.Fail(fmt::format("{} numbers, and ncols is {}; give each row of the grid one line",
                             column, columns));
    }
    ++row;
  }
  return table;
}

PointTable ParseUnnamed(const std::string& bytes, const std::string& ending,
                        const std::string& name) {
  if (ending == ".xyz") {
    return ParseXyz(bytes, name);
  }
  if (ending == ".pts") {
    return ParsePts(bytes, name);
  }
  if (ending == ".asc") {
    return LowerCase(bytes.substr(0, 5)) == "ncols" ? ParseEsriGrid(bytes, name)
                                                    : ParseXyz(bytes, name);
  }
  if (ending == ".npy") {
    return ParseNpyPoints(bytes, name);
  }
  if (ending == ".obj") {
    return ParseObj(bytes, name);
  }
  if (ending == ".stl" || ending == ".off") {
    return PointsOf(ending == ".stl" ? ReadStl(bytes, name) : ReadOff(bytes, name));
  }
  throw IoError(fmt::format(
      "{}: files of points end in .csv, .txt, .xyz, .pts, .asc, .npy, .ply, .obj, .stl or .off, "
      "or in one of these and .gz; or give - for a CSV on standard input",
      name));
}

// Merges corners at the same place into one point if each triangle has corners of its own, as in an
// STL and as some programs write other files. Points that carry more than a position stay apart.
void WeldCorners(PointTable& table) {
  const std::vector<Vec3>& points = table.positions;
  const bool all_finite = std::ranges::all_of(points, [](const Vec3& p) { return p.allFinite(); });
  if (!all_finite || table.triangles.empty() || points.size() != 3 * table.triangles.size() ||
      !table.uv.empty() || !table.weights.empty() || !table.exact.empty() ||
      !table.attributes.empty()) {
    return;
  }
  const auto place = [&](std::uint32_t k) {
    return std::tuple(points[k].x(), points[k].y(), points[k].z());
  };
  std::vector<std::uint32_t> order(points.size()), first(points.size());
  std::iota(order.begin(), order.end(), 0u);
  std::ranges::stable_sort(order, {}, place);
  for (std::size_t n = 0; n < order.size(); ++n) {
    const bool again = n > 0 && place(order[n]) == place(order[n - 1]);
    first[order[n]] = again ? first[order[n - 1]] : order[n];
  }
  std::vector<Vec3> kept;
  std::vector<std::int32_t> number(points.size());
  for (std::uint32_t k = 0; k < points.size(); ++k) {
    number[k] = first[k] == k ? static_cast<std::int32_t>(kept.size()) : number[first[k]];
    if (first[k] == k) {
      kept.push_back(points[k]);
    }
  }
  for (Triangle& triangle : table.triangles) {
    for (std::int32_t& corner : triangle) {
      corner = number[corner];
    }
  }
  table.positions = std::move(kept);
}

PointTable Parse(const std::string& bytes, const std::filesystem::path& path,
                 std::span<const std::string> attributes) {
  const std::string name = path.string(), ending = LowerCase(path.extension().string());
  const std::string_view first = FirstLine(bytes);
  const bool is_table = name == "-" || ending == ".csv" || ending == ".txt",
             is_bare = is_table && (IsBare(first) || (ending == ".txt" && !NamesColumns(first) &&
                                                      first.find(',') == first.npos)),
             is_named = (ending == ".xyz" || ending == ".pts" || ending == ".asc") &&
                        NamesColumns(first) && LowerCase(bytes.substr(0, 5)) != "ncols";
  if (is_named || (is_table && !is_bare)) {
    return ParseTable(bytes, name == "-" ? "standard input" : name, attributes);
  }
  if (ending == ".ply") {
    return NonEmpty(ParsePlyPoints(bytes, name, attributes), name);
  }
  PointTable table =
      NonEmpty(is_bare ? ParseBare(bytes, name) : ParseUnnamed(bytes, ending, name), name);
  if (!attributes.empty()) {
    throw InputError(
        fmt::format("{}: it has no '{}', which the option `attributes` names; give a CSV or PLY",
                    name, attributes.front()));
  }
  return table;
}

bool IsCsv(const std::filesystem::path& path) {
  const std::string ending = LowerCase(path.extension().string());
  return ending == ".csv" || ending == ".txt";
}

// Estimates the number of points from the length of the first lines, plus 2 %.
std::size_t PointsExpected(const std::filesystem::path& path, std::string_view lines) {
  constexpr double kMore = 1.02;
  std::error_code unknown;
  const std::uintmax_t bytes = std::filesystem::file_size(path, unknown);
  const auto count = std::count(lines.begin(), lines.end(), '\n');
  return unknown || count == 0 ? 0
                               : static_cast<std::size_t>(kMore * static_cast<double>(bytes) *
                                                          static_cast<double>(count) /
                                                          static_cast<double>(lines.size()));
}

// A text that was cut in its last row loses digits of a number without becoming wrong. Programs end
// the last line, too.
void NoteMissingEnd(std::string_view text, PointTable& table) {
  if (!text.empty() && text.back() != '\n' && text.back() != '\r') {
    table.notes.push_back(fmt::format(
        "the last line has no end, as in a file that was cut: compare its {} points, and the last "
        "number, with the original",
        table.positions.size()));
  }
}

// Reads a plain table block by block; returns nothing if the file cannot be read or is not plain.
std::optional<PointFile> ReadPlainCsv(const std::filesystem::path& path,
                                      std::span<const std::string> attributes) {
  constexpr std::size_t kBlock = 1 << 22;
  std::ifstream stream(path, std::ios::binary);
  std::string text(kBlock, '\0');
  std::size_t kept = 0;  // bytes of an unfinished line from the last block
  Sha256 sha;
  std::optional<PlainPoints> points;
  char last = '\n';
  while (stream) {
    text.resize(std::max(text.size(), kept + kBlock));
    stream.read(text.data() + kept, kBlock);
    const std::string_view all(text.data(), kept + static_cast<std::size_t>(stream.gcount()));
    sha.Add(all.substr(kept));
    last = all.empty() ? last : all.back();
    std::size_t begin = 0;
    if (!points) {
      begin = all.find('\n') + 1;
      if (begin == 0 || all.substr(0, begin).find(',') == all.npos || IsBare(all)) {
        return std::nullopt;  // one line, another separator, or no names
      }
      points.emplace(ReadPointColumns(all.substr(0, begin - 1), path.string(), attributes));
    }
    const std::size_t end = stream ? std::max(all.rfind('\n') + 1, begin) : all.size();
    if (begin > 0) {
      points->Reserve(PointsExpected(path, all.substr(begin, end - begin)));
    }
    if (!points->Add(all.substr(begin, end - begin))) {
      return std::nullopt;
    }
    kept = all.size() - end;
    std::memmove(text.data(), text.data() + end, kept);
  }
  if (!points || points->size() == 0) {
    return std::nullopt;
  }
  PointFile file{.points = points->Take(), .sha256 = sha.Hex()};
  NoteMissingEnd({&last, 1}, file.points);
  return file;
}

// Refuses coordinates so large that squares of distances overflow.
void CheckReach(const PointTable& points) {
  constexpr double kFarthest = 1e100;
  for (std::size_t k = 0; k < points.positions.size(); ++k) {
    const double largest =
        points.positions[k].hasNaN() ? 0 : points.positions[k].cwiseAbs().maxCoeff();
    if (largest > kFarthest) {
      throw InputError(fmt::format("{} has a coordinate of {:.3g}; at most 1e100 are allowed",
                                   PointName(points, k), largest));
    }
  }
}

// Returns whether each point is a line of the file, after a line with the names of the columns.
bool IsTable(const std::filesystem::path& path) {
  return path == "-" || IsCsv(LowerCase(path.extension().string()) == ".gz" ? path.stem() : path);
}

// Returns the text of standard input, unpacked if it is gzip. Other formats need a file name, whose
// ending names the format.
std::string PipedText(std::string bytes) {
  if (bytes.starts_with(kGzip)) {
    bytes = Unpacked(bytes, "standard input");
  }
  constexpr std::size_t kLooked = 4096;  // bytes among which a binary file has a zero
  if (bytes.starts_with("ply") ||
      std::string_view(bytes).substr(0, kLooked).find('\0') != std::string_view::npos) {
    throw IoError("standard input: it is not a CSV; give the file's name in place of -");
  }
  return bytes;
}

PointFile ReadAnyPointFile(const std::filesystem::path& path,
                           std::span<const std::string> attributes) {
  if (auto plain = IsCsv(path) ? ReadPlainCsv(path, attributes) : std::nullopt) {
    return std::move(*plain);
  }
  const bool piped = path == "-", zipped = LowerCase(path.extension().string()) == ".gz";
  std::string bytes =
      piped ? std::string(std::istreambuf_iterator<char>(std::cin), {}) : ReadFileBytes(path);
  PointFile file{.points = {}, .sha256 = Sha256OfText(bytes)};
  if (zipped) {
    bytes = Unzipped(bytes, path.string());
  } else if (piped) {
    bytes = PipedText(std::move(bytes));
  }
  const std::filesystem::path inner = zipped ? path.parent_path() / path.stem() : path;
  file.points = Parse(bytes, inner, attributes);
  const std::string ending = LowerCase(inner.extension().string());
  if (piped || IsCsv(inner) || ending == ".xyz" || ending == ".pts") {
    NoteMissingEnd(bytes, file.points);
  }
  return file;
}

}  // namespace

PointFile ReadPointFile(const std::filesystem::path& path,
                        std::span<const std::string> attributes) {
  PointFile file = ReadAnyPointFile(path, attributes);
  file.points.file = path == "-" ? "standard input" : path.string();
  if (file.points.first_line == 0) {
    file.points.first_line = IsTable(path) ? 2 : 0;
  }
  CheckReach(file.points);
  RefuseWrongDegrees(file.points);
  WeldCorners(file.points);
  return file;
}

std::vector<Vec2> ReadPlaces(const std::filesystem::path& path) {
  const bool piped = path == "-", zipped = LowerCase(path.extension().string()) == ".gz";
  std::string bytes =
      piped ? std::string(std::istreambuf_iterator<char>(std::cin), {}) : ReadFileBytes(path);
  const std::string name = piped ? "standard input" : path.string();
  bytes = zipped ? Unzipped(bytes, name) : piped ? PipedText(std::move(bytes)) : std::move(bytes);
  if (const auto inner = zipped ? path.stem() : path; LowerCase(inner.extension()) == ".npy") {
    const NpyArray array = ParseNpy(bytes, name);
    const std::size_t columns = array.shape.size() == 2 ? array.shape[1] : 0;
    if (columns < 2) {
      throw InputError(fmt::format("{}: the array is not n x 2 (x, y) or wider", name));
    }
    std::vector<Vec2> places;
    for (std::size_t k = 0; k < array.values.size(); k += columns) {
      places.emplace_back(array.values[k], array.values[k + 1]);
    }
    return places;
  }
  const std::optional<std::string> table = AsCommaTable(bytes, name);
  return ParsePlaces(table ? *table : bytes, name);
}

}  // namespace semblance::problems
