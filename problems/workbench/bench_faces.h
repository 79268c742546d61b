// SPDX-License-Identifier: GPL-3.0-or-later
// The faces that the workbench shows: a coarse one at once, the run's after it.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "problems/pipeline/case.h"
#include "problems/pipeline/stage_cache.h"
#include "problems/workbench/bench_subject.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

struct BenchFace {
  HSplineSurface surface;
  std::vector<Dowel> dowels;
  std::vector<std::string> notes;
  double seconds = kNaN;  // that making a coarse face took
};

// The head, which has a skull, as a run takes it, but on the thinned-out one: dowels with their
// depths, and notes. Throws as MakeCase.
Case CoarseCase(const BenchSubject& subject, const Experiment& experiment, const BenchState& state);

// The face without the implicit surface and without a fit: the prior's most likely face given the
// dowels' tips alone, where the experiment's way to the face asks a prior; else the generic face
// bent to the tips by a thin plate. Dowels stand on the thinned-out skull. Takes some tenths of a
// second once `cache` has the template and the prior. Throws as MakeCase and MakeFace.
BenchFace CoarseFace(const BenchSubject& subject, const Experiment& experiment,
                     const BenchState& state, StageCache& cache, const RunContext& context);

// Of the whole work: what side by side is compared.
enum class BenchVariant { kAsIs, kEmaciated, kNormal, kObese, kThinner, kThicker };
inline constexpr std::array kBenchVariants = {BenchVariant::kAsIs,    BenchVariant::kEmaciated,
                                              BenchVariant::kNormal,  BenchVariant::kObese,
                                              BenchVariant::kThinner, BenchVariant::kThicker};
constexpr auto EnumNames(BenchVariant) {
  return std::to_array<std::string_view>(
      {"as_is", "emaciated", "normal", "obese", "thinner", "thicker"});
}
std::string_view NameOf(BenchVariant variant);

// Throws InputError for a name that is none.
BenchVariant VariantCalled(std::string_view name);

inline constexpr double kUsualSd_mm = 3;  // where a table states none: the T-Table 2023's mean

// The shown face's quads along each side of a patch of its finest level.
inline constexpr int kShownQuadsPerPatch = 2;

// The experiment of a variant. kThinner and kThicker: each dowel's depth less or more by its
// standard deviation, `fallback_sd_mm` where the table states none.
Experiment VariantOf(const Experiment& experiment, BenchVariant variant,
                     const std::vector<Dowel>& dowels, double fallback_sd_mm);

}  // namespace semblance
