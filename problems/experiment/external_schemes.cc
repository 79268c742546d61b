// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/external_schemes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <iterator>
#include <optional>
#include <set>
#include <utility>

#include "problems/config/config.h"
#include "problems/config/spelling_suggestion.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

bool IsPlainWord(const std::string& word) {
  return !word.empty() && std::isalpha(static_cast<unsigned char>(word.front())) != 0 &&
         std::ranges::all_of(word, [](unsigned char c) { return std::isalnum(c) || c == '_'; });
}

// The text under `key`, or "" if the node is not a map or lacks it.
std::string TextUnder(const ConfigNode& node, const char* key) {
  const ConfigNode* const value = node.Find(key);
  return value != nullptr && value->IsScalar() ? value->text : "";
}

// The name of the scheme that `interp` names. `external` names it by an option.
std::string SchemeName(const ConfigNode& interp) {
  const std::string type = interp.IsScalar() ? interp.text : TextUnder(interp, "type");
  return type == ExternalScheme::kName ? TextUnder(interp, "name") : type;
}

// Reads a value of the option's kind and writes it in its one form, so that 4 and 4.0 are the same
// number.
template <class T>
std::string ReadText(ConfigErrors& errors, const ConfigItem& item) {
  T value{};
  ReadScalar(errors, item, value);
  return MakeConfigTree(value).text;
}

std::string ReadOption(ConfigErrors& errors, const ConfigItem& item, ExternalOption::Kind kind) {
  switch (kind) {
    case ExternalOption::Kind::kBool:
      return ReadText<bool>(errors, item);
    case ExternalOption::Kind::kInteger:
      return ReadText<int>(errors, item);
    case ExternalOption::Kind::kNumber:
      return ReadText<double>(errors, item);
    case ExternalOption::Kind::kText:
      break;
  }
  std::string text;
  // A resolved.yaml quotes all options, because it stores them as texts.
  ReadScalar(errors, item, text);
  return text;
}

// An option as its kind's reader expects it: only texts may be quoted.
ConfigNode Unquoted(ConfigNode node) {
  node.quoted = false;
  return node;
}

void ReadOptions(const ConfigNode& given, const std::string& path, bool is_resolved,
                 const NamedScheme& scheme, ExternalScheme& result, ConfigErrors& errors) {
  std::vector<std::string> known =
      is_resolved ? std::vector<std::string>{} : std::vector{std::string("type")};
  for (const ExternalOption& option : scheme.options) {
    known.push_back(option.name);
    const FieldInfo info{.name = option.name};
    const ConfigNode* const value = given.Find(option.name);
    const ConfigNode node = value == nullptr ? ConfigNode::Scalar(option.text)
                            : is_resolved    ? Unquoted(*value)
                                             : *value;
    result.options[option.name] =
        ReadOption(errors, {node, JoinPath(path, option.name), info}, option.kind);
  }
  RefuseUnknownKeys(errors, {given, path, FieldInfo{}}, known);
}

const NamedScheme* FindScheme(const std::string& name, std::span<const NamedScheme> schemes) {
  const auto found = std::ranges::find(schemes, name, &NamedScheme::name);
  return found == schemes.end() ? nullptr : &*found;
}

}  // namespace

void RequirePlainWord(const std::string& word, const std::string& what) {
  if (!IsPlainWord(word)) {
    throw InputError(fmt::format(
        "{} '{}': a name begins with a letter and has letters, digits and '_'", what, word));
  }
}

void CheckSchemeNames(std::span<const NamedScheme> schemes) {
  const DepthChoice* const built_in = nullptr;
  std::set<std::string> taken;
  for (const std::string& name : config_internal::TypeNames(built_in)) {
    taken.insert(name);
  }
  for (const NamedScheme& scheme : schemes) {
    RequirePlainWord(scheme.name, "scheme");
    if (!taken.insert(scheme.name).second) {
      throw InputError(fmt::format(
          "scheme '{}': the name is taken by another scheme; choose another name", scheme.name));
    }
    std::set<std::string> options = {"type"};
    for (const ExternalOption& option : scheme.options) {
      RequirePlainWord(option.name, fmt::format("scheme '{}': option", scheme.name));
      if (!options.insert(option.name).second) {
        throw InputError(fmt::format("scheme '{}': no option may have the name '{}'; rename it",
                                     scheme.name, option.name));
      }
    }
  }
}

std::optional<ExternalScheme> ReadExternalScheme(const ConfigNode& interp,
                                                 std::span<const NamedScheme> schemes,
                                                 ConfigErrors& errors) {
  const NamedScheme* const scheme = FindScheme(SchemeName(interp), schemes);
  if (scheme == nullptr) {
    return std::nullopt;
  }
  ExternalScheme result{.name = scheme->name,
                        .source_hash = scheme->source_hash,
                        .options = {},
                        .function = scheme->function};
  const bool is_resolved = TextUnder(interp, "type") == ExternalScheme::kName;
  if (is_resolved && TextUnder(interp, "source_hash") != scheme->source_hash) {
    errors.Add(interp.location, "interp.source_hash",
               fmt::format("the source of the scheme '{}' has changed since this file was written; "
                           "write `interp: {{type: {}, ...}}` to use the present one",
                           scheme->name, scheme->name));
  }
  const ConfigNode* const inner = is_resolved ? interp.Find("options") : &interp;
  const ConfigNode none = ConfigNode::Map();
  ReadOptions(inner != nullptr && inner->IsMap() ? *inner : none,
              is_resolved ? "interp.options" : "interp", is_resolved, *scheme, result, errors);
  return result;
}

namespace {

// Returns the complaint about a name that is neither a built-in scheme nor one of `schemes`, with
// all names, because the reader of configurations lists only the built-in ones. Empty for a known
// name, and without `schemes`.
std::string UnknownSchemeText(const ConfigNode& interp, std::span<const NamedScheme> schemes) {
  const DepthChoice* const built_in = nullptr;
  const std::string name = SchemeName(interp);
  std::vector<std::string> known = config_internal::TypeNames(built_in);
  if (schemes.empty() || name.empty() || std::ranges::find(known, name) != known.end()) {
    return "";
  }
  std::ranges::transform(schemes, std::back_inserter(known), &NamedScheme::name);
  const std::string nearest = NearestWord(name, known);
  return fmt::format("unknown scheme '{}'; known are: {}{}", name, fmt::join(known, ", "),
                     nearest.empty() ? "" : fmt::format("; did you mean '{}'?", nearest));
}

}  // namespace

Experiment ReadExperimentTree(ConfigNode tree, std::span<const NamedScheme> schemes,
                              ConfigErrors& errors) {
  ConfigNode* const interp = tree.Find("interp");
  const std::optional<ExternalScheme> scheme =
      interp == nullptr ? std::nullopt : ReadExternalScheme(*interp, schemes, errors);
  const std::string unknown =
      interp == nullptr || scheme ? "" : UnknownSchemeText(*interp, schemes);
  if (!unknown.empty()) {
    errors.Add(interp->location, "interp", unknown);
    *interp = ConfigNode::Scalar(std::string(Nearest::kName));
  }
  if (!scheme) {
    return ReadConfigTree<Experiment>(tree, errors);
  }
  // The reader knows the built-in schemes alone, and no fault depends on the options of this one.
  *interp = ConfigNode::Scalar(std::string(Nearest::kName));
  auto experiment = ReadConfigTree<Experiment>(tree, errors);
  experiment.interp = *scheme;
  return experiment;
}

Experiment ReadExperiment(const std::filesystem::path& file, std::span<const std::string> overrides,
                          std::span<const NamedScheme> schemes) {
  ConfigErrors errors;
  const ConfigNode tree = LoadConfigTree(file, overrides, MakeConfigTree(Experiment{}), errors);
  Experiment experiment = ReadExperimentTree(tree, schemes, errors);
  errors.ThrowIfAny();
  return experiment;
}

}  // namespace semblance::problems
