// SPDX-License-Identifier: GPL-3.0-or-later
// `semblance raters`: a page on which people match recovered faces with the faces of a pool, and
// what they answered.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "problems/study/rater_statistics.h"
#include "surfaces/base/run_context.h"

namespace semblance::problems {

struct RaterPageOptions {
  std::vector<std::filesystem::path> runs;    // folders of runs with a true skin: one question each
  std::vector<std::filesystem::path> others;  // further runs, whose true skins only fill the pools
  int pool = 6;                               // faces in a pool, 2 to 9: the right one and others
  std::uint64_t random_seed = 1;
};

struct RaterPage {
  std::string html;  // one file that needs no network
  std::string key;   // CSV question,candidate,person,is_own: for the person who scores
};

// Each question shows the recovered face of a run (its head's skin, if it has a head, would show
// ears that were never seen, so the face alone) above a pool: the true skin of its person and true
// skins of others. All are cut at one distance from nasion and shown from two sides in one pose,
// turned by up to 4 degrees at random, so that neither the pose nor the end of a scan betrays
// them. Questions, pools and codes are drawn from random_seed; the page contains no key. The same
// input gives the same bytes. Throws InputError for a pool that is too large for the persons, for
// two runs of one name, and for options out of range; IoError for a folder without a face, true
// skin or markers.
RaterPage MakeRaterPage(const RaterPageOptions& options, const RunContext& context);

// Reads the key and the answers: CSV with the columns rater,question,candidate,rank, as the page
// saves them, one file or several. Throws IoError, naming file and line, for unknown questions and
// candidates and for repeated answers; InputError for an answer that ranks only a part of a pool.
std::vector<RaterQuestion> ReadRaterAnswers(const std::filesystem::path& key,
                                            const std::vector<std::filesystem::path>& answers);

// The statistics as a table of two columns: quantity,value.
std::string RaterStatisticsCsv(const RaterStatistics& statistics);

}  // namespace semblance::problems
