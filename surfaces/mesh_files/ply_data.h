// SPDX-License-Identifier: GPL-3.0-or-later
// The data of a PLY file behind its header, number by number: two classes of one interface, chosen
// by the header's format. BeginRow, Next for each number of the row, EndRow; End after all
// elements. Whatever is wrong is an InputError that names the file and the line (text) or byte
// (binary).
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

#include "surfaces/base/error.h"
#include "surfaces/mesh_files/ply_header.h"
#include "surfaces/mesh_files/read_parts.h"
#include "surfaces/mesh_files/text_lines.h"

namespace semblance {

// A line per row of an element.
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

  // Whole types may be written as any number: most of them are not kept.
  double Next(PlyType type) {
    return type == PlyType::kFloat ? lines_.NextFloat() : lines_.NextDouble();
  }
  // How many more numbers there can be.
  std::size_t MostItems(PlyType) { return lines_.RestOfLine().size() / 2 + 1; }

  [[noreturn]] void Fail(const std::string& what) const { lines_.Fail(what); }

 private:
  TextLines lines_;
};

// Numbers without anything between them.
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

}  // namespace semblance
