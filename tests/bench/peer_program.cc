// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/bench/peer_program.h"

#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>

namespace semblance::bench {
using namespace problems;
namespace {

std::filesystem::path NewFolder() {
  std::string name = (std::filesystem::temp_directory_path() / "fit_bench_XXXXXX").string();
  return mkdtemp(name.data()) == nullptr ? "" : name;
}

}  // namespace

PeerFiles::PeerFiles(const std::vector<File>& files) : folder_(NewFolder()) {
  for (const auto& [name, values] : files) {
    std::ofstream(folder_ / name, std::ios::binary)
        .write(reinterpret_cast<const char*>(values.data()),
               static_cast<std::streamsize>(values.size() * sizeof(double)));
    names_ += fmt::format("{}'{}'", names_.empty() ? "" : " ", (folder_ / name).string());
  }
}

PeerFiles::~PeerFiles() { std::filesystem::remove_all(folder_); }

Measured AskPeer(const std::string& command) {
  Measured measured;
  std::FILE* const pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) {
    return measured;
  }
  const int read =
      std::fscanf(pipe, "%lf %lf %lf", &measured.seconds, &measured.rms_mm, &measured.largest_mm);
  return pclose(pipe) == 0 && read == 3 ? measured : Measured{};
}

// Another Python that comes first in the path does not see Debian's packages.
Measured AskScipy(const std::string& script) {
  const bool there = std::system("/usr/bin/python3 -c 'import scipy.interpolate' 2>/dev/null") == 0;
  return there ? AskPeer("/usr/bin/python3 " + script) : Measured{};
}

}  // namespace semblance::bench
