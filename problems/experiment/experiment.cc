// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/experiment.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include "fitting/plan/fit_check.h"
#include "problems/config/config_tree.h"
#include "problems/experiment/experiment_config.h"
#include "problems/face/bust/bust_model.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

// The levels of the generic face, which limit those of other options.
struct TemplateLevels {
  int finest = 0;
  std::string remedy;  // for a finer level
};

TemplateLevels FindLevels(const TemplateSource& source) {
  if (const auto* formula = std::get_if<FormulaTemplate>(&source)) {
    return {formula->max_level, "raise template.max_level"};
  }
  return {LoadTemplate(source).surface.shape().max_level, "take a template with more levels"};
}

class LevelCheck {
 public:
  explicit LevelCheck(TemplateLevels levels) : levels_(std::move(levels)) {}

  void At(std::string path, int level) {
    if (level > levels_.finest) {
      faults_.push_back(
          {std::move(path), fmt::format("level {} is finer than the surface, whose finest level "
                                        "is {}; give a level up to that, or {}",
                                        level, levels_.finest, levels_.remedy)});
    }
  }
  void Steps(const std::string& path, const std::vector<ScheduleStep>& steps) {
    for (std::size_t n = 0; n < steps.size(); ++n) {
      At(fmt::format("{}[{}].level", path, n), steps[n].level);
    }
  }
  std::vector<OptionFault> Take() { return std::move(faults_); }

 private:
  TemplateLevels levels_;
  std::vector<OptionFault> faults_;
};

// Checks the user's bust. The program's own is known to be sound.
void CheckBust(const Experiment& experiment, std::vector<OptionFault>& faults) {
  if (!std::holds_alternative<MeshBust>(experiment.bust) &&
      !std::holds_alternative<HSplineBust>(experiment.bust)) {
    return;
  }
  try {
    LoadBust(experiment.bust, experiment.face_template, {});
  } catch (const Error& error) {
    faults.push_back({"bust", error.what()});
  }
}

bool HasSteps(const SchedulePlan& plan) {
  return std::holds_alternative<ListedPlan>(plan) || std::holds_alternative<CoarseToFinePlan>(plan);
}

// `face: joint` runs the steps of a schedule, and its levels meet the data with the whole surface.
bool JointRuns(const SchedulePlan& plan) {
  return HasSteps(plan) && PlanAim(plan) == FitAim::kSurface;
}

}  // namespace

FaceSource WayToFace(const Experiment& experiment) {
  if (!std::holds_alternative<AutoFace>(experiment.face)) {
    return experiment.face;
  }
  const bool fits = std::holds_alternative<IctPrior>(experiment.prior)
                        ? std::holds_alternative<IctTemplate>(experiment.face_template)
                        : !std::holds_alternative<NoPrior>(experiment.prior);
  if (!fits) {
    return FittedTemplate{};
  }
  return JointRuns(experiment.fit.plan) ? FaceSource(JointFace{}) : FaceSource(PriorThenFit{});
}

DepthScheme WayToDepth(const Experiment& experiment) {
  return std::visit(
      [&]<class Choice>(const Choice& choice) -> DepthScheme {
        if constexpr (std::is_same_v<Choice, DefaultDepth>) {
          return std::holds_alternative<PhantomOptions>(experiment.subject)
                     ? DepthScheme(Barycentric{})
                     : DepthScheme(PopulationDepth{});
        } else {
          return choice;
        }
      },
      experiment.interp);
}

namespace {

// The options that require the table's mean.
std::vector<std::string> TableMeans(const DepthScheme& scheme) {
  const auto* const mixture = std::get_if<AutoScheme>(&scheme);
  if (mixture == nullptr) {
    return NeedsExpected(scheme) ? std::vector<std::string>{"interp.mean"}
                                 : std::vector<std::string>();
  }
  std::vector<std::string> options;
  for (std::size_t k = 0; k < mixture->schemes.size(); ++k) {
    if (SingleNeedsExpected(mixture->schemes[k])) {
      options.push_back(fmt::format("interp.schemes[{}].mean", k));
    }
  }
  return options;
}

// Checks the bounds of depth against each other and against depths that are set by hand.
void CheckBounds(const Experiment& experiment, std::vector<OptionFault>& faults) {
  for (const OptionFault& fault : BoundFaults(experiment.tissue)) {
    faults.push_back({"tissue." + fault.path, fault.what});
  }
  for (const auto& [name, site] : experiment.sites) {
    if (!site.depth || site.depth->automatic || !IsStandardSite(name)) {
      continue;  // a site of one's own is checked where it lies on the bone
    }
    const DepthRange range = AllowedAt(experiment.tissue.bounds, name);
    if (!range.Contains(site.depth->value)) {
      faults.push_back({fmt::format("sites.{}.depth", name), KnownDepthFault(*site.depth, range)});
    }
  }
}

// Depths on the skin need a file of it; phantoms and volumes have their own.
void CheckSkinNamed(const Experiment& experiment, std::vector<OptionFault>& faults) {
  const auto* const files = std::get_if<FileSubject>(&experiment.subject);
  if (experiment.tissue.depths == DepthSource::kSkin && files != nullptr && files->skin.empty()) {
    faults.push_back({"tissue.depths",
                      "skin: the subject names no true skin to measure on; name one under "
                      "subject.skin, or take `table` or `measured`"});
  }
}

// The table's mean adds no information to the table's own depths.
void CheckExpected(const Experiment& experiment, std::vector<OptionFault>& faults) {
  for (const std::string& option : TableMeans(WayToDepth(experiment))) {
    if (experiment.tissue.depths == DepthSource::kTable) {
      faults.push_back({option,
                        "the depths are the table's own (tissue.depths: table), and its mean "
                        "adds nothing to them; measure depths, or take `mean: constant`"});
    } else if (experiment.tissue.table.empty()) {
      faults.push_back(
          {option,
           "`table` needs the mean depths of tissue.table, and none is named; name one, "
           "e.g. configs/tables/t_table_2023.yaml, or take `mean: constant`"});
    }
  }
}

void CheckPhantom(const Subject& subject, std::vector<OptionFault>& faults) {
  const auto* const phantom = std::get_if<PhantomOptions>(&subject);
  if (std::string fault = phantom == nullptr ? "" : RingsFault(*phantom); !fault.empty()) {
    faults.push_back({"subject.rings", std::move(fault)});
  }
}

void CheckRegion(const FaceRegionOptions& region, std::vector<OptionFault>& faults) {
  for (std::size_t k = 0; k < region.exclude.size(); ++k) {
    if (std::string complaint = StandardSiteFault(region.exclude[k].site); !complaint.empty()) {
      faults.push_back({fmt::format("region.exclude[{}].site", k), std::move(complaint)});
    }
  }
}

// Checks that the source of a used prior names its files.
void CheckPriorFiles(const PriorSource& source, std::vector<OptionFault>& faults) {
  const auto need = [&](const char* field, const std::filesystem::path& file, const char* remedy) {
    if (file.empty()) {
      faults.push_back(
          {fmt::format("prior.{}", field), fmt::format("no file is named; {}", remedy)});
    }
  };
  if (const auto* modes = std::get_if<ModesPrior>(&source)) {
    constexpr const char* kAll = "a prior of type modes needs mean, modes, sites and features";
    need("mean", modes->mean, kAll);
    need("modes", modes->modes, kAll);
    need("sites", modes->sites, kAll);
    need("features", modes->features, kAll);
  } else if (const auto* hspline = std::get_if<HSplinePrior>(&source)) {
    need("modes", hspline->modes, "`semblance prior` makes one");
  }
}

// The auto plan fits the levels that the points need, and would smooth eyes, nose and mouth away.
void CheckAutoPlan(const Experiment& experiment, std::vector<OptionFault>& faults) {
  const FaceSource face = WayToFace(experiment);
  const bool fits =
      std::holds_alternative<FittedTemplate>(face) || std::holds_alternative<PriorThenFit>(face);
  if (fits && std::holds_alternative<AutoPlan>(experiment.fit.plan) &&
      !FeatureVertices(LoadTemplate(experiment.face_template)).empty()) {
    faults.push_back(
        {"fit.plan",
         "the auto plan does not protect features, and the template has some; take `adaptive`, "
         "or a plan of steps"});
  }
}

void CheckJointPlan(const Experiment& experiment, std::vector<OptionFault>& faults) {
  if (!std::holds_alternative<JointFace>(experiment.face)) {
    return;
  }
  if (!HasSteps(experiment.fit.plan)) {
    faults.push_back({"fit.plan",
                      "`face: joint` runs the steps of a schedule once; take `listed` or "
                      "`coarse_to_fine`, or `face: prior_then_fit`"});
  } else if (PlanAim(experiment.fit.plan) != FitAim::kSurface) {
    faults.push_back({"fit.plan.aim",
                      "`face: joint` fits the whole surface; leave it out, or take `face: "
                      "prior_then_fit`"});
  }
}

void CheckReference(const Experiment& experiment, std::vector<OptionFault>& faults) {
  const auto* const reference = std::get_if<ReferenceFace>(&experiment.face);
  if (reference == nullptr) {
    return;
  }
  const bool own_skin = std::holds_alternative<FileTemplate>(experiment.face_template);
  if (own_skin && reference->landmarks.empty()) {
    faults.push_back({"face.landmarks",
                      "no file is named; give the landmarks of the skull under the template's "
                      "skin"});
  } else if (!own_skin && !reference->landmarks.empty()) {
    faults.push_back({"face",
                      "`reference` with landmarks takes that head's own skin as the template; make "
                      "it by `semblance template` and name it by `template: {type: file, ...}`"});
  }
}

// Checks terms and priors that only some ways to a face use.
void CheckWayToFace(const Experiment& experiment, std::vector<OptionFault>& faults) {
  const FaceSource face = WayToFace(experiment);
  const bool asks = UsesPrior(face);
  if (asks && std::holds_alternative<IctPrior>(experiment.prior) &&
      !std::holds_alternative<IctTemplate>(experiment.face_template)) {
    faults.push_back({"face",
                      "it uses the prior 'ict', which fits `template: ict` alone; take that "
                      "template, your own prior, or `face: fit`"});
  }
  if (asks) {
    CheckPriorFiles(experiment.prior, faults);
  }
  CheckReference(experiment, faults);
  if (asks && std::holds_alternative<NoPrior>(experiment.prior)) {
    faults.push_back({"face",
                      "it uses a prior, and there is none; name one under `prior`, or take "
                      "`face: fit`"});
  }
  const bool holds_shape = std::ranges::any_of(experiment.fit.terms, [](const Term& term) {
    return std::holds_alternative<PriorShapeTerm>(term);
  });
  if (holds_shape && !std::holds_alternative<PriorThenFit>(face)) {
    faults.push_back({"fit.terms",
                      "the term 'prior_shape' needs a prior's face; leave it out, or write "
                      "`face: prior_then_fit`"});
  }
}

std::string_view NameOf(const FaceSource& face) {
  return std::visit([](const auto& way) { return way.kName; }, face);
}

// Refuses options of `uncertainty` that the way to the face does not use. template_sd_mm and
// unseen_sd_mm are accepted with every way, because they state whether a template is exact, as that
// of a phantom is.
void CheckUncertainty(const Experiment& experiment, std::vector<OptionFault>& faults) {
  const FaceSource face = WayToFace(experiment);
  if (std::holds_alternative<FittedTemplate>(face)) {
    return;
  }
  const UncertaintyOptions usual, &given = experiment.uncertainty;
  const bool asks = UsesPrior(face);
  const auto refuse = [&](const char* field, const std::string& remedy) {
    faults.push_back(
        {fmt::format("uncertainty.{}", field),
         fmt::format("`face: {}` does not use it; leave it out{}", NameOf(face), remedy)});
  };
  const auto of_fit = [&](const char* field, double UncertaintyOptions::*option,
                          const char* of_prior) {
    if (given.*option != usual.*option) {
      refuse(field, (asks ? of_prior : std::string()) + ", or write `face: fit`");
    }
  };
  of_fit("dowel_sd_mm", &UncertaintyOptions::dowel_sd_mm, "");
  of_fit("implicit_sd_mm", &UncertaintyOptions::implicit_sd_mm, ", set face.implicit_spread");
  of_fit("own", &UncertaintyOptions::own, ", set face.table_depths.own");
  of_fit("shared", &UncertaintyOptions::shared, ", set face.table_depths.shared");
  if (given.samples > 0 && !asks) {
    refuse("samples", ", or write `face: fit` or one of a prior, which can be drawn from");
  }
}

// Adds the paths of differing options, descending where both are maps.
void AddDifferences(const std::string& path, const ConfigNode& given, const ConfigNode& usual,
                    std::vector<std::string>& paths) {
  if (ToFlowYaml(given) == ToFlowYaml(usual)) {
    return;
  }
  const auto known = [&](const ConfigNode::Entry& entry) {
    return usual.Find(entry.key) != nullptr;
  };
  if (!given.IsMap() || !usual.IsMap() || !std::ranges::all_of(given.entries, known)) {
    paths.push_back(path);
    return;
  }
  for (const ConfigNode::Entry& entry : given.entries) {
    AddDifferences(path + "." + entry.key, entry.value, *usual.Find(entry.key), paths);
  }
}

std::vector<std::string> UnusedFitOptions(const Experiment& experiment) {
  std::vector<std::string> notes = UnusedOptions(experiment.fit);
  for (std::string& note : notes) {
    note.insert(0, "fit.");
  }
  return notes;
}

}  // namespace

std::vector<OptionFault> FaultsBetween(const Experiment& experiment) try {
  const TemplateLevels levels = FindLevels(experiment.face_template);
  LevelCheck check(levels);
  check.Steps("first_fit", experiment.first_fit);
  if (const auto* const seeds = std::get_if<SeedOptions>(&experiment.seeds)) {
    check.At("seeds.direction_level", seeds->direction_level);
  }
  if (const auto* const springs = std::get_if<SpringFace>(&experiment.face)) {
    check.At("face.level", springs->level);
  }
  std::vector<OptionFault> faults = check.Take();
  for (const FitFault& fault : FindFitFaults(experiment.fit, levels.finest)) {
    faults.push_back(
        {"fit." + fault.path, fault.too_fine ? fault.what + ", or " + levels.remedy : fault.what});
  }
  for (const OptionFault& fault : CheckRules(experiment.rules)) {
    faults.push_back({"rules." + fault.path, fault.what});
  }
  for (const OptionFault& fault : SiteOptionFaults(experiment.sites)) {
    faults.push_back({"sites." + fault.path, fault.what});
  }
  CheckBounds(experiment, faults);
  CheckSkinNamed(experiment, faults);
  CheckExpected(experiment, faults);
  CheckPhantom(experiment.subject, faults);
  CheckRegion(experiment.region, faults);
  CheckWayToFace(experiment, faults);
  CheckUncertainty(experiment, faults);
  CheckAutoPlan(experiment, faults);
  CheckJointPlan(experiment, faults);
  CheckBust(experiment, faults);
  return faults;
} catch (const Error& error) {  // the template cannot be used, so its levels are unknown
  return {{"template", error.what()}};
}

namespace {

// The option of the face that replaces an unused one, in words.
std::string_view Replacement(std::string_view path, const FaceSource& face) {
  const bool joint = std::holds_alternative<JointFace>(face);
  if (path == "seeds.method" && joint) {
    return "; face.seed_method replaces it";
  }
  if (path == "seeds.weight" && joint) {
    return "; face.estimate.surface_worth replaces it";
  }
  return path == "seeds.weight" && std::holds_alternative<PriorThenFit>(face)
             ? "; face.seed_weight of prior_then_fit replaces it"
             : "";
}

}  // namespace

std::vector<std::string> UnusedOptions(const Experiment& experiment) {
  const FaceSource face = WayToFace(experiment);
  if (std::holds_alternative<FittedTemplate>(face)) {
    return UnusedFitOptions(experiment);
  }
  const ConfigNode given = MakeConfigTree(experiment), usual = MakeConfigTree(Experiment());
  std::vector<std::string> paths;
  for (const std::string_view option : {"first_fit", "seeds", "rounds", "fit"}) {
    AddDifferences(std::string(option), *given.Find(option), *usual.Find(option), paths);
  }
  if (std::holds_alternative<PriorThenFit>(face)) {
    std::erase_if(paths, [](const std::string& path) {
      return path != "seeds.weight" && path != "first_fit";
    });
  } else if (std::holds_alternative<JointFace>(face)) {
    std::erase_if(paths, [](const std::string& path) {
      return (path.starts_with("seeds") && path != "seeds.weight" && path != "seeds.method") ||
             path == "rounds" || path.starts_with("fit.plan");
    });
  }
  std::vector<std::string> notes;
  if (std::holds_alternative<PriorThenFit>(face)) {
    notes = UnusedFitOptions(experiment);
    if (std::holds_alternative<AutoFace>(experiment.face)) {
      notes.push_back(
          "face: `auto` is prior_then_fit here, because joint needs a plan of steps (listed or "
          "coarse_to_fine) with `aim: surface`; write `face: prior_then_fit` if you want that");
    }
  }
  for (const std::string& path : paths) {
    notes.push_back(fmt::format("{}: `face: {}` does not use it{}", path, NameOf(face),
                                Replacement(path, face)));
  }
  return notes;
}

template ConfigNode MakeConfigTree(const Experiment& value);
template Experiment ReadConfigTree(const ConfigNode& tree, ConfigErrors& errors);
template Experiment ReadConfig(const std::filesystem::path& file,
                               std::span<const std::string> overrides);
template Experiment ReadConfigText(std::string_view text, const std::filesystem::path& pretend_file,
                                   std::span<const std::string> overrides);
template std::string WriteConfig(const Experiment& value);
template std::string OptionsReference<Experiment>();
template std::string OptionsSchema<Experiment>();

ConfigType DescribeExperiment() { return config_internal::DescribeType(Experiment{}); }

}  // namespace semblance::problems
