// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/manifest.h"

namespace semblance::problems {

std::vector<std::pair<std::string, std::string>> LibraryVersions() {
  return {{"ceres", SEMBLANCE_CERES_VERSION},
          {"eigen", SEMBLANCE_EIGEN_VERSION},
          {"cgal", SEMBLANCE_CGAL_VERSION},
          {"compiler", "g++ " __VERSION__}};
}

}  // namespace semblance::problems
