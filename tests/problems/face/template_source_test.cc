// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/template_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::problems {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

class TemplateIo : public ::testing::Test {
 protected:
  static const TemplateFace& Face() {
    static const TemplateFace face = MakeTemplateFace({.max_level = 2});
    return face;
  }

  FileTemplate Written(const TemplateFace& face = Face()) const {
    return WriteTemplate(folder_.Path(), face);
  }

  // The message of reading a good template whose features were changed by `edit`.
  template <class Edit>
  std::string MessageAfter(const Edit& edit) const {
    const FileTemplate files = Written();
    auto json = nlohmann::json::parse(ReadFileBytes(files.features));
    edit(json);
    WriteFileAtomically(files.features, json.dump());
    return MessageOfReading(files, files.features);
  }
  // The same with `from` in the table of sites replaced by `to`.
  std::string MessageAfterSites(const std::string& from, const std::string& to) const {
    const FileTemplate files = Written();
    std::string text = ReadFileBytes(files.sites);
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    WriteFileAtomically(files.sites, text.replace(at, from.size(), to));
    return MessageOfReading(files, files.sites);
  }

  static std::string MessageOfReading(const FileTemplate& files,
                                      const std::filesystem::path& faulty) {
    try {
      ReadTemplate(files);
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), AllOf(StartsWith(faulty.string() + ":"), Not(HasSubstr("\n"))));
      return error.what();
    }
    return "accepted";
  }

  testing::ScratchFolder folder_;
};

TEST_F(TemplateIo, RoundTripIsExact) {
  const TemplateFace read = ReadTemplate(Written());
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
  const FileTemplate files = Written();
  std::vector<std::string> first, second;
  for (const std::filesystem::path& file : TemplateFiles(files)) {
    first.push_back(ReadFileBytes(file));
  }
  EXPECT_EQ(first.size(), 3);
  for (const std::filesystem::path& file : TemplateFiles(Written(ReadTemplate(files)))) {
    second.push_back(ReadFileBytes(file));
  }
  EXPECT_EQ(first, second);
}

TEST_F(TemplateIo, KeepsExtraSitesAndFeaturesWithoutRegion) {
  TemplateFace face = Face();
  face.site_uv["mmb_l"] = {0.7, 0.15};
  face.features[0].region.reset();
  const TemplateFace read = ReadTemplate(Written(face));
  EXPECT_EQ(read.site_uv.at("mmb_l"), Vec2(0.7, 0.15));
  EXPECT_FALSE(read.features[0].region.has_value());
}

TEST_F(TemplateIo, AFaceNeedsNoFeatures) {
  FileTemplate files = Written();
  files.features.clear();
  EXPECT_TRUE(ReadTemplate(files).features.empty());
  EXPECT_EQ(TemplateFiles(files).size(), 2);
}

TEST_F(TemplateIo, NamesASiteThatIsMissingOrTwiceOrOutsideTheDomain) {
  EXPECT_THAT(MessageAfterSites("zy_l,", "zy_x,"), HasSubstr("site 'zy_l' is missing"));
  EXPECT_THAT(MessageAfterSites("zy_l,", "zy_r,"), HasSubstr("site 'zy_r' appears twice"));
  EXPECT_THAT(MessageAfterSites("\ng,0.5,", "\ng,1.5,"),
              AllOf(HasSubstr("site 'g'"), HasSubstr("(1.5, "), HasSubstr("[0, 1]")));
  EXPECT_THAT(MessageAfterSites("\ng,0.5,", "\ng,here,"), HasSubstr("here"));
  EXPECT_THAT(MessageAfterSites("site,u,v", "site,u,w"), HasSubstr("'v'"));
}

TEST_F(TemplateIo, RefusesLeftAndRightThatHaveChangedPlaces) {
  const auto message_with = [this](const std::vector<std::string>& exchanged) {
    TemplateFace face = Face();
    for (const std::string& pair : exchanged) {
      std::swap(face.site_uv.at(pair + "_l"), face.site_uv.at(pair + "_r"));
    }
    return testing::WordsOf<InputError>([&] { Written(face); });
  };
  std::vector<std::string> pairs;
  for (const auto& [code, uv] : Face().site_uv) {
    if (code.ends_with("_l")) {
      pairs.push_back(code.substr(0, code.size() - 2));
      EXPECT_THAT(message_with({pairs.back()}),
                  AllOf(HasSubstr(code), HasSubstr("the two have changed places")));
    }
  }
  EXPECT_THAT(message_with(pairs), HasSubstr("mirror image"));
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
  EXPECT_THAT(MessageAfter([](auto& json) {
                json["features"][1]["vertices"][0] = {1, 4294967297, 1};  // truncation would give 1
              }),
              HasSubstr("[1,4294967297,1]; it must be a list of 3 integers below a million"));
}

TEST_F(TemplateIo, NamesARadiusThatIsNotPositive) {
  EXPECT_THAT(MessageAfter([](auto& json) { json["features"][0]["region"]["radius_mm"] = 0; }),
              AllOf(HasSubstr("feature 'nose'"), HasSubstr("radius_mm 0")));
}

TEST_F(TemplateIo, NamesWhatIsMissingOrOfTheWrongKind) {
  EXPECT_THAT(MessageAfter([](auto& json) { json.erase("features"); }), HasSubstr("features"));
  EXPECT_THAT(MessageAfter([](auto& json) { json["format"] = "other"; }),
              HasSubstr("semblance template features"));
  const FileTemplate files = Written();
  WriteFileAtomically(files.features, "{\"format\": ");
  EXPECT_THAT(MessageOfReading(files, files.features), HasSubstr("this is not JSON"));
}

TEST_F(TemplateIo, AFileThatIsNotNamedOrNotThereIsAClearError) {
  EXPECT_THROW(ReadTemplate({}), InputError);
  FileTemplate files = Written();
  for (std::filesystem::path FileTemplate::*file :
       {&FileTemplate::surface, &FileTemplate::sites, &FileTemplate::features}) {
    FileTemplate wrong = files;
    wrong.*file = folder_ / "none";
    EXPECT_THROW(ReadTemplate(wrong), IoError);
  }
}

TEST(EmbeddedFace, IsAFaceInMillimetresWithAllItsParts) {
  const std::filesystem::path folder = SEMBLANCE_SOURCE_DIR "/configs/faces/ict";
  const TemplateFace face =
      ReadTemplate({folder / "head.hspline.json", folder / "sites.csv", folder / "features.json"});
  const auto at = [&](const char* site) { return face.surface.Point(face.site_uv.at(site)); };
  EXPECT_NEAR((at("zy_l") - at("zy_r")).norm(), 140, 15);  // bizygomatic breadth over skin
  EXPECT_NEAR((at("n") - at("me")).norm(), 120, 15);       // height of the face
  EXPECT_GT(at("zy_l").x(), at("zy_r").x());
  EXPECT_LT(face.surface.Normal(face.site_uv.at("g")).y(), -0.8);
  ASSERT_EQ(face.features.size(), 4);
  for (const TemplateFeature& feature : face.features) {
    EXPECT_GT(feature.vertices.size(), 50) << feature.name;
    EXPECT_TRUE(feature.region.has_value()) << feature.name;
  }
}

TEST_F(TemplateIo, RefusesToWriteWhatItWouldNotRead) {
  TemplateFace face = Face();
  face.site_uv.erase("me");
  EXPECT_THROW(Written(face), InputError);
  EXPECT_TRUE(std::filesystem::is_empty(folder_.Path()));
}

}  // namespace
}  // namespace semblance::problems
