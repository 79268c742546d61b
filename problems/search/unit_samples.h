// SPDX-License-Identifier: GPL-3.0-or-later
// Points that fill the unit cube.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

namespace semblance {

// lhs: one point in each of n equal slices of each axis (McKay et al. 1979); sobol: the first n
// points of the sequence after its origin.
enum class SampleMethod { kLhs, kSobol };
constexpr auto EnumNames(SampleMethod) { return std::to_array<std::string_view>({"lhs", "sobol"}); }

// n points of [0,1)^dimensions. random_seed: of kLhs.
std::vector<std::vector<double>> UnitSamples(SampleMethod method, int n, int dimensions,
                                             std::uint64_t random_seed);

}  // namespace semblance
