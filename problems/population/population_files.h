// SPDX-License-Identifier: GPL-3.0-or-later
// The files that a population comes to.
#pragma once

#include <array>
#include <string_view>

#include "problems/output/output_folder.h"
#include "problems/population/population_result.h"

namespace semblance {

// What WritePopulation writes.
inline constexpr std::array<std::string_view, 9> kPopulationFiles = {
    "table.yaml", "depths.csv", "subjects.csv",    "outliers.csv", "leave_one_out.csv",
    "dense.csv",  "dense.ply",  "population.json", "report.html"};

// table.yaml, depths.csv, subjects.csv, outliers.csv, leave_one_out.csv, dense.csv, dense.ply,
// population.json and report.html; the same bytes for the same result.
void WritePopulation(const PopulationResult& result, OutputFolder& folder);

// subjects.csv alone, where there is no table: who was measured, and why the others were not.
void WriteSubjects(const std::vector<MeasuredSubject>& subjects, OutputFolder& folder);

}  // namespace semblance
