// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/base/npy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <string>

#include "surfaces/base/error.h"
#include "surfaces/base/geometry.h"

namespace semblance::surfaces {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

template <class Number>
std::string Raw(const std::vector<Number>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Number)};
}

// The bytes that numpy.save writes: magic, version, length of the header, header, data.
std::string Npy(const std::string& type, const std::string& shape, const std::string& data,
                const std::string& fortran = "False", char version = 1) {
  const std::string header =
      "{'descr': " + type + ", 'fortran_order': " + fortran + ", 'shape': " + shape + ", }\n";
  std::string bytes = std::string("\x93NUMPY") + version + '\0';
  bytes += static_cast<char>(header.size() & 255);
  bytes += static_cast<char>(header.size() >> 8);
  bytes += version == 1 ? std::string() : std::string(2, '\0');
  return bytes + header + data;
}

std::string NpyFault(const std::string& bytes) {
  try {
    ParseNpy(bytes, "a.npy");
  } catch (const InputError& error) {
    return error.what();
  }
  return "none";
}

TEST(Npy, EveryKindOfNumberIsReadAsItStands) {
  EXPECT_THAT(ParseNpy(Npy("'<f8'", "(2,)", Raw<double>({0.1, -3})), "a").values,
              ElementsAre(0.1, -3));
  EXPECT_THAT(ParseNpy(Npy("'<f4'", "(2,)", Raw<float>({0.5, -3})), "a").values,
              ElementsAre(0.5, -3));
  EXPECT_THAT(ParseNpy(Npy("'<i8'", "(2,)", Raw<std::int64_t>({5000000000, -3})), "a").values,
              ElementsAre(5000000000, -3));
  EXPECT_THAT(ParseNpy(Npy("'<i4'", "(2,)", Raw<std::int32_t>({70000, -3})), "a").values,
              ElementsAre(70000, -3));
  EXPECT_THAT(ParseNpy(Npy("'<i2'", "(2,)", Raw<std::int16_t>({300, -3})), "a").values,
              ElementsAre(300, -3));
  EXPECT_THAT(ParseNpy(Npy("'|i1'", "(2,)", Raw<std::int8_t>({7, -3})), "a").values,
              ElementsAre(7, -3));
}

TEST(Npy, OrderIsTheLastIndexFastestWhateverTheFileHas) {
  const std::vector<std::int16_t> rows = {1, 2, 3, 4, 5, 6}, columns = {1, 4, 2, 5, 3, 6};
  const NpyArray c = ParseNpy(Npy("'<i2'", "(2, 3)", Raw(rows)), "a");
  const NpyArray fortran = ParseNpy(Npy("'<i2'", "(2, 3)", Raw(columns), "True", 2), "a");
  EXPECT_THAT(c.shape, ElementsAre(2, 3));
  EXPECT_EQ(c.values, fortran.values);
  EXPECT_THAT(c.values, ElementsAre(1, 2, 3, 4, 5, 6));
}

TEST(Npy, UnreadableFilesAreReported) {
  EXPECT_THAT(NpyFault("PK\x03\x04 something else"), HasSubstr("a.npy: not a .npy file"));
  EXPECT_THAT(NpyFault(Npy("'|O'", "(1,)", "x")), HasSubstr("'|O'"));
  EXPECT_THAT(NpyFault(Npy("'>f8'", "(1,)", Raw<double>({1}))), HasSubstr("little-endian"));
  EXPECT_THAT(NpyFault(Npy("[('x', '<f8')]", "(1,)", Raw<double>({1}))), HasSubstr("fields"));
  EXPECT_THAT(NpyFault(Npy("'<f8'", "(2,)", Raw<double>({1}))), HasSubstr("there are 8"));
  EXPECT_THAT(NpyFault(Npy("'<f8'", "(4294967296, 4294967296)", "")), HasSubstr("too large"));
  EXPECT_THAT(NpyFault(Npy("'<f8'", "(1,)", Raw<double>({kNaN}))), HasSubstr("not finite"));
  for (const char* wrong : {"(-1,)", "(1.0,)", "(x,)", "(0, 99999999999999999999)"}) {
    EXPECT_THAT(NpyFault(Npy("'<f8'", wrong, Raw<double>({1}))), HasSubstr("not one of whole"));
  }
  EXPECT_THAT(NpyFault(Npy("'<f8'", "()", Raw<double>({1}))), HasSubstr("no shape"));
  EXPECT_THAT(NpyFault(Npy("'<f8'", "(1,)", Raw<double>({1})).substr(0, 30)), HasSubstr("header"));
}

}  // namespace
}  // namespace semblance::surfaces
