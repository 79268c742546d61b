// SPDX-License-Identifier: GPL-3.0-or-later
// Depth schemes of the caller, by the names that configurations use for them.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "interp/schemes/external_scheme.h"
#include "problems/experiment/experiment_config.h"

namespace semblance::problems {

// An option of a scheme, with its default. A configuration may set another value of the same kind.
struct ExternalOption {
  enum class Kind { kBool, kInteger, kNumber, kText };
  std::string name;
  Kind kind = Kind::kNumber;
  std::string text;  // the default, as a configuration writes it
};

struct NamedScheme {
  std::string name;         // for `interp: NAME` and `interp: {type: NAME, option: value}`
  std::string source_hash;  // of the scheme's source
  std::vector<ExternalOption> options;
  std::shared_ptr<const ExternalFunction> function;
};

// Throws InputError, which begins with `what`, unless the word begins with a letter and has
// letters, digits and '_' alone.
void RequirePlainWord(const std::string& word, const std::string& what);

// Throws InputError if a name or an option is not a plain word, occurs twice, or is the name of a
// built-in scheme.
void CheckSchemeNames(std::span<const NamedScheme> schemes);

// Does what ReadConfigTree does, but `interp` may also name one of the schemes, or be the
// `external` of a resolved.yaml with the same source. Adds an error for an option that the scheme
// lacks or that is of another kind.
Experiment ReadExperimentTree(ConfigNode tree, std::span<const NamedScheme> schemes,
                              ConfigErrors& errors);

// Does what ReadConfig does, with the schemes.
Experiment ReadExperiment(const std::filesystem::path& file, std::span<const std::string> overrides,
                          std::span<const NamedScheme> schemes);

// Makes the scheme from `interp`, which names it. Without a name in `schemes`, returns nothing.
std::optional<ExternalScheme> ReadExternalScheme(const ConfigNode& interp,
                                                 std::span<const NamedScheme> schemes,
                                                 ConfigErrors& errors);

}  // namespace semblance::problems
