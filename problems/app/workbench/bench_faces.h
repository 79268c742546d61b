// SPDX-License-Identifier: GPL-3.0-or-later
// The faces that the workbench shows: a coarse face at once, the full face of a run later, variants
// of both, and the preview of a pull.
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "problems/app/workbench/bench_subject.h"
#include "problems/experiment/case.h"
#include "problems/experiment/stage_cache.h"
#include "problems/face/pull.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance::problems {

struct BenchFace {
  HSplineSurface surface;
  std::vector<Dowel> dowels;
  std::vector<std::string> notes;
  std::string faults = "[]";  // FaultMarks of a full face as JSON; a coarse face is not judged
  double seconds = kNaN;      // duration of making a coarse face; NaN for a full one
};

// The case as a run makes it, but on the decimated skull: dowels with their depths, and notes. The
// subject must have a skull. Throws as MakeCase.
Case CoarseCase(const BenchSubject& subject, const Experiment& experiment, const BenchState& state);

// A face without first face and without fit. If the experiment's method uses a prior, the face is
// the prior's most likely face given the dowels' tips alone; otherwise the template bent to the
// tips by a thin plate. The dowels stand on the decimated skull. Takes some tenths of a second once
// `cache` holds the template and the prior. Throws as MakeCase and MakeFace.
BenchFace CoarseFace(const BenchSubject& subject, const Experiment& experiment,
                     const BenchState& state, StageCache& cache, const RunContext& context);

// A variant of the experiment, for comparison beside the other variants.
enum class BenchVariant { kAsIs, kEmaciated, kNormal, kObese, kThinner, kThicker };
inline constexpr std::array kBenchVariants = {BenchVariant::kAsIs,    BenchVariant::kEmaciated,
                                              BenchVariant::kNormal,  BenchVariant::kObese,
                                              BenchVariant::kThinner, BenchVariant::kThicker};
constexpr auto EnumNames(BenchVariant) {
  return std::to_array<std::string_view>(
      {"as_is", "emaciated", "normal", "obese", "thinner", "thicker"});
}
std::string_view VariantName(BenchVariant variant);

// Throws InputError for an unknown name.
BenchVariant FindVariant(std::string_view name);

// Standard deviation of a depth if the table states none: the mean of the T-Table 2023.
inline constexpr double kUsualSd_mm = 3;

// The shown face has this number of quads along each side of a patch of its finest level.
inline constexpr int kShownQuadsPerPatch = 2;

// The experiment of a variant. kThinner and kThicker subtract or add each dowel's standard
// deviation, or `fallback_sd_mm` if the table states none.
Experiment VariantExperiment(const Experiment& experiment, BenchVariant variant,
                             const std::vector<Dowel>& dowels, double fallback_sd_mm);

// A full face of a variant, with the edits.
struct VariantFace {
  BenchFace face;
  std::string key;  // hash of all that the face depends on
};
using VariantFaces = std::map<BenchVariant, VariantFace>;

// Writes the variant's surface, faults and key to FOLDER/variants. Throws IoError.
void StoreVariant(const std::filesystem::path& folder, BenchVariant variant,
                  const VariantFace& made);

// Reads the stored surfaces whose key is `key`. dowels: returns the dowels of a variant, which are
// not stored.
VariantFaces StoredVariants(const std::filesystem::path& folder, const std::string& key,
                            const std::function<std::vector<Dowel>(BenchVariant)>& dowels);

// (u,v) of the face's point that is nearest to `at`, interpolated within the shown triangles.
Vec2 NearestParameter(const HSplineSurface& face, const Vec3& at);

// The displacements in mm of the vertices of Tessellate(face, per_patch) for pulls of 1 mm along x,
// y and z. The page draws a pull as their sum while the pointer moves. The sum is exact except for
// finer detail that turns with the surface, because all else is linear in by_mm. pull.by_mm is
// ignored. Throws as Pulled.
std::array<std::vector<Vec3>, 3> PullMoves(const HSplineSurface& face, Pull pull, int per_patch);

}  // namespace semblance::problems
