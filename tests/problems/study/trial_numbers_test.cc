// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/trial_numbers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "surfaces/base/json_text.h"

namespace semblance {
namespace {

using Json = nlohmann::json;
using ::testing::ElementsAre;
using ::testing::Pair;

// The same by way of a tree.
void AddNumbers(const Json& json, const std::string& path, std::map<std::string, double>& numbers) {
  if (json.is_number()) {
    numbers[path] = json.get<double>();
  } else if (json.is_object()) {
    for (const auto& [key, value] : json.items()) {
      AddNumbers(value, path.empty() ? key : path + "." + key, numbers);
    }
  }
}

TEST(TrialNumbers, AreThoseOfTheTree) {
  const std::string text = R"({"id": "a1", "status": "done", "axes": {"x": "1", "status": "no"},
    "result": {"n": 3, "low": -2, "null": null, "text": "x", "flag": true, "face":
    {"rms_mm": 1.5, "quantiles_mm": [0.5, null, 1e-3], "id": "b"},
    "fit": {"levels": [{"rms": 3, "deep": {"d": [7]}}, {"rms": 2}], "after": 1}, "last": 4e2},
    "files": [{"file": "a", "size": 4}], "after": 5})";
  const auto trial = ReadTrialNumbers(text);
  ASSERT_TRUE(trial);
  EXPECT_EQ(trial->id, "a1");
  EXPECT_EQ(trial->status, "done");
  std::map<std::string, double> numbers;
  AddNumbers(Json::parse(text)["result"], "", numbers);
  EXPECT_EQ(trial->metrics, numbers);
  EXPECT_EQ(trial->metrics.size(), 5U);
  EXPECT_THAT(trial->lists,
              ElementsAre(Pair("face.quantiles_mm", ElementsAre(0.5, ::testing::IsNan(), 1e-3)),
                          Pair("fit.levels.deep.d", ElementsAre(7)),
                          Pair("fit.levels.rms", ElementsAre(3, 2))));
}

TEST(TrialNumbers, OfWhatIsNoTrialThereAreNone) {
  const std::string deep = R"({"id": "a", "result": )" + std::string(kDeepestJson, '[') +
                           std::string(kDeepestJson, ']') + "}";
  for (const std::string& text :
       {std::string(), std::string("[]"), std::string("3"), std::string("null"),
        std::string("\"id\""), std::string(R"({"id": "a")"), std::string(R"({"id": 1})"),
        std::string(R"({"id": null})"), std::string(R"({"status": ["done"]})"),
        std::string(R"({"status": {"a": 1}})"), std::string(R"({"reason": false})"), deep}) {
    EXPECT_FALSE(ReadTrialNumbers(text)) << text;
  }
  EXPECT_EQ(ReadTrialNumbers("{}")->status, "failed");
}

}  // namespace
}  // namespace semblance
