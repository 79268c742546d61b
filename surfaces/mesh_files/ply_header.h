// SPDX-License-Identifier: GPL-3.0-or-later
// The header of a PLY file: what its data are and how many.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace semblance {

enum class PlyFormat { kText, kLittleEndian, kBigEndian };
enum class PlyType { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };

std::size_t PlyTypeSize(PlyType type);  // bytes
bool IsWhole(PlyType type);             // whether its numbers are whole

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::kFloat;      // of a list: of its items
  std::optional<PlyType> length_type;  // of a list
};

struct PlyElement {
  std::string name;
  std::int64_t count = 0;
  std::vector<PlyProperty> properties;
};

struct PlyHeader {
  std::optional<PlyFormat> format;
  std::vector<PlyElement> elements;
  std::size_t bytes = 0;   // to the first byte of data
  std::int64_t lines = 0;  // to the first line of data
};

// The header of a PLY whose data can be as long as the header says, if lists are empty: what is
// kept of the data takes a few times the file's size at most. name: the file, for messages.
// Throws InputError with the line for anything else.
PlyHeader ReadPlyHeader(std::string_view bytes, const std::string& name);

}  // namespace semblance
