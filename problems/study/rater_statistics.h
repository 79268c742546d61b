// SPDX-License-Identifier: GPL-3.0-or-later
// Statistics of a study in which people match recovered faces with the faces of a pool.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "problems/experiment/metrics/statistics.h"

namespace semblance::problems {

// One recovered face and its pool.
struct RaterQuestion {
  std::string name;
  int own = -1;  // index of the right person among the candidates
  // One row per answer: the rank 1 .. n of each of the n >= 2 candidates, 1 for the most alike.
  std::vector<std::vector<int>> ranks = {};
};

struct RaterStatistics {
  int questions = 0;       // with at least one answer
  int answers = 0;         // rankings of a pool by a rater
  int hits = 0;            // answers that rank the right person first
  double hit_rate = kNaN;  // hits / answers
  Interval hit_95;         // exact (Clopper & Pearson 1934), as if answers were independent
  double chance_hit_rate = kNaN;
  double hit_p = kNaN;
  double mean_rank = kNaN;  // of the right person
  double chance_rank = kNaN;
  double rank_p = kNaN;
  double agreement = kNaN;  // mean of Kendall's W over questions with two answers or more
};

// p-values are exact and one-sided: the probability of at least so many hits, or of at most such a
// mean rank, if the right person were any candidate of the pool with equal probability, while all
// rankings stay as they are. So raters may share a taste and one rater may answer many questions;
// questions must be independent. NaN where there is no answer. Throws InputError, naming the
// question, if a ranking is not 1 .. n or `own` is none of the candidates.
RaterStatistics SummarizeRaters(std::span<const RaterQuestion> questions);

// The exact 95 % interval of a probability after `hits` successes in `n` trials, 0 <= hits <= n,
// n >= 1 (Clopper & Pearson 1934).
Interval ExactInterval_95(int hits, int n);

// Kendall's coefficient of concordance of m >= 2 rankings of n >= 2 candidates: 1 if all rankings
// are the same, about 1 / m if they are random.
double KendallW(const std::vector<std::vector<int>>& ranks);

}  // namespace semblance::problems
