// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh_files/ply_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>

#include "surfaces/mesh_files/read_parts.h"
#include "surfaces/mesh_files/text_lines.h"

namespace semblance {
namespace {

class HeaderReader {
 public:
  HeaderReader(std::string_view bytes, const std::string& name) : lines_(bytes, name, {}) {}

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
    header_.bytes = lines_.Position();
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
    const std::int64_t count = lines_.NextInteger("number of elements", 0, kMostElements);
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

  // A name that none of the named things has yet.
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

  // Bytes of the shortest row: an empty list has its length alone; a number of a text has a digit
  // and what parts it from the next.
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

}  // namespace

std::size_t PlyTypeSize(PlyType type) {
  constexpr std::array<std::size_t, 8> kSizes = {1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

bool IsWhole(PlyType type) { return type != PlyType::kFloat && type != PlyType::kDouble; }

PlyHeader ReadPlyHeader(std::string_view bytes, const std::string& name) {
  return HeaderReader(bytes, name).Read();
}

}  // namespace semblance
