// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/workbench/bench_config.h"

#include <nlohmann/json.hpp>

#include "problems/config/config.h"
#include "problems/config/options_reference.h"
#include "problems/experiment/experiment_config.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;

// The state's settings, and those that name its landmark file and its edit script.
std::vector<BenchSetting> AllSettings(const BenchState& state) {
  std::vector<BenchSetting> settings = state.settings;
  if (!state.landmarks.empty()) {
    settings.push_back({"subject.landmarks", "landmarks.yaml"});
  }
  if (!state.edits.edits.empty() || !state.edits.resets.empty()) {
    settings.push_back({"edits", "edits.yaml"});
  }
  return settings;
}

bool SameText(const ConfigNode* a, const ConfigNode* b) {
  return a != nullptr && b != nullptr && a->text == b->text;
}

bool Same(const ConfigNode& a, const ConfigNode& b) { return ToFlowYaml(a) == ToFlowYaml(b); }

// The entries of `tree` that differ from `defaults`. A variant of another type is kept whole.
ConfigNode Difference(const ConfigNode& tree, const ConfigNode& defaults) {
  const ConfigNode *type = tree.Find("type"), *default_type = defaults.Find("type");
  const bool merges =
      tree.IsMap() && defaults.IsMap() &&
      ((type == nullptr && default_type == nullptr) || SameText(type, default_type));
  if (!merges) {
    return tree;
  }
  ConfigNode difference = ConfigNode::Map();
  for (const ConfigNode::Entry& entry : tree.entries) {
    const ConfigNode* usual = defaults.Find(entry.key);
    if (usual == nullptr || !Same(entry.value, *usual)) {
      difference.Set(entry.key, usual ? Difference(entry.value, *usual) : entry.value);
    }
  }
  return difference;
}

// Removes the folder from the front of every text, which makes absolute paths relative.
void RemovePrefix(ConfigNode& node, const std::string& folder) {
  if (node.IsScalar() && node.text.starts_with(folder)) {
    node.text = node.text.substr(folder.size());
  }
  for (ConfigNode& item : node.items) {
    RemovePrefix(item, folder);
  }
  for (ConfigNode::Entry& entry : node.entries) {
    RemovePrefix(entry.value, folder);
  }
}

}  // namespace

Experiment MakeExperiment(std::string_view start, const fs::path& folder, const BenchState& state) {
  ConfigErrors errors;
  ConfigNode tree =
      ParseConfigText(start, {.name = (folder / state.start).string(), .folder = folder}, errors);
  const ConfigNode defaults = MakeConfigTree(Experiment{});
  int order = 1;
  for (const BenchSetting& setting : AllSettings(state)) {
    const ConfigNode value = ParseConfigText(
        setting.value,
        {.name = setting.path, .folder = folder, .order = order++, .has_lines = false}, errors);
    SetPath(tree, setting.path, value, &defaults);
  }
  Experiment experiment = ReadConfigTree<Experiment>(tree, errors);
  errors.ThrowIfAny();
  return experiment;
}

void MakeRelative(ConfigNode& tree, const fs::path& folder) {
  RemovePrefix(tree, (fs::absolute(folder).lexically_normal() / "").string());
}

std::string StartConfig(const Experiment& experiment, const fs::path& folder) {
  ConfigNode tree = MakeConfigTree(experiment);
  MakeRelative(tree, folder);
  return ToYaml(tree);
}

std::string ShortConfig(const Experiment& experiment, const fs::path& folder) {
  ConfigNode tree = Difference(MakeConfigTree(experiment), MakeConfigTree(Experiment{}));
  MakeRelative(tree, folder);
  return "# Made by `semblance workbench`, for `semblance run`. Missing options have their "
         "defaults.\n" +
         ToYaml(tree);
}

std::string ExperimentJson(const Experiment& experiment) {
  static const ConfigType kType = DescribeExperiment();
  return ValueJson(MakeConfigTree(experiment), kType).dump();
}

}  // namespace semblance::problems
