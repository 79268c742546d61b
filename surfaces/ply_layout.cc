// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/ply_layout.h"

#include <fmt/format.h>

#include <cstdint>
#include <map>
#include <sstream>
#include <vector>

namespace semblance {
namespace {

struct Property {
  std::size_t size = 0;        // bytes of one value
  std::size_t count_size = 0;  // of a list's length; 0 for a plain value
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
  std::string type, count_type, item_type;
  words >> type;
  if (type != "list") {
    return {SizeOf(type), 0};
  }
  words >> count_type >> item_type;
  return {SizeOf(item_type), SizeOf(count_type)};
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

}  // namespace

std::string PlyDefect(std::string_view bytes) {
  const Header header = ReadHeader(bytes);
  if (!header.defect.empty()) {
    return header.defect;
  }
  return header.format == "ascii" ? TextDefect(header, bytes) : BinaryDefect(header, bytes);
}

}  // namespace semblance
