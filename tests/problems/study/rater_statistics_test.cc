// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/rater_statistics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "surfaces/base/error.h"
#include "surfaces/base/random.h"

namespace semblance::problems {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

std::vector<int> RandomRanking(Random& random, int n) {
  std::vector<int> ranks(static_cast<std::size_t>(n));
  std::iota(ranks.begin(), ranks.end(), 1);
  random.Shuffle(ranks);
  return ranks;
}

std::vector<RaterQuestion> RandomQuestions(Random& random, int questions, int raters) {
  std::vector<RaterQuestion> all;
  for (int q = 0; q < questions; ++q) {
    const int pool = 3 + static_cast<int>(random.Index(3));
    RaterQuestion question{.name = "q", .own = static_cast<int>(random.Index(pool))};
    for (int r = 0; r < raters; ++r) {
      question.ranks.push_back(RandomRanking(random, pool));
    }
    all.push_back(question);
  }
  return all;
}

// Counts every choice of the right persons.
struct Enumeration {
  double choices = 0, hits_as_good = 0, ranks_as_good = 0, hit_sum = 0, rank_sum = 0;
};
void Enumerate(const std::vector<RaterQuestion>& all, std::size_t next, int hits, int ranks,
               const RaterStatistics& s, Enumeration& found) {
  if (next == all.size()) {
    ++found.choices;
    found.hits_as_good += hits >= s.hits ? 1 : 0;
    found.ranks_as_good += ranks <= std::lround(s.mean_rank * s.answers) ? 1 : 0;
    found.hit_sum += hits;
    found.rank_sum += ranks;
    return;
  }
  for (std::size_t own = 0; own < all[next].ranks[0].size(); ++own) {
    int more_hits = 0, more_ranks = 0;
    for (const auto& ranks_of_rater : all[next].ranks) {
      more_hits += ranks_of_rater[own] == 1 ? 1 : 0;
      more_ranks += ranks_of_rater[own];
    }
    Enumerate(all, next + 1, hits + more_hits, ranks + more_ranks, s, found);
  }
}

TEST(RaterStatistics, ProbabilitiesAreThoseOfAllChoicesOfTheRightPersons) {
  Random random(3);
  for (int k = 0; k < 20; ++k) {
    const auto questions = RandomQuestions(random, 5, 1 + k % 3);
    const RaterStatistics s = SummarizeRaters(questions);
    Enumeration found;
    Enumerate(questions, 0, 0, 0, s, found);
    EXPECT_NEAR(s.hit_p, found.hits_as_good / found.choices, 1e-12);
    EXPECT_NEAR(s.rank_p, found.ranks_as_good / found.choices, 1e-12);
    EXPECT_NEAR(s.chance_hit_rate, found.hit_sum / found.choices / s.answers, 1e-12);
    EXPECT_NEAR(s.chance_rank, found.rank_sum / found.choices / s.answers, 1e-12);
  }
}

TEST(RaterStatistics, OneRaterInPoolsOfOneSizeIsBinomial) {
  std::vector<RaterQuestion> questions;
  for (int q = 0; q < 6; ++q) {
    questions.push_back({.name = "q", .own = q < 4 ? 0 : 1, .ranks = {{1, 2, 3, 4}}});
  }
  const RaterStatistics s = SummarizeRaters(questions);
  EXPECT_EQ(s.hits, 4);
  EXPECT_DOUBLE_EQ(s.mean_rank, 8.0 / 6);
  EXPECT_NEAR(s.chance_hit_rate, 0.25, 1e-15);
  EXPECT_NEAR(s.chance_rank, 2.5, 1e-14);
  // 4, 5 or 6 successes of 6 with probability 1/4.
  EXPECT_NEAR(s.hit_p, (15 * 9 + 6 * 3 + 1) / 4096.0, 1e-14);
}

TEST(RaterStatistics, RatersWhoShareATasteAreNoFurtherEvidence) {
  RaterQuestion question{.name = "q", .own = 0, .ranks = {{1, 2, 3, 4, 5}}};
  const double one = SummarizeRaters({&question, 1}).rank_p;
  question.ranks.assign(30, question.ranks[0]);
  const RaterStatistics many = SummarizeRaters({&question, 1});
  EXPECT_NEAR(one, 0.2, 1e-15);
  EXPECT_NEAR(many.rank_p, 0.2, 1e-15);
  EXPECT_NEAR(many.agreement, 1, 1e-15);
}

// P(X >= k) by multiplying terms, from the smallest power up.
double Tail(int k, int n, double p) {
  double term = std::pow(1 - p, n), tail = 0;
  for (int x = 0; x <= n; ++x) {
    tail += x >= k ? term : 0;
    term *= (n - x) * p / ((x + 1) * (1 - p));
  }
  return tail;
}

TEST(RaterStatistics, TheIntervalHasItsTails) {
  for (const int n : {1, 2, 7, 20, 60}) {
    for (int hits = 0; hits <= n; ++hits) {
      const Interval interval = ExactInterval_95(hits, n);
      if (hits > 0) {
        EXPECT_NEAR(Tail(hits, n, interval.low), 0.025, 1e-9);
      }
      if (hits < n) {
        EXPECT_NEAR(1 - Tail(hits + 1, n, interval.high), 0.025, 1e-9);
      }
    }
  }
  EXPECT_EQ(ExactInterval_95(0, 10).low, 0);
  EXPECT_NEAR(ExactInterval_95(0, 10).high, 1 - std::pow(0.025, 0.1), 1e-12);
  EXPECT_EQ(ExactInterval_95(10, 10).high, 1);
}

TEST(RaterStatistics, AgreementOfOppositeRankingsIsZero) {
  EXPECT_NEAR(KendallW({{1, 2, 3}, {3, 2, 1}}), 0, 1e-15);
  // Rank sums 4, 5, 9 of three raters: S = 4 + 1 + 9, W = 12 S / (9 * 24).
  EXPECT_NEAR(KendallW({{1, 2, 3}, {2, 1, 3}, {1, 2, 3}}), 12 * 14.0 / 216, 1e-15);
}

TEST(RaterStatistics, RefusesWhatIsNoRanking) {
  const auto with = [](std::vector<int> ranks, int own) {
    return std::vector<RaterQuestion>{{.name = "q7", .own = own, .ranks = {std::move(ranks)}}};
  };
  EXPECT_THAT(
      [&] {
        SummarizeRaters(with({1, 1, 3}, 0));
      },
      ThrowsMessage<InputError>(HasSubstr("question 'q7'")));
  EXPECT_THAT(
      [&] {
        SummarizeRaters(with({1, 2, 3}, 3));
      },
      ThrowsMessage<InputError>(HasSubstr("correct the key")));
  EXPECT_TRUE(std::isnan(SummarizeRaters({}).hit_rate));
}

}  // namespace
}  // namespace semblance::problems
