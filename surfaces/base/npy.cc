// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/base/npy.h"

#include <fmt/format.h>

#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <utility>

#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"

namespace semblance::surfaces {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr std::string_view kMagic = "\x93NUMPY";

[[noreturn]] void Fail(std::string_view name, const std::string& what) {
  throw InputError(fmt::format("{}: {}", name, what));
}

struct NpyHeader {
  std::string_view text;  // a Python dictionary
  std::string_view data;
};

NpyHeader SplitHeader(std::string_view bytes, std::string_view name) {
  if (bytes.size() < 10 || !bytes.starts_with(kMagic)) {
    Fail(name, "not a .npy file; save the array with numpy.save");
  }
  const auto byte = [&](std::size_t at) {
    return std::size_t{static_cast<unsigned char>(bytes[at])};
  };
  const std::size_t version = byte(6), begin = version == 1 ? 10 : 12;
  if (version < 1 || version > 3 || bytes.size() < begin) {
    Fail(name, fmt::format("a .npy file of version {}; versions 1 to 3 are read", version));
  }
  std::size_t length = byte(8) + (byte(9) << 8);
  if (version > 1) {
    length += (byte(10) << 16) + (byte(11) << 24);
  }
  if (length > bytes.size() - begin) {
    Fail(name, "the file ends inside its header; copy it again");
  }
  return {bytes.substr(begin, length), bytes.substr(begin + length)};
}

// Returns the header's text from behind 'key': to its end.
std::string_view TextAfterKey(std::string_view header, std::string_view key,
                              std::string_view name) {
  const std::size_t at = header.find(fmt::format("'{}':", key));
  if (at == std::string_view::npos) {
    Fail(name, fmt::format("the header has no '{}'; save the array with numpy.save", key));
  }
  std::string_view rest = header.substr(at + key.size() + 3);
  rest.remove_prefix(std::min(rest.find_first_not_of(' '), rest.size()));
  return rest;
}

std::vector<std::size_t> ParseShape(std::string_view header, std::string_view name) {
  const std::string_view text = TextAfterKey(header, "shape", name);
  const std::size_t end = text.find(')');
  std::vector<std::size_t> shape;
  for (std::size_t at = 1; text.starts_with('(') && end != std::string_view::npos && at < end;) {
    std::size_t extent = 0;
    const auto [stop, error] = std::from_chars(text.data() + at, text.data() + end, extent);
    if (error == std::errc()) {
      shape.push_back(extent);
      at = static_cast<std::size_t>(stop - text.data());
    } else if (text[at] == ' ' || text[at] == ',') {
      ++at;
    } else {
      Fail(name, fmt::format("the shape ({} is not one of whole numbers such as (60, 5000, 3)",
                             text.substr(1, end)));
    }
  }
  if (shape.empty()) {
    Fail(name, "the array has no shape, such as (60, 5000, 3)");
  }
  return shape;
}

// Returns the product of the extents and checks it against the number of bytes, without overflow.
std::size_t CountValues(const std::vector<std::size_t>& shape, std::size_t bytes, std::size_t size,
                        std::string_view name) {
  std::size_t count = 1;
  for (const std::size_t extent : shape) {
    if (extent != 0 && count > std::numeric_limits<std::size_t>::max() / extent / size) {
      Fail(name, fmt::format("shape ({}) is too large", fmt::join(shape, ", ")));
    }
    count *= extent;
  }
  if (count * size != bytes) {
    Fail(name, fmt::format("shape ({}) of {} bytes each needs {} bytes, and there are {}",
                           fmt::join(shape, ", "), size, count * size, bytes));
  }
  return count;
}

template <class Number>
std::vector<double> ReadValues(std::string_view data, const std::vector<std::size_t>& shape,
                               std::string_view name) {
  std::vector<double> values(CountValues(shape, data.size(), sizeof(Number), name));
  for (std::size_t k = 0; k < values.size(); ++k) {
    Number number;
    std::memcpy(&number, data.data() + k * sizeof(Number), sizeof(Number));
    values[k] = static_cast<double>(number);
    if (!std::isfinite(values[k])) {
      Fail(name, fmt::format("value {} is not finite", k));
    }
  }
  return values;
}

std::vector<double> ReadValues(std::string_view type, std::string_view data,
                               const std::vector<std::size_t>& shape, std::string_view name) {
  using Read =
      std::vector<double> (*)(std::string_view, const std::vector<std::size_t>&, std::string_view);
  constexpr std::pair<std::string_view, Read> kTypes[] = {
      {"<f8", &ReadValues<double>},       {"<f4", &ReadValues<float>},
      {"<i8", &ReadValues<std::int64_t>}, {"<i4", &ReadValues<std::int32_t>},
      {"<i2", &ReadValues<std::int16_t>}, {"|i1", &ReadValues<std::int8_t>},
      {"|u1", &ReadValues<std::uint8_t>}};
  for (const auto& [code, read] : kTypes) {
    if (type == code) {
      return read(data, shape, name);
    }
  }
  Fail(name,
       fmt::format("its values are of type '{}'; save them as float64, float32, int64, int32, "
                   "int16 or int8, little-endian",
                   type));
}

// Reorders values from Fortran's order, in which the first index varies fastest.
std::vector<double> WithLastIndexFastest(const std::vector<double>& values,
                                         const std::vector<std::size_t>& shape) {
  std::vector<double> result(values.size());
  std::vector<std::size_t> index(shape.size(), 0);
  for (const double value : values) {
    std::size_t at = 0;
    for (std::size_t d = 0; d < shape.size(); ++d) {
      at = at * shape[d] + index[d];
    }
    result[at] = value;
    for (std::size_t d = 0; d < shape.size() && ++index[d] == shape[d]; ++d) {
      index[d] = 0;
    }
  }
  return result;
}

}  // namespace

NpyArray ParseNpy(std::string_view bytes, std::string_view name) {
  const NpyHeader header = SplitHeader(bytes, name);
  std::string_view type = TextAfterKey(header.text, "descr", name);
  type = type.starts_with('\'') ? type.substr(1, type.find('\'', 1) - 1) : "of several fields";
  NpyArray array{.shape = ParseShape(header.text, name), .values = {}};
  array.values = ReadValues(type, header.data, array.shape, name);
  if (TextAfterKey(header.text, "fortran_order", name).starts_with("True")) {
    array.values = WithLastIndexFastest(array.values, array.shape);
  }
  return array;
}

NpyArray ReadNpy(const std::filesystem::path& path) {
  return ParseNpy(ReadFileBytes(path), path.string());
}

}  // namespace semblance::surfaces
