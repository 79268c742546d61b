// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/ply_layout.h"

#include <fmt/format.h>

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <map>
#include <sstream>

#include "surfaces/base/error.h"

namespace semblance {
namespace {

struct Property {
  std::size_t size = 0;        // bytes of one value
  std::size_t count_size = 0;  // of a list's length; 0 for a plain value
  std::string name = {}, type = {};
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  std::string format;
  std::vector<Element> elements;
  std::size_t size = 0;  // bytes, to the first byte of data
  std::string defect;
};

std::size_t SizeOf(const std::string& type) {
  static const std::map<std::string, std::size_t> kSizes = {
      {"char", 1},   {"int8", 1},    {"uchar", 1},  {"uint8", 1},  {"short", 2}, {"int16", 2},
      {"ushort", 2}, {"uint16", 2},  {"int", 4},    {"int32", 4},  {"uint", 4},  {"uint32", 4},
      {"float", 4},  {"float32", 4}, {"double", 8}, {"float64", 8}};
  const auto found = kSizes.find(type);
  return found == kSizes.end() ? 0 : found->second;
}

Property ReadProperty(std::istream& words) {
  std::string type, count_type, item_type, name;
  words >> type;
  if (type != "list") {
    words >> name;
    return {SizeOf(type), 0, name, type};
  }
  words >> count_type >> item_type >> name;
  return {SizeOf(item_type), SizeOf(count_type), name, item_type};
}

void ReadHeaderLine(const std::string& line, Header& header) {
  std::istringstream words(line);
  std::string keyword;
  words >> keyword;
  if (keyword == "format") {
    words >> header.format;
  } else if (keyword == "element") {
    Element element;
    words >> element.name >> element.count;
    header.elements.push_back(element);
  } else if (keyword == "property" && !header.elements.empty()) {
    header.elements.back().properties.push_back(ReadProperty(words));
    if (header.elements.back().properties.back().size == 0) {
      header.defect = fmt::format("has a property of unknown type: '{}'", line);
    }
  }
}

Header ReadHeader(std::string_view bytes) {
  Header header;
  if (!bytes.starts_with("ply")) {
    header.defect = "does not begin with 'ply'";
    return header;
  }
  for (std::size_t begin = 0; begin < bytes.size();) {
    const std::size_t end = bytes.find('\n', begin);
    if (end == std::string_view::npos) {
      break;
    }
    std::string line(bytes.substr(begin, end - begin));
    if (line.ends_with('\r')) {
      line.pop_back();
    }
    begin = end + 1;
    if (line == "end_header") {
      header.size = begin;
      return header;
    }
    ReadHeaderLine(line, header);
  }
  header.defect = "is truncated: its header has no end";
  return header;
}

std::uint64_t ReadCount(std::string_view bytes, std::size_t at, std::size_t size, bool big_endian) {
  std::uint64_t value = 0;
  for (std::size_t b = 0; b < size; ++b) {
    const std::size_t from = big_endian ? at + b : at + size - 1 - b;
    value = value << 8 | static_cast<unsigned char>(bytes[from]);
  }
  return value;
}

std::string BinaryDefect(const Header& header, std::string_view bytes) {
  const bool big_endian = header.format == "binary_big_endian";
  std::size_t at = header.size;
  for (const Element& element : header.elements) {
    for (std::uint64_t n = 0; n < element.count; ++n) {
      for (const Property& property : element.properties) {
        std::size_t values = 1;
        if (property.count_size > 0 && at + property.count_size <= bytes.size()) {
          values = ReadCount(bytes, at, property.count_size, big_endian);
        }
        at += property.count_size + values * property.size;
        if (at > bytes.size()) {
          return fmt::format(
              "is truncated: its header says {} of element '{}', its {} bytes end in number {}",
              element.count, element.name, bytes.size(), n + 1);
        }
      }
    }
  }
  return {};
}

std::string TextDefect(const Header& header, std::string_view bytes) {
  std::uint64_t expected = 0, found = 0;
  for (const Element& element : header.elements) {
    expected += element.count;
  }
  std::istringstream lines{std::string(bytes.substr(header.size))};
  for (std::string line; std::getline(lines, line);) {
    found += line.find_first_not_of(" \t\r") != std::string::npos;
  }
  return found >= expected
             ? ""
             : fmt::format("is truncated: its header says {} lines of data, it has {}", expected,
                           found);
}

template <class T>
double FromBits(std::uint64_t bits, std::size_t size) {
  T value;
  std::memcpy(&value, &bits, size);  // little-endian, as every machine this runs on
  return static_cast<double>(value);
}

double ReadNumber(std::string_view bytes, std::size_t at, const Property& property,
                  bool big_endian) {
  const std::uint64_t bits = ReadCount(bytes, at, property.size, big_endian);
  const std::string& type = property.type;
  if (type.starts_with("float") || type == "double") {
    return property.size == 4 ? FromBits<float>(bits, 4) : FromBits<double>(bits, 8);
  }
  if (type.starts_with("u")) {
    return static_cast<double>(bits);
  }
  return property.size == 1   ? FromBits<std::int8_t>(bits, 1)
         : property.size == 2 ? FromBits<std::int16_t>(bits, 2)
                              : FromBits<std::int32_t>(bits, 4);
}

// Which property of a vertex has the name; its elements must be all plain values.
std::size_t FindScalar(const Element& vertex, const std::string& name, const std::string& where) {
  std::vector<std::string> names;
  for (std::size_t k = 0; k < vertex.properties.size(); ++k) {
    if (vertex.properties[k].count_size > 0) {
      throw InputError(fmt::format("{}: a vertex has the list '{}'; write plain values", where,
                                   vertex.properties[k].name));
    }
    if (vertex.properties[k].name == name) {
      return k;
    }
    names.push_back(vertex.properties[k].name);
  }
  throw InputError(
      fmt::format("{}: a vertex has no '{}'; it has {}", where, name, fmt::join(names, ", ")));
}

std::vector<double> TextScalar(std::string_view data, std::size_t count, std::size_t column,
                               const std::string& where) {
  std::vector<double> values;
  std::istringstream lines{std::string(data)};
  for (std::string line; values.size() < count && std::getline(lines, line);) {
    std::istringstream words(line);
    std::string word;
    std::size_t k = 0;
    while (k <= column && words >> word) {
      ++k;
    }
    if (k == 0) {
      continue;  // an empty line
    }
    char* end = nullptr;
    values.push_back(std::strtod(word.c_str(), &end));
    if (k <= column || end == word.c_str() || *end != 0) {
      throw InputError(
          fmt::format("{}: vertex {}: '{}' is no number", where, values.size() - 1, line));
    }
  }
  return values;
}

std::vector<double> BinaryScalar(std::string_view data, const Element& vertex, std::size_t column,
                                 bool big_endian) {
  std::size_t stride = 0, offset = 0;
  for (std::size_t k = 0; k < vertex.properties.size(); ++k) {
    offset = k == column ? stride : offset;
    stride += vertex.properties[k].size;
  }
  std::vector<double> values(vertex.count);
  for (std::size_t v = 0; v < values.size(); ++v) {
    values[v] = ReadNumber(data, v * stride + offset, vertex.properties[column], big_endian);
  }
  return values;
}

}  // namespace

std::vector<double> PlyVertexScalar(std::string_view bytes, const std::string& name,
                                    const std::string& where) {
  const std::string defect = PlyDefect(bytes);
  if (!defect.empty()) {
    throw IoError(fmt::format("{} {}", where, defect));
  }
  const Header header = ReadHeader(bytes);
  if (header.elements.empty() || header.elements[0].name != "vertex") {
    throw InputError(fmt::format("{}: the first element is not 'vertex'", where));
  }
  const Element& vertex = header.elements[0];
  const std::size_t column = FindScalar(vertex, name, where);
  const std::string_view data = bytes.substr(header.size);
  return header.format == "ascii"
             ? TextScalar(data, vertex.count, column, where)
             : BinaryScalar(data, vertex, column, header.format == "binary_big_endian");
}

std::string PlyDefect(std::string_view bytes) {
  const Header header = ReadHeader(bytes);
  if (!header.defect.empty()) {
    return header.defect;
  }
  return header.format == "ascii" ? TextDefect(header, bytes) : BinaryDefect(header, bytes);
}

}  // namespace semblance
