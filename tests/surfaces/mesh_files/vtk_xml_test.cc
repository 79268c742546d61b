// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh_files/vtk_xml.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <pugixml.hpp>

#include "surfaces/base/error.h"

namespace semblance::surfaces {
namespace {

using ::testing::ElementsAre;

TriMesh Tent() {
  return {.points = {{0, 0, 0}, {1.0 / 3, 0, 0}, {0, 1e-9, 2}, {-7, 8, 1e9}},
          .triangles = {{0, 1, 2}, {2, 1, 3}}};
}

MeshAttributes Carried() {
  return {.normals = {{0, 0, 1}, {0, 1, 0}, {1, 0, 0}, {0, 0, -1}},
          .colors = {{1, 2, 3}, {4, 5, 6}, {7, 8, 255}, {0, 0, 0}},
          .scalars = {{"quality", {0.1, NAN, 3, 4}},
                      {"scalar_error_mm", {0.1, NAN, 3, 4}},
                      {"a<b&\"\x01", {5, 6, 7, 8}},
                      {"error_mm", {9, 10, 11, 12}}}};
}

// By the table of RFC 4648, bit by bit.
std::string Decoded(const std::string& text) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bits, bytes;
  for (const char c : text) {
    for (int k = 5; k >= 0 && digits.find(c) != digits.npos; --k) {
      bits += static_cast<char>('0' + (digits.find(c) >> k & 1));
    }
  }
  for (std::size_t k = 0; k + 8 <= bits.size(); k += 8) {
    bytes += static_cast<char>(std::stoi(bits.substr(k, 8), nullptr, 2));
  }
  return bytes;
}

template <class T>
std::vector<T> Numbers(const pugi::xml_node& array) {
  const std::string bytes = Decoded(array.text().as_string());
  std::uint64_t size = 0;
  std::memcpy(&size, bytes.data(), 8);
  EXPECT_EQ(size, bytes.size() - 8);
  std::vector<T> numbers(size / sizeof(T));
  std::memcpy(numbers.data(), bytes.data() + 8, size);
  return numbers;
}

std::vector<std::string> Names(const pugi::xml_node& data) {
  std::vector<std::string> names;
  for (const pugi::xml_node& array : data.children("DataArray")) {
    names.emplace_back(array.attribute("Name").value());
  }
  return names;
}

pugi::xml_node Array(const pugi::xml_node& data, const char* name) {
  return data.find_child_by_attribute("DataArray", "Name", name);
}

TEST(VtkXml, AVtpHoldsEveryNumberToTheBit) {
  pugi::xml_document document;
  ASSERT_TRUE(document.load_string(EncodeVtp(Tent(), Carried()).c_str()));
  const pugi::xml_node piece = document.child("VTKFile").child("PolyData").child("Piece");
  EXPECT_STREQ(document.child("VTKFile").attribute("header_type").value(), "UInt64");
  EXPECT_EQ(piece.attribute("NumberOfPoints").as_int(), 4);
  EXPECT_EQ(piece.attribute("NumberOfPolys").as_int(), 2);
  EXPECT_THAT(Numbers<double>(piece.child("Points").child("DataArray")),
              ElementsAre(0, 0, 0, 1.0 / 3, 0, 0, 0, 1e-9, 2, -7, 8, 1e9));
  EXPECT_THAT(Numbers<std::int64_t>(Array(piece.child("Polys"), "connectivity")),
              ElementsAre(0, 1, 2, 2, 1, 3));
  EXPECT_THAT(Numbers<std::int64_t>(Array(piece.child("Polys"), "offsets")), ElementsAre(3, 6));
}

TEST(VtkXml, ValuesHaveNamesThatAReaderCanUse) {
  pugi::xml_document document;
  ASSERT_TRUE(document.load_string(EncodeVtp(Tent(), Carried()).c_str()));
  const pugi::xml_node data = document.select_node("//PointData").node();
  // `quality` repeats the error; what XML cannot hold is replaced, and no name is there twice.
  EXPECT_THAT(Names(data), ElementsAre("error_mm", "a_b___", "error_mm_2", "Normals", "RGB"));
  EXPECT_STREQ(data.attribute("Scalars").value(), "error_mm");
  EXPECT_STREQ(data.attribute("Normals").value(), "Normals");
  const std::vector<double> error = Numbers<double>(Array(data, "error_mm"));
  EXPECT_EQ(error[0], 0.1);
  EXPECT_TRUE(std::isnan(error[1]));
  EXPECT_THAT(Numbers<double>(Array(data, "error_mm_2")), ElementsAre(9, 10, 11, 12));
  EXPECT_THAT(Numbers<double>(Array(data, "Normals")),
              ElementsAre(0, 0, 1, 0, 1, 0, 1, 0, 0, 0, 0, -1));
  EXPECT_THAT(Numbers<std::uint8_t>(Array(data, "RGB")),
              ElementsAre(1, 2, 3, 4, 5, 6, 7, 8, 255, 0, 0, 0));
}

TEST(VtkXml, QualityStaysWhereItSaysSomethingOfItsOwn) {
  MeshAttributes own;
  own.scalars = {{"quality", {1, 2, 3, 4}}, {"scalar_x", {1, 2, 3, 5}}};
  pugi::xml_document document;
  ASSERT_TRUE(document.load_string(EncodeVtp(Tent(), own).c_str()));
  EXPECT_THAT(Names(document.select_node("//PointData").node()), ElementsAre("quality", "x"));
}

TEST(VtkXml, AVtuHasTheSameMeshAsTriangles) {
  pugi::xml_document vtp, vtu;
  ASSERT_TRUE(vtp.load_string(EncodeVtp(Tent(), Carried()).c_str()));
  ASSERT_TRUE(vtu.load_string(EncodeVtu(Tent(), Carried()).c_str()));
  const pugi::xml_node piece = vtu.child("VTKFile").child("UnstructuredGrid").child("Piece");
  EXPECT_EQ(piece.attribute("NumberOfCells").as_int(), 2);
  EXPECT_THAT(Numbers<std::uint8_t>(Array(piece.child("Cells"), "types")), ElementsAre(5, 5));
  for (const char* name : {"Points", "connectivity", "offsets", "error_mm", "RGB"}) {
    const std::string path = std::string("//DataArray[@Name='") + name + "']";
    EXPECT_STREQ(vtu.select_node(path.c_str()).node().text().as_string(),
                 vtp.select_node(path.c_str()).node().text().as_string())
        << name;
  }
}

TEST(VtkXml, AttributesOfAnotherSizeAreRefused) {
  MeshAttributes few;
  few.scalars = {{"x", {1, 2, 3}}};
  EXPECT_THROW(EncodeVtp(Tent(), few), InputError);
  EXPECT_THROW(EncodeVtu(Tent(), few), InputError);
}

}  // namespace
}  // namespace semblance::surfaces
