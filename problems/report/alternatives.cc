// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/alternatives.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "problems/config/terminal_text.h"
#include "problems/experiment/experiment_config.h"
#include "problems/report/pictures/pictures.h"
#include "problems/report/run_folder.h"
#include "problems/report/run_pictures.h"

namespace semblance::problems {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

constexpr int kSheetWidth = 420, kSheetHeight = 520;  // pixels of a picture

bool IsName(const std::string& name) {
  return !name.empty() && name.size() <= 60 && std::ranges::all_of(name, [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '-' || c == '+';
  });
}

// Makes relative paths of settings start at `folder`, as if a file of that folder held them.
void SetPathBase(const fs::path& folder, ConfigNode& node) {
  if (node.location.source && !node.location.source->has_lines) {
    auto source = std::make_shared<ConfigSource>(*node.location.source);
    source->folder = folder;
    node.location.source = std::move(source);
  }
  for (ConfigNode::Entry& entry : node.entries) {
    SetPathBase(folder, entry.value);
  }
  for (ConfigNode& item : node.items) {
    SetPathBase(folder, item);
  }
}

Experiment Read(const std::string& text, const Alternative& alternative, const fs::path& folder,
                ConfigErrors& errors) {
  ConfigNode tree = LoadConfigTextTree(text, "alternative " + alternative.name, alternative.set,
                                       MakeConfigTree(Experiment{}), errors);
  SetPathBase(fs::current_path() / folder, tree);
  auto experiment = ReadConfigTree<Experiment>(tree, errors);
  experiment.title += " (" + alternative.name + ")";
  return experiment;
}

bool HaveSameSubject(const Experiment& a, const Experiment& b) {
  Experiment with_other_subject = a;
  with_other_subject.subject = b.subject;
  return WriteConfig(with_other_subject) == WriteConfig(a);
}

// Reports faults of one alternative at its place in the configuration.
class AlternativeFaults {
 public:
  AlternativeFaults(const ConfigNode& tree, std::size_t index, const Alternative& alternative,
                    ConfigErrors& errors)
      : tree_(tree),
        at_(fmt::format("alternatives[{}]", index)),
        alternative_(alternative),
        errors_(errors) {}

  void Add(const std::string& what) { errors_.Add(FindLocation(tree_, at_), Name(), what); }

  void Add(const ConfigErrors& of_settings) {
    for (const ConfigFault& fault : of_settings.faults()) {
      errors_.Add(FindLocation(tree_, at_ + SettingPath(fault)), Name(),
                  fault.path + (fault.path.empty() ? "" : ": ") + fault.what);
    }
  }

 private:
  std::string Name() const { return fmt::format("{} '{}'", at_, alternative_.name); }

  // The path of the faulty setting, e.g. ".set[1]". Empty if no single setting is at fault.
  std::string SettingPath(const ConfigFault& fault) const {
    for (std::size_t k = 0; k < alternative_.set.size(); ++k) {
      if (fault.location.source && fault.location.source->name == "--set " + alternative_.set[k]) {
        return fmt::format(".set[{}]", k);
      }
    }
    return "";
  }

  const ConfigNode& tree_;
  std::string at_;
  const Alternative& alternative_;
  ConfigErrors& errors_;
};

// Adds the lines that `known` does not hold, with the alternative's name.
void AddNamed(const std::string& name, const std::vector<std::string>& lines,
              const std::vector<std::string>& known, std::vector<std::string>& named) {
  for (const std::string& line : lines) {
    if (std::ranges::find(known, line) == known.end()) {
      named.push_back(fmt::format("alternative '{}': {}", name, line));
    }
  }
}

// The parts of a result that the comparison needs. The rest of the result is freed.
struct Answer {
  std::string name;
  Scene scene;
  TriMesh face;
  std::vector<Vec3> normals;
  std::set<std::string> sites;      // with a dowel
  std::set<std::string> landmarks;  // with a dowel or without
  Json json;
};

std::set<std::string> DowelSites(const RunResult& result) {
  std::set<std::string> sites;
  for (const Dowel& dowel : result.subject.dowels_on_bone) {
    sites.insert(dowel.site);
  }
  return sites;
}

std::set<std::string> LandmarkSites(const RunResult& result) {
  std::set<std::string> landmarks;
  for (const auto& [site, point] : result.subject.points) {
    landmarks.insert(site);
  }
  return landmarks;
}

Answer MakeAnswer(const std::string& name, const std::vector<std::string>& set,
                  const RunResult& result) {
  Answer answer{.name = name,
                .scene = HeadScene(result),
                .face = result.face.mesh,
                .normals = result.face.normals,
                .sites = DowelSites(result),
                .landmarks = LandmarkSites(result),
                .json = {{"name", name}, {"set", set}, {"usable", result.usable()}}};
  answer.json["dowels"] = answer.sites.size();
  answer.json["face"] = nullptr;
  if (result.truth) {
    const DistanceSummary& s = result.truth->face.truth_to_face;
    answer.json["face"] = {{"mean_abs_mm", s.mean_abs_mm},
                           {"rms_mm", s.rms_mm},
                           {"p95_mm", s.p95_mm},
                           {"within_2_5mm", s.within_2_5mm}};
  }
  answer.json["notes"] = result.Notes();
  return answer;
}

// The distance of each vertex outside the run's own face, in mm. Empty if the two meshes have
// different triangles.
std::vector<double> OutsideDistances(const Answer& answer, const Answer& own) {
  std::vector<double> outside;
  if (answer.face.triangles == own.face.triangles) {
    for (std::size_t v = 0; v < own.face.points.size(); ++v) {
      outside.push_back(own.normals[v].dot(answer.face.points[v] - own.face.points[v]));
    }
  }
  return outside;
}

Json DifferenceJson(const std::vector<double>& outside, const TriMesh& mesh) {
  if (outside.empty()) {
    return nullptr;
  }
  const std::vector<double> areas = VertexAreas(mesh);
  double sum = 0, squares = 0, area = 0;
  for (std::size_t v = 0; v < outside.size(); ++v) {
    sum += areas[v] * outside[v];
    squares += areas[v] * outside[v] * outside[v];
    area += areas[v];
  }
  return {{"mean_mm", sum / area},
          {"rms_mm", std::sqrt(squares / area)},
          {"least_mm", *std::ranges::min_element(outside)},
          {"most_mm", *std::ranges::max_element(outside)}};
}

void Compare(std::vector<Answer>& answers) {
  const Answer& own = answers.front();
  for (Answer& answer : answers) {
    std::set<std::string> wanted = answer.landmarks;
    wanted.insert(own.sites.begin(), own.sites.end());
    Json left_out = Json::array();
    std::ranges::set_difference(wanted, answer.sites, std::back_inserter(left_out));
    answer.json["left_out"] = left_out;
    answer.json["difference"] = DifferenceJson(OutsideDistances(answer, own), own.face);
  }
}

class ComparedPictures {
 public:
  ComparedPictures(const std::vector<Answer>& answers, OutputFolder& folder, int threads)
      : answers_(answers), folder_(folder), threads_(threads) {
    for (const Answer& answer : answers) {
      faces_.extend(Bounds(answer.face));
      for (const SceneObject& object : answer.scene.objects) {
        heads_.extend(Bounds(object.mesh));
      }
    }
  }

  void WriteHeads(View view) {
    std::vector<Image> pictures;
    for (const Answer& answer : answers_) {
      pictures.push_back(Picture(answer.scene, view, heads_, Lighting::kStudio));
    }
    Write(std::string(EnumNames(View{})[static_cast<int>(view)]), pictures);
  }

  void WriteDifferences() {
    std::vector<Image> pictures;
    for (const Answer& answer : answers_) {
      std::vector<double> outside = OutsideDistances(answer, answers_.front());
      outside.resize(answer.face.points.size(), kNaN);
      pictures.push_back(Picture({{MappedObject(answer.face, outside, ErrorColours())}},
                                 View::kFront, faces_, Lighting::kEven));
    }
    Write("difference", pictures);
  }

 private:
  Image Picture(const Scene& scene, View view, const Box3& region, Lighting lighting) const {
    const double aspect = static_cast<double>(kSheetWidth) / kSheetHeight;
    return Render(scene, CameraFor(view, region, aspect),
                  {.width = kSheetWidth, .height = kSheetHeight, .lighting = lighting}, threads_);
  }
  void Write(const std::string& name, const std::vector<Image>& pictures) {
    folder_.Write(fmt::format("pictures/alternatives_{}.png", name),
                  EncodePng(ContactSheet(pictures)));
  }

  const std::vector<Answer>& answers_;
  OutputFolder& folder_;
  int threads_;
  Box3 heads_, faces_;
};

void WriteComparedPictures(const std::vector<Answer>& answers, OutputFolder& folder, int threads) {
  ComparedPictures pictures(answers, folder, threads);
  for (const View view : {View::kFront, View::kThreeQuarter, View::kSide}) {
    pictures.WriteHeads(view);
  }
  pictures.WriteDifferences();
}

}  // namespace

std::vector<NamedExperiment> MakeAlternatives(const Experiment& experiment, const fs::path& folder,
                                              const ConfigNode& tree) {
  Experiment own = experiment;
  own.alternatives.clear();
  const std::string text = WriteConfig(own);
  std::vector<NamedExperiment> result;
  std::set<std::string> names;
  ConfigErrors errors;
  for (std::size_t k = 0; k < experiment.alternatives.size(); ++k) {
    const Alternative& alternative = experiment.alternatives[k];
    AlternativeFaults faults(tree, k, alternative, errors);
    if (!IsName(alternative.name)) {
      faults.Add("this is not the name of a folder; use 1 to 60 letters, digits, '_', '-' and '+'");
    } else if (!names.insert(alternative.name).second) {
      faults.Add("the name appears twice; give each alternative its own name");
    }
    ConfigErrors of_settings;
    result.push_back({alternative.name, Read(text, alternative, folder, of_settings)});
    faults.Add(of_settings);
    if (!result.back().experiment.alternatives.empty()) {
      faults.Add("it sets alternatives of its own; list them next to it instead");
    }
    if (of_settings.faults().empty() && !HaveSameSubject(own, result.back().experiment)) {
      faults.Add(
          "it sets another `subject`, but all alternatives share one skull; use a study to compare "
          "skulls");
    }
  }
  errors.ThrowIfAny();
  return result;
}

CheckFindings CheckAlternatives(const std::vector<NamedExperiment>& named, const CheckFindings& own,
                                InputCheck& inputs) {
  CheckFindings all;
  for (const auto& [name, experiment] : named) {
    const CheckFindings found = inputs.Look(experiment);
    AddNamed(name, found.faults, own.faults, all.faults);
    AddNamed(name, found.warnings, own.warnings, all.warnings);
  }
  return all;
}

std::vector<std::string> RunAlternatives(const Experiment& experiment,
                                         const std::vector<NamedExperiment>& named,
                                         const RunResult& own, StageCache& cache,
                                         OutputFolder& folder, const RunContext& context) {
  std::vector<std::string> faults;
  if (named.empty()) {
    return faults;
  }
  std::vector<Answer> answers = {MakeAnswer("this run", {}, own)};
  for (std::size_t k = 0; k < named.size(); ++k) {
    const RunResult result = Run(named[k].experiment, context, &cache);
    OutputFolder below(folder.Root() / "alternatives" / named[k].name, WhenNotEmpty::kReplaceFiles);
    WriteRun(named[k].experiment, result, below, context);
    for (const std::string& fault : result.Faults()) {
      faults.push_back(fmt::format("alternative '{}': {}", named[k].name, fault));
    }
    answers.push_back(MakeAnswer(named[k].name, experiment.alternatives[k].set, result));
  }
  Compare(answers);
  Json json = Json::array();
  for (const Answer& answer : answers) {
    json.push_back(answer.json);
  }
  folder.Write("alternatives.json", WithPlainTexts(json).dump(2) + "\n");
  if (experiment.report) {
    WriteComparedPictures(answers, folder, context.threads);
  }
  return faults;
}

}  // namespace semblance::problems
