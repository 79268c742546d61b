// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/stacking/single_scheme.h"

#include <type_traits>

namespace semblance::interp {
namespace {

template <class Scheme>
bool WorksAlongSurface(const Scheme& scheme) {
  if constexpr (requires { scheme.distance == DowelDistance::kGeodesic; }) {
    if (scheme.distance == DowelDistance::kGeodesic) {
      return true;
    }
  }
  if constexpr (requires { UsesBone(scheme.mean); }) {
    if (UsesBone(scheme.mean)) {
      return true;
    }
  }
  return std::is_same_v<Scheme, SurfaceMatern> || std::is_same_v<Scheme, Harmonic> ||
         std::is_same_v<Scheme, Biharmonic>;
}

}  // namespace

bool SingleNeedsSurface(const SingleScheme& scheme) {
  return std::visit([](const auto& options) { return WorksAlongSurface(options); }, scheme);
}

bool SingleNeedsExpected(const SingleScheme& scheme) {
  return std::visit(
      [](const auto& options) {
        if constexpr (requires { options.mean == DepthMean::kTable; }) {
          return options.mean == DepthMean::kTable;
        }
        return false;
      },
      scheme);
}

bool SingleNeedsNetwork(const SingleScheme& scheme) {
  return std::holds_alternative<Barycentric>(scheme) ||
         std::holds_alternative<NetworkSpline>(scheme);
}

std::size_t SingleFewestDowels(const SingleScheme& scheme) {
  return std::visit(
      [](const auto& options) -> std::size_t {
        if constexpr (requires { FewestDowels(options.mean); }) {
          return FewestDowels(options.mean);
        }
        return 1;
      },
      scheme);
}

}  // namespace semblance::interp
