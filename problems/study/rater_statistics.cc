// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/rater_statistics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

void CheckQuestion(const RaterQuestion& question) {
  for (const std::vector<int>& ranks : question.ranks) {
    const int n = static_cast<int>(ranks.size());
    std::vector<int> sorted = ranks, expected(ranks.size());
    std::ranges::sort(sorted);
    std::iota(expected.begin(), expected.end(), 1);
    if (sorted != expected || n < 2 || ranks.size() != question.ranks.front().size()) {
      throw InputError(fmt::format(
          "question '{}': an answer does not rank its candidates from 1 to {}; rank each candidate "
          "once",
          question.name, question.ranks.front().size()));
    }
    if (question.own < 0 || question.own >= n) {
      throw InputError(fmt::format(
          "question '{}': the right person is none of its {} candidates; correct the key",
          question.name, n));
    }
  }
}

// The probability of each sum over questions.
using Distribution = std::map<int, double>;

// Adds a question whose contribution is one of `values` with equal probability.
Distribution Convolved(const Distribution& sums, const std::vector<int>& values) {
  Distribution result;
  for (const auto& [sum, probability] : sums) {
    for (const int value : values) {
      result[sum + value] += probability / static_cast<double>(values.size());
    }
  }
  return result;
}

// For each candidate of a question, the sum over answers of score(rank).
template <class Score>
std::vector<int> SumsByCandidate(const RaterQuestion& question, Score score) {
  std::vector<int> sums(question.ranks.front().size(), 0);
  for (const std::vector<int>& ranks : question.ranks) {
    for (std::size_t c = 0; c < sums.size(); ++c) {
      sums[c] += score(ranks[c]);
    }
  }
  return sums;
}

template <class Score>
Distribution ChanceOf(std::span<const RaterQuestion> questions, Score score) {
  Distribution sums = {{0, 1.0}};
  for (const RaterQuestion& question : questions) {
    if (!question.ranks.empty()) {
      sums = Convolved(sums, SumsByCandidate(question, score));
    }
  }
  return sums;
}

double Mean(const Distribution& sums) {
  double mean = 0;
  for (const auto& [sum, probability] : sums) {
    mean += sum * probability;
  }
  return mean;
}

template <class Condition>
double ProbabilityThat(const Distribution& sums, Condition condition) {
  double total = 0;
  for (const auto& [sum, probability] : sums) {
    total += condition(sum) ? probability : 0;
  }
  return std::min(1.0, total);
}

int Hit(int rank) { return rank == 1 ? 1 : 0; }
int Rank(int rank) { return rank; }

// P(X >= k) for X binomial of n trials.
double UpperTail(int k, int n, double probability) {
  double tail = 0;
  for (int x = k; x <= n; ++x) {
    tail += std::exp(std::lgamma(n + 1) - std::lgamma(x + 1) - std::lgamma(n - x + 1) +
                     (x > 0 ? x * std::log(probability) : 0) +
                     (x < n ? (n - x) * std::log1p(-probability) : 0));
  }
  return tail;
}

// The probability at which P(X >= k) is `tail`, by bisection: the tail grows with it.
double ProbabilityOfTail(int k, int n, double tail) {
  double low = 0, high = 1;
  for (int step = 0; step < 100; ++step) {
    const double middle = (low + high) / 2;
    (UpperTail(k, n, middle) < tail ? low : high) = middle;
  }
  return (low + high) / 2;
}

double MeanAgreement(std::span<const RaterQuestion> questions) {
  double sum = 0;
  int count = 0;
  for (const RaterQuestion& question : questions) {
    if (question.ranks.size() >= 2) {
      sum += KendallW(question.ranks);
      ++count;
    }
  }
  return count == 0 ? kNaN : sum / count;
}

}  // namespace

Interval ExactInterval_95(int hits, int n) {
  constexpr double kTail = 0.025;
  return {.low = hits == 0 ? 0 : ProbabilityOfTail(hits, n, kTail),
          .high = hits == n ? 1 : ProbabilityOfTail(hits + 1, n, 1 - kTail)};
}

double KendallW(const std::vector<std::vector<int>>& ranks) {
  const double m = static_cast<double>(ranks.size()), n = static_cast<double>(ranks.front().size());
  double squares = 0;
  for (std::size_t c = 0; c < ranks.front().size(); ++c) {
    double sum = 0;
    for (const std::vector<int>& row : ranks) {
      sum += row[c];
    }
    squares += std::pow(sum - m * (n + 1) / 2, 2);
  }
  return 12 * squares / (m * m * (n * n * n - n));
}

RaterStatistics SummarizeRaters(std::span<const RaterQuestion> questions) {
  RaterStatistics s;
  int rank_sum = 0;
  for (const RaterQuestion& question : questions) {
    CheckQuestion(question);
    s.questions += question.ranks.empty() ? 0 : 1;
    for (const std::vector<int>& ranks : question.ranks) {
      const int rank = ranks[static_cast<std::size_t>(question.own)];
      ++s.answers;
      s.hits += Hit(rank);
      rank_sum += rank;
    }
  }
  if (s.answers == 0) {
    return s;
  }
  const Distribution hits = ChanceOf(questions, &Hit), sums = ChanceOf(questions, &Rank);
  s.hit_rate = static_cast<double>(s.hits) / s.answers;
  s.hit_95 = ExactInterval_95(s.hits, s.answers);
  s.chance_hit_rate = Mean(hits) / s.answers;
  s.hit_p = ProbabilityThat(hits, [&](int sum) { return sum >= s.hits; });
  s.mean_rank = static_cast<double>(rank_sum) / s.answers;
  s.chance_rank = Mean(sums) / s.answers;
  s.rank_p = ProbabilityThat(sums, [&](int sum) { return sum <= rank_sum; });
  s.agreement = MeanAgreement(questions);
  return s;
}

}  // namespace semblance::problems
