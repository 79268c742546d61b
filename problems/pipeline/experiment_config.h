// SPDX-License-Identifier: GPL-3.0-or-later
// Reading and writing an experiment's configuration (config.h): these templates take long to
// compile, so they are instantiated in one place.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "problems/config/config.h"
#include "problems/pipeline/experiment.h"

namespace semblance {

extern template ConfigNode ConfigTreeOf(const Experiment& value);
extern template Experiment ReadConfigTree(const ConfigNode& tree, ConfigErrors& errors);
extern template Experiment ReadConfig(const std::filesystem::path& file,
                                      std::span<const std::string> overrides);
extern template Experiment ReadConfigText(std::string_view text,
                                          const std::filesystem::path& pretend_file,
                                          std::span<const std::string> overrides);
extern template std::string WriteConfig(const Experiment& value);
extern template std::string OptionsReference<Experiment>();
extern template std::string OptionsSchema<Experiment>();

// All options as data, with their defaults: for whatever offers them to people.
ConfigType DescribeExperiment();

}  // namespace semblance
