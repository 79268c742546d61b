// SPDX-License-Identifier: GPL-3.0-or-later
// Keys of the stage cache: what a value is made from, as text. Apart from stage_cache.h, whose
// users need not know how options are written.
#pragma once

#include <string>

#include "problems/config/config.h"

namespace semblance {

// The stage's name and the resolved options, one per line. Paths stand as they are: a file must not
// change while a cache lives.
template <class... Options>
std::string StageKey(const char* stage, const Options&... options) {
  std::string key = stage;
  for (const std::string& text : {ToFlowYaml(ConfigTreeOf(options))...}) {
    key += "\n" + text;
  }
  return key;
}

}  // namespace semblance
