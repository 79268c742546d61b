// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/section_pictures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <pugixml.hpp>
#include <regex>

#include "problems/subject/average_skull.h"
#include "problems/subject/sites.h"
#include "tests/testing/shapes.h"

namespace semblance::problems {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

// Every point of every outline of one colour, in mm from the lower left corner of the picture.
std::vector<Vec2> OutlinePoints(const std::string& svg, const std::string& colour) {
  pugi::xml_document document;
  EXPECT_TRUE(document.load_string(svg.c_str()));
  std::vector<Vec2> points;
  for (const pugi::xpath_node& found : document.select_nodes("//path")) {
    if (found.node().attribute("stroke").value() != colour) {
      continue;
    }
    const std::string path = found.node().attribute("d").value();
    const std::regex pair("[ML]([-0-9.]+) ([-0-9.]+)");
    for (auto at = std::sregex_iterator(path.begin(), path.end(), pair);
         at != std::sregex_iterator(); ++at) {
      points.emplace_back(std::stod((*at)[1]), std::stod((*at)[2]));
    }
  }
  return points;
}

const HeadPlane kLevel{
    .name = "axial_n",
    .plane = {.origin = {0, 0, 10}, .right = Vec3::UnitX(), .up = -Vec3::UnitY()},
    .left = "right",
    .right = "left"};

TEST(SectionPictures, AnOutlineHasItsSizeInMillimetres) {
  const TriMesh sphere = testing::SphereMesh({0, 0, 0}, 50, 100);
  const std::string svg =
      SectionSvg(kLevel, {{"skull", "#8a5a00", &sphere}}, Bounds(sphere), nullptr);
  const std::vector<Vec2> points = OutlinePoints(svg, "#8a5a00");
  ASSERT_GT(points.size(), 100u);
  // The bar of the scale has 20 mm.
  pugi::xml_document document;
  ASSERT_TRUE(document.load_string(svg.c_str()));
  double bar = 0;
  for (const pugi::xpath_node& line : document.select_nodes("//line[@y1 = @y2]")) {
    const double length =
        line.node().attribute("x2").as_double() - line.node().attribute("x1").as_double();
    bar = bar == 0 ? length : bar;
  }
  ASSERT_GT(bar, 0);
  Vec2 middle = Vec2::Zero();
  for (const Vec2& p : points) {
    middle += p / static_cast<double>(points.size());
  }
  for (const Vec2& p : points) {
    EXPECT_NEAR((p - middle).norm() / bar * 20, std::sqrt(50.0 * 50 - 10 * 10), 0.3);
  }
}

TEST(SectionPictures, TheLegendNamesWhatThePlaneCuts) {
  const TriMesh sphere = testing::SphereMesh({0, 0, 0}, 50, 20),
                apart = testing::SphereMesh({0, 0, 90}, 30, 20);
  const std::string svg =
      SectionSvg(kLevel, {{"skull", "#8a5a00", &sphere}, {"true skin", "#009e73", &apart}},
                 Bounds(sphere), nullptr);
  EXPECT_THAT(svg, HasSubstr(">skull</text>"));
  EXPECT_THAT(svg, Not(HasSubstr("true skin")));
  EXPECT_THAT(svg, Not(HasSubstr("<image")));
}

TEST(SectionPictures, TheSliceLiesWhereItsPointsAre) {
  // Air but for a brick of bone from x = 10 to 40, y = -30 to -10.
  CtVolume volume;
  volume.columns = volume.rows = 101;
  volume.slices = 21;
  volume.spacing_mm = {1, 1, 1};
  volume.origin = {-50, -50, 0};
  for (int s = 0; s < volume.slices; ++s) {
    for (int r = 0; r < volume.rows; ++r) {
      for (int c = 0; c < volume.columns; ++c) {
        const bool bone = c - 50 >= 10 && c - 50 <= 40 && r - 50 >= -30 && r - 50 <= -10;
        volume.values.push_back(bone ? 1500 : -1000);
      }
    }
  }
  const GreySlice slice = SampleSlice(volume, kLevel.plane, "axial_n", 0.5);
  for (int y = 0; y < slice.height; ++y) {
    for (int x = 0; x < slice.width; ++x) {
      const Vec3 at = kLevel.plane.InSpace(slice.low_mm +
                                           slice.pixel_mm * Vec2(x + 0.5, slice.height - y - 0.5));
      const double from_edge = std::min({at.x() - 10, 40 - at.x(), at.y() + 30, -10 - at.y()});
      const int grey = slice.grey[static_cast<std::size_t>(y * slice.width + x)];
      if (from_edge > 0) {
        ASSERT_GT(grey, 200) << at.transpose();
      } else if (from_edge < -1) {
        ASSERT_EQ(grey, 0) << at.transpose();
      }
    }
  }
  const TriMesh sphere = testing::SphereMesh({0, 0, 0}, 50, 20);
  EXPECT_THAT(SectionSvg(kLevel, {{"skull", "#8a5a00", &sphere}}, Bounds(sphere), &slice),
              HasSubstr("<image"));
}

TEST(HeadPlanes, ContainTheirSitesHoweverTheHeadLies) {
  std::vector<SitePoint> sites;
  const Mat3 turn = (Eigen::AngleAxisd(0.3, Vec3(1, 2, 3).normalized())).toRotationMatrix();
  const Vec3 shift(120, -200, 40);
  for (const std::string& site : StandardSiteCodes()) {
    sites.push_back({site, turn * AverageSite(site) + shift});
  }
  const auto at = [&](const char* site) -> Vec3 { return turn * AverageSite(site) + shift; };
  const auto planes = HeadPlanes(sites);
  ASSERT_EQ(planes.size(), kHeadPlaneTitles.size());
  for (std::size_t k = 0; k < planes.size(); ++k) {
    EXPECT_EQ(planes[k].name, kHeadPlaneTitles[k].first);
  }
  EXPECT_NEAR(planes[0].plane.Height_mm(at("n")), 0, 1e-6);
  EXPECT_NEAR(planes[0].plane.Height_mm(at("me")), 0, 0.5);  // the midline
  EXPECT_NEAR(planes[1].plane.Height_mm(at("n")), 0, 1e-6);
  EXPECT_NEAR(planes[2].plane.Height_mm(at("mp")), 0, 1e-6);
  EXPECT_NEAR(planes[3].plane.Height_mm(at("zy_l")), 0, 0.5);
  EXPECT_NEAR(planes[3].plane.Height_mm(at("zy_r")), 0, 0.5);
  // The subject's left is on the right of an axial picture, the chin below nasion.
  EXPECT_GT(planes[1].plane.InPicture(at("zy_l")).x(), planes[1].plane.InPicture(at("zy_r")).x());
  EXPECT_LT(planes[0].plane.InPicture(at("me")).y(), planes[0].plane.InPicture(at("n")).y());
  EXPECT_THAT(HeadPlanes(std::span(sites).first(2)), IsEmpty());
}

}  // namespace
}  // namespace semblance::problems
