// SPDX-License-Identifier: GPL-3.0-or-later
// Peers that are programs of their own: what they read, and what they say.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "tests/bench/fit_measure.h"

namespace semblance::bench {
using namespace problems;

// Files of doubles in a folder of their own, which goes with this object.
class PeerFiles {
 public:
  using File = std::pair<std::string, std::vector<double>>;  // name, what is in it
  explicit PeerFiles(const std::vector<File>& files);
  ~PeerFiles();
  PeerFiles(const PeerFiles&) = delete;
  PeerFiles& operator=(const PeerFiles&) = delete;

  const std::string& Names() const { return names_; }  // in the order given, for a shell

 private:
  std::filesystem::path folder_;
  std::string names_;
};

// What a peer's program says: seconds, RMS, largest distance; NaN if it cannot be run.
Measured AskPeer(const std::string& command);

// The same of a script for the system's Python with its arguments; NaN without python3-scipy.
Measured AskScipy(const std::string& script);

}  // namespace semblance::bench
