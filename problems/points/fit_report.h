// SPDX-License-Identifier: GPL-3.0-or-later
// The report of a fit of points: in words, as JSON, and as the files of its folder.
#pragma once

#include <array>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "fitting/nested/nested_fit.h"
#include "problems/io/given_files.h"
#include "problems/io/output_folder.h"
#include "problems/points/point_fit.h"
#include "surfaces/base/run_context.h"

namespace semblance::problems {

nlohmann::ordered_json AutoJson(const AutoReport& report);

// Returns a few lines about noise, outliers, and whether denser points would show more detail.
// unit: of lengths, or empty.
std::string AutoText(const AutoReport& report, std::string_view unit = "");

// Returns a sentence about the moves of (u,v) before the fit.
std::string MovesText(const FootMoves& moves, std::string_view unit = "");

// The files that WritePointFit may write (given_files.h).
inline constexpr std::array<std::string_view, 9> kPointFitFiles = {
    "resolved.yaml", "surface.hspline.json", "surface.ply",
    "residuals.csv", "residuals.ply",        "attributes_*.hspline.json",
    "report.html",   "timing.json",          "result.json"};

// The files that not every fit writes, with words near their beginning by which they are
// recognised.
inline constexpr std::array<FileMark, 4> kPointFitMarks = {
    FileMark{R"(residuals\.csv)", "residual_mm"}, FileMark{R"(residuals\.ply)", "residual_mm"},
    FileMark{R"(attributes_\d+\.hspline\.json)", "semblance-hspline"},
    FileMark{R"(report\.html)", "An H-spline surface through"}};

// Writes resolved.yaml, result.json, residuals.csv or .ply (in the order of the table),
// surface.hspline.json, surface.ply, attributes_1.hspline.json and so on (one per attribute),
// report.html and timing.json. The same input gives the same bytes, except in timing.json. Returns
// lines for the terminal.
std::vector<std::string> WritePointFit(const PointFitOptions& options, const PointSource& source,
                                       const PointFit& result, OutputFolder& folder,
                                       const RunContext& context);

}  // namespace semblance::problems
