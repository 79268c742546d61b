// SPDX-License-Identifier: GPL-3.0-or-later
// The results of a study as an SQLite database.
#pragma once

#include <string>

#include "problems/study/study_tables.h"

namespace semblance::problems {

// The bytes of an SQLite file with STRICT tables, the same for the same results:
//   study(title, plan, metric)                    one row
//   axis(position, path)                          option paths, in the order of the study
//   trial(id, position, subject, status, reason)  in the order of the plan
//   setting(trial, axis, value)                   a trial's value on an axis (axis.position)
//   metric(trial, name, value)                    by dotted path in result.json
//   tag(word)                                     the tags of the study
// Throws InputError if SQLite fails.
std::string ResultsSqlite(const StudyResults& results);

}  // namespace semblance::problems
