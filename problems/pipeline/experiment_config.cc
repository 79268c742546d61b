// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/pipeline/experiment_config.h"

namespace semblance {

template ConfigNode ConfigTreeOf(const Experiment& value);
template Experiment ReadConfigTree(const ConfigNode& tree, ConfigErrors& errors);
template Experiment ReadConfig(const std::filesystem::path& file,
                               std::span<const std::string> overrides);
template Experiment ReadConfigText(std::string_view text, const std::filesystem::path& pretend_file,
                                   std::span<const std::string> overrides);
template std::string WriteConfig(const Experiment& value);
template std::string OptionsReference<Experiment>();
template std::string OptionsSchema<Experiment>();

ConfigType DescribeExperiment() { return config_internal::DescribeType(Experiment{}); }

}  // namespace semblance
