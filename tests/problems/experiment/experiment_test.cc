// SPDX-License-Identifier: GPL-3.0-or-later
// Options that are valid each by itself but not together.
#include "problems/experiment/experiment.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <stdexcept>

#include "problems/experiment/experiment_config.h"
#include "problems/face/template_source.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::problems {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;
using testing::WordsOf;
using Json = nlohmann::json;

std::string Faults(const std::string& text) {
  return WordsOf<ConfigError>([&] { ReadConfigText<Experiment>(text, "a.yaml"); });
}

TEST(Experiment, TheTermOfAPriorNeedsAFaceOfThePrior) {
  const std::string terms = "fit: {terms: [points, prior_shape]}\n";
  EXPECT_THAT(Faults(terms + "face: fit\n"), HasSubstr("1:14: fit.terms: the term 'prior_shape'"));
  EXPECT_NO_THROW(ReadConfigText<Experiment>(terms + "face: prior_then_fit\n", "a.yaml"));
}

// A prior is used if it is one of the template.
TEST(Experiment, TheWayToTheFaceFollowsTemplateAndPrior) {
  const auto way = [](const std::string& text) {
    return std::visit([](const auto& face) { return face.kName; },
                      WayToFace(ReadConfigText<Experiment>(text, "a.yaml")));
  };
  EXPECT_EQ(way(""), "joint");
  EXPECT_EQ(way("template: formula\n"), "fit");
  EXPECT_EQ(way("prior: none\n"), "fit");
  EXPECT_EQ(way("template: formula\nprior: {type: hspline, modes: m.json}\n"), "joint");
  EXPECT_EQ(way("fit: {plan: {type: adaptive, finest: 3}}\n"), "prior_then_fit");
  EXPECT_EQ(way("fit: {plan: {type: listed, aim: level}}\n"), "prior_then_fit");
  EXPECT_EQ(way("face: placed\n"), "placed");
  EXPECT_THAT(Faults("template: formula\nface: prior\n"),
              HasSubstr("a.yaml:2:7: face: it uses the prior 'ict'"));
  EXPECT_THAT(Faults("prior: none\nface: prior\n"), HasSubstr("face: it uses a prior"));
  EXPECT_NO_THROW(ReadConfigText<Experiment>("uncertainty: {samples: 2}\n", "a.yaml"));
}

TEST(Experiment, UncertaintyOptionsThatTheFaceDoesNotUseAreFaultsAtTheirLine) {
  EXPECT_THAT(Faults("uncertainty: {dowel_sd_mm: 3}\n"),
              HasSubstr("a.yaml:1:28: uncertainty.dowel_sd_mm: `face: joint` does not"));
  EXPECT_THAT(Faults("uncertainty: {own: 0.5, shared: 0.2, implicit_sd_mm: 1}\n"),
              AllOf(HasSubstr("face.table_depths.own"), HasSubstr("face.table_depths.shared"),
                    HasSubstr("face.implicit_spread")));
  EXPECT_THAT(Faults("face: placed\nuncertainty: {samples: 2}\n"),
              HasSubstr("a.yaml:2:24: uncertainty.samples: `face: placed` does not use it"));
  EXPECT_THAT(Faults("face: thin_plate\nuncertainty: {own: 0.5}\n"), HasSubstr("uncertainty.own"));
  EXPECT_NO_THROW(ReadConfigText<Experiment>(
      "face: fit\nuncertainty: {samples: 2, dowel_sd_mm: 3, own: 0.5, implicit_sd_mm: 1}\n",
      "a.yaml"));
}

// A study may compare ways that share their options, so these are no faults.
TEST(Experiment, UnusedOptionsOfSeedsAndFitAreNoted) {
  const auto unused = [](const std::string& text) {
    return UnusedOptions(ReadConfigText<Experiment>(text, "a.yaml"));
  };
  const std::string set =
      "seeds: {weight: 0.5, level: 1, method: closest}\nfirst_fit: []\nrounds: 2\n"
      "fit: {solver: fastest, plan: {schedule: [{level: 0}]}, terms: [points]}\n";
  EXPECT_THAT(unused("face: placed\n"), ::testing::IsEmpty());
  EXPECT_THAT(unused("face: fit\n" + set), ::testing::IsEmpty());
  EXPECT_THAT(
      unused("face: thin_plate\n" + set),
      ::testing::UnorderedElementsAre(
          HasSubstr("seeds.weight: `face: thin_plate` does not use it"), HasSubstr("seeds.level: "),
          HasSubstr("seeds.method: "), HasSubstr("first_fit: "), HasSubstr("rounds: "),
          HasSubstr("fit.solver: "), HasSubstr("fit.plan.schedule: "), HasSubstr("fit.terms: ")));
  EXPECT_THAT(
      unused("face: prior_then_fit\n" + set),
      ::testing::UnorderedElementsAre(HasSubstr("seeds.weight: `face: prior_then_fit` does not use "
                                                "it; face.seed_weight"),
                                      HasSubstr("first_fit: ")));
  EXPECT_THAT(unused(set),
              ::testing::UnorderedElementsAre(
                  HasSubstr("seeds.weight: `face: joint` does not use it; face.estimate"),
                  HasSubstr("seeds.method: `face: joint` does not use it; face.seed_method"),
                  HasSubstr("first_fit: "), HasSubstr("fit.solver: "), HasSubstr("fit.terms: ")));
}

// The default method goes over to another one for some plans, which a user would not notice.
TEST(Experiment, AnotherMethodThanJointIsNoted) {
  const auto noted = [](const std::string& text) {
    return UnusedOptions(ReadConfigText<Experiment>(text, "a.yaml"));
  };
  const auto has_note = Contains(HasSubstr("`auto` is prior_then_fit here"));
  EXPECT_THAT(noted("fit: {plan: {type: adaptive, finest: 3}}\n"), has_note);
  EXPECT_THAT(noted("face: prior_then_fit\nfit: {plan: {type: adaptive, finest: 3}}\n"),
              Not(has_note));
  EXPECT_THAT(noted(""), Not(has_note));
}

TEST(Experiment, AWidthWithoutALossIsNoted) {
  const auto unused = [](const std::string& face, const std::string& points) {
    return UnusedOptions(ReadConfigText<Experiment>(
        fmt::format("face: {}\nfit: {{terms: [smoothness, {{type: points{}}}]}}\n", face, points),
        "a.yaml"));
  };
  for (const char* face : {"fit", "prior_then_fit"}) {
    EXPECT_THAT(unused(face, ", loss_width_mm: 3"),
                ElementsAre("fit.terms[1].loss_width_mm: `loss: none` ignores it"));
    EXPECT_THAT(unused(face, ", loss: huber, loss_width_mm: 3"), IsEmpty());
    EXPECT_THAT(unused(face, ", loss_width_mm: 5"), IsEmpty()) << "the default";
  }
  EXPECT_THAT(unused("thin_plate", ", loss_width_mm: 3"),
              ElementsAre(HasSubstr("fit.terms: `face: thin_plate`")));
}

// Otherwise a trial would refuse these only after its skull was filled.
TEST(Experiment, AUsedPriorNamesItsFiles) {
  EXPECT_THAT(Faults("prior: hspline\n"), HasSubstr("prior.modes: no file is named"));
  EXPECT_THAT(Faults("prior: modes\n"),
              AllOf(HasSubstr("prior.mean: no file"), HasSubstr("prior.features: no file")));
  EXPECT_NO_THROW(ReadConfigText<Experiment>("prior: hspline\nface: fit\n", "a.yaml"));
}

TEST(Experiment, TheDefaultsFitTogether) { EXPECT_THAT(FaultsBetween(Experiment{}), IsEmpty()); }

TEST(Experiment, PeopleGetPeoplesDepthByDefaultAndPhantomsDoNot) {
  Experiment experiment;
  experiment.subject = FileSubject{};
  EXPECT_TRUE(std::holds_alternative<PopulationDepth>(WayToDepth(experiment)));
  experiment.subject = CtSubject{};
  EXPECT_TRUE(std::holds_alternative<PopulationDepth>(WayToDepth(experiment)));
  experiment.subject = PhantomOptions{};
  EXPECT_TRUE(std::holds_alternative<Barycentric>(WayToDepth(experiment)));
  experiment.interp = Kriging{};
  EXPECT_TRUE(std::holds_alternative<Kriging>(WayToDepth(experiment)));
}

// configs/published.yaml as a base of a subject gives the way of the thesis with the subject's
// depths.
TEST(Experiment, ThePublishedWayIsOneBaseAway) {
  const testing::ScratchFolder folder;
  const std::string configs = SEMBLANCE_SOURCE_DIR "/configs/";
  const Experiment demo = ReadConfig<Experiment>(configs + "demo.yaml");
  const Experiment published = ReadConfigText<Experiment>(
      fmt::format("base: [{0}demo.yaml, {0}published.yaml]\n", configs), folder / "e.yaml");
  EXPECT_THAT(FaultsBetween(published), IsEmpty());
  EXPECT_EQ(StageKey("", published.subject), StageKey("", demo.subject));
  EXPECT_EQ(StageKey("", published.tissue), StageKey("", demo.tissue));
  EXPECT_TRUE(std::holds_alternative<FormulaTemplate>(published.face_template));
  EXPECT_TRUE(std::holds_alternative<FittedTemplate>(WayToFace(published)));
  EXPECT_TRUE(std::holds_alternative<Barycentric>(published.interp));
  EXPECT_TRUE(std::holds_alternative<RestoreFeatures>(published.fit.features));
  EXPECT_TRUE(std::holds_alternative<NoRelaxation>(published.fit.relaxation));
  EXPECT_EQ(std::get<SeedOptions>(published.seeds).weight, 1);
  EXPECT_EQ(published.inserted_uv, InsertedUv::kNeighbours);
  ASSERT_EQ(published.fit.terms.size(), 1u);
  EXPECT_EQ(std::get<PointTerm>(published.fit.terms[0]).loss, RobustLoss::kNone);
  const std::vector<ScheduleStep> steps = PlanSteps(published.fit.plan),
                                  thesis = PublishedSchedule();
  ASSERT_EQ(steps.size(), thesis.size());
  for (std::size_t k = 0; k < steps.size(); ++k) {
    EXPECT_EQ(steps[k].level, thesis[k].level);
    EXPECT_EQ(steps[k].fraction, thesis[k].fraction);
  }
}

TEST(Experiment, AStepAtALevelThatTheFaceLacksIsToldAtItsLine) {
  EXPECT_EQ(Faults("template: {type: formula, max_level: 2}\n"
                   "fit:\n"
                   "  plan:\n"
                   "    schedule:\n"
                   "      - {level: 2, fraction: 1}\n"
                   "      - {level: 3, fraction: 1}\n"),
            "a.yaml:6:17: fit.plan.schedule[1].level: level 3 is finer than the surface, whose "
            "finest level is 2; give a level up to that, or raise template.max_level");
}

TEST(Experiment, AllOptionsThatNameALevelAreLookedAt) {
  EXPECT_THAT(Faults("first_fit: [{level: 4}]\n"), HasSubstr("1:21: first_fit[0].level: level 4"));
  EXPECT_THAT(Faults("seeds: {direction_level: 5}\n"),
              HasSubstr("1:26: seeds.direction_level: level 5"));
  EXPECT_THAT(Faults("fit: {plan: {type: coarse_to_fine, finest: 6}}\n"),
              HasSubstr("1:44: fit.plan.finest: level 6"));
}

// The fault is found before anything runs, not after the implicit face was made.
TEST(Experiment, WhatAPlanCannotIsToldWhenTheFileIsRead) {
  EXPECT_THAT(Faults("fit: {plan: adaptive}\n"),
              HasSubstr("1:13: fit.plan.finest: level 4 is finer than the surface"));
  EXPECT_THAT(Faults("fit: {plan: {type: adaptive, finest: 3}, terms: [symmetry]}\n"),
              HasSubstr("1:49: fit.terms: the adaptive plan has no term 'points'"));
  EXPECT_THAT(Faults("fit: {plan: {type: adaptive, finest: 3}, relaxation: tangent_distance}\n"),
              HasSubstr("1:54: fit.relaxation: the relaxation tangent_distance goes level by"));
  EXPECT_NO_THROW(ReadConfigText<Experiment>(
      "fit: {plan: {type: adaptive, finest: 3}, terms: [points, symmetry], features: frozen}\n",
      "a.yaml"));
}

TEST(Experiment, ARoughPhantomNeedsRingsEnough) {
  EXPECT_THAT(
      Faults("subject: {type: phantom, bone: like_people, rings: 29}\n"),
      HasSubstr("subject.rings: 29 is too few, allowed is 30 to 1000 with bone: like_people"));
  EXPECT_NO_THROW(ReadConfigText<Experiment>("subject: {type: phantom, rings: 29}\n", "a.yaml"));
}

TEST(Experiment, AnExcludedZoneIsAroundAStandardSite) {
  EXPECT_THAT(Faults("region: {exclude: [{site: g}, {site: sn}]}\n"),
              HasSubstr("region.exclude[1].site: unknown site 'sn'; did you mean 'sg'?"));
}

TEST(Experiment, ThePlanThatKnowsNoFeaturesIsNotForATemplateThatHasSome) {
  const std::string fit =
      "fit: {plan: auto, terms: [points, {type: smoothness, weight: auto}], relaxation: none}\n";
  for (const char* face : {"fit", "prior_then_fit", "auto"}) {
    EXPECT_THAT(
        Faults(fit + "template: ict\nface: " + face + "\n"),
        HasSubstr("fit.plan: the auto plan does not protect features, and the template has some"));
  }
  EXPECT_NO_THROW(ReadConfigText<Experiment>(fit + "template: ict\nface: placed\n", "a.yaml"));
}

// A plan has no key for an option that it does not use.
TEST(Experiment, APlanOwnsItsOptions) {
  EXPECT_THAT(Faults("fit: {plan: {type: adaptive, finest: 2, sweeps: 1}}\n"),
              AllOf(StartsWith("a.yaml:1:41: "), HasSubstr("fit.plan.sweeps")));
  EXPECT_THAT(Faults("fit: {plan: {type: coarse_to_fine, schedule: []}}\n"),
              HasSubstr("fit.plan.schedule"));
  EXPECT_THAT(Faults("fit: {schedule: []}\n"), HasSubstr("fit.schedule"));
  EXPECT_NO_THROW(ReadConfigText<Experiment>(
      "fit: {plan: {type: until, schedule: [{level: 1}], aim: level, sweeps: 2}}\n", "a.yaml"));
}

TEST(Experiment, AFaultOfADefaultIsToldWhereTheFileComesNearest) {
  EXPECT_THAT(Faults("template: {type: formula, max_level: 1}\n"),
              AllOf(StartsWith("a.yaml:1:1: fit.plan.schedule[2].level: level 2"),
                    HasSubstr("fit.plan.schedule[5].level")));
}

// Compares each default of the reference and the schema with `node`, a part of the tree from which
// resolved.yaml is written.
class StatedDefaults {
 public:
  void Check(const ConfigNode& node, const Json& schema, const std::string& path,
             const std::string& condition) {
    const ConfigNode* type = node.Find("type");
    if (type) {
      ExpectLine(path + condition, *type);
    }
    const std::string inside = type ? condition + " (type: " + type->text + ")" : condition;
    const Json& properties = type ? Alternative(schema, type->text) : schema["properties"];
    for (const ConfigNode::Entry& entry : node.entries) {
      const std::string entry_path = path.empty() ? entry.key : path + "." + entry.key;
      if (entry.value.IsMap() && !entry.value.entries.empty()) {
        Check(entry.value, properties[entry.key], entry_path, inside);
      } else if (entry.key != "type") {
        ++checked;
        ExpectLine(entry_path + inside, entry.value);
        ExpectJson(properties[entry.key]["default"], entry.value, entry_path);
      }
    }
  }
  int checked = 0;

 private:
  static const Json& Alternative(const Json& schema, const std::string& type) {
    for (const Json& alternative : schema["anyOf"]) {
      if (alternative.contains("properties") &&
          alternative["properties"]["type"]["const"] == type) {
        return alternative["properties"];
      }
    }
    throw std::logic_error("the schema has no type " + type);
  }
  void ExpectLine(const std::string& path, const ConfigNode& node) const {
    const std::size_t begin = reference_.find("\n" + path + ": ");
    ASSERT_NE(begin, std::string::npos) << path;
    const std::string line =
        reference_.substr(begin + 1, reference_.find('\n', begin + 1) - begin - 1) + ",";
    EXPECT_THAT(line, HasSubstr(", default " + ToFlowYaml(node) + ","));
  }
  static void ExpectJson(const Json& stated, const ConfigNode& node, const std::string& path) {
    ASSERT_EQ(stated.size(), node.IsList() ? node.items.size() : stated.size()) << path;
    if (node.IsScalar()) {
      EXPECT_EQ(stated, stated.is_string() ? Json(node.text) : Json::parse(node.text)) << path;
    } else if (node.IsNull()) {
      EXPECT_TRUE(stated.is_null()) << path;
    }
  }

  const std::string reference_ = "\n" + OptionsReference<Experiment>();
};

TEST(Experiment, TheReferenceAndTheSchemaStateTheDefaultsThatResolvedYamlHas) {
  StatedDefaults defaults;
  defaults.Check(MakeConfigTree(Experiment{}), Json::parse(OptionsSchema<Experiment>()), "", "");
  EXPECT_GT(defaults.checked, 60);
  EXPECT_THAT(OptionsReference<Experiment>(),
              HasSubstr("\nseeds.weight (type: patches): number, default 0.1,"));
}

TEST(Experiment, ASchemeCanBeSetByItsTypeAlone) {
  const auto set = [](const std::string& text, const std::vector<std::string>& overrides) {
    return ReadConfigText<Experiment>(text, "a.yaml", overrides).interp;
  };
  EXPECT_TRUE(std::holds_alternative<NaturalNeighbour>(set("", {"interp.type=natural_neighbour"})));
  EXPECT_TRUE(std::holds_alternative<NaturalNeighbour>(
      set("interp: {type: kriging}", {"interp.type=natural_neighbour"})));
}

TEST(Experiment, AMeanOfATableIsForDepthsThatAreNotTheTables) {
  for (const std::string scheme : {"kriging", "surface_matern"}) {
    const std::string interp = fmt::format("interp: {{type: {}, mean: table}}\n", scheme);
    EXPECT_THAT(Faults(interp), HasSubstr("interp.mean: the depths are the table's own"));
    EXPECT_THAT(Faults(interp + "tissue: {depths: measured}\n"),
                HasSubstr("interp.mean: `table` needs the mean depths of tissue.table"));
    const std::string both = interp + "tissue: {depths: measured, table: a.yaml}\n";
    EXPECT_NO_THROW(ReadConfigText<Experiment>(both, "a.yaml"));
  }
  EXPECT_THAT(Faults("interp: {type: auto, schemes: [mean, {type: kriging, mean: table}]}\n"),
              HasSubstr("interp.schemes[1].mean: the depths are the table's own"));
}

TEST(Experiment, TheLevelsOfATemplateFromFilesAreThoseOfItsSurface) {
  const testing::ScratchFolder folder;
  const FileTemplate files = WriteTemplate(folder.Path(), MakeTemplateFace({.max_level = 1}));
  const std::string config =
      fmt::format("template: {{type: file, surface: {}, sites: {}, features: {}}}\n",
                  files.surface.string(), files.sites.string(), files.features.string());
  EXPECT_THAT(Faults(config), AllOf(HasSubstr("schedule[2].level: level 2 is finer than the"),
                                    HasSubstr("take a template with more levels")));
  std::filesystem::remove(files.sites);
  EXPECT_THAT(Faults(config), AllOf(HasSubstr("template: "), HasSubstr(files.sites.string())));
  EXPECT_THAT(Faults("template: file\n"), HasSubstr("template.surface: no file is named"));
}

}  // namespace
}  // namespace semblance::problems
