// SPDX-License-Identifier: GPL-3.0-or-later
// What a fit of points tells: in words, as JSON, and as the files of its folder.
#pragma once

#include <array>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "fitting/nested/nested_fit.h"
#include "fitting/relaxation/foot_moves.h"
#include "problems/output/files.h"
#include "problems/output/given_files.h"
#include "problems/points/point_fit.h"
#include "surfaces/base/run_context.h"

namespace semblance {

nlohmann::ordered_json AutoJson(const AutoReport& report);

// A few lines for people: noise, outliers, and whether points of this density can support more.
std::string AutoText(const AutoReport& report);

// How (u,v) were moved before the fit.
nlohmann::ordered_json MovesJson(const FootMoves& moves);
std::string MovesText(const FootMoves& moves);

// What WritePointFit may write (given_files.h).
inline constexpr std::array<std::string_view, 9> kPointFitFiles = {
    "resolved.yaml", "surface.hspline.json", "surface.ply",
    "residuals.csv", "residuals.ply",        "attributes_*.hspline.json",
    "report.html",   "timing.json",          "result.json"};

// Those of them that not every fit writes: by what stands in their heads.
inline constexpr std::array<FileMark, 4> kPointFitMarks = {
    FileMark{R"(residuals\.csv)", "residual_mm"}, FileMark{R"(residuals\.ply)", "residual_mm"},
    FileMark{R"(attributes_\d+\.hspline\.json)", "semblance-hspline"},
    FileMark{R"(report\.html)", "An H-spline surface through"}};

// Writes resolved.yaml, result.json, residuals.csv or .ply (in the order of the table),
// surface.hspline.json, surface.ply, attributes_1.hspline.json and so on (three attributes each),
// report.html and timing.json; the same bytes for the same input, timing.json apart. Returns
// lines that a user should be told.
std::vector<std::string> WritePointFit(const PointFitOptions& options, const PointSource& source,
                                       const PointFit& result, OutputFolder& folder,
                                       const RunContext& context);

}  // namespace semblance
