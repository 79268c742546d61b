// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/interpolate_depth.h"

#include <algorithm>
#include <ranges>
#include <type_traits>

namespace semblance::interp {
namespace {

// A choice that is no scheme of the dowels alone.
template <class Scheme>
constexpr bool IsApart = std::is_same_v<Scheme, PopulationDepth> ||
                         std::is_same_v<Scheme, DepthMap> || std::is_same_v<Scheme, ExternalScheme>;

}  // namespace

DepthField InterpolateDepth(const DepthScheme& scheme, const DepthInput& input,
                            const RunContext& run) {
  return std::visit([&](const auto& options) { return InterpolateDepth(options, input, run); },
                    scheme);
}

bool NeedsSurface(const DepthScheme& scheme) {
  return std::visit(
      [](const auto& options) {
        using Scheme = std::decay_t<decltype(options)>;
        if constexpr (std::is_same_v<Scheme, AutoScheme>) {
          return std::ranges::any_of(options.schemes, SingleNeedsSurface);
        } else if constexpr (std::is_same_v<Scheme, PopulationDepth>) {
          return true;
        } else if constexpr (std::is_same_v<Scheme, DepthMap>) {
          return false;
        } else if constexpr (std::is_same_v<Scheme, ExternalScheme>) {
          return options.function && options.function->needs_surface;
        } else {
          return SingleNeedsSurface(options);
        }
      },
      scheme);
}

bool NeedsExpected(const DepthScheme& scheme) {
  return std::visit(
      [](const auto& options) {
        using Scheme = std::decay_t<decltype(options)>;
        if constexpr (std::is_same_v<Scheme, AutoScheme>) {
          return std::ranges::any_of(options.schemes, SingleNeedsExpected);
        } else if constexpr (IsApart<Scheme>) {
          return false;
        } else {
          return SingleNeedsExpected(options);
        }
      },
      scheme);
}

bool NeedsNetwork(const DepthScheme& scheme) {
  return std::visit(
      [](const auto& options) {
        using Scheme = std::decay_t<decltype(options)>;
        if constexpr (std::is_same_v<Scheme, AutoScheme>) {
          return std::ranges::all_of(options.schemes, SingleNeedsNetwork);
        } else if constexpr (std::is_same_v<Scheme, ExternalScheme>) {
          return options.function && options.function->needs_network;
        } else if constexpr (IsApart<Scheme>) {
          return false;
        } else {
          return SingleNeedsNetwork(options);
        }
      },
      scheme);
}

std::size_t FewestDowels(const DepthScheme& scheme) {
  return std::visit(
      [](const auto& options) -> std::size_t {
        using Scheme = std::decay_t<decltype(options)>;
        if constexpr (std::is_same_v<Scheme, AutoScheme>) {
          const auto& schemes = options.schemes;
          return schemes.empty()
                     ? 1
                     : std::ranges::min(schemes | std::views::transform(SingleFewestDowels));
        } else if constexpr (std::is_same_v<Scheme, PopulationDepth>) {
          return 6;
        } else if constexpr (std::is_same_v<Scheme, DepthMap> ||
                             std::is_same_v<Scheme, ExternalScheme>) {
          return 1;
        } else {
          return SingleFewestDowels(options);
        }
      },
      scheme);
}

}  // namespace semblance::interp
