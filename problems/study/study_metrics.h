// SPDX-License-Identifier: GPL-3.0-or-later
// The numbers that a trial can have, known before any has run.
#pragma once

#include <set>
#include <string>

#include "problems/study/study_file.h"

namespace semblance {

// By dotted path, as in trials.csv. What is there for each landmark, feature and left-out site is
// left out: which there are, a subject decides.
std::set<std::string> MetricsOf(StudyJob job);

// What is wrong with it, and what may be meant; empty where a trial of the job can have the metric.
std::string ComplaintAboutMetric(const std::string& metric, StudyJob job);

// Whether the metric measures against the true skin, so that a subject without one has no such
// number.
bool NeedsTrueSkin(const std::string& metric);

// Which of its values are better: higher of shares within a distance, as face.within_2_5mm; of all
// others lower.
Better BetterOf(const std::string& metric);

}  // namespace semblance
