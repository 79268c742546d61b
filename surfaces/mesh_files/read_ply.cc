// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh_files/read_ply.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>

#include "surfaces/base/error.h"
#include "surfaces/mesh_files/text_lines.h"

namespace semblance::surfaces {
namespace {

// In bytes.
std::size_t PlyTypeSize(PlyType type) {
  constexpr std::array<std::size_t, 8> kSizes = {1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

// True if the numbers of the type are whole.
bool IsWhole(PlyType type) { return type != PlyType::kFloat && type != PlyType::kDouble; }

class PlyHeaderReader {
 public:
  PlyHeaderReader(std::string_view bytes, const std::string& name) : lines_(bytes, name, {}) {}

  PlyHeader Read() {
    if (!lines_.NextLine() || lines_.NextWord() != "ply") {
      lines_.Fail("a PLY file begins with the line 'ply'; is it another format?");
    }
    lines_.ExpectLineEnd();
    while (ReadLine()) {
    }
    if (!header_.format) {
      lines_.Fail("the header has no line 'format'");
    }
    header_.bytes = lines_.NextLineStart();
    header_.lines = lines_.LineNumber();
    CheckSize();
    return std::move(header_);
  }

 private:
  bool ReadLine() {
    if (!lines_.NextLine()) {
      lines_.Fail("the file is truncated: its header has no 'end_header'; copy it again");
    }
    const std::string_view keyword = lines_.NextWord();
    if (keyword == "comment" || keyword == "obj_info") {
      return true;
    }
    if (keyword == "format") {
      ReadFormat();
    } else if (keyword == "element") {
      ReadElement();
    } else if (keyword == "property") {
      ReadProperty();
    } else if (keyword != "end_header") {
      lines_.Fail(
          fmt::format("'{}' is not a keyword; allowed are format, element, property, comment, "
                      "obj_info and end_header",
                      Shown(keyword)));
    }
    lines_.ExpectLineEnd();
    return keyword != "end_header";
  }

  void ReadFormat() {
    static const std::map<std::string_view, PlyFormat> kFormats = {
        {"ascii", PlyFormat::kText},
        {"binary_little_endian", PlyFormat::kLittleEndian},
        {"binary_big_endian", PlyFormat::kBigEndian}};
    const auto found = kFormats.find(lines_.NextWord());
    if (header_.format || found == kFormats.end() || lines_.NextWord() != "1.0") {
      lines_.Fail(
          "expected once: 'format ascii 1.0', 'format binary_little_endian 1.0' or 'format "
          "binary_big_endian 1.0'");
    }
    header_.format = found->second;
  }

  void ReadElement() {
    const std::string name = NextName(header_.elements);
    const std::int64_t count = lines_.NextInteger("number of elements", 0, kMaxElements);
    header_.elements.push_back({name, count, {}});
  }

  void ReadProperty() {
    if (header_.elements.empty()) {
      lines_.Fail("a property before any element; write 'element vertex ...' first");
    }
    std::vector<PlyProperty>& properties = header_.elements.back().properties;
    PlyProperty property;
    std::string_view type = lines_.NextWord();
    if (type == "list") {
      property.length_type = TypeOf(lines_.NextWord());
      if (!IsWhole(*property.length_type)) {
        lines_.Fail("the length of a list must be of a whole type, such as uchar or int");
      }
      type = lines_.NextWord();
    }
    property.type = TypeOf(type);
    property.name = NextName(properties);
    properties.push_back(property);
  }

  PlyType TypeOf(std::string_view word) const {
    static const std::map<std::string_view, PlyType> kTypes = {
        {"char", PlyType::kInt8},     {"int8", PlyType::kInt8},     {"uchar", PlyType::kUint8},
        {"uint8", PlyType::kUint8},   {"short", PlyType::kInt16},   {"int16", PlyType::kInt16},
        {"ushort", PlyType::kUint16}, {"uint16", PlyType::kUint16}, {"int", PlyType::kInt32},
        {"int32", PlyType::kInt32},   {"uint", PlyType::kUint32},   {"uint32", PlyType::kUint32},
        {"float", PlyType::kFloat},   {"float32", PlyType::kFloat}, {"double", PlyType::kDouble},
        {"float64", PlyType::kDouble}};
    const auto found = kTypes.find(word);
    if (found == kTypes.end()) {
      lines_.Fail(
          fmt::format("'{}' is not the type of a property; allowed are char, uchar, short, "
                      "ushort, int, uint, float and double",
                      Shown(word)));
    }
    return found->second;
  }

  // Reads a name that none of `named` has yet.
  template <class T>
  std::string NextName(const std::vector<T>& named) {
    constexpr std::size_t kMost = 1000;
    if (named.size() == kMost) {
      lines_.Fail(fmt::format("more than {} elements, or properties of one element", kMost));
    }
    const std::string name(lines_.NextWord());
    if (name.empty() || std::any_of(named.begin(), named.end(),
                                    [&](const T& other) { return other.name == name; })) {
      lines_.Fail(
          fmt::format("the name '{}' is empty or taken; each element, and each property of "
                      "an element, needs a name of its own",
                      Shown(name)));
    }
    return name;
  }

  // The bytes of the shortest row. An empty list has only its length. A number in a text has at
  // least one digit and a separator.
  std::int64_t FewestBytes(const PlyElement& element) const {
    std::int64_t bytes = 0;
    for (const PlyProperty& property : element.properties) {
      bytes += header_.format == PlyFormat::kText
                   ? 2
                   : static_cast<std::int64_t>(
                         PlyTypeSize(property.length_type.value_or(property.type)));
    }
    return bytes;
  }

  void CheckSize() const {
    auto left = static_cast<std::int64_t>(lines_.BytesLeft()) +
                (header_.format == PlyFormat::kText ? 1 : 0);  // the last line may have no end
    for (const PlyElement& element : header_.elements) {
      const std::int64_t needed = element.count * FewestBytes(element);
      if (needed > left) {
        lines_.Fail(fmt::format(
            "the file is truncated: its header says {} of element '{}', at least {} bytes; {} are "
            "left; copy it again",
            element.count, Shown(element.name), needed, left));
      }
      left -= needed;
    }
  }

  TextLines lines_;
  PlyHeader header_;
};

// The next two classes have one interface: they read the data behind the header, number by number.
// A reader calls BeginRow, Next for each number of the row, EndRow, and End after all elements.
// Every fault is an InputError that names the file and the line (text) or byte (binary).

// Text: one line per row of an element.
class PlyTextData {
 public:
  PlyTextData(std::string_view bytes, const PlyHeader& header, const std::string& name)
      : lines_(bytes.substr(header.bytes), name, {.first_line = header.lines + 1}) {}

  void BeginRow(const PlyElement& element, std::int64_t row) {
    if (!lines_.NextLine()) {
      lines_.Fail(
          fmt::format("the file is truncated: it ends after {} of {} of element '{}'; copy "
                      "it again",
                      row, element.count, Shown(element.name)));
    }
  }
  void EndRow() { lines_.ExpectLineEnd(); }
  void End() {
    if (lines_.NextLine()) {
      lines_.Fail("more data than the header says; correct its counts or write the file again");
    }
  }

  // Any number is allowed for a whole type, because most numbers are skipped.
  double Next(PlyType type) {
    return type == PlyType::kFloat ? lines_.NextFloat() : lines_.NextDouble();
  }
  // The most numbers that can follow.
  std::size_t MostItems(PlyType) { return lines_.RestOfLine().size() / 2 + 1; }

  [[noreturn]] void Fail(const std::string& what) const { lines_.Fail(what); }

 private:
  TextLines lines_;
};

// Binary: numbers without separators.
class PlyBinaryData {
 public:
  PlyBinaryData(std::string_view bytes, const PlyHeader& header, const std::string& name)
      : bytes_(bytes),
        name_(name),
        at_(header.bytes),
        swapped_((header.format == PlyFormat::kBigEndian) ==
                 (std::endian::native == std::endian::little)) {}

  void BeginRow(const PlyElement& element, std::int64_t row) {
    element_ = &element;
    row_ = row;
  }
  void EndRow() {}
  void End() {
    begin_ = at_;
    if (!IsPadding(bytes_.substr(at_))) {
      Fail(
          fmt::format("{} bytes more than the header says; correct its counts or write the file "
                      "again",
                      bytes_.size() - at_));
    }
  }

  double Next(PlyType type) {
    switch (type) {
      case PlyType::kInt8:
        return Take<std::int8_t>();
      case PlyType::kUint8:
        return Take<std::uint8_t>();
      case PlyType::kInt16:
        return Take<std::int16_t>();
      case PlyType::kUint16:
        return Take<std::uint16_t>();
      case PlyType::kInt32:
        return Take<std::int32_t>();
      case PlyType::kUint32:
        return Take<std::uint32_t>();
      case PlyType::kFloat:
        return Take<float>();
      case PlyType::kDouble:
        return Take<double>();
    }
    return 0;
  }
  std::size_t MostItems(PlyType type) const { return (bytes_.size() - at_) / PlyTypeSize(type); }

  [[noreturn]] void Fail(const std::string& what) const {
    throw InputError(fmt::format("{}: byte {}: {}", name_, begin_, what));
  }

 private:
  template <class T>
  T Take() {
    begin_ = at_;
    if (bytes_.size() - at_ < sizeof(T)) {
      Fail(
          fmt::format("the file is truncated: its header says {} of element '{}', it ends in "
                      "number {}; copy it again",
                      element_->count, Shown(element_->name), row_ + 1));
    }
    std::array<char, sizeof(T)> raw;
    std::memcpy(raw.data(), bytes_.data() + at_, sizeof(T));
    at_ += sizeof(T);
    if (swapped_) {
      std::reverse(raw.begin(), raw.end());
    }
    return std::bit_cast<T>(raw);
  }

  std::string_view bytes_;
  const std::string& name_;
  std::size_t at_, begin_ = 0;  // behind and at the last number
  bool swapped_;
  const PlyElement* element_ = nullptr;
  std::int64_t row_ = 0;
};

// True if the value is whole and in [0, end).
bool IsIndex(double value, double end) {
  return value >= 0 && value < end && value == std::floor(value);
}

template <class Data>
std::size_t ListLength(Data& data, const PlyProperty& list) {
  const double length = data.Next(*list.length_type);
  const std::size_t most = data.MostItems(list.type);
  if (!IsIndex(length, static_cast<double>(most) + 1)) {
    data.Fail(
        fmt::format("a list '{}' of {} items, but there is room for {}; the file is truncated "
                    "or damaged: write it again",
                    Shown(list.name), length, most));
  }
  return static_cast<std::size_t>(length);
}

// Reads an element. Calls on_value(row, k, value) for each value of property k, or each item of its
// list, and on_row(row) after the last value of a row.
template <class Data, class OnValue, class OnRow>
void ForEachValue(Data& data, const PlyElement& element, const OnValue& on_value,
                  const OnRow& on_row) {
  if (element.properties.empty()) {
    return;
  }
  for (std::int64_t row = 0; row < element.count; ++row) {
    data.BeginRow(element, row);
    for (std::size_t k = 0; k < element.properties.size(); ++k) {
      const PlyProperty& property = element.properties[k];
      const std::size_t length = property.length_type ? ListLength(data, property) : 1;
      for (std::size_t item = 0; item < length; ++item) {
        on_value(row, k, data.Next(property.type));
      }
    }
    data.EndRow();
    on_row(row);
  }
}

PlyElement& FindElement(PlyHeader& header, const std::string& wanted, const std::string& name) {
  for (PlyElement& element : header.elements) {
    if (element.name == wanted) {
      return element;
    }
  }
  throw InputError(
      fmt::format("{}: line {}: the header has no element '{}'; export a mesh of "
                  "vertices and faces",
                  name, header.lines, wanted));
}

std::optional<std::size_t> FindProperty(const PlyElement& element, const std::string& wanted) {
  for (std::size_t k = 0; k < element.properties.size(); ++k) {
    if (element.properties[k].name == wanted) {
      return k;
    }
  }
  return std::nullopt;
}

// The properties x, y and z, which must be plain numbers.
std::array<std::size_t, 3> FindAxes(const PlyElement& vertex, const std::string& name) {
  std::array<std::size_t, 3> axes;
  const std::array<std::string, 3> names = {"x", "y", "z"};
  for (std::size_t a = 0; a < 3; ++a) {
    const auto found = FindProperty(vertex, names[a]);
    if (!found || vertex.properties[*found].length_type) {
      throw InputError(
          fmt::format("{}: the header's vertices have no plain property '{}'; they need x, y and z",
                      name, names[a]));
    }
    axes[a] = *found;
  }
  return axes;
}

// The list property with the vertices of a face.
std::size_t FindCorners(const PlyElement& face, const std::string& name) {
  auto found = FindProperty(face, "vertex_indices");
  found = found ? found : FindProperty(face, "vertex_index");
  if (!found || !face.properties[*found].length_type || !IsWhole(face.properties[*found].type)) {
    throw InputError(
        fmt::format("{}: the header's faces have no list of whole numbers 'vertex_indices'; write "
                    "'property list uchar int vertex_indices'",
                    name));
  }
  return *found;
}

template <class Data>
std::vector<Vec3> ReadPoints(Data& data, const PlyElement& vertex, const std::string& name) {
  const auto axes = FindAxes(vertex, name);
  std::vector<Vec3> points(static_cast<std::size_t>(vertex.count));
  ForEachValue(
      data, vertex,
      [&](std::int64_t row, std::size_t k, double value) {
        for (std::size_t a = 0; a < 3; ++a) {
          if (axes[a] == k) {
            points[static_cast<std::size_t>(row)][static_cast<int>(a)] = value;
          }
        }
      },
      [&](std::int64_t row) {
        if (!points[static_cast<std::size_t>(row)].allFinite()) {
          data.Fail(fmt::format("vertex {} is not finite; remove it or repair the mesh", row));
        }
      });
  return points;
}

template <class Data>
std::int32_t CornerIndex(const Data& data, const char* what, std::int64_t row, double value,
                         std::int64_t points) {
  if (!IsIndex(value, static_cast<double>(points))) {
    data.Fail(fmt::format("{} {} names vertex {}; there are {}, numbered from 0", what, row, value,
                          points));
  }
  return static_cast<std::int32_t>(value);
}

template <class Data>
void ReadFaces(Data& data, const PlyElement& face, std::int64_t points, const std::string& name,
               std::vector<Triangle>& triangles, PolygonFans& fans) {
  const std::size_t list = FindCorners(face, name);
  triangles.reserve(triangles.size() + static_cast<std::size_t>(face.count));
  std::vector<std::int32_t> corners;
  ForEachValue(
      data, face,
      [&](std::int64_t row, std::size_t k, double value) {
        if (k == list) {
          corners.push_back(CornerIndex(data, "face", row, value, points));
        }
      },
      [&](std::int64_t row) {
        if (corners.size() < 3) {
          data.Fail(
              fmt::format("face {} has {} corners; it needs at least 3", row, corners.size()));
        }
        fans.Append(corners, triangles);
        corners.clear();
      });
}

// Appends the triangles of one strip. Two equal corners, with which programs join strips, make no
// triangle.
void AppendStrip(const std::vector<std::int32_t>& strip, std::vector<Triangle>& triangles) {
  for (std::size_t k = 2; k < strip.size(); ++k) {
    const bool turned = k % 2 == 1;
    const Triangle t = {strip[turned ? k - 1 : k - 2], strip[turned ? k - 2 : k - 1], strip[k]};
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) {
      triangles.push_back(t);
    }
  }
}

template <class Data>
void ReadStrips(Data& data, const PlyElement& strips, std::int64_t points, const std::string& name,
                std::vector<Triangle>& triangles) {
  constexpr double kEnd = -1;
  const std::size_t list = FindCorners(strips, name);
  std::vector<std::int32_t> strip;
  const auto end_strip = [&](std::int64_t) {
    AppendStrip(strip, triangles);
    strip.clear();
  };
  ForEachValue(
      data, strips,
      [&](std::int64_t row, std::size_t k, double value) {
        if (k == list && value == kEnd) {
          end_strip(row);
        } else if (k == list) {
          strip.push_back(CornerIndex(data, "strip", row, value, points));
        }
      },
      end_strip);
}

template <class Data>
TriMesh ReadMeshData(Data data, PlyHeader& header, const std::string& name) {
  const PlyElement& vertex = FindElement(header, "vertex", name);
  if (std::ranges::find(header.elements, "tristrips", &PlyElement::name) == header.elements.end()) {
    FindElement(header, "face", name);  // a mesh has faces or strips
  }
  TriMesh mesh;
  PolygonFans fans;
  for (const PlyElement& element : header.elements) {
    if (&element == &vertex) {
      mesh.points = ReadPoints(data, vertex, name);
    } else if (element.name == "face") {
      ReadFaces(data, element, vertex.count, name, mesh.triangles, fans);
    } else if (element.name == "tristrips") {
      ReadStrips(data, element, vertex.count, name, mesh.triangles);
    } else {
      ForEachValue(
          data, element, [](auto...) {}, [](auto...) {});
    }
  }
  data.End();
  fans.Finish(mesh, name);
  return mesh;
}

template <class Data>
std::vector<double> ReadScalar(Data data, const PlyHeader& header, const PlyElement& vertex,
                               std::size_t scalar) {
  std::vector<double> values;
  values.reserve(static_cast<std::size_t>(vertex.count));
  for (const PlyElement& element : header.elements) {
    ForEachValue(
        data, element,
        [&](std::int64_t, std::size_t k, double value) {
          if (&element == &vertex && k == scalar) {
            values.push_back(value);
          }
        },
        [](auto...) {});
  }
  data.End();
  return values;
}

std::string Names(const PlyElement& element) {
  std::string names;
  for (const PlyProperty& property : element.properties) {
    names += (names.empty() ? "" : ", ") + Shown(property.name);
  }
  constexpr std::size_t kLongest = 400;
  return names.size() > kLongest ? names.substr(0, kLongest) + "..." : names;
}

// The properties of a vertex that become its normal, its colour and its scalars.
struct PlyColumns {
  std::optional<std::array<std::size_t, 3>> normal, colour;
  std::vector<std::size_t> scalars;
};

// The properties of these names, if all three exist and are plain.
std::optional<std::array<std::size_t, 3>> FindThree(const PlyElement& vertex,
                                                    const std::array<std::string, 3>& names) {
  std::array<std::size_t, 3> three;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto found = FindProperty(vertex, names[k]);
    if (!found || vertex.properties[*found].length_type) {
      return std::nullopt;
    }
    three[k] = *found;
  }
  return three;
}

PlyColumns FindColumns(const PlyElement& vertex) {
  PlyColumns columns{.normal = FindThree(vertex, {"nx", "ny", "nz"}),
                     .colour = FindThree(vertex, {"red", "green", "blue"}),
                     .scalars = {}};
  if (columns.colour && std::ranges::any_of(*columns.colour, [&](std::size_t k) {
        return vertex.properties[k].type != PlyType::kUint8;
      })) {
    columns.colour.reset();
  }
  const auto is_of = [](const std::optional<std::array<std::size_t, 3>>& three, std::size_t k) {
    return three && std::ranges::find(*three, k) != three->end();
  };
  for (std::size_t k = 0; k < vertex.properties.size(); ++k) {
    const PlyProperty& property = vertex.properties[k];
    const bool is_axis = property.name == "x" || property.name == "y" || property.name == "z";
    if (!is_axis && !property.length_type && !is_of(columns.normal, k) &&
        !is_of(columns.colour, k)) {
      columns.scalars.push_back(k);
    }
  }
  return columns;
}

// A text may contain any number as a colour.
template <class Data>
void CheckColour(const Data& data, const std::vector<double>& row, const PlyColumns& columns,
                 std::int64_t vertex) {
  constexpr double kColours = 256;
  for (std::size_t k = 0; columns.colour && k < 3; ++k) {
    if (const double value = row[(*columns.colour)[k]]; !IsIndex(value, kColours)) {
      data.Fail(fmt::format("vertex {} has a colour of {}; allowed are whole numbers from 0 to 255",
                            vertex, value));
    }
  }
}

// Appends one row of values as the attributes of a vertex.
void AppendVertex(const std::vector<double>& row, const PlyColumns& columns,
                  MeshAttributes& attributes) {
  if (columns.normal) {
    const auto& n = *columns.normal;
    attributes.normals.emplace_back(row[n[0]], row[n[1]], row[n[2]]);
  }
  if (columns.colour) {
    const auto byte = [&](std::size_t k) { return static_cast<std::uint8_t>(row[k]); };
    const auto& c = *columns.colour;
    attributes.colors.push_back({byte(c[0]), byte(c[1]), byte(c[2])});
  }
  for (std::size_t k = 0; k < columns.scalars.size(); ++k) {
    attributes.scalars[k].values.push_back(row[columns.scalars[k]]);
  }
}

template <class Data>
MeshAttributes ReadAttributesData(Data data, const PlyHeader& header, const PlyElement& vertex) {
  const PlyColumns columns = FindColumns(vertex);
  MeshAttributes attributes;
  for (const std::size_t k : columns.scalars) {
    attributes.scalars.push_back({vertex.properties[k].name, {}});
  }
  std::vector<double> row(vertex.properties.size());
  for (const PlyElement& element : header.elements) {
    const bool is_vertex = &element == &vertex;
    ForEachValue(
        data, element,
        [&](std::int64_t, std::size_t k, double value) {
          if (is_vertex) {
            row[k] = value;
          }
        },
        [&](std::int64_t vertex_number) {
          if (is_vertex) {
            CheckColour(data, row, columns, vertex_number);
            AppendVertex(row, columns, attributes);
          }
        });
  }
  data.End();
  return attributes;
}

}  // namespace

PlyHeader ReadPlyHeader(std::string_view bytes, const std::string& name) {
  return PlyHeaderReader(bytes, name).Read();
}

TriMesh ReadPly(std::string_view bytes, const std::string& name) {
  PlyHeader header = ReadPlyHeader(bytes, name);
  return header.format == PlyFormat::kText
             ? ReadMeshData(PlyTextData(bytes, header, name), header, name)
             : ReadMeshData(PlyBinaryData(bytes, header, name), header, name);
}

std::vector<double> ReadPlyVertexScalar(std::string_view bytes, const std::string& scalar,
                                        const std::string& name) {
  PlyHeader header = ReadPlyHeader(bytes, name);
  PlyElement& vertex = FindElement(header, "vertex", name);
  const auto found = FindProperty(vertex, scalar);
  if (!found || vertex.properties[*found].length_type) {
    throw InputError(
        fmt::format("{}: a vertex has no '{}'; it has {}", name, Shown(scalar), Names(vertex)));
  }
  if (header.format == PlyFormat::kText) {
    vertex.properties[*found].type = PlyType::kDouble;  // keeps all digits
  }
  return header.format == PlyFormat::kText
             ? ReadScalar(PlyTextData(bytes, header, name), header, vertex, *found)
             : ReadScalar(PlyBinaryData(bytes, header, name), header, vertex, *found);
}

MeshAttributes ReadPlyAttributes(std::string_view bytes, const std::string& name) {
  PlyHeader header = ReadPlyHeader(bytes, name);
  const PlyElement& vertex = FindElement(header, "vertex", name);
  return header.format == PlyFormat::kText
             ? ReadAttributesData(PlyTextData(bytes, header, name), header, vertex)
             : ReadAttributesData(PlyBinaryData(bytes, header, name), header, vertex);
}

}  // namespace semblance::surfaces
