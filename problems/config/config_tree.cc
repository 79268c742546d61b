// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/config/config_tree.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>

#include "problems/config/config_limits.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

// One step of a path: a key, or an index into a list.
struct Step {
  std::string_view key;
  std::optional<std::size_t> index;
  std::string_view until_here;  // the path up to and with this step, for messages
};

[[noreturn]] void FailMalformed(std::string_view path) {
  throw ConfigError(fmt::format("{}: not a path; write it like a.b[0].c", path));
}

// Reads "name" or "[3]" (and the dot before a name) at `at`, and moves `at` behind it.
Step TakeStep(std::string_view path, std::size_t& at) {
  Step step;
  if (path[at] == '[') {
    const std::size_t close = path.find(']', at);
    std::size_t index = 0;
    const char* first = path.data() + at + 1;
    const char* last = path.data() + std::min(close, path.size());
    const auto [end, error] = std::from_chars(first, last, index);
    if (at == 0 || close == path.npos || error != std::errc() || end != last) {
      FailMalformed(path);
    }
    step.index = index;
    at = close + 1;
  } else {
    const std::size_t begin = at == 0 ? 0 : at + 1;
    if (at > 0 && path[at] != '.') {
      FailMalformed(path);
    }
    at = std::min(path.find_first_of(".[]", begin), path.size());
    step.key = path.substr(begin, at - begin);
    if (step.key.empty()) {
      FailMalformed(path);
    }
  }
  step.until_here = path.substr(0, at);
  return step;
}

std::vector<Step> ParsePath(std::string_view path) {
  std::vector<Step> steps;
  std::size_t at = 0;
  do {
    if (path.empty()) {
      FailMalformed(path);
    }
    steps.push_back(TakeStep(path, at));
    if (steps.size() > kDeepestConfig) {
      throw ConfigError(fmt::format("{}...: a path of more than {} steps leads nowhere",
                                    path.substr(0, 40), kDeepestConfig));
    }
  } while (at < path.size());
  return steps;
}

// The bare name of a variant's type, as a map that options can be added to.
void ExpandBareName(ConfigNode& node) {
  if (node.IsScalar()) {
    ConfigNode map = ConfigNode::Map();
    map.location = node.location;
    map.entries.push_back({"type", node.location, std::move(node)});
    node = std::move(map);
  }
}

bool IsAnotherType(const ConfigNode& base, const ConfigNode& over) {
  const ConfigNode* over_type = over.Find("type");
  const ConfigNode* base_type = base.Find("type");
  return over_type && (!base_type || base_type->text != over_type->text);
}

// What `defaults` has for a map that stands at `node`: nothing, if the two are of different types.
const ConfigNode* MatchingDefaults(const ConfigNode& node, const ConfigNode* defaults) {
  const ConfigNode* type = node.Find("type");
  return defaults && type && IsAnotherType(*defaults, node) ? nullptr : defaults;
}

// Whether two entries were said together: in one file, or both by overrides.
bool IsSameLayer(const ConfigLocation& a, const ConfigLocation& b) {
  const bool are_overrides = a.source && b.source && !a.source->has_lines && !b.source->has_lines;
  return a.source && (a.source == b.source || are_overrides);
}

// Leaves of `node` what stands in the layer of `location`. Returns whether anything does.
bool KeepLayer(ConfigNode& node, const ConfigLocation& location) {
  bool keeps_part = IsSameLayer(node.location, location);
  for (ConfigNode& item : node.items) {
    keeps_part |= KeepLayer(item, location);
  }
  std::erase_if(node.entries,
                [&](ConfigNode::Entry& entry) { return !KeepLayer(entry.value, location); });
  return keeps_part || !node.entries.empty();
}

// A variant that is about to get the type that `type` names. Where that is another one, it replaces
// what lower layers say of the variant, as in MergeTrees. Options given beside it stay: if the type
// does not have them, the reader refuses them.
void ForgetFormerType(ConfigNode& variant, const ConfigNode& type, const ConfigNode* defaults) {
  const ConfigNode* named = variant.Find("type");
  const ConfigNode* former = named || !defaults ? named : defaults->Find("type");
  if (former && former->text != type.text) {
    KeepLayer(variant, type.location);
  }
}

// The entry that `step` names; made, as written at `location`, where it is missing.
ConfigNode& StepIntoMap(ConfigNode& node, const Step& step, const ConfigNode*& defaults,
                        bool is_last, const ConfigLocation& location) {
  ExpandBareName(node);
  if (node.IsList()) {
    throw ConfigError(
        fmt::format("{}: this is an entry of a list; write its index, like [0]", step.until_here));
  }
  node.kind = ConfigNode::Kind::kMap;
  const ConfigNode* matching = MatchingDefaults(node, defaults);
  defaults = matching ? matching->Find(step.key) : nullptr;
  const auto entry = std::find_if(node.entries.begin(), node.entries.end(),
                                  [&](const auto& candidate) { return candidate.key == step.key; });
  if (entry != node.entries.end()) {
    entry->key_location = is_last ? location : entry->key_location;
    return entry->value;
  }
  node.entries.push_back({std::string(step.key), location, {}});
  ConfigNode& child = node.entries.back().value;
  if (defaults && !is_last) {
    child = *defaults;
  }
  child.location = location;
  return child;
}

ConfigNode& StepIntoList(ConfigNode& node, const Step& step, const ConfigNode*& defaults) {
  if (!node.IsList()) {
    throw ConfigError(fmt::format("{}: there is no list to take an item of", step.until_here));
  }
  if (*step.index >= node.items.size()) {
    throw ConfigError(fmt::format("{}: past the end; the list has {} item{}, counted from 0",
                                  step.until_here, node.items.size(),
                                  node.items.size() == 1 ? "" : "s"));
  }
  const bool has_default = defaults && defaults->IsList() && *step.index < defaults->items.size();
  defaults = has_default ? &defaults->items[*step.index] : nullptr;
  return node.items[*step.index];
}

}  // namespace

std::string ToText(const ConfigLocation& location) {
  if (!location.source) {
    return "default";
  }
  return location.source->has_lines
             ? fmt::format("{}:{}:{}", location.source->name, location.line, location.column)
             : location.source->name;
}

ConfigNode ConfigNode::Scalar(std::string text) {
  ConfigNode node = OfKind(Kind::kScalar);
  node.text = std::move(text);
  return node;
}

ConfigNode ConfigNode::Quoted(std::string text) {
  ConfigNode node = Scalar(std::move(text));
  node.quoted = true;
  return node;
}

ConfigNode ConfigNode::OfKind(Kind kind) {
  ConfigNode node;
  node.kind = kind;
  return node;
}

const ConfigNode* ConfigNode::Find(std::string_view key) const {
  const auto it = std::find_if(entries.begin(), entries.end(),
                               [&](const Entry& entry) { return entry.key == key; });
  return it == entries.end() ? nullptr : &it->value;
}

ConfigNode* ConfigNode::Find(std::string_view key) {
  return const_cast<ConfigNode*>(std::as_const(*this).Find(key));
}

ConfigNode& ConfigNode::Set(std::string_view key, ConfigNode value) {
  if (ConfigNode* old = Find(key)) {
    return *old = std::move(value);
  }
  ConfigLocation key_location = value.location;
  entries.push_back({std::string(key), std::move(key_location), std::move(value)});
  return entries.back().value;
}

ConfigNode MergeTrees(ConfigNode base, const ConfigNode& over) {
  if (!over.IsMap()) {
    return over;
  }
  ExpandBareName(base);
  if (!base.IsMap() || IsAnotherType(base, over)) {
    return over;
  }
  for (const ConfigNode::Entry& entry : over.entries) {
    ConfigNode* old = base.Find(entry.key);
    base.Set(entry.key, old ? MergeTrees(std::move(*old), entry.value) : entry.value);
  }
  base.location = over.location;
  return base;
}

ConfigLocation LocationOf(const ConfigNode& tree, std::string_view path) {
  const ConfigNode* node = &tree;
  for (const Step& step : ParsePath(path)) {
    const bool has_item = step.index && *step.index < node->items.size();
    const ConfigNode* child =
        step.index ? (has_item ? &node->items[*step.index] : nullptr) : node->Find(step.key);
    if (!child) {
      break;
    }
    node = child;
  }
  return node->location;
}

void SetPath(ConfigNode& tree, std::string_view path, const ConfigNode& value,
             const ConfigNode* defaults) {
  const std::vector<Step> steps = ParsePath(path);
  ConfigNode edited = tree;  // so that a path that leads nowhere changes nothing
  ConfigNode* node = &edited;
  for (const Step& step : steps) {
    const bool is_last = &step == &steps.back();
    if (is_last && step.key == "type" && node->IsMap()) {
      ForgetFormerType(*node, value, defaults);
    }
    node = step.index ? &StepIntoList(*node, step, defaults)
                      : &StepIntoMap(*node, step, defaults, is_last, value.location);
  }
  *node = MergeTrees(std::move(*node), value);
  tree = std::move(edited);
}

}  // namespace semblance
