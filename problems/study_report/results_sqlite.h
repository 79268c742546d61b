// SPDX-License-Identifier: GPL-3.0-or-later
// A study's results as a database, for those who would rather ask than read.
#pragma once

#include <string>

#include "problems/study/study_tables.h"

namespace semblance {

// The bytes of an SQLite file with STRICT tables, the same for the same results:
//   study(title, plan, metric)                    one row
//   axis(position, path)                          option paths, in the order of the study
//   trial(id, position, subject, status, reason)  in the order of the plan
//   setting(trial, axis, value)                   what a trial sets on an axis (axis.position)
//   metric(trial, name, value)                    by dotted path in result.json
//   tag(word)                                     of the study
// Throws InputError if SQLite cannot make it.
std::string ResultsSqlite(const StudyResults& results);

}  // namespace semblance
