// SPDX-License-Identifier: GPL-3.0-or-later
// An experiment's options as text: its configuration (config.h), and keys of stages made from
// options. The templates take long to compile, so they are instantiated in one place
// (experiment.cc).
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "problems/config/config.h"
#include "problems/experiment/experiment.h"

namespace semblance::problems {

extern template ConfigNode MakeConfigTree(const Experiment& value);
extern template Experiment ReadConfigTree(const ConfigNode& tree, ConfigErrors& errors);
extern template Experiment ReadConfig(const std::filesystem::path& file,
                                      std::span<const std::string> overrides);
extern template Experiment ReadConfigText(std::string_view text,
                                          const std::filesystem::path& pretend_file,
                                          std::span<const std::string> overrides);
extern template std::string WriteConfig(const Experiment& value);
extern template std::string OptionsReference<Experiment>();
extern template std::string OptionsSchema<Experiment>();

// All options with their defaults, as data for user interfaces.
ConfigType DescribeExperiment();

// A key of the stage cache (stage_cache.h): the stage's name and the resolved options from which
// its value is made, one per line. Paths are not resolved to contents, so a file must not change
// while a cache lives.
template <class... Options>
std::string StageKey(const char* stage, const Options&... options) {
  std::string key = stage;
  for (const std::string& text : {ToFlowYaml(MakeConfigTree(options))...}) {
    key += "\n" + text;
  }
  return key;
}

}  // namespace semblance::problems
