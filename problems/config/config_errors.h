// SPDX-License-Identifier: GPL-3.0-or-later
// Collects everything that is wrong with a configuration, so that it is told at once.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "problems/config/config_tree.h"

namespace semblance {

// What is wrong with the entry at a path, in the words of ConfigErrors::Add.
struct OptionFault {
  std::string path, what;
};

// One that is told, with its location.
struct ConfigFault {
  ConfigLocation location;
  std::string path, what;
};

class ConfigErrors {
 public:
  // `path` is that of the entry ("a.b[0].c"), empty for the document as a whole; `what` is one
  // clause or more, with the remedy.
  void Add(const ConfigLocation& location, std::string_view path, std::string_view what);
  std::size_t size() const { return faults_.size(); }
  const std::vector<ConfigFault>& faults() const { return faults_; }
  // Throws ConfigError with one line an error, in the order of sources, lines and columns; does
  // nothing if there are none.
  void ThrowIfAny() const;

 private:
  std::vector<ConfigFault> faults_;
};

}  // namespace semblance
