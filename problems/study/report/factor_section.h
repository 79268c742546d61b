// SPDX-License-Identifier: GPL-3.0-or-later
// The parts of a study's report on its factors: what each axis of a grid does by itself, and
// whether its effect depends on another axis.
#pragma once

#include <vector>

#include "problems/report/report_kit.h"
#include "problems/study/report/study_factors.h"
#include "problems/study/study_tables.h"

namespace semblance::problems {

// For two factors or more an open section: the metric's means as lines over an ordered factor (in
// panels for a third one), the marginal means with intervals, a heat map of two factors, and a
// table of effects with their tests; and a folded one: a pivot table and the marginal means in
// numbers. For one ordered factor, its line alone. All are over the subjects that have every
// combination. Below six such subjects the effects have no p. If the factors cannot be separated,
// the section states why. Empty for a study without a factor to show.
std::vector<ReportSection> FactorSections(const StudyResults& results, const FactorGrid& grid);

}  // namespace semblance::problems
