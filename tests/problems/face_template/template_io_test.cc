// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face_template/template_io.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "problems/output/files.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

class TemplateIo : public ::testing::Test {
 protected:
  TemplateIo()
      : folder_(std::filesystem::temp_directory_path() /
                (std::string("semblance_template_") +
                 ::testing::UnitTest::GetInstance()->current_test_info()->name() +
                 std::to_string(getpid()))),
        path_(folder_ / "face.json") {
    std::filesystem::create_directories(folder_);
  }
  ~TemplateIo() override { std::filesystem::remove_all(folder_); }

  static const TemplateFace& Face() {
    static const TemplateFace face = MakeTemplateFace({.max_level = 2});
    return face;
  }

  // Writes the good template, changed by `edit`, and gives the message of reading it.
  template <class Edit>
  std::string MessageAfter(const Edit& edit) {
    WriteTemplate(path_, Face());
    auto json = nlohmann::json::parse(ReadFileBytes(path_));
    edit(json);
    WriteFileAtomically(path_, json.dump());
    return MessageOfReading();
  }

  std::string MessageOfReading() {
    try {
      ReadTemplate(path_);
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), AllOf(StartsWith(path_.string() + ": "), Not(HasSubstr("\n"))));
      return error.what();
    }
    return "accepted";
  }

  std::filesystem::path folder_, path_;
};

TEST_F(TemplateIo, RoundTripIsExact) {
  WriteTemplate(path_, Face());
  const TemplateFace read = ReadTemplate(path_);
  EXPECT_EQ(read.site_uv, Face().site_uv);
  ASSERT_EQ(read.features.size(), Face().features.size());
  for (std::size_t k = 0; k < read.features.size(); ++k) {
    EXPECT_EQ(read.features[k].name, Face().features[k].name);
    EXPECT_EQ(read.features[k].vertices, Face().features[k].vertices);
    EXPECT_EQ(read.features[k].region->center, Face().features[k].region->center);
    EXPECT_EQ(read.features[k].region->radius_mm, Face().features[k].region->radius_mm);
  }
  for (int level = 0; level <= 2; ++level) {
    EXPECT_EQ(read.surface.Net(level).vertices, Face().surface.Net(level).vertices) << level;
  }
}

TEST_F(TemplateIo, SecondWritingGivesTheSameBytes) {
  WriteTemplate(path_, Face());
  const std::string first = ReadFileBytes(path_);
  WriteTemplate(path_, ReadTemplate(path_));
  EXPECT_EQ(ReadFileBytes(path_), first);
}

TEST_F(TemplateIo, KeepsExtraSitesAndFeaturesWithoutRegion) {
  TemplateFace face = Face();
  face.site_uv["mmb_l"] = {0.7, 0.15};
  face.features[0].region.reset();
  WriteTemplate(path_, face);
  const TemplateFace read = ReadTemplate(path_);
  EXPECT_EQ(read.site_uv.at("mmb_l"), Vec2(0.7, 0.15));
  EXPECT_FALSE(read.features[0].region.has_value());
}

TEST_F(TemplateIo, NamesAMissingSite) {
  EXPECT_THAT(MessageAfter([](auto& json) { json["site_uv"].erase("zy_l"); }),
              HasSubstr("site 'zy_l' is missing"));
}

TEST_F(TemplateIo, NamesASiteOutsideTheDomain) {
  EXPECT_THAT(MessageAfter([](auto& json) { json["site_uv"]["g"][1] = 1.5; }),
              AllOf(HasSubstr("site 'g'"), HasSubstr("(0.5, 1.5)"), HasSubstr("[0, 1]")));
}

TEST_F(TemplateIo, NamesAVertexThatTheSurfaceDoesNotHave) {
  EXPECT_THAT(MessageAfter([](auto& json) {
                json["features"][1]["vertices"][0] = {2, 1, 35};
              }),
              AllOf(HasSubstr("feature 'mouth'"), HasSubstr("[2, 1, 35]")));
  EXPECT_THAT(MessageAfter([](auto& json) {
                json["features"][1]["vertices"][0] = {3, 1, 1};
              }),
              HasSubstr("[3, 1, 1]"));
  EXPECT_THAT(MessageAfter([](auto& json) {
                json["features"][1]["vertices"][0] = {0, 1, 1};
              }),
              HasSubstr("levels 1 to 2"));
}

TEST_F(TemplateIo, NamesARadiusThatIsNotPositive) {
  EXPECT_THAT(MessageAfter([](auto& json) { json["features"][0]["region"]["radius_mm"] = 0; }),
              AllOf(HasSubstr("feature 'nose'"), HasSubstr("radius_mm 0")));
}

TEST_F(TemplateIo, NamesWhatIsMissingOrOfTheWrongKind) {
  EXPECT_THAT(MessageAfter([](auto& json) { json.erase("features"); }), HasSubstr("features"));
  EXPECT_THAT(MessageAfter([](auto& json) { json["site_uv"]["g"] = "here"; }),
              HasSubstr("site 'g'"));
  EXPECT_THAT(MessageAfter([](auto& json) {
                json["site_uv"]["g"] = {0.5, 0.5, 0.5};
              }),
              HasSubstr("site 'g'"));
  EXPECT_THAT(MessageAfter([](auto& json) { json["format"] = "other"; }),
              HasSubstr("semblance template"));
  WriteFileAtomically(path_, "{\"format\": ");
  EXPECT_THAT(MessageOfReading(), HasSubstr("not a template"));
}

TEST_F(TemplateIo, AFileThatIsNotThereIsAnIoError) {
  EXPECT_THROW(ReadTemplate(folder_ / "none.json"), IoError);
  WriteTemplate(path_, Face());
  std::filesystem::remove(folder_ / "face.hspline.json");
  EXPECT_THROW(ReadTemplate(path_), IoError);
}

TEST_F(TemplateIo, RefusesToWriteWhatItWouldNotRead) {
  TemplateFace face = Face();
  face.site_uv.erase("me");
  EXPECT_THROW(WriteTemplate(path_, face), InputError);
  EXPECT_FALSE(std::filesystem::exists(path_));
}

}  // namespace
}  // namespace semblance
