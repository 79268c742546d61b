// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/config/config_tree.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <optional>
#include <tuple>

#include "problems/config/utf8_check.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

// One step of a path: a key, or an index into a list.
struct Step {
  std::string_view key;
  std::optional<std::size_t> index;
  std::string_view until_here;  // the path up to and including this step, for messages
};

[[noreturn]] void FailMalformed(std::string_view path) {
  throw ConfigError(fmt::format("{}: not a path; write it like a.b[0].c", path));
}

// Reads "name" or "[3]" (and the dot before a name) at `at`, and moves `at` past it.
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
    if (steps.size() > kMaxConfigDepth) {
      throw ConfigError(fmt::format("{}...: a path of more than {} steps leads nowhere",
                                    path.substr(0, 40), kMaxConfigDepth));
    }
  } while (at < path.size());
  return steps;
}

// Turns the bare name of a variant's type into a map, to which options can be added.
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

// Returns the defaults for the map `node`, or nullptr if the two have different types.
const ConfigNode* MatchingDefaults(const ConfigNode& node, const ConfigNode* defaults) {
  const ConfigNode* type = node.Find("type");
  return defaults && type && IsAnotherType(*defaults, node) ? nullptr : defaults;
}

// Returns true if both entries are from the same file, or both are from overrides.
bool IsSameLayer(const ConfigLocation& a, const ConfigLocation& b) {
  const bool are_overrides = a.source && b.source && !a.source->has_lines && !b.source->has_lines;
  return a.source && (a.source == b.source || are_overrides);
}

// Keeps only the parts of `node` from the layer of `location`. Returns true if any part is left.
bool KeepLayer(ConfigNode& node, const ConfigLocation& location) {
  bool keeps_part = IsSameLayer(node.location, location);
  for (ConfigNode& item : node.items) {
    keeps_part |= KeepLayer(item, location);
  }
  std::erase_if(node.entries,
                [&](ConfigNode::Entry& entry) { return !KeepLayer(entry.value, location); });
  return keeps_part || !node.entries.empty();
}

// Prepares a variant for the type that `type` names. If the type changes, the options that lower
// layers set are dropped, as in MergeTrees. Options of the same layer stay; the reader refuses them
// if the new type does not have them.
void ForgetFormerType(ConfigNode& variant, const ConfigNode& type, const ConfigNode* defaults) {
  const ConfigNode* named = variant.Find("type");
  const ConfigNode* former = named || !defaults ? named : defaults->Find("type");
  if (former && former->text != type.text) {
    KeepLayer(variant, type.location);
  }
}

// Returns the entry that `step` names. A missing entry is created with `location`.
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
    throw ConfigError(fmt::format("{}: an index needs a list, and there is none", step.until_here));
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

// Sort key of the errors. Defaults have no source and come first.
std::tuple<int, int, int> SortKey(const ConfigFault& fault) {
  const ConfigLocation& at = fault.location;
  return {at.source ? at.source->order : -1, at.line, at.column};
}

// Returns true if every YAML reader takes the unquoted text as a text.
bool IsPlainText(std::string_view text) {
  constexpr std::array<std::string_view, 12> kOther = {
      "null", "true", "false", "yes", "no", "on", "off", "y", "n", "nan", "inf", "infinity"};
  std::string lower;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x80 ||
        !(std::isalnum(byte) || std::string_view("_./-").find(c) != std::string_view::npos)) {
      return false;
    }
    lower += static_cast<char>(std::tolower(byte));
  }
  const bool has_first = !lower.empty() && (std::isalpha(static_cast<unsigned char>(lower[0])) ||
                                            lower[0] == '/' || lower[0] == '_');
  return has_first && std::find(kOther.begin(), kOther.end(), lower) == kOther.end();
}

std::string QuotedText(std::string_view text) {
  std::string out = "\"";
  for (const Character& c : SplitCharacters(text)) {
    if (c.code == '"' || c.code == '\\') {
      out += '\\';
      out += c.bytes;
    } else if (c.code != Character::kNotUtf8 && ControlsText(c.code)) {
      out += c.code < 0x100 ? fmt::format("\\x{:02X}", static_cast<unsigned>(c.code))
                            : fmt::format("\\u{:04X}", static_cast<unsigned>(c.code));
    } else {
      out += c.bytes;
    }
  }
  return out + '"';
}

std::string YamlText(std::string_view text) {
  return IsPlainText(text) ? std::string(text) : QuotedText(text);
}

// Returns true if the node is written on the line of its key.
bool IsInline(const ConfigNode& node) {
  const auto is_leaf = [](const ConfigNode& item) { return item.IsScalar() || item.IsNull(); };
  return is_leaf(node) || (node.IsMap() && node.entries.empty()) ||
         (node.IsList() && std::all_of(node.items.begin(), node.items.end(), is_leaf));
}

void AddBlock(const ConfigNode& node, std::size_t indent, std::string& out) {
  const std::string margin(indent, ' ');
  if (IsInline(node)) {
    out += fmt::format("{}{}\n", margin, ToFlowYaml(node));
  } else if (node.IsMap()) {
    for (const ConfigNode::Entry& entry : node.entries) {
      out += fmt::format("{}{}:", margin, YamlText(entry.key));
      if (IsInline(entry.value)) {
        out += fmt::format(" {}\n", ToFlowYaml(entry.value));
      } else {
        out += "\n";
        AddBlock(entry.value, indent + 2, out);
      }
    }
  } else {
    for (const ConfigNode& item : node.items) {
      const std::size_t begin = out.size();
      AddBlock(item, indent + 2, out);
      out[begin + indent] = '-';
    }
  }
}

void RequireFinite(const ConfigNode& node, const std::string& path) {
  if (node.IsScalar() && !node.quoted &&
      (node.text.ends_with("nan") || node.text.ends_with("inf"))) {
    throw InputError(fmt::format(
        "{}: {} cannot be written to a configuration; only finite numbers can", path, node.text));
  }
  for (const ConfigNode::Entry& entry : node.entries) {
    RequireFinite(entry.value, JoinPath(path, entry.key));
  }
  for (std::size_t i = 0; i < node.items.size(); ++i) {
    RequireFinite(node.items[i], JoinPath(path, i));
  }
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

std::string JoinPath(std::string_view parent, std::string_view key) {
  return parent.empty() ? std::string(key) : fmt::format("{}.{}", parent, key);
}

std::string JoinPath(std::string_view parent, std::size_t index) {
  return fmt::format("{}[{}]", parent, index);
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

ConfigLocation FindLocation(const ConfigNode& tree, std::string_view path) {
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

std::string CanonicalPath(std::string_view path) {
  std::string canonical;
  for (const Step& step : ParsePath(path)) {
    canonical = step.index ? JoinPath(canonical, *step.index) : JoinPath(canonical, step.key);
  }
  return canonical;
}

bool SetsEntry(std::string_view path, const ConfigNode& value, std::string_view inner) {
  const bool is_within =
      inner.starts_with(path) &&
      (inner.size() == path.size() || inner[path.size()] == '.' || inner[path.size()] == '[');
  const std::vector<Step> steps = is_within ? ParsePath(inner) : std::vector<Step>();
  const ConfigNode* node = is_within ? &value : nullptr;
  for (std::size_t k = is_within ? ParsePath(path).size() : 0; node && k < steps.size(); ++k) {
    const Step& step = steps[k];
    if (node->IsNull() || (node->IsScalar() && step.key == "type")) {
      return true;
    }
    const bool has_item = step.index && *step.index < node->items.size();
    node = step.index ? (has_item ? &node->items[*step.index] : nullptr) : node->Find(step.key);
  }
  return node != nullptr;
}

void SetPath(ConfigNode& tree, std::string_view path, const ConfigNode& value,
             const ConfigNode* defaults) {
  const std::vector<Step> steps = ParsePath(path);
  ConfigNode edited = tree;  // a copy, so that a wrong path changes nothing
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

void ConfigErrors::Add(const ConfigLocation& location, std::string_view path,
                       std::string_view what) {
  faults_.push_back({location, std::string(path), std::string(what)});
}

void ConfigErrors::ThrowIfAny() const {
  if (faults_.empty()) {
    return;
  }
  std::vector<ConfigFault> sorted = faults_;
  std::ranges::stable_sort(sorted, {}, SortKey);
  std::string lines;
  for (const ConfigFault& fault : sorted) {
    lines += fmt::format("{}{}: {}{}{}", lines.empty() ? "" : "\n", ToText(fault.location),
                         fault.path, fault.path.empty() ? "" : ": ", fault.what);
  }
  throw ConfigError(lines);
}

std::string ToFlowYaml(const ConfigNode& tree) {
  if (tree.IsNull()) {
    return "null";
  }
  if (tree.IsScalar()) {
    return tree.quoted ? YamlText(tree.text) : tree.text;
  }
  std::string inside;
  for (const ConfigNode::Entry& entry : tree.entries) {
    inside += fmt::format("{}{}: {}", inside.empty() ? "" : ", ", YamlText(entry.key),
                          ToFlowYaml(entry.value));
  }
  for (const ConfigNode& item : tree.items) {
    inside += fmt::format("{}{}", inside.empty() ? "" : ", ", ToFlowYaml(item));
  }
  return tree.IsMap() ? fmt::format("{{{}}}", inside) : fmt::format("[{}]", inside);
}

std::string ToYaml(const ConfigNode& tree) {
  RequireFinite(tree, "");
  std::string out;
  AddBlock(tree, 0, out);
  return out;
}

}  // namespace semblance::problems
